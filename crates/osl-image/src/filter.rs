//! One sample of one level: interpolation weights, and the weighted sum of texels.

use half::f16;

use crate::level::Level;
use crate::texels::{Texel, Texels};
use crate::wrap::Wrap;

/// How texels are interpolated, once the level is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Interp {
    /// The nearest texel; the lower one of two at equal distance.
    Closest,
    /// Linear: two texels per axis.
    Linear,
    /// The cubic B-spline: four texels per axis, smooth and slightly blurred.
    Cubic,
    /// [`Interp::Cubic`] in the finest level, where single texels are visible, and in levels more than an
    /// octave coarser than the footprint alone (without width and blur) would select; [`Interp::Linear`] in
    /// the others.
    #[default]
    SmartCubic,
}

impl Interp {
    /// The interpolation with this name. There are no synonyms: the reference treats `bilinear` as an unknown
    /// name and keeps its default (measured).
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "closest" => Self::Closest,
            "linear" => Self::Linear,
            "cubic" => Self::Cubic,
            "smartcubic" => Self::SmartCubic,
            _ => return None,
        })
    }
}

/// Four channels and their derivatives with respect to s and t.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// The requested channels, followed by zeros.
    pub value: [f32; 4],
    /// The partial derivatives with respect to s, over the whole texture.
    pub d_ds: [f32; 4],
    /// The partial derivatives with respect to t.
    pub d_dt: [f32; 4],
}

impl Sample {
    /// Adds `weight` times another sample; without `DERIVS` the partials of both are zero and stay so.
    #[inline]
    pub(crate) fn add_scaled<const DERIVS: bool>(&mut self, weight: f32, other: &Self) {
        let add = |sum: &mut [f32; 4], term: &[f32; 4]| {
            sum.iter_mut().zip(term).for_each(|(sum, term)| *sum += weight * term);
        };
        add(&mut self.value, &other.value);
        if DERIVS {
            add(&mut self.d_ds, &other.d_ds);
            add(&mut self.d_dt, &other.d_dt);
        }
    }
}

/// The channels and the level that a sample reads, and the values outside the image.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) level: &'a Level,
    /// Number of channels in the level, at least 1.
    pub(crate) n_stored: usize,
    pub(crate) first: usize,
    /// Number of existing channels: at most 4, and `first + n_read <= n_stored`.
    pub(crate) n_read: usize,
    /// Number of requested channels: at least `n_read`, at most 4.
    pub(crate) n_wanted: usize,
    /// The value of channels that do not exist.
    pub(crate) fill: f32,
    pub(crate) wrap_s: Wrap,
    pub(crate) wrap_t: Wrap,
}

/// Marks a texel that is black.
const BLACK: usize = usize::MAX;

/// The `K` texels of one axis that a sample touches: index, weight, and the weight's change per unit of s or
/// t.
struct Taps<const K: usize> {
    texel: [usize; K],
    weight: [f32; K],
    derivs: [f32; K],
    /// Whether the texels follow each other.
    are_neighbours: bool,
}

/// From this magnitude on, floats are whole numbers.
const EXACT: f32 = 8_388_608.0;

/// The position of a coordinate between the texels of an axis.
struct AxisPosition {
    /// The last texel whose center is at or before it.
    below: i64,
    /// The fraction of the distance from there to the next center, in 0..1.
    fraction: f32,
}

impl AxisPosition {
    #[inline]
    fn of(s: f32, n: usize) -> Self {
        // Texel i is centered on (i + 0.5) / n.
        let x = s * n as f32 - 0.5;
        if x.abs() < EXACT {
            // The same without a call: not every processor has an instruction for the floor.
            let near = x as i32;
            let below = near - i32::from(x < near as f32);
            return Self { below: below.into(), fraction: x - below as f32 };
        }
        // Far from the origin there is no fraction left, and beyond the largest float not even a difference.
        // The bound only prevents overflow in the sums below.
        Self { below: x.floor().clamp(-9e15, 9e15) as i64, fraction: 0.0 }
    }
}

/// One axis of a level.
#[derive(Clone, Copy)]
struct Axis {
    /// The number of texels across the full width or height of the texture.
    full: usize,
    /// Where the stored texels begin, and how many there are.
    origin: i64,
    stored: usize,
    wrap: Wrap,
}

