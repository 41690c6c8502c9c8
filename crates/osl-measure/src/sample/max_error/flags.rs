//! Sets of pixels: as flags, one for each pixel, or as lists of numbers in order. This module must not know
//! what the sets mean.

use crate::sample::round::{as_range, put};

/// Flags that are looked at together. Most are equal to their neighbours.
pub(super) const CHUNK: usize = 32;

/// Adds the numbers of the pixels whose flag is set. `first` is the number of the first.
pub(super) fn add_set(flags: &[bool], first: u32, pixels: &mut Vec<u32>) {
    for (flags, first) in flags.chunks(CHUNK).zip((first..).step_by(CHUNK)) {
        // Sums of bytes, which the compiler puts into vectors.
        let set = usize::from(flags.iter().map(|flag| u8::from(*flag)).sum::<u8>());
        if set == flags.len() {
            pixels.extend(first..first + set as u32);
        } else if set > 0 {
            // Each is written where the next one that is set overwrites it, because a jump may be
            // mispredicted.
            let (mut some, mut count) = ([0; CHUNK + 1], 0);
            for (flag, pixel) in flags.iter().zip(first..) {
                some[count] = pixel;
                count += usize::from(*flag);
            }
            pixels.extend_from_slice(&some[..count]);
        }
    }
}

/// The pixels whose flag is set, in order.
pub(super) fn set(flags: &[bool]) -> Vec<u32> {
    let mut pixels = Vec::new();
    add_set(flags, 0, &mut pixels);
    pixels
}

/// Sets the flags of some pixels, which are in order.
pub(super) fn set_all(pixels: &[u32], flags: &mut [bool]) {
    for pixels in pixels.chunks(CHUNK) {
        match as_range(pixels) {
            Some(range) => flags[range].fill(true),
            None => pixels.iter().for_each(|pixel| flags[*pixel as usize] = true),
        }
    }
}

/// Writes the values of some pixels, which are in order, to their places.
pub(super) fn scatter(pixels: &[u32], values: &[f32], to: &mut [f32]) {
    pixels.chunks(CHUNK).zip(values.chunks(CHUNK)).for_each(|(pixels, values)| put(pixels, values, to));
}

/// How many pixels are pending.
pub(super) fn count(pending: &[bool]) -> usize {
    // Sums of bytes, which the compiler puts into vectors.
    let some = |pixels: &[bool]| usize::from(pixels.iter().map(|pending| u8::from(*pending)).sum::<u8>());
    pending.chunks(128).map(some).sum()
}
