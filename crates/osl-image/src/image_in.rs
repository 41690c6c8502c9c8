//! Reads files of all formats except EXR and TIFF through the crate image: one picture of one to four
//! channels.
//!
//! Only the pixels of the first frame are read; color profiles, texts and previews are skipped. A decoder
//! starts once the memory that it needs is admitted.

use std::error::Error;
use std::io::{Cursor, ErrorKind};
use std::path::Path;

use image::codecs::{bmp, dds, gif, hdr, jpeg, png, pnm, tga, webp};
use image::{ImageDecoder, ImageFormat};
use osl_limits::Images;

use crate::admission::{Admission, Claim};
use crate::decoded::Decoded;
use crate::error::ImageError;
use crate::image::{EncodedFile, StoredType, channel_names};
use crate::texels::Texels;

/// Memory of a decoder for tables, such as the color map of a TGA and the buffers of a PNG.
const TABLES: u64 = 1 << 20;

/// Bytes of the tables of codes that a byte of a WebP file can describe.
const CODES: u64 = 360;

/// A decoder that has read the header, and the memory that it needs besides the pixels.
type Opened<'a> = (Box<dyn ImageDecoder + 'a>, u64);

/// Decodes a file in one of these formats. The error for other files lists all formats that this crate reads.
pub(crate) fn decode(file: EncodedFile<'_>, admission: &Admission<'_>) -> Result<Decoded, ImageError> {
    let (path, length) = (file.path, file.length);
    let images = &admission.limits.images;
    let none = "not an EXR, PNG, JPEG, TIFF, HDR, TGA, BMP, GIF, WebP, PNM or DDS file";
    let format = format_of(&file.head).ok_or_else(|| ImageError::format(path, none))?;
    check_head(format, &file.head, images).map_err(|what| ImageError::format(path, what))?;
    // These decoders load the whole file into memory.
    let most = images.texture_memory;
    if length > most && matches!(format, ImageFormat::Jpeg | ImageFormat::WebP | ImageFormat::Gif) {
        return Err(ImageError::memory(
            path,
            format!("a {} file", name(format)),
            length,
            most,
            "texture_memory",
        ));
    }
    let codes = length.saturating_mul(CODES);
    // A file that begins with a lossy frame has no other one.
    let has_codes = format == ImageFormat::WebP && file.head.get(12..16) != Some(b"VP8 ");
    if has_codes && codes > most {
        let what = "the tables of codes that a WebP file of this length may describe";
        return Err(ImageError::memory(path, what.to_owned(), codes, most, "texture_memory"));
    }
    let damaged = |error| refused(path, format, error);
    let (mut decoder, working) = open(format, file, images).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let size = (width as usize, height as usize);
    let color = decoder.color_type();
    let n_channels = usize::from(color.channel_count());
    let stored = match color.bytes_per_pixel() / color.channel_count() {
        1 => StoredType::U8,
        2 => StoredType::U16,
        _ => StoredType::Float,
    };
    admission
        .admit(path, &Claim { size, full: size, n_channels, kept: stored, makes_levels: true, working })?;
    let mut texels = Texels::zeros(stored, size.0 * size.1 * n_channels);
    decoder.set_limits(at_most(working)).map_err(damaged)?;
    decoder.read_image(texels.bytes_mut()).map_err(damaged)?;
    if format == ImageFormat::Gif {
        // Where nothing is drawn, the reference has no color either.
        for pixel in texels.bytes_mut().chunks_exact_mut(4) {
            if let [.., 0] = pixel {
                pixel.fill(0);
            }
        }
    }
    Ok(Decoded::plain(size, channel_names(n_channels), (stored, texels)))
}

/// The format that the first bytes of a file mean. TGA has no signature, so its header must make sense.
fn format_of(head: &[u8]) -> Option<ImageFormat> {
    match (image::guess_format(head), head) {
        (Ok(format), _) => {
            Some(format).filter(|format| format.reading_enabled() || *format == ImageFormat::Dds)
        }
        (Err(_), [b'#', b'?', b'R', b'G', b'B', b'E', ..]) => Some(ImageFormat::Hdr),
        (
            Err(_),
            [_, map @ 0..=1, 1..=3 | 9..=11, _, _, _, _, map_bits, _, _, _, _, w0, w1, h0, h1, bits, ..],
        ) => {
            let known = |bits: &u8| matches!(bits, 8 | 15 | 16 | 24 | 32);
            let is_tga = known(bits) && (*map == 0 || known(map_bits)) && w0 | w1 != 0 && h0 | h1 != 0;
            is_tga.then_some(ImageFormat::Tga)
        }
        _ => None,
    }
}

