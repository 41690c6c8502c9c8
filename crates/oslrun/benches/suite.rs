//! Processor time per point of the shaders of `seeds`, on one thread, for each instruction set, with and
//! without machine code: the two in turns, so that other work on the machine slows both. Expect: never slower
//! with machine code.
//!
//! `cargo bench -p oslrun --bench suite -- [--rounds N] [--json FILE] [PART OF A NAME]`

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a bench says what it finds"
)]

mod cases;

use cases::{CASES, Case, services};
use osl_exec::{Isa, Native, PointSource, RunOptions, Services};
use osl_scene::Grid;
use std::time::{Duration, Instant};

/// Least time of a sample.
const SAMPLE: Duration = Duration::from_millis(120);
/// Shaders that take longer for a point, in nanoseconds, run on a smaller grid.
const SLOW: f64 = 300.0;

/// The processor time of this thread, in nanoseconds; elsewhere than on Linux, the time since `start`.
fn processor_time(start: Instant) -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let time = text.and_then(|text| text.split_whitespace().next()?.parse().ok());
    time.unwrap_or_else(|| start.elapsed().as_nanos() as f64)
}

/// Nanoseconds per point of some runs.
fn sample(case: &Case, grid: &Grid, services: &Services, options: &RunOptions) -> impl FnMut() -> f64 {
    let program = case.compile(&case.text(), grid);
    move || {
        let (start, mut runs) = (Instant::now(), 0);
        let before = processor_time(start);
        while runs == 0 || start.elapsed() < SAMPLE {
            osl_exec::run(&program, services, grid, options, &|_| ()).expect("a frame");
            runs += 1;
        }
        (processor_time(start) - before) / (runs * grid.count()) as f64
    }
}

fn median(mut list: Vec<f64>) -> f64 {
    list.sort_by(f64::total_cmp);
    list.get(list.len() / 2).copied().unwrap_or(f64::NAN)
}

/// What the words of the command line say.
struct Wish {
    rounds: usize,
    json: Option<String>,
    part: String,
}

fn wish() -> Wish {
    let mut wish = Wish { rounds: 7, json: None, part: String::new() };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            // Said by Cargo.
            "--bench" => {}
            "--rounds" => wish.rounds = words.next().and_then(|n| n.parse().ok()).expect("a number"),
            "--json" => wish.json = words.next(),
            _ => wish.part = word,
        }
    }
    wish
}

fn main() {
    let wish = wish();
    let services = services();
    println!("ns per point, medians of {} samples\n", wish.rounds);
    println!("| shader | instruction set | interpreted | machine code | times as fast |");
    println!("|---|---|---|---|---|");
    let mut rows = Vec::new();
    for case in CASES.iter().filter(|case| case.name.contains(&wish.part)) {
        for isa in Isa::all() {
            let options = |native| RunOptions { isa, native, threads: Some(1), ..RunOptions::default() };
            let (never, recurring) = (options(Native::Never), options(Native::Recurring));
            let small = Grid::new(256, 256);
            let slow = sample(case, &small, &services, &never)() > SLOW;
            let grid = if slow { small } else { Grid::new(1024, 1024) };
            let mut interpreted = sample(case, &grid, &services, &never);
            let mut native = sample(case, &grid, &services, &recurring);
            // The first run makes the code.
            native();
            let (mut before, mut after) = (Vec::new(), Vec::new());
            for _ in 0..wish.rounds {
                before.push(interpreted());
                after.push(native());
            }
            let ratios = before.iter().zip(&after).map(|(before, after)| before / after).collect();
            let (before, after, ratio) = (median(before), median(after), median(ratios));
            println!("| {} | {} | {before:.1} | {after:.1} | {ratio:.2} |", case.name, isa.name());
            rows.push(format!(
                "{{\"shader\": \"{}\", \"isa\": \"{}\", \"interpreted\": {before}, \"native\": {after}, \"ratio\": {ratio}}}",
                case.name,
                isa.name()
            ));
        }
    }
    if let Some(file) = wish.json {
        std::fs::write(&file, format!("[\n{}\n]\n", rows.join(",\n"))).expect("a file that can be written");
    }
}
