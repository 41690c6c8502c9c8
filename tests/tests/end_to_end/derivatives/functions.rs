//! Models of the mathematical functions, and of operators and statements.

use super::case::{Case, Domain, Piece, each, even, of_floats, of_triples, positive, sizes};
use std::f64::consts::{LN_2, LN_10, PI};

/// The range in which sines have their intended precision.
const TURNS: Domain = even(-10.0, 10.0).edges(-1e4, 1e4);
const FOLDED: &str =
    "the argument is subtracted from pi/2 or 1, and what is left again, which rounds it like 1";
/// The range in which exponentials are finite.
const EXPONENT: Domain = even(-20.0, 20.0).edges(-80.0, 80.0);

/// 2/√π times the integral of exp(-x²): its series, and from 2 on the continued fraction of its complement to
/// 1; the complement itself if `rest`.
fn error_function(x: f64, rest: bool, piece: &mut Piece) -> f64 {
    let size = x.abs();
    if piece.is(size < 2.0) {
        let (mut term, mut sum) = (x, x);
        for n in 1..60 {
            let n = f64::from(n);
            term *= -x * x / n;
            sum += term / (2.0 * n + 1.0);
        }
        let erf = sum * 2.0 / PI.sqrt();
        return if rest { 1.0 - erf } else { erf };
    }
    let mut fraction = size;
    for n in (1..80).rev() {
        fraction = size + f64::from(n) / 2.0 / fraction;
    }
    let missing = (-x * x).exp() / PI.sqrt() / fraction;
    // Both functions except for a constant.
    if piece.is(x > 0.0) == rest { missing } else { -missing }
}

fn clamped_log(x: f64, piece: &mut Piece) -> f64 {
    let low = f64::from(f32::MIN_POSITIVE);
    if piece.is(x < low) { low.ln() } else { x.ln() }
}