/// The name of a format in messages.
fn name(format: ImageFormat) -> String {
    match format {
        ImageFormat::WebP => "WebP".to_owned(),
        other => format!("{other:?}").to_uppercase(),
    }
}

/// Refuses headers whose lines do not end or are too many, because the decoders load them into memory.
fn check_head(format: ImageFormat, head: &[u8], limits: &Images) -> Result<(), String> {
    let end_of = |mark: &[u8]| head.windows(mark.len()).position(|part| part == mark);
    let is_line = |byte: &&u8| **byte == b'\n';
    if format == ImageFormat::Hdr {
        let end = end_of(b"\n\n").ok_or("HDR file whose header does not end")?;
        if head.iter().skip(end + 2).find(is_line).is_none() {
            return Err("HDR file whose line of sizes does not end".to_owned());
        }
        let most = limits.attributes;
        if head.iter().take(end).filter(is_line).count() as u64 > most {
            return Err(format!("HDR file with more than {most} lines (--limit images.attributes=COUNT)"));
        }
    } else if head.starts_with(b"P7") && end_of(b"ENDHDR\n").is_none() {
        return Err("PNM file whose header does not end".to_owned());
    }
    Ok(())
}

/// Bounds for the decoders that know bounds.
fn at_most(bytes: u64) -> image::Limits {
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(bytes);
    limits
}

/// Reads the header of a file.
fn open<'a>(format: ImageFormat, file: EncodedFile<'a>, limits: &Images) -> image::ImageResult<Opened<'a>> {
    let EncodedFile { head, length, source, .. } = file;
    fn with<'a>(
        decoder: impl ImageDecoder + 'a,
        working: impl FnOnce(u64, u64) -> u64,
    ) -> image::ImageResult<Opened<'a>> {
        let (width, height) = decoder.dimensions();
        let working = working(width.into(), height.into()).saturating_add(TABLES);
        Ok((Box::new(decoder), working))
    }
    match format {
        ImageFormat::Png => {
            // Some rows, and texts, which are part of the file. The decoder reads each into a growing buffer.
            let width =
                head.get(16..20).and_then(|bytes| bytes.try_into().ok()).map_or(0, u32::from_be_bytes);
            let bytes = (u64::from(width) * 64 + 4 * length).min(limits.working_memory / 2);
            with(png::PngDecoder::with_limits(source, at_most(bytes + TABLES))?, |_, _| bytes)
        }
        ImageFormat::Jpeg => {
            // 16-bit coefficients of up to four channels. Blocks may extend beyond the border.
            let rows = if keeps_coefficients(&head) { u64::MAX } else { 32 };
            with(jpeg::JpegDecoder::new(source)?, |width, height| {
                (width + 32) * (height + 32).min(rows) * 8 + 2 * length
            })
        }
        ImageFormat::WebP => {
            let mut bytes = Vec::new();
            source.read_to_end(&mut bytes)?;
            let frame = largest_frame(&bytes);
            let decoder = webp::WebPDecoder::new(Cursor::new(bytes))?;
            let each = if decoder.has_animation() { 16 } else { 8 };
            // Those of ordinary files fit into this bound.
            let codes = length.saturating_mul(CODES).min(limits.working_memory);
            with(decoder, |width, height| (width * height).max(frame) * each + length + codes)
        }
        // A frame that is smaller than the image is decoded on its own.
        ImageFormat::Gif => with(gif::GifDecoder::new(source)?, |width, height| width * height * 4 + length),
        // Colors of a palette, and those of 15 bits, are expanded.
        ImageFormat::Tga => with(tga::TgaDecoder::new(source)?, |width, height| width * height * 2),
        ImageFormat::Hdr => with(hdr::HdrDecoder::new_nonstrict(source)?, |width, _| width * 4),
        ImageFormat::Bmp => with(bmp::BmpDecoder::new(source)?, |width, _| width * 4),
        ImageFormat::Dds => with(dds::DdsDecoder::new(source)?, |width, _| width * 4),
        _ => with(pnm::PnmDecoder::new(source)?, |_, _| 0),
    }
}

