//! The decoding memory of a JPEG file, computed from its header (ITU-T T.81, annex B).
//!
//! This module must not know pixels.

/// The frame of a JPEG file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct JpegHead {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) n_channels: usize,
    /// Whether decoding keeps all coefficients until the end of the file.
    is_progressive: bool,
}

impl JpegHead {
    /// Reads the segments up to the frame.
    pub(crate) fn of(bytes: &[u8]) -> Option<Self> {
        let mut rest = bytes.get(2..)?;
        loop {
            // Any number of fill bytes may precede a marker.
            let start = rest.iter().position(|byte| *byte == 0xff)?;
            rest = rest.get(start..)?;
            let (marker, after) = rest.split_first_chunk::<2>()?;
            let [_, kind] = *marker;
            match kind {
                0xff => rest = rest.get(1..)?,
                // Markers without a segment.
                0x00 | 0x01 | 0xd0..=0xd8 => rest = after,
                0xc0..=0xcf if !matches!(kind, 0xc4 | 0xc8 | 0xcc) => {
                    let [_, _, _, h0, h1, w0, w1, n_channels] = *after.first_chunk::<8>()?;
                    return Some(Self {
                        width: u16::from_be_bytes([w0, w1]).into(),
                        height: u16::from_be_bytes([h0, h1]).into(),
                        n_channels: n_channels.into(),
                        is_progressive: kind != 0xc0 && kind != 0xc1,
                    });
                }
                _ => {
                    let length = u16::from_be_bytes(*after.first_chunk::<2>()?);
                    rest = after.get(usize::from(length).max(2)..)?;
                }
            }
        }
    }

    /// The bytes needed for decoding besides the file and the pixels: some rows of blocks, or all
    /// coefficients.
    pub(crate) fn decoder_bytes(&self) -> u64 {
        // A block of up to four by four units of 8 pixels may extend beyond the border.
        let padded = |n: u32| u64::from(n).saturating_add(32);
        let rows = if self.is_progressive { padded(self.height) } else { 64 };
        padded(self.width) * rows * (self.n_channels as u64).max(1) * 4
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_found_behind_other_segments() {
        let file = b"\xff\xd8\xff\xe0\0\x05abc\xff\xff\xc2\0\x0b\x08\x01\0\x02\0\x03";
        let expected = JpegHead { width: 512, height: 256, n_channels: 3, is_progressive: true };
        assert_eq!(JpegHead::of(file), Some(expected));
        assert_eq!(expected.decoder_bytes(), 544 * 288 * 12);
        for n in 0..file.len() {
            assert_eq!(JpegHead::of(&file[..n]), None);
        }
    }
}
