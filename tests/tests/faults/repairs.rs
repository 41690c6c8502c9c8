//! Wrong repairs of shaders with several outputs: none passes the tests, and the right ones do.

use osl::stages::{self, NoFiles, Options};
use osl_exec::Services;
use osl_limits::Limits;
use osl_lower::params::{self, ParamValues};
use osl_measure::stability::fix::{self, Built, Changed};
use osl_measure::stability::{Base, Examined, Knob, Subject, examine_given};
use osl_scene::Grid;
use rayon::prelude::*;

/// A shader with a parameter `k`, and the line of it that is right.
struct Planted {
    k: f64,
    text: &'static str,
    wrong: &'static str,
    right: &'static str,
    /// What may be assigned to, with the size of its values.
    targets: &'static [(&'static str, f64)],
}

const PLANTED: [Planted; 3] = [
    Planted {
        k: 2000.0,
        text: "shader a(float k = 2000, output float root = 0, output float phase = 0, output color tint = 0)\n{\n    \
               float c = 1.0137 + u;\n    float disc = k * k - 4 * c;\n    WRONG\n    root = r * k;\n    \
               phase = mod(r * k * 600, 1);\n    tint = color(u, v, noise(4 * u, 4 * v));\n}\n",
        wrong: "float r = (sqrt(disc) - k) / 2;",
        right: "float r = k > 0 ? -2 * c / (sqrt(disc) + k) : (sqrt(disc) - k) / 2;",
        targets: &[("root", 1.0), ("phase", 1.0), ("tint[0]", 1.0), ("tint[1]", 1.0), ("tint[2]", 1.0)],
    },
    Planted {
        k: 1.0,
        text: "shader b(float k = 1, output float r = 0, output vector w = 0)\n{\n    \
               float swing = 0.002 * (1 + u) * k;\n    WRONG\n    w = vector(sin(3 * v), r, swing * 100);\n}\n",
        wrong: "r = 100000 * (1 - cos(swing));",
        right: "float s = sin(0.5 * swing); r = 200000 * s * s;",
        targets: &[("r", 1.0), ("w[0]", 1.0), ("w[1]", 1.0), ("w[2]", 1.0)],
    },
    Planted {
        k: 4096.0,
        text: "shader d(float k = 4096, output float r = 0, output float f = 0)\n{\n    \
               float a = k + floor(u * 64) / 64;\n    float b = k + floor(v * 64) / 64;\n    WRONG\n    \
               f = cellnoise(u * 16, v * 16);\n}\n",
        wrong: "r = a * a - b * b;",
        right: "r = (a - b) * (a + b);",
        targets: &[("r", 8192.0), ("f", 1.0)],
    },
];

fn build(changed: &Changed<'_>) -> Option<Built> {
    let checked = stages::check("s.osl", changed.text, &NoFiles, &Options::default());
    let program = checked.program?;
    let mut values = ParamValues::default();
    if let Some((name, text)) = changed.param {
        params::set(&program, &mut values, name, text).ok()?;
        values.make_live(name);
    }
    let plain = osl_lower::lower(&program, &values).ok()?;
    let noted = if changed.notes { Some(stages::lower_noted(&program, &[]).ok()?) } else { None };
    Some(Built { program, sources: checked.sources, plain, noted })
}

/// Calls a function with the test of changed texts.
fn with<T>(planted: &Planted, then: impl Fn(&(dyn Fn(&str) -> Result<(), String> + Sync)) -> T) -> T {
    let original = planted.text.replace("WRONG", planted.wrong);
    let given = || build(&Changed { text: &original, notes: true, param: None }).unwrap();
    let limits = Limits::default();
    let services = Services::default();
    let subject = |built: Built| {
        Subject::new(&services, Base::new(built.plain, built.noted.unwrap(), None, &limits), &limits)
    };
    let grid = Grid::new(32, 32);
    let built = given();
    let sources = built.sources.clone();
    let examined: Examined = examine_given(&subject(built), &grid, 0.01, &sources, "s");
    let factors = [-1.0, 0.1, 0.5, 2.0, 10.0].map(|factor| factor * planted.k);
    let mut near: Vec<String> = factors.iter().map(|x| x.to_string()).collect();
    near.extend(Knob::between([-planted.k, 10.0 * planted.k], false));
    let knobs = [Knob { name: "k".to_string(), values: Vec::new(), near }];
    then(&|text| {
        let subject = subject(given());
        fix::check(&subject, &grid, &examined, &knobs, (&original, text), &build)
    })
}

/// Numbers by chance (Knuth's MMIX generator).
struct Chance(u64);

impl Chance {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % n as u64) as usize
    }

    fn share(&mut self) -> f64 {
        self.below(1 << 20) as f64 / f64::from(1 << 20)
    }
}

