//! Points a second of each field, form and instruction set over 256 lanes.
//! Expect: AVX-512 at least four times the baseline in every row.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use osl_noise::{Isa, Kind, eval, eval3};
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

criterion_group!(benches, noise);
criterion_main!(benches);
