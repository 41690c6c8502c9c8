//! Exact remainders in double precision, without the library call that a remainder of floats is.
//!
//! The remainder of two floats is itself a float, so that there is no rounding that could differ.

use super::rounding::{SIGNED_WHOLE_64, pick};

/// Quotients below this magnitude are truncated exactly: a quotient of floats that is not whole differs from
/// the next whole number by more than 2^-24, and below this magnitude it is rounded by at most 2^-25.
const MOST: f64 = (1 << 28) as f64;

/// `a % b`, and whether it is that: not if the quotient is too large, or if one of the numbers is infinite or
/// NaN, or the second is 0. Compiles to vectors.
#[inline(always)]
pub fn remainder(a: f32, b: f32) -> (f32, bool) {
    let (x, y) = (f64::from(a), f64::from(b));
    let quotient = x / y;
    let nearest = (quotient + SIGNED_WHOLE_64) - SIGNED_WHOLE_64;
    let excess = pick(nearest.abs() > quotient.abs(), 1.0_f64.copysign(quotient), 0.0);
    // The product and the difference are exact: at most 28 bits times 24, and a multiple of what the bits of
    // both are multiples of.
    let rest = x - (nearest - excess) * y;
    let is_exact = (quotient.abs() < MOST) & (rest.abs() < y.abs());
    // A remainder of 0 has the sign of the first number too.
    ((rest as f32).copysign(a), is_exact)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remainders_are_those_of_floats() {
        let mut state = 0x9E37_79B9_u32;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state
        };
        let mut exact = 0;
        let mut check = |a: f32, b: f32| {
            let (found, is_exact) = remainder(a, b);
            let expected = a % b;
            assert!(!is_exact || found.to_bits() == expected.to_bits(), "{a:e} % {b:e}: {found:e}");
            exact += u32::from(is_exact);
        };
        for _ in 0..200_000 {
            let (a, b) = (f32::from_bits(next()), f32::from_bits(next()));
            check(a, b);
            // Of similar magnitude: exponents that differ by up to 28.
            let near = (a.to_bits() & 0x7f80_0000).saturating_sub((next() % 29) << 23);
            let near = f32::from_bits(near | (next() & 0x807f_ffff));
            check(a, near);
            // Multiples, and their neighbours.
            let multiple = near * (next() % (1 << 24)) as f32;
            check(multiple, near);
            check(multiple.next_up(), near);
            check(multiple.next_down(), near);
        }
        let edges =
            [0.0, -0.0, 1.0, -1.5, 1e-45, -1e-40, f32::MIN_POSITIVE, f32::MAX, f32::INFINITY, f32::NAN];
        for a in edges {
            for b in edges {
                check(a, b);
            }
        }
        assert!(exact > 500_000, "most of them: {exact}");
    }
}
