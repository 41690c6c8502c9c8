//! Strict and double precision side by side: each operation in both, and every decision the strict one's.
//!
//! So a program takes the strict run's way with the strict run's bits, and beside each number stands what it would be
//! had nothing on that way been rounded to single precision. Comparisons, and whole numbers below, that come out
//! differently in the two are counted: there the ways would part.

use super::{Number, Real};
use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

thread_local! {
    static FLIPS: Cell<u64> = const { Cell::new(0) };
}

/// A number in both precisions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shadow {
    /// By the strict arithmetic.
    pub strict: f32,
    /// By double precision.
    pub exact: f64,
}

/// How many decisions of this thread came out differently in the two precisions since the last call.
pub fn take_flips() -> u64 {
    FLIPS.with(|flips| flips.replace(0))
}

/// The strict outcome; counted where the other is different.
#[inline]
fn decide<T: PartialEq>(strict: T, exact: T) -> T {
    if strict != exact {
        FLIPS.with(|flips| flips.set(flips.get() + 1));
    }
    strict
}

macro_rules! compare {
    ($($name:ident)*) => {$(
        fn $name(&self, other: &Self) -> bool {
            decide(self.strict.$name(&other.strict), self.exact.$name(&other.exact))
        }
    )*};
}

impl PartialEq for Shadow {
    fn eq(&self, other: &Self) -> bool {
        decide(self.strict == other.strict, self.exact == other.exact)
    }
}

impl PartialOrd for Shadow {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        decide(self.strict.partial_cmp(&other.strict), self.exact.partial_cmp(&other.exact))
    }

    compare! { lt le gt ge }
}

macro_rules! operators {
    ($($trait:ident $name:ident $op:tt;)*) => {$(
        impl $trait for Shadow {
            type Output = Self;
            #[inline]
            fn $name(self, other: Self) -> Self {
                Shadow { strict: self.strict $op other.strict, exact: self.exact $op other.exact }
            }
        }
    )*};
}

operators! {
    Add add +;
    Sub sub -;
    Mul mul *;
    Div div /;
}

impl Neg for Shadow {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Shadow { strict: -self.strict, exact: -self.exact }
    }
}

impl Number for Shadow {
    fn lit(value: f32) -> Self {
        Shadow { strict: value, exact: f64::from(value) }
    }

    fn known(single: f32, exact: f64) -> Self {
        Shadow { strict: single, exact }
    }

    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    fn is_nan(self) -> bool {
        decide(self.strict.is_nan(), self.exact.is_nan())
    }

    fn floor(self) -> Self {
        let (strict, exact) = (Number::floor(self.strict), Number::floor(self.exact));
        decide(f64::from(strict), exact);
        Shadow { strict, exact }
    }
}

macro_rules! both {
    ($($name:ident($($arg:ident),*);)*) => {$(
        fn $name(self $(, $arg: Self)*) -> Self {
            Shadow {
                strict: Real::$name(self.strict $(, $arg.strict)*),
                exact: Real::$name(self.exact $(, $arg.exact)*),
            }
        }
    )*};
}

impl Real for Shadow {
    fn from_int(value: i32) -> Self {
        Shadow { strict: Real::from_int(value), exact: Real::from_int(value) }
    }

    fn to_f32(self) -> f32 {
        self.strict
    }

    fn to_f64(self) -> f64 {
        self.exact
    }

    fn to_int(self) -> i32 {
        decide(Real::to_int(self.strict), Real::to_int(self.exact))
    }

    fn is_finite(self) -> bool {
        decide(self.strict.is_finite(), self.exact.is_finite())
    }

    both! {
        abs();
        copysign(sign);
        ceil();
        trunc();
        round();
        sqrt();
        sin();
        cos();
        tan();
        asin();
        acos();
        atan();
        atan2(x);
        sinh();
        cosh();
        tanh();
        exp();
        exp2();
        expm1();
        log();
        log2();
        log10();
        logb();
        cbrt();
        pow(y);
        erf();
        erfc();
        fmod(divisor);
        fmod_exact(divisor);
        pow_accurate(y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decisions_are_strict_and_counted() {
        take_flips();
        let big = Shadow::lit(16_777_216.0);
        let more = big + Shadow::lit(1.0);
        assert_eq!((more.strict, more.exact), (16_777_216.0, 16_777_217.0));
        assert!(!(more > big));
        assert_eq!(take_flips(), 1);
        assert_eq!(Number::floor(Shadow { strict: 3.0, exact: 2.999 }).exact, 2.0);
        assert_eq!(take_flips(), 1);
        assert!(Shadow::lit(1.0) < Shadow::lit(2.0));
        assert_eq!(take_flips(), 0);
    }
}
