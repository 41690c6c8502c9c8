//! Mathematics: angles, exponentials, logarithms, roots. One number in, one number out, per component for
//! triples.

use super::{Builtin, Emitted, Site, T1, T2};
use osl_ir::ir::{Builder, LaneOp};
use osl_numeric::library_constants::LibraryConstant;

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "degrees",
        T1,
        "x",
        degrees,
        "Converts `x` from radians to degrees: `x` times 57.2957764.",
    )
    .derivatives("57.2957764 dx")
    .extremes(
        "The factor is 180/pi as the reference rounds it: one float below the nearest float. From \
         5.94e36 on the result is inf. inf, -inf and nan are returned unchanged.",
    )
    .example("float right_angle = degrees(M_PI_2);"),
    Builtin::compose(
        "radians",
        T1,
        "x",
        radians,
        "Converts `x` from degrees to radians: `x` times 0.0174532924.",
    )
    .derivatives("0.0174532924 dx")
    .extremes("Denormals are kept. inf, -inf and nan are returned unchanged.")
    .example("float quarter = radians(90);"),
    Builtin::lane("cos", T1, "x", LaneOp::Cos, "Returns the cosine of `x`, an angle in radians.")
        .derivatives("-sin(x) dx")
        .extremes(
            "The result always lies within -1 to 1. cos(0) and cos(-0) are 1. The result is precise to \
             about 1e-7 for angles up to some thousands of turns. From 6.7e9 on, the number of turns does \
             not fit in an int, and the result is -1 or 1 without meaning. inf, -inf and nan give -1.",
        )
        .example("float wave = cos(2 * M_PI * u);"),
    Builtin::lane("sin", T1, "x", LaneOp::Sin, "Returns the sine of `x`, an angle in radians.")
        .derivatives("cos(x) dx")
        .extremes(
            "The result always lies within -1 to 1. sin(0) and sin(-0) are 0. The result is precise to \
             about 1e-7 for angles up to some thousands of turns. From 6.7e9 on, the number of turns does \
             not fit in an int, and the result is -1 or 1 without meaning. inf gives 1; -inf and nan give \
             -1.",
        )
        .example("float wave = sin(2 * M_PI * u);"),
    Builtin::lane("tan", T1, "x", LaneOp::Tan, "Returns the tangent of `x`, an angle in radians.")
        .derivatives("dx / cos(x)^2; inf where the cosine is 0")
        .extremes(
            "At odd multiples of a quarter turn the result is a large number, not inf: tan(M_PI_2) is \
             -22877334. From 3.3e9 on the result has no meaning and may be inf; the same holds for inf \
             and -inf. nan gives nan.",
        )
        .example("float slope = tan(radians(30));"),
    Builtin::lane(
        "acos",
        T1,
        "x",
        LaneOp::Acos,
        "Returns the angle whose cosine is `x`, in radians from 0 to pi.",
    )
    .derivatives("-dx / sqrt(1 - x^2); 0 where x is at least 1 or at most -1")
    .extremes("`x` is clamped to -1 to 1, even if it is inf or -inf. nan counts as 1 and gives 0.")
    .example("float angle = acos(u);"),
    Builtin::lane(
        "asin",
        T1,
        "x",
        LaneOp::Asin,
        "Returns the angle whose sine is `x`, in radians from -pi/2 to pi/2.",
    )
    .derivatives("dx / sqrt(1 - x^2); 0 where x is at least 1 or at most -1")
    .extremes(
        "`x` is clamped to -1 to 1, even if it is inf or -inf. nan counts as 1 or -1, depending on \
         its sign bit. A zero keeps its sign.",
    )
    .example("float angle = asin(u);"),
    Builtin::lane(
        "atan",
        T1,
        "x",
        LaneOp::Atan,
        "Returns the angle whose tangent is `x`, in radians from -pi/2 to pi/2.",
    )
    .derivatives("dx / (1 + x^2)")
    .extremes("inf gives pi/2, and -inf gives -pi/2. A zero keeps its sign. nan gives nan.")
    .example("float angle = atan(2 * u);"),
    Builtin::lane(
        "atan2",
        T2,
        "y, x",
        LaneOp::Atan2,
        "Returns the angle of the point (`x`, `y`), in radians from -pi to pi.",
    )
    .derivatives(
        "(y dx - x dy) / (x^2 + y^2), 0 at the origin; this is the reference's rule, whose sign is \
         the opposite of the slope's",
    )
    .extremes(
        "The result has the sign bit of `y`. If `y` is 0, the result is 0 where `x` has no sign bit, \
         else pi; so atan2(0, -0) is pi. Two infinities count as equal: atan2(inf, inf) is pi/4. nan \
         in `y` or `x` gives nan, unless `y` is 0.",
    )
    .example("float angle = atan2(v - 0.5, u - 0.5);"),
    Builtin::compose(
        "sincos",
        &["x(f,of,of)", "x(c,oc,oc)", "x(p,op,op)", "x(v,ov,ov)", "x(n,on,on)"],
        "x, sinval, cosval",
        sincos,
        "Computes the sine and the cosine of `x`, an angle in radians, and stores them in `sinval` \
         and `cosval`.",
    )
    .derivatives("cos(x) dx for sinval, and -sin(x) dx for cosval")
    .extremes("The outputs are exactly the results of sin and cos.")
    .example("float s, c; sincos(2 * M_PI * u, s, c);"),
    Builtin::lane("cosh", T1, "x", LaneOp::Cosh, "Returns the hyperbolic cosine of `x`.")
        .derivatives("sinh(x) dx")
        .extremes(
            "The result is at most 4.25e37, since the results of exp are bounded. It reaches this limit \
             at about -87.3 and 87.3, and for -inf and inf. cosh(0) is 1. nan gives 4.25e37, since \
             exp(nan) equals exp(-inf).",
        )
        .example("float chain = cosh(u - 0.5);"),
    Builtin::lane("sinh", T1, "x", LaneOp::Sinh, "Returns the hyperbolic sine of `x`.")
        .derivatives("cosh(x) dx")
        .extremes(
            "The result lies within -4.25e37 to 4.25e37, since the results of exp are bounded. It reaches \
             these limits at about -87.3 and 87.3, and for -inf and inf. A zero keeps its sign. nan gives \
             nan.",
        )
        .example("float y = sinh(u);"),
    Builtin::lane("tanh", T1, "x", LaneOp::Tanh, "Returns the hyperbolic tangent of `x`.")
        .derivatives("dx / cosh(x)^2")
        .extremes(
            "inf gives 1, and -inf gives -1. A zero keeps its sign. nan gives 1 or -1, depending on its \
             sign bit.",
        )
        .example("float soft = tanh(4 * (u - 0.5));"),
    Builtin::lane("exp", T1, "x", LaneOp::Exp, "Returns e to the power `x`.")
        .derivatives("exp(x) dx")
        .extremes(
            "The result lies between 1.17549435e-38 and 8.50705917e+37: it is never 0 and never inf, not \
             even for -inf and inf. nan gives the smallest result.",
        )
        .example("float falloff = exp(-4 * u);"),
    Builtin::lane("exp2", T1, "x", LaneOp::Exp2, "Returns 2 to the power `x`.")
        .derivatives("0.693147 exp2(x) dx")
        .extremes(
            "`x` is clamped to -126 to 126, even if it is -inf or inf, so the result lies between \
             1.17549435e-38 and 8.50705917e+37. nan counts as -126.",
        )
        .example("float octave = exp2(3);"),
    Builtin::lane(
        "expm1",
        T1,
        "x",
        LaneOp::Expm1,
        "Returns e to the power `x`, minus 1; the result is accurate even near 0.",
    )
    .derivatives("exp(x) dx")
    .extremes(
        "If the size of `x` is below 0.03, the result is the sum of two terms of the series, else \
         exp(x) - 1. -inf gives -1, and inf gives 8.50705917e+37. A zero keeps its sign, but numbers \
         below 2^-25 give a zero. nan gives -1.",
    )
    .example("float y = expm1(0.01 * u);"),
    Builtin::compose(
        "log",
        &["n(n)", "v(v)", "p(p)", "c(c)", "f(f)", "p(p,f)", "v(v,f)", "c(c,f)", "f(f,f)"],
        "x, b",
        log,
        "Returns the natural logarithm of `x`, or with a second argument the logarithm to the base \
         `b`: log(x) / log(b).",
    )
    .derivatives(
        "dx / x; 0 where x is less than the smallest normal number. With a base, those of the \
         quotient",
    )
    .extremes(
        "`x` is clamped to the positive normal numbers: 0, negative numbers, denormals and nan give \
         -87.3365479, and inf gives 88.7228394. A base of 1 gives 0, because a division by 0 gives 0.",
    )
    .example("float y = log(1 + u); float bits = log(8, 2);"),
    Builtin::lane("log2", T1, "x", LaneOp::Log2, "Returns the logarithm of `x` to the base 2.")
        .derivatives("dx / (0.693147 x); 0 where that divisor is less than the smallest normal number")
        .extremes(
            "`x` is clamped to the positive normal numbers: 0, negative numbers, denormals and nan give \
             -126, and inf gives 128.",
        )
        .example("float octaves = log2(1 + u);"),
    Builtin::lane("log10", T1, "x", LaneOp::Log10, "Returns the logarithm of `x` to the base 10.")
        .derivatives("dx / (2.302585 x); 0 where that divisor is less than the smallest normal number")
        .extremes(
            "`x` is clamped to the positive normal numbers: 0, negative numbers, denormals and nan give \
             -37.9297829, and inf gives 38.5318413.",
        )
        .example("float decades = log10(1 + u);"),
    Builtin::lane("logb", T1, "x", LaneOp::Logb, "Returns the exponent of `x` to the base 2, as a float.")
        .derivatives("zero")
        .extremes(
            "0 and denormals give -126, inf and -inf give 127, and nan gives 128. The sign of `x` has no \
             effect.",
        )
        .example("float exponent = logb(10);"),
    Builtin::lane("sqrt", T1, "x", LaneOp::Sqrt, "Returns the square root of `x`.")
        .derivatives("dx / (2 sqrt(x)); 0 where x is 0 or less")
        .extremes("Negative numbers, -inf and nan give 0. A zero keeps its sign. inf gives inf.")
        .example("float y = sqrt(u);"),
    Builtin::lane(
        "inversesqrt",
        T1,
        "x",
        LaneOp::InverseSqrt,
        "Returns 1 divided by the square root of `x`.",
    )
    .derivatives("-dx / (2 x sqrt(x)); 0 where x is 0 or less")
    .extremes("0, negative numbers, nan and inf give 0.")
    .example("float y = inversesqrt(1 + u);"),
    Builtin::lane("cbrt", T1, "x", LaneOp::Cbrt, "Returns the cube root of `x`, which may be negative.")
        .derivatives("dx / (3 cbrt(x)^2); 0 where x is 0")
        .extremes("A zero keeps its sign. inf, -inf and nan give nan.")
        .example("float side = cbrt(u);"),
    Builtin::lane(
        "pow",
        &["n(n,n)", "v(v,v)", "p(p,p)", "c(c,c)", "n(n,f)", "v(v,f)", "p(p,f)", "c(c,f)", "f(f,f)"],
        "x, y",
        LaneOp::Pow,
        "Returns `x` to the power `y`.",
    )
    .derivatives(
        "y pow(x, y - 1) dx + log(x) pow(x, y) dy, where log(x) counts as 0 if x is 0 or less. If \
         derivatives are needed, the value is computed as pow(x, y - 1) x, which changes its last \
         bits and makes pow(0, 0) 0",
    )
    .extremes(
        "The first rule that applies decides. If `y` is 0, the result is 1, even for nan. If `x` is \
         0, the result is 0, even if `y` is negative. If `y` is 1, the result is `x`. If `y` is 2, it \
         is the square of `x`, at most 3.40282347e+38. If `x` is negative, the result is 0 unless `y` \
         is a whole number; for an odd `y` it is negative. In all other cases the size of the result \
         lies between 1.17549435e-38 and 8.50705917e+37: it is never 0, inf or nan.",
    )
    .example("float y = pow(u, 2.2);"),
    Builtin::lane("erf", &["f(f)"], "x", LaneOp::Erf, "Returns the error function of `x`.")
        .derivatives("1.128379 exp(-x^2) dx")
        .extremes("inf gives 1, and -inf gives -1. A zero keeps its sign. nan gives nan.")
        .example("float y = erf(2 * u - 1);"),
    Builtin::lane("erfc", &["f(f)"], "x", LaneOp::Erfc, "Returns 1 minus the error function of `x`.")
        .derivatives("-1.128379 exp(-x^2) dx")
        .extremes(
            "inf gives 0, and -inf gives 2. nan gives nan. The result is computed as 1 - erf(x), so it is \
             0 from about 4 on.",
        )
        .example("float tail = erfc(u);"),
    Builtin::compose(
        "hypot",
        &["f(f,f)", "f(f,f,f)"],
        "x, y, z",
        hypot,
        "Returns the square root of the sum of the squares of two or three numbers.",
    )
    .derivatives("(x dx + y dy + z dz) / hypot; 0 where hypot is 0")
    .extremes(
        "The numbers are not scaled before they are squared: the result is 0 if all squares underflow \
         (numbers below about 3e-23), and inf if a square overflows (numbers from 1.84e19 on). nan \
         gives 0.",
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
