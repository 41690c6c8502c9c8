//! Processor time per point of the shaders of `seeds`, and of others that resemble published ones: on one
//! thread for each instruction set, and on all threads; in a table and as JSON. All columns of a shader are
//! measured in turns, so that other work on the machine slows each of them. Expect: wider instruction sets
//! and more threads are never slower.
//!
//! ```sh
//! cargo bench -p oslrun --bench suite -- [--rounds N] [--json FILE] [--interpreted] [PART OF A NAME]
//! ```
//!
//! The columns for one thread and for all threads have the time of the clock, whose ratio is the gain of
//! threads. `--interpreted` also measures the widest instruction set without machine code. The whole takes
//! about two minutes.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a bench says what it finds"
)]

mod cases;

use cases::{CASES, Case, MORE, services};
use osl_exec::{Isa, Native, PointSource, Program, RunOptions, Services};
use osl_scene::Grid;
use std::fmt::Write;
use std::time::{Duration, Instant};

/// Least time of a sample.
const SAMPLE: Duration = Duration::from_millis(60);
/// Shaders that take longer for a point, in nanoseconds, run on a smaller grid.
const SLOW: f64 = 300.0;

/// The processor time of this thread, in nanoseconds; elsewhere than on Linux, the time since `start`.
fn processor_time(start: Instant) -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let time = text.and_then(|text| text.split_whitespace().next()?.parse().ok());
    time.unwrap_or_else(|| start.elapsed().as_nanos() as f64)
}

/// A column of the table.
struct Column {
    name: String,
    options: RunOptions,
    /// Whether the time is that of the clock.
    by_clock: bool,
}

impl Column {
    fn new(name: &str, isa: Isa, native: Native, threads: Option<usize>) -> Column {
        let options = RunOptions { isa, native, threads, ..RunOptions::default() };
        Column { name: name.to_string(), options, by_clock: false }
    }

    /// Nanoseconds per point of some runs.
    fn sample(&self, program: &Program, grid: &Grid, services: &Services) -> f64 {
        let (start, mut runs) = (Instant::now(), 0);
        let before = processor_time(start);
        while runs == 0 || start.elapsed() < SAMPLE {
            osl_exec::run(program, services, grid, &self.options, &|_| ()).expect("a frame");
            runs += 1;
        }
        let time =
            if self.by_clock { start.elapsed().as_nanos() as f64 } else { processor_time(start) - before };
        time / (runs * grid.count()) as f64
    }
}

/// The columns: each instruction set on one thread; one thread and all of them by the clock; and the widest
/// instruction set without machine code, if it is wanted.
fn columns(interpreted: bool) -> Vec<Column> {
    let one = |isa: Isa, native| Column::new(isa.name(), isa, native, Some(1));
    let mut columns: Vec<Column> = Isa::all().into_iter().map(|isa| one(isa, Native::Recurring)).collect();
    let widest = Isa::detect();
    for (name, threads) in [("one thread", Some(1)), ("all threads", None)] {
        columns.push(Column { by_clock: true, ..Column::new(name, widest, Native::Recurring, threads) });
    }
    if interpreted {
        columns.push(Column { name: "interpreted".into(), ..one(widest, Native::Never) });
    }
    columns
}

/// The medians of all columns for a shader.
fn measure(case: &Case, columns: &[Column], services: &Services, rounds: usize) -> Vec<f64> {
    let small = Grid::new(256, 256);
    let program = case.compile(&case.text(), &small);
    // The first run makes the code.
    columns.iter().for_each(|column| _ = column.sample(&program, &small, services));
    let slow = columns.first().is_some_and(|column| column.sample(&program, &small, services) > SLOW);
    let grid = if slow { small } else { Grid::new(1024, 1024) };
    let mut samples = vec![Vec::new(); columns.len()];
    for _ in 0..rounds {
        for (list, column) in samples.iter_mut().zip(columns) {
            list.push(column.sample(&program, &grid, services));
        }
    }
    samples.into_iter().map(median).collect()
}

fn median(mut list: Vec<f64>) -> f64 {
    list.sort_by(f64::total_cmp);
    list.get(list.len() / 2).copied().unwrap_or(f64::NAN)
}

/// What the words of the command line say.
struct Wish {
    rounds: usize,
    json: Option<String>,
    interpreted: bool,
    part: String,
}

fn wish() -> Wish {
    let mut wish = Wish { rounds: 5, json: None, interpreted: false, part: String::new() };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            // Said by Cargo.
            "--bench" => {}
            "--rounds" => wish.rounds = words.next().and_then(|n| n.parse().ok()).expect("a number"),
            "--json" => wish.json = words.next(),
            "--interpreted" => wish.interpreted = true,
            _ => wish.part = word,
        }
    }
    wish
}

fn main() {
    let wish = wish();
    let (services, columns) = (services(), columns(wish.interpreted));
    println!("ns per point, medians of {} samples, {} threads\n", wish.rounds, rayon::current_num_threads());
    let names: Vec<&str> = columns.iter().map(|column| &*column.name).collect();
    println!("| shader | {} | gain of threads |", names.join(" | "));
    println!("|---|{}---|", "---|".repeat(names.len()));
    let mut rows = Vec::new();
    for case in CASES.iter().chain(&MORE).filter(|case| case.name.contains(&wish.part)) {
        let times = measure(case, &columns, &services, wish.rounds);
        let by_clock: Vec<f64> =
            times.iter().zip(&columns).filter(|(_, column)| column.by_clock).map(|(time, _)| *time).collect();
        let gain = by_clock.first().zip(by_clock.last()).map_or(f64::NAN, |(one, all)| one / all);
        let shown: Vec<String> = times.iter().map(|time| format!("{time:.1}")).collect();
        println!("| {} | {} | {gain:.2} |", case.name, shown.join(" | "));
        let mut row = format!("{{\"shader\": \"{}\"", case.name);
        for (name, time) in names.iter().zip(&times) {
            let _ = write!(row, ", \"{name}\": {time:.2}");
        }
        let _ = write!(row, ", \"gain\": {gain:.3}}}");
        rows.push(row);
    }
    if let Some(file) = wish.json {
        std::fs::write(&file, format!("[\n{}\n]\n", rows.join(",\n"))).expect("a file that can be written");
    }
}
