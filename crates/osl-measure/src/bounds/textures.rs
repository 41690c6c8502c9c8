//! Bounds of texture lookups: the smallest and the largest texel of each channel, with what lookups give
//! outside of the image, in channels that the file does not have, and in place of a missing file.

use osl_exec::Services;
use osl_image::{LookupOptions, OwnedSubImage, Reach, Texture, TextureCache, Wrap};
use osl_ir::ir::{Kernel, Kind, TextureOption};
use osl_numeric::interval::{Enclosure, Interval};

/// The maximum number of unit squares of a tiled name whose files are read.
const SQUARES: usize = 100;
/// The files of a tiled name are in this many columns; the rows are unlimited.
const COLUMNS: f32 = 10.0;
/// Larger factors for the footprint, and larger blurs, are not bounded.
const WIDEST: f32 = 1e6;

/// The options of a lookup, for all points of a tile.
#[derive(Default)]
struct Options {
    /// Wraps and first channel. A wrap that is not known counts as black, which only adds 0.
    lookup: LookupOptions,
    /// The number of the image in the file, or its name.
    part: OwnedSubImage,
    /// The value of channels that the file does not have.
    fill: Option<Interval>,
    /// The channels in place of a missing file.
    missing: Option<[Option<Interval>; 4]>,
}

/// The results of a lookup in files with known names; `None` for other calls, and for options that are not
/// known.
pub(super) fn lookup(
    services: &Services,
    kernel: &Kernel,
    given: &[Enclosure],
    kinds: &[Kind],
) -> Option<Vec<Enclosure>> {
    let (options, before) = match kernel {
        Kernel::Texture { options, .. } => (options, 3),
        Kernel::Environment { options, .. } => (options, 2),
        Kernel::Volume { options, .. } => (options, 1),
        _ => return None,
    };
    let Some(Enclosure::Str(Some(name))) = given.first() else { return None };
    let channels = kinds.first()?.words() as usize;
    let options = Options::of(options, given.get(before..)?, channels)?;
    let place: Vec<Interval> =
        given.get(1..before)?.iter().flat_map(|arg| arg.numbers().iter().copied()).collect();
    let mut found = LookupRange::default();
    let is_finite = place.iter().all(|x| !x.may_be_nan() && !x.has_infinity());
    match kernel {
        Kernel::Volume { .. } => found.fails = true,
        Kernel::Texture { .. } if TextureCache::is_tiled(name) => {
            for (s, t) in squares(place.first()?, place.get(1)?)? {
                found.add(services, name, (s, t), &options, (channels, false));
            }
        }
        Kernel::Texture { .. } => found.add(services, name, (0.0, 0.0), &options, (channels, false)),
        _ => found.add(services, name, (0.0, 0.0), &options, (channels, true)),
    }
    if found.succeeds && !is_finite {
        // Without coordinates, a lookup gives 0.
        found.channels = found.channels.map(|channel| channel.hull(zero()));
    }
    if found.fails {
        let instead = options.instead();
        found.channels = std::array::from_fn(|i| found.channels[i].hull(instead[i]));
    }
    let [r, g, b, a] = found.channels;
    let result = |(at, kind): (usize, &Kind)| match (at, kind) {
        (0, Kind::Triple) => Enclosure::Triple([r, g, b]),
        (0, Kind::Float) => Enclosure::Float(r),
        (1, Kind::Float) => Enclosure::Float(if channels == 1 { g } else { a }),
        (2, Kind::Str) if !found.fails => Enclosure::Str(Some("".into())),
        _ => Enclosure::any(*kind),
    };
    Some(kinds.iter().enumerate().map(result).collect())
}

/// The number 0, with either sign.
fn zero() -> Interval {
    Interval::new(-0.0, 0.0)
}

/// The corners of the unit squares in which coordinates may be: of a point beyond the last column, the first
/// such square, since none of them has a file.
fn squares(s: &Interval, t: &Interval) -> Option<Vec<(f32, f32)>> {
    let ends = |x: &Interval, most: f32| {
        let lo = if x.may_be_nan() { 0.0 } else { x.lo() };
        (!x.is_empty()).then(|| [lo.floor().clamp(0.0, most), x.hi().floor().clamp(0.0, most)])
    };
    let ([left, right], [top, bottom]) = (ends(s, COLUMNS)?, ends(t, f32::MAX)?);
    let (columns, rows) = (right - left + 1.0, bottom - top + 1.0);
    if columns * rows > SQUARES as f32 {
        return None;
    }
    let row = |y: usize| (0..columns as usize).map(move |x| (left + x as f32, top + y as f32));
    Some((0..rows as usize).flat_map(row).collect())
}