/// Rows of "Angles, exponentials, roots".
pub(crate) fn exponentials() -> Vec<Case> {
    let wide = sizes(1e-6, 1e6);
    // Squares of smaller numbers underflow.
    let squared = wide.least(1e-16);
    let above = positive(1e-6, 1e6);
    let mut cases =
        vec![
            each("degrees", "degrees($0)", &[wide], |x, _| x[0] * 180.0 / PI),
            each("radians", "radians($0)", &[wide], |x, _| x[0] * PI / 180.0),
            each("cos", "cos($0)", &[TURNS], |x, _| x[0].cos()),
            each("sin", "sin($0)", &[TURNS], |x, _| x[0].sin()),
            each("tan", "tan($0)", &[TURNS], |x, _| x[0].tan()),
            each("acos", "acos($0)", &[even(-1.2, 1.2)], |x, p| {
                if p.is(x[0].abs() >= 1.0) { 0.0 } else { x[0].acos() }
            }),
            each("asin", "asin($0)", &[even(-1.2, 1.2)], |x, p| {
                if p.is(x[0].abs() >= 1.0) { 0.0 } else { x[0].asin() }
            }),
            each("atan", "atan($0)", &[wide], |x, _| x[0].atan()),
            // The rule has the sign of the reference, the opposite of the slope's. Half the angle has no
            // discontinuity.
            each("atan2", "atan2($0, $1)", &[even(-5.0, 5.0), even(-5.0, 5.0)], |x, p| {
                if p.is(x[1].abs() > x[0].abs()) { -(x[0] / x[1]).atan() } else { (x[1] / x[0]).atan() }
            }),
            each("sincos", "float x = 0; sincos($0, f, x);", &[TURNS], |x, _| x[0].sin()),
            each("cosh", "cosh($0)", &[EXPONENT], |x, _| x[0].cosh()),
            each("sinh", "sinh($0)", &[EXPONENT], |x, _| x[0].sinh()),
            each("tanh", "tanh($0)", &[even(-6.0, 6.0)], |x, p| {
                // For large arguments, the complement to 1 or -1.
                match (p.is(x[0] > 1.0), p.is(x[0] < -1.0)) {
                    (true, _) => -2.0 / ((2.0 * x[0]).exp() + 1.0),
                    (_, true) => 2.0 / ((-2.0 * x[0]).exp() + 1.0),
                    _ => x[0].tanh(),
                }
            }),
            each("exp", "exp($0)", &[EXPONENT], |x, _| x[0].exp()),
            each("exp2", "exp2($0)", &[even(-30.0, 30.0).edges(-100.0, 100.0)], |x, _| (x[0] * LN_2).exp()),
            each("expm1", "expm1($0)", &[EXPONENT], |x, p| {
                if p.is(x[0] < -1.0) { x[0].exp() } else { x[0].exp_m1() }
            }),
            each("log", "log($0)", &[wide], |x, p| clamped_log(x[0], p)),
            each("log2", "log2($0)", &[wide], |x, p| clamped_log(x[0] * LN_2, p) / LN_2),
            each("log10", "log10($0)", &[wide], |x, p| clamped_log(x[0] * LN_10, p) / LN_10),
            each("sqrt", "sqrt($0)", &[wide], |x, p| if p.is(x[0] <= 0.0) { 0.0 } else { x[0].sqrt() }),
            each("inversesqrt", "inversesqrt($0)", &[wide], |x, p| {
                if p.is(x[0] <= 0.0) { 0.0 } else { 1.0 / x[0].sqrt() }
            }),
            each("cbrt", "cbrt($0)", &[wide], |x, p| {
                p.is(x[0] > 0.0);
                x[0].cbrt()
            }),
            each(
                "pow",
                "pow($0, $1)",
                &[positive(1e-3, 1e3).edges(1e-3, 1e4), even(-4.0, 4.0).edges(-10.0, 10.0).least(1e-6)],
                |x, _| (x[1] * x[0].ln()).exp(),
            ),
            each("pow", "pow($0, 3)", &[wide], |x, _| x[0].powi(3)),
            each("pow", "pow($0, -2)", &[wide], |x, p| {
                p.is(x[0] > 0.0);
                x[0].powi(-2)
            }),
        ]
        .into_iter()
        .flatten()
        .collect::<Vec<_>>();
    for case in cases.iter_mut().filter(|c| c.row == "sincos" && c.triple) {
        case.code = case.code.replace("float x", "vector x");
    }
    let bell = even(-3.0, 3.0).edges(-8.0, 8.0);
    cases.extend([
        of_floats("erf", "erf($0)", &[bell], |x, p| error_function(x[0], false, p)),
        of_floats("erfc", "erfc($0)", &[bell], |x, p| error_function(x[0], true, p)),
        of_floats("sincos", "float x = 0; sincos($0, x, f);", &[TURNS], |x, _| x[0].cos()),
        of_triples("sincos", "vector x = 0; sincos($0, x, f);", &[TURNS], |x, _| x[0].cos()),
        spread_power(),
        of_floats("log", "log($0, $1)", &[above, positive(1e-3, 1e3).edges(2.0, 1e6)], |x, p| {
            clamped_log(x[0], p) / clamped_log(x[1], p)
        }),
        of_triples("log", "log($0, 3)", &[above], |x, p| clamped_log(x[0], p) / 3.0_f64.ln()),
        of_floats("hypot", "hypot($0, $1)", &[squared, squared], |x, _| x[0].hypot(x[1])),
        of_floats("hypot", "hypot($0, $1, $2)", &[squared, squared, squared], |x, _| {
            x[0].hypot(x[1]).hypot(x[2])
        }),
    ]);
    for case in &mut cases {
        let trigonometric = ["cos", "sin", "tan", "sincos", "cosh", "sinh", "tanh"].contains(&case.row);
        if trigonometric {
            case.inside = (4.0, FOLDED);
        }
    }
    cases
}

fn spread_power() -> Case {
    let model = |x: &super::case::In, _: &mut Piece| x.a().map(|a| (x.s() * a.ln()).exp());
    Case::new("pow", "pow(a, s)", true, Box::new(model))
        .on(&[positive(1e-3, 1e3).edges(1e-3, 1e4), even(-4.0, 4.0).edges(-10.0, 10.0).least(1e-6)])
}

fn clamp(x: f64, low: f64, high: f64, p: &mut Piece) -> f64 {
    let x = if p.is(x > high) { high } else { x };
    if p.is(x < low) { low } else { x }
}

fn smoothstep(x: &[f64], p: &mut Piece) -> f64 {
    if p.is(x[2] < x[0]) {
        return 0.0;
    }
    if p.is(x[2] >= x[1]) {
        return 1.0;
    }
    let t = (x[2] - x[0]) / (x[1] - x[0]);
    (3.0 - 2.0 * t) * t * t
}

fn linearstep(x: &[f64], p: &mut Piece) -> f64 {
    if p.is(x[2] < x[0]) || p.is(x[1] <= x[0]) {
        return 0.0;
    }
    if p.is(x[2] > x[1]) { 1.0 } else { (x[2] - x[0]) / (x[1] - x[0]) }
}

fn smooth_linearstep(x: &[f64], p: &mut Piece) -> f64 {
    let width = x[1] - x[0];
    let (t, e) = ((x[2] - x[0]) / width, x[3] / width);
    let piece = [t <= -e, e <= t && t <= 1.0 - e, t >= 1.0 + e, t >= e].map(|is| p.is(is));
    match piece {
        [true, ..] => 0.0,
        [_, true, ..] => t,
        [_, _, true, _] => 1.0,
        [.., true] => 1.0 - (1.0 + e - t).powi(2) / (4.0 * e),
        _ => (t + e).powi(2) / (4.0 * e),
    }
}

