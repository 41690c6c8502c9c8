//! The lane operations: everything that works point by point, declared once with its arithmetic.
//!
//! [`for_each_lane_op!`](crate::for_each_lane_op) lists each with its shape and the body that computes one
//! lane. Folding calls the body here ([`LaneOp::eval`]); the interpreter stamps the same body into loops. So
//! folding and running are one arithmetic by construction.

use super::{Const, Kind};
use crate::numeric::Real;

/// Calls `$callback!` with the rows of all lane operations:
/// `Name "text" class (argument types) -> result type, path of the body;`
///
/// Types: `F` float, `I` int, `T` triple, `M` matrix, `S` string (its number in the string table).
/// Class `each` works per component where an argument is a triple (other arguments are then used for every
/// component); class `whole` takes exactly the types that it names.
#[macro_export]
macro_rules! for_each_lane_op {
    ($callback:ident) => {
        $callback! {
            // Arithmetic.
            FAdd "fadd" each (F, F) -> F, $crate::numeric::lane::add;
            FSub "fsub" each (F, F) -> F, $crate::numeric::lane::sub;
            FMul "fmul" each (F, F) -> F, $crate::numeric::lane::mul;
            FDiv "fdiv" each (F, F) -> F, $crate::numeric::arith::div;
            FDivBy "fdiv.const" each (F, F) -> F, $crate::numeric::arith::div_by_constant;
            // a b + c, and c - a b, for arithmetics that fuse them.
            FMulAdd "fmul.add" each (F, F, F) -> F, $crate::numeric::lane::mul_add;
            FMulSub "fmul.sub" each (F, F, F) -> F, $crate::numeric::lane::mul_sub;
            FNeg "fneg" each (F) -> F, $crate::numeric::lane::neg;
            IAdd "iadd" whole (I, I) -> I, $crate::numeric::arith::int_add;
            ISub "isub" whole (I, I) -> I, $crate::numeric::arith::int_sub;
            IMul "imul" whole (I, I) -> I, $crate::numeric::arith::int_mul;
            IDiv "idiv" whole (I, I) -> I, $crate::numeric::arith::int_div;
            IMod "imod" whole (I, I) -> I, $crate::numeric::arith::int_rem;
            INeg "ineg" whole (I) -> I, $crate::numeric::arith::int_neg;
            IAnd "iand" whole (I, I) -> I, $crate::numeric::lane::int_and;
            IOr "ior" whole (I, I) -> I, $crate::numeric::lane::int_or;
            IXor "ixor" whole (I, I) -> I, $crate::numeric::lane::int_xor;
            ICompl "icompl" whole (I) -> I, $crate::numeric::lane::int_compl;
            IShl "ishl" whole (I, I) -> I, $crate::numeric::arith::shl;
            IShr "ishr" whole (I, I) -> I, $crate::numeric::arith::shr;
            IMin "imin" whole (I, I) -> I, $crate::numeric::common::int_min;
            IMax "imax" whole (I, I) -> I, $crate::numeric::common::int_max;
            IAbs "iabs" whole (I) -> I, $crate::numeric::arith::int_abs;
            // Comparison and choice. Truth values are 0 and 1.
            FLt "flt" whole (F, F) -> I, $crate::numeric::lane::lt;
            FLe "fle" whole (F, F) -> I, $crate::numeric::lane::le;
            FGt "fgt" whole (F, F) -> I, $crate::numeric::lane::gt;
            FGe "fge" whole (F, F) -> I, $crate::numeric::lane::ge;
            FEq "feq" whole (F, F) -> I, $crate::numeric::lane::eq;
            FNe "fne" whole (F, F) -> I, $crate::numeric::lane::ne;
            TEq "teq" whole (T, T) -> I, $crate::numeric::lane::triple_eq;
            TNe "tne" whole (T, T) -> I, $crate::numeric::lane::triple_ne;
            MEq "meq" whole (M, M) -> I, $crate::numeric::lane::matrix_eq;
            MNe "mne" whole (M, M) -> I, $crate::numeric::lane::matrix_ne;
            ILt "ilt" whole (I, I) -> I, $crate::numeric::lane::int_lt;
            ILe "ile" whole (I, I) -> I, $crate::numeric::lane::int_le;
            IGt "igt" whole (I, I) -> I, $crate::numeric::lane::int_gt;
            IGe "ige" whole (I, I) -> I, $crate::numeric::lane::int_ge;
            IEq "ieq" whole (I, I) -> I, $crate::numeric::lane::int_eq;
            INe "ine" whole (I, I) -> I, $crate::numeric::lane::int_ne;
            SEq "seq" whole (S, S) -> I, $crate::numeric::lane::int_eq;
            SNe "sne" whole (S, S) -> I, $crate::numeric::lane::int_ne;
            Choose "choose" each (I, F, F) -> F, $crate::numeric::lane::choose;
            IChoose "ichoose" whole (I, I, I) -> I, $crate::numeric::lane::choose_int;
            MChoose "mchoose" whole (I, M, M) -> M, $crate::numeric::lane::choose_matrix;
            SChoose "schoose" whole (I, S, S) -> S, $crate::numeric::lane::choose_int;
            KChoose "kchoose" whole (I, K, K) -> K, $crate::numeric::lane::choose_int;
            KSome "ksome" whole (K) -> I, $crate::numeric::lane::int_truth;
            // Conversion and parts.
            ToFloat "float" whole (I) -> F, $crate::numeric::arith::int_to_float;
            ToInt "int" whole (F) -> I, $crate::numeric::arith::float_to_int;
            Triple "triple" whole (F, F, F) -> T, $crate::numeric::lane::triple;
            Splat "splat" whole (F) -> T, $crate::numeric::lane::splat;
            X "x" whole (T) -> F, $crate::numeric::lane::x;
            Y "y" whole (T) -> F, $crate::numeric::lane::y;
            Z "z" whole (T) -> F, $crate::numeric::lane::z;
            Get "get" whole (T, I) -> F, $crate::numeric::lane::component;
            Set "set" whole (T, I, F) -> T, $crate::numeric::lane::with_component;
            MGet "mget" whole (M, I, I) -> F, $crate::numeric::lane::element;
            MSet "mset" whole (M, I, I, F) -> M, $crate::numeric::lane::with_element;
            MDiag "mdiag" whole (F) -> M, $crate::numeric::matrix::diagonal;
            // A constant of the library, by its number.
            Known "known" whole (I) -> F, $crate::numeric::known::of;
            // Common functions.
            Abs "abs" each (F) -> F, $crate::numeric::common::abs;
            Sign "sign" each (F) -> F, $crate::numeric::common::sign;
            Floor "floor" each (F) -> F, $crate::numeric::lane::floor;
            Ceil "ceil" each (F) -> F, $crate::numeric::lane::ceil;
            Trunc "trunc" each (F) -> F, $crate::numeric::lane::trunc;
            Round "round" each (F) -> F, $crate::numeric::lane::round;
            Min "min" each (F, F) -> F, $crate::numeric::common::min;
            Max "max" each (F, F) -> F, $crate::numeric::common::max;
            // The first where it is below the second.
            Lower "lower" each (F, F) -> F, $crate::numeric::lane::lower;
            Clamp "clamp" each (F, F, F) -> F, $crate::numeric::common::clamp;
            Mix "mix" each (F, F, F) -> F, $crate::numeric::common::mix;
            Select "select" each (F, F, F) -> F, $crate::numeric::common::select;
            Step "step" each (F, F) -> F, $crate::numeric::common::step;
            Smoothstep "smoothstep" each (F, F, F) -> F, $crate::numeric::common::smoothstep;
            Linearstep "linearstep" each (F, F, F) -> F, $crate::numeric::common::linearstep;
            Mod "mod" each (F, F) -> F, $crate::numeric::common::modulo;
            // The divisor is known before running, and not 0.
            ModBy "mod.const" each (F, F) -> F, $crate::numeric::common::modulo_by_constant;
            Fmod "fmod" each (F, F) -> F, $crate::numeric::lane::fmod;
            // The divisor is known before running.
            FmodExact "fmod.exact" each (F, F) -> F, $crate::numeric::lane::fmod_exact;
            IsNan "isnan" whole (F) -> I, $crate::numeric::common::isnan;
            IsInf "isinf" whole (F) -> I, $crate::numeric::common::isinf;
            IsFinite "isfinite" whole (F) -> I, $crate::numeric::common::isfinite;
            // Elementary functions.
            Sin "sin" each (F) -> F, $crate::numeric::lane::sin;
            Cos "cos" each (F) -> F, $crate::numeric::lane::cos;
            Tan "tan" each (F) -> F, $crate::numeric::lane::tan;
            Asin "asin" each (F) -> F, $crate::numeric::lane::asin;
            Acos "acos" each (F) -> F, $crate::numeric::lane::acos;
            Atan "atan" each (F) -> F, $crate::numeric::lane::atan;
            Atan2 "atan2" each (F, F) -> F, $crate::numeric::lane::atan2;
            Sinh "sinh" each (F) -> F, $crate::numeric::lane::sinh;
            Cosh "cosh" each (F) -> F, $crate::numeric::lane::cosh;
            Tanh "tanh" each (F) -> F, $crate::numeric::lane::tanh;
            Exp "exp" each (F) -> F, $crate::numeric::lane::exp;
            Exp2 "exp2" each (F) -> F, $crate::numeric::lane::exp2;
            Expm1 "expm1" each (F) -> F, $crate::numeric::lane::expm1;
            Log "log" each (F) -> F, $crate::numeric::lane::log;
            Log2 "log2" each (F) -> F, $crate::numeric::lane::log2;
            Log10 "log10" each (F) -> F, $crate::numeric::lane::log10;
            Logb "logb" each (F) -> F, $crate::numeric::lane::logb;
            Pow "pow" each (F, F) -> F, $crate::numeric::lane::pow;
            Sqrt "sqrt" each (F) -> F, $crate::numeric::common::sqrt;
            InverseSqrt "inversesqrt" each (F) -> F, $crate::numeric::common::inversesqrt;
            Cbrt "cbrt" each (F) -> F, $crate::numeric::lane::cbrt;
            Erf "erf" each (F) -> F, $crate::numeric::lane::erf;
            Erfc "erfc" each (F) -> F, $crate::numeric::lane::erfc;
            // Geometry.
            Dot "dot" whole (T, T) -> F, $crate::numeric::geometry::dot;
            Cross "cross" whole (T, T) -> T, $crate::numeric::geometry::cross;
            Length "length" whole (T) -> F, $crate::numeric::geometry::length;
            Distance "distance" whole (T, T) -> F, $crate::numeric::geometry::distance;
            // The distance is its root.
            SquareDistance "square_distance" whole (T, T) -> F, $crate::numeric::geometry::square_distance;
            Root "root" each (F) -> F, $crate::numeric::lane::root;
            Normalize "normalize" whole (T) -> T, $crate::numeric::geometry::normalize;
            FaceForward "faceforward" whole (T, T, T) -> T, $crate::numeric::geometry::faceforward;
            Reflect "reflect" whole (T, T) -> T, $crate::numeric::geometry::reflect;
            Refract "refract" whole (T, T, F) -> T, $crate::numeric::geometry::refract;
            // Matrices, row vectors from the left.
            MMul "mmul" whole (M, M) -> M, $crate::numeric::matrix::multiply;
            MScale "mscale" whole (M, F) -> M, $crate::numeric::matrix::scale;
            MInverse "minverse" whole (M) -> M, $crate::numeric::matrix::inverse;
            MTranspose "mtranspose" whole (M) -> M, $crate::numeric::matrix::transpose;
            MDet "mdet" whole (M) -> F, $crate::numeric::matrix::determinant;
            TransformPoint "transform.point" whole (M, T) -> T, $crate::numeric::matrix::transform_point;
            TransformVector "transform.vector" whole (M, T) -> T, $crate::numeric::matrix::transform_vector;
            TransformNormal "transform.normal" whole (M, T) -> T, $crate::numeric::matrix::transform_normal;
            // Color.
            HsvToRgb "hsv_to_rgb" whole (T) -> T, $crate::numeric::color::hsv_to_rgb;
            RgbToHsv "rgb_to_hsv" whole (T) -> T, $crate::numeric::color::rgb_to_hsv;
            HslToRgb "hsl_to_rgb" whole (T) -> T, $crate::numeric::color::hsl_to_rgb;
            RgbToHsl "rgb_to_hsl" whole (T) -> T, $crate::numeric::color::rgb_to_hsl;
            YiqToRgb "yiq_to_rgb" whole (T) -> T, $crate::numeric::color::yiq_to_rgb;
            RgbToYiq "rgb_to_yiq" whole (T) -> T, $crate::numeric::color::rgb_to_yiq;
            XyzToRgb "xyz_to_rgb" whole (T) -> T, $crate::numeric::lane::xyz_to_rgb;
            RgbToXyz "rgb_to_xyz" whole (T) -> T, $crate::numeric::lane::rgb_to_xyz;
            XyyToXyz "xyy_to_xyz" whole (T) -> T, $crate::numeric::color::xyy_to_xyz;
            XyzToXyy "xyz_to_xyy" whole (T) -> T, $crate::numeric::color::xyz_to_xyy;
            HsvToRgbTangent "hsv_to_rgb.tangent" whole (T, T) -> T, $crate::numeric::tangent::hsv_to_rgb;
            RgbToHsvTangent "rgb_to_hsv.tangent" whole (T, T) -> T, $crate::numeric::tangent::rgb_to_hsv;
            HslToRgbTangent "hsl_to_rgb.tangent" whole (T, T) -> T, $crate::numeric::tangent::hsl_to_rgb;
            RgbToHslTangent "rgb_to_hsl.tangent" whole (T, T) -> T, $crate::numeric::tangent::rgb_to_hsl;
            XyyToXyzTangent "xyy_to_xyz.tangent" whole (T, T) -> T, $crate::numeric::tangent::xyy_to_xyz;
            XyzToXyyTangent "xyz_to_xyy.tangent" whole (T, T) -> T, $crate::numeric::tangent::xyz_to_xyy;
            SrgbToLinear "srgb_to_linear" each (F) -> F, $crate::numeric::color::srgb_to_linear;
            LinearToSrgb "linear_to_srgb" each (F) -> F, $crate::numeric::color::linear_to_srgb;
            Blackbody "blackbody" whole (F) -> T, $crate::numeric::spectrum::blackbody;
            Wavelength "wavelength_color" whole (F) -> T, $crate::numeric::spectrum::wavelength_color;
            Still "still" each (F) -> F, $crate::numeric::lane::still;
            Luminance "luminance" whole (T) -> F, $crate::numeric::lane::luminance;
            // The same in the RGB system of a number.
            XyzToRgbIn "xyz_to_rgb.in" whole (T, I) -> T, $crate::numeric::lane::xyz_to_rgb_in;
            RgbToXyzIn "rgb_to_xyz.in" whole (T, I) -> T, $crate::numeric::lane::rgb_to_xyz_in;
            LuminanceIn "luminance.in" whole (T, I) -> F, $crate::numeric::lane::luminance_in;
            BlackbodyIn "blackbody.in" whole (F, I) -> T, $crate::numeric::spectrum::blackbody_in;
            WavelengthIn "wavelength_color.in" whole (F, I) -> T, $crate::numeric::spectrum::wavelength_in;
        }
    };
}

