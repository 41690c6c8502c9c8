//! Compares a case with central differences of its model.
//!
//! The slope of the model along each input is a fourth-order difference in f64. Steps differ by a factor of
//! ten; the step whose neighbour agrees best, including rounding, is used. The derivative is the sum over
//! inputs of slope times change. The tolerance is a fraction of the sum of the magnitudes of these products,
//! plus the change of the derivative itself if the inputs move by four units in the last place, which
//! arithmetic in f32 cannot distinguish after one rounding. If a function adds arguments of different
//! magnitudes, or keeps only a remainder, its case says so (`inside`): then the units are those of the
//! largest argument or of 1, and slopes may have an error of as many units of the steepest one.
//!
//! A point does not count if the model takes another piece within 1/500000 of an input (`kinks`), if no step
//! gives a slope (`unmeasured`), or if the result leaves the range of f32 (`beyond`). All three are counted,
//! and at least three quarters of the derivatives of each case must count.

use super::case::{Case, Domain, INPUTS, In, Model, Piece, TOLERANCE};
use super::source::{Point, Points, Random};
use osl_exec::RunOptions;
use osl_ir::passes;
use osl_tests::run;
use std::fmt::Write;

const EXTREMES: [f64; 25] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -0.5,
    2.0,
    -3.0,
    1e-45,
    -1e-40,
    1e-30,
    -1e-20,
    1e-10,
    1e-6,
    -1e-3,
    0.999_999_94,
    -0.999_999,
    1.000_000_1,
    10.0,
    -100.0,
    1e4,
    -1e6,
    16_777_216.0,
    1e10,
    -1e10,
];

/// The result of a case.
#[derive(Default)]
pub(crate) struct Outcome {
    pub(crate) measured: usize,
    pub(crate) kinks: usize,
    pub(crate) unmeasured: usize,
    pub(crate) beyond: usize,
    /// The largest error in units of the tolerance.
    pub(crate) worst: f64,
    /// The largest error as a fraction of the sum of contributions, without errors that the inputs' last
    /// places explain.
    pub(crate) share: f64,
    pub(crate) wrong: Vec<String>,
}

fn value(domain: Domain, random: &mut Random) -> f64 {
    if !domain.sizes {
        return random.between(domain.low, domain.high);
    }
    let size = random.between(domain.low.ln(), domain.high.ln()).exp();
    if domain.signed && random.word() & 1 == 1 { -size } else { size }
}

/// The points of a case: random ones first.
pub(crate) fn points(case: &Case) -> Vec<Point> {
    let seed = case.name().bytes().fold(7_u64, |h, b| h.wrapping_mul(31).wrapping_add(u64::from(b)));
    let mut random = Random(seed);
    let used = case.used();
    let point = |n: usize| {
        let mut x = [0.0; INPUTS];
        let mut d = [[0.0; INPUTS]; 2];
        let chosen = used.get(random.word() as usize % used.len().max(1));
        for input in &used {
            let domain = case.domain(*input);
            x[*input] = value(domain, &mut random) as f32;
            let edge = EXTREMES[random.word() as usize % EXTREMES.len()];
            let takes = chosen == Some(input) || random.word().is_multiple_of(4);
            if n >= case.points[0] && takes && domain.takes(edge) {
                x[*input] = edge as f32;
            }
            for d in &mut d {
                d[*input] = random.between(-2.0, 2.0) as f32;
                // Derivatives of zero, and small ones.
                match random.word() % 8 {
                    0 => d[*input] = 0.0,
                    1 => d[*input] *= 1e-3,
                    _ => {}
                }
            }
        }
        Point { x, d }
    };
    (0..case.points[0] + case.points[1]).map(point).collect()
}

/// The shader of a case.
pub(crate) fn shader(case: &Case) -> String {
    let ty = if case.triple { "vector" } else { "float" };
    // The text before two percent signs belongs outside the shader.
    let (outside, code) = case.code.split_once("%%").unwrap_or(("", &case.code));
    format!(
        "{outside}\nshader derivatives(output {ty} r = 0, output {ty} dx = 0, output {ty} dy = 0) {{
            point a = P; vector b = I; point c = Ps; float s = u, t = v; {ty} f = 0;
            {code}\nr = f; dx = Dx(f); dy = Dy(f); }}"
    )
}

/// Value, Dx and Dy at each point, in this order; for a float, the components after the first are zero.
///
/// # Errors
/// The messages of the compiler or the run, with the shader.
pub(crate) fn computed(case: &Case, points: &[Point]) -> Result<Vec<[[f32; 3]; 3]>, String> {
    let text = shader(case);
    let options = passes::Options::default();
    let compiled =
        run::compile("derivatives.osl", &text, &[], &options).map_err(|e| format!("{text}\n{e}"))?;
    let source = Points(points.to_vec());
    let frame = osl_exec::run(&compiled.program, &run::services(), &source, &RunOptions::default(), &|_| ())
        .map_err(|e| format!("{text}\n{e}"))?;
    if !frame.messages.is_empty() {
        return Err(format!("{text}\n{:?}", frame.messages));
    }
    let mut out = vec![[[0.0; 3]; 3]; points.len()];
    for plane in &frame.planes {
        let which = ["r", "dx", "dy"].iter().position(|name| **name == *plane.output).unwrap();
        for (out, value) in out.iter_mut().zip(plane.floats()) {
            out[which][plane.component] = value;
        }
    }
    Ok(out)
}