/// Rows of "Rounding, comparing, blending".
pub(crate) fn numbers() -> Vec<Case> {
    let wide = sizes(1e-3, 1e3);
    let steps = [even(-2.0, 0.0), even(0.5, 2.0), even(-2.0, 2.0)];
    // Dividends for which f32 can represent part of the fraction.
    let (over, by) = (even(-20.0, 20.0).edges(-100.0, 100.0), sizes(0.5, 5.0).edges(0.5, 1e10));
    let near = [over, by];
    let mut cases: Vec<Case> = vec![
        each("mod", "mod($0, $1)", &near, |x, p| x[0] - x[1] * p.floor(x[0] / x[1])),
        each("abs", "abs($0)", &[wide], |x, p| if p.is(x[0] < 0.0) { -x[0] } else { x[0] }),
        each("fabs", "fabs($0)", &[wide], |x, p| if p.is(x[0] < 0.0) { -x[0] } else { x[0] }),
        each("min", "min($0, $1)", &[wide, wide], |x, p| if p.is(x[1] < x[0]) { x[1] } else { x[0] }),
        each("max", "max($0, $1)", &[wide, wide], |x, p| if p.is(x[1] > x[0]) { x[1] } else { x[0] }),
        each("clamp", "clamp($0, $1, $2)", &[even(-2.0, 2.0), even(-2.0, 1.0), even(-1.0, 2.0)], |x, p| {
            clamp(x[0], x[1], x[2], p)
        }),
        each("mix", "mix($0, $1, $2)", &[wide, wide, even(-1.0, 2.0)], |x, _| {
            x[0] * (1.0 - x[2]) + x[1] * x[2]
        }),
        each("select", "select($0, $1, $2)", &[wide, wide, even(-1.0, 1.0)], |x, p| {
            if p.is(x[2] != 0.0) { x[1] } else { x[0] }
        }),
        each("smoothstep", "smoothstep($0, $1, $2)", &steps, smoothstep),
        each("linearstep", "linearstep($0, $1, $2)", &steps, linearstep),
        each(
            "smooth_linearstep",
            "smooth_linearstep($0, $1, $2, $3)",
            &[steps[0], steps[1], steps[2], even(0.05, 0.2).edges(1e-3, 0.2)],
            smooth_linearstep,
        ),
    ]
    .into_iter()
    .flatten()
    .collect();
    cases.push(
        Case::new(
            "select",
            "select(a, b, s > t)",
            true,
            Box::new(|x, p| if p.is(x.s() > x.t()) { x.b() } else { x.a() }),
        )
        .on(&[wide]),
    );
    for case in cases.iter_mut().filter(|c| c.row.contains("step")) {
        case.inside = (4.0, "differences of arguments round like the largest of them");
    }
    // The divisor's derivative does not contribute, by the rule of the function.
    let remainder: fn(&[f64], &mut Piece) -> f64 = |x, p| {
        p.is(x[0] < 0.0);
        p.note((x[0] / x[1]).trunc() as i64);
        x[0] % x[1]
    };
    cases.push(of_floats("transformu", "transformu(\"in\", \"m\", $0)", &[wide], |x, _| x[0] * 0.0254));
    cases.push(of_floats("fmod", "fmod($0, $1)", &near, remainder).still(&[10]));
    cases.push(of_triples("fmod", "fmod($0, $1)", &near, remainder).still(&[3, 4, 5]));
    for call in ["logb", "floor", "ceil", "round", "trunc", "sign"] {
        cases.push(Case::zero(call, &format!("{call}(s)"), false));
        cases.push(Case::zero(call, &format!("{call}(a)"), true));
    }
    cases.push(Case::zero("step", "step(s, t)", false));
    cases.push(Case::zero("step", "step(a, b)", true));
    cases
}

