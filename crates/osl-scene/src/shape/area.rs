//! The areas of shapes after a transformation, which need not keep angles: a stretched sphere has no formula.

use super::{Exact, Shape};
use glam::{DMat3, Mat4};

/// Steps along u, and along v, which must be even.
const STEPS: usize = 128;

impl Shape {
    /// The area after a transformation; infinite for a plane that does not end. The integral of the length of
    /// `dPdu x dPdv`: by midpoints along u, where round shapes are periodic, and by Simpson's rule along v.
    pub(super) fn area_after(&self, to_common: &Mat4) -> f32 {
        if matches!(self, Shape::Plane { bounded: false, .. }) {
            return f32::INFINITY;
        }
        let turn = DMat3::from_mat4(to_common.as_dmat4());
        let step = 1.0 / STEPS as f64;
        let stretch = |face: usize, u: f64, v: f64| {
            let Exact { dpdu, dpdv, .. } = self.exact(face, [u, v]);
            (turn * dpdu).cross(turn * dpdv).length()
        };
        let column = |face: usize, u: f64| {
            let inner =
                |at: usize| if at.is_multiple_of(2) { 2.0 } else { 4.0 } * stretch(face, u, at as f64 * step);
            let sum: f64 = (1..STEPS).map(inner).sum();
            (stretch(face, u, 0.0) + sum + stretch(face, u, 1.0)) / 3.0
        };
        let of_face = |face: usize| (0..STEPS).map(|at| column(face, (at as f64 + 0.5) * step)).sum::<f64>();
        ((0..self.faces()).map(of_face).sum::<f64>() * step * step) as f32
    }
}
