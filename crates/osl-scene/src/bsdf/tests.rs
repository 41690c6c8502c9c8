//! Scattering conserves energy: no closure creates any, lossless closures keep all, and densities match the
//! sampled directions.

use super::*;
use osl_exec::Param;
use std::f32::consts::{PI, TAU};

/// Quasirandom numbers: each is the fraction of a multiple of an irrational number.
fn uniform(n: usize) -> [f32; 4] {
    // M. Roberts' extension of the golden ratio to four dimensions.
    const STEPS: [f64; 4] =
        [0.856_674_883_854_502_9, 0.733_891_856_627_126, 0.628_706_721_017_811_5, 0.538_597_257_223_615_1];
    STEPS.map(|s| ((0.5 + s * (n + 1) as f64).fract() as f32).min(1.0 - f32::EPSILON))
}

fn param(value: Const) -> Param {
    Param { key: None, values: [value].into_iter().collect(), closure: Vec::new() }
}

fn component(name: &str, values: Vec<Const>) -> Component {
    let params = values.into_iter().map(param).collect();
    Component { weight: [1.0; 3], name: name.into(), params }
}

const N: Const = Const::Triple([0.0, 0.0, 1.0]);

fn facets(name: &str, alpha: [f32; 2], eta: f32, how: i32) -> Component {
    let numbers = [alpha[0], alpha[1], eta].map(Const::Float);
    let mut values = vec![Const::Str(name.into()), N, Const::Triple([1.0, 0.0, 0.0])];
    values.extend(numbers);
    values.push(Const::Int(how));
    component("microfacet", values)
}

/// Closures with densities, with their names.
fn rough() -> Vec<(&'static str, Component)> {
    vec![
        ("diffuse", component("diffuse", vec![N])),
        ("oren_nayar", component("oren_nayar", vec![N, Const::Float(0.6)])),
        ("ggx", facets("ggx", [0.3, 0.3], 0.0, 0)),
        ("ggx, anisotropic", facets("ggx", [0.5, 0.15], 1.5, 0)),
        ("ggx, through", facets("ggx", [0.3, 0.3], 1.5, 1)),
        ("ggx, both", facets("ggx", [0.4, 0.4], 1.5, 2)),
        ("beckmann", facets("beckmann", [0.3, 0.3], 0.0, 0)),
        ("beckmann, both", facets("beckmann", [0.25, 0.4], 1.33, 2)),
    ]
}

fn directions() -> [Vec3; 4] {
    [0.1, 0.7, 1.2, 1.45].map(|angle: f32| Vec3::new(angle.sin() * 0.6, angle.sin() * 0.8, angle.cos()))
}

/// The share of a uniform sky's light that reaches the viewer, by sampling.
fn furnace(scatter: &Scatter, samples: usize) -> f32 {
    let mut sum = 0.0_f64;
    for n in 0..samples {
        let [choice, u @ ..] = uniform(n);
        if let Some(Next::Direction(chosen)) = scatter.next(choice, u) {
            sum += f64::from(chosen.weight.x);
        }
    }
    (sum / samples as f64) as f32
}

#[test]
fn an_even_sky_is_never_outshone() {
    for (name, component) in rough() {
        for wo in directions() {
            let share = furnace(&Scatter::new(std::slice::from_ref(&component), Vec3::Z, wo), 1 << 14);
            assert!(share <= 1.005, "{name} from {wo}: {share}");
            assert!(share > 0.01, "{name} from {wo}: {share}");
        }
    }
}