/// Whether decoding a JPEG keeps all coefficients until the end of the file, because several scans refine the
/// pixels or each scan has a part of the channels (ITU-T T.81, annex B). The answer is yes if the header does
/// not tell.
fn keeps_coefficients(head: &[u8]) -> bool {
    let scans_at_once = || {
        let (mut rest, mut n_channels) = (head.get(2..)?, None);
        loop {
            // Any number of fill bytes may precede a marker.
            rest = rest.get(rest.windows(2).position(|pair| matches!(pair, [0xff, 1..=0xfe]))?..)?;
            let [_, kind, l0, l1, ..] = rest else { return None };
            match (kind, rest) {
                // Markers without a segment.
                (0x01 | 0xd0..=0xd8, _) => {
                    rest = rest.get(2..)?;
                    continue;
                }
                (0xc0 | 0xc1, [_, _, _, _, _, _, _, _, _, n, ..]) if n_channels.is_none() => {
                    n_channels = Some(*n);
                }
                (0xc4 | 0xc8 | 0xcc, _) => {}
                (0xc0..=0xcf, _) => return Some(false),
                (0xda, [_, _, _, _, n, ..]) => return Some(n_channels == Some(*n)),
                _ => {}
            }
            rest = rest.get(2 + usize::from(u16::from_be_bytes([*l0, *l1])).max(2)..)?;
        }
    };
    scans_at_once() != Some(true)
}

/// Pixels of the largest lossy frame of a WebP. A file may claim other sizes elsewhere, which the decoder
/// compares only after decoding.
fn largest_frame(bytes: &[u8]) -> u64 {
    let side = |low: u8, high: u8| u64::from(u16::from_le_bytes([low, high]) & 0x3fff);
    let pixels = |part: &[u8]| match part {
        // The head of the chunk with its length, a tag of three bytes, a signature, width and height.
        [b'V', b'P', b'8', b' ', _, _, _, _, _, _, _, 0x9d, 0x01, 0x2a, w0, w1, h0, h1] => {
            side(*w0, *w1) * side(*h0, *h1)
        }
        _ => 0,
    };
    bytes.windows(18).map(pixels).max().unwrap_or(0)
}

/// The error of a decoder, in which the format is named.
fn refused(path: &Path, format: ImageFormat, error: image::ImageError) -> ImageError {
    use image::ImageError as Foreign;
    let what = match (error, format) {
        (Foreign::IoError(error), _) if error.kind() != ErrorKind::UnexpectedEof => {
            return ImageError::io(path, "read the file", error);
        }
        (Foreign::IoError(_), _) => "the file ends too early".to_owned(),
        (Foreign::Limits(_), _) => "it takes more memory (--limit images.working_memory=BYTES)".to_owned(),
        (Foreign::Parameter(_), ImageFormat::Dds) => "width and height must be multiples of 4".to_owned(),
        (Foreign::Unsupported(_), ImageFormat::Dds) => {
            "only DXT1, DXT3 and DXT5 (BC1 to BC3) are read".to_owned()
        }
        (error, _) => error.source().map_or_else(|| error.to_string(), ToString::to_string),
    };
    ImageError::format(path, format!("{}: {what}", name(format)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_of_jpeg_files_are_told_apart() {
        let file = |frame: u8, n_scanned: u8| {
            let start = [b"\xff\xd8\xff\xe0\0\x05abc\xff\xff".as_slice(), &[frame]].concat();
            [&start, b"\0\x0b\x08\x01\0\x02\0\x03abc\xff\xda\0\x08".as_slice(), &[n_scanned, 0, 0]].concat()
        };
        assert!(!keeps_coefficients(&file(0xc0, 3)), "one scan");
        assert!(keeps_coefficients(&file(0xc0, 1)), "a scan for each channel");
        assert!(keeps_coefficients(&file(0xc2, 3)), "progressive");
        for n in 0..24 {
            assert!(
                keeps_coefficients(file(0xc0, 3).get(..n).unwrap_or_default()),
                "the header does not tell"
            );
        }
    }
}
