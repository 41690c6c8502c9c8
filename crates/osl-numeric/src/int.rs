//! Masks and integers of a lane, as the arithmetic needs them.
//!
//! [`i32`] and [`bool`] are those of a single point (`single`). Another implementation may stand for values
//! that are not known yet, such as those of code under construction: so a body never asks for a value, but
//! chooses with `select`.

use std::fmt::Debug;
use std::ops::{BitAnd, BitOr, BitXor, Not};

/// The truth of a condition.
pub trait Mask: Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// The truth, if it is known, so that a body may branch where only one side is worth computing. `None`
    /// for a body that is recorded, whose code has to compute both sides.
    fn known(self) -> Option<bool> {
        None
    }
}

/// An integer of 32 bits. Sums, differences and products are modulo 2^32.
pub trait Int:
    Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + BitXor<Output = Self> + Not<Output = Self>
{
    /// The result of a comparison.
    type Mask: Mask;

    /// The constant `value`.
    fn lit(value: i32) -> Self;
    /// `yes` if `mask`, else `no`. Both are computed.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// 1 if `mask`, else 0.
    fn of_mask(mask: Self::Mask) -> Self;

    /// Whether it is not 0.
    fn is_true(self) -> Self::Mask;
    /// `self == other`.
    fn eq(self, other: Self) -> Self::Mask;
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self != other`.
    #[inline(always)]
    fn ne(self, other: Self) -> Self::Mask {
        !self.eq(other)
    }
    /// `self <= other`.
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        !other.lt(self)
    }

    /// The sum.
    fn wrapping_add(self, other: Self) -> Self;
    /// The difference.
    fn wrapping_sub(self, other: Self) -> Self;
    /// The product.
    fn wrapping_mul(self, other: Self) -> Self;
    /// The magnitude; that of `i32::MIN` is itself.
    fn wrapping_abs(self) -> Self;
    /// The smaller.
    fn min(self, other: Self) -> Self;
    /// The larger.
    fn max(self, other: Self) -> Self;
    /// `self << distance`; only the low five bits of the distance count.
    fn shl(self, distance: Self) -> Self;
    /// `self >> distance`, sign extended; only the low five bits of the distance count.
    fn shr(self, distance: Self) -> Self;
    /// A third of a number that is not negative, rounded down.
    #[inline(always)]
    fn third(self) -> Self {
        // 2^16 is 3 · 21845 + 1, and the sum of both halves is below 2^17: so far, a product with 43691 /
        // 2^17 is a third of it. Its bits are those of a number without sign.
        let high = self.shr(Self::lit(16));
        let sum = high.wrapping_add(self & Self::lit(0xFFFF));
        let third = sum.wrapping_mul(Self::lit(43_691)).shr(Self::lit(17)) & Self::lit(0x7FFF);
        high.wrapping_mul(Self::lit(21_845)).wrapping_add(third)
    }
    /// `self / divisor`, truncated toward zero, modulo 2^32; unspecified for divisor 0.
    fn quotient(self, divisor: Self) -> Self;
}