/// Which arguments an operation takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LaneShape {
    /// Whether it works per component where an argument is a triple.
    pub per_component: bool,
    /// Kinds of the arguments.
    pub args: &'static [Kind],
    /// Kind of the result, where no argument is a triple in a per-component operation.
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

macro_rules! lane {
    (F $real:ident) => {
        $real
    };
    (I $real:ident) => {
        i32
    };
    (T $real:ident) => {
        [$real; 3]
    };
    (M $real:ident) => {
        [$real; 16]
    };
}

macro_rules! declare {
    ($($name:ident $text:literal $class:ident ($($arg:ident),*) -> $ret:ident, $path:path;)*) => {
        /// An operation that works point by point.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[expect(missing_docs, reason = "each is described by its built-in or by the language's operator")]
        pub enum LaneOp { $($name),* }

        impl LaneOp {
    /// Whether the second operand is the number of an RGB system, and the first one color.
    pub fn takes_system(self) -> bool {
        matches!(self, LaneOp::XyzToRgbIn | LaneOp::RgbToXyzIn)
    }

            /// All operations.
            pub const ALL: &[LaneOp] = &[$(LaneOp::$name),*];

            /// The name that IR text shows.
            pub fn text(self) -> &'static str {
                match self { $(LaneOp::$name => $text),* }
            }

            /// Its arguments and result.
            pub fn shape(self) -> LaneShape {
                match self {
                    $(LaneOp::$name => LaneShape {
                        per_component: per_component!($class),
                        args: &[$(kind!($arg)),*],
                        result: kind!($ret),
                    }),*
                }
            }

            /// One lane of the operation on arguments of exactly the row's kinds.
            fn eval_lane<R: Real>(self, args: &[Const]) -> Option<Const> {
                match self {
                    $(LaneOp::$name => eval_row!(R, args, $path, ($($arg),*) -> $ret)),*
                }
            }
        }
    };
}

