//! Reconstruction filters, as distributions of a pixel's samples.
//!
//! Samples are drawn in proportion to the filter's weight (filter importance sampling, Ernst, Stamminger and
//! Greiner 2006). So all samples of a pixel count alike, no pixel needs the samples of another, and refining
//! a pixel does not change its neighbours. Where the filter is negative, the sample's weight is negative.

use pxfm::{f_cos, f_exp};
use std::fmt;

/// The shape of a filter. All are products of one function along x and along y.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FilterKind {
    /// 1 over the whole width.
    #[default]
    Box,
    /// `exp(-2 (x/r)²)` minus its value at the radius; the standard deviation is half the radius.
    Gaussian,
    /// The four-term window of Harris 1978.
    BlackmanHarris,
    /// Mitchell and Netravali 1988 with B = C = 1/3.
    Mitchell,
}

impl FilterKind {
    /// All filters.
    pub const ALL: [FilterKind; 4] =
        [FilterKind::Box, FilterKind::Gaussian, FilterKind::BlackmanHarris, FilterKind::Mitchell];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            FilterKind::Box => "box",
            FilterKind::Gaussian => "gaussian",
            FilterKind::BlackmanHarris => "blackman-harris",
            FilterKind::Mitchell => "mitchell",
        }
    }

    /// The filter with a name.
    pub fn from_name(name: &str) -> Option<FilterKind> {
        FilterKind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Default width in pixels: 1, 2, 3 and 4.
    pub fn usual_width(self) -> f32 {
        match self {
            FilterKind::Box => 1.0,
            FilterKind::Gaussian => 2.0,
            FilterKind::BlackmanHarris => 3.0,
            FilterKind::Mitchell => 4.0,
        }
    }

    /// The filter's value at `t`, which runs from −1 to 1 over the width.
    fn value(self, t: f64) -> f64 {
        match self {
            FilterKind::Box => 1.0,
            FilterKind::Gaussian => f_exp(-2.0 * t * t) - f_exp(-2.0),
            FilterKind::BlackmanHarris => {
                let turn = std::f64::consts::PI * (t + 1.0);
                let [one, two, three] = [1.0, 2.0, 3.0].map(|times| f_cos(times * turn));
                0.35875 - 0.48829 * one + 0.14128 * two - 0.01168 * three
            }
            FilterKind::Mitchell => {
                let x = 2.0 * t.abs();
                if x < 1.0 {
                    (7.0 * x * x * x - 12.0 * x * x + 16.0 / 3.0) / 6.0
                } else {
                    (-7.0 / 3.0 * x * x * x + 12.0 * x * x - 20.0 * x + 32.0 / 3.0) / 6.0
                }
            }
        }
    }
}

/// Something that is done with the offsets of samples. The function is inlined into it, so that a box costs
/// no more than its product.
pub(super) trait WithOffset {
    /// What it returns.
    type Result;

    /// Does it, given the function from the coordinate of a sample to its offset.
    fn with(self, offset: impl Fn(f32) -> f32) -> Self::Result;
}

/// The arguments of [`Filter::offsets`].
struct Offsets<'s, F, T> {
    samples: &'s [[f32; 2]],
    of: F,
    to: &'s mut Vec<T>,
}

impl<F: Fn([f32; 2]) -> T, T> WithOffset for Offsets<'_, F, T> {
    type Result = ();

    fn with(self, offset: impl Fn(f32) -> f32) {
        self.to.extend(self.samples.iter().map(|[x, y]| (self.of)([offset(*x), offset(*y)])));
    }
}

/// Steps of the table that maps uniform numbers to the filter's distribution.
const STEPS: usize = 1024;

/// A filter with a width.
#[derive(Clone, Debug)]
pub struct Filter {
    kind: FilterKind,
    width: f32,
    /// Quantiles of the filter's weight: entry `i` is the position, from −1 to 1, below which the share
    /// `i / STEPS` lies. Empty for a box.
    ends: Vec<f32>,
}

impl Default for Filter {
    fn default() -> Self {
        Filter::new(FilterKind::Box, 1.0)
    }
}

impl PartialEq for Filter {
    fn eq(&self, other: &Filter) -> bool {
        self.kind == other.kind && self.width == other.width
    }
}

impl fmt::Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.kind.name(), self.width)
    }
}

impl Filter {
    /// Makes a filter of a width. **Units:** pixels.
    pub fn new(kind: FilterKind, width: f32) -> Filter {
        let ends = if kind == FilterKind::Box { Vec::new() } else { ends(kind) };
        Filter { kind, width, ends }
    }

    /// Its shape.
    pub fn kind(&self) -> FilterKind {
        self.kind
    }

