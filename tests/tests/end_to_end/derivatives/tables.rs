//! Models of lookups: splines, textures, data of a point.

use super::case::{Case, In, Model, Piece, even};
use osl_tests::run;

/// The permitted relative error of slopes of `splineinverse`. Its search stops a millionth from the root, and
/// the slope of its last step has an error of up to 1.12e-3 at the points here (`bspline`, where the spline
/// is steepest).
const SEARCH: f64 = 1.5e-3;

/// A basis of splines: knots from segment to segment, coefficients of x³, x², x and 1 (OSL language
/// specification, chapter on splines).
struct Basis {
    name: &'static str,
    step: usize,
    rows: [[f64; 4]; 4],
}

const BASES: [Basis; 5] = [
    Basis {
        name: "catmull-rom",
        step: 1,
        rows: [[-0.5, 1.5, -1.5, 0.5], [1.0, -2.5, 2.0, -0.5], [-0.5, 0.0, 0.5, 0.0], [0.0, 1.0, 0.0, 0.0]],
    },
    Basis {
        name: "bezier",
        step: 3,
        rows: [[-1.0, 3.0, -3.0, 1.0], [3.0, -6.0, 3.0, 0.0], [-3.0, 3.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]],
    },
    Basis {
        name: "bspline",
        step: 1,
        rows: [
            [-1.0 / 6.0, 0.5, -0.5, 1.0 / 6.0],
            [0.5, -1.0, 0.5, 0.0],
            [-0.5, 0.0, 0.5, 0.0],
            [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0, 0.0],
        ],
    },
    Basis {
        name: "hermite",
        step: 2,
        rows: [[2.0, 1.0, -2.0, 1.0], [-3.0, -2.0, 3.0, -1.0], [0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]],
    },
    Basis {
        name: "linear",
        step: 1,
        rows: [[0.0; 4], [0.0; 4], [0.0, -1.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0]],
    },
];

impl Basis {
    fn at(&self, x: f64, knots: &[f64], p: &mut Piece) -> f64 {
        // x beyond the ends counts as the end, but keeps its derivative: outside, the model is a straight
        // line.
        let (low, high) = (p.is(x < 0.0), p.is(x > 1.0));
        let inside = if low {
            0.0
        } else if high {
            1.0
        } else {
            x
        };
        let segments = (knots.len() - 4) / self.step + 1;
        let far = inside * segments as f64;
        let segment = p.floor(far).clamp(0.0, segments as f64 - 1.0);
        let t = far - segment;
        let weights: [f64; 4] =
            std::array::from_fn(|k| self.rows.iter().fold(0.0, |sum, row| sum * t + row[k]));
        let first = segment as usize * self.step;
        (0..4).map(|k| weights[k] * knots[first + k]).sum()
    }
}

/// Seven knots that all change.
const KNOTS: &str = "{ a[0], b[0], a[1], b[1], a[2], b[2], t }";

fn knots(x: &In) -> [f64; 7] {
    [x.0[0], x.0[3], x.0[1], x.0[4], x.0[2], x.0[5], x.t()]
}

/// Rows of "Splines".
pub(crate) fn splines() -> Vec<Case> {
    let mut cases = Vec::new();
    let inside = even(0.001, 0.999).edges(-3.0, 10.0);
    let value = even(-3.0, 3.0).edges(-1e6, 1e6);
    for basis in &BASES {
        let name = basis.name;
        let model: Model = Box::new(move |x, p| [basis.at(x.s(), &knots(x), p), 0.0, 0.0]);
        let code = format!("float k[7] = {KNOTS}; f = spline(\"{name}\", s, k);");
        cases.push(Case::new("spline", &code, false, model).on(&[value, value, value, inside, value]));
        let model: Model = Box::new(move |x, p| {
            [0, 1, 2].map(|i| {
                let knots = [x.0[i], x.0[3 + i], x.0[6 + i], x.t(), x.0[i]];
                basis.at(x.s(), &knots, p)
            })
        });
        let code = format!("vector k[5] = {{ a, b, (vector)c, t, a }}; f = spline(\"{name}\", s, k);");
        cases.push(Case::new("spline", &code, true, model).on(&[value, value, value, inside, value]));
        // Rising knots with zero derivatives; the value is found by bisection.
        let rising = if basis.step == 2 {
            [0.0, 1.0, 1.0, 2.0, 3.0, 2.0, 5.0]
        } else {
            [0.0, 1.0, 2.5, 3.0, 5.0, 6.0, 7.0]
        };
        let model: Model = Box::new(move |x, p| {
            let of = |x: f64| basis.at(x, &rising, &mut Piece::default());
            let (mut low, mut high) = (0.0, 1.0);
            if p.is(x.s() <= of(0.0)) || p.is(x.s() >= of(1.0)) {
                return [0.0; 3];
            }
            for _ in 0..80 {
                let middle = 0.5 * (low + high);
                if of(middle) < x.s() { low = middle } else { high = middle }
            }
            let segments = (7 - 4) / basis.step + 1;
            p.floor(low * segments as f64);
            [low, 0.0, 0.0]
        });
        let list: Vec<String> = rising.iter().map(f64::to_string).collect();
        let code = format!("float k[7] = {{ {} }}; f = splineinverse(\"{name}\", s, k);", list.join(", "));
        let case = Case::new("splineinverse", &code, false, model).on(&[even(0.1, 6.9)]);
        cases
            .push(case.within(SEARCH, "the slope is that of the last step of a search, as in the reference"));
    }
    for case in &mut cases {
        case.inside = (8.0, "the weights of knots are sums that cancel");
    }
    cases.push(Case::zero(
        "spline",
        &format!("float k[7] = {KNOTS}; f = spline(\"constant\", s, k);"),
        false,
    ));
    cases
}

