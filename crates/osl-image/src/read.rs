//! Reading: EXR, PNG, JPEG, TIFF and Radiance HDR to interleaved `f32`.
//!
//! Which format a file has is told by its first bytes, not its name. Sizes are checked against a limit before
//! memory is taken for them, and damage becomes an error value. No color conversion happens: an 8-bit value is
//! its byte over 255. It must not know how textures are looked up, nor what the formats look like inside.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use crate::attributes::Attributes;
use crate::error::ImageError;
use crate::file;
use crate::wrap::Wrap;
use crate::{exr_in, image_in, tiff_in};
use osl_files::Opened;

/// The most samples (width times height times channels) that [`read_image`] takes: one gibibyte of `f32`.
pub const MAX_SAMPLES: u64 = 1 << 28;

/// Which image of a file that holds several: a part of an EXR, a page of a TIFF.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SubImage<'a> {
    /// By place, from 0. EXR parts of deep data and the reduced copies that a TIFF may hold of a page are not
    /// counted.
    Index(usize),
    /// By the name of the part or page. The empty name is the first.
    Name(&'a str),
}

impl Default for SubImage<'_> {
    fn default() -> Self {
        Self::Index(0)
    }
}

impl SubImage<'_> {
    /// The place of this image among those of these names.
    pub(crate) fn among<'n>(self, mut names: impl Iterator<Item = Option<&'n str>>) -> Option<usize> {
        match self {
            Self::Index(index) => names.nth(index).map(|_| index),
            Self::Name("") => names.next().map(|_| 0),
            Self::Name(wanted) => names.position(|name| name == Some(wanted)),
        }
    }

    /// The error of a file that lacks this image.
    pub(crate) fn absent(self, path: &Path, n_parts: usize) -> ImageError {
        let reason = match self {
            Self::Index(index) => format!("there is no subimage {index}, only {n_parts}"),
            Self::Name(name) => format!("there is no subimage named \"{}\"", name.escape_debug()),
        };
        ImageError::format(path, reason)
    }
}

/// How a file stores its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoredType {
    /// 8-bit integers, read as fractions of 255.
    U8,
    /// 16-bit integers, read as fractions of 65535.
    U16,
    /// 32-bit integers (EXR), read as numbers: they count things and are no fractions.
    U32,
    /// Signed 8-bit integers, read as fractions of 127.
    I8,
    /// Signed 16-bit integers, read as fractions of 32767.
    I16,
    /// Signed 32-bit integers, read as fractions of 2147483647.
    I32,
    /// 16-bit floats.
    Half,
    /// 32-bit floats.
    Float,
}

/// The pixels of one image.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageData {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// One name for each channel: R, G, B, A first, then the others; for grey `Y` (and `A`).
    pub channels: Vec<String>,
    /// How the file stored the first channel.
    pub stored: StoredType,
    /// The wraps of s and t that the file asks for when it is used as a texture; [`Wrap::File`] if it does not
    /// say. Only EXR and TIFF files can.
    pub wraps: (Wrap, Wrap),
    /// How many images the file holds; this is one of them.
    pub n_parts: usize,
    /// What else the file says.
    pub header: Header,
    /// `width * height * channels.len()` values, pixel by pixel, row 0 (the first scanline) first.
    pub samples: Vec<f32>,
}

/// What a file says of an image beside its pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// The column and row of the first stored pixel.
    pub data_origin: (i32, i32),
    /// The whole image, of which a file may store a part: first column, first row, last column, last row. Without, what
    /// is stored is all.
    pub display_window: Option<[i32; 4]>,
    /// Columns and rows of the tiles in which the file stores its pixels; none if it stores rows.
    pub tile: Option<(usize, usize)>,
    /// The coarser levels of the file, from the larger to the smaller: width, height, samples.
    pub coarser: Vec<(usize, usize, Vec<f32>)>,
    /// Values by name.
    pub attributes: Attributes,
}