macro_rules! eval_row {
    ($real:ident, $args:ident, $path:path, ($($arg:ident),*) -> S) => {{ None }};
    // Strings compare by value in `LaneOp::eval`, never by number.
    ($real:ident, $args:ident, $path:path, (S, S) -> $ret:ident) => {{ None }};
    // Of closures only null is a constant.
    ($real:ident, $args:ident, $path:path, ($($arg:ident),*) -> K) => {{ None }};
    ($real:ident, $args:ident, $path:path, (K) -> $ret:ident) => {{ None }};
    ($real:ident, $args:ident, $path:path, ($($arg:ident),*) -> $ret:ident) => {{
        let mut args = $args.iter();
        let result: lane!($ret $real) = $path($(<lane!($arg $real)>::from_const(args.next()?)?),*);
        result.into_const()
    }};
}

trait FromConst: Sized {
    fn from_const(value: &Const) -> Option<Self>;
}

trait IntoConst {
    /// The constant, if single precision has it.
    fn into_const(self) -> Option<Const>;
}

impl FromConst for i32 {
    fn from_const(value: &Const) -> Option<Self> {
        if let Const::Int(n) = value { Some(*n) } else { None }
    }
}

impl IntoConst for i32 {
    fn into_const(self) -> Option<Const> {
        Some(Const::Int(self))
    }
}

