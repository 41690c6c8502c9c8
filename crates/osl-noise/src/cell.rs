//! Cell noise, constant within each unit cell, and hash noise, different at every float.

use crate::float::Float;
use crate::hash::hash;
use crate::unroll::array;

/// Wraps a coordinate into its period, which is floored and at least 1. Every step is rounded, so the result
/// may be the period itself, or slightly negative, next to a multiple of the period.
///
/// Hash noise treats NaN like any other word, and the NaN that arithmetic returns differs between processors.
/// Here the result is the coordinate if that is NaN, else the period if that is NaN, made quiet; for
/// infinities it is the word 0xffc00000.
#[inline(always)]
pub(crate) fn wrap<F: Float>(x: F, period: F) -> F {
    let q = period.floor();
    let q = if q < F::lit(1.0) { F::lit(1.0) } else { q };
    let wrapped = x - q * (x / q).floor();
    if wrapped.is_nan() { F::nan_of(x, period) } else { wrapped }
}

/// The words of the cell of a point.
#[inline(always)]
pub(crate) fn cells<F: Float, const D: usize>(p: [F; D]) -> [u32; D] {
    array(
        #[inline(always)]
        |a| p[a].cell().0 as u32,
    )
}

/// The words of the coordinates themselves, in single precision.
#[inline(always)]
pub(crate) fn bits<F: Float, const D: usize>(p: [F; D]) -> [u32; D] {
    array(
        #[inline(always)]
        |a| p[a].word(),
    )
}

/// One value of a lattice point.
#[inline(always)]
pub(crate) fn one<F: Float, const D: usize>(words: [u32; D]) -> F {
    F::unit(hash(words))
}

/// Three values of a lattice point; the component's number is hashed as a further word.
#[inline(always)]
pub(crate) fn three<F: Float, const D: usize>(words: [u32; D]) -> [F; 3] {
    let with = |n: u32| match D {
        1 => F::unit(hash([words[0], n])),
        2 => F::unit(hash([words[0], words[1], n])),
        3 => F::unit(hash([words[0], words[1], words[2], n])),
        _ => F::unit(hash([words[0], words[1], words[2], words[3], n])),
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