/// What lookups in some files give.
struct LookupRange {
    channels: [Interval; 4],
    /// Whether there is a file.
    succeeds: bool,
    /// Whether a file is missing.
    fails: bool,
}

impl Default for LookupRange {
    fn default() -> LookupRange {
        LookupRange { channels: [Interval::NONE; 4], succeeds: false, fails: false }
    }
}

impl LookupRange {
    /// Adds the values of the file with a name at a point.
    fn add(
        &mut self,
        services: &Services,
        name: &str,
        (s, t): (f32, f32),
        options: &Options,
        (channels, is_directional): (usize, bool),
    ) {
        let part = options.part.sub_image();
        let Ok(texture) = services.textures.tile(name, part, s, t).0 else {
            self.fails = true;
            return;
        };
        self.succeeds = true;
        let reach = options.reach(&texture, channels + 1, is_directional);
        self.channels = std::array::from_fn(|i| self.channels[i].hull(reach[i]));
    }
}

impl Options {
    /// The options of a lookup of some channels, in the order of the call; `None` if one of them that matters
    /// is not known.
    fn of(options: &[TextureOption], values: &[Enclosure], channels: usize) -> Option<Options> {
        let mut found = Options::default();
        for (option, value) in options.iter().zip(values) {
            let wrap = || match value {
                Enclosure::Str(Some(name)) => Wrap::from_name(name).unwrap_or(Wrap::File),
                _ => Wrap::Black,
            };
            let number = || value.numbers().first().copied();
            let whole = || match value {
                Enclosure::Int(n) => Some(usize::try_from(n.value()?).unwrap_or(0)),
                _ => None,
            };
            match option {
                TextureOption::Wrap => (found.lookup.wrap_s, found.lookup.wrap_t) = (wrap(), wrap()),
                TextureOption::SWrap => found.lookup.wrap_s = wrap(),
                TextureOption::TWrap => found.lookup.wrap_t = wrap(),
                // All filters average texels.
                TextureOption::Interp => {}
                TextureOption::FirstChannel => found.lookup.first_channel = whole()?,
                TextureOption::Fill => found.fill = Some(number()?),
                TextureOption::Width | TextureOption::SWidth | TextureOption::TWidth => {
                    number().filter(|x| x.is_within(-WIDEST, WIDEST))?;
                }
                TextureOption::Blur | TextureOption::SBlur | TextureOption::TBlur => {
                    number().filter(|x| x.is_within(0.0, WIDEST))?;
                }
                TextureOption::MissingColor => {
                    let [_, _, _, alpha] = found.missing.unwrap_or_default();
                    let [r, g, b] = value.numbers() else { return None };
                    found.missing = Some([Some(*r), Some(*g), Some(*b), alpha.or(Some(zero()))]);
                }
                TextureOption::MissingAlpha => {
                    let missing = found.missing.get_or_insert_default();
                    missing[if channels == 1 { 1 } else { 3 }] = Some(number()?);
                }
                TextureOption::SubImage => found.part = OwnedSubImage::Index(whole()?),
                TextureOption::SubImageName => match value {
                    Enclosure::Str(Some(name)) => found.part = OwnedSubImage::Name(name.clone()),
                    _ => return None,
                },
            }
        }
        Some(found)
    }

    /// The channels in place of a missing file.
    fn instead(&self) -> [Interval; 4] {
        let fill = self.fill.unwrap_or_else(|| Interval::point(0.0));
        self.missing.unwrap_or_default().map(|channel| channel.unwrap_or(fill))
    }

    /// The values of a texture at finite coordinates.
    fn reach(&self, texture: &Texture, channels: usize, is_directional: bool) -> [Interval; 4] {
        let of = |fill: f32| {
            let lookup = LookupOptions { fill, ..self.lookup };
            match is_directional {
                true => texture.directional_reach(channels, &lookup),
                false => texture.reach(channels, &lookup),
            }
        };
        let interval = |reach: Reach| reach.map_or(Interval::ANY, |[lo, hi]| Interval::new(lo, hi));
        // A missing channel grows with the value that fills it.
        let fill = self.fill.unwrap_or_else(|| Interval::point(0.0));
        let ends = match fill.may_be_nan() || fill.is_empty() {
            true => [f32::NAN; 2],
            false => [fill.lo(), fill.hi()],
        };
        let [low, high] = ends.map(of);
        std::array::from_fn(|i| interval(low[i]).hull(interval(high[i])))
    }
}
