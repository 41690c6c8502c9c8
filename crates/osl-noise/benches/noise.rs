//! Points per second of each field, form and instruction set over 256 lanes. Expect: AVX-512 at least four
//! times the baseline in every row.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use osl_noise::{Kind, eval, eval_dual, eval3, gabor};
use osl_simd::Isa;
use std::hint::black_box;

const LANES: usize = 256;

fn noise(c: &mut Criterion) {
    let axis = |k: f32| (0..LANES).map(|i| (i as f32 * 0.173 + k) * 1.3 - 40.0).collect::<Vec<f32>>();
    let columns = [axis(0.1), axis(3.7), axis(9.2), axis(20.9)];
    for kind in Kind::ALL {
        let mut group = c.benchmark_group(format!("noise/{kind:?}"));
        group.throughput(Throughput::Elements(LANES as u64));
        for dims in 1..=4 {
            let coords: Vec<&[f32]> = columns[..dims].iter().map(Vec::as_slice).collect();
            for isa in Isa::all() {
                let mut out = vec![0.0; 3 * LANES];
                group.bench_function(format!("{dims}d/float/{isa:?}"), |b| {
                    b.iter(|| eval(isa, kind, black_box(&coords), &mut out[..LANES]));
                });
                group.bench_function(format!("{dims}d/triple/{isa:?}"), |b| {
                    b.iter(|| {
                        let (x, rest) = out.split_at_mut(LANES);
                        let (y, z) = rest.split_at_mut(LANES);
                        eval3(isa, kind, black_box(&coords), [x, y, z]);
                    });
                });
            }
        }
        group.finish();
    }
}

/// Lattice noise of blocks of 16 × 16 pixels, for a number of pixels per unit of the field. Neighbouring
/// points share cells. Expect: fewer pixels take longer, for simplex noise up to three times.
fn pixels(c: &mut Criterion) {
    const POINTS: usize = 2048;
    let mut group = c.benchmark_group("noise/pixels");
    group.throughput(Throughput::Elements(POINTS as u64));
    let (one, zero) = (vec![0.01_f32; POINTS], vec![0.0_f32; POINTS]);
    for per_unit in [256, 50] {
        let column = |f: &dyn Fn(usize) -> usize| {
            (0..POINTS).map(|i| f(i) as f32 / per_unit as f32 + 3.1).collect::<Vec<f32>>()
        };
        let (x, y, z) = (column(&|i| i / 256 * 16 + i % 16), column(&|i| i % 256 / 16), vec![0.4; POINTS]);
        let duals: [&[f32]; 9] = [&x, &y, &z, &one, &zero, &zero, &zero, &one, &zero];
        for isa in Isa::all() {
            let mut out = vec![0.0; 3 * POINTS];
            for (kind, dims) in [(Kind::Perlin, 2), (Kind::Perlin, 3), (Kind::Simplex, 3)] {
                group.bench_function(format!("{per_unit}/{kind:?}/{dims}d/float/{isa:?}"), |b| {
                    b.iter(|| eval(isa, kind, black_box(&duals[..dims]), &mut out[..POINTS]));
                });
            }
            group.bench_function(format!("{per_unit}/Perlin/3d/dual/{isa:?}"), |b| {
                b.iter(|| {
                    let (v, rest) = out.split_at_mut(POINTS);
                    let (dx, dy) = rest.split_at_mut(POINTS);
                    eval_dual(isa, Kind::Perlin, black_box(&duals), &[], [v, dx, dy]);
                });
            });
        }
    }
    group.finish();
}

/// Gabor noise of points in a patch, like the neighbouring pixels of a picture, and of distant points, which
/// share no cells. Expect: wide vectors and shared cells each halve the time.
fn gabors(c: &mut Criterion) {
    let column = |f: &dyn Fn(usize) -> f32| (0..LANES).map(f).collect::<Vec<f32>>();
    let patch = [
        column(&|i| (i % 16) as f32 * 0.05 + 0.3),
        column(&|i| (i / 16) as f32 * 0.05 - 7.9),
        column(&|_| 2.0),
    ];
    let apart = [0.0, 1.7, 5.1].map(|k| column(&|i| ((i * 7919 % 1009) as f32 + k) * 0.37));
    let (step, zero) = (vec![0.05_f32; LANES], vec![0.0_f32; LANES]);
    let partials: [&[f32]; 6] = [&step, &zero, &zero, &zero, &step, &zero].map(Vec::as_slice);
    let narrow = [gabor::Options { do_filter: false, ..gabor::Options::default() }];
    let filtered = [gabor::Options { do_filter: true, ..narrow[0] }];
    let mut group = c.benchmark_group("noise/Gabor");
    group.throughput(Throughput::Elements(LANES as u64));
    for (name, columns) in [("patch", &patch), ("apart", &apart)] {
        let coords: Vec<&[f32]> = columns.iter().map(Vec::as_slice).collect();
        let points = gabor::Points { coords: &coords, partials: &partials, periods: &[] };
        for isa in Isa::all() {
            let mut out = vec![0.0; 3 * LANES];
            group.bench_function(format!("{name}/float/{isa:?}"), |b| {
                b.iter(|| gabor::eval(isa, black_box(points), &narrow, &mut out[..LANES]));
            });
            for (form, options) in [("dual", &narrow), ("filtered", &filtered)] {
                group.bench_function(format!("{name}/{form}/{isa:?}"), |b| {
                    b.iter(|| {
                        let (v, rest) = out.split_at_mut(LANES);
                        let (dx, dy) = rest.split_at_mut(LANES);
                        gabor::eval_dual(isa, black_box(points), options, [v, dx, dy]);
                    });
                });
            }
            group.bench_function(format!("{name}/triple/{isa:?}"), |b| {
                b.iter(|| {
                    let (x, rest) = out.split_at_mut(LANES);
                    let (y, z) = rest.split_at_mut(LANES);
                    gabor::eval3(isa, black_box(points), &narrow, [x, y, z]);
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, noise, pixels, gabors);
criterion_main!(benches);
