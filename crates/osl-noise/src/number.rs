//! The numbers that a field is computed in: plain, or dual (a value with partial derivatives).

/// What a noise body does with its coordinates.
pub(crate) trait Number: Copy {
    /// A constant with zero partials.
    fn constant(value: f32) -> Self;
    /// What the number keeps of a dual one.
    fn from_dual(dual: Dual) -> Self;
    /// Itself with its partials, zero where it has none.
    fn dual(self) -> Dual;
    /// The value.
    fn value(self) -> f32;
    /// The same partials with another value.
    fn with_value(self, value: f32) -> Self;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    /// Times a plain number.
    fn scale(self, factor: f32) -> Self;
    /// Negated where `bits` is not 0.
    fn negate_if(self, bits: u32) -> Self;
    /// One of two.
    fn select(mask: bool, yes: Self, no: Self) -> Self;
}

/// Flips the sign where `bits` is not 0.
#[inline(always)]
pub(crate) fn flip(x: f32, bits: u32) -> f32 {
    f32::from_bits(x.to_bits() ^ if bits != 0 { 0x8000_0000 } else { 0 })
}

impl Number for f32 {
    #[inline(always)]
    fn constant(value: f32) -> f32 {
        value
    }
    #[inline(always)]
    fn from_dual(dual: Dual) -> f32 {
        dual.v
    }
    #[inline(always)]
    fn dual(self) -> Dual {
        Dual::constant(self)
    }
    #[inline(always)]
    fn value(self) -> f32 {
        self
    }
    #[inline(always)]
    fn with_value(self, value: f32) -> f32 {
        value
    }
    #[inline(always)]
    fn add(self, other: f32) -> f32 {
        self + other
    }
    #[inline(always)]
    fn sub(self, other: f32) -> f32 {
        self - other
    }
    #[inline(always)]
    fn mul(self, other: f32) -> f32 {
        self * other
    }
    #[inline(always)]
    fn scale(self, factor: f32) -> f32 {
        self * factor
    }
    #[inline(always)]
    fn negate_if(self, bits: u32) -> f32 {
        flip(self, bits)
    }
    #[inline(always)]
    fn select(mask: bool, yes: f32, no: f32) -> f32 {
        if mask { yes } else { no }
    }
}

/// A value with its partial derivatives in two directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Dual {
    /// The value.
    pub(crate) v: f32,
    /// Partial in the first direction.
    pub(crate) dx: f32,
    /// Partial in the second direction.
    pub(crate) dy: f32,
}

impl Number for Dual {
    #[inline(always)]
    fn constant(value: f32) -> Dual {
        Dual { v: value, dx: 0.0, dy: 0.0 }
    }
    #[inline(always)]
    fn from_dual(dual: Dual) -> Dual {
        dual
    }
    #[inline(always)]
    fn dual(self) -> Dual {
        self
    }
    #[inline(always)]
    fn value(self) -> f32 {
        self.v
    }
    #[inline(always)]
    fn with_value(self, v: f32) -> Dual {
        Dual { v, ..self }
    }
    #[inline(always)]
    fn add(self, b: Dual) -> Dual {
        Dual { v: self.v + b.v, dx: self.dx + b.dx, dy: self.dy + b.dy }
    }
    #[inline(always)]
    fn sub(self, b: Dual) -> Dual {
        Dual { v: self.v - b.v, dx: self.dx - b.dx, dy: self.dy - b.dy }
    }
    #[inline(always)]
    fn mul(self, b: Dual) -> Dual {
        Dual { v: self.v * b.v, dx: self.v * b.dx + self.dx * b.v, dy: self.v * b.dy + self.dy * b.v }
    }
    #[inline(always)]
    fn scale(self, k: f32) -> Dual {
        Dual { v: self.v * k, dx: self.dx * k, dy: self.dy * k }
    }
    #[inline(always)]
    fn negate_if(self, bits: u32) -> Dual {
        Dual { v: flip(self.v, bits), dx: flip(self.dx, bits), dy: flip(self.dy, bits) }
    }
    #[inline(always)]
    fn select(mask: bool, yes: Dual, no: Dual) -> Dual {
        if mask { yes } else { no }
    }
}
