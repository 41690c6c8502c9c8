//! A texture in memory: the image and its coarser levels.
//!
//! Coarser levels are made when a filtered lookup first asks for one, so that unfiltered lookups never pay for
//! them. It must not know coordinates or filters.

use std::sync::OnceLock;

use half::f16;

use crate::read::{ImageData, StoredType};
use crate::wrap::Wrap;

/// An image ready for lookups, with its mip-maps. Shared between threads as it is.
#[derive(Debug)]
pub struct Texture {
    finest: Level,
    coarser: OnceLock<Vec<Level>>,
    channels: Vec<String>,
    stored: StoredType,
    wraps: (Wrap, Wrap),
    n_parts: usize,
}

/// One resolution of a texture.
#[derive(Debug)]
pub(crate) struct Level {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// `width * height * n_channels` values, pixel by pixel, row 0 first.
    pub(crate) samples: Vec<f32>,
}

impl Texture {
    /// Takes over the pixels of an image. An image whose sample count does not fit its sizes becomes one
    /// without pixels, which is black everywhere.
    pub fn new(image: ImageData) -> Self {
        let expected =
            image.width.checked_mul(image.height).and_then(|n| n.checked_mul(image.channels.len()));
        let fits = expected == Some(image.samples.len()) && !image.samples.is_empty();
        let finest = if fits {
            Level { width: image.width, height: image.height, samples: image.samples }
        } else {
            Level { width: 0, height: 0, samples: Vec::new() }
        };
        let coarser = OnceLock::new();
        let ImageData { channels, stored, wraps, n_parts, .. } = image;
        Self { finest, coarser, channels, stored, wraps, n_parts }
    }

    /// Pixels in a row of the finest level.
    pub fn width(&self) -> usize {
        self.finest.width
    }

    /// Rows of the finest level.
    pub fn height(&self) -> usize {
        self.finest.height
    }

    /// The names of the channels, in the order that lookups count them.
    pub fn channels(&self) -> &[String] {
        &self.channels
    }

    /// How the file stored its samples.
    pub fn stored(&self) -> StoredType {
        self.stored
    }

    /// The wraps of s and t that the file asks for; [`Wrap::File`] if it does not say.
    pub fn wraps(&self) -> (Wrap, Wrap) {
        self.wraps
    }

    /// How many images the file holds; this texture is one of them.
    pub fn n_parts(&self) -> usize {
        self.n_parts
    }

    /// The mean of a channel over all pixels; 0 for a channel that does not exist.
    pub fn average(&self, channel: usize) -> f32 {
        let n_pixels = self.finest.width * self.finest.height;
        if channel >= self.channels.len() || n_pixels == 0 {
            return 0.0;
        }
        let values = self.finest.samples.iter().skip(channel).step_by(self.channels.len());
        let sum: f64 = values.map(|&value| f64::from(value)).sum();
        (sum / n_pixels as f64) as f32
    }

    /// The bytes of all samples, of all levels whether made or not.
    pub(crate) fn bytes(&self) -> u64 {
        let Level { mut width, mut height, .. } = self.finest;
        let mut pixels = (width * height) as u64;
        while width > 1 || height > 1 {
            (width, height) = (half_size(width), half_size(height));
            pixels += (width * height) as u64;
        }
        pixels.saturating_mul((self.channels.len() * size_of::<f32>()) as u64)
    }

    pub(crate) fn finest(&self) -> &Level {
        &self.finest
    }

    /// The levels below the finest, each half as large as the one before, down to a single pixel.
    pub(crate) fn coarser(&self) -> &[Level] {
        self.coarser.get_or_init(|| {
            let mut levels: Vec<Level> = Vec::new();
            loop {
                let previous = levels.last().unwrap_or(&self.finest);
                if previous.width <= 1 && previous.height <= 1 {
                    return levels;
                }
                levels.push(halved(previous, self.channels.len(), self.stored));
            }
        })
    }
}

/// The next coarser level: each texel is the mean of the area that it covers, stored with the precision of the
/// file. The rounding is visible: an 8-bit texture has 8-bit mip-maps in the reference too (measured; other types are taken to be alike).
fn halved(level: &Level, n_channels: usize, stored: StoredType) -> Level {
    let columns = spans(level.width);
    let rows = spans(level.height);
    let mut samples = Vec::with_capacity(columns.len() * rows.len() * n_channels);
    for row in &rows {
        for column in &columns {
            for channel in 0..n_channels {
                let mut mean = 0.0;
                for &(y, weight_y) in row {
                    for &(x, weight_x) in column {
                        let sample = level.samples[(y * level.width + x) * n_channels + channel];
                        mean += weight_x * weight_y * in_stored_units(sample, stored);
                    }
                }
                samples.push(rounded_as_stored(mean, stored));
            }
        }
    }
    Level { width: columns.len(), height: rows.len(), samples }
}

