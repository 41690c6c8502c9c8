//! Every door, a fixed number of inputs each: no panic, no execution of more than five seconds.
//!
//! `cargo run --profile fuzz -p osl-tests --example fuzz` goes on for as long as one likes (`tests/fuzz/README.md`). What it finds is mended,
//! and its input becomes one of those below.

#![allow(
    clippy::panic,
    clippy::unwrap_used,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl_tests::doors;
use osl_tests::fuzz::drive::{Bounds, Until, drive};

/// Changed inputs of a door, always the same ones.
fn open(name: &str) {
    let door = doors::find(name).unwrap_or_else(|| panic!("no door {name}"));
    let mut wrong = Vec::new();
    // Tests run side by side in one process, whose memory says nothing of one of them; a build for tests is slow.
    let bounds = Bounds { megabytes: f64::INFINITY, seconds: 5.0 };
    let tally = drive(door, (1, Until::Runs(door.runs), bounds), None, &mut |_| (), &mut |input, what| {
        wrong.push(format!("{what}\n{}", String::from_utf8_lossy(input)));
    });
    println!(
        "{name}: {} executions, worst {:.2} s, all {:.1} s",
        tally.executions, tally.worst, tally.seconds
    );
    assert!(wrong.is_empty(), "{} of {} are wrong, the first:\n{}", wrong.len(), tally.executions, wrong[0]);
}

macro_rules! doors {
    ($($name:ident)*) => {
        $(#[test] fn $name() { open(stringify!($name)); })*

        #[test]
        fn all_doors_are_opened() {
            let names: Vec<&str> = doors::ALL.iter().map(|door| door.name).collect();
            assert_eq!(names, [$(stringify!($name)),*]);
        }
    };
}

doors! {
    parse mutate fmt generate compiled told oso group attributes textures scene testrender arguments
}

/// Inputs that once broke something: the door, what was wrong, and the input.
const ONCE_WRONG: &[(&str, &str, &[u8])] = &[];

#[test]
fn once_wrong() {
    for (door, what, input) in ONCE_WRONG {
        let door = doors::find(door).unwrap();
        println!("{}: {what}", door.name);
        (door.enter)(input);
    }
}
