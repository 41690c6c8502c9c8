//! The texture area that one point covers: from screen derivatives to level, blend and probes.
//!
//! A point covers an ellipse whose axes are the singular values of the Jacobian of (s, t) (Heckbert,
//! "Fundamentals of Texture Mapping and Image Warping", 1989). The shorter axis selects the level; several
//! probes are taken along the longer one (McCormack, Perry, Farkas and Jouppi, "Feline", 1999). Level choice,
//! blur, weights and limits are the reference's, as measured.

/// How (s, t) changes from this point to its neighbours on the screen, in texture widths per pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Change of s to the right-hand neighbour.
    pub ds_dx: f32,
    /// Change of t to the right-hand neighbour.
    pub dt_dx: f32,
    /// Change of s to the neighbour in the next row.
    pub ds_dy: f32,
    /// Change of t to the neighbour in the next row.
    pub dt_dy: f32,
}

impl Footprint {
    /// The image size at which one texel covers one pixel, as whole numbers.
    pub(crate) fn natural_size(&self) -> (usize, usize) {
        // The cast gives 0 for NaN.
        let texels = |x: f32, y: f32| (1.0 / x.abs().max(y.abs()).max(SHORTEST as f32)) as usize;
        (texels(self.ds_dx, self.ds_dy), texels(self.dt_dx, self.dt_dy))
    }
}

/// The largest ratio of the longer to the shorter axis that is filtered exactly. A longer ellipse is
/// shortened and widened, so that the number of probes stays bounded.
const MAX_ASPECT: f64 = 32.0;

/// An upper bound on the number of probes.
const MAX_PROBES: usize = 64;

/// How fast the weights of probes fall off: alpha in the paper.
const FALLOFF: f64 = 2.0;

/// A shorter change of (s, t) counts as this long.
const SHORTEST: f64 = 1e-8;

/// The longest axis, in texture widths.
const LONGEST: f64 = 1000.0;

/// An ellipse in texture space. Lengths are in texture widths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ellipse {
    major: f64,
    minor: f64,
    /// Longer axis over shorter, as far as probes cover it.
    aspect: f64,
    /// The unit direction of the major axis.
    axis: (f64, f64),
}

impl Ellipse {
    /// The ellipse of a footprint whose s and t parts are scaled by `width`; it is then enlarged by `blur`.
    pub(crate) fn new(footprint: &Footprint, width: (f32, f32), blur: (f32, f32)) -> Self {
        let (width_s, width_t) = (f64::from(width.0), f64::from(width.1));
        let x = (f64::from(footprint.ds_dx) * width_s, f64::from(footprint.dt_dx) * width_t);
        let y = (f64::from(footprint.ds_dy) * width_s, f64::from(footprint.dt_dy) * width_t);
        let ((sx, tx), (sy, ty)) = never_degenerate(x, y);
        let (ss, st, tt) = (sx * sx + sy * sy, sx * tx + sy * ty, tx * tx + ty * ty);
        let half_difference = 0.5 * (ss - tt);
        let largest = 0.5 * (ss + tt) + (half_difference * half_difference + st * st).sqrt();
        let major = largest.sqrt();
        // The determinant keeps its digits where the difference of eigenvalues would lose them.
        let minor = if major > 0.0 { ((sx * ty - sy * tx) / major).abs().min(major) } else { 0.0 };
        let axis = if ss >= tt { (largest - tt, st) } else { (st, largest - ss) };
        // With NaN derivatives, the footprint is the whole texture.
        let (major, minor) =
            if major.is_finite() { (major.min(LONGEST), minor.min(LONGEST)) } else { (LONGEST, LONGEST) };
        let ellipse = Self { major, minor, aspect: 1.0, axis: unit(axis) };
        ellipse.blurred(f64::from(blur.0), f64::from(blur.1)).bounded()
    }

    /// Enlarges each axis by the component of the blur along it.
    fn blurred(self, blur_s: f64, blur_t: f64) -> Self {
        let (along_s, along_t) = (self.axis.0.abs(), self.axis.1.abs());
        let major = self.major + blur_s * along_s + blur_t * along_t;
        let minor = self.minor + blur_s * along_t + blur_t * along_s;
        if minor > major {
            Self { major: minor, minor: major, axis: (-self.axis.1, self.axis.0), ..self }
        } else {
            Self { major, minor, ..self }
        }
    }

    /// The ellipse with the axes of [`bounded`].
    fn bounded(self) -> Self {
        let (major, minor, aspect) = bounded(self.major, self.minor);
        Self { major, minor, aspect, ..self }
    }

    /// The width of each probe: the shorter axis.
    pub(crate) fn probe_width(&self) -> f64 {
        self.minor
    }

    /// In an image with `texels` along its longer side, an ellipse narrower than half a texel takes no more
    /// probes than one of that width, since closer probes would read the same texels.
    pub(crate) fn magnified(self, texels: usize) -> Self {
        let texels = texels as f64;
        if self.minor * texels < 0.5 {
            Self { aspect: (2.0 * self.major * texels).clamp(1.0, MAX_ASPECT), ..self }
        } else {
            self
        }
    }

