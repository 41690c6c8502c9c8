//! Whether `--max-error` keeps its promise, and at what cost: 71 shaders, three sizes, two errors (shares
//! of each output's range) and three sample patterns. The truth is 1024 to 4096 samples at 16384 pixels. The
//! cost is compared with the cheapest fixed setting (a shading rate, or a number of samples) that keeps the
//! error at 99.9 % of these pixels, found by trying all. Both are timed in turns on one thread. Aims: kept in
//! 98 % of the cases that any fixed setting can keep; at most 1.2 times the evaluations in 90 % of them; at
//! most 1.1 times the time in the median, and less than twice in 90 %.
//!
//! ```sh
//! cargo bench -p oslrun --bench max_error -- [--file F] [--size N] [--seed N] [--commands] [--table]
//!     [--counts [--against F]] [NAME]
//! ```
//!
//! `--size` may name another size than the three. `--commands` measures the same cases as whole commands, by
//! the clock: the results must be there already. `--counts` measures neither times nor fixed settings, and
//! knows the truth at 4096 pixels only; it prints how many bounds are kept, and compares the evaluations with
//! the results of another file (`--against`), such as those of an earlier state of the driver.
//!
//! Truths and best settings are kept in `target/max_error`. The first run takes half an hour on one core,
//! later ones a quarter of one. The results are added to a file there (`--file` names another one), and a
//! case that it has is not measured again. `--table` measures nothing and prints the tables of
//! docs/accuracy.md.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

#[path = "../cases/mod.rs"]
mod cases;
mod commands;
mod shaders;
mod table;
mod truth;

use osl_exec::{RunOptions, Services};
use osl_measure::sample::{Filter, Image, Pattern, Shading, max_error_each};
use osl_scene::Grid;
use shaders::{Compiled, Shader, root, shaders};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;
use table::Measured;
use truth::{Fixed, Truth};

const SIDES: [usize; 3] = [128, 256, 384];
const ERRORS: [f32; 2] = [0.05, 0.02];
const SEEDS: [u32; 3] = [0, 1, 2];
/// Maximum number of samples per pixel.
const MOST: u32 = 4096;
/// Runs of each of the two images, the fastest of which count, unless they take long. **Units:**
/// milliseconds.
const RUNS: usize = 5;
const LONG: f64 = 100.0;

/// What to measure.
struct Selection {
    /// Measures one small case of each shader, to see that the bench works.
    quick: bool,
    table: bool,
    /// Measures whole commands.
    commands: bool,
    /// Measures neither times nor fixed settings, and compares with the results in this file.
    counts: bool,
    against: Option<PathBuf>,
    file: PathBuf,
    folder: PathBuf,
    part: Option<String>,
    side: Option<usize>,
    seed: Option<u32>,
}

impl Selection {
    fn of(arguments: &[String]) -> Selection {
        let value = |name: &str| {
            let at = arguments.iter().position(|a| a == name)?;
            arguments.get(at + 1).cloned()
        };
        let is = |name: &str| arguments.iter().any(|a| a == name);
        let after_option = |at: usize| {
            at > 0 && ["--file", "--size", "--seed", "--against"].contains(&arguments[at - 1].as_str())
        };
        let part = arguments.iter().enumerate().find(|(at, a)| !a.starts_with("--") && !after_option(*at));
        let folder = root().join("target/max_error");
        Selection {
            // `cargo test` and `cargo bench -- --quick` only check that it works.
            quick: is("--test") || is("--quick") || !is("--bench"),
            table: is("--table"),
            commands: is("--commands"),
            counts: is("--counts"),
            against: value("--against").map(PathBuf::from),
            file: value("--file").map_or_else(|| folder.join("results.tsv"), PathBuf::from),
            folder,
            part: part.map(|(_, a)| a.clone()),
            side: value("--size").map(|n| n.parse().expect("a size")),
            seed: value("--seed").map(|n| n.parse().expect("a seed")),
        }
    }

    fn results(&self) -> Vec<Measured> {
        table::read(&std::fs::read_to_string(&self.file).unwrap_or_default())
    }
}

/// The processor time of this thread in seconds; elsewhere than on Linux, the time since `start`. The kernel
/// counts it when a thread gives way.
fn processor_time(start: Instant) -> f64 {
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let time = text.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    time.map_or_else(|| start.elapsed().as_secs_f64(), |nanoseconds| 1e-9 * nanoseconds)
}

/// Milliseconds of processor time of some work.
fn timed(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    let before = processor_time(start);
    work();
    1e3 * (processor_time(start) - before)
}

