//! Reads PNG, JPEG and Radiance HDR files, which contain one image of one to four channels.
//!
//! Only pixels are read; color profiles, texts and previews are skipped. This module must not know other
//! formats.

use std::path::Path;

use image::codecs::hdr::HdrDecoder;
use image::codecs::jpeg::JpegDecoder;
use image::{DynamicImage, ImageDecoder};
use png::{BitDepth, Transformations};

use crate::decoded::{Admission, Claim, Decoded};
use crate::error::ImageError;
use crate::jpeg_head::JpegHead;
use crate::read::{Opened, Source, StoredType, channel_names};
use crate::texels::Texels;

/// Memory of the PNG decoder besides rows.
const PNG_BUFFERS: u64 = 1 << 20;

/// Decodes a file in one of these formats. The error for other files lists all formats that this crate reads.
pub(crate) fn decode(file: Opened<'_>, admission: &Admission<'_>) -> Result<Decoded, ImageError> {
    if file.head.starts_with(b"#?RADIANCE") || file.head.starts_with(b"#?RGBE") {
        decode_hdr(file, admission)
    } else if file.head.starts_with(b"\x89PNG\r\n\x1a\n") {
        decode_png(file.path, file.source, admission)
    } else if file.head.starts_with(b"\xff\xd8\xff") {
        decode_jpeg(file, admission)
    } else {
        Err(ImageError::format(file.path, "not an EXR, PNG, JPEG, TIFF or HDR file"))
    }
}

fn claim((width, height): (u32, u32), n_channels: usize, kept: StoredType, working: u64) -> Claim {
    let size = (width as usize, height as usize);
    Claim { size, full: size, n_channels, kept, makes_levels: true, working }
}

fn decode_png(
    path: &Path,
    source: &mut dyn Source,
    admission: &Admission<'_>,
) -> Result<Decoded, ImageError> {
    let damaged = |error: png::DecodingError| ImageError::format(path, error);
    let mut decoder = png::Decoder::new_with_limits(source, png::Limits { bytes: PNG_BUFFERS as usize });
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    // Samples of less than a byte become bytes; palette entries become colors.
    decoder.set_transformations(Transformations::EXPAND);
    let info = decoder.read_header_info().map_err(damaged)?;
    let size = (info.width, info.height);
    let kept = if info.bit_depth == BitDepth::Sixteen { StoredType::U16 } else { StoredType::U8 };
    let row = info.raw_row_length() as u64;
    // The number of channels may increase by one: the chunk with the transparent color comes later.
    let most_channels =
        if info.color_type == png::ColorType::Indexed { 4 } else { info.color_type.samples() };
    let working = PNG_BUFFERS.saturating_add(row.saturating_mul(8));
    admission.admit(path, &claim(size, most_channels, kept, working))?;
    decoder.set_limits(png::Limits { bytes: usize::try_from(working).unwrap_or(usize::MAX) });
    let mut reader = decoder.read_info().map_err(damaged)?;
    let (color, depth) = reader.output_color_type();
    let n_channels = color.samples();
    if n_channels > most_channels {
        admission.admit(path, &claim(size, n_channels, kept, working))?;
    }
    let n_bytes = reader.output_buffer_size().ok_or_else(|| ImageError::format(path, "too large"))?;
    let mut texels = match depth {
        BitDepth::Sixteen => Texels::U16(vec![0; n_bytes / 2]),
        _ => Texels::U8(vec![0; n_bytes]),
    };
    let buffer = match &mut texels {
        Texels::U16(words) => bytemuck::cast_slice_mut(words),
        Texels::U8(bytes) => bytes,
        _ => &mut [],
    };
    let frame = reader.next_frame(buffer).map_err(damaged)?;
    if (frame.width, frame.height) != size {
        return Err(ImageError::format(path, "PNG whose first frame is not of the image's size"));
    }
    if let Texels::U16(words) = &mut texels {
        words.iter_mut().for_each(|word| *word = u16::from_be(*word));
    }
    Ok(plain(size, n_channels, (kept, texels)))
}

fn decode_jpeg(file: Opened<'_>, admission: &Admission<'_>) -> Result<Decoded, ImageError> {
    let Opened { path, length, source, .. } = file;
    // The decoder loads the whole file into memory.
    if length > admission.limits.images.texture_memory {
        let most = admission.limits.images.texture_memory;
        return Err(ImageError::memory(path, "a JPEG file", length, most, "texture_memory"));
    }
    let mut bytes = Vec::new();
    source.read_to_end(&mut bytes).map_err(|error| ImageError::io(path, "read the file", error))?;
    let head = JpegHead::of(&bytes).ok_or_else(|| ImageError::format(path, "JPEG without a header"))?;
    let size = (head.width, head.height);
    let n_channels = head.n_channels.max(1);
    let working = length.saturating_add(head.decoder_bytes());
    admission.admit(path, &claim(size, n_channels, StoredType::U8, working))?;
    let decoder = JpegDecoder::new(std::io::Cursor::new(bytes));
    decoded(path, size, decoder.map_err(|error| ImageError::format(path, error))?)
}

fn decode_hdr(file: Opened<'_>, admission: &Admission<'_>) -> Result<Decoded, ImageError> {
    let Opened { path, head, source, .. } = file;
    // The decoder keeps all lines of the header.
    if !head.windows(2).any(|pair| pair == b"\n\n") {
        return Err(ImageError::format(path, "HDR file whose header does not end"));
    }
    // The strict decoder accepts only the first of the two signatures.
    let decoder = HdrDecoder::new_nonstrict(source).map_err(|error| ImageError::format(path, error))?;
    let size = decoder.dimensions();
    let working = u64::from(size.0).saturating_mul(16);
    admission.admit(path, &claim(size, 3, StoredType::Float, working))?;
    decoded(path, size, decoder)
}

/// The pixels from a decoder that has read the header and whose image was admitted.
fn decoded(path: &Path, size: (u32, u32), decoder: impl ImageDecoder) -> Result<Decoded, ImageError> {
    if decoder.dimensions() != size {
        return Err(ImageError::format(path, "image with two headers of different sizes"));
    }
    let image = DynamicImage::from_decoder(decoder).map_err(|error| ImageError::format(path, error))?;
    let n_channels = usize::from(image.color().channel_count());
    let values = match image {
        DynamicImage::ImageLuma8(image) => (StoredType::U8, Texels::U8(image.into_raw())),
        DynamicImage::ImageLumaA8(image) => (StoredType::U8, Texels::U8(image.into_raw())),
        DynamicImage::ImageRgb8(image) => (StoredType::U8, Texels::U8(image.into_raw())),
        DynamicImage::ImageRgba8(image) => (StoredType::U8, Texels::U8(image.into_raw())),
        DynamicImage::ImageRgb32F(image) => (StoredType::Float, Texels::Float(image.into_raw())),
        _ => return Err(ImageError::format(path, "image of a kind that its format does not have")),
    };
    Ok(plain(size, n_channels, values))
}

fn plain((width, height): (u32, u32), n_channels: usize, values: (StoredType, Texels)) -> Decoded {
    Decoded::plain((width as usize, height as usize), channel_names(n_channels), values)
}
