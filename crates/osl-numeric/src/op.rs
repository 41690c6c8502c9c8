//! The lane operations: all operations that work on one point, each declared once with its body and all facts
//! about it.
//!
//! [`for_each_lane_op!`](crate::for_each_lane_op) lists each operation with its shape, the body that computes
//! one lane, and the facts that passes and reports need: [`Cost`], [`Continuity`], [`Precision`], [`Domain`],
//! [`Derivative`]. A line that lacks one of them does not compile. Folding calls the body ([`LaneOp::eval`],
//! in `eval`); the interpreter stamps the same body into loops. So folding and running have the same
//! arithmetic by construction.

mod eval;
mod facts;

pub use facts::{Continuity, Cost, Derivative, Domain, Precision};

use crate::Kind;

/// Calls `$callback!` with the lines of all lane operations:
/// `Name "text" class (argument types) -> result type, module::body, cost continuity precision domain,
/// derivative;`
///
/// - Types: `F` float, `I` int, `T` triple, `M` matrix, `S` string (its number in the string table), `K`
///   closure.
/// - Class `each` works per component where an argument is a triple (other arguments are then used for every
///   component); class `whole` takes exactly the types that it names.
/// - Body: a function of `this crate`.
/// - Cost, continuity, precision, domain: a variant of [`Cost`](crate::Cost),
///   [`Continuity`](crate::Continuity), [`Precision`](crate::Precision) and [`Domain`](crate::Domain), in
///   small letters.
/// - Derivative: `none`, `zero` or `late`, see [`Derivative`](crate::Derivative), or a function of
///   `passes/derive/rules`.
#[macro_export]
macro_rules! for_each_lane_op {
    ($callback:ident) => {
        $callback! {
            // Arithmetic.
            FAdd "fadd" each (F, F) -> F, lane::add, cheap smooth strict everywhere, sum;
            FSub "fsub" each (F, F) -> F, lane::sub, cheap smooth strict everywhere, difference;
            FMul "fmul" each (F, F) -> F, lane::mul, cheap smooth strict everywhere, product;
            FDiv "fdiv" each (F, F) -> F, arith::div, root smooth strict divisors, quotient;
            FDivBy "fdiv.const" each (F, F) -> F, arith::div_by_constant, root smooth strict divisors, quotient;
            // a b + c, and c - a b, for arithmetics that fuse them.
            FMulAdd "fmul.add" each (F, F, F) -> F, lane::mul_add, cheap smooth fused everywhere, late;
            FMulSub "fmul.sub" each (F, F, F) -> F, lane::mul_sub, cheap smooth fused everywhere, late;
            FNeg "fneg" each (F) -> F, lane::neg, cheap smooth strict everywhere, negative;
            IAdd "iadd" whole (I, I) -> I, arith::int_add, cheap discrete strict everywhere, none;
            ISub "isub" whole (I, I) -> I, arith::int_sub, cheap discrete strict everywhere, none;
            IMul "imul" whole (I, I) -> I, arith::int_mul, cheap discrete strict everywhere, none;
            IDiv "idiv" whole (I, I) -> I, arith::int_div, cheap discrete strict divisors, none;
            IMod "imod" whole (I, I) -> I, arith::int_rem, cheap discrete strict divisors, none;
            INeg "ineg" whole (I) -> I, arith::int_neg, cheap discrete strict everywhere, none;
            IAnd "iand" whole (I, I) -> I, lane::int_and, cheap discrete strict everywhere, none;
            IOr "ior" whole (I, I) -> I, lane::int_or, cheap discrete strict everywhere, none;
            IXor "ixor" whole (I, I) -> I, lane::int_xor, cheap discrete strict everywhere, none;
            ICompl "icompl" whole (I) -> I, lane::int_compl, cheap discrete strict everywhere, none;
            IShl "ishl" whole (I, I) -> I, arith::shl, cheap discrete strict everywhere, none;
            IShr "ishr" whole (I, I) -> I, arith::shr, cheap discrete strict everywhere, none;
            IMin "imin" whole (I, I) -> I, common::int_min, cheap discrete strict everywhere, none;
            IMax "imax" whole (I, I) -> I, common::int_max, cheap discrete strict everywhere, none;
            IAbs "iabs" whole (I) -> I, arith::int_abs, cheap discrete strict everywhere, none;
            // Comparison and choice. Truth values are 0 and 1.
            FLt "flt" whole (F, F) -> I, lane::lt, cheap compare strict everywhere, none;
            FLe "fle" whole (F, F) -> I, lane::le, cheap compare strict everywhere, none;
            FGt "fgt" whole (F, F) -> I, lane::gt, cheap compare strict everywhere, none;
            FGe "fge" whole (F, F) -> I, lane::ge, cheap compare strict everywhere, none;
            FEq "feq" whole (F, F) -> I, lane::eq, cheap compare strict everywhere, none;
            FNe "fne" whole (F, F) -> I, lane::ne, cheap compare strict everywhere, none;
            TEq "teq" whole (T, T) -> I, lane::triple_eq, cheap compare strict everywhere, none;
            TNe "tne" whole (T, T) -> I, lane::triple_ne, cheap compare strict everywhere, none;
            MEq "meq" whole (M, M) -> I, lane::matrix_eq, cheap compare strict everywhere, none;
            MNe "mne" whole (M, M) -> I, lane::matrix_ne, cheap compare strict everywhere, none;
            ILt "ilt" whole (I, I) -> I, lane::int_lt, cheap discrete strict everywhere, none;
            ILe "ile" whole (I, I) -> I, lane::int_le, cheap discrete strict everywhere, none;
            IGt "igt" whole (I, I) -> I, lane::int_gt, cheap discrete strict everywhere, none;
            IGe "ige" whole (I, I) -> I, lane::int_ge, cheap discrete strict everywhere, none;
            IEq "ieq" whole (I, I) -> I, lane::int_eq, cheap discrete strict everywhere, none;
            INe "ine" whole (I, I) -> I, lane::int_ne, cheap discrete strict everywhere, none;
            SEq "seq" whole (S, S) -> I, lane::int_eq, cheap discrete strict everywhere, none;
            SNe "sne" whole (S, S) -> I, lane::int_ne, cheap discrete strict everywhere, none;
            Choose "choose" each (I, F, F) -> F, lane::choose, cheap smooth strict everywhere, choose;
            IChoose "ichoose" whole (I, I, I) -> I, lane::choose_int, cheap discrete strict everywhere, none;
            MChoose "mchoose" whole (I, M, M) -> M, lane::choose_matrix, cheap smooth strict everywhere, none;
            SChoose "schoose" whole (I, S, S) -> S, lane::choose_int, cheap discrete strict everywhere, none;
            KChoose "kchoose" whole (I, K, K) -> K, lane::choose_int, cheap discrete strict everywhere, none;
            KSome "ksome" whole (K) -> I, lane::int_truth, cheap discrete strict everywhere, none;
            // Conversion and parts.
            ToFloat "float" whole (I) -> F, arith::int_to_float, cheap discrete strict everywhere, none;
            ToInt "int" whole (F) -> I, arith::float_to_int, cheap step strict everywhere, none;
            Triple "triple" whole (F, F, F) -> T, lane::triple, part smooth strict everywhere, parts;
            Splat "splat" whole (F) -> T, lane::splat, part smooth strict everywhere, parts;
            X "x" whole (T) -> F, lane::x, part smooth strict everywhere, parts;
            Y "y" whole (T) -> F, lane::y, part smooth strict everywhere, parts;
            Z "z" whole (T) -> F, lane::z, part smooth strict everywhere, parts;
            Get "get" whole (T, I) -> F, lane::component, cheap smooth strict everywhere, get;
            Set "set" whole (T, I, F) -> T, lane::with_component, cheap smooth strict everywhere, set;
            MGet "mget" whole (M, I, I) -> F, lane::element, cheap smooth strict everywhere, none;
            MSet "mset" whole (M, I, I, F) -> M, lane::with_element, cheap smooth strict everywhere, none;
            MDiag "mdiag" whole (F) -> M, matrix::diagonal, cheap smooth strict everywhere, none;
            // A constant of the library, by its number.
            LibraryConstant "known" whole (I) -> F, library_constants::of, cheap discrete strict everywhere, none;
            // Common functions.
            Abs "abs" each (F) -> F, common::abs, cheap smooth strict everywhere, magnitude;
            Sign "sign" each (F) -> F, common::sign, cheap step strict everywhere, none;
            Floor "floor" each (F) -> F, lane::floor, cheap step strict everywhere, none;
            Ceil "ceil" each (F) -> F, lane::ceil, cheap step strict everywhere, none;
            Trunc "trunc" each (F) -> F, lane::trunc, cheap step strict everywhere, none;
            Round "round" each (F) -> F, lane::round, cheap step strict everywhere, none;
            Min "min" each (F, F) -> F, common::min, cheap smooth strict everywhere, minimum;
            Max "max" each (F, F) -> F, common::max, cheap smooth strict everywhere, maximum;
            // The first where it is below the second.
            Lower "lower" each (F, F) -> F, lane::lower, cheap smooth strict everywhere, late;
            Clamp "clamp" each (F, F, F) -> F, common::clamp, cheap smooth strict everywhere, clamp;
            Mix "mix" each (F, F, F) -> F, common::mix, cheap smooth fused everywhere, mix;
            Select "select" each (F, F, F) -> F, common::select, cheap jump strict everywhere, select;
            Step "step" each (F, F) -> F, common::step, cheap step strict everywhere, none;
            Smoothstep "smoothstep" each (F, F, F) -> F, common::smoothstep, root smooth strict everywhere, smoothstep;
            Linearstep "linearstep" each (F, F, F) -> F, common::linearstep, root smooth strict everywhere, linearstep;
            Mod "mod" each (F, F) -> F, common::modulo, root jump strict divisors, modulo;
            // The divisor is a constant other than 0.
            ModBy "mod.const" each (F, F) -> F, common::modulo_by_constant, root jump strict divisors, modulo;
            Fmod "fmod" each (F, F) -> F, lane::fmod, exponential jump strict divisors, first;
            // The divisor is a constant.
            FmodExact "fmod.exact" each (F, F) -> F, lane::fmod_exact, exponential jump strict divisors, first;
            IsNan "isnan" whole (F) -> I, common::isnan, cheap compare strict everywhere, none;
            IsInf "isinf" whole (F) -> I, common::isinf, cheap compare strict everywhere, none;
            IsFinite "isfinite" whole (F) -> I, common::isfinite, cheap compare strict everywhere, none;
            // Elementary functions.
            Sin "sin" each (F) -> F, lane::sin, trigonometric smooth approximated everywhere, sin;
            Cos "cos" each (F) -> F, lane::cos, trigonometric smooth approximated everywhere, cos;
            Tan "tan" each (F) -> F, lane::tan, trigonometric smooth approximated everywhere, tan;
            Asin "asin" each (F) -> F, lane::asin, exponential smooth approximated arcs, asin;
            Acos "acos" each (F) -> F, lane::acos, exponential smooth approximated arcs, acos;
            Atan "atan" each (F) -> F, lane::atan, exponential smooth approximated everywhere, atan;
            Atan2 "atan2" each (F, F) -> F, lane::atan2, exponential smooth approximated everywhere, arc_tangent;
            Sinh "sinh" each (F) -> F, lane::sinh, trigonometric smooth approximated everywhere, sinh;
            Cosh "cosh" each (F) -> F, lane::cosh, exponential smooth approximated everywhere, cosh;
            Tanh "tanh" each (F) -> F, lane::tanh, exponential smooth approximated everywhere, tanh;
            Exp "exp" each (F) -> F, lane::exp, exponential smooth approximated everywhere, exp;
            Exp2 "exp2" each (F) -> F, lane::exp2, exponential smooth approximated everywhere, exp2;
            Expm1 "expm1" each (F) -> F, lane::expm1, exponential smooth approximated everywhere, expm1;
            Log "log" each (F) -> F, lane::log, exponential smooth approximated logs, log;
            Log2 "log2" each (F) -> F, lane::log2, exponential smooth approximated logs, log2;
            Log10 "log10" each (F) -> F, lane::log10, exponential smooth approximated logs, log10;
            Logb "logb" each (F) -> F, lane::logb, cheap step strict everywhere, none;
            Pow "pow" each (F, F) -> F, lane::pow, power smooth approximated powers, power;
            Sqrt "sqrt" each (F) -> F, common::sqrt, root smooth strict roots, sqrt;
            InverseSqrt "inversesqrt" each (F) -> F, common::inversesqrt, root smooth approximated logs, inversesqrt;
            Cbrt "cbrt" each (F) -> F, lane::cbrt, exponential smooth approximated everywhere, cbrt;
            Erf "erf" each (F) -> F, lane::erf, exponential smooth approximated everywhere, erf;
            Erfc "erfc" each (F) -> F, lane::erfc, exponential smooth approximated everywhere, erfc;
            // Geometry.
            Dot "dot" whole (T, T) -> F, geometry::dot, cheap smooth fused everywhere, dot;
            Cross "cross" whole (T, T) -> T, geometry::cross, cheap smooth strict everywhere, cross;
            Length "length" whole (T) -> F, geometry::length, cheap smooth fused everywhere, length;
            Distance "distance" whole (T, T) -> F, geometry::distance, cheap smooth fused everywhere, distance;
            // The distance is its square root.
            SquareDistance "square_distance" whole (T, T) -> F, geometry::square_distance, cheap smooth fused everywhere, late;
            Root "root" each (F) -> F, lane::root, cheap smooth strict everywhere, late;
            Normalize "normalize" whole (T) -> T, geometry::normalize, cheap smooth fused directions, normalize;
            FaceForward "faceforward" whole (T, T, T) -> T, geometry::faceforward, cheap smooth strict everywhere, zero;
            Reflect "reflect" whole (T, T) -> T, geometry::reflect, cheap smooth fused everywhere, reflect;
            Refract "refract" whole (T, T, F) -> T, geometry::refract, medium smooth fused everywhere, refract;
            // Matrices, row vectors from the left.
            MMul "mmul" whole (M, M) -> M, matrix::multiply, matrix smooth fused everywhere, none;
            MScale "mscale" whole (M, F) -> M, matrix::scale, cheap smooth strict everywhere, none;
            MInverse "minverse" whole (M) -> M, matrix::inverse, matrix smooth strict everywhere, none;
            MTranspose "mtranspose" whole (M) -> M, matrix::transpose, cheap smooth strict everywhere, none;
            MDet "mdet" whole (M) -> F, matrix::determinant, matrix smooth strict everywhere, none;
            TransformPoint "transform.point" whole (M, T) -> T, matrix::transform_point, cheap smooth fused everywhere, transform_point;
            TransformVector "transform.vector" whole (M, T) -> T, matrix::transform_vector, cheap smooth fused everywhere, transform;
            TransformNormal "transform.normal" whole (M, T) -> T, matrix::transform_normal, cheap smooth fused everywhere, transform;
            // Color.
            HsvToRgb "hsv_to_rgb" whole (T) -> T, color::hsv_to_rgb, medium smooth strict everywhere, hsv_to_rgb;
            RgbToHsv "rgb_to_hsv" whole (T) -> T, color::rgb_to_hsv, medium smooth strict everywhere, rgb_to_hsv;
            HslToRgb "hsl_to_rgb" whole (T) -> T, color::hsl_to_rgb, medium smooth strict everywhere, hsl_to_rgb;
            RgbToHsl "rgb_to_hsl" whole (T) -> T, color::rgb_to_hsl, medium smooth strict everywhere, rgb_to_hsl;
            YiqToRgb "yiq_to_rgb" whole (T) -> T, color::yiq_to_rgb, medium smooth strict everywhere, linear;
            RgbToYiq "rgb_to_yiq" whole (T) -> T, color::rgb_to_yiq, cheap smooth strict everywhere, linear;
            XyzToRgb "xyz_to_rgb" whole (T) -> T, lane::xyz_to_rgb, medium smooth fused everywhere, linear;
            RgbToXyz "rgb_to_xyz" whole (T) -> T, lane::rgb_to_xyz, cheap smooth fused everywhere, linear;
            XyyToXyz "xyy_to_xyz" whole (T) -> T, color::xyy_to_xyz, medium smooth strict everywhere, xyy_to_xyz;
            XyzToXyy "xyz_to_xyy" whole (T) -> T, color::xyz_to_xyy, cheap smooth strict everywhere, xyz_to_xyy;
            HsvToRgbTangent "hsv_to_rgb.tangent" whole (T, T) -> T, tangent::hsv_to_rgb, cheap smooth strict everywhere, zero;
            RgbToHsvTangent "rgb_to_hsv.tangent" whole (T, T) -> T, tangent::rgb_to_hsv, cheap smooth strict everywhere, zero;
            HslToRgbTangent "hsl_to_rgb.tangent" whole (T, T) -> T, tangent::hsl_to_rgb, cheap smooth strict everywhere, zero;
            RgbToHslTangent "rgb_to_hsl.tangent" whole (T, T) -> T, tangent::rgb_to_hsl, cheap smooth strict everywhere, zero;
            XyyToXyzTangent "xyy_to_xyz.tangent" whole (T, T) -> T, tangent::xyy_to_xyz, cheap smooth strict everywhere, zero;
            XyzToXyyTangent "xyz_to_xyy.tangent" whole (T, T) -> T, tangent::xyz_to_xyy, cheap smooth strict everywhere, zero;
            SrgbToLinear "srgb_to_linear" each (F) -> F, color::srgb_to_linear, medium smooth strict everywhere, srgb_to_linear;
            LinearToSrgb "linear_to_srgb" each (F) -> F, color::linear_to_srgb, medium smooth strict everywhere, linear_to_srgb;
            Blackbody "blackbody" whole (F) -> T, spectrum::blackbody, spectrum smooth strict everywhere, zero;
            Wavelength "wavelength_color" whole (F) -> T, spectrum::wavelength_color, spectrum smooth strict everywhere, zero;
            // The value itself, with zero derivatives.
            Still "still" each (F) -> F, lane::still, cheap smooth strict everywhere, zero;
            Luminance "luminance" whole (T) -> F, lane::luminance, cheap smooth fused everywhere, linear;
            // The same in the RGB system with a number.
            XyzToRgbIn "xyz_to_rgb.in" whole (T, I) -> T, lane::xyz_to_rgb_in, system smooth fused everywhere, linear_in;
            RgbToXyzIn "rgb_to_xyz.in" whole (T, I) -> T, lane::rgb_to_xyz_in, system smooth fused everywhere, linear_in;
            LuminanceIn "luminance.in" whole (T, I) -> F, lane::luminance_in, system smooth fused everywhere, linear_in;
            BlackbodyIn "blackbody.in" whole (F, I) -> T, spectrum::blackbody_in, spectrum smooth strict everywhere, zero;
            WavelengthIn "wavelength_color.in" whole (F, I) -> T, spectrum::wavelength_in, spectrum smooth strict everywhere, zero;
            // Between linear RGB and a named space: the conversion with a number.
            ConvertNamed "convert_named" whole (T, I) -> T, named::convert, system smooth strict everywhere, named;
            ConvertNamedTangent "convert_named.tangent" whole (T, T, I) -> T, named::tangent, system smooth strict everywhere, zero;
        }
    };
}