/// The average of the four nearest pixels, weighted by distance.
fn bilinear(pixels: &[f32], size: [usize; 2], s: f64, t: f64, p: &mut Piece) -> f64 {
    let [x, y] = [s * size[0] as f64 - 0.5, t * size[1] as f64 - 0.5];
    let (left, top) = (p.floor(x), p.floor(y));
    let pixel = |i: f64, j: f64| {
        let column = (i as i64).rem_euclid(size[0] as i64) as usize;
        let row = (j as i64).rem_euclid(size[1] as i64) as usize;
        f64::from(pixels[row * size[0] + column])
    };
    let (u, v) = (x - left, y - top);
    let upper = pixel(left, top) * (1.0 - u) + pixel(left + 1.0, top) * u;
    let lower = pixel(left, top + 1.0) * (1.0 - u) + pixel(left + 1.0, top + 1.0) * u;
    upper * (1.0 - v) + lower * v
}

/// The same with the sixteen nearest pixels and the cubic B-spline as weight.
fn bicubic(pixels: &[f32], size: [usize; 2], s: f64, t: f64, p: &mut Piece) -> f64 {
    let [x, y] = [s * size[0] as f64 - 0.5, t * size[1] as f64 - 0.5];
    let (left, top) = (p.floor(x), p.floor(y));
    let weight = |f: f64, k: i32| match k {
        -1 => (1.0 - f).powi(3) / 6.0,
        0 => 2.0 / 3.0 - 0.5 * f * f * (2.0 - f),
        1 => 2.0 / 3.0 - 0.5 * (1.0 - f).powi(2) * (1.0 + f),
        _ => f.powi(3) / 6.0,
    };
    let mut sum = 0.0;
    for j in -1..3 {
        for i in -1..3 {
            let column = (left as i64 + i64::from(i)).rem_euclid(size[0] as i64) as usize;
            let row = (top as i64 + i64::from(j)).rem_euclid(size[1] as i64) as usize;
            sum += weight(x - left, i) * weight(y - top, j) * f64::from(pixels[row * size[0] + column]);
        }
    }
    sum
}

/// Rows of "Textures" and "Surroundings": a lookup without footprint reads the image itself.
pub(crate) fn lookups() -> Vec<Case> {
    let path = run::root().join("tests/data/textures/tex64f.exr");
    let image = osl_image::read_image(&path).unwrap();
    let size = [image.width, image.height];
    let mut cases = Vec::new();
    type Filter = fn(&[f32], [usize; 2], f64, f64, &mut Piece) -> f64;
    for (name, filter) in [("linear", bilinear as Filter), ("cubic", bicubic)] {
        let plane = image.plane(0);
        let model: Model = Box::new(move |x, p| [filter(&plane, size, x.s(), x.t(), p), 0.0, 0.0]);
        let options = format!("\"width\", 0.0, \"interp\", \"{name}\", \"wrap\", \"periodic\"");
        let code = format!("texture(\"tex64f.exr\", s, t, {options})");
        cases.push(Case::new("texture", &code, false, model).on(&[even(-1.0, 2.0).edges(-3.0, 10.0)]));
    }
    let planes = [0, 1, 2].map(|channel| image.plane(channel));
    let model: Model =
        Box::new(move |x, p| [0, 1, 2].map(|i| bilinear(&planes[i], size, x.s() * x.t(), x.t(), p)));
    let code = "color x = texture(\"tex64f.exr\", s * t, t, \"width\", 0.0, \"interp\", \"linear\", \"wrap\", \"periodic\"); f = (vector)x;";
    cases.push(Case::new("texture", code, true, model).on(&[even(-1.0, 2.0).edges(-3.0, 10.0)]));
    for case in &mut cases {
        case.inside = (64.0, "the place within a pixel is what is left of s and t times the size in pixels");
    }
    cases.push(Case::new("getattribute", "float x = 0; getattribute(\"s\", x); f = x + 0 * s;", false, {
        Box::new(|x, _| [x.s(), 0.0, 0.0])
    }));
    cases
}