#[test]
fn what_loses_nothing_shows_the_sky_as_it_is() {
    let glass = |eta: f32| {
        vec![
            component("reflection", vec![N, Const::Float(eta)]),
            component("refraction", vec![N, Const::Float(eta)]),
        ]
    };
    let cases: Vec<(&str, Vec<Component>)> = vec![
        ("diffuse", vec![component("diffuse", vec![N])]),
        ("oren_nayar, smooth", vec![component("oren_nayar", vec![N, Const::Float(0.0)])]),
        ("mirror", vec![component("reflection", vec![N, Const::Float(0.0)])]),
        ("glass", glass(1.5)),
        ("transparent", vec![component("transparent", vec![])]),
        ("ggx, almost smooth", vec![facets("ggx", [2e-3; 2], 0.0, 0)]),
        ("ggx, almost smooth glass", vec![facets("ggx", [2e-3; 2], 1.5, 2)]),
        ("beckmann, almost smooth glass", vec![facets("beckmann", [2e-3; 2], 1.5, 2)]),
    ];
    for (name, components) in cases {
        for wo in directions() {
            let share = furnace(&Scatter::new(&components, Vec3::Z, wo), 1 << 14);
            assert!((share - 1.0).abs() < 0.01, "{name} from {wo}: {share}");
        }
    }
    // From inside, all light that is not totally reflected leaves.
    for wo in directions() {
        let share = furnace(&Scatter::new(&glass(1.5), Vec3::NEG_Z, wo), 1 << 14);
        assert!((share - 1.0).abs() < 0.01, "glass from inside, from {wo}: {share}");
    }
}

/// The direction for a position on the unit square, uniform by solid angle.
fn direction(s: f32, t: f32) -> Vec3 {
    sphere([s, t])
}

/// Bins of the histogram: in height and around.
const BINS: [usize; 2] = [16, 16];

#[test]
fn directions_are_chosen_as_their_density_says() {
    for (name, component) in rough() {
        for wo in directions() {
            let scatter = Scatter::new(std::slice::from_ref(&component), Vec3::Z, wo);
            let samples = 1 << 16;
            let mut found = vec![0.0_f64; BINS[0] * BINS[1]];
            for n in 0..samples {
                let [choice, u @ ..] = uniform(n);
                let Some(Next::Direction(chosen)) = scatter.next(choice, u) else { continue };
                let (_, density) = scatter.value(chosen.wi);
                assert!((density - chosen.pdf).abs() <= 1e-3 * density, "{name}: {density} {}", chosen.pdf);
                let height = (0.5 - 0.5 * chosen.wi.z).clamp(0.0, 0.999_99);
                let around = (chosen.wi.y.atan2(chosen.wi.x) / TAU).rem_euclid(1.0).min(0.999_99);
                found[(height * 16.0) as usize * BINS[1] + (around * 16.0) as usize] += 1.0;
            }
            let (mut chi, mut freedom, mut total) = (0.0, 0, 0.0);
            for (bin, found) in found.into_iter().enumerate() {
                let expected = samples as f64 * probability(&scatter, bin);
                total += expected;
                if expected > 20.0 {
                    chi += (found - expected).powi(2) / expected;
                    freedom += 1;
                }
            }
            assert!(total <= samples as f64 * 1.01, "{name} from {wo}: densities add up to {total}");
            // Stratified points vary less than random ones, and the integral over a bin is not exact.
            assert!(chi < 1.5 * f64::from(freedom) + 30.0, "{name} from {wo}: {chi} of {freedom}");
        }
    }
}

/// The probability of a direction in a bin: the integral of the density.
fn probability(scatter: &Scatter, bin: usize) -> f64 {
    let (row, column) = (bin / BINS[1], bin % BINS[1]);
    // At the poles, a narrow lobe covers a small part of a bin's height.
    let fine = if matches!(row, 0 | 15) { [768, 24] } else { [48, 48] };
    let mut sum = 0.0_f64;
    for n in 0..fine[0] * fine[1] {
        let part = |at: usize, step: usize, of: usize| (at as f32 + (step as f32 + 0.5) / of as f32) / 16.0;
        let wi = direction(part(row, n / fine[1], fine[0]), part(column, n % fine[1], fine[1]));
        sum += f64::from(scatter.value(wi).1);
    }
    sum / (fine[0] * fine[1]) as f64 * f64::from(4.0 * PI) / (BINS[0] * BINS[1]) as f64
}