/// The arguments of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LaneShape {
    /// Whether it works per component where an argument is a triple.
    pub per_component: bool,
    /// Kinds of the arguments.
    pub args: &'static [Kind],
    /// Kind of the result, unless an argument of a per-component operation is a triple.
    pub result: Kind,
}

macro_rules! kind {
    (F) => {
        Kind::Float
    };
    (I) => {
        Kind::Int
    };
    (T) => {
        Kind::Triple
    };
    (M) => {
        Kind::Matrix
    };
    (S) => {
        Kind::Str
    };
    (K) => {
        Kind::Closure
    };
}

macro_rules! per_component {
    (each) => {
        true
    };
    (whole) => {
        false
    };
}

/// A variant, by its word in the list.
macro_rules! fact {
    (part) => {
        Cost::Part
    };
    (cheap) => {
        Cost::Cheap
    };
    (root) => {
        Cost::Root
    };
    (medium) => {
        Cost::Medium
    };
    (exponential) => {
        Cost::Exponential
    };
    (trigonometric) => {
        Cost::Trigonometric
    };
    (power) => {
        Cost::Power
    };
    (matrix) => {
        Cost::Matrix
    };
    (system) => {
        Cost::System
    };
    (spectrum) => {
        Cost::Spectrum
    };
    (smooth) => {
        Continuity::Smooth
    };
    (jump) => {
        Continuity::Jump
    };
    (step) => {
        Continuity::Step
    };
    (compare) => {
        Continuity::Compare
    };
    (discrete) => {
        Continuity::Discrete
    };
    (strict) => {
        Precision::Strict
    };
    (fused) => {
        Precision::Fused
    };
    (approximated) => {
        Precision::Approximated
    };
    (everywhere) => {
        Domain::Everywhere
    };
    (roots) => {
        Domain::Roots
    };
    (logs) => {
        Domain::Logs
    };
    (arcs) => {
        Domain::Arcs
    };
    (powers) => {
        Domain::Powers
    };
    (divisors) => {
        Domain::Divisors
    };
    (directions) => {
        Domain::Directions
    };
}

