//! The renderer: it creates no light, gives the same light in every way of sampling, and the same picture on
//! any number of threads.

#![allow(clippy::unwrap_used, clippy::expect_used, missing_docs, reason = "a test says what must hold")]

mod common;
mod scenes;

use common::{mean, picture, world};
use osl_exec::RunError;
use osl_limits::Halt;
use osl_scene::render::{RenderOptions, Strategy, render};

const CAMERA: &str = "persp_camera {\n position 0 0 4\n look_at 0 0 0\n fov 20\n}\n";
const EVEN_SKY: &str = "sky {\n name s\n color 1 1 1\n}\n";

/// A ball that fills the picture, in a uniform visible sky.
fn furnace(depth: u32) -> String {
    format!(
        "options {{\n background s\n GI_diffuse_depth {depth}\n GI_glossy_depth 60\n}}\n{CAMERA}{EVEN_SKY}\
         sphere {{\n name ball\n radius 0.6\n shader m\n}}\nmat {{\n name m\n}}\n"
    )
}

fn material(closure: &str) -> String {
    format!("surface mat() {{ Ci = {closure}; }}")
}

fn options(samples: u32) -> RenderOptions {
    RenderOptions { samples, ..RenderOptions::default() }
}

#[test]
fn in_an_even_sky_what_loses_nothing_is_not_to_be_seen() {
    for closure in [
        "diffuse(N)",
        "oren_nayar(N, 0.0)",
        "reflection(N)",
        "transparent()",
        "reflection(N, 1.5) + refraction(N, 1.5)",
        "0.25 * diffuse(N) + 0.75 * reflection(N)",
    ] {
        let picture = picture(&furnace(1), &[&material(closure)], [12, 12], options(64));
        for (share, error) in mean(&picture, |_, _| true) {
            assert!((share - 1.0).abs() < 4.0 * error + 2e-3, "{closure}: {share} ± {error}");
        }
    }
}

#[test]
fn in_an_even_sky_nothing_is_brighter_than_the_sky() {
    for closure in [
        "oren_nayar(N, 0.5)",
        "microfacet(\"ggx\", N, 0.3, 0.0, 0)",
        "microfacet(\"ggx\", N, 0.4, 1.5, 2)",
        "microfacet(\"beckmann\", N, 0.3, 1.5, 1)",
        "microfacet(\"beckmann\", N, dPdu, 0.1, 0.4, 0.0, 0)",
        "subsurface(1.4, 0.0, color(0.2), color(0.95))",
        "subsurface(1.4, 0.5, color(0.1, 0.4, 0.2), color(1, 0.5, 0.1))",
        "color(0.6, 0.3, 0.1) * diffuse(N)",
    ] {
        let picture = picture(&furnace(1), &[&material(closure)], [12, 12], options(64));
        for (share, error) in mean(&picture, |_, _| true) {
            assert!(share < 1.0 + 4.0 * error + 2e-3, "{closure}: {share} ± {error}");
            assert!(share > 0.02, "{closure}: {share}");
        }
    }
}

/// The front of the ball lets everything through, and its back is seen from inside.
#[test]
fn a_material_knows_which_side_it_is_seen_from() {
    let text = "surface mat() { Ci = transparent(); if (backfacing()) Ci = color(0, 1, 0) * emission(); }";
    let picture = picture(&furnace(1), &[text], [12, 12], options(16));
    let inside = |x: usize, y: usize| (4..8).contains(&x) && (4..8).contains(&y);
    let green = mean(&picture, inside).map(|(share, _)| share);
    assert!(green[0] < 1e-6 && green[2] < 1e-6, "{green:?}");
    assert!((green[1] - 1.0).abs() < 1e-6, "{green:?}");
}

#[test]
fn light_from_below_the_surface_has_the_color_that_was_asked_for() {
    // The medium's fit assumes flat, thick objects: here, a ball that is large relative to the mean free
    // path.
    let shader = material("subsurface(1.4, 0.0, color(0.005), color(0.8, 0.5, 0.2))");
    let text = furnace(1).replace("radius 0.6", "radius 3").replace("0 0 4", "0 0 9");
    let picture = picture(&text, &[&shader], [12, 12], options(64));
    for ((share, error), wanted) in mean(&picture, |_, _| true).into_iter().zip([0.8, 0.5, 0.2]) {
        assert!((share - wanted).abs() < 0.05 + 4.0 * error, "{share} ± {error}, not {wanted}");
    }
}

/// A ball on a floor under a lamp and a sky with a bright side.
const LIT: &str = "options {\n GI_diffuse_depth 2\n}\n\
    persp_camera {\n position 0 1.2 4\n look_at 0 0.3 0\n fov 40\n}\n\
    plane {\n name floor\n point 0 -0.6 0\n normal 0 1 0\n shader white\n}\n\
    sphere {\n name ball\n radius 0.6\n shader m\n}\nmat {\n name m\n}\nmat {\n name white\n}\n\
    point_light {\n position 2 3 2\n radius 0.7\n color 1 0.8 0.6\n}\n\
    sky {\n name s\n color around\n intensity 0.5\n}\nnight {\n name around\n}\n";
const NIGHT: &str =
    "shader night(output color c = 0) { c = 0.1 + 8 * color(0.5, 0.7, 1) * smoothstep(0.7, 0.9, I[0]); }";

