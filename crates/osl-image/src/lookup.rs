//! `texture()` for one point: footprint to levels and probes, probes to a value.
//!
//! It must not know files, nor how a shader names its options.

use crate::filter::{Interp, Sample, Source, sample};
use crate::footprint::{Ellipse, Footprint, LevelBlend};
use crate::texture::{Level, Texture};
use crate::wrap::Wrap;

/// What a lookup does besides its coordinates. The default is what `texture(name, s, t)` does in OSL.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookupOptions {
    /// What lies left and right of the image.
    pub wrap_s: Wrap,
    /// What lies above and below the image.
    pub wrap_t: Wrap,
    /// How texels are joined.
    pub interp: Interp,
    /// The channel that becomes the first of the result.
    pub first_channel: usize,
    /// The value of channels that the file does not have (zero where the wrap is black).
    pub fill: f32,
    /// Factors for the footprint in s and t; 0 reads the finest level without any filtering.
    pub width: (f32, f32),
    /// What the footprint is grown by in s and t, in texture widths.
    pub blur: (f32, f32),
}

impl Default for LookupOptions {
    fn default() -> Self {
        Self {
            wrap_s: Wrap::File,
            wrap_t: Wrap::File,
            interp: Interp::SmartCubic,
            first_channel: 0,
            fill: 0.0,
            width: (1.0, 1.0),
            blur: (0.0, 0.0),
        }
    }
}

/// Looks up one point, with derivatives.
///
/// **Shape**: `n_channels` (up to 4) channels from `first_channel` on; to read alpha, ask for one channel more
/// than the color has. The result's partials are with respect to s and t; the caller applies the chain rule.
///
/// **Units**: (0, 0) is the corner of the first pixel of the first scanline, (1, 1) the opposite corner.
///
/// Coordinates that are infinite or nan give zero everywhere.
///
/// **Source**: OSL language specification, "Texture mapping"; level choice, blend and rounding as measured on
/// the reference, see the tests.
pub fn lookup(
    texture: &Texture,
    s: f32,
    t: f32,
    footprint: &Footprint,
    n_channels: usize,
    options: &LookupOptions,
) -> Sample {
    Lookup::<true> { texture, n_channels, options }.filtered(s, t, footprint)
}

/// Looks up one point: the channels of [`lookup`], bit for bit, without the work for the partials.
pub fn lookup_values(
    texture: &Texture,
    s: f32,
    t: f32,
    footprint: &Footprint,
    n_channels: usize,
    options: &LookupOptions,
) -> [f32; 4] {
    Lookup::<false> { texture, n_channels, options }.filtered(s, t, footprint).value
}

/// What is the same for all samples of a lookup.
struct Lookup<'a, const DERIVS: bool> {
    texture: &'a Texture,
    n_channels: usize,
    options: &'a LookupOptions,
}

impl<const DERIVS: bool> Lookup<'_, DERIVS> {
    /// All probes over the footprint.
    fn filtered(&self, s: f32, t: f32, footprint: &Footprint) -> Sample {
        if !(s.is_finite() && t.is_finite()) || self.texture.width() == 0 {
            return Sample::default();
        }
        let LookupOptions { width, blur, .. } = *self.options;
        let unfiltered = width == (0.0, 0.0) || *footprint == Footprint::default();
        if unfiltered && blur == (0.0, 0.0) {
            return self.level(0).sample::<DERIVS>(s, t);
        }
        let ellipse = Ellipse::new(footprint, width, blur);
        let blend = levels_for(self.texture, ellipse.probe_width());
        let levels = (self.level(blend.finer), self.level(blend.coarser));
        let blended = |s, t| blended::<DERIVS>(&levels, blend.share_of_coarser, s, t);
        let probes = ellipse.probes();
        if probes.is_single() {
            return blended(s, t);
        }
        let mut sum = Sample::default();
        for (ds, dt, weight) in probes.iter() {
            sum.add_scaled::<DERIVS>(weight, &blended(s + ds, t + dt));
        }
        sum
    }

    /// What a probe reads of one level.
    fn level(&self, index: usize) -> LevelSource<'_> {
        let options = self.options;
        let n_stored = self.texture.channels().len();
        let wraps = self.texture.wraps();
        let n_wanted = self.n_channels.min(4);
        let first = options.first_channel.min(n_stored);
        let source = Source {
            level: level_at(self.texture, index),
            n_stored,
            first,
            n_read: n_wanted.min(n_stored - first),
            n_wanted,
            fill: options.fill,
            wrap_s: options.wrap_s.or_file(wraps.0),
            wrap_t: options.wrap_t.or_file(wraps.1),
        };
        let interp = match options.interp {
            // Only the finest level can be magnified; between the others, neighbours are an octave apart.
            Interp::SmartCubic if index == 0 => Interp::Cubic,
            Interp::SmartCubic => Interp::Linear,
            other => other,
        };
        LevelSource { source, interp }
    }
}

/// One level as a probe reads it: the same for all probes of a lookup.
struct LevelSource<'a> {
    source: Source<'a>,
    interp: Interp,
}

impl LevelSource<'_> {
    fn sample<const DERIVS: bool>(&self, s: f32, t: f32) -> Sample {
        sample::<DERIVS>(&self.source, s, t, self.interp)
    }
}

/// One probe: the finer and the coarser level, blended.
fn blended<const DERIVS: bool>(
    (finer, coarser): &(LevelSource<'_>, LevelSource<'_>),
    share: f32,
    s: f32,
    t: f32,
) -> Sample {
    let finer = finer.sample::<DERIVS>(s, t);
    if share == 0.0 {
        return finer;
    }
    let mut sum = Sample::default();
    sum.add_scaled::<DERIVS>(1.0 - share, &finer);
    sum.add_scaled::<DERIVS>(share, &coarser.sample::<DERIVS>(s, t));
    sum
}

/// Chooses levels, without making the coarser ones where the finest will do. Of an oblong texture the shorter
/// side counts (chosen for sharpness; all textures with reference results are square).
fn levels_for(texture: &Texture, width: f64) -> LevelBlend {
    let shorter_side = |width: usize, height: usize| width.min(height);
    let finest = shorter_side(texture.width(), texture.height());
    if width * finest as f64 <= 1.0 {
        return LevelBlend::FINEST;
    }
    let coarser = texture.coarser().iter().map(|level| shorter_side(level.width, level.height));
    LevelBlend::for_width(width, std::iter::once(finest).chain(coarser))
}

fn level_at(texture: &Texture, index: usize) -> &Level {
    match index.checked_sub(1) {
        None => texture.finest(),
        Some(coarser) => texture.coarser().get(coarser).unwrap_or(texture.finest()),
    }
}
