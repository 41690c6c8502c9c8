//! Writes one or three planes as a PNG file, optionally with a plane of alpha after them. The
//! caller names the curve.

use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use rayon::prelude::*;

use crate::error::ImageError;
use crate::exr_out::{check_plane, check_size};
use crate::file;
use crate::transfer::Transfer;

/// The integers of a PNG file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BitDepth {
    /// 0 to 255.
    #[default]
    Eight,
    /// 0 to 65535.
    Sixteen,
}

/// How [`write_png`] stores its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PngOptions {
    /// The curve between the values and the stored integers. The usual choice is the sRGB curve for a color,
    /// and no curve for a single float, since a mask is a ratio and 0.5 should be half of the range.
    pub transfer: Transfer,
    /// The size of the integers.
    pub depth: BitDepth,
    /// The program that made the image: the text `Software`. It is to have ASCII characters only.
    pub software: Option<&'static str>,
}

/// Writes one plane as grey or three as RGB, clamped to 0..=1, halves rounded up, NaN as 0. A second or
/// fourth plane is alpha, stored without the curve.
///
/// **Shape**: each plane has `width * height` values, row 0 first.
///
/// **Errors**: there are no planes or more than 4, sizes do not match, or the system refuses. The file at
/// `path` is then unchanged.
pub fn write_png(
    path: &Path,
    width: usize,
    height: usize,
    planes: &[&[f32]],
    options: PngOptions,
) -> Result<(), ImageError> {
    file::replace(path, &png_bytes(path, width, height, planes, options)?)
}

/// The bytes of the file that [`write_png`] writes. `path` is used only in error messages.
///
/// **Errors**: those of [`write_png`], except system errors.
pub fn png_bytes(
    path: &Path,
    width: usize,
    height: usize,
    planes: &[&[f32]],
    options: PngOptions,
) -> Result<Vec<u8>, ImageError> {
    check_size(path, width, height)?;
    if !matches!(planes.len(), 1..=4) {
        return Err(ImageError::input(path, format!("a PNG takes 1 to 4 planes, not {}", planes.len())));
    }
    for (i, plane) in planes.iter().enumerate() {
        check_plane(path, &format!("plane {i}"), plane, width * height)?;
    }
    use ExtendedColorType::{L8, L16, La8, La16, Rgb8, Rgb16, Rgba8, Rgba16};
    let color = match (planes.len(), options.depth) {
        (1, BitDepth::Eight) => L8,
        (1, BitDepth::Sixteen) => L16,
        (2, BitDepth::Eight) => La8,
        (2, BitDepth::Sixteen) => La16,
        (3, BitDepth::Eight) => Rgb8,
        (3, BitDepth::Sixteen) => Rgb16,
        (_, BitDepth::Eight) => Rgba8,
        (_, BitDepth::Sixteen) => Rgba16,
    };
    let stored = png_samples(planes, width * height, options);
    let mut bytes = Vec::new();
    // `check_size` made sure that both fit. The fast compression takes a third of the time and a third more
    // bytes.
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    let encoded = encoder.write_image(&stored, width as u32, height as u32, color);
    encoded.map_err(|error| ImageError::format(path, format!("cannot encode PNG: {error}")))?;
    if let Some(name) = options.software {
        let text = [b"tEXtSoftware\0", name.as_bytes()].concat();
        let length = text.len() as u32 - 4;
        let chunk = [&length.to_be_bytes()[..], &text, &crc(&text).to_be_bytes()].concat();
        bytes.splice(HEADER..HEADER, chunk);
    }
    Ok(bytes)
}

/// Bytes of the signature and of the chunk IHDR.
const HEADER: usize = 8 + 25;

/// The check sum of a chunk's kind and data (PNG specification, annex D). The crate image writes no texts.
fn crc(bytes: &[u8]) -> u32 {
    let next = |sum: u32, _| (sum >> 1) ^ (0xedb8_8320 * (sum & 1));
    !bytes.iter().fold(!0, |sum, byte| (0..8).fold(sum ^ u32::from(*byte), next))
}

/// Pixels that one thread converts at a time.
const PIECE: usize = 1 << 13;

/// The samples that [`write_png`] stores, pixel by pixel, in the byte order of this machine. A plane that is
/// too short continues with zero bytes.
pub fn png_samples(planes: &[&[f32]], n_pixels: usize, options: PngOptions) -> Vec<u8> {
    let bytes = if options.depth == BitDepth::Eight { 1 } else { 2 };
    let pixel = planes.len() * bytes;
    let mut stored = vec![0; n_pixels * pixel];
    stored.par_chunks_mut((PIECE * pixel).max(1)).enumerate().for_each(|(piece, stored)| {
        for (index, plane) in planes.iter().enumerate() {
            let is_alpha = index % 2 == 1 && index + 1 == planes.len();
            let transfer = if is_alpha { Transfer::Linear } else { options.transfer };
            let values = plane.get(piece * PIECE..).unwrap_or_default().iter();
            let places = stored.get_mut(index * bytes..).unwrap_or_default().chunks_mut(pixel);
            for (place, value) in places.zip(values) {
                match (options.depth, place) {
                    (BitDepth::Eight, [byte, ..]) => *byte = transfer.byte(*value),
                    (BitDepth::Sixteen, [first, second, ..]) => {
                        [*first, *second] = transfer.quantize(*value, 65535).to_ne_bytes();
                    }
                    _ => {}
                }
            }
        }
    });
    stored
}
