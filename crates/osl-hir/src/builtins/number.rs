//! Numbers: rounding, remainders, comparing, blending, stepping; per component for triples.

use super::{Builtin, Composed, Emitted, Site, T1, T2F};
use osl_ir::ir::{Builder, Kernel, Kind, LaneOp, ValueId};

pub(super) static ROWS: &[Builtin] = &[
    Builtin::lane("fmod", T2F, "a, b", LaneOp::Fmod, "Remainder of a/b with the sign of a.")
        .derivatives("da")
        .extremes(
            "b of 0 gives 0. A b that is known when compiling gives the exact remainder. Otherwise the result is \
             a - N b with N = (int)(a/b): where the quotient leaves the ints (huge a, inf, nan), N is \
             -2147483648 and the result has no meaning, though it is the same everywhere; -0 gives 0.",
        )
        .example("float y = fmod(7 * u, 2);"),
    Builtin::compose(
        "mod",
        &["i(i,i)", "p(p,p)", "v(v,v)", "n(n,n)", "c(c,c)", "p(p,f)", "v(v,f)", "n(n,f)", "c(c,f)", "f(f,f)"],
        "a, b",
        modulo,
        "Remainder of a/b with the sign of b: a - b floor(a/b). For ints the sign is that of a.",
    )
    .composed(Composed::Mod)
    .derivatives("da - floor(a/b) db")
    .extremes(
        "b of 0 gives a. A quotient that overflows counts as 0, so that mod(1e38, 1e-10) is 1e38, unless b is \
         known when compiling: then the result is -inf. Infinite a stays, infinite b gives nan; nan stays.",
    )
    .example("float phase = mod(7 * u, 1); int left = mod(-7, 3);"),
    Builtin::lane("sign", T1, "x", LaneOp::Sign, "-1, 0 or 1.")
        .derivatives("zero")
        .extremes("Both zeros give 0. Denormals count as what they are; nan gives 1.")
        .example("float side = sign(u - 0.5);"),
    Builtin::lane("floor", T1, "x", LaneOp::Floor, "Largest whole number that is not above x.")
        .derivatives("zero")
        .extremes(
            "The sign of a zero is kept; -1e-45 gives -1. From 8388608 on every float is whole. inf and nan \
             stay.",
        )
        .example("float cell = floor(8 * u);"),
    Builtin::lane("ceil", T1, "x", LaneOp::Ceil, "Smallest whole number that is not below x.")
        .derivatives("zero")
        .extremes("ceil(-0.5) is -0, 1e-45 gives 1. From 8388608 on every float is whole. inf and nan stay.")
        .example("float cell = ceil(8 * u);"),
    Builtin::lane("round", T1, "x", LaneOp::Round, "Nearest whole number, halves away from zero.")
        .derivatives("zero")
        .extremes("round(-0.4) is -0, and 0.49999997 gives 0. inf and nan stay.")
        .example("float nearest = round(8 * u);"),
    Builtin::lane("trunc", T1, "x", LaneOp::Trunc, "x without its fraction.")
        .derivatives("zero")
        .extremes("trunc(-0.5) is -0. inf and nan stay.")
        .example("float whole = trunc(8 * u - 4);"),
    Builtin::compose("abs", &["n(n)", "v(v)", "p(p)", "c(c)", "f(f)", "i(i)"], "x", abs, "Absolute value.")
        .derivatives("dx, or -dx for negative x")
        .extremes("abs(-0) is 0, abs(-inf) inf; nan stays. The int -2147483648 stays itself.")
        .example("float distance_from_middle = abs(u - 0.5);"),
    Builtin::compose(
        "fabs",
        &["n(n)", "v(v)", "p(p)", "c(c)", "f(f)", "i(i)"],
        "x",
        abs,
        "Absolute value; another name of abs.",
    )
    .derivatives("dx, or -dx for negative x")
    .extremes("As abs.")
    .example("float distance_from_middle = fabs(u - 0.5);"),
    Builtin::compose(
        "min",
        &["n(n,n)", "v(v,v)", "p(p,p)", "c(c,c)", "f(f,f)", "i(i,i)"],
        "a, b",
        min,
        "The smaller of two.",
    )
    .derivatives("of the value picked, the first of two equals")
    .extremes(
        "The first of two that are equal, so that min(0, -0) is 0, and the first if either is nan: min(nan, \
         1) is nan, min(1, nan) is 1.",
    )
    .example("float lower = min(u, v);"),
    Builtin::compose(
        "max",
        &["n(n,n)", "v(v,v)", "p(p,p)", "c(c,c)", "f(f,f)", "i(i,i)"],
        "a, b",
        max,
        "The larger of two.",
    )
    .derivatives("of the value picked, the second of two equals")
    .extremes(
        "The second of two that are equal, so that max(0, -0) is -0, but the first if either is nan: \
         max(nan, 1) is nan, max(1, nan) is 1.",
    )
    .example("float upper = max(u, v);"),
    Builtin::compose(
        "clamp",
        &["n(n,n,n)", "v(v,v,v)", "p(p,p,p)", "c(c,c,c)", "f(f,f,f)", "i(i,i,i)"],
        "x, minval, maxval",
        clamp,
        "x limited to minval to maxval: max(min(x, maxval), minval).",
    )
    .derivatives("of the value picked")
    .extremes("If minval is above maxval, the result is minval. x of nan stays nan; limits of nan do not limit.")
    .example("float inside = clamp(2 * u, 0.2, 0.8);"),
    Builtin::compose(
        "mix",
        &[
            "n(n,n,n)", "v(v,v,v)", "p(p,p,p)", "c(c,c,c)", "n(n,n,f)", "v(v,v,f)", "p(p,p,f)", "c(c,c,f)",
            "f(f,f,f)", "K(K,K,c)", "K(K,K,f)",
        ],
        "x, y, alpha",
        mix,
        "x where alpha is 0, y where alpha is 1, a straight line between and beyond: x (1 - alpha) + y alpha.",
    )
    .composed(Composed::Mix)
    .derivatives("(1 - alpha) dx + alpha dy + (y - x) dalpha; closures have none")
    .extremes(
        "alpha is not clamped. Both sides are computed: inf or nan in the one that does not count gives nan, \
         since inf times 0 is nan.",
    )
    .example("color c = mix(color(1, 0, 0), color(0, 0, 1), u);"),
    Builtin::compose(
        "select",
        &[
            "n(n,n,n)", "v(v,v,v)", "p(p,p,p)", "c(c,c,c)", "f(f,f,f)", "n(n,n,f)", "v(v,v,f)", "p(p,p,f)",
            "c(c,c,f)", "n(n,n,i)", "v(v,v,i)", "p(p,p,i)", "c(c,c,i)", "f(f,f,i)",
        ],
        "x, y, cond",
        select,
        "y where cond is not 0, else x. Component by component where cond is a triple.",
    )
    .derivatives("of the value picked")
    .extremes(
        "Both zeros are 0; a denormal and nan are not. What is not picked does not count, whatever it is.",
    )
    .example("float y = select(0.0, 1.0, u > 0.5);"),
    Builtin::compose("isnan", &["i(f)"], "x", |b, s| b.lane(LaneOp::IsNan, s.args).into(), "1 for a nan, else 0.")
        .derivatives("none: the result is an int")
        .extremes("Nans of either sign and any payload are nans.")
        .example("int bad = isnan(u);"),
    Builtin::compose(
        "isinf",
        &["i(f)"],
        "x",
        |b, s| b.lane(LaneOp::IsInf, s.args).into(),
        "1 for inf and -inf, else 0.",
    )
    .derivatives("none: the result is an int")
    .extremes("nan gives 0.")
    .example("int endless = isinf(u);"),
    Builtin::compose(
        "isfinite",
        &["i(f)"],
        "x",
        |b, s| b.lane(LaneOp::IsFinite, s.args).into(),
        "1 for a finite number, else 0.",
    )
    .derivatives("none: the result is an int")
    .extremes("Denormals are finite; inf, -inf and nan are not.")
    .example("int fine = isfinite(u);"),
    Builtin::lane(
        "step",
        &["c(c,c)", "p(p,p)", "v(v,v)", "n(n,n)", "f(f,f)"],
        "edge, x",
        LaneOp::Step,
        "0 for x below edge, else 1.",
    )
    .derivatives("zero")
    .extremes("1 at the edge itself; the zeros are equal. nan in either gives 1.")
    .example("float half_plane = step(0.5, u);"),
    Builtin::lane(
        "smoothstep",
        &["f(f,f,f)", "c(c,c,c)", "v(v,v,v)"],
        "edge0, edge1, x",
        LaneOp::Smoothstep,
        "0 below edge0, 1 from edge1 on, between them (3 - 2t) t^2 of the share t of the way.",
    )
    .derivatives("of ((3 - 2t) t) t between the edges, in which form the value is computed too; 0 outside")
    .extremes(
        "Equal edges make a step: 0 below, 1 from there on. Where edge0 is above edge1, it is a step at \
         edge0. The test against edge0 is the first. x of nan gives nan.",
    )
    .example("float y = smoothstep(0.25, 0.75, u);"),
    Builtin::lane(
        "linearstep",
        &["f(f,f,f)", "c(c,c,c)", "v(v,v,v)"],
        "edge0, edge1, x",
        LaneOp::Linearstep,
        "0 below edge0, 1 from edge1 on, a straight line between.",
    )
    .derivatives(
        "of the share of the way between the edges, (x - edge0) / (edge1 - edge0), with x clamped to them; \
         0 outside",
    )
    .extremes(
        "Equal edges make a step: 0 below, 1 from there on. Where edge0 is above edge1 it is -0 everywhere. \
         x of nan gives 0, by the guarded division.",
    )
    .example("float y = linearstep(0.25, 0.75, u);"),
    Builtin::compose(
        "smooth_linearstep",
        &["f(f,f,f,f)", "c(c,c,c,c)", "v(v,v,v,v)"],
        "edge0, edge1, x, eps",
        smooth_linearstep,
        "A straight line from 0 at edge0 to 1 at edge1, its corners rounded over eps to either side.",
    )
    .derivatives("of the piece that x lies on, by its formula; 0 outside")
    .extremes(
        "Equal edges make a step: 0 below, 1 from there on. An eps of 0 leaves the corners sharp. x of nan \
         gives nan.",
    )
    .example("float y = smooth_linearstep(0.25, 0.75, u, 0.1);"),
];