/// The slopes of a model along an input: for each component the best step, its estimate, and its uncertainty.
#[derive(Clone, Copy)]
struct Slope {
    step: [f64; 3],
    slope: [f64; 3],
    doubt: [f64; 3],
    /// Even the largest step changes nothing: the slope is zero within the precision of f64.
    flat: [bool; 3],
}

fn at(model: &Model, x: &In, input: usize, value: f64) -> ([f64; 3], Piece) {
    let mut x = *x;
    x.0[input] = value;
    let mut piece = Piece::default();
    let result = model(&x, &mut piece);
    (result, piece)
}

/// The fourth-order difference for a step, and the largest value; `None` across pieces.
fn difference(model: &Model, x: &In, input: usize, step: f64, piece: Piece) -> Option<([f64; 3], [f64; 3])> {
    let here = x.0[input];
    let step = (here + step) - here;
    if step == 0.0 {
        return None;
    }
    let mut f = [[0.0; 3]; 4];
    for (f, times) in f.iter_mut().zip([-2.0, -1.0, 1.0, 2.0]) {
        let (value, other) = at(model, x, input, here + times * step);
        if other != piece {
            return None;
        }
        *f = value;
    }
    let slope = [0, 1, 2].map(|c| (8.0 * (f[2][c] - f[1][c]) - (f[3][c] - f[0][c])) / (12.0 * step));
    Some((slope, [0, 1, 2].map(|c| f.iter().fold(0.0, |m: f64, f| m.max(f[c].abs())))))
}

fn slope(model: &Model, x: &In, input: usize, piece: Piece) -> Option<Slope> {
    let here = x.0[input].abs();
    // Odd steps, which do not match any lattice.
    let mut steps: Vec<f64> = (0..9).map(|k| 0.072_8 * 0.1_f64.powi(k)).collect();
    if here > 0.0 {
        steps.extend((0..8).map(|k| 0.072_8 * 0.1_f64.powi(k) * here));
    }
    steps.sort_by(|a, b| b.total_cmp(a));
    steps.dedup_by(|a, b| *a > 0.5 * *b);
    let mut best: Option<Slope> = None;
    let mut before: Option<[f64; 3]> = None;
    let mut largest = [0.0_f64; 3];
    for step in steps {
        let Some((slope, sizes)) = difference(model, x, input, step, piece) else { continue };
        // Terms that cancel at small steps are visible at large ones.
        largest = [0, 1, 2].map(|c| largest[c].max(sizes[c]));
        let rounding = largest.map(|size| 4.0 * f64::EPSILON * size / step);
        let best = best.get_or_insert(Slope {
            step: [step; 3],
            slope,
            doubt: rounding.map(|_| f64::INFINITY),
            flat: slope.map(|s| s == 0.0),
        });
        for c in 0..3 {
            let doubt = before.map_or(f64::INFINITY, |before| (slope[c] - before[c]).abs() + rounding[c]);
            if doubt < best.doubt[c] {
                (best.step[c], best.slope[c], best.doubt[c]) = (step, slope[c], doubt);
            }
        }
        before = Some(slope);
    }
    best
}

/// The apparent movement of an input by arithmetic in f32.
fn shift(case: &Case, x: &In, input: usize) -> f64 {
    let largest = case.used().iter().fold(1.0_f64, |m, i| m.max(x.0[*i].abs()));
    f64::from(f32::EPSILON) * (4.0 * x.0[input].abs() + case.inside.0 * largest)
}

/// The result for a point: the derivative along each axis for each component, and its tolerance.
enum Known {
    Kink,
    Slopes(Vec<(usize, Slope)>),
}

fn known(case: &Case, model: &Model, x: &In) -> Known {
    let piece = at(model, x, 0, x.0[0]).1;
    if piece.blurred {
        return Known::Kink;
    }
    let mut slopes = Vec::new();
    for input in case.used() {
        let here = x.0[input];
        let window = (2e-6 * here.abs() + 1e-12).max(shift(case, x, input));
        if [-window, window].iter().any(|w| at(model, x, input, here + w).1 != piece) {
            return Known::Kink;
        }
        match slope(model, x, input, piece) {
            Some(slope) => slopes.push((input, slope)),
            None => return Known::Kink,
        }
    }
    Known::Slopes(slopes)
}

