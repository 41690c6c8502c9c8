//! Doors by hand: `cargo run --profile fuzz -p osl-tests --example door -- COMMAND`.
//!
//! ```text
//! list               the doors
//! seeds DOOR FOLDER  writes the seed inputs of a door, for a fuzzer
//! one DOOR FILE      runs a door on a file, and prints the outcome
//! program FILE       prints the program that the doors of programs make of a file
//! ```

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "what a program for people does")]

use osl_tests::doors::{self, Door};
use std::process::ExitCode;

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = args.iter().map(String::as_str).collect();
    match run(&words) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::from(2)
        }
    }
}

fn run(words: &[&str]) -> Result<(), String> {
    let door = |name: &str| -> Result<&'static Door, String> {
        doors::find(name).ok_or_else(|| format!("there is no door {name}; `list` has them"))
    };
    let bytes = |file: &str| std::fs::read(file).map_err(|error| format!("{file}: {error}"));
    match *words {
        ["list"] => doors::ALL.iter().for_each(|door| println!("{:<12} {}", door.name, door.what)),
        ["seeds", name, folder] => {
            for (number, seed) in (door(name)?.seeds)().iter().enumerate() {
                let path = format!("{folder}/seed-{number}");
                std::fs::write(&path, seed).map_err(|error| format!("{path}: {error}"))?;
            }
        }
        ["one", name, file] => {
            let (door, bytes) = (door(name)?, bytes(file)?);
            let began = std::time::Instant::now();
            let came_to = (door.enter)(&bytes);
            println!("{came_to:016x} in {:.2} s", began.elapsed().as_secs_f64());
        }
        ["program", file] => print!("{}", osl_tests::generate::program(&bytes(file)?)),
        _ => return Err("the commands are list, seeds DOOR FOLDER, one DOOR FILE, program FILE".to_string()),
    }
    Ok(())
}
