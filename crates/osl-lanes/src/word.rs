//! The word of a lane, and how floats are stored in it.
//!
//! Ints and the numbers of strings and closures are the low 32 bits of a word in each arithmetic.

use bytemuck::Pod;
use osl_numeric::Scalar;
use osl_numeric::fast::FastFloat;
use osl_simd::Isa;
use std::fmt::Debug;

/// The contents of a lane.
pub trait Word: Pod + Default + Debug + PartialEq + Send + Sync {
    /// The word for an int, or for the number of a string or closure.
    fn of(bits: u32) -> Self;
    /// The int.
    fn bits(self) -> u32;
    /// `yes` if `mask` is all ones, `no` if it is 0.
    fn pick(mask: u32, yes: Self, no: Self) -> Self;
    /// The words as they are, if they have 32 bits.
    fn narrow(lanes: &[Self]) -> Option<&[u32]>;
    /// The same, mutable.
    fn narrow_mut(lanes: &mut [Self]) -> Option<&mut [u32]>;
    /// `out[i] = table[index[i]]`; an index beyond the table selects its last word.
    fn look_up(isa: Isa, table: &[Self; 16], index: &[u32], out: &mut [Self]);
}

impl Word for u32 {
    #[inline(always)]
    fn of(bits: u32) -> u32 {
        bits
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        self
    }
    #[inline(always)]
    fn pick(mask: u32, yes: u32, no: u32) -> u32 {
        (yes & mask) | (no & !mask)
    }
    fn narrow(lanes: &[u32]) -> Option<&[u32]> {
        Some(lanes)
    }
    fn narrow_mut(lanes: &mut [u32]) -> Option<&mut [u32]> {
        Some(lanes)
    }
    fn look_up(isa: Isa, table: &[u32; 16], index: &[u32], out: &mut [u32]) {
        isa.look_up(table, index, out);
    }
}

impl Word for u64 {
    #[inline(always)]
    fn of(bits: u32) -> u64 {
        u64::from(bits)
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        self as u32
    }
    #[inline(always)]
    fn pick(mask: u32, yes: u64, no: u64) -> u64 {
        if mask != 0 { yes } else { no }
    }
    fn narrow(_: &[u64]) -> Option<&[u32]> {
        None
    }
    fn narrow_mut(_: &mut [u64]) -> Option<&mut [u32]> {
        None
    }
    fn look_up(_: Isa, table: &[u64; 16], index: &[u32], out: &mut [u64]) {
        for (o, i) in out.iter_mut().zip(index) {
            *o = table[(*i).min(15) as usize];
        }
    }
}

/// A float stored in words.
pub trait Element<W>: Scalar {
    /// The float of a word.
    fn load(word: W) -> Self;
    /// The word of the float.
    fn store(self) -> W;
}

impl Element<u32> for f32 {
    #[inline(always)]
    fn load(word: u32) -> f32 {
        f32::from_bits(word)
    }
    #[inline(always)]
    fn store(self) -> u32 {
        self.to_bits()
    }
}

impl<const FUSED: bool> Element<u32> for FastFloat<FUSED> {
    #[inline(always)]
    fn load(word: u32) -> Self {
        FastFloat(f32::from_bits(word))
    }
    #[inline(always)]
    fn store(self) -> u32 {
        self.0.to_bits()
    }
}

impl Element<u64> for f64 {
    #[inline(always)]
    fn load(word: u64) -> f64 {
        f64::from_bits(word)
    }
    #[inline(always)]
    fn store(self) -> u64 {
        self.to_bits()
    }
}
