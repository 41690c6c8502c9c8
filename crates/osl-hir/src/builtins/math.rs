//! Mathematics: angles, exponentials, logarithms, roots. One number in, one number out, per component for
//! triples.

use super::{Builtin, Composed, Emitted, Site, T1, T2};
use osl_ir::ir::{Builder, LaneOp};
use osl_numeric::library_constants::LibraryConstant;

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose("degrees", T1, "x", degrees, "Radians in degrees: x times 57.2957764.")
        .derivatives("57.2957764 dx")
        .extremes(
            "The factor is 180/pi as the reference rounds it, one float below the nearest. From 5.94e36 on \
             the result is inf; inf and nan stay.",
        )
        .example("float right_angle = degrees(M_PI_2);"),
    Builtin::compose("radians", T1, "x", radians, "Degrees in radians: x times 0.0174532924.")
        .derivatives("0.0174532924 dx")
        .extremes("Denormals are kept; inf and nan stay.")
        .example("float quarter = radians(90);"),
    Builtin::lane("cos", T1, "x", LaneOp::Cos, "Cosine of an angle in radians.")
        .derivatives("-sin(x) dx")
        .extremes(
            "Always within -1 to 1. cos(0) and cos(-0) are 1. Precise to about 1e-7 up to some thousands of \
             turns; from 6.7e9 on, where the turns leave the ints, it is -1 or 1 without meaning; the \
             infinities and nan give -1.",
        )
        .example("float wave = cos(2 * M_PI * u);"),
    Builtin::lane("sin", T1, "x", LaneOp::Sin, "Sine of an angle in radians.")
        .derivatives("cos(x) dx")
        .extremes(
            "Always within -1 to 1. sin(0) is 0 and sin(-0) is 0 too. Precise to about 1e-7 up to some \
             thousands of turns; from 6.7e9 on, where the turns leave the ints, it is -1 or 1 without \
             meaning; inf gives 1, -inf and nan -1.",
        )
        .example("float wave = sin(2 * M_PI * u);"),
    Builtin::lane("tan", T1, "x", LaneOp::Tan, "Tangent of an angle in radians.")
        .derivatives("dx / cos(x)^2; from a cosine of 0 inf")
        .extremes(
            "Odd quarter turns give a large number, not inf: tan(M_PI_2) is -22877334. From 3.3e9 on the \
             result has no meaning and may be inf; so it is for the infinities, and nan stays.",
        )
        .example("float slope = tan(radians(30));"),
    Builtin::lane("acos", T1, "x", LaneOp::Acos, "Angle in radians, 0 to pi, of a cosine.")
        .derivatives("-dx / sqrt(1 - x^2); 0 from 1 and -1 outward")
        .extremes("x is clamped to -1 to 1, inf and -inf as well; nan counts as 1 and gives 0.")
        .example("float angle = acos(u);"),
    Builtin::lane("asin", T1, "x", LaneOp::Asin, "Angle in radians, -pi/2 to pi/2, of a sine.")
        .derivatives("dx / sqrt(1 - x^2); 0 from 1 and -1 outward")
        .extremes(
            "x is clamped to -1 to 1, inf and -inf as well; nan counts as 1 or -1, by its sign bit. The \
             sign of a zero is kept.",
        )
        .example("float angle = asin(u);"),
    Builtin::lane("atan", T1, "x", LaneOp::Atan, "Angle in radians, -pi/2 to pi/2, of a tangent.")
        .derivatives("dx / (1 + x^2)")
        .extremes("inf gives pi/2, -inf -pi/2. The sign of a zero is kept; nan stays.")
        .example("float angle = atan(2 * u);"),
    Builtin::lane(
        "atan2",
        T2,
        "y, x",
        LaneOp::Atan2,
        "Angle in radians, -pi to pi, of the point (x, y).",
    )
    .derivatives(
        "(y dx - x dy) / (x^2 + y^2), 0 at the origin: the reference's rule, whose sign is the opposite of \
         the slope's",
    )
    .extremes(
        "The sign of the result is the sign bit of y. y of 0 gives 0 where x has no sign bit, else pi, so \
         atan2(0, -0) is pi. Two infinities count as equal: atan2(inf, inf) is pi/4. nan in y or x gives \
         nan, except that y of 0 wins.",
    )
    .example("float angle = atan2(v - 0.5, u - 0.5);"),
    Builtin::compose(
        "sincos",
        &["x(f,of,of)", "x(c,oc,oc)", "x(p,op,op)", "x(v,ov,ov)", "x(n,on,on)"],
        "x, sinval, cosval",
        sincos,
        "Sine and cosine of an angle in radians, in two outputs.",
    )
    .derivatives("of both outputs: cos(x) dx and -sin(x) dx")
    .extremes("The outputs are exactly those of sin and cos.")
    .example("float s, c; sincos(2 * M_PI * u, s, c);"),
    Builtin::lane("cosh", T1, "x", LaneOp::Cosh, "Hyperbolic cosine.")
        .derivatives("sinh(x) dx")
        .extremes(
            "At most 4.25e37, from about 87.3 on and for both infinities, since exp is bounded. cosh(0) is \
             1. nan gives 4.25e37, as -inf in exp does.",
        )
        .example("float chain = cosh(u - 0.5);"),
    Builtin::lane("sinh", T1, "x", LaneOp::Sinh, "Hyperbolic sine.")
        .derivatives("cosh(x) dx")
        .extremes(
            "Within -4.25e37 to 4.25e37, which it reaches at about 87.3 and for the infinities, since exp \
             is bounded. The sign of a zero is kept; nan stays.",
        )
        .example("float y = sinh(u);"),
    Builtin::lane("tanh", T1, "x", LaneOp::Tanh, "Hyperbolic tangent.")
        .derivatives("dx / cosh(x)^2")
        .extremes("inf gives 1, -inf -1; the sign of a zero is kept. nan gives 1 or -1, by its sign bit.")
        .example("float soft = tanh(4 * (u - 0.5));"),
    Builtin::lane("exp", T1, "x", LaneOp::Exp, "e to the x.")
        .derivatives("exp(x) dx")
        .extremes(
            "Results stay between 1.17549435e-38 and 8.50705917e+37, never 0 and never inf: so for -inf and \
             inf. nan gives the smallest.",
        )
        .example("float falloff = exp(-4 * u);"),
    Builtin::lane("exp2", T1, "x", LaneOp::Exp2, "2 to the x.")
        .derivatives("0.693147 exp2(x) dx")
        .extremes(
            "x is clamped to -126 to 126, so results stay between 1.17549435e-38 and 8.50705917e+37: so for \
             -inf and inf. nan counts as -126.",
        )
        .example("float octave = exp2(3);"),
    Builtin::lane("expm1", T1, "x", LaneOp::Expm1, "e to the x, less 1; exact near 0.")
        .derivatives("exp(x) dx")
        .extremes(
            "Two terms of the series below 0.03, else exp(x) - 1: -1 for -inf, 8.50705917e+37 for inf. The \
             sign of a zero is kept, but numbers below 2^-25 give a zero. nan gives -1.",
        )
        .example("float y = expm1(0.01 * u);"),
    Builtin::compose(
        "log",
        &["n(n)", "v(v)", "p(p)", "c(c)", "f(f)", "p(p,f)", "v(v,f)", "c(c,f)", "f(f,f)"],
        "x, b",
        log,
        "Natural logarithm, or that to the base of the second argument: log(x) / log(b).",
    )
    .composed(Composed::Log)
    .derivatives("dx / x; 0 for x below the normal numbers. With a base: of the quotient")
    .extremes(
        "x is clamped to the positive normal numbers: 0, negatives, denormals and nan give -87.3365479, inf \
         88.7228394. A base of 1 gives 0, by the guarded division.",
    )
    .example("float y = log(1 + u); float bits = log(8, 2);"),
    Builtin::lane("log2", T1, "x", LaneOp::Log2, "Logarithm to the base 2.")
        .derivatives("dx / (0.693147 x); 0 where that divisor is below the normal numbers")
        .extremes(
            "x is clamped to the positive normal numbers: 0, negatives, denormals and nan give -126, inf \
             128.",
        )
        .example("float octaves = log2(1 + u);"),
    Builtin::lane("log10", T1, "x", LaneOp::Log10, "Logarithm to the base 10.")
        .derivatives("dx / (2.302585 x); 0 where that divisor is below the normal numbers")
        .extremes(
            "x is clamped to the positive normal numbers: 0, negatives, denormals and nan give -37.9297829, \
             inf 38.5318413.",
        )
        .example("float decades = log10(1 + u);"),
    Builtin::lane("logb", T1, "x", LaneOp::Logb, "Exponent of x to the base 2, as a float.")
        .derivatives("zero")
        .extremes(
            "0 and denormals give -126, the infinities 127; the sign of x does not count. nan gives 128.",
        )
        .example("float exponent = logb(10);"),
    Builtin::lane("sqrt", T1, "x", LaneOp::Sqrt, "Square root.")
        .derivatives("dx / (2 sqrt(x)); 0 for x of 0 or less")
        .extremes("Negative x, -inf and nan give 0; the sign of a zero is kept; inf stays.")
        .example("float y = sqrt(u);"),
    Builtin::lane("inversesqrt", T1, "x", LaneOp::InverseSqrt, "One over the square root.")
        .derivatives("-dx / (2 x sqrt(x)); 0 for x of 0 or less")
        .extremes("x of 0 or less and nan give 0, and so does inf.")
        .example("float y = inversesqrt(1 + u);"),
    Builtin::lane("cbrt", T1, "x", LaneOp::Cbrt, "Cube root, of negative numbers too.")
        .derivatives("dx / (3 cbrt(x)^2); 0 at 0")
        .extremes("The sign of a zero is kept. The infinities give nan, and nan stays.")
        .example("float side = cbrt(u);"),
    Builtin::lane(
        "pow",
        &["n(n,n)", "v(v,v)", "p(p,p)", "c(c,c)", "n(n,f)", "v(v,f)", "p(p,f)", "c(c,f)", "f(f,f)"],
        "x, y",
        LaneOp::Pow,
        "x to the y.",
    )
    .derivatives(
        "y pow(x, y - 1) dx + log(x) pow(x, y) dy, where log(x) counts as 0 for x of 0 or less; the value \
         is then computed as pow(x, y - 1) x, which changes last bits and makes pow(0, 0) 0",
    )
    .extremes(
        "The first that holds: y of 0 gives 1, even for nan; x of 0 gives 0, also to a negative power; y of \
         1 gives x; y of 2 gives x squared, at most 3.40282347e+38; negative x gives 0 unless y is whole, \
         and is negative for odd y. Else the result stays between 1.17549435e-38 and 8.50705917e+37 in \
         size, never 0, inf or nan.",
    )
    .example("float y = pow(u, 2.2);"),
    Builtin::lane("erf", &["f(f)"], "x", LaneOp::Erf, "Error function.")
        .derivatives("1.128379 exp(-x^2) dx")
        .extremes("inf gives 1, -inf -1; the sign of a zero is kept; nan stays.")
        .example("float y = erf(2 * u - 1);"),
    Builtin::lane("erfc", &["f(f)"], "x", LaneOp::Erfc, "1 less the error function.")
        .derivatives("-1.128379 exp(-x^2) dx")
        .extremes("inf gives 0, -inf 2; nan stays. It is computed as 1 - erf(x), so it is 0 from about 4 on.")
        .example("float tail = erfc(u);"),
    Builtin::compose(
        "hypot",
        &["f(f,f)", "f(f,f,f)"],
        "x, y, z",
        hypot,
        "Square root of the sum of two or three squares.",
    )
    .composed(Composed::Hypot)
    .derivatives("by the formula: (a da + b db + c dc) / hypot; 0 where that is 0")
    .extremes(
        "Nothing is scaled: the result is 0 where all squares underflow (below about 3e-23) and inf where \
         one overflows (from 1.84e19 on). nan gives 0.",
    )
    .example("float radius = hypot(u - 0.5, v - 0.5);"),
];

fn degrees(b: &mut Builder, s: &Site<'_>) -> Emitted {
    scaled(b, s, LibraryConstant::Degrees)
}

fn radians(b: &mut Builder, s: &Site<'_>) -> Emitted {
    scaled(b, s, LibraryConstant::Radians)
}

fn scaled(b: &mut Builder, s: &Site<'_>, factor: LibraryConstant) -> Emitted {
    let factor = b.library_constant(factor);
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

fn hypot(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let mut sum = b.lane(LaneOp::FMul, &[s.arg(0), s.arg(0)]);
    for other in s.args.iter().skip(1) {
        let square = b.lane(LaneOp::FMul, &[*other, *other]);
        sum = b.lane(LaneOp::FAdd, &[sum, square]);
    }
    b.lane(LaneOp::Sqrt, &[sum]).into()
}