    /// The offsets (in s and t) and weights of the probes. The weights sum to 1.
    pub(crate) fn probes(&self) -> Probes {
        let Self { major, minor, aspect, axis } = *self;
        let count = ((2.0 * aspect - 1.0) as usize).clamp(1, MAX_PROBES);
        let length = if count > 1 { 2.0 * (major - minor) } else { 0.0 };
        Probes { count, length, major, axis }
    }
}

/// Longer axis, shorter axis and their ratio. If the ratio is too large, the longer axis is cut to the mean
/// of its length and the maximum for the shorter one, and the shorter one is widened to match.
pub(crate) fn bounded(major: f64, minor: f64) -> (f64, f64, f64) {
    let aspect = major / minor;
    if aspect.is_nan() || aspect <= MAX_ASPECT {
        return (major, minor, aspect.max(1.0));
    }
    let major = 0.5 * (major + MAX_ASPECT * minor);
    (major, major / MAX_ASPECT, MAX_ASPECT)
}

/// Replaces negligible changes of (s, t) by the shortest one that counts, at a right angle to the other.
fn never_degenerate(x: (f64, f64), y: (f64, f64)) -> ((f64, f64), (f64, f64)) {
    let squared = |v: (f64, f64)| v.0 * v.0 + v.1 * v.1;
    let tiny = |v| squared(v) < SHORTEST * SHORTEST;
    // A quarter turn to the left.
    let across = |v: (f64, f64)| {
        let scale = SHORTEST / squared(v).sqrt();
        (-v.1 * scale, v.0 * scale)
    };
    match (tiny(x), tiny(y)) {
        (true, true) => ((SHORTEST, 0.0), (0.0, SHORTEST)),
        (true, false) => (across((-y.0, -y.1)), y),
        (false, true) => (x, across(x)),
        (false, false) => (x, y),
    }
}

/// The probes along the major axis of an ellipse.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Probes {
    count: usize,
    /// The distance over which the probes are spread.
    length: f64,
    /// The distance from the center over which weights fall off.
    major: f64,
    axis: (f64, f64),
}

impl Probes {
    /// Whether there is only one probe, in the center.
    pub(crate) fn is_single(&self) -> bool {
        self.count == 1
    }

    /// Offsets in s and t, and weight, of each probe.
    pub(crate) fn iter(self) -> impl Iterator<Item = (f32, f32, f32)> {
        let mut weights = [1.0; MAX_PROBES];
        let mut norm = 1.0;
        if self.count > 1 {
            let used = &mut weights[..self.count];
            used.iter_mut().enumerate().for_each(|(i, weight)| *weight = self.weight(i));
            norm = used.iter().sum::<f64>().recip();
        }
        weights.into_iter().take(self.count).enumerate().map(move |(i, weight)| {
            let distance = self.length * self.place(i);
            ((distance * self.axis.0) as f32, (distance * self.axis.1) as f32, (weight * norm) as f32)
        })
    }

    /// The position of probe `i` along the length, from -1/2 to 1/2.
    fn place(&self, i: usize) -> f64 {
        (i as f64 + 0.5) / self.count as f64 - 0.5
    }

    fn weight(&self, i: usize) -> f64 {
        let relative = 2.0 * self.place(i) * self.major / self.length;
        gaussian(FALLOFF * relative * relative)
    }
}

/// exp(-x) for x in 0..=2, by its Taylor series about 0 of -x/16, squared four times. Its error is below
/// 1e-12, and unlike the system's `exp` it gives the same bits on every machine.
fn gaussian(x: f64) -> f64 {
    /// 1/n for n from 9 down to 1: nine divisions in sequence would take most of the time.
    const RECIPROCALS: [f64; 9] =
        [1.0 / 9.0, 1.0 / 8.0, 1.0 / 7.0, 1.0 / 6.0, 1.0 / 5.0, 1.0 / 4.0, 1.0 / 3.0, 1.0 / 2.0, 1.0];
    let y = -x / 16.0;
    let series = RECIPROCALS.into_iter().fold(1.0, |sum, reciprocal| 1.0 + sum * (y * reciprocal));
    let (second, fourth) = (series * series, series * series * series * series);
    second * second * fourth * fourth * fourth
}

fn unit(v: (f64, f64)) -> (f64, f64) {
    let length = (v.0 * v.0 + v.1 * v.1).sqrt();
    if length > 0.0 && length.is_finite() { (v.0 / length, v.1 / length) } else { (1.0, 0.0) }
}

/// Two neighbouring levels, and the share of the coarser one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LevelBlend {
    /// 0 is the finest.
    pub(crate) finer: usize,
    pub(crate) coarser: usize,
    pub(crate) share_of_coarser: f32,
}

impl LevelBlend {
    /// The finest level alone.
    pub(crate) const FINEST: Self = Self { finer: 0, coarser: 0, share_of_coarser: 0.0 };