/// Measures the cases of a shader at one size.
fn measure(shader: &Shader, compiled: &Compiled, side: usize, (services, wanted): (&Services, &Selection)) {
    let Selection { quick, file, folder, counts, .. } = wanted;
    let known: std::collections::BTreeSet<table::Key> = wanted.results().iter().map(Measured::key).collect();
    let seeds: Vec<u32> =
        SEEDS.into_iter().filter(|seed| wanted.seed.is_none_or(|own| own == *seed)).collect();
    let key = |error: f32, seed: u32| (shader.name.to_string(), side, (1e3 * error).round() as u32, seed);
    let missing = |error: f32, seed: u32| !known.contains(&key(error, seed));
    if !seeds.iter().any(|seed| ERRORS.iter().any(|error| missing(*error, *seed))) {
        return;
    }
    let grid = Grid { center: shader.center, ..Grid::new(side, side) };
    let options = RunOptions::default();
    let (most, first) = if *quick { (64, 64) } else { (MOST, 1024) };
    let plain = Shading {
        program: &compiled.program,
        services,
        surface: &grid,
        options: &options,
        cheaper: compiled.fast.as_ref(),
        pattern: Pattern::new(first, 0),
        filter: Filter::default(),
    };
    let checked = match (*quick, *counts) {
        (true, _) => [64, 64, 64],
        (_, true) => [4096, 1024, 4096],
        _ => [16384, 1024, 4096],
    };
    let truth = Truth::of(shader, &plain, ERRORS[1], (folder, checked));
    for seed in seeds {
        let best = if *counts { vec![None; 2] } else { truth.best(&plain, &ERRORS, (seed, most)) };
        // A command makes the pattern before it begins; the number of samples is that of the command.
        let shading = Shading { pattern: Pattern::new(64, seed), ..plain.clone() };
        for (error, best) in ERRORS.into_iter().zip(best) {
            if !missing(error, seed) {
                continue;
            }
            let bounds = truth.bounds(error);
            let own = || max_error_each(&shading, 0..side, (&bounds, most)).expect("an image");
            let mut image = Image::default();
            let mut time = timed(|| image = own());
            let best = best.map(|fixed| {
                let count = if let Fixed::Samples(samples) = fixed { samples } else { 1 };
                let shading = Shading { pattern: Pattern::new(count, seed), ..plain.clone() };
                let mut rest = 0.0;
                let mut fixed_time = timed(|| rest = fixed.image(&shading).tally.per_pixel());
                for _ in 1..if time + fixed_time > LONG { 1 } else { RUNS } {
                    time = time.min(timed(|| drop(own())));
                    fixed_time = fixed_time.min(timed(|| drop(fixed.image(&shading))));
                }
                (fixed.name(), rest, fixed_time)
            });
            let found = Measured {
                set: shader.set.to_string(),
                name: shader.name.to_string(),
                side,
                error,
                seed,
                above: truth.above(&image, error),
                known: truth.is_known(error),
                evaluations: image.tally.per_pixel(),
                time,
                best,
            };
            append(file, &found.line());
        }
        if *quick {
            break;
        }
    }
}

fn append(file: &Path, line: &str) {
    let mut file = std::fs::OpenOptions::new().create(true).append(true).open(file).expect("a file");
    file.write_all(line.as_bytes()).expect("a line");
}

fn main() {
    // As the command does.
    oslrun::memory::keep_freed();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut wanted = Selection::of(&arguments);
    std::fs::create_dir_all(&wanted.folder).expect("a folder");
    if wanted.quick {
        wanted.file = wanted.folder.join("quick.tsv");
        let _ = std::fs::remove_file(&wanted.file);
    }
    let is_wanted =
        |shader: &&Shader| wanted.part.as_ref().is_none_or(|part| shader.name.contains(part.as_str()));
    let services = cases::services();
    let all = shaders();
    let sides = match (wanted.quick, wanted.side) {
        (true, _) => vec![32],
        (false, Some(side)) => vec![side],
        (false, None) => SIDES.to_vec(),
    };
    if !wanted.table {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        for shader in all.iter().filter(is_wanted) {
            if wanted.commands {
                commands::measure(shader, &wanted);
                continue;
            }
            let compiled = shader.compile();
            for side in &sides {
                pool.install(|| measure(shader, &compiled, *side, (&services, &wanted)));
            }
        }
    }
    if wanted.commands {
        wanted.file = commands::file(&wanted);
    }
    let results = wanted.results();
    if wanted.counts {
        let other =
            wanted.against.map(|file| table::read(&std::fs::read_to_string(file).unwrap_or_default()));
        println!("{}", table::counts(&results, &other.unwrap_or_default()));
        return;
    }
    println!("{}", table::tables(&results));
    if wanted.table {
        println!("{}\n{}", table::shaders(&results, 256), table::misses(&results));
    }
}
