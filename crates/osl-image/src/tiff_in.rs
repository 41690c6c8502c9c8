//! Reads one page of a TIFF file: integers of up to 16 bits and floats, in strips or tiles, chunky or planar.
//!
//! In files written by a texture tool, the pages are the levels of one image. In other files, pages marked as
//! reduced copies of another page are skipped.

use std::path::Path;

use tiff::ColorType;
use tiff::decoder::{DecodingResult, Limits};
use tiff::tags::{SampleFormat, Tag};

use crate::admission::{Admission, Claim};
use crate::decoded::Decoded;
use crate::error::ImageError;
use crate::image::{EncodedFile, Header, Source, StoredType, SubImage, channel_names};
use crate::texels::{Texels, bytes_of};
use crate::tiff_meta;
use crate::wrap::Wrap;

type Decoder<'a> = tiff::decoder::Decoder<&'a mut dyn Source>;

const PAGE_NAME: Tag = Tag::Unknown(285);

/// Whether a file begins as TIFF files of either byte order do, with 32-bit or 64-bit offsets.
pub(crate) fn is_tiff(bytes: &[u8]) -> bool {
    [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|magic| bytes.starts_with(*magic))
}

/// Decodes one of the pages.
pub(crate) fn decode(
    file: EncodedFile<'_>,
    admission: &Admission<'_>,
    part: SubImage<'_>,
) -> Result<Decoded, ImageError> {
    let EncodedFile { path, length, source, .. } = file;
    let damaged = |error: tiff::TiffError| ImageError::format(path, format!("not a readable TIFF: {error}"));
    let mut decoder = Decoder::new(source).map_err(damaged)?.with_limits(limits(admission));
    let levels = tiff_meta::is_texture(&mut decoder);
    let mut pages = pages(&mut decoder, levels, admission.limits.images.pages).map_err(damaged)?;
    let further = if levels { pages.split_off(pages.len().min(1)) } else { Vec::new() };
    let place = part.among(pages.iter().map(|page| page.name.as_deref()));
    let page = place.and_then(|place| pages.get(place)).ok_or_else(|| part.absent(path, pages.len()))?;
    decoder.seek_to_image(page.index).map_err(damaged)?;
    let layout = Layout::of(path, &mut decoder, length)?;
    let header = tiff_meta::header(&mut decoder, (layout.width, layout.height), &admission.limits.images);
    admission.admit(path, &layout.claim(&header, further.is_empty()))?;
    let (stored, texels) = pixels(path, &mut decoder, &layout)?;
    let coarser = coarser((path, length), &mut decoder, &further, &layout);
    Ok(Decoded {
        width: layout.width,
        height: layout.height,
        channels: channel_names(layout.n_channels),
        stored,
        wraps: header.attributes.text("wrapmodes").map(Wrap::pair_from_file).unwrap_or_default(),
        n_parts: pages.len(),
        header,
        texels,
        coarser,
    })
}

/// The pixels of the decoder's current page.
fn pixels(
    path: &Path,
    decoder: &mut Decoder<'_>,
    layout: &Layout,
) -> Result<(StoredType, Texels), ImageError> {
    let damaged = |error: tiff::TiffError| ImageError::format(path, format!("not a readable TIFF: {error}"));
    let mut result = DecodingResult::U8(Vec::new());
    decoder.read_image_to_buffer(&mut result).map_err(damaged)?;
    layout.texels(path, result)
}

/// The pages that form the coarser levels of a texture. They end at the first page that is damaged or not
/// smaller than the previous one.
fn coarser(
    (path, length): (&Path, u64),
    decoder: &mut Decoder<'_>,
    pages: &[Page],
    finest: &Layout,
) -> Vec<(usize, usize, Texels)> {
    let mut levels = Vec::new();
    let mut last = (finest.width, finest.height);
    for page in pages {
        let Ok(()) = decoder.seek_to_image(page.index) else { break };
        let Ok(layout) = Layout::of(path, decoder, length) else { break };
        // Half as wide and half as high, except for rounding, and of the same type, so that all levels
        // together take a third of the first, which is what was admitted.
        let fits = layout.width <= last.0.div_ceil(2) && layout.height <= last.1.div_ceil(2);
        let alike = layout.n_channels == finest.n_channels && layout.kept == finest.kept;
        if !fits || !alike || (layout.width, layout.height) == last {
            break;
        }
        let Ok((_, texels)) = pixels(path, decoder, &layout) else { break };
        last = (layout.width, layout.height);
        levels.push((layout.width, layout.height, texels));
    }
    levels
}

