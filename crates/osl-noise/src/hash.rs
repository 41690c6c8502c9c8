//! The integer hash of every lattice, and the conversion of coordinates to lattice cells. Source: Bob
//! Jenkins, lookup3 (public domain), in its form for whole words.

use osl_simd::to_int;

/// The NaN that x86-64, where the reference ran, returns for an invalid operation.
pub const NAN_WORD: u32 = 0xffc0_0000;

/// Hash of one to five words.
#[inline(always)]
pub fn hash<const N: usize>(words: [u32; N]) -> u32 {
    let start = 0xdead_beef_u32.wrapping_add(4 * N as u32).wrapping_add(13);
    let (mut a, mut b, mut c) = (start, start, start);
    if N >= 1 {
        a = a.wrapping_add(words[0]);
    }
    if N >= 2 {
        b = b.wrapping_add(words[1]);
    }
    if N >= 3 {
        c = c.wrapping_add(words[2]);
    }
    if N >= 4 {
        (a, b, c) = mix(a, b, c);
        a = a.wrapping_add(words[3]);
    }
    if N >= 5 {
        b = b.wrapping_add(words[4]);
    }
    finish(a, b, c)
}

/// The reversible mixing between blocks of three words.
#[inline(always)]
fn mix(mut a: u32, mut b: u32, mut c: u32) -> (u32, u32, u32) {
    macro_rules! step {
        ($x:ident, $y:ident, $z:ident, $k:literal) => {
            $x = $x.wrapping_sub($z);
            $x ^= $z.rotate_left($k);
            $z = $z.wrapping_add($y);
        };
    }
    step!(a, b, c, 4);
    step!(b, c, a, 6);
    step!(c, a, b, 8);
    step!(a, b, c, 16);
    step!(b, c, a, 19);
    step!(c, a, b, 4);
    (a, b, c)
}

/// The final mixing of three words into one.
#[inline(always)]
pub(crate) fn finish(mut a: u32, mut b: u32, mut c: u32) -> u32 {
    macro_rules! step {
        ($x:ident, $y:ident, $k:literal) => {
            $x ^= $y;
            $x = $x.wrapping_sub($y.rotate_left($k));
        };
    }
    step!(c, b, 14);
    step!(a, c, 11);
    step!(b, a, 25);
    step!(c, b, 16);
    step!(a, c, 4);
    step!(b, a, 14);
    step!(c, b, 24);
    c
}

/// A word as a number from 0 to 1; both ends occur.
#[inline(always)]
pub fn unit(word: u32) -> f32 {
    const SCALE: f32 = 1.0 / 4_294_967_296.0;
    word as f32 * SCALE
}

/// The exact floor, without a library call on machines without an instruction for it.
#[inline(always)]
pub(crate) fn floor(x: f32) -> f32 {
    let whole = to_int(x) as f32;
    let down = if whole > x { whole - 1.0 } else { whole };
    // A result of zero keeps its sign. From 2^23 on every float is whole; NaN stays as it is.
    let signed = if down == 0.0 { 0.0_f32.copysign(x) } else { down };
    if x.abs() < 8_388_608.0 { signed } else { x }
}

/// The lattice cell of a coordinate: its floor as an integer; −2³¹ for NaN and for values beyond integers.
#[inline(always)]
pub fn cell(x: f32) -> i32 {
    let i = to_int(x);
    // Beyond the range the integer is −2³¹ already and must not wrap.
    let above = (i as f32 > x) & (x >= -2_147_483_648.0);
    i.wrapping_sub(i32::from(above))
}

/// Flips the sign where `bits` is not 0.
#[inline(always)]
pub(crate) fn flip(x: f32, bits: u32) -> f32 {
    f32::from_bits(x.to_bits() ^ if bits != 0 { 0x8000_0000 } else { 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_words() {
        assert_eq!(hash([0]), 0x9519_dc65);
        assert_eq!(hash([1]), 0x4ad7_c6a0);
        assert_eq!(hash([0xffff_ffff]), 0x428a_df39);
    }

    #[test]
    fn floor_is_exact() {
        for bits in (0..=u32::MAX).step_by(9973) {
            let x = f32::from_bits(bits);
            if !x.is_nan() {
                assert_eq!(floor(x).to_bits(), x.floor().to_bits(), "{x:e}");
            }
        }
    }
}