    /// Its width. **Units:** pixels.
    pub fn width(&self) -> f32 {
        self.width
    }

    /// Calls something with a function from the coordinate of a sample to its offset from the pixel's centre.
    /// **Units:** pixels.
    pub(super) fn with_offset<W: WithOffset>(&self, to: W) -> W::Result {
        if self.ends.is_empty() {
            // The same as below, without a question for each sample.
            let width = self.width;
            to.with(|s| (s - 0.5) * width)
        } else {
            to.with(|s| self.place(s).0)
        }
    }

    /// Appends what `of` makes of the offset of each of some samples from the pixel's centre. **Units:**
    /// pixels.
    pub(super) fn offsets<T>(&self, samples: &[[f32; 2]], of: impl Fn([f32; 2]) -> T, to: &mut Vec<T>) {
        self.with_offset(Offsets { samples, of, to });
    }

    /// The quantile `s` of the filter's weight along one axis, as an offset from the pixel's centre in
    /// pixels, and the sign of the filter there. `s` is in 0..1.
    pub fn place(&self, s: f32) -> (f32, f32) {
        let radius = 0.5 * self.width;
        if self.ends.is_empty() {
            return ((s - 0.5) * self.width, 1.0);
        }
        let at = s * STEPS as f32;
        let step = (at as usize).min(STEPS - 1);
        let (a, b) = (self.ends.get(step).copied(), self.ends.get(step + 1).copied());
        let (a, b) = (a.unwrap_or(0.0), b.unwrap_or(0.0));
        let t = a + (b - a) * (at - step as f32);
        let negative = self.kind == FilterKind::Mitchell && t.abs() > 4.0 / 7.0;
        (t * radius, if negative { -1.0 } else { 1.0 })
    }
}

/// The inverse of the distribution of the filter's absolute value.
fn ends(kind: FilterKind) -> Vec<f32> {
    const FINE: usize = 8 * STEPS;
    let middle = |i: usize| 2.0 * (i as f64 + 0.5) / FINE as f64 - 1.0;
    let mut sums = Vec::with_capacity(FINE + 1);
    let mut sum = 0.0;
    sums.push(0.0);
    for i in 0..FINE {
        sum += kind.value(middle(i)).abs();
        sums.push(sum);
    }
    let mut bin = 0;
    (0..=STEPS)
        .map(|step| {
            let wanted = sum * step as f64 / STEPS as f64;
            while bin + 1 < FINE && sums[bin + 1] < wanted {
                bin += 1;
            }
            let inside = (wanted - sums[bin]) / (sums[bin + 1] - sums[bin]).max(f64::MIN_POSITIVE);
            (2.0 * (bin as f64 + inside.clamp(0.0, 1.0)) / FINE as f64 - 1.0) as f32
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of a function of the position under the filter, computed with the filter's own samples.
    fn mean(filter: &Filter, f: impl Fn(f64) -> f64) -> f64 {
        let n = 200_000;
        let (mut sum, mut weight) = (0.0, 0.0);
        for i in 0..n {
            let (x, sign) = filter.place((i as f32 + 0.5) / n as f32);
            sum += f64::from(sign) * f(f64::from(x));
            weight += f64::from(sign);
        }
        sum / weight
    }

    #[test]
    fn samples_have_the_moments_of_the_filter() {
        for kind in FilterKind::ALL {
            let filter = Filter::new(kind, kind.usual_width());
            let radius = 0.5 * f64::from(kind.usual_width());
            let n = 200_000;
            let (mut total, mut square) = (0.0, 0.0);
            for i in 0..n {
                let t = 2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0;
                total += kind.value(t);
                square += kind.value(t) * (t * radius).powi(2);
            }
            assert!(mean(&filter, |x| x).abs() < 1e-4, "{kind:?}");
            let found = mean(&filter, |x| x * x);
            assert!((found - square / total).abs() < 1e-3, "{kind:?}: {found} {}", square / total);
        }
    }

    #[test]
    fn mitchell_has_negative_lobes() {
        let filter = Filter::new(FilterKind::Mitchell, 4.0);
        assert!(filter.place(0.001).1 < 0.0 && filter.place(0.999).1 < 0.0);
        assert_eq!(filter.place(0.5).1, 1.0);
    }

    #[test]
    fn samples_stay_inside() {
        for kind in FilterKind::ALL {
            let filter = Filter::new(kind, 3.0);
            for s in [0.0, 1e-7, 0.5, 1.0 - f32::EPSILON / 2.0] {
                assert!(filter.place(s).0.abs() <= 1.5, "{kind:?} {s}");
            }
        }
    }
}
