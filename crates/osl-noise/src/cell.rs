//! Cell noise, constant within each unit cell, and hash noise, different at every float.

use crate::hash::{cell, floor, hash, unit};
use crate::unroll::array;

/// Wraps a coordinate into its period, which is floored and at least 1. Every step is rounded, so the result may
/// be the period itself or slightly negative next to a multiple of it.
#[inline(always)]
pub(crate) fn wrap(x: f32, period: f32) -> f32 {
    let q = floor(period);
    let q = if q < 1.0 { 1.0 } else { q };
    x - q * floor(x / q)
}

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
