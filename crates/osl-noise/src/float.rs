//! The floats that a field is computed in: single precision, and double as a reference for positions where
//! single has run out of digits.
//!
//! Single precision is the field that renderers agree on, bit for bit. In double precision, cells and hashes
//! are the same; the offset within a cell has double precision, and so have the constants that skew a
//! lattice. Coordinates beyond 32-bit integers count modulo 2³², so that the field continues.

use crate::hash;
use osl_simd::{Isa, Kernel};
use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A kernel whose vectors take much code.
pub trait Large: Kernel<Output = ()> {
    /// Does the same work a lane at a time.
    fn lane_by_lane(self);
}

/// The arithmetic of a field.
pub trait Float:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The constant, exactly.
    fn lit(value: f32) -> Self;
    /// A constant that is not exactly a float: its value in single precision, and its exact value.
    fn known(single: f32, exact: f64) -> Self;
    /// The nearest number to an integer.
    fn from_int(value: i32) -> Self;
    /// True for NaN.
    fn is_nan(self) -> bool;
    /// The largest whole number that is not larger; keeps the sign of zero.
    fn floor(self) -> Self;
    /// The lattice cell of a coordinate, as an integer and as a number; −2³¹ for NaN. Values beyond integers
    /// give −2³¹ in single precision and count modulo 2³² in double.
    fn cell(self) -> (i32, Self);
    /// A sum of cells: the integers are added modulo 2³², and so are their numeric values.
    fn total(cells: i32, numbers: Self) -> Self;
    /// Flips the sign where `bits` is not 0.
    fn flip(self, bits: u32) -> Self;
    /// A word as a number from 0 to 1.
    fn unit(word: u32) -> Self;
    /// The word for hash noise: that of the nearest single-precision value.
    fn word(self) -> u32;
    /// The result of [`wrap`](crate::field) for NaN: the coordinate's NaN or else the period's, made quiet.
    fn nan_of(x: Self, period: Self) -> Self;
    /// Runs a kernel with the instruction set, or with the baseline if it is not compiled for that one.
    fn dispatch<K: Kernel<Output = ()>>(isa: Isa, kernel: K);
    /// Runs a large kernel: as [`dispatch`](Float::dispatch), but a lane at a time with the baseline of
    /// x86-64 in single precision.
    fn dispatch_large<K: Large>(isa: Isa, kernel: K);
    /// Runs a kernel that computes nine results: a large kernel that double precision, which is a reference,
    /// always runs a lane at a time.
    fn dispatch_nine<K: Large>(isa: Isa, kernel: K);
    /// Coordinates and results, if they are in single precision.
    fn singles<'a, const D: usize>(
        coords: [&'a [Self]; D],
        out: &'a mut [Self],
    ) -> Option<([&'a [f32]; D], &'a mut [f32])>;
}

/// The quiet bit of a NaN.
const QUIET: u32 = 0x0040_0000;

