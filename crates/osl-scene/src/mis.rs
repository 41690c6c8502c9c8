//! Weights for samples of several techniques. E. Veach, "Robust Monte Carlo Methods for Light Transport
//! Simulation", 1997, chapter 9.
//!
//! A weight is a value divided by its density, so a product of weights or values needs factors of the
//! densities to become an estimate. Densities may be infinite, such as those of mirrors.

use crate::math::positive;
use crate::math::square;
use glam::Vec3;

/// The power heuristic with exponent 2 for a sample chosen with the density `own`.
pub(crate) fn power(own: f32, other: f32) -> f32 {
    if own > other {
        1.0 / (1.0 + square(other / own))
    } else if own < other {
        1.0 - 1.0 / (1.0 + square(own / other))
    } else {
        0.5
    }
}

/// The factor of a product of two weights; the first weight has the density with which the sample was chosen.
pub(crate) fn of_weights(own: f32, other: f32) -> f32 {
    if other > 0.0 { power(own, other) * other } else { 0.0 }
}

/// The factor of a product of a weight with the density `other` and a plain value, where the sample was
/// chosen with the density `own`.
pub(crate) fn of_value(own: f32, other: f32) -> f32 {
    if own > other {
        let r = other / own;
        r / (1.0 + r * r)
    } else {
        let r = own / other;
        if r.is_finite() { r / (1.0 + r * r) } else { 0.0 }
    }
}

/// Mixes another technique into a weight and its density by the balance heuristic. `chance` is the other's
/// probability.
pub(crate) fn mix((weight, pdf): (&mut Vec3, &mut f32), other: Vec3, other_pdf: f32, chance: f32) {
    let other_pdf = other_pdf * chance;
    if !positive(other_pdf) {
        return;
    }
    let share = if other_pdf < *pdf {
        let r = other_pdf / *pdf;
        r / (1.0 + r)
    } else {
        1.0 / (1.0 + *pdf / other_pdf)
    };
    *weight = *weight * (1.0 - share) + other * (share / chance);
    *pdf += other_pdf;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_both_techniques_sum_to_one() {
        for (a, b) in [(0.3, 2.0), (5.0, 0.01), (1.0, 1.0), (f32::INFINITY, 0.5), (0.0, 0.5)] {
            assert!((power(a, b) + power(b, a) - 1.0).abs() < 1e-6);
        }
        assert_eq!(power(f32::INFINITY, 3.0), 1.0);
    }

    #[test]
    fn factors_make_estimates_of_products() {
        // A light of radiance 2 chosen with density 4, and a surface with value 3 and density 0.5.
        let estimate = 2.0 * 3.0 / 4.0 * power(4.0, 0.5);
        assert!((2.0 / 4.0 * (3.0 / 0.5) * of_weights(4.0, 0.5) - estimate).abs() < 1e-6);
        assert!((2.0 * (3.0 / 0.5) * of_value(4.0, 0.5) - estimate).abs() < 1e-6);
    }

    #[test]
    fn balance() {
        let (mut weight, mut pdf) = (Vec3::splat(0.5), 2.0);
        mix((&mut weight, &mut pdf), Vec3::splat(0.25), 4.0, 0.5);
        assert_eq!((weight, pdf), (Vec3::splat(0.5), 4.0));
        mix((&mut weight, &mut pdf), Vec3::ONE, 0.0, 0.5);
        assert_eq!(pdf, 4.0, "nothing to mix in");
        let (mut weight, mut pdf) = (Vec3::ONE, f32::INFINITY);
        mix((&mut weight, &mut pdf), Vec3::ZERO, 4.0, 0.5);
        assert_eq!((weight, pdf), (Vec3::ONE, f32::INFINITY));
    }
}