fn is_int(b: &Builder, s: &Site<'_>) -> bool {
    b.body.kind(s.arg(0)) == Kind::Int
}

/// The int form of a function, or its float form.
fn by_kind(b: &mut Builder, s: &Site<'_>, int: LaneOp, float: LaneOp) -> Emitted {
    let op = if is_int(b, s) { int } else { float };
    b.lane(op, s.args).into()
}

fn modulo(b: &mut Builder, s: &Site<'_>) -> Emitted {
    if !is_int(b, s) {
        return b.lane(LaneOp::Mod, s.args).into();
    }
    // a - b * floor(a / b) in int arithmetic, where the quotient is already whole.
    let quotient = b.lane(LaneOp::IDiv, s.args);
    let whole = b.lane(LaneOp::IMul, &[s.arg(1), quotient]);
    b.lane(LaneOp::ISub, &[s.arg(0), whole]).into()
}

fn abs(b: &mut Builder, s: &Site<'_>) -> Emitted {
    by_kind(b, s, LaneOp::IAbs, LaneOp::Abs)
}

fn min(b: &mut Builder, s: &Site<'_>) -> Emitted {
    by_kind(b, s, LaneOp::IMin, LaneOp::Min)
}

fn max(b: &mut Builder, s: &Site<'_>) -> Emitted {
    by_kind(b, s, LaneOp::IMax, LaneOp::Max)
}

