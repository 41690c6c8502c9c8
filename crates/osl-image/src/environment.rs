//! `environment()` for one point: maps a direction and its derivatives to levels and probes, and probes to a
//! value.
//!
//! y is up, and the middle of the image looks along -z.

use std::f64::consts::{FRAC_1_PI, PI};

use crate::filter::{Interp, Sample};
use crate::footprint::{LevelBlend, bounded};
use crate::level::Level;
use crate::lookup::{LevelSource, Lookup, LookupOptions};
use crate::texture::Texture;
use crate::wrap::Wrap;

/// The smallest angle to a neighbour.
const SMALLEST: f64 = 1e-8;

type Direction = [f64; 3];

/// Looks up one direction with its derivatives `d_dx` and `d_dy`.
///
/// The angles to the neighbouring pixels, scaled by the width and increased by the blur, are the axes of the
/// footprint. The shorter axis selects the level, and probes are spread along the longer one. Near the poles,
/// where the image's rows shrink to a point, samples fade to the mean of the last row, on levels that the
/// file stores as one tile.
///
/// **Source**: measured on the reference, see the tests.
pub fn environment(
    texture: &Texture,
    direction: [f32; 3],
    d_dx: [f32; 3],
    d_dy: [f32; 3],
    n_channels: usize,
    options: &LookupOptions,
) -> [f32; 4] {
    let options = &LookupOptions { wrap_s: Wrap::Periodic, wrap_t: Wrap::Clamp, ..*options };
    let lookup = Lookup::<false> { texture, n_channels, options };
    let direction = direction.map(f64::from);
    if !direction.iter().all(|c| c.is_finite()) || texture.width() == 0 {
        return [0.0; 4];
    }
    let towards = |change: [f32; 3]| unit(std::array::from_fn(|i| direction[i] + f64::from(change[i])));
    let (center, to_x, to_y) = (unit(direction), towards(d_dx), towards(d_dy));
    let angle = |to: &Direction| {
        let cosine: f64 = center.iter().zip(to).map(|(a, b)| a * b).sum();
        // For NaN or infinite angles the footprint is the whole image.
        if cosine.is_finite() { libm::acos(cosine.clamp(-1.0, 1.0)).max(SMALLEST) } else { PI }
    };
    let (angle_x, angle_y) = (angle(&to_x), angle(&to_y));
    let x = angle_x * f64::from(options.width.0) + f64::from(options.blur.0);
    let y = angle_y * f64::from(options.width.1) + f64::from(options.blur.1);
    let (major, minor, along) = if x >= y { (x, y, to_x) } else { (y, x, to_y) };
    let (_, minor, aspect) = bounded(major, minor);
    let blend = blend_for(texture, minor / PI);
    let natural = (PI / angle_x.min(angle_y)) as usize;
    let probe = Probe {
        finer: lookup.directional(blend.finer, natural),
        coarser: lookup.directional(blend.coarser, natural),
        share: blend.share_of_coarser,
    };
    let count = ((aspect - 0.25).ceil() as usize).max(1);
    if count == 1 {
        return probe.at(center).value;
    }
    let mut sum = Sample::default();
    for i in 0..count {
        let place = (i as f64 + 0.5) / count as f64 - 0.5;
        let towards = std::array::from_fn(|k| center[k] + place * along[k]);
        sum.add_scaled::<false>(1.0 / count as f32, &probe.at(towards));
    }
    sum.value
}

/// Normalises a direction; zero and non-finite directions stay unchanged.
fn unit(v: Direction) -> Direction {
    let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length > 0.0 && length.is_finite() { v.map(|c| c / length) } else { v }
}

/// The levels between which a texel is as high as `width`, in units of the image height.
fn blend_for(texture: &Texture, width: f64) -> LevelBlend {
    let rows = |level: &Level| level.full.1;
    let finest = texture.finest();
    if width * rows(finest) as f64 <= 1.0 {
        return LevelBlend::FINEST;
    }
    let coarser = texture.coarser().iter().map(rows);
    LevelBlend::for_width(width, std::iter::once(rows(finest)).chain(coarser))
}

/// Two levels, blended.
struct Probe<'a> {
    finer: LevelSource<'a>,
    coarser: LevelSource<'a>,
    share: f32,
}

impl Probe<'_> {
    fn at(&self, [x, y, z]: Direction) -> Sample {
        // Angles are rounded as in the reference: next to a pole, the rounding decides whether a sample
        // fades.
        let s = libm::atan2(-x, z) as f32 * (0.5 * FRAC_1_PI) as f32 + 0.5;
        let t = 0.5 - libm::atan2(y, libm::hypot(x, z)) as f32 * FRAC_1_PI as f32;
        let finer = faded(&self.finer, s, t);
        if self.share == 0.0 {
            return finer;
        }
        let mut sum = Sample::default();
        sum.add_scaled::<false>(1.0 - self.share, &finer);
        sum.add_scaled::<false>(self.share, &faded(&self.coarser, s, t));
        sum
    }
}

/// A sample of one level, faded to the mean of its first or last row near a pole.
fn faded(level: &LevelSource<'_>, s: f32, t: f32) -> Sample {
    let mut sample = level.sample::<false>(s, t);
    let source = &level.source;
    let row = t * source.level.height as f32;
    let near = if row < 1.0 {
        Some((1.0 - row, 0))
    } else if row > source.level.height as f32 - 1.0 {
        Some((row - row.floor(), 1))
    } else {
        None
    };
    if let Some((nearness, pole)) = near.filter(|_| source.level.one_tile && level.interp != Interp::Closest)
    {
        let share = nearness * nearness;
        let mean = source.level.poles()[pole].iter().skip(source.first);
        for (value, mean) in sample.value.iter_mut().take(source.n_read).zip(mean) {
            *value += share * (mean - *value);
        }
    }
    sample
}
