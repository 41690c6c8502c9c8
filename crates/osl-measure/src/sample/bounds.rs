//! Error bounds that differ between the outputs of an image, and the ranges of which a bound may be a share.
//!
//! A range is measured before the image is computed, at the centres of some of its pixels. So it depends
//! neither on threads nor on the pieces in which the image is computed.

use super::image::Shading;
use super::oracle::some_pixels;
use osl_exec::{Frame, Plane, RunError};
use std::ops::Range;
use std::sync::Arc;

/// A range is measured at one in so many pixels of an image, between a minimum and a maximum.
const LOOKS: (usize, usize, usize) = (32, 1024, 4096);
/// Share of the values that is left out at either end of a range, so that single bright points do not count.
const LEFT_OUT: f64 = 1e-3;

/// How far the values of an output reach.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// Name of the output.
    pub name: Arc<str>,
    /// Its planes.
    pub planes: Range<usize>,
    /// Of the component with the largest range: the values below and above which there is one in a thousand.
    pub ends: [f32; 2],
    /// Number of pixels that were computed.
    pub pixels: usize,
}

impl Reach {
    /// The range of an output, from the values of its planes at some pixels.
    pub(super) fn of(
        name: Arc<str>,
        planes: Range<usize>,
        values: impl IntoIterator<Item = Vec<f32>>,
        pixels: usize,
    ) -> Reach {
        let ends = values.into_iter().map(|plane| ends(&plane));
        let ends = ends.max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0]))).unwrap_or([0.0; 2]);
        Reach { name, planes, ends, pixels }
    }

    /// The size of the range. Of a constant its largest value stands in, and 1 if that is 0, because a share
    /// of nothing could never be kept.
    pub fn size(&self) -> f32 {
        let [low, high] = self.ends;
        let sizes = [high - low, low.abs().max(high.abs())];
        sizes.into_iter().find(|size| *size > 0.0 && size.is_finite()).unwrap_or(1.0)
    }
}

/// Measures the ranges of the outputs of an image at some of its pixels.
///
/// # Errors
/// A loop exceeds its budget.
pub fn reaches(shading: &Shading<'_>) -> Result<Vec<Reach>, RunError> {
    let (width, height) = shading.surface.size();
    let (one_in, fewest, most) = LOOKS;
    let looks = (width * height / one_in).clamp(fewest, most);
    let pixels = some_pixels(width * height, looks, 0x4a96);
    let values = shading.centres(&pixels, &mut Frame::default())?;
    let planes = shading.planes();
    let reach = |own: Range<usize>| {
        let name = planes.get(own.start).map_or_else(|| "".into(), |plane| plane.output.clone());
        let own_values = values.get(own.clone()).unwrap_or(&[]).to_vec();
        Reach::of(name, own, own_values, pixels.len())
    };
    Ok(outputs(&planes).into_iter().map(reach).collect())
}

/// The values of a plane below and above which there is one in a thousand; 0 without finite values.
fn ends(plane: &[f32]) -> [f32; 2] {
    let mut values: Vec<f32> = plane.iter().copied().filter(|x| x.is_finite()).collect();
    let left_out = (LEFT_OUT * values.len() as f64) as usize;
    let last = values.len().saturating_sub(1 + left_out);
    [left_out, last].map(|at| {
        if at >= values.len() {
            return 0.0;
        }
        *values.select_nth_unstable_by(at, f32::total_cmp).1
    })
}

/// The planes of each output.
pub fn outputs(planes: &[Plane]) -> Vec<Range<usize>> {
    let starts: Vec<usize> =
        planes.iter().enumerate().filter(|(_, plane)| plane.component == 0).map(|(at, _)| at).collect();
    let end = |at: usize| starts.get(at + 1).copied().unwrap_or(planes.len());
    starts.iter().enumerate().map(|(at, start)| *start..end(at)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_bright_points_do_not_widen_a_range() {
        let mut plane: Vec<f32> = (0..4096).map(|i| i as f32 / 4095.0).collect();
        (plane[7], plane[9], plane[11]) = (1e6, f32::NAN, f32::INFINITY);
        let [low, high] = ends(&plane);
        assert!(low < 0.01 && (0.99..=1.0).contains(&high), "{low} {high}");
        assert_eq!(ends(&[3.0, 1.0, 2.0]), [1.0, 3.0], "few values all count");
        assert_eq!(ends(&[f32::NAN]), [0.0, 0.0]);
    }

    #[test]
    fn a_constant_has_a_range_too() {
        let reach = |ends| Reach { name: "r".into(), planes: 0..1, ends, pixels: 9 };
        assert_eq!(reach([-1.0, 3.0]).size(), 4.0);
        assert_eq!(reach([-0.5, -0.5]).size(), 0.5);
        assert_eq!(reach([0.0, 0.0]).size(), 1.0);
        assert_eq!(reach([-3e38, 3e38]).size(), 3e38, "a range that is too large for a float");
    }
}