/// The texels of an axis of `n` in the next coarser level.
fn half_size(n: usize) -> usize {
    (n / 2).max(1)
}

/// For each texel of the halved axis, the texels that it covers and their shares, which sum to 1.
fn spans(n: usize) -> Vec<Vec<(usize, f64)>> {
    let n_half = half_size(n);
    let covered = n as f64 / n_half as f64;
    (0..n_half)
        .map(|i| {
            let (begin, end) = (i as f64 * covered, (i + 1) as f64 * covered);
            let texels = begin as usize..(end.ceil() as usize).min(n);
            let share = |x: usize| (end.min((x + 1) as f64) - begin.max(x as f64)) / covered;
            texels.map(|x| (x, share(x))).collect()
        })
        .collect()
}

/// Integers are averaged as integers, so that ties are exact.
fn in_stored_units(sample: f32, stored: StoredType) -> f64 {
    match stored {
        StoredType::U8 => (f64::from(sample) * 255.0).round(),
        StoredType::U16 => (f64::from(sample) * 65535.0).round(),
        StoredType::U32 | StoredType::Half | StoredType::Float => f64::from(sample),
    }
}

fn rounded_as_stored(mean: f64, stored: StoredType) -> f32 {
    match stored {
        StoredType::U8 => (mean + 0.5).floor() as f32 * (1.0 / 255.0),
        StoredType::U16 => (mean + 0.5).floor() as f32 * (1.0 / 65535.0),
        StoredType::U32 => (mean + 0.5).floor() as f32,
        StoredType::Half => f16::from_f64(mean).to_f32(),
        StoredType::Float => mean as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(width: usize, height: usize, stored: StoredType, samples: Vec<f32>) -> Texture {
        let wraps = (Wrap::File, Wrap::File);
        Texture::new(ImageData {
            width,
            height,
            channels: vec!["Y".to_owned()],
            stored,
            wraps,
            n_parts: 1,
            samples,
        })
    }

    #[test]
    fn odd_sizes_are_averaged_by_area() {
        let texture = texture(5, 1, StoredType::Float, vec![1.0, 2.0, 3.0, 4.0, 5.0]);
        let sizes: Vec<_> = texture.coarser().iter().map(|l| (l.width, l.height)).collect();
        assert_eq!(sizes, [(2, 1), (1, 1)]);
        // Two and a half texels each: (1 + 2 + 3/2) / 2.5 and its mirror image.
        assert_eq!(texture.coarser()[0].samples, [1.8, 4.2]);
        assert_eq!(texture.coarser()[1].samples, [3.0]);
        assert_eq!(texture.average(0), 3.0);
        assert_eq!(texture.average(1), 0.0);
    }

    #[test]
    fn bytes_are_averaged_to_bytes_with_halves_up() {
        let of = |bytes: [u8; 4]| {
            let samples = bytes.iter().map(|&b| f32::from(b) / 255.0).collect();
            (texture(2, 2, StoredType::U8, samples).coarser()[0].samples[0] * 255.0).round()
        };
        assert_eq!(of([0, 0, 1, 1]), 1.0);
        assert_eq!(of([0, 0, 0, 1]), 0.0);
        assert_eq!(of([2, 2, 3, 3]), 3.0);
        assert_eq!(of([255, 255, 255, 255]), 255.0);
    }

    #[test]
    fn bytes_are_those_of_all_levels() {
        for (width, height) in [(5, 1), (1, 1), (7, 12), (16, 16)] {
            let texture = texture(width, height, StoredType::Float, vec![0.0; width * height]);
            let levels = std::iter::once(texture.finest()).chain(texture.coarser());
            assert_eq!(texture.bytes(), levels.map(|level| level.samples.len() as u64 * 4).sum::<u64>());
        }
    }

    #[test]
    fn a_misfit_has_no_pixels() {
        let texture = texture(5, 1, StoredType::Float, vec![1.0]);
        assert_eq!((texture.width(), texture.coarser().len(), texture.bytes()), (0, 0, 0));
        assert_eq!(texture.average(0), 0.0);
    }
}
