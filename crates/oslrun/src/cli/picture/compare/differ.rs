//! Measures how two pictures differ, channel by channel.
//!
//! Differences between finite numbers are measured. A NaN equals a NaN, and an infinity equals itself; any
//! other pair with such a value differs, beyond every tolerance, and is counted apart. This module must not
//! know files or shaders.

use super::side::Side;
use serde::{Serialize, Serializer};

/// A value of a picture. JSON has no NaN and no infinities, so these become text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::cli) struct Value(pub(in crate::cli) f64);

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self.0.is_finite() {
            true => to.serialize_f64(self.0),
            false => to.serialize_str(&self.0.to_string()),
        }
    }
}

/// A pixel, and the values of both pictures there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(in crate::cli) struct At {
    /// Column and row.
    pub(in crate::cli) pixel: [usize; 2],
    pub(in crate::cli) values: [Value; 2],
}

/// How a channel differs.
#[derive(Clone, Debug, Serialize)]
pub(in crate::cli) struct Difference {
    pub(in crate::cli) channel: String,
    /// The largest difference between finite values; 0 if there is none.
    pub(in crate::cli) largest: f64,
    /// Where it is.
    pub(in crate::cli) at: Option<At>,
    /// The root of the mean square of the differences between finite values.
    pub(in crate::cli) rms: f64,
    /// Pixels that differ by more than the tolerance.
    pub(in crate::cli) different: usize,
    /// The number of NaN in each picture.
    pub(in crate::cli) nan: [usize; 2],
    /// The number of infinities in each picture.
    pub(in crate::cli) infinite: [usize; 2],
    /// Pixels where one value is NaN or infinite and the other one is not the same.
    pub(in crate::cli) unlike: usize,
    /// The first such pixel.
    pub(in crate::cli) unlike_at: Option<At>,
}

/// How two pictures differ.
#[derive(Debug)]
pub(in crate::cli) struct Measured {
    pub(in crate::cli) channels: Vec<Difference>,
    /// The largest difference of each pixel in a channel; infinite where values are unlike.
    pub(in crate::cli) worst: Vec<f64>,
    /// Pixels that differ in some channel.
    pub(in crate::cli) different: usize,
}

impl Measured {
    /// Whether no value differs by more than the tolerance.
    pub(in crate::cli) fn is_equal(&self) -> bool {
        self.different == 0
    }

    /// The largest difference between finite values.
    pub(in crate::cli) fn largest(&self) -> f64 {
        self.channels.iter().map(|channel| channel.largest).fold(0.0, f64::max)
    }
}

/// Compares two pictures.
///
/// # Errors
/// Their sizes or channels differ.
pub(in crate::cli) fn measure(left: &Side, right: &Side, tolerance: f64) -> Result<Measured, String> {
    if let Some(why) = left.mismatch(right) {
        return Err(why);
    }
    let (width, height) = left.size;
    let mut worst = vec![0.0; width * height];
    let mut channels = Vec::new();
    for own in &left.channels {
        let Some(other) = right.channels.iter().find(|channel| channel.name == own.name) else { continue };
        let pair = |pixel| [own.at(pixel), other.at(pixel)];
        channels.push(channel(&own.name, width, tolerance, pair, &mut worst));
    }
    let different = worst.iter().filter(|by| **by > tolerance).count();
    Ok(Measured { channels, worst, different })
}

/// Compares the values of a channel, and adds the differences of its pixels.
fn channel(
    name: &str,
    width: usize,
    tolerance: f64,
    pair: impl Fn(usize) -> [f64; 2],
    worst: &mut [f64],
) -> Difference {
    let mut found = Difference {
        channel: name.to_string(),
        largest: 0.0,
        at: None,
        rms: 0.0,
        different: 0,
        nan: [0; 2],
        infinite: [0; 2],
        unlike: 0,
        unlike_at: None,
    };
    let (mut squares, mut count) = (0.0, 0_usize);
    for (pixel, worst) in worst.iter_mut().enumerate() {
        let values = pair(pixel);
        for (side, value) in values.iter().enumerate() {
            found.nan[side] += usize::from(value.is_nan());
            found.infinite[side] += usize::from(value.is_infinite());
        }
        let at = || Some(At { pixel: [pixel % width, pixel / width], values: values.map(Value) });
        let by = match values {
            [a, b] if a.is_finite() && b.is_finite() => {
                let by = (a - b).abs();
                squares += by * by;
                count += 1;
                if by > found.largest {
                    (found.largest, found.at) = (by, at());
                }
                by
            }
            [a, b] if a == b || (a.is_nan() && b.is_nan()) => 0.0,
            _ => {
                found.unlike += 1;
                if found.unlike_at.is_none() {
                    found.unlike_at = at();
                }
                f64::INFINITY
            }
        };
        found.different += usize::from(by > tolerance);
        *worst = worst.max(by);
    }
    found.rms = (squares / count.max(1) as f64).sqrt();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(pairs: &[[f64; 2]], tolerance: f64) -> (Difference, Vec<f64>) {
        let mut worst = vec![0.0; pairs.len()];
        let found = channel("x", 2, tolerance, |pixel| pairs[pixel], &mut worst);
        (found, worst)
    }

    #[test]
    fn the_largest_difference_has_its_place() {
        let (found, worst) = measured(&[[1.0, 1.0], [0.0, 0.5], [2.0, 1.0], [0.0, -0.0]], 0.5);
        assert_eq!((found.largest, found.different, found.unlike), (1.0, 1, 0));
        assert_eq!(found.at, Some(At { pixel: [0, 1], values: [Value(2.0), Value(1.0)] }));
        assert_eq!(found.rms, (1.25_f64 / 4.0).sqrt());
        assert_eq!(worst, [0.0, 0.5, 1.0, 0.0]);
    }

    #[test]
    fn nan_and_infinity_hide_nothing() {
        let (nan, inf) = (f64::NAN, f64::INFINITY);
        let pairs = [[nan, nan], [inf, inf], [nan, 0.0], [inf, -inf], [1.0, inf], [0.0, 0.25]];
        let (found, worst) = measured(&pairs, 1e9);
        assert_eq!((found.nan, found.infinite), ([2, 1], [2, 3]));
        assert_eq!((found.unlike, found.different, found.largest), (3, 3, 0.25));
        assert_eq!(found.unlike_at.map(|at| at.pixel), Some([0, 1]));
        assert_eq!(worst, [0.0, 0.0, inf, inf, inf, 0.25]);
        assert_eq!(found.rms, 0.25, "of the only pair of finite values");
    }
}
