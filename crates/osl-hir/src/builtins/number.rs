//! Numbers: rounding, remainders, comparing, blending, stepping; per component for triples.

use super::{Builtin, Emitted, Site, T1, T2F};
use osl_ir::ir::{Builder, Kernel, Kind, LaneOp, ValueId};

pub(super) static ROWS: &[Builtin] = &[
    Builtin::lane(
        "fmod",
        T2F,
        "a, b",
        LaneOp::Fmod,
        "Returns the remainder of `a` / `b`, with the sign of `a`.",
    )
    .derivatives("da")
    .extremes(
        "If `b` is 0, the result is 0; but in a triple `b` that is known when compiling and has another \
         component than 0, a component of 0 gives nan. If `b` is known when compiling, the remainder is \
         exact. Otherwise the result is a - N b with N = (int)(a/b), and a zero may have either sign. If the \
         quotient does not fit in an int (huge `a`, inf, nan), N is -2147483648: the result then has \
         no meaning, but is the same everywhere.",
    )
    .example("float y = fmod(7 * u, 2);"),
    Builtin::compose(
        "mod",
        &["i(i,i)", "p(p,p)", "v(v,v)", "n(n,n)", "c(c,c)", "p(p,f)", "v(v,f)", "n(n,f)", "c(c,f)", "f(f,f)"],
        "a, b",
        modulo,
        "Returns the remainder of `a` / `b`, with the sign of `b`: a - b floor(a/b). For ints the \
         remainder has the sign of `a`.",
    )
    .derivatives("da - floor(a/b) db")
    .extremes(
        "If `b` is 0, the result is `a`, for ints too; but in a triple `b` that is known when compiling \
         and has another component than 0, a component of 0 gives nan. A quotient that overflows counts as 0, so mod(1e38, 1e-10) \
         is 1e38; but if `b` is known when compiling, the result is -inf. An infinite `a` gives `a`, \
         or nan if `b` is known when compiling. An infinite `b` gives nan. nan gives nan.",
    )
    .example("float phase = mod(7 * u, 1); int left = mod(-7, 3);"),
    Builtin::lane(
        "sign",
        T1,
        "x",
        LaneOp::Sign,
        "Returns -1 if `x` is negative, 0 if it is 0, and 1 if it is positive.",
    )
    .derivatives("zero")
    .extremes("0 and -0 give 0. Denormals are not 0 and give -1 or 1. nan gives 1.")
    .example("float side = sign(u - 0.5);"),
    Builtin::lane(
        "floor",
        T1,
        "x",
        LaneOp::Floor,
        "Returns the largest whole number that is not greater than `x`.",
    )
    .derivatives("zero")
    .extremes(
        "A zero keeps its sign. -1e-45 gives -1. From 8388608 on every float is a whole number. inf, \
         -inf and nan are returned unchanged.",
    )
    .example("float cell = floor(8 * u);"),
    Builtin::lane(
        "ceil",
        T1,
        "x",
        LaneOp::Ceil,
        "Returns the smallest whole number that is not less than `x`.",
    )
    .derivatives("zero")
    .extremes(
        "ceil(-0.5) is -0, and 1e-45 gives 1. From 8388608 on every float is a whole number. inf, \
         -inf and nan are returned unchanged.",
    )
    .example("float cell = ceil(8 * u);"),
    Builtin::lane(
        "round",
        T1,
        "x",
        LaneOp::Round,
        "Returns the whole number nearest to `x`; halves are rounded away from zero.",
    )
    .derivatives("zero")
    .extremes("round(-0.4) is -0, and 0.49999997 gives 0. inf, -inf and nan are returned unchanged.")
    .example("float nearest = round(8 * u);"),
    Builtin::lane("trunc", T1, "x", LaneOp::Trunc, "Returns `x` without its fraction.")
        .derivatives("zero")
        .extremes("trunc(-0.5) is -0. inf, -inf and nan are returned unchanged.")
        .example("float whole = trunc(8 * u - 4);"),
    Builtin::compose(
        "abs",
        &["n(n)", "v(v)", "p(p)", "c(c)", "f(f)", "i(i)"],
        "x",
        abs,
        "Returns the absolute value of `x`.",
    )
    .derivatives("dx, or -dx where x is negative")
    .extremes(
        "abs(-0) is 0, and abs(-inf) is inf. nan gives nan. The int -2147483648 is returned \
         unchanged, since no int is its absolute value.",
    )
    .example("float distance_from_middle = abs(u - 0.5);"),
    Builtin::compose(
        "fabs",
        &["n(n)", "v(v)", "p(p)", "c(c)", "f(f)", "i(i)"],
        "x",
        abs,
        "Returns the absolute value of `x`; another name of abs.",
    )
    .derivatives("dx, or -dx where x is negative")
    .extremes("The result is that of abs.")
    .example("float distance_from_middle = fabs(u - 0.5);"),
    Builtin::compose(
        "min",
        &["n(n,n)", "v(v,v)", "p(p,p)", "c(c,c)", "f(f,f)", "i(i,i)"],
        "a, b",
        min,
        "Returns the smaller of `a` and `b`.",
    )
    .derivatives("those of the argument that is returned; of a if both are equal")
    .extremes(
        "If both are equal, the result is `a`, so min(0, -0) is 0. If one of them is nan, the result \
         is also `a`: min(nan, 1) is nan, and min(1, nan) is 1.",
    )
    .example("float lower = min(u, v);"),
    Builtin::compose(
        "max",
        &["n(n,n)", "v(v,v)", "p(p,p)", "c(c,c)", "f(f,f)", "i(i,i)"],
        "a, b",
        max,
        "Returns the larger of `a` and `b`.",
    )
    .derivatives("those of the argument that is returned; of b if both are equal")
    .extremes(
        "If both are equal, the result is `b`, so max(0, -0) is -0. But if one of them is nan, the \
         result is `a`: max(nan, 1) is nan, and max(1, nan) is 1.",
    )
    .example("float upper = max(u, v);"),
    Builtin::compose(
        "clamp",
        &["n(n,n,n)", "v(v,v,v)", "p(p,p,p)", "c(c,c,c)", "f(f,f,f)", "i(i,i,i)"],
        "x, minval, maxval",
        clamp,
        "Limits `x` to the range from `minval` to `maxval`: max(min(x, maxval), minval).",
    )
    .derivatives("those of the argument that is returned")
    .extremes(
        "If `minval` is greater than `maxval`, the result is `minval`. If `x` is nan, the result is \
         nan. A limit that is nan has no effect.",
    )
    .example("float inside = clamp(2 * u, 0.2, 0.8);"),
    Builtin::compose(
        "mix",
        &[
            "n(n,n,n)", "v(v,v,v)", "p(p,p,p)", "c(c,c,c)", "n(n,n,f)", "v(v,v,f)", "p(p,p,f)", "c(c,c,f)",
            "f(f,f,f)", "K(K,K,c)", "K(K,K,f)",
        ],
        "x, y, alpha",
        mix,
        "Blends `x` and `y` by `alpha`: x (1 - alpha) + y alpha. The result is `x` where `alpha` is \
         0, and `y` where it is 1.",
    )
    .derivatives("(1 - alpha) dx + alpha dy + (y - x) dalpha; closures have none")
    .extremes(
        "`alpha` is not clamped: outside 0 to 1 the straight line continues. Both terms are always \
         computed, so inf or nan in the term with weight 0 gives nan, since inf times 0 is nan.",
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
        "Returns `y` where `cond` is not 0, else `x`. If `cond` is a triple, it selects component by \
         component.",
    )
    .derivatives("those of the argument that is returned")
    .extremes(
        "0 and -0 count as 0; denormals and nan do not. The value that is not selected has no effect, \
         even if it is inf or nan.",
    )
    .example("float y = select(0.0, 1.0, u > 0.5);"),
    Builtin::compose(
        "isnan",
        &["i(f)"],
        "x",
        |b, s| b.lane(LaneOp::IsNan, s.args).into(),
        "Returns 1 if `x` is nan, else 0.",
    )
    .derivatives("none: the result is an int")
    .extremes("A nan counts whatever its sign and its payload are.")
    .example("int bad = isnan(u);"),
    Builtin::compose(
        "isinf",
        &["i(f)"],
        "x",
        |b, s| b.lane(LaneOp::IsInf, s.args).into(),
        "Returns 1 if `x` is inf or -inf, else 0.",
    )
    .derivatives("none: the result is an int")
    .extremes("nan gives 0.")
    .example("int endless = isinf(u);"),
    Builtin::compose(
        "isfinite",
        &["i(f)"],
        "x",
        |b, s| b.lane(LaneOp::IsFinite, s.args).into(),
        "Returns 1 if `x` is finite, else 0.",
    )
    .derivatives("none: the result is an int")
    .extremes("Denormals are finite; inf, -inf and nan are not.")
    .example("int fine = isfinite(u);"),
    Builtin::lane(
        "step",
        &["c(c,c)", "p(p,p)", "v(v,v)", "n(n,n)", "f(f,f)"],
        "edge, x",
        LaneOp::Step,
        "Returns 0 if `x` is less than `edge`, else 1.",
    )
    .derivatives("zero")
    .extremes("At the edge itself the result is 1. 0 and -0 are equal. nan in `edge` or `x` gives 1.")
    .example("float half_plane = step(0.5, u);"),
    Builtin::compose(
        "smoothstep",
        &["f(f,f,f)", "c(c,c,c)", "v(v,v,v)"],
        "edge0, edge1, x",
        |b, s| by_component(b, s, &|b, args| b.lane(LaneOp::Smoothstep, args)),
        "Returns 0 below `edge0`, 1 from `edge1` on, and a smooth transition in between. The \
         transition is (3 - 2t) t^2, where t is the fraction of the way from `edge0` to `edge1`.",
    )
    .derivatives(
        "those of ((3 - 2t) t) t between the edges, which is also the form in which the value is \
         computed; 0 outside",
    )
    .extremes(
        "If the edges are equal, the result is a step: 0 below the edge, 1 from there on. If `edge0` \
         is greater than `edge1`, the result is a step at `edge0`, because the test against `edge0` \
         comes first. If `x` is nan, the result is nan.",
    )
    .example("float y = smoothstep(0.25, 0.75, u);"),
    Builtin::compose(
        "linearstep",
        &["f(f,f,f)", "c(c,c,c)", "v(v,v,v)"],
        "edge0, edge1, x",
        |b, s| by_component(b, s, &|b, args| b.lane(LaneOp::Linearstep, args)),
        "Returns 0 below `edge0`, 1 from `edge1` on, and a straight line in between.",
    )
    .derivatives("those of (x - edge0) / (edge1 - edge0), with x clamped to the edges; 0 outside")
    .extremes(
        "If the edges are equal, the result is a step: 0 below the edge, 1 from there on. If `edge0` \
         is greater than `edge1`, the result is -0 everywhere. If `x` is nan, the result is 0, \
         because a quotient that is not finite counts as 0; it is 1 if the edges are equal.",
    )
    .example("float y = linearstep(0.25, 0.75, u);"),
    Builtin::compose(
        "smooth_linearstep",
        &["f(f,f,f,f)", "c(c,c,c,c)", "v(v,v,v,v)"],
        "edge0, edge1, x, eps",
        |b, s| by_component(b, s, &smooth_linearstep),
        "Returns a straight line from 0 at `edge0` to 1 at `edge1`, with rounded corners. The corners \
         are rounded over the distance `eps` on both sides.",
    )
    .derivatives("those of the formula for the piece on which x lies; 0 outside")
    .extremes(
        "If the edges are equal, the result is a step: 0 below the edge, 1 from there on. An `eps` of \
         0 leaves the corners sharp. If `x` is nan, the result is 0, or 1 if the edges are equal.",
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

/// A function of numbers, for triples component by component: each component has derivatives of its own.
fn by_component(
    b: &mut Builder,
    s: &Site<'_>,
    function: &dyn Fn(&mut Builder, &[ValueId]) -> ValueId,
) -> Emitted {
    if b.body.kind(s.arg(0)) != Kind::Triple {
        return function(b, s.args).into();
    }
    let parts = [LaneOp::X, LaneOp::Y, LaneOp::Z].map(|part| {
        let args: Vec<ValueId> = s.args.iter().map(|arg| b.lane(part, &[*arg])).collect();
        function(b, &args)
    });
    b.lane(LaneOp::Triple, &parts).into()
}

/// With x and eps in units of the ramp: 0, a parabola, the line, a parabola, 1. The parabola through the
/// origin that reaches slope 1 at `r` is z²/2r.
fn smooth_linearstep(b: &mut Builder, args: &[ValueId]) -> ValueId {
    use LaneOp as L;
    let [edge0, edge1, x, eps] = *args else { return b.float(0.0) };
    let [zero, half, one] = [0.0, 0.5, 1.0].map(|value| b.float(value));
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

    let differ = b.lane(L::FNe, &[edge0, edge1]);
    let hard = b.lane(L::Step, &[edge0, x]);
    b.lane(L::Choose, &[differ, r, hard])
}