impl<const K: usize> Taps<K> {
    /// Taps on the texels from `first` on. Wrapping repeats the stored texels.
    #[inline]
    fn new(first: i64, axis: Axis, weight: [f32; K], derivs: [f32; K]) -> Self {
        let length = axis.stored as i64;
        // Both are far from the largest integers.
        let first = first - axis.origin;
        let are_neighbours = first >= 0 && first + K as i64 <= length;
        let texel = if are_neighbours {
            std::array::from_fn(|k| first as usize + k)
        } else {
            std::array::from_fn(|k| axis.wrap.texel(first + k as i64, length).unwrap_or(BLACK))
        };
        Self { texel, weight, derivs: derivs.map(|d| d * axis.full as f32), are_neighbours }
    }

    /// The taps that are not black: texel, weight, derivs.
    #[inline]
    fn iter(&self) -> impl Iterator<Item = (usize, f32, f32)> {
        let taps = (0..K).map(|k| (self.texel[k], self.weight[k], self.derivs[k]));
        taps.filter(|(texel, ..)| *texel != BLACK)
    }

    /// The share of the weights that is inside the image.
    fn covered(&self) -> f32 {
        // Not `sum`, which returns -0 if nothing is covered.
        self.iter().fold(0.0, |sum, (_, weight, _)| sum + weight)
    }
}

fn closest(s: f32, axis: Axis) -> Taps<1> {
    let AxisPosition { below, fraction } = AxisPosition::of(s, axis.full);
    Taps::new(below + i64::from(fraction > 0.5), axis, [1.0], [0.0])
}

fn linear(s: f32, axis: Axis) -> Taps<2> {
    let AxisPosition { below, fraction } = AxisPosition::of(s, axis.full);
    Taps::new(below, axis, [1.0 - fraction, fraction], [-1.0, 1.0])
}

fn cubic(s: f32, axis: Axis) -> Taps<4> {
    let AxisPosition { below, fraction } = AxisPosition::of(s, axis.full);
    Taps::new(below - 1, axis, b_spline(fraction), b_spline_derivs(fraction))
}

/// The weights of the uniform cubic B-spline at `f` in 0..1 past the second of four texels.
fn b_spline(f: f32) -> [f32; 4] {
    let g = 1.0 - f;
    [
        g * g * g / 6.0,
        2.0 / 3.0 - 0.5 * f * f * (2.0 - f),
        2.0 / 3.0 - 0.5 * g * g * (2.0 - g),
        f * f * f / 6.0,
    ]
}

/// The derivatives of [`b_spline`] with respect to `f`.
fn b_spline_derivs(f: f32) -> [f32; 4] {
    let g = 1.0 - f;
    [-0.5 * g * g, f * (1.5 * f - 2.0), g * (2.0 - 1.5 * g), 0.5 * f * f]
}

/// One interpolated sample at `(s, t)`, both finite. Without `DERIVS` the partials stay zero. The level has
/// pixels.
pub(crate) fn sample<const DERIVS: bool>(source: &Source<'_>, s: f32, t: f32, interp: Interp) -> Sample {
    let Source { level, wrap_s, wrap_t, .. } = *source;
    let columns = Axis { full: level.full.0, origin: level.origin.0, stored: level.width, wrap: wrap_s };
    let rows = Axis { full: level.full.1, origin: level.origin.1, stored: level.height, wrap: wrap_t };
    match interp {
        Interp::Closest => joined::<1, DERIVS>(source, &closest(s, columns), &closest(t, rows)),
        Interp::Linear => joined::<2, DERIVS>(source, &linear(s, columns), &linear(t, rows)),
        Interp::Cubic | Interp::SmartCubic => {
            joined::<4, DERIVS>(source, &cubic(s, columns), &cubic(t, rows))
        }
    }
}

/// The weighted sum of the texels under the taps, and the fill value for missing channels.
#[inline]
fn joined<const K: usize, const DERIVS: bool>(
    source: &Source<'_>,
    columns: &Taps<K>,
    rows: &Taps<K>,
) -> Sample {
    let mut sum = match source.n_read {
        0 => Sample::default(),
        1 => summed::<K, 1, DERIVS>(source, columns, rows),
        2 => summed::<K, 2, DERIVS>(source, columns, rows),
        3 => summed::<K, 3, DERIVS>(source, columns, rows),
        _ => summed::<K, 4, DERIVS>(source, columns, rows),
    };
    if source.n_read < source.n_wanted && source.fill != 0.0 {
        // If the wrap is black, the outside is black in the missing channels too.
        let fill = source.fill * columns.covered() * rows.covered();
        sum.value[source.n_read..source.n_wanted].fill(fill);
    }
    sum
}