#[test]
fn both_ways_to_integrate_agree() {
    for (name, component) in rough() {
        for wo in directions() {
            let scatter = Scatter::new(std::slice::from_ref(&component), Vec3::Z, wo);
            let evenly: f64 = (0..1 << 18)
                .map(|n| {
                    let [s, t, ..] = uniform(n);
                    f64::from(scatter.value(direction(s, t)).0.x * 4.0 * PI)
                })
                .sum::<f64>()
                / f64::from(1 << 18);
            let chosen = f64::from(furnace(&scatter, 1 << 16));
            assert!((evenly - chosen).abs() < 0.03 * chosen.max(0.2), "{name} from {wo}: {evenly} {chosen}");
        }
    }
}

#[test]
fn reflection_is_reciprocal() {
    for (name, component) in rough().into_iter().filter(|(name, _)| !name.contains("through")) {
        for (a, b) in directions().into_iter().zip(directions().into_iter().rev()) {
            let b = Vec3::new(-b.y, b.x, b.z);
            let value = |wo: Vec3, wi: Vec3| {
                Scatter::new(std::slice::from_ref(&component), Vec3::Z, wo).value(wi).0.x / wi.z
            };
            let (there, back) = (value(a, b), value(b, a));
            assert!((there - back).abs() <= 1e-3 * there.max(back).max(1e-3), "{name}: {there} {back}");
        }
    }
}

#[test]
fn fresnel_has_its_known_values() {
    assert!((fresnel::dielectric(1.0, 1.5) - 0.04).abs() < 1e-6);
    assert_eq!(fresnel::dielectric(0.0, 1.5), 1.0);
    assert_eq!(fresnel::dielectric(0.5, 0.0), 1.0, "no index is a mirror");
    assert_eq!(fresnel::dielectric(0.3, 1.0 / 1.5), 1.0, "beyond the critical angle");
    // Snell's law.
    let wo = Vec3::new(0.6, 0.0, 0.8);
    let wi = fresnel::refract(wo, Vec3::Z, 1.5).unwrap();
    assert!((wi.x + 0.4).abs() < 1e-6 && wi.z < 0.0);
}

#[test]
fn light_and_marks_are_kept_and_strangers_named() {
    let mut emission = component("emission", vec![]);
    emission.weight = [1.0, 2.0, 3.0];
    let mark = component("debug", vec![Const::Str("here".into())]);
    let scatter = Scatter::new(&[emission, mark, component("ward", vec![])], Vec3::Z, Vec3::Z);
    assert_eq!(scatter.emitted, Vec3::new(1.0, 2.0, 3.0));
    assert_eq!(scatter.marks, [("here".into(), Vec3::ONE)]);
    assert_eq!(scatter.unknown, ["ward".into()]);
    assert!(scatter.is_black() && scatter.next(0.5, [0.5; 3]).is_none());
}

#[test]
fn odd_values_of_shaders_do_no_harm() {
    let odd = [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e30];
    for x in odd {
        for name in ["diffuse", "oren_nayar", "reflection", "refraction", "subsurface"] {
            let mut one =
                component(name, vec![Const::Triple([x; 3]), Const::Float(x), Const::Triple([x; 3])]);
            one.weight = [x, 1.0, 1.0];
            let scatter = Scatter::new(&[one, facets("ggx", [x; 2], x, 2)], Vec3::Z, directions()[1]);
            for n in 0..64 {
                let [choice, u @ ..] = uniform(n);
                if let Some(Next::Direction(chosen)) = scatter.next(choice, u) {
                    assert!(!chosen.weight.is_nan() && chosen.wi.is_finite(), "{name} with {x}");
                }
            }
        }
    }
}

#[test]
fn disks_and_cosines_are_even() {
    let mean: Vec3 = (0..1 << 14).map(|n| cosine([uniform(n)[0], uniform(n)[1]])).sum::<Vec3>() / 16384.0;
    assert!((mean - Vec3::new(0.0, 0.0, 2.0 / 3.0)).length() < 2e-3, "{mean}");
    assert_eq!(disk([0.5, 0.5]), glam::Vec2::ZERO);
    assert!((disk([1.0, 0.5]).x - 1.0).abs() < 1e-6 && disk([0.5, 0.0]).y < 0.0);
}
