//! One lookup at a time, over a 512 x 512 texture of three bytes per pixel whose levels already exist.
//!
//! Expect on one core of a 2020s server: closest 25 ns, linear 35, the cubic of the finest level 70, a
//! filtered lookup 100 for each probe (two levels).
#![allow(
    clippy::unwrap_used,
    missing_docs,
    reason = "a benchmark stops by panicking, and criterion_group makes public items"
)]

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use osl_image::{
    BitDepth, Footprint, ImageData, Interp, LookupOptions, PngOptions, StoredType, SubImage, Texture,
    TextureCache, Transfer, Wrap, lookup, lookup_values, write_png,
};

const SIZE: usize = 512;
const N_POINTS: usize = 1024;

fn texture() -> Texture {
    let value = |i: usize| ((i * 2_654_435_761) >> 7 & 255) as f32 * (1.0 / 255.0);
    Texture::new(ImageData {
        width: SIZE,
        height: SIZE,
        channels: ["R", "G", "B"].map(str::to_owned).to_vec(),
        stored: StoredType::U8,
        wraps: (Wrap::File, Wrap::File),
        n_parts: 1,
        header: Default::default(),
        samples: (0..SIZE * SIZE * 3).map(value).collect(),
    })
}

/// Slightly more than a row of points, in the order in which a shader's batch requests them.
fn points() -> Vec<(f32, f32)> {
    (0..N_POINTS).map(|i| (i as f32 / 700.0 % 1.0, 0.3 + (i / 64) as f32 / 512.0)).collect()
}

/// A footprint of `texels` by `texels * aspect` texels, slightly rotated.
fn footprint(texels: f32, aspect: f32) -> Footprint {
    let width = texels / SIZE as f32;
    Footprint {
        ds_dx: width * 0.8,
        dt_dx: width * 0.6,
        ds_dy: -width * aspect * 0.6,
        dt_dy: width * aspect * 0.8,
    }
}

fn lookups(c: &mut Criterion) {
    let texture = texture();
    let points = points();
    let plain = |interp| LookupOptions {
        interp,
        width: (0.0, 0.0),
        wrap_s: Wrap::Periodic,
        wrap_t: Wrap::Periodic,
        ..LookupOptions::default()
    };
    let filtered = LookupOptions { width: (1.0, 1.0), ..plain(Interp::SmartCubic) };
    let cases = [
        ("closest", plain(Interp::Closest), Footprint::default()),
        ("linear", plain(Interp::Linear), Footprint::default()),
        (
            "linear, black",
            LookupOptions { wrap_s: Wrap::Black, wrap_t: Wrap::Black, ..plain(Interp::Linear) },
            Footprint::default(),
        ),
        ("smartcubic", plain(Interp::SmartCubic), Footprint::default()),
        ("filtered, magnified", filtered, footprint(0.5, 1.0)),
        ("filtered, 1 probe", filtered, footprint(2.5, 1.0)),
        ("filtered, 5 probes", filtered, footprint(2.5, 3.0)),
        ("filtered, 31 probes", filtered, footprint(2.5, 16.0)),
    ];
    let mut group = c.benchmark_group("lookup");
    group.throughput(Throughput::Elements(N_POINTS as u64));
    for (name, options, footprint) in cases {
        group.bench_function(format!("{name}/values"), |b| {
            b.iter(|| {
                let look = |&(s, t): &(f32, f32)| lookup_values(&texture, s, t, &footprint, 4, &options);
                points.iter().map(look).for_each(|value| _ = black_box(value));
            });
        });
        group.bench_function(format!("{name}/derivatives"), |b| {
            b.iter(|| {
                let look = |&(s, t): &(f32, f32)| lookup(&texture, s, t, &footprint, 4, &options);
                points.iter().map(look).for_each(|sample| _ = black_box(sample));
            });
        });
    }
    group.finish();
}

/// The cost of finding a texture by name. Expect below 100 ns; below 250 for tiles, whose name is built each
/// time.
fn names(c: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str| {
        let options = PngOptions { transfer: Transfer::Linear, depth: BitDepth::Eight, software: None };
        write_png(&dir.path().join(name), 1, 1, &[&[1.0]], options).unwrap();
    };
    write("a.png");
    write("a.1001.png");
    let cache = |bytes| {
        let mut limits = osl_limits::Limits::default();
        limits.images.texture_memory = bytes;
        TextureCache::within(vec![Path::to_owned(dir.path())], &limits)
    };
    let mut group = c.benchmark_group("cache");
    for (kind, cache) in [("unbounded", cache(u64::MAX)), ("bounded", cache(1 << 20))] {
        group.bench_function(format!("get/{kind}"), |b| b.iter(|| cache.get(black_box("a.png")).unwrap()));
        for name in ["a.png", "a.<UDIM>.png"] {
            group.bench_function(format!("tile {name}/{kind}"), |b| {
                b.iter(|| cache.tile(black_box(name), SubImage::default(), 0.5, 0.5).0.unwrap());
            });
        }
    }
    group.finish();
}

criterion_group!(benches, lookups, names);
criterion_main!(benches);
