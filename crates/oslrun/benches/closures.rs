//! What a closure costs a renderer: the time of a point of a material with two lobes, from the run to the
//! weights and normals in the renderer's hands, and the time of the same point without closures.
//!
//! cargo bench -p oslrun --bench closures

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench may fail")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use osl::{Group, Points, Program, Renderer, RunOptions, Shader};
use std::hint::black_box;

const TEXT: &str = "surface s(output color c = 0) { c = color(u, v, 0.5); Ci = c * diffuse(N) + (1 - c) * reflection(N, 1.5); }";
const COUNT: usize = 1 << 16;

fn program(output: &str) -> Program {
    Group::new().layer("s", &Shader::compile("s.osl", TEXT).unwrap()).compile(&[output]).unwrap()
}

fn closures(c: &mut Criterion) {
    let mut group = c.benchmark_group("closures");
    group.throughput(Throughput::Elements(COUNT as u64));
    let ramp: Vec<f32> = (0..COUNT).map(|at| at as f32 / COUNT as f32).collect();
    let normals = vec![[0.0, 0.6, 0.8]; COUNT];
    let points = Points::new(COUNT).u(&ramp).v(&ramp).n(&normals);
    let (renderer, options) = (Renderer::default(), RunOptions::default().threads(1));
    let (color, both) = (program("c"), program("Ci"));
    group.bench_function(BenchmarkId::from_parameter("none"), |b| {
        b.iter(|| color.run_with(&points, &renderer, &options).unwrap());
    });
    group.bench_function(BenchmarkId::from_parameter("two lobes"), |b| {
        b.iter(|| {
            let outputs = both.run_with(&points, &renderer, &options).unwrap();
            let closures = outputs.closures("Ci").unwrap();
            let lobes = (0..closures.len()).flat_map(|point| closures.at(point));
            let sum: f32 = lobes.map(|lobe| lobe.weight()[0] * lobe.triple(0).unwrap_or_default()[2]).sum();
            black_box(sum)
        });
    });
    group.finish();
}

criterion_group!(benches, closures);
criterion_main!(benches);
