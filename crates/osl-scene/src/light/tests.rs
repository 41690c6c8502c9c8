//! Lights send the right amount of light, and their densities match their samples.

use super::*;

fn uniform(n: usize) -> [f32; 2] {
    [0.754_877_666_246_692_8, 0.569_840_290_998_053_2]
        .map(|s: f64| ((0.5 + s * (n + 1) as f64).fract() as f32).min(1.0 - f32::EPSILON))
}

#[test]
fn a_white_surface_that_faces_a_light_has_its_color() {
    let n = 4096;
    for radius in [0.0, 0.5, 400.0] {
        let light =
            SphereLight { position: Vec3::new(0.0, 0.0, 1000.0), radius, color: Vec3::new(1.0, 2.0, 0.5) };
        let sum: Vec3 = (0..n)
            .map(|i| {
                let arriving = light.sample(Vec3::ZERO, uniform(i)).unwrap();
                // White reflects 1/π of the irradiance.
                arriving.weight * arriving.wi.z / PI
            })
            .sum();
        let mean = sum / n as f32;
        assert!((mean - light.color).length() < 1e-3, "{radius}: {mean}");
    }
}

#[test]
fn what_is_chosen_is_seen_with_the_same_density() {
    let light = SphereLight { position: Vec3::new(3.0, 4.0, 1.0), radius: 2.0, color: Vec3::ONE };
    let p = Vec3::new(-1.0, 0.5, 0.0);
    for i in 0..1000 {
        let arriving = light.sample(p, uniform(i)).unwrap();
        let (radiance, pdf) = light.seen(p, arriving.wi, f32::INFINITY).unwrap();
        assert!((pdf - arriving.pdf).abs() < 1e-3 * pdf);
        assert!((radiance / pdf - arriving.weight).length() < 1e-3);
        let surface = p + arriving.wi * arriving.distance;
        assert!((surface.distance(light.position) - light.radius).abs() < 1e-3, "on the sphere");
        assert!(light.seen(p, arriving.wi, arriving.distance * 0.99).is_none(), "behind what is nearer");
        assert!(light.seen(p, -arriving.wi, f32::INFINITY).is_none());
    }
    assert!(light.sample(light.position, [0.5; 2]).is_none(), "no light within");
}

/// A sky with a bright spot, a dark half and some noise.
fn sky() -> Sky {
    let [width, height] = [64, 32];
    let pixel = |at: usize| {
        let (x, y) = (at % width, at / width);
        let spot = if (x, y) == (40, 9) { 50.0 } else { 0.0 };
        let half = if y < height / 2 { 1.0 + ((x * 7 + y * 13) % 5) as f32 } else { 0.0 };
        Vec3::new(half + spot, half, half * 0.5)
    };
    Sky::image([width, height], (0..width * height).map(pixel).collect())
}

#[test]
fn the_density_of_a_sky_adds_up_to_one() {
    let sky = sky();
    let n = 1 << 20;
    let sum: f64 = (0..n).map(|i| f64::from(sky.pdf(crate::bsdf::sphere(uniform(i))))).sum();
    let total = sum / n as f64 * 4.0 * std::f64::consts::PI;
    assert!((total - 1.0).abs() < 5e-3, "{total}");
}

#[test]
fn a_sky_is_the_same_however_it_is_summed() {
    let sky = sky();
    let n = 1 << 18;
    let chosen: Vec3 =
        (0..n).filter_map(|i| sky.sample(uniform(i))).map(|a| a.weight).sum::<Vec3>() / n as f32;
    let all = |i: usize| sky.radiance(crate::bsdf::sphere(uniform(i)));
    let evenly: Vec3 = (0..n).map(all).sum::<Vec3>() / n as f32 * 4.0 * PI;
    assert!((chosen - evenly).length() < 0.02 * evenly.length(), "{chosen} {evenly}");
    for i in 0..1000 {
        let arriving = sky.sample(uniform(i)).unwrap();
        assert!((sky.pdf(arriving.wi) - arriving.pdf).abs() < 1e-2 * arriving.pdf);
    }
}

#[test]
fn directions_and_places_of_a_sky_are_each_others_inverse() {
    assert!((Sky::direction([0.5, 0.5]) - Vec3::NEG_Z).length() < 1e-6);
    assert!((Sky::direction([0.75, 0.5]) - Vec3::X).length() < 1e-6);
    assert!((Sky::direction([0.3, 0.0]) - Vec3::Y).length() < 1e-6);
    let mut pixels = vec![Vec3::ZERO; 8 * 4];
    pixels[2 * 8 + 5] = Vec3::ONE;
    let sky = Sky::image([8, 4], pixels);
    assert!((sky.radiance(Sky::direction([5.5 / 8.0, 2.5 / 4.0])) - Vec3::ONE).length() < 1e-5);
    let even = Sky::image([8, 4], vec![Vec3::splat(0.5); 32]);
    assert!((even.radiance(Vec3::new(0.3, -0.9, 0.1)) - 0.5).length() < 1e-6);
    assert_eq!(Sky::image([4, 2], vec![Vec3::NAN; 8]).radiance(Vec3::X), Vec3::ZERO);
    assert!(
        Sky::constant(Vec3::ONE).sample([0.5; 2]).is_none() && Sky::constant(Vec3::ONE).pdf(Vec3::X) == 0.0
    );
}