/// Expressions and statements without calls.
pub(crate) fn operators() -> Vec<Case> {
    let wide = sizes(1e-3, 1e3);
    let divisor = sizes(1e-3, 1e3).edges(0.5, 1e10);
    let row = "operator";
    let mut cases: Vec<Case> = vec![
        each(row, "$0 + $1", &[wide, wide], |x, _| x[0] + x[1]),
        each(row, "$0 - $1", &[wide, wide], |x, _| x[0] - x[1]),
        each(row, "$0 * $1", &[wide, wide], |x, _| x[0] * x[1]),
        each(row, "$0 / $1", &[wide, divisor], |x, p| {
            p.is(x[1] > 0.0);
            x[0] / x[1]
        }),
        each(row, "$0 / 3", &[wide], |x, _| x[0] / 3.0),
        each(row, "-$0", &[wide], |x, _| -x[0]),
        each(row, "f = $0; f += $1; f *= $1; f -= $0;", &[wide, wide], |x, _| (x[0] + x[1]) * x[1] - x[0]),
    ]
    .into_iter()
    .flatten()
    .collect();
    let mut add = |code: &str, triple: bool, model: super::case::Model| {
        cases.push(Case::new("statement", code, triple, model).on(&[even(-3.0, 3.0)]));
    };
    add("a * s", true, Box::new(|x, _| x.a().map(|a| a * x.s())));
    add("s - a", true, Box::new(|x, _| x.a().map(|a| x.s() - a)));
    add("a[1] * a[2]", false, Box::new(|x, _| [x.0[1] * x.0[2], 0.0, 0.0]));
    add("a.x + b.y * c.z", false, Box::new(|x, _| [x.0[0] + x.0[4] * x.0[8], 0.0, 0.0]));
    add("f = a; f[1] = s * t; f[2] *= s;", true, Box::new(|x, _| [x.0[0], x.s() * x.t(), x.0[2] * x.s()]));
    add(
        "int k = int(abs(s)) % 3; f = a; f[k] = t;",
        true,
        Box::new(|x, p| {
            let mut f = x.a();
            f[p.floor(x.s().abs()) as usize % 3] = x.t();
            f
        }),
    );
    add("vector(s, s * t, t)", true, Box::new(|x, _| [x.s(), x.s() * x.t(), x.t()]));
    add("color k = color(s) * t; f = (vector)k;", true, Box::new(|x, _| [x.s() * x.t(); 3]));
    add("(vector)(normal)(a * 2)", true, Box::new(|x, _| x.a().map(|a| 2.0 * a)));
    add(
        "s > t ? s * t : s + t",
        false,
        Box::new(|x, p| [if p.is(x.s() > x.t()) { x.s() * x.t() } else { x.s() + x.t() }, 0.0, 0.0]),
    );
    add(
        "if (s > t) f = a * s; else f = b - t;",
        true,
        Box::new(
            |x, p| {
                if p.is(x.s() > x.t()) { x.a().map(|a| a * x.s()) } else { x.b().map(|b| b - x.t()) }
            },
        ),
    );
    add(
        "f = s; for (int i = 0; i < 5; i++) f = f * t + s;",
        false,
        Box::new(|x, _| [(0..5).fold(x.s(), |f, _| f * x.t() + x.s()), 0.0, 0.0]),
    );
    add(
        "f = s * s; while (f < 20) f = f * 2 + t * t + 1;",
        false,
        Box::new(|x, p| {
            let mut f = x.s() * x.s();
            while p.is(f < 20.0) {
                f = f * 2.0 + x.t() * x.t() + 1.0;
            }
            [f, 0.0, 0.0]
        }),
    );
    add(
        "float k[4] = { s, t, s * t, a[0] }; k[int(abs(s))] = t * t; f = k[0] + k[1] * k[2] + k[3];",
        false,
        {
            Box::new(|x, p| {
                let mut k = [x.s(), x.t(), x.s() * x.t(), x.0[0]];
                k[p.floor(x.s().abs()).min(3.0) as usize] = x.t() * x.t();
                [k[0] + k[1] * k[2] + k[3], 0.0, 0.0]
            })
        },
    );
    add(
        "vector k[3] = { a, b, (vector)c }; k[1] = k[0] * k[2]; f = k[int(abs(t))];",
        true,
        Box::new(|x, p| {
            let k = [x.a(), [0, 1, 2].map(|i| x.0[i] * x.0[6 + i]), x.c()];
            k[p.floor(x.t().abs()).min(2.0) as usize]
        }),
    );
    // Edges outside the arrays.
    for case in cases.iter_mut().filter(|c| c.code.contains("abs(") || c.code.contains("while")) {
        case.domains = [even(-2.9, 2.9).edges(-2.9, 2.9); 5];
    }
    cases.extend(structures());
    cases
}

/// Structs, functions with outputs, and returns.
fn structures() -> Vec<Case> {
    let mut add = Vec::new();
    add.push(Case::new(
        "statement",
        "struct Pair { float x; vector y; }; %% Pair k; k.x = s * t; k.y = a * k.x; f = k.y + k.x;",
        true,
        Box::new(|x, _| x.a().map(|a| a * x.s() * x.t() + x.s() * x.t())),
    ));
    add.push(Case::new(
        "statement",
        "float half_way(float x, float t, output float y) { y = x * t; if (x > 0) return y * y; return -x; } %%
         float y = 0; f = half_way(s, t, y); f += y;",
        false,
        Box::new(|x, p| {
            let y = x.s() * x.t();
            [if p.is(x.s() > 0.0) { y * y } else { -x.s() } + y, 0.0, 0.0]
        }),
    ));
    add
}