    /// The levels between which a probe is as wide as a texel. `sizes` are the shorter sides of the levels in
    /// texels, finest first. The blend is linear in the width, not in its logarithm (measured).
    pub(crate) fn for_width(width: f64, sizes: impl Iterator<Item = usize>) -> Self {
        let mut last = 0;
        for (level, size) in sizes.enumerate() {
            let in_texels = width * size as f64;
            if in_texels <= 1.0 {
                let Some(finer) = level.checked_sub(1) else { return Self::FINEST };
                let share = (2.0 * in_texels - 1.0).clamp(0.0, 1.0);
                return Self { finer, coarser: level, share_of_coarser: share as f32 };
            }
            last = level;
        }
        Self { finer: last, coarser: last, share_of_coarser: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ellipse(steps: [f32; 4]) -> Ellipse {
        let [ds_dx, dt_dx, ds_dy, dt_dy] = steps;
        Ellipse::new(&Footprint { ds_dx, dt_dx, ds_dy, dt_dy }, (1.0, 1.0), (0.0, 0.0))
    }

    #[test]
    fn axes_are_those_of_the_jacobian() {
        let straight = ellipse([0.5, 0.0, 0.0, 0.125]);
        assert_eq!((straight.major, straight.minor, straight.axis), (0.5, 0.125, (1.0, 0.0)));
        let upright = ellipse([0.125, 0.0, 0.0, 0.5]);
        assert_eq!((upright.major, upright.minor, upright.axis), (0.5, 0.125, (0.0, 1.0)));
        // Rotated by 45 degrees, twice as long as wide.
        let turned = ellipse([0.5, 0.5, -0.25, 0.25]);
        let root = 0.5_f64.sqrt();
        assert!((turned.major - root).abs() < 1e-12 && (turned.minor - 0.5 * root).abs() < 1e-12);
        assert!((turned.axis.0 - root).abs() < 1e-12 && (turned.axis.1 - root).abs() < 1e-12);
    }

    #[test]
    fn round_footprints_take_one_probe_in_the_center() {
        for steps in [[0.0; 4], [1.0 / 63.0, 0.0, 0.0, 1.0 / 63.0], [0.3, 0.4, -0.4, 0.3]] {
            let probes: Vec<_> = ellipse(steps).probes().iter().collect();
            assert_eq!(probes, [(0.0, 0.0, 1.0)]);
        }
    }

    #[test]
    fn long_footprints_take_a_bounded_number_of_balanced_probes() {
        for (length, count) in [(1.5_f32, 2), (3.0, 5), (31.0, 61), (1000.0, 63), (1e30, 63)] {
            let probes: Vec<_> = ellipse([length, 0.0, 0.0, 1.0]).probes().iter().collect();
            assert_eq!(probes.len(), count);
            assert!((probes.iter().map(|p| p.2).sum::<f32>() - 1.0).abs() < 1e-5);
            let center: f32 = probes.iter().map(|p| p.0 * p.2).sum();
            assert!(center.abs() <= length * 1e-5);
        }
        let flat: Vec<_> = ellipse([1.0, 0.0, 0.0, 0.0]).probes().iter().collect();
        assert_eq!(flat.len(), 63);
    }

    #[test]
    fn blur_falls_on_the_axes() {
        let footprint = Footprint { ds_dx: 0.25, dt_dy: 0.25, ..Footprint::default() };
        let along_t = Ellipse::new(&footprint, (1.0, 1.0), (0.0, 0.5));
        assert_eq!((along_t.major, along_t.minor, along_t.axis.1.abs()), (0.75, 0.25, 1.0));
    }

    #[test]
    fn levels_blend_linearly_in_width() {
        let sizes = || [8, 4, 2, 1].into_iter();
        let blend = |width| LevelBlend::for_width(width, sizes());
        assert_eq!(blend(0.1), LevelBlend::FINEST);
        assert_eq!(blend(0.125), LevelBlend::FINEST);
        assert_eq!(blend(0.1875), LevelBlend { finer: 0, coarser: 1, share_of_coarser: 0.5 });
        assert_eq!(blend(0.5), LevelBlend { finer: 1, coarser: 2, share_of_coarser: 1.0 });
        assert_eq!(blend(7.0), LevelBlend { finer: 3, coarser: 3, share_of_coarser: 0.0 });
        assert_eq!(blend(f64::NAN), LevelBlend { finer: 3, coarser: 3, share_of_coarser: 0.0 });
    }

    #[test]
    fn ellipses_that_are_too_long_are_cut_and_widened() {
        // The longer axis is cut to the mean of 2 and 32 times the shorter one.
        let long = ellipse([2.0, 0.0, 0.0, 1.0 / 32.0]);
        assert_eq!((long.major, long.minor, long.aspect), (1.5, 1.5 / 32.0, 32.0));
        let line = ellipse([2.0, 0.0, 0.0, 0.0]);
        assert!((line.major - 1.0).abs() < 1e-6 && line.aspect == 32.0);
        // Narrower than half a texel, only the length in texels counts.
        assert_eq!(ellipse([1e-3, 0.0, 0.0, 1e-4]).magnified(32).aspect, 1.0);
    }

    #[test]
    fn gaussian_is_the_exponential() {
        for i in 0..=200 {
            let x = f64::from(i) / 100.0;
            assert!((gaussian(x) - (-x).exp()).abs() < 1e-12, "{x}");
        }
    }
}
