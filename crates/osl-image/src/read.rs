//! Reading: EXR, PNG and JPEG to interleaved `f32`.
//!
//! Which format a file has is told by its first bytes, not its name. Sizes are checked against a limit before
//! memory is taken for them, and damage becomes an error value. No color conversion happens: an 8-bit value is
//! its byte over 255. It must not know how textures are looked up.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::meta::MetaData;
use exr::prelude::{AnyChannel, FlatSamples, ReadChannels, ReadLayers};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use crate::error::ImageError;
use crate::file;
use crate::wrap::Wrap;

/// The most samples (width times height times channels) that [`read_image`] takes: one gibibyte of `f32`.
pub const MAX_SAMPLES: u64 = 1 << 28;

/// The first bytes of every EXR file.
const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// How a file stores its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoredType {
    /// 8-bit integers, read as fractions of 255.
    U8,
    /// 16-bit integers, read as fractions of 65535.
    U16,
    /// 32-bit integers (EXR), read as numbers: they count things and are no fractions.
    U32,
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
    /// say. Only EXR files can.
    pub wraps: (Wrap, Wrap),
    /// `width * height * channels.len()` values, pixel by pixel, row 0 (the first scanline) first.
    pub samples: Vec<f32>,
}

impl ImageData {
    /// The values of one channel, row 0 first; empty if there is no such channel.
    pub fn plane(&self, channel: usize) -> Vec<f32> {
        let n_channels = self.channels.len().max(1);
        self.samples.iter().skip(channel).step_by(n_channels).copied().collect()
    }
}

/// Reads an EXR, PNG or JPEG file of up to [`MAX_SAMPLES`] samples.
///
/// Of an EXR the first layer of plain pixels is taken, at its full resolution.
///
/// **Errors**: what the disk refuses, formats that are not among the three, damaged files, too large images.
pub fn read_image(path: &Path) -> Result<ImageData, ImageError> {
    decode_image(path, &file::read(path)?, MAX_SAMPLES)
}

/// Decodes the bytes of a file. `path` serves the error text alone; `limit` is in samples.
///
/// **Errors**: as for [`read_image`].
pub fn decode_image(path: &Path, bytes: &[u8], limit: u64) -> Result<ImageData, ImageError> {
    let decoded = catch_unwind(AssertUnwindSafe(|| {
        if bytes.starts_with(&EXR_MAGIC) {
            decode_exr(path, bytes, limit)
        } else {
            decode_integers(path, bytes, limit)
        }
    }));
    // A texture must not be able to end the process. This barrier is needed: where overflow is checked, a
    // damaged file that claims B44 compression makes exr 1.74.2 panic (a subtraction in `b44::decompress`).
    // Nothing outside the closure is half-changed then.
    decoded.unwrap_or_else(|_| Err(ImageError::format(path, "the decoder failed on a damaged file")))
}

