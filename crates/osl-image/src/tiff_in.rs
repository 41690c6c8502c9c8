//! Reading one page of a TIFF file: integers of up to 16 bits and floats, in strips or tiles, chunky or planar.
//!
//! The pages of a file that a texture tool wrote are the levels of one image. In other files, pages that are marked as
//! reduced copies of another are passed over. It must not know other formats.

use std::io::Cursor;
use std::path::Path;

use half::f16;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::{SampleFormat, Tag};

use crate::error::ImageError;
use crate::read::{ImageData, StoredType, SubImage, channel_names, check_samples, from_bytes, from_words};
use crate::tiff_meta;
use crate::wrap::Wrap;

/// The most pages of a file that are looked at; pages of a damaged file may overlap and be very many.
const MAX_PAGES: usize = 1024;

const PAGE_NAME: Tag = Tag::Unknown(285);

/// Whether a file begins as TIFF files of either byte order do, with 32-bit or 64-bit offsets.
pub(crate) fn is_tiff(bytes: &[u8]) -> bool {
    [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|magic| bytes.starts_with(*magic))
}

/// Decodes one of the pages.
pub(crate) fn decode(
    path: &Path,
    bytes: &[u8],
    limit: u64,
    part: SubImage<'_>,
) -> Result<ImageData, ImageError> {
    let damaged = |error: tiff::TiffError| ImageError::format(path, format!("not a readable TIFF: {error}"));
    let decoder = Decoder::new(Cursor::new(bytes)).map_err(damaged)?;
    let mut decoder = decoder.with_limits(limits(limit));
    let levels = tiff_meta::is_texture(&mut decoder);
    let mut pages = pages(&mut decoder, levels).map_err(damaged)?;
    let further = if levels { pages.split_off(pages.len().min(1)) } else { Vec::new() };
    let place = part.among(pages.iter().map(|page| page.name.as_deref()));
    let page = place.and_then(|place| pages.get(place)).ok_or_else(|| part.absent(path, pages.len()))?;
    decoder.seek_to_image(page.index).map_err(damaged)?;
    let (layout, stored, samples) = pixels(path, &mut decoder, limit)?;
    let mut header = tiff_meta::header(&mut decoder, (layout.width, layout.height));
    header.coarser = coarser(path, &mut decoder, &further, &layout);
    Ok(ImageData {
        width: layout.width,
        height: layout.height,
        channels: channel_names(layout.n_channels),
        stored,
        wraps: header.attributes.text("wrapmodes").map(Wrap::pair_from_file).unwrap_or_default(),
        n_parts: pages.len(),
        header,
        samples,
    })
}

/// The pixels of the page that the decoder is at.
fn pixels(
    path: &Path,
    decoder: &mut Decoder<Cursor<&[u8]>>,
    limit: u64,
) -> Result<(Layout, StoredType, Vec<f32>), ImageError> {
    let damaged = |error: tiff::TiffError| ImageError::format(path, format!("not a readable TIFF: {error}"));
    let layout = Layout::of(path, decoder, limit)?;
    let mut result = DecodingResult::U8(Vec::new());
    decoder.read_image_to_buffer(&mut result).map_err(damaged)?;
    let (stored, samples) = layout.samples(path, result)?;
    Ok((layout, stored, samples))
}

/// The pages that are coarser and coarser levels of a texture. The first that is damaged, or not smaller than the one
/// before, ends them.
fn coarser(
    path: &Path,
    decoder: &mut Decoder<Cursor<&[u8]>>,
    pages: &[Page],
    finest: &Layout,
) -> Vec<(usize, usize, Vec<f32>)> {
    let mut levels = Vec::new();
    let mut last = (finest.width, finest.height);
    for page in pages {
        // Half as wide and half as high, but for rounding, so that all levels together are smaller than the first.
        let most =
            last.0.div_ceil(2).saturating_mul(last.1.div_ceil(2)).saturating_mul(finest.n_channels) as u64;
        let Ok(()) = decoder.seek_to_image(page.index) else { break };
        let Ok((layout, _, samples)) = pixels(path, decoder, most) else { break };
        if layout.n_channels != finest.n_channels || (layout.width, layout.height) == last {
            break;
        }
        last = (layout.width, layout.height);
        levels.push((layout.width, layout.height, samples));
    }
    levels
}

/// Limits in bytes that let through what the limit of samples does.
fn limits(samples: u64) -> Limits {
    let bytes = usize::try_from(samples.saturating_mul(8)).unwrap_or(usize::MAX);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = bytes;
    limits.intermediate_buffer_size = bytes.saturating_add(1 << 20);
    limits
}

/// One page that is not the reduced copy of another.
struct Page {
    /// Its place among all pages.
    index: usize,
    name: Option<String>,
}

/// The pages of a file; reduced copies are passed over unless they are levels.
fn pages(decoder: &mut Decoder<Cursor<&[u8]>>, levels: bool) -> Result<Vec<Page>, tiff::TiffError> {
    let mut pages = Vec::new();
    let mut next = decoder.ifd_pointer();
    for index in 0..MAX_PAGES {
        let Some(pointer) = next else { break };
        // Damage further on does not spoil the pages before it.
        let directory = match decoder.read_directory(pointer) {
            Err(_) if index > 0 => break,
            directory => directory?,
        };
        next = directory.next();
        let mut tags = decoder.read_directory_tags(&directory);
        let kind = tags.find_tag_unsigned::<u32>(Tag::NewSubfileType).ok().flatten().unwrap_or(0);
        if index == 0 || levels || kind & 1 == 0 {
            let name = tags.find_tag(PAGE_NAME).ok().flatten().and_then(|value| value.into_string().ok());
            pages.push(Page { index, name });
        }
    }
    Ok(pages)
}