/// The change of a component's derivative if the inputs move by some units in the last place.
fn unsteady(
    case: &Case,
    model: &Model,
    x: &In,
    slopes: &[(usize, Slope)],
    d: &[f32; INPUTS],
    c: usize,
) -> f64 {
    let mut total = 0.0;
    for moved in case.used() {
        let mut near = *x;
        near.0[moved] += shift(case, x, moved);
        let piece = at(model, &near, 0, near.0[0]).1;
        for (input, slope) in slopes {
            let change = f64::from(d[*input]);
            if change != 0.0
                && !case.still.contains(input)
                && let Some((there, _)) = difference(model, &near, *input, slope.step[c], piece)
            {
                total += ((there[c] - slope.slope[c]) * change).abs();
            }
        }
    }
    total
}

/// Compares a case with its model.
pub(crate) fn measure(case: &Case) -> Outcome {
    let points = points(case);
    let mut outcome = Outcome::default();
    let results = match computed(case, &points) {
        Ok(results) => results,
        Err(why) => {
            outcome.wrong.push(why);
            return outcome;
        }
    };
    for (point, result) in points.iter().zip(&results) {
        match &case.model {
            Some(model) => one(case, model, point, result, &mut outcome),
            None => {
                outcome.measured += 1;
                if result[1..].iter().flatten().any(|d| *d != 0.0) {
                    outcome.wrong.push(format!("{point:?}: {result:?} is not zero"));
                }
            }
        }
    }
    outcome
}

/// The expected value of a component of a derivative, by the slopes.
#[derive(Default)]
struct Expected {
    value: f64,
    /// Sum of the sizes of all contributions.
    size: f64,
    /// The possible error of the slopes,
    doubt: f64,
    /// and the error without slopes that are zero within the precision of f64.
    unknown: f64,
    /// The steepest slope of any component times the sum of changes.
    steepest: f64,
}

fn expected(case: &Case, slopes: &[(usize, Slope)], d: &[f32; INPUTS], c: usize) -> Expected {
    let mut expected = Expected::default();
    let (mut steepest, mut changes) = (0.0_f64, 0.0);
    for (input, slope) in slopes.iter().filter(|(input, _)| !case.still.contains(input)) {
        let change = f64::from(d[*input]);
        expected.value += slope.slope[c] * change;
        expected.size += (slope.slope[c] * change).abs();
        steepest = slope.slope.iter().fold(steepest, |m, s| m.max(s.abs()));
        changes += change.abs();
        if change != 0.0 {
            let doubt = (slope.doubt[c] * change).abs();
            expected.doubt += doubt;
            expected.unknown += if slope.flat[c] { 0.0 } else { doubt };
        }
    }
    expected.steepest = steepest * changes;
    expected
}

fn one(case: &Case, model: &Model, point: &Point, result: &[[f32; 3]; 3], outcome: &mut Outcome) {
    let share = case.tolerance.map_or(TOLERANCE, |(share, _)| share);
    let x = In(point.x.map(f64::from));
    let components = if case.triple { 3 } else { 1 };
    let slopes = match known(case, model, &x) {
        Known::Kink => {
            outcome.kinks += 2 * components;
            return;
        }
        Known::Slopes(slopes) => slopes,
    };
    for ((axis, d), result) in point.d.iter().enumerate().zip(&result[1..]) {
        for (c, got) in result.iter().take(components).enumerate() {
            let expected = expected(case, &slopes, d, c);
            let unsteady = unsteady(case, model, &x, &slopes, d, c);
            // If terms cancel, they are as large as those of the steepest input and component.
            let cancelled = case.inside.0 * f64::from(f32::EPSILON) * expected.steepest;
            let tolerance = share * expected.size + unsteady + cancelled + 1e-36;
            if expected.size.max(unsteady) > f64::from(f32::MAX) / 16.0 {
                outcome.beyond += 1;
                continue;
            }
            if expected.unknown.is_nan() || expected.unknown > 0.3 * tolerance.max(1e-12) {
                outcome.unmeasured += 1;
                continue;
            }
            let error = (f64::from(*got) - expected.value).abs();
            let explained = tolerance + expected.doubt;
            outcome.measured += 1;
            outcome.worst = outcome.worst.max(error / explained);
            let rest = error - unsteady - cancelled - expected.doubt;
            outcome.share = outcome.share.max(rest / expected.size.max(1e-30));
            // NaN is an error too.
            if error.is_nan() || error > explained {
                outcome.wrong.push(shown(case, point, axis, c, *got, &expected, tolerance));
            }
        }
    }
}

fn shown(
    case: &Case,
    point: &Point,
    axis: usize,
    c: usize,
    got: f32,
    expected: &Expected,
    tolerance: f64,
) -> String {
    let (value, d) = (expected.value, &point.d[axis]);
    let mut text = format!("component {c} along {axis}: {got:e} rather than {value:e} ± {tolerance:e} at");
    for input in case.used().into_iter().filter(|i| point.x[*i] != 0.0 || d[*i] != 0.0) {
        let _ = write!(text, " [{input}] {:e} changing {:e}", point.x[input], d[input]);
    }
    text
}