impl ImageData {
    /// The values of one channel, row 0 first; empty if there is no such channel.
    pub fn plane(&self, channel: usize) -> Vec<f32> {
        let n_channels = self.channels.len().max(1);
        self.samples.iter().skip(channel).step_by(n_channels).copied().collect()
    }
}

/// Reads the first image of an EXR, PNG, JPEG, TIFF or Radiance HDR file, of up to [`MAX_SAMPLES`] samples.
///
/// Of an EXR the first part of plain pixels is taken, at its full resolution.
///
/// **Errors**: what the disk refuses, formats that are not among these, damaged files, too large images.
pub fn read_image(path: &Path) -> Result<ImageData, ImageError> {
    decode_image(path, &file::read_named(path)?, MAX_SAMPLES)
}

/// Reads one image of an opened file. **Errors**: as for [`read_image`], and a file without that image.
pub(crate) fn read_part(file: Opened, part: SubImage<'_>) -> Result<ImageData, ImageError> {
    let path = file.path().to_owned();
    decode_part(&path, &file::read(file)?, MAX_SAMPLES, part)
}

/// Decodes the bytes of a file. `path` serves the error text alone; `limit` is in samples.
///
/// **Errors**: as for [`read_image`].
pub fn decode_image(path: &Path, bytes: &[u8], limit: u64) -> Result<ImageData, ImageError> {
    decode_part(path, bytes, limit, SubImage::default())
}

/// Decodes one image of the bytes of a file, as [`decode_image`] does.
///
/// **Errors**: as for [`read_image`], and a file without that image.
pub fn decode_part(
    path: &Path,
    bytes: &[u8],
    limit: u64,
    part: SubImage<'_>,
) -> Result<ImageData, ImageError> {
    let decoded = catch_unwind(AssertUnwindSafe(|| {
        if exr_in::is_exr(bytes) {
            exr_in::decode(path, bytes, limit, part)
        } else if tiff_in::is_tiff(bytes) {
            tiff_in::decode(path, bytes, limit, part)
        } else if part.among([None].into_iter()) == Some(0) {
            image_in::decode(path, bytes, limit)
        } else {
            Err(part.absent(path, 1))
        }
    }));
    // A texture must not be able to end the process. This barrier is needed: where overflow is checked, a
    // damaged file that claims B44 compression makes exr 1.74.2 panic (a subtraction in `b44::decompress`).
    // Nothing outside the closure is half-changed then.
    decoded.unwrap_or_else(|_| Err(ImageError::format(path, "the decoder failed on a damaged file")))
}

/// Refuses images without pixels and those of more than `limit` samples.
pub(crate) fn check_samples(
    path: &Path,
    width: usize,
    height: usize,
    channels: usize,
    limit: u64,
) -> Result<(), ImageError> {
    let pixels = (width as u64).saturating_mul(height as u64);
    let samples = pixels.saturating_mul(channels as u64);
    if samples > limit {
        return Err(ImageError::TooLarge { path: path.to_owned(), samples, limit });
    }
    if samples == 0 {
        return Err(ImageError::format(path, "the image has no pixels"));
    }
    Ok(())
}

/// Fractions as the reference computes them (measured): times a rounded 1/255, which differs from a division
/// in the last bit of some bytes and still gives exactly 1 for 255.
pub(crate) fn from_bytes(bytes: &[u8]) -> Vec<f32> {
    bytes.iter().map(|&byte| f32::from(byte) * (1.0 / 255.0)).collect()
}

/// Fractions of 65535, computed as those of bytes.
pub(crate) fn from_words(words: &[u16]) -> Vec<f32> {
    words.iter().map(|&word| f32::from(word) * (1.0 / 65535.0)).collect()
}

/// The names of the channels of an image that has no names for them: grey up to two, colors from three on.
pub(crate) fn channel_names(n_channels: usize) -> Vec<String> {
    let known: &[&str] = if n_channels < 3 { &["Y", "A"] } else { &["R", "G", "B", "A"] };
    let name = |i: usize| known.get(i).map_or_else(|| format!("channel{i}"), |name| (*name).to_owned());
    (0..n_channels).map(name).collect()
}