fn check_samples(
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

fn decode_exr(path: &Path, bytes: &[u8], limit: u64) -> Result<ImageData, ImageError> {
    let damaged = |error: exr::error::Error| ImageError::format(path, format!("not a readable EXR: {error}"));
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(damaged)?;
    for header in meta.headers.iter().filter(|header| !header.deep) {
        let size = header.layer_size;
        check_samples(path, size.width(), size.height(), header.channels.list.len(), limit)?;
        if header.channels.list.iter().any(|c| c.sampling.width() != 1 || c.sampling.height() != 1) {
            return Err(ImageError::format(path, "EXR with channels of different resolutions"));
        }
    }
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
    // On this thread: a panic in one of the decoder's own workers would abort the process, barrier or not.
    let reader = reader.first_valid_layer().all_attributes().non_parallel();
    let image = reader.from_buffered(Cursor::new(bytes)).map_err(damaged)?;
    let layer = image.layer_data;
    let wraps = layer.attributes.wrap_mode_name.map(|text| Wrap::pair_from_file(&text.to_string()));
    let (width, height) = (layer.size.width(), layer.size.height());
    let mut channels: Vec<_> = layer.channel_data.list.into_iter().collect();
    channels.sort_by_cached_key(|channel| channel_order(&channel.name.to_string()));
    check_samples(path, width, height, channels.len(), limit)?;
    let image = interleaved(path, width, height, &channels)?;
    Ok(ImageData { wraps: wraps.unwrap_or_default(), ..image })
}

fn interleaved(
    path: &Path,
    width: usize,
    height: usize,
    channels: &[AnyChannel<FlatSamples>],
) -> Result<ImageData, ImageError> {
    let n_channels = channels.len();
    let mut samples = vec![0.0; width * height * n_channels];
    for (i, channel) in channels.iter().enumerate() {
        if channel.sample_data.len() != width * height {
            return Err(ImageError::format(path, "EXR with a channel that is not of the image's size"));
        }
        let slots = samples.iter_mut().skip(i).step_by(n_channels);
        for (slot, value) in slots.zip(channel.sample_data.values_as_f32()) {
            *slot = value;
        }
    }
    let stored = match channels.first().map(|c| &c.sample_data) {
        Some(FlatSamples::F16(_)) => StoredType::Half,
        Some(FlatSamples::U32(_)) => StoredType::U32,
        _ => StoredType::Float,
    };
    let channels = channels.iter().map(|c| c.name.to_string()).collect();
    Ok(ImageData { width, height, channels, stored, wraps: Default::default(), samples })
}

/// A key that puts bare names before those of layers, and within a layer R, G, B, A before the rest.
fn channel_order(name: &str) -> (String, usize, String) {
    let (layer, base) = name.rsplit_once('.').unwrap_or(("", name));
    let rank = ["R", "G", "B", "A"].iter().position(|known| *known == base).unwrap_or(4);
    (layer.to_owned(), rank, base.to_owned())
}

fn decode_integers(path: &Path, bytes: &[u8], limit: u64) -> Result<ImageData, ImageError> {
    let damaged = |error: image::ImageError| ImageError::format(path, error);
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let mut reader = reader.map_err(|error| ImageError::io(path, "read the file", error))?;
    if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg)) {
        return Err(ImageError::format(path, "not an EXR, PNG or JPEG file"));
    }
    let mut limits = image::Limits::default();
    // Room for 16-bit samples and what the decoder needs beside them.
    limits.max_alloc = Some(limit.saturating_mul(4).saturating_add(1 << 20));
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let n_channels = usize::from(decoder.color_type().channel_count());
    let (width, height) = (width as usize, height as usize);
    check_samples(path, width, height, n_channels, limit)?;
    let image = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    Ok(from_dynamic(width, height, image))
}

fn from_dynamic(width: usize, height: usize, image: DynamicImage) -> ImageData {
    let names: &[&str] = match image.color().channel_count() {
        1 => &["Y"],
        2 => &["Y", "A"],
        3 => &["R", "G", "B"],
        _ => &["R", "G", "B", "A"],
    };
    let (stored, samples) = match image {
        DynamicImage::ImageLuma8(image) => (StoredType::U8, from_bytes(image.as_raw())),
        DynamicImage::ImageLumaA8(image) => (StoredType::U8, from_bytes(image.as_raw())),
        DynamicImage::ImageRgb8(image) => (StoredType::U8, from_bytes(image.as_raw())),
        DynamicImage::ImageRgba8(image) => (StoredType::U8, from_bytes(image.as_raw())),
        DynamicImage::ImageLuma16(image) => (StoredType::U16, from_words(image.as_raw())),
        DynamicImage::ImageLumaA16(image) => (StoredType::U16, from_words(image.as_raw())),
        DynamicImage::ImageRgb16(image) => (StoredType::U16, from_words(image.as_raw())),
        DynamicImage::ImageRgba16(image) => (StoredType::U16, from_words(image.as_raw())),
        // The two formats store nothing else; the conversion covers what a later decoder may add.
        other => (StoredType::U16, from_words(other.to_rgba16().as_raw())),
    };
    let n_channels = samples.len() / (width * height).max(1);
    let names = if n_channels == names.len() { names } else { &["R", "G", "B", "A"] };
    let channels = names.iter().map(|name| (*name).to_owned()).collect();
    ImageData { width, height, channels, stored, wraps: Default::default(), samples }
}

/// Fractions as the reference computes them (measured): times a rounded 1/255, which differs from a division
/// in the last bit of some bytes and still gives exactly 1 for 255.
fn from_bytes(bytes: &[u8]) -> Vec<f32> {
    bytes.iter().map(|&byte| f32::from(byte) * (1.0 / 255.0)).collect()
}

fn from_words(words: &[u16]) -> Vec<f32> {
    words.iter().map(|&word| f32::from(word) * (1.0 / 65535.0)).collect()
}
