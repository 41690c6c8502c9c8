//! Scales the error of each plane, so that one bound, the smallest, serves for all planes.

use std::sync::Arc;

/// Factors on the errors of the planes, so that one bound holds for all.
#[derive(Clone, Debug)]
pub(super) struct Weights(Arc<[f32]>);

impl Weights {
    /// The same bound for all planes.
    pub(super) fn equal(planes: usize) -> Weights {
        Weights(vec![1.0; planes].into())
    }

    /// The smallest of some bounds, and the factors that make it stand for all. A plane with an infinite
    /// bound does not count.
    pub(super) fn of(bounds: &[f32]) -> (f32, Weights) {
        let smallest = bounds.iter().copied().fold(f32::INFINITY, f32::min);
        let smallest = if smallest.is_finite() { smallest } else { 1.0 };
        let weight = |bound: &f32| if bound.is_finite() { smallest / bound } else { 0.0 };
        (smallest, Weights(bounds.iter().map(weight).collect()))
    }

    /// The factor of each plane.
    pub(super) fn iter(&self) -> impl Iterator<Item = f32> + '_ {
        self.0.iter().copied()
    }
}

/// An error times the factor of its plane. An error without a bound does not count, even if it is NaN.
#[inline(always)]
pub(super) fn weighted(error: f32, weight: f32) -> f32 {
    if weight > 0.0 { error * weight } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_bound_stands_for_all() {
        let (smallest, weights) = Weights::of(&[0.5, 0.125, f32::INFINITY]);
        assert_eq!(smallest, 0.125);
        assert_eq!(weights.iter().collect::<Vec<_>>(), [0.25, 1.0, 0.0]);
        assert_eq!(weighted(f32::NAN, 0.0), 0.0);
    }
}
