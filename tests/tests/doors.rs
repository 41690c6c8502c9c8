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
const ONCE_WRONG: &[(&str, &str, &[u8])] = &[
    (
        "lod",
        "a mean of 1e30 was written as an int, which is out of range",
        b"\x14\x5c\xae\xc6\x1b\xdb\xd5\x5d\xba\x04\xe6\x07\x1a\xd0\x57\x58\x52\xd9\xee\x61\xf4\x8a\xbf\x4d\
          \x44\x7b\x14\x36\x5a\xda\xb1\x8f\x64\xe6\x37\x85\xcb\xe0\x93\x9b\x97\xda\xb1\x60\x1a\xa9\xad\xdd\
          \x37\xb3\x64\xbc\x9b\x67\xd7\xe5\x3d\x05\x5a\xf7\x71\x70\x74\x3c\x26\xc8\x28\xf1\x33",
    ),
    (
        "lod",
        "a mean of 1e30 was written as an int, which is out of range",
        b"\xc6\x55\x59\x18\x73\x8e\x5a\xaf\x7a\xef\x02\x5c\xc2\xc0\x14\xf4\xd8\xcf\xcd\x72\x99\x87\xb2\x30\
          \xb3\x73\xf4\xf5\x65\xd0\x8d\xad\x53\x35\xab\x94\x02\xd9\x10\xc8\xa8\x07\x24\x92\x3b\xd0\xa7\x2a\
          \xc4\xa7\xa9\xba\x66\x85\x50\xad\xe5\xd5\x96\x92\x7e\x33\xcc\xcd\x07\xb3\xe8\x8c\x3a\xe3\x25\x90\
          \xdc\xfd\xa8\x75\xdb\xaa\xa5\xba\xd1\x85\x9d\xdc\xc5\x57\x57\xc5\x80\xdb\xc5\xe6\xbc\xa4\x3f\x02\
          \xfa\x59\xa7\x99\x6e",
    ),
];

#[test]
fn once_wrong() {
    for (door, what, input) in ONCE_WRONG {
        let door = doors::find(door).unwrap();
        println!("{}: {what}", door.name);
        (door.enter)(input);
    }
}
