//! Points per second of each seed shader, and of shaders that cover the library, at 512²: one thread for each
//! instruction set, and all threads; also the compile time. Expect: AVX-512 at least twice the baseline;
//! compiling takes a few milliseconds.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

mod cases;

use cases::{CASES, services};
use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use osl_exec::{Isa, PointSource, RunOptions};
use osl_scene::Grid;

fn seeds(c: &mut Criterion) {
    let (grid, services) = (Grid::new(512, 512), services());
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    for case in CASES {
        let text = case.text();
        let mut group = c.benchmark_group(case.name);
        group.sampling_mode(SamplingMode::Flat).sample_size(10);
        group.bench_function("compile", |b| b.iter(|| case.compile(&text, &grid)));
        let program = case.compile(&text, &grid);
        group.throughput(Throughput::Elements(grid.count() as u64));
        for isa in Isa::all() {
            let options = RunOptions { isa, ..RunOptions::default() };
            let shade = || osl_exec::run(&program, &services, &grid, &options, &|_| ()).expect("a frame");
            group.bench_function(isa.name(), |b| b.iter(|| one.install(shade)));
        }
        let shade =
            || osl_exec::run(&program, &services, &grid, &RunOptions::default(), &|_| ()).expect("a frame");
        group.bench_function("all threads", |b| b.iter(shade));
        group.finish();
    }
}

criterion_group!(benches, seeds);
criterion_main!(benches);