/// A right repair in which one component is wrong somewhere.
fn wrong(planted: &Planted, chance: &mut Chance) -> String {
    let (target, size) = planted.targets[chance.below(planted.targets.len())];
    let strip = |name: &str, at: f64, width: f64| format!("{name} >= {at} && {name} < {}", at + width);
    // A hundredth of the range or more.
    let width = 0.01 + 0.02 * chance.share();
    let at = 0.97 * chance.share();
    let other = 0.9 * chance.share();
    let finite = chance.below(4) > 0;
    let place = match chance.below(6) {
        0 => "1".to_string(),
        1 => strip("u", at, width),
        2 => strip("v", at, width),
        3 => strip("k", planted.k * (11.0 * at - 1.0), planted.k * 11.0 * width),
        4 => format!("k == {}", planted.k * [-1.0, 0.5, 2.0, 10.0][chance.below(4)]),
        // A spot is seen where results are not finite.
        _ if !finite => format!("{} && {}", strip("u", at, 0.05), strip("v", other, 0.05)),
        _ => strip("u", at, 0.05),
    };
    let by = [0.01, 0.03, 0.1, 0.3, 1.0][chance.below(5)];
    let now = match (finite, chance.below(2)) {
        (true, 0) => format!("{target} * {} + {}", 1.0 + by, by * size),
        (true, _) => format!("{target} * {} - {}", 1.0 - by, by * size),
        (false, 0) => "exp(1000.0)".to_string(),
        (false, _) => "exp(1000.0) - exp(1000.0)".to_string(),
    };
    let text = planted.text.replace("WRONG", planted.right);
    text.replace("\n}\n", &format!("\n    if ({place}) {target} = {now};\n}}\n"))
}

#[test]
fn no_wrong_repair_passes_and_the_right_ones_do() {
    let accepted: Vec<String> = PLANTED
        .par_iter()
        .enumerate()
        .flat_map(|(index, planted)| {
            with(planted, |check| {
                check(&planted.text.replace("WRONG", planted.right)).unwrap();
                let mut chance = Chance(index as u64 + 7);
                let texts: Vec<String> = (0..67).map(|_| wrong(planted, &mut chance)).collect();
                let passes = |text: &String| {
                    let failed = check(text).err();
                    // A text that does not compile shows nothing.
                    failed.is_none_or(|why| why.contains("compile"))
                };
                texts.into_par_iter().filter(passes).collect::<Vec<String>>()
            })
        })
        .collect();
    assert!(accepted.is_empty(), "{} of 201:\n{}", accepted.len(), accepted.join("\n"));
}

/// Faults whose repair needs the value of a field, of an element or of a component, or a rule of vectors.
const PARTS: [(&str, &str); 7] = [
    (
        "float b = k * (1100 + 100 * v); hit h; h.b = b; h.disc = h.b * h.b - 4.0 * (1.0137 + u); \
         h.t = (sqrt(h.disc) - h.b) / 2; r = h.t * k;",
        "conjugate",
    ),
    (
        "float a[3] = { 0, 0, 0 }; a[0] = 0.002 * k * (0.5 + u); a[1] = 0.3 * v; a[2] = cos(a[0]); \
         r = 100000 * (1 - a[2]) + 0.01 * a[1];",
        "series",
    ),
    (
        "vector p; p[0] = 4096 * k + u; p[1] = 4096 * k + v; p[2] = k; r = p[0] * p[0] - p[1] * p[1];",
        "difference of squares",
    ),
    (
        "ray a; a.d = normalize(vector(0.6, 0.64, 0.48)); a.o = 400 * k * a.d + vector(0.3 + u, v, 0.1); \
         float t = dot(a.o, a.d); r = dot(a.o, a.o) - t * t;",
        "part across a direction",
    ),
    (
        "vector p = vector(900 + u, 900 * v, 900 * k); vector q = p + vector(u, 0.3, v) * 0.01; \
         r = dot(p, p) - 2 * dot(p, q) + dot(q, q);",
        "square of a difference",
    ),
    (
        "vector p = vector(1.3 + u, 0.7 + v, 2.1); vector q = p + 0.0002 * k * vector(v, 0.5, u); \
         r = dot(cross(p, q), vector(5000, 3000, 1000));",
        "part along a vector",
    ),
    (
        "color a = color(0.5 + 0.2 * u, 0.6, 0.7 * v + 0.2); color b = a + 0.0002 * k * color(v, u, 0.4); \
         r = 5000 * (luminance(a) - luminance(b));",
        "difference of colors",
    ),
];

#[test]
fn repairs_go_through_fields_elements_and_components() {
    PARTS.par_iter().for_each(|(body, rule)| {
        let text = format!(
            "struct hit {{ float b; float disc; float t; }};\nstruct ray {{ vector o; vector d; }};\n\
             shader s(float k = 1, output float r = 0, output float other = 0)\n{{\n    \
             other = noise(3 * u, 3 * v) + noise(7 * u, 7 * v);\n    {}\n}}\n",
            body.replace("; ", ";\n    ")
        );
        let built = build(&Changed { text: &text, notes: true, param: None }).unwrap();
        let (services, limits) = (Services::default(), Limits::default());
        let subject =
            Subject::new(&services, Base::new(built.plain, built.noted.unwrap(), None, &limits), &limits);
        let grid = Grid::new(32, 32);
        let examined = examine_given(&subject, &grid, 0.01, &built.sources, "s");
        let repair = fix::repair(&subject, &grid, &examined, &[], (&text, &built.program), &build);
        let found = repair.steps.iter().any(|step| step.name == *rule);
        assert!(found && repair.text.is_some(), "{rule}:\n{text}\n{repair:?}");
    });
}
