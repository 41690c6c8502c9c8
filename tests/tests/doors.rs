//! Runs every door on a fixed number of inputs: no panic, and no execution of more than five seconds.
//!
//! `cargo run --profile fuzz -p osl-tests --example fuzz` runs for any time (`tests/fuzz/README.md`). When it
//! finds a bug, the bug is fixed and its input is added to the list below.

#![allow(
    clippy::panic,
    clippy::unwrap_used,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl_tests::doors;
use osl_tests::fuzz::drive::{Bounds, Until, drive};

/// Runs a door on mutated inputs, which are the same in every run.
fn open(name: &str) {
    let door = doors::find(name).unwrap_or_else(|| panic!("no door {name}"));
    let mut wrong = Vec::new();
    // Tests run in parallel in one process, so its memory cannot be attributed to one of them; test builds
    // are slow.
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
    parse mutate fmt generate compiled told bounds lod oso group attributes textures scene testrender arguments
}

/// Inputs that once failed: the door, the failure, and the input.
const ONCE_WRONG: &[(&str, &str, &[u8])] = &[];

#[test]
fn once_wrong() {
    for (door, what, input) in ONCE_WRONG {
        let door = doors::find(door).unwrap();
        println!("{}: {what}", door.name);
        (door.enter)(input);
    }
}