/// How the samples of a page lie in the decoder's buffer.
struct Layout {
    width: usize,
    height: usize,
    n_channels: usize,
    /// Bits of a sample; those below 8 share bytes.
    bits: u8,
    /// Whether each channel has a plane of its own.
    planar: bool,
}

impl Layout {
    /// The layout of the page that the decoder is at, if its size is within the limit and its kind known.
    fn of(path: &Path, decoder: &mut Decoder<Cursor<&[u8]>>, limit: u64) -> Result<Self, ImageError> {
        let damaged =
            |error: tiff::TiffError| ImageError::format(path, format!("not a readable TIFF: {error}"));
        let (width, height) = decoder.dimensions().map_err(damaged)?;
        let color = decoder.colortype().map_err(damaged)?;
        let (width, height, n_channels) = (width as usize, height as usize, usize::from(color.num_samples()));
        check_samples(path, width, height, n_channels, limit)?;
        let known = match color {
            ColorType::Gray(bits) => matches!(bits, 1 | 2 | 4 | 8 | 16 | 32 | 64),
            ColorType::GrayA(bits) | ColorType::RGB(bits) | ColorType::RGBA(bits) => bits >= 8,
            ColorType::Multiband { bit_depth, .. } => bit_depth >= 8,
            _ => false,
        };
        let buffer = decoder.image_buffer_layout().map_err(damaged)?;
        let small_enough = buffer.complete_len as u64 <= limit.saturating_mul(8);
        if !known
            || !small_enough
            || !matches!(buffer.sample_format, SampleFormat::Uint | SampleFormat::Int | SampleFormat::IEEEFP)
        {
            return Err(ImageError::format(path, format!("TIFF with pixels of the kind {color:?}")));
        }
        Ok(Self { width, height, n_channels, bits: color.bit_depth(), planar: buffer.planes > 1 })
    }

    /// The decoder's samples as floats, pixel by pixel.
    fn samples(&self, path: &Path, result: DecodingResult) -> Result<(StoredType, Vec<f32>), ImageError> {
        let (stored, samples) = match result {
            DecodingResult::U8(bytes) if self.bits < 8 => (StoredType::U8, self.unpacked(&bytes)),
            DecodingResult::U8(bytes) => (StoredType::U8, from_bytes(&bytes)),
            DecodingResult::U16(words) => (StoredType::U16, from_words(&words)),
            DecodingResult::F16(halves) => (StoredType::Half, halves.into_iter().map(f16::to_f32).collect()),
            DecodingResult::F32(floats) => (StoredType::Float, floats),
            DecodingResult::F64(doubles) => {
                (StoredType::Float, doubles.into_iter().map(|value| value as f32).collect())
            }
            DecodingResult::I8(numbers) => (StoredType::I8, fractions(numbers, i8::MAX)),
            DecodingResult::I16(numbers) => (StoredType::I16, fractions(numbers, i16::MAX)),
            DecodingResult::I32(numbers) => (StoredType::I32, fractions(numbers, i32::MAX)),
            DecodingResult::U32(_) | DecodingResult::U64(_) | DecodingResult::I64(_) => {
                return Err(ImageError::format(path, "TIFF with unsigned 32-bit or with 64-bit integers"));
            }
        };
        let n_pixels = self.width * self.height;
        if samples.len() != n_pixels * self.n_channels {
            return Err(ImageError::format(path, "TIFF with a page that is not of its size"));
        }
        Ok((stored, if self.planar { interleaved(&samples, n_pixels, self.n_channels) } else { samples }))
    }

    /// Samples of less than a byte, scaled to bytes. Each row begins with a new byte, the first sample in its
    /// highest bits.
    fn unpacked(&self, bytes: &[u8]) -> Vec<f32> {
        let bits = usize::from(self.bits);
        let largest = (1_u8 << bits) - 1;
        let row_bytes = (self.width * bits).div_ceil(8);
        let in_row = |row: &[u8], x: usize| {
            let shift = 8 - bits - x * bits % 8;
            row.get(x * bits / 8).map_or(0, |byte| (byte >> shift & largest) * (255 / largest))
        };
        let rows = bytes.chunks(row_bytes.max(1)).take(self.height);
        let unpacked: Vec<u8> = rows.flat_map(|row| (0..self.width).map(move |x| in_row(row, x))).collect();
        from_bytes(&unpacked)
    }
}

/// Integers as fractions of the largest of their type.
fn fractions<T: Into<f64>>(numbers: Vec<T>, largest: T) -> Vec<f32> {
    let largest: f64 = largest.into();
    numbers.into_iter().map(|number| (number.into() / largest) as f32).collect()
}

/// Planes to pixels.
fn interleaved(planes: &[f32], n_pixels: usize, n_channels: usize) -> Vec<f32> {
    (0..n_pixels * n_channels).map(|i| planes[i % n_channels * n_pixels + i / n_channels]).collect()
}
