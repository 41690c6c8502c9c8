//! Elementary functions with the same bits on every machine.
//!
//! The standard library's functions call the machine's own library. These come from the crate `libm`, which
//! computes them itself. Square roots and rounding are exact everywhere and need no replacement.

/// Whether a number is positive; false for NaN.
pub(crate) fn positive(x: f32) -> bool {
    x > 0.0
}

/// The square of a number.
pub(crate) fn square(x: f32) -> f32 {
    x * x
}

/// The fifth power of a number.
pub(crate) fn fifth_power(x: f32) -> f32 {
    square(square(x)) * x
}

/// A float that has these functions.
pub(crate) trait Real: Copy {
    fn sin(self) -> Self;
    fn sin_cos(self) -> (Self, Self);
    fn tan(self) -> Self;
    fn acos(self) -> Self;
    fn atan(self) -> Self;
    fn atan2(self, x: Self) -> Self;
    fn hypot(self, y: Self) -> Self;
    fn exp(self) -> Self;
    fn ln(self) -> Self;
    fn powf(self, y: Self) -> Self;
}

macro_rules! real {
    ($float:ty: $sin:ident, $sin_cos:ident, $tan:ident, $acos:ident, $atan:ident, $atan2:ident, $hypot:ident,
     $exp:ident, $ln:ident, $powf:ident) => {
        impl Real for $float {
            fn sin(self) -> Self {
                libm::$sin(self)
            }
            fn sin_cos(self) -> (Self, Self) {
                libm::$sin_cos(self)
            }
            fn tan(self) -> Self {
                libm::$tan(self)
            }
            fn acos(self) -> Self {
                libm::$acos(self)
            }
            fn atan(self) -> Self {
                libm::$atan(self)
            }
            fn atan2(self, x: Self) -> Self {
                libm::$atan2(self, x)
            }
            fn hypot(self, y: Self) -> Self {
                libm::$hypot(self, y)
            }
            fn exp(self) -> Self {
                libm::$exp(self)
            }
            fn ln(self) -> Self {
                libm::$ln(self)
            }
            fn powf(self, y: Self) -> Self {
                libm::$powf(self, y)
            }
        }
    };
}

real!(f32: sinf, sincosf, tanf, acosf, atanf, atan2f, hypotf, expf, logf, powf);
real!(f64: sin, sincos, tan, acos, atan, atan2, hypot, exp, log, pow);

pub(crate) fn sin<T: Real>(x: T) -> T {
    x.sin()
}

pub(crate) fn sin_cos<T: Real>(x: T) -> (T, T) {
    x.sin_cos()
}

pub(crate) fn cos<T: Real>(x: T) -> T {
    x.sin_cos().1
}

pub(crate) fn tan<T: Real>(x: T) -> T {
    x.tan()
}

pub(crate) fn acos<T: Real>(x: T) -> T {
    x.acos()
}

pub(crate) fn atan<T: Real>(x: T) -> T {
    x.atan()
}

pub(crate) fn atan2<T: Real>(y: T, x: T) -> T {
    y.atan2(x)
}

pub(crate) fn hypot<T: Real>(x: T, y: T) -> T {
    x.hypot(y)
}

pub(crate) fn exp<T: Real>(x: T) -> T {
    x.exp()
}

pub(crate) fn ln<T: Real>(x: T) -> T {
    x.ln()
}

pub(crate) fn powf<T: Real>(x: T, y: T) -> T {
    x.powf(y)
}
