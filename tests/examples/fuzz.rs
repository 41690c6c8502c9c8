//! A fuzzer without further tools:
//! `cargo run --profile fuzz -p osl-tests --example fuzz -- [OPTIONS] [DOOR…]`.
//!
//! ```text
//! --time SECONDS   how long, all doors together (default 60)
//! --runs N         number of executions instead, for all doors together
//! --seed S         another seed, other inputs (default 1)
//! --threads N      processes at a time (default: all cores)
//! --folder DIR     where corpora and failing inputs are kept (default tests/fuzz/corpus/plain)
//! --seeds DIR      writes the seed inputs of the one named door, for other fuzzers
//! --one FILE       runs the one named door on a file, and prints the outcome
//! --program FILE   prints the program that the doors of programs make of a file
//! --list           the doors
//! ```
//! The exit code is 1 if an input panics, takes more than 5 s of processor time or 500 MB, or ends its
//! process.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "what a program for people does")]

use osl_tests::doors;
use osl_tests::fuzz::drive::{Bounds, Until};
use osl_tests::fuzz::parent::{self, Job};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match start(&args) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::from(2)
        }
    }
}

fn start(args: &[String]) -> Result<bool, String> {
    if args.first().is_some_and(|arg| arg == parent::WORKER) {
        return parent::work(args.get(1..).unwrap_or(&[]), &mut std::io::stdout()).map(|()| true);
    }
    let mut job = Job {
        doors: Vec::new(),
        until: Until::Time(Duration::from_secs(60)),
        seed: 1,
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        folder: PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/corpus/plain")),
        bounds: Bounds::default(),
    };
    let (mut one, mut seeds) = (None, None);
    let mut words = args.iter();
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        let wrong = |text: &str| format!("{word} takes a number, not {text}");
        match word.as_str() {
            "--time" => {
                let text = value()?;
                let seconds: f64 = text.parse().map_err(|_| wrong(text))?;
                job.until = Until::Time(Duration::try_from_secs_f64(seconds).map_err(|_| wrong(text))?);
            }
            "--runs" => {
                let text = value()?;
                job.until = Until::Runs(text.parse().map_err(|_| wrong(text))?);
            }
            "--seed" => {
                let text = value()?;
                job.seed = text.parse().map_err(|_| wrong(text))?;
            }
            "--threads" => {
                let text = value()?;
                job.threads =
                    text.parse().ok().filter(|n| (1..=256).contains(n)).ok_or_else(|| wrong(text))?;
            }
            "--folder" => job.folder = PathBuf::from(value()?),
            "--one" => one = Some(value()?.clone()),
            "--program" => {
                let file = value()?;
                let bytes = std::fs::read(file).map_err(|e| format!("{file}: {e}"))?;
                print!("{}", osl_tests::generate::program(&bytes));
                return Ok(true);
            }
            "--seeds" => seeds = Some(PathBuf::from(value()?)),
            "--list" => {
                doors::ALL.iter().for_each(|door| println!("{:<12} {}", door.name, door.what));
                return Ok(true);
            }
            name => {
                job.doors.push(doors::find(name).ok_or_else(|| format!("there is no door {name}; --list"))?)
            }
        }
    }
    if let Some(folder) = seeds {
        let [door] = job.doors.as_slice() else {
            return Err("--seeds takes the name of one door".to_string());
        };
        for (number, seed) in (door.seeds)().iter().enumerate() {
            let path = folder.join(format!("seed-{number}"));
            std::fs::write(&path, seed).map_err(|e| format!("{}: {e}", path.display()))?;
        }
        return Ok(true);
    }
    if let Some(file) = one {
        let [door] = job.doors.as_slice() else { return Err("--one takes the name of one door".to_string()) };
        let bytes = std::fs::read(&file).map_err(|e| format!("{file}: {e}"))?;
        let began = std::time::Instant::now();
        let came_to = (door.enter)(&bytes);
        println!("{came_to:016x} in {:.2} s", began.elapsed().as_secs_f64());
        return Ok(true);
    }
    if job.doors.is_empty() {
        job.doors = doors::ALL.iter().collect();
    }
    std::fs::create_dir_all(&job.folder).map_err(|e| format!("{}: {e}", job.folder.display()))?;
    Ok(parent::run(&job, &mut |line| println!("{line}")))
}