macro_rules! derivative {
    (none) => {
        Derivative::None
    };
    (zero) => {
        Derivative::Zero
    };
    (late) => {
        Derivative::Late
    };
    ($rule:ident) => {
        Derivative::Rule
    };
}

macro_rules! declare {
    ($($name:ident $text:literal $class:ident ($($arg:ident),*) -> $ret:ident, $module:ident::$body:ident,
        $cost:ident $continuity:ident $precision:ident $domain:ident, $derivative:ident;)*) => {
        /// An operation on one point.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[expect(missing_docs, reason = "each is described by its built-in or by the language's operator")]
        pub enum LaneOp { $($name),* }

        /// How many arguments each operation takes.
        const COUNTS: &[usize] = &[$([$(stringify!($arg)),*].len()),*];

        impl LaneOp {
            /// All operations.
            pub const ALL: &[LaneOp] = &[$(LaneOp::$name),*];

            /// Its name in the text of the IR.
            pub const fn text(self) -> &'static str {
                match self { $(LaneOp::$name => $text),* }
            }

            /// Its arguments and result.
            pub const fn shape(self) -> LaneShape {
                match self {
                    $(LaneOp::$name => LaneShape {
                        per_component: per_component!($class),
                        args: &[$(kind!($arg)),*],
                        result: kind!($ret),
                    }),*
                }
            }

            /// Its cost.
            pub const fn cost(self) -> Cost {
                match self { $(LaneOp::$name => fact!($cost)),* }
            }

            /// How its result responds to small changes of the arguments.
            pub const fn continuity(self) -> Continuity {
                match self { $(LaneOp::$name => fact!($continuity)),* }
            }

            /// How the fast arithmetic treats it.
            pub const fn precision(self) -> Precision {
                match self { $(LaneOp::$name => fact!($precision)),* }
            }

            /// The arguments for which it has a value of its own.
            pub const fn domain(self) -> Domain {
                match self { $(LaneOp::$name => fact!($domain)),* }
            }

            /// Its derivative.
            pub fn derivative(self) -> Derivative {
                match self { $(LaneOp::$name => derivative!($derivative)),* }
            }
        }
    };
}

crate::for_each_lane_op!(declare);

/// Maximum number of arguments of a lane operation.
pub const MAX_ARGS: usize = {
    let (mut most, mut at) = (0, 0);
    while at < COUNTS.len() {
        if COUNTS[at] > most {
            most = COUNTS[at];
        }
        at += 1;
    }
    most
};

impl LaneOp {
    /// Whether the first operand is a color and the second one the number of an RGB system or of a
    /// conversion.
    pub fn takes_number(self) -> bool {
        matches!(self, LaneOp::XyzToRgbIn | LaneOp::RgbToXyzIn | LaneOp::ConvertNamed)
    }

    /// Whether the fast arithmetic computes it by a cheaper formula, a function of `numeric::fast`.
    pub fn is_approximated(self) -> bool {
        self.precision() == Precision::Approximated
    }

    /// Kind of the result for arguments of these kinds.
    pub fn result_kind(self, args: impl IntoIterator<Item = Kind>) -> Kind {
        let shape = self.shape();
        if shape.per_component && args.into_iter().any(|k| k == Kind::Triple) {
            Kind::Triple
        } else {
            shape.result
        }
    }
}
