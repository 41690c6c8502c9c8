//! Cell noise, constant within each unit cell, and hash noise, different at every float.

use crate::hash::{cell, floor, hash, unit};
use crate::unroll::array;

/// Wraps a coordinate into its period, which is floored and at least 1. Every step is rounded, so the result may
/// be the period itself or slightly negative next to a multiple of it.
///
/// NaN is a word like any other to hash noise, and which NaN arithmetic yields differs from processor to processor.
/// Here it is the coordinate if that is NaN, else the period, made quiet; else, for what is infinite, the word
/// 0xffc00000.
#[inline(always)]
pub(crate) fn wrap(x: f32, period: f32) -> f32 {
    let q = floor(period);
    let q = if q < 1.0 { 1.0 } else { q };
    let wrapped = x - q * floor(x / q);
    let nan = if period.is_nan() { period.to_bits() | QUIET } else { 0xffc0_0000 };
    let nan = if x.is_nan() { x.to_bits() | QUIET } else { nan };
    f32::from_bits(if wrapped.is_nan() { nan } else { wrapped.to_bits() })
}

/// The bit of a NaN that arithmetic sets.
const QUIET: u32 = 0x0040_0000;

/// The words of the cells of a point.
#[inline(always)]
pub(crate) fn cells<const D: usize>(p: [f32; D]) -> [u32; D] {
    array(
        #[inline(always)]
        |a| cell(p[a]) as u32,
    )
}

/// The words of the coordinates themselves.
#[inline(always)]
pub(crate) fn bits<const D: usize>(p: [f32; D]) -> [u32; D] {
    array(
        #[inline(always)]
        |a| p[a].to_bits(),
    )
}

/// One value of a lattice point.
#[inline(always)]
pub(crate) fn one<const D: usize>(words: [u32; D]) -> f32 {
    unit(hash(words))
}

/// Three values of a lattice point, each with its number as a further word.
#[inline(always)]
pub(crate) fn three<const D: usize>(words: [u32; D]) -> [f32; 3] {
    let with = |n: u32| match D {
        1 => unit(hash([words[0], n])),
        2 => unit(hash([words[0], words[1], n])),
        3 => unit(hash([words[0], words[1], words[2], n])),
        _ => unit(hash([words[0], words[1], words[2], words[3], n])),
    };
    [with(0), with(1), with(2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_from_wrapping_is_the_same_word_everywhere() {
        let nan = f32::from_bits;
        let check =
            |x: f32, period: f32, word: u32| assert_eq!(wrap(x, period).to_bits(), word, "{x} {period}");
        for infinite in [f32::INFINITY, f32::NEG_INFINITY] {
            check(infinite, 8.0, 0xffc0_0000);
            check(infinite, nan(0x7fc0_0001), 0x7fc0_0001);
        }
        check(7.0, f32::INFINITY, 0xffc0_0000);
        check(nan(0xff80_0005), nan(0x7fc0_0001), 0xffc0_0005);
        check(nan(0x7fc0_0005), f32::INFINITY, 0x7fc0_0005);
        check(1.0, nan(0xff80_0007), 0xffc0_0007);
        check(7.5, 4.0, 3.5_f32.to_bits());
        check(7.5, f32::NEG_INFINITY, 0.5_f32.to_bits());
    }
}