/// Byte limits that permit the admitted amount: each page is admitted before its pixels are read.
fn limits(admission: &Admission<'_>) -> Limits {
    let images = &admission.limits.images;
    let bytes = images.texture_memory.saturating_add(images.working_memory);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = usize::try_from(bytes).unwrap_or(usize::MAX);
    limits.intermediate_buffer_size = limits.decoding_buffer_size;
    limits
}

/// One page that is not the reduced copy of another.
struct Page {
    /// Its place among all pages.
    index: usize,
    name: Option<String>,
}

/// The pages of a file; reduced copies are skipped unless they are levels.
fn pages(decoder: &mut Decoder<'_>, levels: bool, most: u64) -> Result<Vec<Page>, tiff::TiffError> {
    let mut pages = Vec::new();
    let mut next = decoder.ifd_pointer();
    for index in 0..usize::try_from(most).unwrap_or(usize::MAX) {
        let Some(pointer) = next else { break };
        // Later damage does not affect the pages before it.
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
    /// The type in which samples are kept.
    kept: StoredType,
    /// Bytes of the decoder's buffers: that of the image, and that of a strip or tile.
    buffers: (u64, u64),
}

impl Layout {
    /// The layout of the decoder's current page, if its kind is supported and the file can hold it.
    fn of(path: &Path, decoder: &mut Decoder<'_>, length: u64) -> Result<Self, ImageError> {
        let damaged =
            |error: tiff::TiffError| ImageError::format(path, format!("not a readable TIFF: {error}"));
        let (width, height) = decoder.dimensions().map_err(damaged)?;
        let color = decoder.colortype().map_err(damaged)?;
        let n_channels = usize::from(color.num_samples());
        let known = match color {
            ColorType::Gray(bits) => matches!(bits, 1 | 2 | 4 | 8 | 16 | 32 | 64),
            ColorType::GrayA(bits) | ColorType::RGB(bits) | ColorType::RGBA(bits) => bits >= 8,
            ColorType::Multiband { bit_depth, .. } => bit_depth >= 8,
            _ => false,
        };
        let unknown = || ImageError::format(path, format!("TIFF with pixels of the kind {color:?}"));
        let (columns, rows) = decoder.chunk_dimensions();
        let samples = u64::from(width).saturating_mul(height.into()).saturating_mul(n_channels as u64);
        let of_chunk = u64::from(columns).saturating_mul(rows.into()).saturating_mul(n_channels as u64);
        // The decoder multiplies these sizes itself, so they must not overflow.
        if !known || samples > MOST || of_chunk > MOST {
            return Err(if known { too_large(path, samples.max(of_chunk)) } else { unknown() });
        }
        check_strips(path, decoder, length)?;
        let buffer = decoder.image_buffer_layout().map_err(damaged)?;
        let bits = color.bit_depth();
        let kept = match (buffer.sample_format, bits) {
            (SampleFormat::Uint, ..=8) => StoredType::U8,
            (SampleFormat::Uint, 16) => StoredType::U16,
            (SampleFormat::IEEEFP, 16) => StoredType::Half,
            (SampleFormat::Uint | SampleFormat::Int | SampleFormat::IEEEFP, _) => StoredType::Float,
            _ => return Err(unknown()),
        };
        let chunk = of_chunk.saturating_mul(u64::from(bits.max(8)) / 8);
        Ok(Self {
            width: width as usize,
            height: height as usize,
            n_channels,
            bits,
            planar: buffer.planes > 1,
            kept,
            buffers: (buffer.complete_len as u64, chunk),
        })
    }

    /// The memory that the page needs.
    fn claim(&self, header: &Header, makes_levels: bool) -> Claim {
        let size = (self.width, self.height);
        let kept = (self.width as u64)
            .saturating_mul(self.height as u64)
            .saturating_mul(self.n_channels as u64)
            .saturating_mul(bytes_of(self.kept));
        let (image, chunk) = self.buffers;
        // Samples of other types are converted, and those of planes are rearranged.
        let is_copied = self.planar || self.bits < 8 || image != kept;
        let copies = if is_copied { image.max(kept) } else { 0 };
        let working = copies.saturating_add(chunk.saturating_mul(2));
        let full = header.whole_size().unwrap_or(size);
        Claim { size, full, n_channels: self.n_channels, kept: self.kept, makes_levels, working }
    }

    /// The decoder's samples, pixel by pixel.
    fn texels(&self, path: &Path, result: DecodingResult) -> Result<(StoredType, Texels), ImageError> {
        let (stored, texels) = match result {
            DecodingResult::U8(bytes) if self.bits < 8 => (StoredType::U8, Texels::U8(self.unpacked(&bytes))),
            DecodingResult::U8(bytes) => (StoredType::U8, Texels::U8(bytes)),
            DecodingResult::U16(words) => (StoredType::U16, Texels::U16(words)),
            DecodingResult::F16(halves) => (StoredType::Half, Texels::Half(halves)),
            DecodingResult::F32(floats) => (StoredType::Float, Texels::Float(floats)),
            DecodingResult::F64(doubles) => {
                let floats = doubles.into_iter().map(|value| value as f32).collect();
                (StoredType::Float, Texels::Float(floats))
            }
            DecodingResult::I8(numbers) => (StoredType::I8, fractions(numbers, i8::MAX)),
            DecodingResult::I16(numbers) => (StoredType::I16, fractions(numbers, i16::MAX)),
            DecodingResult::I32(numbers) => (StoredType::I32, fractions(numbers, i32::MAX)),
            DecodingResult::U32(_) | DecodingResult::U64(_) | DecodingResult::I64(_) => {
                return Err(ImageError::format(path, "TIFF with unsigned 32-bit or with 64-bit integers"));
            }
        };
        let n_pixels = self.width * self.height;
        if texels.len() != n_pixels * self.n_channels {
            return Err(ImageError::format(path, "TIFF with a page that is not of its size"));
        }
        Ok((stored, if self.planar { self.interleaved(texels) } else { texels }))
    }

    /// Converts planes to pixels.
    fn interleaved(&self, texels: Texels) -> Texels {
        let (n_pixels, n_channels) = (self.width * self.height, self.n_channels);
        fn of<T: Copy>(planes: &[T], n_pixels: usize, n_channels: usize) -> Vec<T> {
            (0..n_pixels * n_channels).map(|i| planes[i % n_channels * n_pixels + i / n_channels]).collect()
        }
        match texels {
            Texels::U8(list) => Texels::U8(of(&list, n_pixels, n_channels)),
            Texels::U16(list) => Texels::U16(of(&list, n_pixels, n_channels)),
            Texels::Half(list) => Texels::Half(of(&list, n_pixels, n_channels)),
            Texels::Float(list) => Texels::Float(of(&list, n_pixels, n_channels)),
        }
    }

    /// Samples of less than a byte, scaled to bytes. Each row begins with a new byte, the first sample in its
    /// highest bits.
    fn unpacked(&self, bytes: &[u8]) -> Vec<u8> {
        let bits = usize::from(self.bits);
        let largest = (1_u8 << bits) - 1;
        let row_bytes = (self.width * bits).div_ceil(8);
        let in_row = |row: &[u8], x: usize| {
            let shift = 8 - bits - x * bits % 8;
            row.get(x * bits / 8).map_or(0, |byte| (byte >> shift & largest) * (255 / largest))
        };
        let rows = bytes.chunks(row_bytes.max(1)).take(self.height);
        rows.flat_map(|row| (0..self.width).map(move |x| in_row(row, x))).collect()
    }
}

/// No image may have more samples, whatever the limits: below this, sizes in bytes do not overflow.
const MOST: u64 = 1 << 40;

fn too_large(path: &Path, samples: u64) -> ImageError {
    ImageError::TooLarge { path: path.to_owned(), samples, limit: MOST }
}

/// Refuses a page whose strips or tiles together are longer than the file: a damaged file may refer to the
/// same bytes very often, and they would be read each time.
fn check_strips(path: &Path, decoder: &mut Decoder<'_>, length: u64) -> Result<(), ImageError> {
    for tag in [Tag::StripByteCounts, Tag::TileByteCounts] {
        let Ok(Some(counts)) = decoder.find_tag_unsigned_vec::<u64>(tag) else { continue };
        if counts.into_iter().fold(0, u64::saturating_add) > length {
            return Err(ImageError::format(path, "TIFF with a page that is longer than the file"));
        }
    }
    Ok(())
}

/// Integers as fractions of the largest value of their type.
fn fractions<T: Into<f64>>(numbers: Vec<T>, largest: T) -> Texels {
    let largest: f64 = largest.into();
    Texels::Float(numbers.into_iter().map(|number| (number.into() / largest) as f32).collect())
}
