//! Mathematics: one number in, one number out, per component for triples.

use super::{Builtin, Emitted, Site, T1, T2, T2F};
use crate::ir::{Builder, Kernel, Kind, LaneOp};

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose("degrees", T1, degrees, "Radians in degrees: x times 57.2957764."),
    Builtin::compose("radians", T1, radians, "Degrees in radians: x times 0.0174532924."),
    Builtin::lane("cos", T1, LaneOp::Cos, "Cosine of an angle in radians."),
    Builtin::lane("sin", T1, LaneOp::Sin, "Sine of an angle in radians."),
    Builtin::lane("tan", T1, LaneOp::Tan, "Tangent of an angle in radians."),
    Builtin::lane(
        "acos",
        T1,
        LaneOp::Acos,
        "Angle in radians, 0 to pi, of a cosine; arguments are clamped to -1 to 1.",
    ),
    Builtin::lane(
        "asin",
        T1,
        LaneOp::Asin,
        "Angle in radians, -pi/2 to pi/2, of a sine; arguments are clamped to -1 to 1.",
    ),
    Builtin::lane("atan", T1, LaneOp::Atan, "Angle in radians, -pi/2 to pi/2, of a tangent."),
    Builtin::lane(
        "atan2",
        T2,
        LaneOp::Atan2,
        "Angle in radians, -pi to pi, of the point (x, y); arguments are y, x.",
    ),
    Builtin::compose(
        "sincos",
        &["x(f,of,of)", "x(c,oc,oc)", "x(p,op,op)", "x(v,ov,ov)", "x(n,on,on)"],
        sincos,
        "Sine and cosine of an angle in radians, in two outputs.",
    ),
    Builtin::lane("cosh", T1, LaneOp::Cosh, "Hyperbolic cosine."),
    Builtin::lane("sinh", T1, LaneOp::Sinh, "Hyperbolic sine."),
    Builtin::lane("tanh", T1, LaneOp::Tanh, "Hyperbolic tangent."),
    Builtin::lane("exp", T1, LaneOp::Exp, "e to the x; results stay between 1.2e-38 and 8.5e37."),
    Builtin::lane("exp2", T1, LaneOp::Exp2, "2 to the x; x is clamped to -126 to 126."),
    Builtin::lane("expm1", T1, LaneOp::Expm1, "e to the x, less 1; exact near 0."),
    Builtin::compose(
        "log",
        &["n(n)", "v(v)", "p(p)", "c(c)", "f(f)", "p(p,f)", "v(v,f)", "c(c,f)", "f(f,f)"],
        log,
        "Natural logarithm, or that to the base of the second argument; x is clamped to the normal numbers.",
    ),
    Builtin::lane("log2", T1, LaneOp::Log2, "Logarithm to the base 2; x is clamped to the normal numbers."),
    Builtin::lane(
        "log10",
        T1,
        LaneOp::Log10,
        "Logarithm to the base 10; x is clamped to the normal numbers.",
    ),
    Builtin::lane("logb", T1, LaneOp::Logb, "Exponent of x, as a float; -126 for 0."),
    Builtin::lane("sqrt", T1, LaneOp::Sqrt, "Square root; 0 for negative x."),
    Builtin::lane("inversesqrt", T1, LaneOp::InverseSqrt, "One over the square root; 0 for x of 0 or less."),
    Builtin::lane("cbrt", T1, LaneOp::Cbrt, "Cube root, of negative numbers too."),
    Builtin::lane(
        "pow",
        &["n(n,n)", "v(v,v)", "p(p,p)", "c(c,c)", "n(n,f)", "v(v,f)", "p(p,f)", "c(c,f)", "f(f,f)"],
        LaneOp::Pow,
        "x to the y; 0 for negative x with a fractional y, and for x of 0 with y other than 0.",
    ),
    Builtin::lane("fmod", T2F, LaneOp::Fmod, "Remainder of a/b with the sign of a; 0 for b of 0."),
    Builtin::compose(
        "mod",
        &["i(i,i)", "p(p,p)", "v(v,v)", "n(n,n)", "c(c,c)", "p(p,f)", "v(v,f)", "n(n,f)", "c(c,f)", "f(f,f)"],
        modulo,
        "Remainder of a/b with the sign of b; a for b of 0. For ints the sign is that of a.",
    ),
    Builtin::lane("sign", T1, LaneOp::Sign, "-1, 0 or 1."),
    Builtin::lane("floor", T1, LaneOp::Floor, "Largest whole number that is not above x."),
    Builtin::lane("ceil", T1, LaneOp::Ceil, "Smallest whole number that is not below x."),
    Builtin::lane("round", T1, LaneOp::Round, "Nearest whole number, halves away from zero."),
    Builtin::lane("trunc", T1, LaneOp::Trunc, "x without its fraction."),
    Builtin::compose("abs", &["n(n)", "v(v)", "p(p)", "c(c)", "f(f)", "i(i)"], abs, "Absolute value."),
    Builtin::compose("fabs", &["n(n)", "v(v)", "p(p)", "c(c)", "f(f)", "i(i)"], abs, "Absolute value."),
    Builtin::compose(
        "min",
        &["n(n,n)", "v(v,v)", "p(p,p)", "c(c,c)", "f(f,f)", "i(i,i)"],
        min,
        "The smaller of two; the first if they cannot be compared.",
    ),
    Builtin::compose(
        "max",
        &["n(n,n)", "v(v,v)", "p(p,p)", "c(c,c)", "f(f,f)", "i(i,i)"],
        max,
        "The larger of two; the first if they cannot be compared.",
    ),
    Builtin::compose(
        "clamp",
        &["n(n,n,n)", "v(v,v,v)", "p(p,p,p)", "c(c,c,c)", "f(f,f,f)", "i(i,i,i)"],
        clamp,
        "x limited to lo to hi; lo wins if it is above hi.",
    ),
    Builtin::compose(
        "mix",
        &[
            "n(n,n,n)", "v(v,v,v)", "p(p,p,p)", "c(c,c,c)", "n(n,n,f)", "v(v,v,f)", "p(p,p,f)", "c(c,c,f)",
            "f(f,f,f)", "K(K,K,c)", "K(K,K,f)",
        ],
        mix,
        "a where t is 0, b where t is 1, a straight line between and beyond: a(1-t) + bt.",
    ),
    Builtin::compose(
        "select",
        &[
            "n(n,n,n)", "v(v,v,v)", "p(p,p,p)", "c(c,c,c)", "f(f,f,f)", "n(n,n,f)", "v(v,v,f)", "p(p,p,f)",
            "c(c,c,f)", "n(n,n,i)", "v(v,v,i)", "p(p,p,i)", "c(c,c,i)", "f(f,f,i)",
        ],
        select,
        "b where c is not 0, else a.",
    ),
    Builtin::compose("isnan", &["i(f)"], |b, s| b.lane(LaneOp::IsNan, s.args).into(), "1 for a NaN, else 0."),
    Builtin::compose(
        "isinf",
        &["i(f)"],
        |b, s| b.lane(LaneOp::IsInf, s.args).into(),
        "1 for an infinity, else 0.",
    ),
    Builtin::compose(
        "isfinite",
        &["i(f)"],
        |b, s| b.lane(LaneOp::IsFinite, s.args).into(),
        "1 for a finite number, else 0.",
    ),
    Builtin::lane("erf", &["f(f)"], LaneOp::Erf, "Error function."),
    Builtin::lane("erfc", &["f(f)"], LaneOp::Erfc, "1 less the error function."),
    Builtin::compose("hypot", &["f(f,f)", "f(f,f,f)"], hypot, "Square root of the sum of squares."),
    Builtin::lane(
        "step",
        &["c(c,c)", "p(p,p)", "v(v,v)", "n(n,n)", "f(f,f)"],
        LaneOp::Step,
        "0 below the edge, else 1; arguments are edge, x.",
    ),
    Builtin::lane(
        "smoothstep",
        &["f(f,f,f)", "c(c,c,c)", "v(v,v,v)"],
        LaneOp::Smoothstep,
        "0 below edge0, 1 from edge1 on, a smooth cubic between; arguments are edge0, edge1, x.",
    ),
    Builtin::lane(
        "linearstep",
        &["f(f,f,f)", "c(c,c,c)", "v(v,v,v)"],
        LaneOp::Linearstep,
        "0 below edge0, 1 from edge1 on, a straight line between; arguments are edge0, edge1, x.",
    ),
    Builtin::lane(
        "smooth_linearstep",
        &["f(f,f,f,f)", "c(c,c,c,c)", "v(v,v,v,v)"],
        LaneOp::SmoothLinearstep,
        "A straight line from 0 at edge0 to 1 at edge1, its corners rounded over eps to either side; arguments are edge0, edge1, x, eps.",
    ),
];