impl Float for f32 {
    #[inline(always)]
    fn lit(value: f32) -> f32 {
        value
    }
    #[inline(always)]
    fn known(single: f32, _: f64) -> f32 {
        single
    }
    #[inline(always)]
    fn from_int(value: i32) -> f32 {
        value as f32
    }
    #[inline(always)]
    fn is_nan(self) -> bool {
        f32::is_nan(self)
    }
    #[inline(always)]
    fn floor(self) -> f32 {
        hash::floor(self)
    }
    #[inline(always)]
    fn cell(self) -> (i32, f32) {
        let i = hash::cell(self);
        (i, i as f32)
    }
    #[inline(always)]
    fn total(cells: i32, _: f32) -> f32 {
        cells as f32
    }
    #[inline(always)]
    fn flip(self, bits: u32) -> f32 {
        hash::flip(self, bits)
    }
    #[inline(always)]
    fn unit(word: u32) -> f32 {
        hash::unit(word)
    }
    #[inline(always)]
    fn word(self) -> u32 {
        self.to_bits()
    }
    #[inline(always)]
    fn nan_of(x: f32, period: f32) -> f32 {
        let nan = if period.is_nan() { period.to_bits() | QUIET } else { hash::NAN_WORD };
        f32::from_bits(if x.is_nan() { x.to_bits() | QUIET } else { nan })
    }
    fn dispatch<K: Kernel<Output = ()>>(isa: Isa, kernel: K) {
        isa.dispatch(kernel);
    }
    fn dispatch_large<K: Large>(isa: Isa, kernel: K) {
        if let Err(kernel) = isa.dispatch_if_wide(kernel) {
            kernel.lane_by_lane();
        }
    }
    fn dispatch_nine<K: Large>(isa: Isa, kernel: K) {
        Self::dispatch_large(isa, kernel);
    }
    #[inline(always)]
    fn singles<'a, const D: usize>(
        coords: [&'a [f32]; D],
        out: &'a mut [f32],
    ) -> Option<([&'a [f32]; D], &'a mut [f32])> {
        Some((coords, out))
    }
}

/// All doubles from here on are whole numbers.
const WHOLE: f64 = 4_503_599_627_370_496.0;
const TWO_POW_32: f64 = 4_294_967_296.0;

impl Float for f64 {
    #[inline(always)]
    fn lit(value: f32) -> f64 {
        f64::from(value)
    }
    #[inline(always)]
    fn known(_: f32, exact: f64) -> f64 {
        exact
    }
    #[inline(always)]
    fn from_int(value: i32) -> f64 {
        f64::from(value)
    }
    #[inline(always)]
    fn is_nan(self) -> bool {
        f64::is_nan(self)
    }
    /// Adds a number at which doubles are spaced by one, as not every machine has a floor instruction.
    #[inline(always)]
    fn floor(self) -> f64 {
        let magnitude = self.abs();
        let nearest = ((magnitude + WHOLE) - WHOLE).copysign(self);
        let whole = nearest - if nearest > self { 1.0 } else { 0.0 };
        if magnitude < WHOLE { whole } else { self }
    }
    #[inline(always)]
    fn cell(self) -> (i32, f64) {
        let whole = Float::floor(self);
        // From 0 to below 2³², exactly; the sum then leaves the integer in the low bits.
        let low = whole - Float::floor(whole * (1.0 / TWO_POW_32)) * TWO_POW_32;
        let word = (low + WHOLE).to_bits() as u32;
        (if whole.is_finite() { word as i32 } else { i32::MIN }, whole)
    }
    #[inline(always)]
    fn total(_: i32, numbers: f64) -> f64 {
        numbers
    }
    #[inline(always)]
    fn flip(self, bits: u32) -> f64 {
        f64::from_bits(self.to_bits() ^ if bits != 0 { 1 << 63 } else { 0 })
    }
    #[inline(always)]
    fn unit(word: u32) -> f64 {
        f64::from(word) * (1.0 / TWO_POW_32)
    }
    #[inline(always)]
    fn word(self) -> u32 {
        let single = self as f32;
        if single.is_nan() { hash::NAN_WORD } else { single.to_bits() }
    }
    #[inline(always)]
    fn nan_of(_: f64, _: f64) -> f64 {
        f64::NAN
    }
    fn dispatch<K: Kernel<Output = ()>>(isa: Isa, kernel: K) {
        isa.dispatch_widest(kernel);
    }
    fn dispatch_large<K: Large>(isa: Isa, kernel: K) {
        Self::dispatch(isa, kernel);
    }
    fn dispatch_nine<K: Large>(_: Isa, kernel: K) {
        kernel.lane_by_lane();
    }
    #[inline(always)]
    fn singles<'a, const D: usize>(
        _: [&'a [f64]; D],
        _: &'a mut [f64],
    ) -> Option<([&'a [f32]; D], &'a mut [f32])> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_in_double_are_floors() {
        for x in
            [0.0_f64, -0.0, 0.5, -0.5, 1.0, -1.0, 7.999, -7.001, 1e6 + 0.25, -1e6 - 0.25, 2_147_483_647.5]
        {
            assert_eq!(x.cell(), (x.floor() as i32, x.floor()), "{x}");
        }
        assert_eq!(2_147_483_648.5_f64.cell().0, i32::MIN);
        assert_eq!(4_294_967_297.5_f64.cell().0, 1);
        assert_eq!((-4_294_967_295.5_f64).cell().0, 0);
        assert_eq!(1e300_f64.cell().0, 0);
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(x.cell().0, i32::MIN);
        }
        let mut x = 1e-3_f64;
        while x < 1e20 {
            assert_eq!(Float::floor(x), x.floor());
            assert_eq!(Float::floor(-x), (-x).floor());
            x *= 1.37;
        }
    }
}