/// A float as single precision has it, if it does.
fn single<R: Real>(x: R) -> Option<f32> {
    let single = x.to_f32();
    (single.is_nan() || f64::from(single) == x.to_f64()).then_some(single)
}

fn singles<R: Real, const C: usize>(list: [R; C]) -> Option<[f32; C]> {
    let mut all = [0.0; C];
    for (to, from) in all.iter_mut().zip(list) {
        *to = single(from)?;
    }
    Some(all)
}

impl<R: Real> FromConst for R {
    fn from_const(value: &Const) -> Option<Self> {
        if let Const::Float(x) = value { Some(R::lit(*x)) } else { None }
    }
}

impl<R: Real> IntoConst for R {
    fn into_const(self) -> Option<Const> {
        single(self).map(Const::Float)
    }
}

impl<R: Real> FromConst for [R; 3] {
    fn from_const(value: &Const) -> Option<Self> {
        if let Const::Triple(t) = value { Some(t.map(R::lit)) } else { None }
    }
}

impl<R: Real> IntoConst for [R; 3] {
    fn into_const(self) -> Option<Const> {
        singles(self).map(Const::Triple)
    }
}

impl<R: Real> FromConst for [R; 16] {
    fn from_const(value: &Const) -> Option<Self> {
        if let Const::Matrix(m) = value { Some(m.map(R::lit)) } else { None }
    }
}