fn degrees(b: &mut Builder, s: &Site<'_>) -> Emitted {
    scaled(b, s, f32::from_bits(0x4265_2ee0))
}

fn radians(b: &mut Builder, s: &Site<'_>) -> Emitted {
    scaled(b, s, f32::from_bits(0x3c8e_fa35))
}

fn scaled(b: &mut Builder, s: &Site<'_>, factor: f32) -> Emitted {
    let factor = b.float(factor);
    b.lane(LaneOp::FMul, &[s.arg(0), factor]).into()
}

fn sincos(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let sin = b.lane(LaneOp::Sin, &[s.arg(0)]);
    let cos = b.lane(LaneOp::Cos, &[s.arg(0)]);
    Emitted { result: None, outputs: vec![(1, sin), (2, cos)] }
}

fn log(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let log = b.lane(LaneOp::Log, &[s.arg(0)]);
    if s.args.len() == 1 {
        return log.into();
    }
    let base = b.lane(LaneOp::Log, &[s.arg(1)]);
    b.lane(LaneOp::FDiv, &[log, base]).into()
}

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
    // a - b * floor(a / b) in int arithmetic, where the quotient is whole already.
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

fn hypot(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let mut sum = b.lane(LaneOp::FMul, &[s.arg(0), s.arg(0)]);
    for other in s.args.iter().skip(1) {
        let square = b.lane(LaneOp::FMul, &[*other, *other]);
        sum = b.lane(LaneOp::FAdd, &[sum, square]);
    }
    b.lane(LaneOp::Sqrt, &[sum]).into()
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
