//! Writes TIFF: one uncompressed strip, any number of channels, each sample a byte, a short, a 32-bit int or
//! a float.
//!
//! Layout: TIFF 6.0, sections 2 to 7 and "SampleFormat". This module must not know what the channels mean;
//! the first three are red, green and blue if there are that many.

use std::path::Path;

use crate::error::ImageError;

/// How samples are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stored {
    /// 0 to 255.
    Byte,
    /// 0 to 65535.
    Short,
    /// Signed 32-bit integers.
    Int,
    /// 32-bit floats.
    Float,
}

impl Stored {
    fn bits(self) -> u16 {
        match self {
            Stored::Byte => 8,
            Stored::Short => 16,
            Stored::Int | Stored::Float => 32,
        }
    }

    /// The code for the field `SampleFormat`.
    fn format(self) -> u16 {
        match self {
            Stored::Byte | Stored::Short => 1,
            Stored::Int => 2,
            Stored::Float => 3,
        }
    }
}

/// Maximum number of channels in a file that this module writes. Users choose the channels, not input.
const MAX_CHANNELS: usize = 1 << 12;

/// The bytes of a file with samples in little-endian order, pixel by pixel, with `channels` samples each.
pub(crate) fn tiff_bytes(
    path: &Path,
    (width, height): (usize, usize),
    channels: usize,
    stored: Stored,
    samples: &[u8],
) -> Result<Vec<u8>, ImageError> {
    let expected = width * height * channels * usize::from(stored.bits() / 8);
    if samples.len() != expected {
        return Err(ImageError::input(path, format!("{} bytes of samples, not {expected}", samples.len())));
    }
    if channels == 0 || channels > MAX_CHANNELS {
        return Err(ImageError::input(
            path,
            format!("a TIFF takes 1 to {MAX_CHANNELS} channels, not {channels}"),
        ));
    }
    let too_large = || ImageError::input(path, "the image is too large for a TIFF");
    let size = u32::try_from(samples.len()).map_err(|_| too_large())?;
    let mut directory = Directory::default();
    let n = channels as u32;
    directory.long(256, width as u32);
    directory.long(257, height as u32);
    directory.shorts(258, vec![stored.bits(); channels]);
    directory.short(259, 1);
    directory.short(262, if channels < 3 { 1 } else { 2 });
    directory.long(273, HEADER);
    directory.short(277, n as u16);
    directory.long(278, height as u32);
    directory.long(279, size);
    directory.short(284, 1);
    let more = channels - if channels < 3 { 1 } else { 3 };
    if more > 0 {
        directory.shorts(338, vec![0; more]);
    }
    directory.shorts(339, vec![stored.format(); channels]);
    // Directories begin at even offsets.
    let at =
        HEADER.checked_add(size).and_then(|end| end.checked_next_multiple_of(2)).ok_or_else(too_large)?;
    let rest = directory.bytes(at).ok_or_else(too_large)?;
    let mut bytes = Vec::with_capacity(at as usize + rest.len());
    bytes.extend(b"II*\0");
    bytes.extend(at.to_le_bytes());
    bytes.extend(samples);
    bytes.resize(at as usize, 0);
    bytes.extend(rest);
    Ok(bytes)
}

/// Bytes before the samples.
const HEADER: u32 = 8;

/// The fields of an image, in ascending order: code and values.
#[derive(Default)]
struct Directory {
    fields: Vec<(u16, Values)>,
}

enum Values {
    Shorts(Vec<u16>),
    Long(u32),
}

impl Directory {
    fn short(&mut self, code: u16, value: u16) {
        self.shorts(code, vec![value]);
    }

    fn shorts(&mut self, code: u16, values: Vec<u16>) {
        self.fields.push((code, Values::Shorts(values)));
    }

    fn long(&mut self, code: u16, value: u32) {
        self.fields.push((code, Values::Long(value)));
    }

    /// The directory for an offset in the file, followed by the values that do not fit into it.
    fn bytes(&self, at: u32) -> Option<Vec<u8>> {
        let mut bytes = (self.fields.len() as u16).to_le_bytes().to_vec();
        let mut behind: Vec<u8> = Vec::new();
        let length = 2 + 12 * self.fields.len() as u32 + 4;
        for (code, values) in &self.fields {
            let (kind, count, data) = match values {
                Values::Shorts(list) => {
                    (3_u16, list.len() as u32, list.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
                }
                Values::Long(value) => (4, 1, value.to_le_bytes().to_vec()),
            };
            bytes.extend(code.to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend(count.to_le_bytes());
            if data.len() <= 4 {
                bytes.extend(&data);
                bytes.extend(std::iter::repeat_n(0, 4 - data.len()));
            } else {
                let offset = at.checked_add(length)?.checked_add(behind.len() as u32)?;
                bytes.extend(offset.to_le_bytes());
                behind.extend(&data);
            }
        }
        bytes.extend(0_u32.to_le_bytes());
        bytes.extend(behind);
        Some(bytes)
    }
}
