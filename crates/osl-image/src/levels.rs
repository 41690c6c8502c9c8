//! The coarser levels of a texture whose file has none: each is half of the one before.
//!
//! It must not know files or lookups.

use half::f16;

use crate::read::StoredType;
use crate::texture::Level;

/// The texels of an axis of `n` in the next coarser level.
pub(crate) fn half_size(n: usize) -> usize {
    (n / 2).max(1)
}

/// The levels below the finest, down to a single texel.
pub(crate) fn made(finest: &Level, n_channels: usize, stored: StoredType) -> Vec<Level> {
    let mut levels: Vec<Level> = Vec::new();
    loop {
        let previous = levels.last().unwrap_or(finest);
        let (width, height) = previous.full;
        if width <= 1 && height <= 1 {
            return levels;
        }
        levels.push(halved(previous, n_channels, stored));
    }
}

/// The next coarser level: each texel is the bilinear sample of the finer level at the texel's center, with the
/// border repeated, and is stored with the precision of the file. Of an odd size not all texels count. The rounding
/// is visible: an 8-bit texture has 8-bit levels in the reference too (measured).
fn halved(level: &Level, n_channels: usize, stored: StoredType) -> Level {
    let (width, height) = (half_size(level.full.0), half_size(level.full.1));
    let columns = pairs(level.full.0, width);
    let rows = pairs(level.full.1, height);
    let mut samples = Vec::with_capacity(width * height * n_channels);
    let texel = |x: usize, y: usize, channel: usize| {
        in_stored_units(level.texel(x, y).and_then(|t| t.get(channel)).copied().unwrap_or(0.0), stored)
    };
    for row in &rows {
        for column in &columns {
            for channel in 0..n_channels {
                let across = |y| {
                    (1.0 - column.share) * texel(column.texels.0, y, channel)
                        + column.share * texel(column.texels.1, y, channel)
                };
                let mean = (1.0 - row.share) * across(row.texels.0) + row.share * across(row.texels.1);
                samples.push(rounded_as_stored(mean, stored));
            }
        }
    }
    Level::new(width, height, n_channels, samples)
}

/// Two neighbouring texels of an axis, and the share of the second.
struct Pair {
    texels: (usize, usize),
    share: f64,
}

/// For each texel of the halved axis, the texels on both sides of its center.
fn pairs(n: usize, n_half: usize) -> Vec<Pair> {
    (0..n_half)
        .map(|i| {
            let place = (i as f64 + 0.5) * n as f64 / n_half as f64 - 0.5;
            let below = place.floor();
            let first = below.max(0.0) as usize;
            Pair { texels: (first, (below as i64 + 1).clamp(0, n as i64 - 1) as usize), share: place - below }
        })
        .collect()
}

/// Integers are averaged as integers, so that ties are exact.
fn in_stored_units(sample: f32, stored: StoredType) -> f64 {
    match stored {
        StoredType::U8 => (f64::from(sample) * 255.0).round(),
        StoredType::U16 => (f64::from(sample) * 65535.0).round(),
        StoredType::I8 => (f64::from(sample) * 127.0).round(),
        StoredType::I16 => (f64::from(sample) * 32767.0).round(),
        StoredType::U32 | StoredType::I32 | StoredType::Half | StoredType::Float => f64::from(sample),
    }
}

fn rounded_as_stored(mean: f64, stored: StoredType) -> f32 {
    match stored {
        StoredType::U8 => (mean + 0.5).floor() as f32 * (1.0 / 255.0),
        StoredType::U16 => (mean + 0.5).floor() as f32 * (1.0 / 65535.0),
        StoredType::U32 => (mean + 0.5).floor() as f32,
        StoredType::Half => f16::from_f64(mean).to_f32(),
        StoredType::I8 => mean.round() as f32 * (1.0 / 127.0),
        StoredType::I16 => mean.round() as f32 * (1.0 / 32767.0),
        // A float holds fewer digits than these integers have.
        StoredType::I32 | StoredType::Float => mean as f32,
    }
}
