//! Glossy lobes without microfacets: Phong's and Ward's.

use super::{Frame, Sample};
use crate::math::{positive, square};
use glam::{Vec2, Vec3};
use osl_numeric::strict::{exp, log, pow, sincos, tan};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// B. T. Phong, "Illumination for Computer Generated Pictures", 1975, modified to conserve energy.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phong {
    pub(super) n: Vec3,
    pub(super) exponent: f32,
}

impl Phong {
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Sample {
        let (i, o) = (self.n.dot(wi), self.n.dot(wo));
        let mirrored = self.n * (2.0 * o) - wo;
        let cosine = mirrored.dot(wi);
        if !(i > 0.0 && o > 0.0 && cosine > 0.0) {
            return Sample::nothing(wi);
        }
        let e = self.exponent;
        Sample {
            wi,
            weight: Vec3::splat(i * (e + 2.0) / (e + 1.0)),
            pdf: (e + 1.0) / TAU * pow(cosine, e),
            roughness: 1.0 / (1.0 + e),
        }
    }

    pub(super) fn sample(&self, wo: Vec3, [x, y, _]: [f32; 3]) -> Sample {
        let o = self.n.dot(wo);
        if !positive(o) {
            return Sample::default();
        }
        let cos = pow(y, 1.0 / (self.exponent + 1.0));
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let (sin_phi, cos_phi) = sincos(TAU * x);
        let axes = Frame::around(self.n * (2.0 * o) - wo);
        self.eval(wo, axes.world(Vec3::new(cos_phi * sin, sin_phi * sin, cos)))
    }
}

/// G. Ward, "Measuring and Modeling Anisotropic Reflection", 1992, with the equations of B. Walter, "Notes on
/// the Ward BRDF", 2005.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ward {
    pub(super) axes: Frame,
    pub(super) alpha: Vec2,
}

impl Ward {
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Sample {
        let (i, o) = (self.axes.n.dot(wi), self.axes.n.dot(wo));
        if !(i > 0.0 && o > 0.0) {
            return Sample::nothing(wi);
        }
        let h = (wi + wo).normalize_or_zero();
        let local = self.axes.local(h);
        let slope = Vec2::new(local.x, local.y) / self.alpha / local.z;
        let falloff = exp(-slope.length_squared());
        let area = 4.0 * PI * self.alpha.x * self.alpha.y;
        // Equations 4 and 9.
        let value = i * falloff / (area * (i * o).sqrt());
        let pdf = falloff / (area * h.dot(wo) * (square(local.z) * local.z));
        if !positive(pdf) {
            return Sample::nothing(wi);
        }
        Sample { wi, weight: Vec3::splat(value / pdf), pdf, roughness: self.alpha.max_element() }
    }

    pub(super) fn sample(&self, wo: Vec3, [x, y, _]: [f32; 3]) -> Sample {
        if !positive(self.axes.n.dot(wo)) {
            return Sample::default();
        }
        // Equation 6: the azimuth, quadrant by quadrant. Measured: the second and the fourth are filled in
        // reverse.
        let quarter = (4.0 * x).floor();
        let inside = 4.0 * x - quarter;
        let inside = if quarter == 1.0 || quarter == 3.0 { 1.0 - inside } else { inside };
        let slope = self.alpha.y / self.alpha.x * tan(FRAC_PI_2 * inside);
        let cos = 1.0 / (1.0 + slope * slope).sqrt();
        let sign = |negative: bool| if negative { -1.0 } else { 1.0 };
        let azimuth = Vec2::new(
            cos * sign(quarter == 1.0 || quarter == 2.0),
            slope * cos * sign(quarter == 2.0 || quarter == 3.0),
        );
        // Equation 7: the angle to the normal.
        let tan2 = -log(1.0 - y) / (azimuth / self.alpha).length_squared();
        let cos = 1.0 / (1.0 + tan2).sqrt();
        let sin = cos * tan2.sqrt();
        let h = self.axes.world(Vec3::new(azimuth.x * sin, azimuth.y * sin, cos));
        let cosine = h.dot(wo);
        if !positive(cosine) {
            return Sample::default();
        }
        self.eval(wo, h * (2.0 * cosine) - wo)
    }
}
