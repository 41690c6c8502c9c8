//! Writes TIFF: uncompressed, any number of channels, each sample a byte, a short, a 32-bit int or a float.
//!
//! The crate image writes the usual kinds of pixels. It has no ints, no floats of one channel and no more
//! than four channels, and does not declare alpha; the crate tiff writes these as one strip. This module must
//! not know what the channels mean; the first three are red, green and blue if there are that many.

use std::io::Cursor;
use std::path::Path;

use image::{ExtendedColorType, ImageEncoder};
use tiff::encoder::TiffEncoder;
use tiff::tags::Tag;

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

/// The bytes of a file with samples in the byte order of this machine, pixel by pixel, with `channels`
/// samples each.
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
    let size = (width as u32, height as u32);
    let color = match (stored, channels) {
        (Stored::Byte, 1) => Some(ExtendedColorType::L8),
        (Stored::Byte, 3) => Some(ExtendedColorType::Rgb8),
        (Stored::Short, 1) => Some(ExtendedColorType::L16),
        (Stored::Short, 3) => Some(ExtendedColorType::Rgb16),
        (Stored::Float, 3) => Some(ExtendedColorType::Rgb32F),
        _ => None,
    };
    let mut file = Cursor::new(Vec::new());
    match color {
        Some(color) => {
            let encoder = image::codecs::tiff::TiffEncoder::new(&mut file);
            encoder.write_image(samples, size.0, size.1, color).map_err(|error| error.to_string())
        }
        None => strip(&mut file, size, channels, stored, samples).map_err(|error| error.to_string()),
    }
    .map_err(|error| ImageError::format(path, format!("cannot encode TIFF: {error}")))?;
    Ok(file.into_inner())
}

/// Writes one strip of samples and its fields (TIFF 6.0, sections 2 to 7, "SampleFormat", "ExtraSamples").
fn strip(
    file: &mut Cursor<Vec<u8>>,
    (width, height): (u32, u32),
    channels: usize,
    stored: Stored,
    samples: &[u8],
) -> tiff::TiffResult<()> {
    let mut encoder = TiffEncoder::new(file)?;
    let mut directory = encoder.image_directory()?;
    let at = u32::try_from(directory.write_data(samples)?)?;
    directory.write_tag(Tag::ImageWidth, width)?;
    directory.write_tag(Tag::ImageLength, height)?;
    directory.write_tag(Tag::BitsPerSample, &*vec![stored.bits(); channels])?;
    directory.write_tag(Tag::Compression, 1_u16)?;
    directory.write_tag(Tag::PhotometricInterpretation, if channels < 3 { 1_u16 } else { 2 })?;
    directory.write_tag(Tag::StripOffsets, at)?;
    directory.write_tag(Tag::SamplesPerPixel, channels as u16)?;
    directory.write_tag(Tag::RowsPerStrip, height)?;
    directory.write_tag(Tag::StripByteCounts, u32::try_from(samples.len())?)?;
    directory.write_tag(Tag::PlanarConfiguration, 1_u16)?;
    let more = channels - if channels < 3 { 1 } else { 3 };
    if more > 0 {
        directory.write_tag(Tag::ExtraSamples, &*vec![0_u16; more])?;
    }
    directory.write_tag(Tag::SampleFormat, &*vec![stored.format(); channels])?;
    directory.finish()
}
