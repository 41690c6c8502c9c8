//! Checks that a block of an EXR file is valid B44-compressed data (OpenEXR, "B44 compression").
//!
//! A channel is divided into squares of four by four samples. A square becomes 14 bytes, or 3 if all samples
//! are equal; the third byte distinguishes the two. The samples are stored as a first one and six-bit
//! differences, scaled by a power of two. The format has no checksum, but damage shows in two ways: the
//! pieces must end where the block ends, and no encoder writes infinity or NaN. This is checked before
//! decoding, because the decoder accepts any data.

/// A channel of a block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Channel {
    /// Channels of other types are stored uncompressed, four bytes per sample.
    pub(crate) is_half: bool,
    /// Whether samples are stored as logarithms.
    pub(crate) is_linear: bool,
}

const LENGTH: &str = "not a readable EXR: a block of B44 data does not have the length of its pieces";
const VALUE: &str = "not a readable EXR: a block of B44 data holds what is no number";

/// A piece whose third byte is at least this has 3 bytes.
const FLAT: u8 = 13 << 2;
/// The difference that is stored as 0.
const BIAS: i32 = 32;

/// Checks a block with a number of columns and rows.
pub(crate) fn check(
    bytes: &[u8],
    (width, height): (usize, usize),
    channels: &[Channel],
) -> Result<(), &'static str> {
    let pixels = width.checked_mul(height).ok_or(LENGTH)?;
    let each = |c: &Channel| if c.is_half { 2 } else { 4 };
    let plain: usize = channels.iter().map(each).sum::<usize>().checked_mul(pixels).ok_or(LENGTH)?;
    // If compression does not pay, the samples are stored uncompressed.
    if bytes.len() == plain {
        return Ok(());
    }
    let mut rest = bytes;
    for channel in channels {
        if !channel.is_half {
            rest = rest.get(pixels * 4..).ok_or(LENGTH)?;
            continue;
        }
        for _ in 0..width.div_ceil(4) * height.div_ceil(4) {
            let third = *rest.get(2).ok_or(LENGTH)?;
            let (piece, after) = rest.split_at_checked(if third >= FLAT { 3 } else { 14 }).ok_or(LENGTH)?;
            rest = after;
            // Logarithms are not floats yet and may exceed their range by rounding.
            let sound = |value: i32| match channel.is_linear {
                true => (0..=0xffff).contains(&value),
                false => is_number(value),
            };
            let is_sound = match piece {
                [high, low, _] => sound(u16::from_be_bytes([*high, *low]).into()),
                _ => samples(piece).into_iter().all(sound),
            };
            if !is_sound {
                return Err(VALUE);
            }
        }
    }
    if rest.is_empty() { Ok(()) } else { Err(LENGTH) }
}

/// Whether a stored sample is a finite float: the encoding maps larger floats to larger integers.
fn is_number(stored: i32) -> bool {
    let Ok(stored) = u16::try_from(stored) else { return false };
    let bits = if stored & 0x8000 != 0 { stored & 0x7fff } else { !stored };
    bits & 0x7c00 != 0x7c00
}

/// The samples of a 14-byte piece, row by row, before truncation to 16 bits; zeros if the piece is shorter.
fn samples(piece: &[u8]) -> [i32; 16] {
    let mut samples = [0; 16];
    let Some(bytes) = piece.first_chunk::<14>() else { return samples };
    let all = bytes.iter().fold(0_u128, |all, byte| all << 8 | u128::from(*byte));
    // 16 bits of the first sample, 6 bits of the scale, 15 differences of 6 bits.
    let scale = (all >> 90 & 0x3f) as u32;
    let difference = |n: u32| (((all >> (84 - 6 * n)) & 0x3f) as i32 - BIAS) << scale;
    samples[0] = i32::from(u16::from_be_bytes([bytes[0], bytes[1]]));
    // Down the first column, then along the rows, column by column.
    for row in 1..4 {
        samples[4 * row] = samples[4 * row - 4] + difference(row as u32 - 1);
    }
    for column in 1..4 {
        for row in 0..4 {
            let at = 4 * row + column;
            samples[at] = samples[at - 1] + difference((3 + 4 * (column - 1) + row) as u32);
        }
    }
    samples
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: Channel = Channel { is_half: true, is_linear: false };

    #[test]
    fn pieces_must_fill_the_block() {
        let flat = [0x80, 0, 0xfc];
        let steps = [0x80, 0, 0, 0x82, 8, 0x20, 0x82, 8, 0x20, 0x82, 8, 0x20, 0x82, 8];
        assert_eq!(check(&flat, (4, 4), &[HALF]), Ok(()));
        assert_eq!(check(&[flat; 2].concat(), (5, 3), &[HALF]), Ok(()));
        assert_eq!(check(&flat[..2], (4, 4), &[HALF]), Err(LENGTH));
        assert_eq!(check(&[flat; 2].concat(), (4, 4), &[HALF]), Err(LENGTH));
        assert_eq!(check(&steps[..13], (4, 4), &[HALF]), Err(LENGTH));
        assert_eq!(check(&[0; 32], (4, 4), &[HALF]), Ok(()), "not compressed");
        let raw = Channel { is_half: false, is_linear: false };
        assert_eq!(check(&[[0; 64].as_slice(), &flat].concat(), (4, 4), &[raw, HALF]), Ok(()));
        assert_eq!(check(&[0; 63], (4, 4), &[raw, HALF]), Err(LENGTH));
    }

    #[test]
    fn infinities_are_damage() {
        for (stored, expected) in [([0xfc, 0], Err(VALUE)), ([0, 1], Err(VALUE)), ([0xfb, 0xff], Ok(()))] {
            assert_eq!(check(&[stored[0], stored[1], 0xfc], (4, 4), &[HALF]), expected, "{stored:?}");
        }
        // Differences that lead below the smallest number.
        assert_eq!(check(&[0; 14], (4, 4), &[HALF]), Err(VALUE));
    }
}