impl<R: Real> IntoConst for [R; 16] {
    fn into_const(self) -> Option<Const> {
        singles(self).map(|m| Const::Matrix(Box::new(m)))
    }
}

crate::for_each_lane_op!(declare);

impl LaneOp {
    /// Whether the fast arithmetic computes it by a cheaper formula: the functions of `numeric::fast`.
    pub fn is_approximated(self) -> bool {
        use LaneOp as L;
        matches!(
            self,
            L::Sin
                | L::Cos
                | L::Tan
                | L::Asin
                | L::Acos
                | L::Atan
                | L::Atan2
                | L::Sinh
                | L::Cosh
                | L::Tanh
                | L::Exp
                | L::Exp2
                | L::Expm1
                | L::Log
                | L::Log2
                | L::Log10
                | L::Pow
                | L::Cbrt
                | L::Erf
                | L::Erfc
                | L::InverseSqrt
        )
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

    /// The result for constant arguments, by the arithmetic of a strict run. `None` if the arguments do not suit it.
    pub fn eval(self, args: &[Const]) -> Option<Const> {
        self.eval_in::<f32>(args)
    }

    /// The result for constant arguments in double precision, if single precision has it: an arithmetic that knows more
    /// must not find less in a constant.
    pub fn eval_exactly(self, args: &[Const]) -> Option<Const> {
        self.eval_in::<f64>(args)
    }

    fn eval_in<R: Real>(self, args: &[Const]) -> Option<Const> {
        match (self, args) {
            (LaneOp::SEq, [Const::Str(a), Const::Str(b)]) => return Some(Const::Int((a == b).into())),
            (LaneOp::SNe, [Const::Str(a), Const::Str(b)]) => return Some(Const::Int((a != b).into())),
            (LaneOp::SChoose, [Const::Int(c), a @ Const::Str(_), b @ Const::Str(_)]) => {
                return Some(if *c != 0 { a.clone() } else { b.clone() });
            }
            (LaneOp::KSome, [Const::Null]) => return Some(Const::Int(0)),
            _ => {}
        }
        let per_component = self.shape().per_component && args.iter().any(|a| a.kind() == Kind::Triple);
        if !per_component {
            return self.eval_lane::<R>(args);
        }
        let mut result = [0.0; 3];
        for (component, out) in result.iter_mut().enumerate() {
            let lane: Vec<Const> = args
                .iter()
                .map(|a| match a {
                    Const::Triple(t) => Const::Float(t[component]),
                    other => other.clone(),
                })
                .collect();
            let Const::Float(value) = self.eval_lane::<R>(&lane)? else { return None };
            *out = value;
        }
        Some(Const::Triple(result))
    }
}
