//! How many pixels `--prefilter` makes better and worse, and what it costs: 71 shaders in three sizes, with
//! one sample in each pixel. The truth is that of the bench `max_error`: 1024 to 4096 samples at 16384
//! pixels.
//!
//! A pixel is worse if its error, less twice the standard error of the truth, exceeds by more than 1 % of the
//! range both the error of the plain pixel and the standard deviation of a sample in this pixel, which is
//! measured with 64 others. The column `centre` leaves out the second condition.
//!
//! ```sh
//! cargo bench -p oslrun --bench prefilter -- [PART OF A NAME]
//! ```

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    dead_code,
    reason = "a bench says what it finds, and shares files with another one"
)]

#[path = "../cases/mod.rs"]
mod cases;
#[path = "../max_error/shaders.rs"]
mod shaders;
#[path = "../max_error/truth.rs"]
mod truth;

use osl::stages;
use osl_exec::{RunOptions, Services};
use osl_ir::passes::{self, Prefilter};
use osl_measure::sample::{Filter, Pattern, Shading};
use osl_scene::Grid;
use shaders::{Shader, root, shaders};
use std::time::Instant;
use truth::Truth;

const SIDES: [usize; 3] = [128, 256, 384];
/// A difference that can be seen, as a share of the range.
const SEEN: f32 = 0.01;
/// Samples that show the standard deviation of a sample.
const OTHERS: u32 = 64;
/// Runs, the fastest of which counts.
const RUNS: usize = 5;

/// How a filtered image compares with a plain one.
struct Compared {
    /// Root mean square errors, in ranges.
    rms: [f64; 2],
    /// Shares of the pixels: worse, worse than the centre, better.
    shares: [f64; 3],
}

fn planes(shading: &Shading<'_>, side: usize) -> Vec<Vec<f32>> {
    shading.rows(0..side, 1).expect("an image").frame.planes.iter().map(|p| p.floats()).collect()
}

fn compare(truth: &Truth, [plain, own]: [&Vec<Vec<f32>>; 2], deviations: &[Vec<f32>]) -> Compared {
    let ranges = truth.bounds(1.0);
    let pixels = &truth.oracle.pixels;
    let (mut squares, mut counts) = ([0.0; 2], [0.0; 3]);
    for (at, pixel) in pixels.iter().enumerate() {
        let mut most = [f32::NEG_INFINITY; 3];
        for (plane, range) in ranges.iter().enumerate() {
            let (value, unsure) = (truth.oracle.values[plane][at], truth.oracle.errors[plane][at]);
            let off = |planes: &[Vec<f32>]| (planes[plane][*pixel as usize] - value).abs() / range;
            let (a, b) = (off(plain), off(own));
            squares[0] += f64::from(a * a);
            squares[1] += f64::from(b * b);
            let sure = b - 2.0 * unsure / range;
            let deviation = deviations[plane][at] / range;
            for (most, own) in most.iter_mut().zip([sure - a.max(deviation), sure - a, a - b]) {
                *most = most.max(own);
            }
        }
        counts.iter_mut().zip(most).for_each(|(count, most)| *count += f64::from(u8::from(most > SEEN)));
    }
    let all = pixels.len() as f64;
    Compared {
        rms: squares.map(|sum| (sum / (all * ranges.len() as f64)).sqrt()),
        shares: counts.map(|n| n / all),
    }
}

/// The standard deviation of a sample around the truth, for each plane and pixel.
fn deviations(truth: &Truth, plain: &Shading<'_>) -> Vec<Vec<f32>> {
    let mut sums: Vec<Vec<f32>> = truth.oracle.values.iter().map(|plane| vec![0.0; plane.len()]).collect();
    for seed in 0..OTHERS {
        let own = Shading { pattern: Pattern::new(1, 77 + seed), ..plain.clone() };
        let values = own.chosen(&truth.oracle.pixels, 1).expect("samples");
        for ((sums, values), truth) in sums.iter_mut().zip(&values).zip(&truth.oracle.values) {
            let pairs = values.iter().zip(truth);
            sums.iter_mut().zip(pairs).for_each(|(sum, (a, b))| *sum += (a - b) * (a - b) / OTHERS as f32);
        }
    }
    sums.into_iter().map(|plane| plane.into_iter().map(f32::sqrt).collect()).collect()
}

fn measure(shader: &Shader, side: usize, services: &Services, quick: bool) {
    let (body, options) = shader.lowered();
    let plain = stages::finish(body.clone(), &options).program;
    let n_filtered = passes::n_filtered(body.clone(), &options);
    let prefilter = Some(Prefilter { scale: 1.0 });
    let wide = stages::finish(body, &passes::Options { prefilter, ..options }).program;
    let grid = Grid { center: shader.center, ..Grid::new(side, side) };
    let run_options = RunOptions::default();
    let of = |program| Shading {
        program,
        services,
        surface: &grid,
        options: &run_options,
        cheaper: None,
        pattern: Pattern::new(1, 0),
        filter: Filter::default(),
    };
    let folder = root().join("target/max_error");
    let truth = {
        let many = Shading { pattern: Pattern::new(1024, 0), ..of(&plain) };
        Truth::of(shader, &many, 0.02, (&folder, if quick { [64; 3] } else { [16384, 1024, 4096] }))
    };
    let shadings = [of(&plain), of(&wide)];
    let mut times = [f64::INFINITY; 2];
    for _ in 0..if quick { 1 } else { RUNS } {
        for (time, shading) in times.iter_mut().zip(&shadings) {
            let start = Instant::now();
            let _ = planes(shading, side);
            *time = time.min(start.elapsed().as_secs_f64());
        }
    }
    let deviations = deviations(&truth, &of(&plain));
    let [plain_planes, wide_planes] = shadings.each_ref().map(|shading| planes(shading, side));
    let found = compare(&truth, [&plain_planes, &wide_planes], &deviations);
    let [worse, centre, better] = found.shares.map(|share| format!("{:.2} %", 100.0 * share));
    println!(
        "| {} | {side} | {n_filtered} | {:.4} | {:.4} | {worse} | {centre} | {better} | {:.2} | {:.2} |",
        shader.name,
        found.rms[0],
        found.rms[1],
        times[1] / times[0],
        1e3 * times[0],
    );
}

fn main() {
    // `cargo test` and `cargo bench -- --quick` only check that it works.
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let is = |name: &str| arguments.iter().any(|a| a == name);
    let quick = is("--test") || is("--quick") || !is("--bench");
    let part = arguments.iter().find(|a| !a.starts_with("--"));
    let services = cases::services();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    println!("| shader | size | filtered | plain rms | rms | worse | centre | better | time | plain ms |");
    println!("|---|{}", "---:|".repeat(9));
    for shader in shaders().iter().filter(|s| part.is_none_or(|p| s.name.contains(p.as_str()))) {
        for side in if quick { vec![32] } else { SIDES.to_vec() } {
            pool.install(|| measure(shader, side, &services, quick));
        }
    }
}
