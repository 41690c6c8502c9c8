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

use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use osl::stages::{self, ShaderFiles};
use osl_exec::{Isa, PointSource, RunOptions, Services, Spaces};
use osl_image::TextureCache;
use osl_ir::passes;
use osl_scene::Grid;
use osl_syntax::NoFiles;
use osl_syntax::source::SourceProvider;
use std::path::Path;

/// Name, file, outputs to compute (empty means all), and parameters.
type Case = (&'static str, &'static str, &'static [&'static str], &'static [(&'static str, &'static str)]);

const CASES: [Case; 19] = [
    ("Cobbled, all outputs", "osl/Cobbled.osl", &[], &[]),
    ("Cobbled, resultRGB", "osl/Cobbled.osl", &["resultRGB"], &[]),
    ("Cobbled, resultMask", "osl/Cobbled.osl", &["resultMask"], &[]),
    ("flakes, result", "osl/flakes.osl", &["result"], &[]),
    ("sprinkles, Fac", "tests/data/seeds/sprinkles.repaired.osl", &["Fac"], &[]),
    ("strips, all outputs", "osl/strips.osl", &[], &[]),
    ("strips, Fac", "osl/strips.osl", &["Fac"], &[]),
    ("nonlinear noise, recursive", "osl/nonlinear_noise.osl", &[], &[("type", "recursive")]),
    ("chaosmosaic, Color", "osl/chaosmosaic.osl", &[], &[("Image", TEXTURE)]),
    ("matrices", "crates/oslrun/benches/shaders/matrices.osl", &[], &[]),
    ("transcendental", "crates/oslrun/benches/shaders/transcendental.osl", &[], &[]),
    ("branches", "crates/oslrun/benches/shaders/branches.osl", &[], &[]),
    ("splines", "crates/oslrun/benches/shaders/splines.osl", &[], &[]),
    ("colors", "crates/oslrun/benches/shaders/colors.osl", &[], &[]),
    ("gabor", "crates/oslrun/benches/shaders/gabor.osl", &[], &[]),
    ("textures", "crates/oslrun/benches/shaders/textures.osl", &[], &[("image", TEXTURE)]),
    ("derivatives", "crates/oslrun/benches/shaders/derivatives.osl", &[], &[]),
    ("strings", "crates/oslrun/benches/shaders/strings.osl", &[], &[]),
    ("network", "crates/oslrun/benches/shaders/network.group", &[], &[]),
];

const TEXTURE: &str = "tests/data/textures/tex64.png";

/// The built-in shaders.
struct Nodes;

impl ShaderFiles for Nodes {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        let text = oslrun::nodes::find(shader).ok_or("no such node")?;
        Ok((format!("{shader}.osl"), text.to_string()))
    }

    fn includes(&self) -> &dyn SourceProvider {
        &NoFiles
    }
}

fn seeds(c: &mut Criterion) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let grid = Grid::new(512, 512);
    let services = Services {
        spaces: Spaces::default(),
        textures: TextureCache::new(vec![root.clone()]),
        ..Services::default()
    };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    for (name, file, outputs, params) in CASES {
        let text = std::fs::read_to_string(root.join(file)).expect("a seed shader");
        let params: Vec<(String, String)> =
            params.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect();
        let compile = || {
            let options = osl_syntax::Options::default();
            let body = if file.ends_with(".group") {
                let checked = stages::check_group(file, &text, "bench", &Nodes, &options);
                osl_lower::lower_group(&checked.group.expect("a group"), &[]).expect("a body")
            } else {
                let checked = stages::check(file, &text, &NoFiles, &options);
                stages::lower(&checked.program.expect("a program"), &params).expect("a body")
            };
            let outputs = (!outputs.is_empty()).then(|| outputs.iter().map(|o| (*o).into()).collect());
            let options =
                passes::Options { outputs, varying: grid.varying().to_vec(), ..passes::Options::default() };
            stages::finish(body, &options).program
        };
        let mut group = c.benchmark_group(name);
        group.sampling_mode(SamplingMode::Flat).sample_size(10);
        group.bench_function("compile", |b| b.iter(compile));
        let program = compile();
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