fn clamp(b: &mut Builder, s: &Site<'_>) -> Emitted {
    if !is_int(b, s) {
        return b.lane(LaneOp::Clamp, s.args).into();
    }
    let below = b.lane(LaneOp::IMin, &[s.arg(0), s.arg(2)]);
    b.lane(LaneOp::IMax, &[below, s.arg(1)]).into()
}

fn select(b: &mut Builder, s: &Site<'_>) -> Emitted {
    if b.body.kind(s.arg(2)) == Kind::Int {
        return b.lane(LaneOp::Choose, &[s.arg(2), s.arg(1), s.arg(0)]).into();
    }
    b.lane(LaneOp::Select, s.args).into()
}

fn mix(b: &mut Builder, s: &Site<'_>) -> Emitted {
    if b.body.kind(s.arg(0)) != Kind::Closure {
        return b.lane(LaneOp::Mix, s.args).into();
    }
    let one = b.float(1.0);
    let rest = b.lane(LaneOp::FSub, &[one, s.arg(2)]);
    let first = b.kernel(Kernel::ClosureScale, &[s.arg(0), rest], Kind::Closure);
    let second = b.kernel(Kernel::ClosureScale, &[s.arg(1), s.arg(2)], Kind::Closure);
    b.kernel(Kernel::ClosureSum, &[first, second], Kind::Closure).into()
}

