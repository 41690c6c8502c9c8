//! The cost of unused layers: a network of ten layers, and the same network with fifty more. Expect: equal
//! run times within the noise; compiling takes longer by the time of reading and resolving the other layers.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a bench says what must hold"
)]

use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use osl::stages::{self, ShaderFiles};
use osl_exec::{PointSource, Program, RunOptions, Services};
use osl_ir::passes;
use osl_scene::Grid;
use osl_syntax::source::SourceProvider;
use osl_syntax::{NoFiles, Options};
use std::fmt::Write as _;

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

/// Ten layers that the color of the last one depends on.
const NEEDED: &str = include_str!("shaders/network.group");

/// The ten layers with fifty others: twenty-five times noise and its remapping, each warped by the one
/// before. They determine the number that the last layer clamps, and that output is not requested.
fn crowded() -> String {
    let (layers, connections) = NEEDED.split_at(NEEDED.find("shader clamp Last").expect("the last layer"));
    let (last, connections) = connections.split_at(connections.find("connect").expect("connections"));
    let mut text = layers.to_string();
    let mut more = String::new();
    for i in 0..25 {
        let _ = writeln!(
            text,
            "param float frequency {} ; shader fractal Noise{i} ; shader remap Map{i} ;",
            i + 2
        );
        let _ = writeln!(more, "connect Noise{i}.result Map{i}.value ;");
        if i > 0 {
            let _ = writeln!(more, "connect Map{}.result Noise{i}.offset ;", i - 1);
        }
    }
    format!("{text}{last}{connections}{more}connect Map24.result Last.value ;")
}

fn compile(text: &str, layers: usize) -> Program {
    let checked = stages::check_group("group", text, "bench", &Nodes, &Options::default());
    let group = checked.group.unwrap_or_else(|| panic!("{:#?}", checked.diagnostics));
    assert_eq!(group.layers().len(), layers);
    let body = osl_lower::lower_group(&group, &[]).expect("a body");
    let outputs = Some(vec!["result_color".into()]);
    let varying = Grid::new(1, 1).varying().to_vec();
    stages::finish(body, &passes::Options { outputs, varying, ..passes::Options::default() }).program
}

fn networks(c: &mut Criterion) {
    let crowded = crowded();
    let grid = Grid::new(512, 512);
    let services = Services::default();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    for (name, text, layers) in [("10 layers", NEEDED, 10), ("60 layers, 10 needed", &crowded, 60)] {
        let mut group = c.benchmark_group(name);
        group.sampling_mode(SamplingMode::Flat).sample_size(10);
        group.bench_function("compile", |b| b.iter(|| compile(text, layers)));
        let program = compile(text, layers);
        group.throughput(Throughput::Elements(grid.count() as u64));
        let options = RunOptions::default();
        let shade = || osl_exec::run(&program, &services, &grid, &options, &|_| ()).expect("a frame");
        group.bench_function("run", |b| b.iter(|| one.install(shade)));
        group.finish();
    }
}

criterion_group!(benches, networks);
criterion_main!(benches);
