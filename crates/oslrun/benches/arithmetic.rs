//! Nanoseconds per point in each arithmetic (strict, fast, double precision), at 512² on one thread with the
//! widest instruction set. Expect: fast at least 1.3 times as fast as strict if elementary functions are most
//! of the work, and never slower; double precision takes five times as long as strict for noise and
//! arithmetic, and some 40 ns for each elementary function.

#![allow(clippy::unwrap_used, clippy::expect_used, missing_docs, reason = "a test says what must hold")]

use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use osl::stages;
use osl_exec::{Arithmetic, PointSource, RunOptions, Services, Spaces};
use osl_image::TextureCache;
use osl_ir::passes;
use osl_scene::Grid;
use osl_syntax::NoFiles;
use std::path::Path;

/// A shader: its name, its file, values of parameters.
type Case = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

const CASES: [Case; 9] = [
    ("transcendental", "crates/oslrun/benches/shaders/transcendental.osl", &[]),
    ("matrices", "crates/oslrun/benches/shaders/matrices.osl", &[]),
    ("derivatives", "crates/oslrun/benches/shaders/derivatives.osl", &[]),
    ("colors", "crates/oslrun/benches/shaders/colors.osl", &[]),
    ("Cobbled", "osl/Cobbled.osl", &[]),
    ("flakes", "osl/flakes.osl", &[]),
    ("sprinkles", "tests/data/seeds/sprinkles.repaired.osl", &[]),
    ("strips", "osl/strips.osl", &[]),
    ("nonlinear noise", "osl/nonlinear_noise.osl", &[("type", "recursive")]),
];

fn arithmetics(c: &mut Criterion) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let grid = Grid::new(512, 512);
    let services = Services {
        spaces: Spaces::default(),
        textures: TextureCache::new(vec![root.clone()]),
        ..Services::default()
    };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    for (name, file, params) in CASES {
        let text = std::fs::read_to_string(root.join(file)).expect("a shader");
        let params: Vec<(String, String)> =
            params.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect();
        let checked = stages::check(file, &text, &NoFiles, &osl_syntax::Options::default());
        let source = checked.program.expect("a program");
        let mut group = c.benchmark_group(name);
        group.sampling_mode(SamplingMode::Flat).sample_size(10);
        group.throughput(Throughput::Elements(grid.count() as u64));
        for arithmetic in Arithmetic::ALL {
            let varying = grid.varying().to_vec();
            let options = passes::Options { varying, arithmetic, ..passes::Options::default() };
            let body = stages::lower(&source, &params).expect("a body");
            let program = stages::finish(body, &options).program;
            let options = RunOptions::default();
            let shade = || osl_exec::run(&program, &services, &grid, &options, &|_| ()).expect("a frame");
            group.bench_function(arithmetic.name(), |b| b.iter(|| one.install(shade)));
        }
        group.finish();
    }
}

criterion_group!(benches, arithmetics);
criterion_main!(benches);
