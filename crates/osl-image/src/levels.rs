//! Computes the coarser levels of a texture whose file has none: each has half the size of the previous one.

use crate::image::StoredType;
use crate::level::Level;
use crate::texels::Texels;
use osl_limits::Limits;

/// The size of an axis in the next coarser level.
pub(crate) fn half_size(n: usize) -> usize {
    (n / 2).max(1)
}

/// The levels below the finest, down to a single texel. If the command has to stop, some are missing: the run
/// fails anyway.
pub(crate) fn made(finest: &Level, n_channels: usize, stored: StoredType, limits: &Limits) -> Vec<Level> {
    let mut levels: Vec<Level> = Vec::new();
    loop {
        let previous = levels.last().unwrap_or(finest);
        let (width, height) = previous.full;
        if width <= 1 && height <= 1 {
            return levels;
        }
        let Some(level) = halved(previous, n_channels, stored, limits) else { return levels };
        levels.push(level);
    }
}

/// The next coarser level. Each texel is the bilinear sample of the finer level at the texel's center, with
/// the border repeated, and is stored with the precision of the file. For odd sizes not all texels
/// contribute. The rounding is visible: 8-bit textures have 8-bit levels in the reference too (measured).
fn halved(level: &Level, n_channels: usize, stored: StoredType, limits: &Limits) -> Option<Level> {
    let (width, height) = (half_size(level.full.0), half_size(level.full.1));
    let columns = pairs(level.full.0, width);
    let rows = pairs(level.full.1, height);
    let mut texels = Texels::with_capacity(&level.texels, width * height * n_channels);
    let texel = |x: usize, y: usize, channel: usize| {
        level.texel(x, y).map_or(0.0, |start| level.texels.in_stored_units(start + channel, stored))
    };
    for row in &rows {
        if limits.halted().is_some() {
            return None;
        }
        for column in &columns {
            for channel in 0..n_channels {
                let across = |y| {
                    (1.0 - column.share) * texel(column.texels.0, y, channel)
                        + column.share * texel(column.texels.1, y, channel)
                };
                let mean = (1.0 - row.share) * across(row.texels.0) + row.share * across(row.texels.1);
                texels.push_rounded(mean, stored);
            }
        }
    }
    Some(Level::new(width, height, n_channels, texels))
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

/// The sizes of the levels below the finest, down to a single texel.
pub(crate) fn sizes_below(full: (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
    std::iter::successors(Some(full), |(width, height)| {
        (*width > 1 || *height > 1).then(|| (half_size(*width), half_size(*height)))
    })
    .skip(1)
}

/// The number of values in all levels below the finest. If a file stores only a corner of an image, the
/// levels may be far larger than the stored part.
pub(crate) fn samples_below(full: (usize, usize), n_channels: usize) -> u64 {
    let samples = |(width, height): (usize, usize)| {
        (width as u64).saturating_mul(height as u64).saturating_mul(n_channels as u64)
    };
    sizes_below(full).map(samples).fold(0, u64::saturating_add)
}
