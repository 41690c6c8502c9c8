//! The numbers in which a field is computed: plain, or dual (a value with partial derivatives).

use crate::float::Float;

/// The arithmetic of a formula, in each of its forms: on one float, on a register of floats, or on either
/// with partials.
pub(crate) trait Ring: Copy {
    /// How many numbers it holds: 1, or 3 with partials.
    const PARTS: usize;
    /// A constant of the same form, with zero partials.
    fn like(self, value: f32) -> Self;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    /// Multiplied by a constant, which has no partials.
    fn times(self, factor: f32) -> Self;
}

/// The operations of noise bodies on the coordinates of one point.
pub(crate) trait Number: Ring {
    /// The type of its value.
    type Float: Float;
    /// A constant with zero partials.
    fn constant(value: Self::Float) -> Self;
    /// Converts from a dual number, dropping what this type does not hold.
    fn from_dual(dual: Dual<Self::Float>) -> Self;
    /// Converts to a dual number; missing partials are zero.
    fn dual(self) -> Dual<Self::Float>;
    /// The value.
    fn value(self) -> Self::Float;
    /// The same partials with another value.
    fn with_value(self, value: Self::Float) -> Self;
    /// Multiplied by a plain number.
    fn scale(self, factor: Self::Float) -> Self;
    /// Negated where `bits` is not 0.
    fn negate_if(self, bits: u32) -> Self;
}

impl<F: Float> Ring for F {
    const PARTS: usize = 1;
    #[inline(always)]
    fn like(self, value: f32) -> F {
        F::lit(value)
    }
    #[inline(always)]
    fn add(self, other: F) -> F {
        self + other
    }
    #[inline(always)]
    fn sub(self, other: F) -> F {
        self - other
    }
    #[inline(always)]
    fn mul(self, other: F) -> F {
        self * other
    }
    #[inline(always)]
    fn times(self, factor: f32) -> F {
        self * F::lit(factor)
    }
}

impl<F: Float> Number for F {
    type Float = F;
    #[inline(always)]
    fn constant(value: F) -> F {
        value
    }
    #[inline(always)]
    fn from_dual(dual: Dual<F>) -> F {
        dual.v
    }
    #[inline(always)]
    fn dual(self) -> Dual<F> {
        Dual::constant(self)
    }
    #[inline(always)]
    fn value(self) -> F {
        self
    }
    #[inline(always)]
    fn with_value(self, value: F) -> F {
        value
    }
    #[inline(always)]
    fn scale(self, factor: F) -> F {
        self * factor
    }
    #[inline(always)]
    fn negate_if(self, bits: u32) -> F {
        self.flip(bits)
    }
}

/// A value with its partial derivatives in two directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Dual<F = f32> {
    /// The value.
    pub(crate) v: F,
    /// Partial in the first direction.
    pub(crate) dx: F,
    /// Partial in the second direction.
    pub(crate) dy: F,
}

impl<F: Float> Ring for Dual<F> {
    const PARTS: usize = 3;
    #[inline(always)]
    fn like(self, value: f32) -> Dual<F> {
        Dual::constant(F::lit(value))
    }
    #[inline(always)]
    fn add(self, b: Dual<F>) -> Dual<F> {
        Dual { v: self.v + b.v, dx: self.dx + b.dx, dy: self.dy + b.dy }
    }
    #[inline(always)]
    fn sub(self, b: Dual<F>) -> Dual<F> {
        Dual { v: self.v - b.v, dx: self.dx - b.dx, dy: self.dy - b.dy }
    }
    #[inline(always)]
    fn mul(self, b: Dual<F>) -> Dual<F> {
        Dual { v: self.v * b.v, dx: self.v * b.dx + self.dx * b.v, dy: self.v * b.dy + self.dy * b.v }
    }
    #[inline(always)]
    fn times(self, factor: f32) -> Dual<F> {
        self.scale(F::lit(factor))
    }
}

impl<F: Float> Number for Dual<F> {
    type Float = F;
    #[inline(always)]
    fn constant(value: F) -> Dual<F> {
        Dual { v: value, dx: F::lit(0.0), dy: F::lit(0.0) }
    }
    #[inline(always)]
    fn from_dual(dual: Dual<F>) -> Dual<F> {
        dual
    }
    #[inline(always)]
    fn dual(self) -> Dual<F> {
        self
    }
    #[inline(always)]
    fn value(self) -> F {
        self.v
    }
    #[inline(always)]
    fn with_value(self, v: F) -> Dual<F> {
        Dual { v, ..self }
    }
    #[inline(always)]
    fn scale(self, k: F) -> Dual<F> {
        Dual { v: self.v * k, dx: self.dx * k, dy: self.dy * k }
    }
    #[inline(always)]
    fn negate_if(self, bits: u32) -> Dual<F> {
        Dual { v: self.v.flip(bits), dx: self.dx.flip(bits), dy: self.dy.flip(bits) }
    }
}