/// The weighted sum of the texels under the taps over `N` channels, for any stored type.
#[inline]
fn summed<const K: usize, const N: usize, const DERIVS: bool>(
    source: &Source<'_>,
    columns: &Taps<K>,
    rows: &Taps<K>,
) -> Sample {
    match &source.level.texels {
        Texels::U8(list) => accumulate::<u8, K, N, DERIVS>(source, list, columns, rows),
        Texels::U16(list) => accumulate::<u16, K, N, DERIVS>(source, list, columns, rows),
        Texels::Half(list) => accumulate::<f16, K, N, DERIVS>(source, list, columns, rows),
        Texels::Float(list) => accumulate::<f32, K, N, DERIVS>(source, list, columns, rows),
    }
}

#[inline]
fn accumulate<T: Texel, const K: usize, const N: usize, const DERIVS: bool>(
    source: &Source<'_>,
    texels: &[T],
    columns: &Taps<K>,
    rows: &Taps<K>,
) -> Sample {
    if let Some(sum) = accumulate_neighbours::<T, K, N, DERIVS>(source, texels, columns, rows) {
        return sum;
    }
    let Source { level, n_stored, first, .. } = *source;
    let mut sum = Sample::default();
    for (y, weight_t, deriv_t) in rows.iter() {
        for (x, weight_s, deriv_s) in columns.iter() {
            let start = (y * level.width + x) * n_stored + first;
            let Some(texel) = texels.get(start..).and_then(|rest| rest.first_chunk::<N>()) else {
                continue;
            };
            for (channel, value) in texel.iter().enumerate() {
                let value = value.float();
                sum.value[channel] += weight_s * weight_t * value;
                if DERIVS {
                    sum.d_ds[channel] += deriv_s * weight_t * value;
                    sum.d_dt[channel] += weight_s * deriv_t * value;
                }
            }
        }
    }
    sum
}

/// The same sum, term by term, for texels that follow each other in memory without other channels between
/// them; `None` for all others.
#[inline]
fn accumulate_neighbours<T: Texel, const K: usize, const N: usize, const DERIVS: bool>(
    source: &Source<'_>,
    texels: &[T],
    columns: &Taps<K>,
    rows: &Taps<K>,
) -> Option<Sample> {
    let Source { level, n_stored, first, .. } = *source;
    if !columns.are_neighbours || n_stored != N || first != 0 {
        return None;
    }
    let mut sum = Sample::default();
    for (y, weight_t, deriv_t) in rows.iter() {
        let start = (y * level.width + columns.texel[0]) * N;
        let row = texels.get(start..start + K * N)?.as_chunks::<N>().0.first_chunk::<K>()?;
        for (texel, (weight_s, deriv_s)) in row.iter().zip(columns.weight.into_iter().zip(columns.derivs)) {
            let values = texel.map(Texel::float);
            for (sum, value) in sum.value.iter_mut().zip(values) {
                *sum += weight_s * weight_t * value;
            }
            if DERIVS {
                for (channel, value) in values.into_iter().enumerate() {
                    sum.d_ds[channel] += deriv_s * weight_t * value;
                    sum.d_dt[channel] += weight_s * deriv_t * value;
                }
            }
        }
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_slopes_to_zero() {
        for i in 0..100 {
            let f = i as f32 / 100.0;
            assert!((b_spline(f).iter().sum::<f32>() - 1.0).abs() < 2e-7);
            assert!(b_spline_derivs(f).iter().sum::<f32>().abs() < 2e-7);
        }
    }

    #[test]
    fn slopes_are_those_of_the_weights() {
        let step = 1e-3;
        for i in 1..100 {
            let f = i as f32 / 100.0;
            let (before, after) = (b_spline(f - step), b_spline(f + step));
            for (k, deriv) in b_spline_derivs(f).into_iter().enumerate() {
                assert!(((after[k] - before[k]) / (2.0 * step) - deriv).abs() < 1e-3);
            }
        }
    }
}