/// With x and eps in units of the ramp: 0, a parabola, the line, a parabola, 1. The parabola through the
/// origin that reaches slope 1 at `r` is z²/2r.
fn smooth_linearstep(b: &mut Builder, s: &Site<'_>) -> Emitted {
    use LaneOp as L;
    let (edge0, edge1, x, eps) = (s.arg(0), s.arg(1), s.arg(2), s.arg(3));
    let triple = b.body.kind(x) == Kind::Triple;
    let number = |b: &mut Builder, value: f32| {
        let value = b.float(value);
        if triple { b.lane(L::Splat, &[value]) } else { value }
    };
    let [zero, half, one] = [0.0, 0.5, 1.0].map(|value| number(b, value));
    let rounded = |b: &mut Builder, z: ValueId, r: ValueId| {
        let k = b.lane(L::FDiv, &[half, r]);
        let kz = b.lane(L::FMul, &[k, z]);
        b.lane(L::FMul, &[kz, z])
    };

    let width = b.lane(L::FSub, &[edge1, edge0]);
    let width = b.lane(L::FDiv, &[one, width]);
    let reach = b.lane(L::FMul, &[eps, width]);
    let above = b.lane(L::FSub, &[x, edge0]);
    let t = b.lane(L::FMul, &[above, width]);
    let twice = b.lane(L::FAdd, &[reach, reach]);
    let start = b.lane(L::FNeg, &[reach]);
    let (last, end) = (b.lane(L::FSub, &[one, reach]), b.lane(L::FAdd, &[one, reach]));

    let from_start = b.lane(L::FAdd, &[t, reach]);
    let lower = rounded(b, from_start, twice);
    let to_end = b.lane(L::FSub, &[end, t]);
    let upper = rounded(b, to_end, twice);
    let upper = b.lane(L::FSub, &[one, upper]);

    // The tests are steps, which are true for NaN as comparisons are. The test with precedence comes last.
    let past_start = b.lane(L::Step, &[reach, t]);
    let before_last = b.lane(L::Step, &[t, last]);
    let straight = b.lane(L::FMul, &[past_start, before_last]);
    let ended = b.lane(L::Step, &[end, t]);
    let outside = b.lane(L::Step, &[t, start]);
    let r = b.lane(L::Select, &[lower, upper, past_start]);
    let r = b.lane(L::Select, &[r, one, ended]);
    let r = b.lane(L::Select, &[r, t, straight]);
    let r = b.lane(L::Select, &[r, zero, outside]);

    let (up, down) = (b.lane(L::Step, &[edge0, edge1]), b.lane(L::Step, &[edge1, edge0]));
    let equal = b.lane(L::FMul, &[up, down]);
    let hard = b.lane(L::Step, &[edge0, x]);
    b.lane(L::Select, &[r, hard, equal]).into()
}
