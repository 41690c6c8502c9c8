//! Lobes: densities integrate to the sampled amount, and no lobe creates light.

use super::facets::{FacetLobe, Kind};
use super::*;
use crate::testrender::sampler::Sampler;
use glam::Vec2;
use std::f32::consts::PI;

fn wo() -> Vec3 {
    Vec3::new(0.3, -0.4, 0.6).normalize()
}

fn facets(distribution: &str, alpha: Vec2, eta: f32, [reflects, refracts]: [bool; 2]) -> Lobe {
    Lobe::Facets(FacetLobe::new(
        distribution,
        Vec3::Z,
        Vec3::X,
        alpha,
        Kind::Plain { eta, reflects, refracts },
    ))
}

fn rough() -> Vec<(&'static str, Lobe)> {
    let n = Vec3::Z;
    let diffuse = |kind| Lobe::Diffuse(Diffuse { n, albedo: Vec3::ONE, kind });
    vec![
        ("lambert", diffuse(diffuse::Kind::Lambert)),
        ("oren", diffuse(diffuse::Kind::oren_nayar(0.5))),
        ("preserving", diffuse(diffuse::Kind::Preserving(0.7))),
        ("burley", diffuse(diffuse::Kind::Burley(0.7))),
        ("sheen", diffuse(diffuse::Kind::Sheen(0.4))),
        ("phong", Lobe::Phong(Phong { n, exponent: 8.0 })),
        ("ward", Lobe::Ward(Ward::new(n, Vec3::X, Vec2::new(0.3, 0.5)))),
        ("ggx", facets("ggx", Vec2::new(0.3, 0.5), 1.5, [true, false])),
        ("beckmann", facets("beckmann", Vec2::new(0.3, 0.5), 1.5, [true, false])),
        ("ggx refracts", facets("ggx", Vec2::new(0.3, 0.5), 1.5, [false, true])),
        ("ggx both, out", facets("ggx", Vec2::splat(0.4), 1.0 / 1.5, [true, true])),
        ("beckmann both", facets("beckmann", Vec2::splat(0.4), 1.5, [true, true])),
    ]
}

/// Directions distributed evenly over the sphere.
fn directions(count: usize) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |k| {
        let z = 1.0 - (2.0 * k as f32 + 1.0) / count as f32;
        let angle = k as f32 * PI * (3.0 - 5.0_f32.sqrt());
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * angle.cos(), r * angle.sin(), z)
    })
}

#[test]
fn densities_are_those_of_the_samples() {
    for (name, lobe) in rough() {
        let count = 200_000;
        let area = 4.0 * PI / count as f32;
        // The probability of directions on one side, and the total light: by the density, and by sampling.
        let (mut sure, mut light) = ([0.0; 2], 0.0);
        for wi in directions(count) {
            let sample = lobe.eval(wo(), wi);
            sure[usize::from(wi.x > 0.2)] += sample.pdf * area;
            light += sample.pdf * sample.weight.x * area;
        }
        let (mut seen, mut gathered) = ([0.0; 2], 0.0);
        for path in 0..4096 {
            let sample = lobe.sample(wo(), Sampler::new(0, 0, path).three());
            // A microfacet may send light below the surface, where evaluation returns zero.
            if sample.pdf > 0.0 && lobe.eval(wo(), sample.wi).pdf > 0.0 {
                seen[usize::from(sample.wi.x > 0.2)] += 1.0 / 4096.0;
                gathered += sample.weight.x / 4096.0;
                let again = lobe.eval(wo(), sample.wi);
                // Transmission is evaluated with a different density than it is sampled with: see
                // `FacetLobe`.
                let known = sample.wi.z < 0.0;
                assert!(
                    known || (again.pdf / sample.pdf - 1.0).abs() < 0.02,
                    "{name}: {} {}",
                    again.pdf,
                    sample.pdf
                );
            }
        }
        // Burley's model is known to reflect slightly more than it receives.
        let limit = if name == "burley" { 1.05 } else { 1.01 };
        assert!(gathered < limit, "{name} makes light: {gathered}");
        if lobe.eval(wo(), Vec3::NEG_Z).pdf > 0.0 {
            continue;
        }
        assert!((light - gathered).abs() < 0.01, "{name}: {light} {gathered}");
        for side in 0..2 {
            assert!((sure[side] - seen[side]).abs() < 0.01, "{name}: {sure:?} {seen:?}");
        }
    }
}

#[test]
fn several_lobes_are_one_density() {
    let mut lobes = Lobes::default();
    for (_, lobe) in rough().into_iter().take(3) {
        lobes.add(lobe, Vec3::splat(0.3));
    }
    lobes.add(Lobe::Phong(Phong { n: Vec3::Z, exponent: 20.0 }), Vec3::splat(0.1));
    lobes.prepare(wo(), Vec3::ONE, false);
    let sample = lobes.sample(wo(), [0.95, 0.3, 0.2]);
    let again = lobes.eval(wo(), sample.wi);
    assert!((again.pdf / sample.pdf - 1.0).abs() < 1e-3);
    assert!(again.weight.distance(sample.weight) < 1e-3);
}

#[test]
fn paths_are_absorbed_late() {
    let mut lobes = Lobes::default();
    lobes.add(Lobe::Transparent, Vec3::splat(0.25));
    lobes.prepare(wo(), Vec3::ONE, true);
    assert_eq!(lobes.sample(wo(), [0.3, 0.0, 0.0]), Sample::default());
    assert_eq!(lobes.sample(wo(), [0.2, 0.0, 0.0]).weight, Vec3::ONE);
    lobes.prepare(wo(), Vec3::ONE, false);
    assert_eq!(lobes.sample(wo(), [0.3, 0.0, 0.0]).weight, Vec3::splat(0.25));
}

#[test]
fn lobes_are_bounded() {
    let mut lobes = Lobes::default();
    for _ in 0..100 {
        lobes.add(Lobe::Transparent, Vec3::ONE);
    }
    assert_eq!(lobes.lobes.len(), MAX_LOBES);
}

#[test]
fn axes_are_as_long_as_the_tangent() {
    let axes = frame_along(Vec3::Z, Vec3::X * 3.0);
    assert_eq!((axes.x, axes.y), (Vec3::X * 3.0, Vec3::Y * 3.0));
    let axes = frame_along(Vec3::Z, Vec3::ZERO);
    assert_eq!((axes.x.length(), axes.y.length()), (1.0, 1.0));
}
