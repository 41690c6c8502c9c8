//! Reads PNG and JPEG files, which contain one image of one to four channels, and tells them from HDR files.
//!
//! Only pixels are read; color profiles, texts and previews are skipped. This module must not know other
//! formats.

use std::path::Path;

use png::{BitDepth, InterlaceInfo, Transformations};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::admission::{Admission, Claim};
use crate::decoded::Decoded;
use crate::error::ImageError;
use crate::hdr_in;
use crate::image::{EncodedFile, Source, StoredType, channel_names};
use crate::jpeg_head::JpegHead;
use crate::texels::Texels;

/// Memory of the PNG decoder besides rows: a property of the decoder.
const PNG_BUFFERS: u64 = 1 << 20;

/// Decodes a file in one of these formats. The error for other files lists all formats that this crate reads.
pub(crate) fn decode(file: EncodedFile<'_>, admission: &Admission<'_>) -> Result<Decoded, ImageError> {
    if file.head.starts_with(b"#?RADIANCE") || file.head.starts_with(b"#?RGBE") {
        hdr_in::decode(file, admission)
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
    // Of an animation this is the first frame.
    let frame = reader.info().frame_control.map_or(size, |frame| (frame.width, frame.height));
    if frame != size {
        return Err(ImageError::format(path, "PNG whose first frame is not of the image's size"));
    }
    let stride = reader.output_line_size(size.0).unwrap_or(0).max(1);
    if reader.info().interlaced {
        let bits = (n_channels * depth as usize) as u8;
        while let Some(row) = reader.next_interlaced_row().map_err(damaged)? {
            admission.goes_on(path)?;
            if let InterlaceInfo::Adam7(pass) = row.interlace() {
                png::expand_interlaced_row(buffer, stride, row.data(), pass, bits);
            }
        }
    } else {
        for row in buffer.chunks_exact_mut(stride) {
            admission.goes_on(path)?;
            let ended = || ImageError::format(path, "PNG that ends before its last row");
            reader.read_row(row).map_err(damaged)?.ok_or_else(ended)?;
        }
        // This checks the data after the last row.
        reader.read_row(&mut []).map_err(damaged)?;
    }
    if let Texels::U16(words) = &mut texels {
        words.iter_mut().for_each(|word| *word = u16::from_be(*word));
    }
    Ok(plain(size, n_channels, (kept, texels)))
}

fn decode_jpeg(file: EncodedFile<'_>, admission: &Admission<'_>) -> Result<Decoded, ImageError> {
    let EncodedFile { path, length, source, .. } = file;
    // The decoder loads the whole file into memory.
    if length > admission.limits.images.texture_memory {
        let most = admission.limits.images.texture_memory;
        return Err(ImageError::memory(path, "a JPEG file", length, most, "texture_memory"));
    }
    let mut bytes = Vec::new();
    source.read_to_end(&mut bytes).map_err(|error| ImageError::io(path, "read the file", error))?;
    let head = JpegHead::of(&bytes).ok_or_else(|| ImageError::format(path, "JPEG without a header"))?;
    let size = (head.width, head.height);
    // Every picture of more than one component is decoded to RGB, also one of two.
    let n_channels = if head.n_channels > 1 { head.n_channels.max(3) } else { 1 };
    let working = length.saturating_add(head.decoder_bytes());
    admission.admit(path, &claim(size, n_channels, StoredType::U8, working))?;
    let mut decoder = jpeg_decoder(&bytes, None);
    let damaged = |error| ImageError::format(path, format!("JPEG: {error}"));
    decoder.decode_headers().map_err(damaged)?;
    let (color, n_channels) = match decoder.input_colorspace() {
        Some(ColorSpace::Luma) => (ColorSpace::Luma, 1),
        _ => (ColorSpace::RGB, 3),
    };
    // The color of what comes out is an option of a decoder that has not started.
    let mut decoder = jpeg_decoder(&bytes, Some(color));
    let texels = decoder.decode().map_err(damaged)?;
    let n_texels = u64::from(size.0) * u64::from(size.1) * n_channels as u64;
    if texels.len() as u64 != n_texels {
        return Err(ImageError::format(path, "JPEG with two headers of different sizes"));
    }
    Ok(plain(size, n_channels, (StoredType::U8, Texels::U8(texels))))
}

/// A decoder that takes what is damaged as far as it can, as other readers do.
fn jpeg_decoder(bytes: &[u8], color: Option<ColorSpace>) -> JpegDecoder<ZCursor<&[u8]>> {
    let options = DecoderOptions::default().set_strict_mode(false);
    let options = options.set_max_width(usize::MAX).set_max_height(usize::MAX);
    let options = color.map_or(options, |color| options.jpeg_set_out_colorspace(color));
    JpegDecoder::new_with_options(ZCursor::new(bytes), options)
}

fn plain((width, height): (u32, u32), n_channels: usize, values: (StoredType, Texels)) -> Decoded {
    Decoded::plain((width as usize, height as usize), channel_names(n_channels), values)
}