#[test]
fn the_sum_of_two_ways_is_that_of_one() {
    for closure in [
        "0.8 * diffuse(N)",
        "microfacet(\"ggx\", N, 0.3, 0.0, 0)",
        "0.5 * subsurface(1.4, 0, color(0.2), color(0.8)) + 0.3 * oren_nayar(N, 0.4)",
    ] {
        let shaders = [material(closure), NIGHT.to_string()];
        let shaders: Vec<&str> = shaders.iter().map(String::as_str).collect();
        let (size, strategy) = ([16, 12], Strategy::Surfaces);
        let both = picture(LIT, &shaders, size, options(256));
        let brute = picture(LIT, &shaders, size, RenderOptions { strategy, seed: 7, ..options(2048) });
        // Every pixel has the same mean, so the mean of the differences is 0 within its error.
        for channel in 0..3 {
            let (a, b) = (&both.layers[0].planes[channel], &brute.layers[0].planes[channel]);
            let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| f64::from(a - b)).collect();
            let n = differences.len() as f64;
            let mean = differences.iter().sum::<f64>() / n;
            let deviation = (differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
            let error = deviation / n.sqrt();
            let light = b.iter().map(|x| f64::from(*x)).sum::<f64>() / n;
            assert!(mean.abs() < 4.0 * error + 1e-3 * light, "{closure}: {mean} ± {error} of {light}");
            assert!(light > 0.05, "there is light: {light}");
        }
    }
}

#[test]
fn a_picture_is_the_same_on_any_number_of_threads() {
    let shaders =
        [material("0.6 * diffuse(N) + 0.2 * reflection(N, 1.5) + 0.1 * emission()"), NIGHT.to_string()];
    let shaders: Vec<&str> = shaders.iter().map(String::as_str).collect();
    let world = world(LIT, &shaders, [70, 50]).unwrap();
    let shown = |threads: usize, options: RenderOptions| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let picture = pool.install(|| render(&world, &options, &|_| ())).unwrap();
        let words = |p: &Vec<f32>| p.iter().map(|x| x.to_bits()).collect::<Vec<u32>>();
        let layers = picture.layers.iter().flat_map(|l| l.planes.iter().map(words));
        (layers.collect::<Vec<_>>(), picture.samples, picture.rays)
    };
    for options in [options(8), RenderOptions { max_error: Some(0.02), ..options(64) }] {
        let one = shown(1, options);
        assert_eq!(one, shown(2, options), "{options:?}");
        assert_eq!(one, shown(3, options), "{options:?}");
        assert_ne!(one.0, shown(1, RenderOptions { seed: 1, ..options }).0, "another seed is other noise");
    }
}

#[test]
fn rendering_stops() {
    let shaders = [material("0.8 * diffuse(N)"), NIGHT.to_string()];
    let shaders: Vec<&str> = shaders.iter().map(String::as_str).collect();
    let world = world(LIT, &shaders, [128, 64]).unwrap();
    // The first tile that is done tells the others to stop.
    let stopped = render(&world, &options(1), &|_| world.limits.halt(Halt::Memory));
    assert!(matches!(stopped, Err(RunError::Halted(Halt::Memory))));
}

#[test]
fn samples_go_where_the_error_is() {
    let shaders = [material("0.8 * diffuse(N)"), NIGHT.to_string()];
    let shaders: Vec<&str> = shaders.iter().map(String::as_str).collect();
    let most = 0.02;
    let picture = picture(LIT, &shaders, [40, 30], RenderOptions { max_error: Some(most), ..options(4096) });
    let layer = |name: &str| &picture.layers.iter().find(|l| &*l.name == name).unwrap().planes[0];
    let (samples, error) = (layer("samples"), layer("error"));
    assert!(samples.iter().any(|n| *n < 64.0) && samples.iter().any(|n| *n > 64.0));
    let fine = samples.iter().zip(error).all(|(n, e)| *e <= most || *n >= 4096.0);
    assert!(fine, "only pixels without samples left have a larger error");
}

#[test]
fn layers_hold_what_the_camera_sees() {
    let shader = "surface mat(output float height = 0, output color tint = 0) \
                  { height = P[1]; tint = color(u, v, 0.5); \
                  Ci = color(0.2, 0.4, 0.6) * diffuse(N) + color(3, 0, 0) * debug(\"tag\") + emission(); }";
    let picture = picture(&furnace(1), &[shader], [9, 9], options(4));
    let names: Vec<&str> = picture.layers.iter().map(|l| &*l.name).collect();
    assert_eq!(names, ["", "samples", "error", "albedo", "normal", "depth", "tag", "height", "tint"]);
    let middle = 4 * 9 + 4;
    let at = |name: &str, component: usize| {
        picture.layers.iter().find(|l| &*l.name == name).unwrap().planes[component][middle]
    };
    assert!((at("albedo", 1) - 0.4).abs() < 1e-6);
    assert!((at("normal", 2) - 1.0).abs() < 0.01);
    assert!((at("depth", 0) - 3.4).abs() < 0.01);
    assert!(
        (at("tag", 0) - 3.0).abs() < 1e-6
            && at("height", 0).abs() < 0.05
            && (at("tint", 2) - 0.5).abs() < 1e-6
    );
    assert!((at("", 0) - 1.2).abs() < 0.05, "what it gives off and what it reflects: {}", at("", 0));
    assert!(picture.layers[5].planes[0][0].is_infinite(), "nothing is there");
}

#[test]
fn a_pattern_without_closure_is_a_matt_color() {
    let shader = "shader mat(output color c = color(0.25, 0.5, 1)) {}";
    let picture = picture(&furnace(1), &[shader], [5, 5], options(64));
    let light = &picture.layers[0].planes;
    for (channel, wanted) in [0.25, 0.5, 1.0].into_iter().enumerate() {
        assert!((light[channel][12] - wanted).abs() < 0.02, "{}", light[channel][12]);
    }
}
