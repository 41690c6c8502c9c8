//! Reading PNG, JPEG and Radiance HDR files, all of which hold one image of one to four channels.
//!
//! It must not know other formats.

use std::io::Cursor;
use std::path::Path;

use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use crate::error::ImageError;
use crate::read::{ImageData, StoredType, channel_names, check_samples, from_bytes, from_words};

/// The longest header of an HDR file, in bytes: the decoder keeps all of its lines.
const MAX_HDR_HEADER: usize = 1 << 16;

/// Decodes a file of these formats; the error of any other names all that this crate reads.
pub(crate) fn decode(path: &Path, bytes: &[u8], limit: u64) -> Result<ImageData, ImageError> {
    if bytes.starts_with(b"#?RADIANCE") || bytes.starts_with(b"#?RGBE") {
        return decode_hdr(path, bytes, limit);
    }
    let damaged = |error: image::ImageError| ImageError::format(path, error);
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let mut reader = reader.map_err(|error| ImageError::io(path, "read the file", error))?;
    if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg)) {
        return Err(ImageError::format(path, "not an EXR, PNG, JPEG, TIFF or HDR file"));
    }
    let mut limits = image::Limits::default();
    // Room for 16-bit samples and what the decoder needs beside them.
    limits.max_alloc = Some(limit.saturating_mul(4).saturating_add(1 << 20));
    reader.limits(limits);
    decoded(path, reader.into_decoder().map_err(damaged)?, limit)
}

fn decode_hdr(path: &Path, bytes: &[u8], limit: u64) -> Result<ImageData, ImageError> {
    let head = &bytes[..bytes.len().min(MAX_HDR_HEADER)];
    if !head.windows(2).any(|pair| pair == b"\n\n") {
        return Err(ImageError::format(path, "HDR file whose header does not end"));
    }
    // The strict decoder knows the first of the two signatures only.
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(bytes));
    decoded(path, decoder.map_err(|error| ImageError::format(path, error))?, limit)
}

/// The pixels of a decoder that has read the header.
fn decoded(path: &Path, decoder: impl ImageDecoder, limit: u64) -> Result<ImageData, ImageError> {
    let (width, height) = decoder.dimensions();
    let n_channels = usize::from(decoder.color_type().channel_count());
    let (width, height) = (width as usize, height as usize);
    check_samples(path, width, height, n_channels, limit)?;
    let image = DynamicImage::from_decoder(decoder).map_err(|error| ImageError::format(path, error))?;
    Ok(from_dynamic(width, height, image))
}

fn from_dynamic(width: usize, height: usize, image: DynamicImage) -> ImageData {
    let (stored, samples) = match image {
        DynamicImage::ImageLuma8(image) => (StoredType::U8, from_bytes(image.as_raw())),
        DynamicImage::ImageLumaA8(image) => (StoredType::U8, from_bytes(image.as_raw())),
        DynamicImage::ImageRgb8(image) => (StoredType::U8, from_bytes(image.as_raw())),
        DynamicImage::ImageRgba8(image) => (StoredType::U8, from_bytes(image.as_raw())),
        DynamicImage::ImageLuma16(image) => (StoredType::U16, from_words(image.as_raw())),
        DynamicImage::ImageLumaA16(image) => (StoredType::U16, from_words(image.as_raw())),
        DynamicImage::ImageRgb16(image) => (StoredType::U16, from_words(image.as_raw())),
        DynamicImage::ImageRgba16(image) => (StoredType::U16, from_words(image.as_raw())),
        DynamicImage::ImageRgb32F(image) => (StoredType::Float, image.into_raw()),
        // The three formats store nothing else; the conversion covers what a later decoder may add.
        other => (StoredType::Float, other.to_rgba32f().into_raw()),
    };
    let channels = channel_names(samples.len() / (width * height).max(1));
    ImageData {
        width,
        height,
        channels,
        stored,
        wraps: Default::default(),
        n_parts: 1,
        header: Default::default(),
        samples,
    }
}
