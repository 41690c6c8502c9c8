//! `texture()` for one point: maps the footprint to levels and probes, and probes to a value.

use crate::filter::{Interp, Sample, Source, sample};
use crate::footprint::{Ellipse, Footprint, LevelBlend};
use crate::level::Level;
use crate::texture::Texture;
use crate::wrap::Wrap;

/// The options of a lookup. The default is that of `texture(name, s, t)` in OSL.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookupOptions {
    /// The wrap to the left and right of the image.
    pub wrap_s: Wrap,
    /// The wrap above and below the image.
    pub wrap_t: Wrap,
    /// How texels are interpolated.
    pub interp: Interp,
    /// The channel that becomes the first of the result.
    pub first_channel: usize,
    /// The value of channels that the file does not have (zero where the wrap is black).
    pub fill: f32,
    /// Factors for the footprint in s and t; 0 reads the finest level without any filtering.
    pub width: (f32, f32),
    /// The amount added to the footprint in s and t, in texture widths.
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
/// **Shape**: `n_channels` (up to 4) channels from `first_channel` on; to read alpha, request one channel
/// more than the color has. The result's partials are with respect to s and t; the caller applies the chain
/// rule.
///
/// **Units**: (0, 0) is the corner of the first pixel of the first scanline, (1, 1) the opposite corner.
///
/// Infinite or NaN coordinates give zero everywhere.
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

/// Looks up one point: the channels of [`lookup`], with the same bits, but without computing the partials.
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

/// The data shared by all samples of a lookup.
pub(crate) struct Lookup<'a, const DERIVS: bool> {
    pub(crate) texture: &'a Texture,
    pub(crate) n_channels: usize,
    pub(crate) options: &'a LookupOptions,
}

impl<const DERIVS: bool> Lookup<'_, DERIVS> {
    /// All probes over the footprint.
    fn filtered(&self, s: f32, t: f32, footprint: &Footprint) -> Sample {
        if !(s.is_finite() && t.is_finite()) || self.texture.width() == 0 {
            return Sample::default();
        }
        let LookupOptions { width, blur, .. } = *self.options;
        if let Some(color) = self.texture.constant_color()
            && !is_black_outside(self.texture, self.options)
        {
            return self.alike(color);
        }
        let unfiltered = width == (0.0, 0.0) || *footprint == Footprint::default();
        if unfiltered && blur == (0.0, 0.0) {
            return self.level(0, (0, 0)).sample::<DERIVS>(s, t);
        }
        let ellipse = Ellipse::new(footprint, width, blur);
        let (blend, ellipse) = levels_for(self.texture, ellipse);
        // Nothing depends on it in the finest level.
        let natural = if blend == LevelBlend::FINEST { (0, 0) } else { footprint.natural_size() };
        let levels = (self.level(blend.finer, natural), self.level(blend.coarser, natural));
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

    /// The result of a lookup in a texture whose texels all have this color.
    fn alike(&self, color: &[f32; 4]) -> Sample {
        let n_stored = self.texture.channels().len();
        let channel = |i: usize| {
            let stored = self.options.first_channel.saturating_add(i);
            if stored < n_stored { color.get(stored).copied().unwrap_or(0.0) } else { self.options.fill }
        };
        let value = std::array::from_fn(|i| if i < self.n_channels { channel(i) } else { 0.0 });
        Sample { value, ..Sample::default() }
    }

    /// A level for a probe by direction; only the number of rows decides on the interpolation.
    pub(crate) fn directional(&self, index: usize, natural_rows: usize) -> LevelSource<'_> {
        self.level(index, (0, natural_rows))
    }

    /// A level for a probe. `natural` is the image size at which one texel covers one pixel.
    fn level(&self, index: usize, natural: (usize, usize)) -> LevelSource<'_> {
        let options = self.options;
        let n_stored = self.texture.channels().len();
        let n_wanted = self.n_channels.min(4);
        let first = options.first_channel.min(n_stored);
        let (wrap_s, wrap_t) = wraps(self.texture, options);
        let level = level_at(self.texture, index);
        let source = Source {
            level,
            n_stored,
            first,
            n_read: n_wanted.min(n_stored - first),
            n_wanted,
            fill: options.fill,
            wrap_s,
            wrap_t,
        };
        // Texels are visible in the finest level, and in coarser levels that wide or blurred lookups read.
        let magnified = index == 0 || level.width < natural.0 / 2 || level.height < natural.1 / 2;
        let interp = match options.interp {
            Interp::SmartCubic if magnified => Interp::Cubic,
            Interp::SmartCubic => Interp::Linear,
            other => other,
        };
        LevelSource { source, interp }
    }
}

/// The wraps of s and t.
fn wraps(texture: &Texture, options: &LookupOptions) -> (Wrap, Wrap) {
    let of_file = texture.wraps();
    (options.wrap_s.or_file(of_file.0), options.wrap_t.or_file(of_file.1))
}

/// Whether the texture is black outside the unit square, at least on two sides.
pub(crate) fn is_black_outside(texture: &Texture, options: &LookupOptions) -> bool {
    let black = |wrap| matches!(wrap, Wrap::Black | Wrap::File);
    let (s, t) = wraps(texture, options);
    black(s) || black(t)
}

/// One level with the settings shared by all probes of a lookup.
pub(crate) struct LevelSource<'a> {
    pub(crate) source: Source<'a>,
    pub(crate) interp: Interp,
}

impl LevelSource<'_> {
    pub(crate) fn sample<const DERIVS: bool>(&self, s: f32, t: f32) -> Sample {
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

/// Chooses levels, without computing the coarser ones if the finest is enough, and the ellipse to read them
/// with. The shorter side of an oblong texture counts.
fn levels_for(texture: &Texture, ellipse: Ellipse) -> (LevelBlend, Ellipse) {
    let shorter_side = |level: &Level| level.full.0.min(level.full.1);
    let finest = texture.finest();
    let width = ellipse.probe_width();
    if width * shorter_side(finest) as f64 <= 1.0 {
        return (LevelBlend::FINEST, ellipse.magnified(finest.full.0.max(finest.full.1)));
    }
    let coarser = texture.coarser().iter().map(shorter_side);
    (LevelBlend::for_width(width, std::iter::once(shorter_side(finest)).chain(coarser)), ellipse)
}

fn level_at(texture: &Texture, index: usize) -> &Level {
    match index.checked_sub(1) {
        None => texture.finest(),
        Some(coarser) => texture.coarser().get(coarser).unwrap_or(texture.finest()),
    }
}
