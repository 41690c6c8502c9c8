//! Exact remainders of floats as a loop of vectors, with the library call only for blocks of lanes that need
//! it.

use super::CallPart;
use crate::word::Word;
use osl_numeric::remainder::remainder;

/// Lanes that are computed again together if one of them needs the call.
const BLOCK: usize = 32;

/// The remainders of one part of a call, whose arguments are lanes of words of 32 bits.
#[inline(always)]
pub(super) fn part<W: Word>(part: CallPart<'_, W>) {
    let CallPart { args: [a, b, ..], out, n, .. } = part;
    let (a, b) = (W::narrow(a.words()), W::narrow(b.words()));
    let (Some(a), Some(b), Some(out)) = (a, b, W::narrow_mut(&mut out[..n])) else { return };
    let (a, b) = (&a[..n], &b[..n]);
    for start in (0..n).step_by(BLOCK) {
        let end = n.min(start + BLOCK);
        let (a, b, out) = (&a[start..end], &b[start..end], &mut out[start..end]);
        let mut all = 1;
        for i in 0..out.len() {
            let (rest, is_exact) = remainder(f32::from_bits(a[i]), f32::from_bits(b[i]));
            out[i] = rest.to_bits();
            all &= u32::from(is_exact);
        }
        if all == 0 {
            for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
                *out = (f32::from_bits(*a) % f32::from_bits(*b)).to_bits();
            }
        }
    }
}
