//! Reflection and refraction at an interface between two media.

use glam::Vec3;

/// The share of unpolarised light that an interface reflects. `cosine` is that of the angle to the normal, on
/// the side of the incoming light, from 0 to 1; `eta` is the index of refraction on the far side divided by
/// that on the near side. An `eta` of 0 or less stands for a mirror, which reflects everything.
pub(super) fn dielectric(cosine: f32, eta: f32) -> f32 {
    if !(eta > 0.0 && eta.is_finite()) {
        return 1.0;
    }
    let c = cosine.abs().min(1.0);
    let g2 = eta * eta - 1.0 + c * c;
    if g2 <= 0.0 {
        return 1.0;
    }
    let g = g2.sqrt();
    // Cook and Torrance's form of the Fresnel equations, 1982.
    let a = (g - c) / (g + c);
    let b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    (0.5 * a * a * (1.0 + b * b)).clamp(0.0, 1.0)
}

/// The mirror direction of `w` about `n`, both pointing away from the surface.
pub(super) fn reflect(w: Vec3, n: Vec3) -> Vec3 {
    n * (2.0 * w.dot(n)) - w
}

/// The direction of light from `w` after the interface, with `eta` as in [`dielectric`]; `None` for total
/// reflection.
pub(super) fn refract(w: Vec3, n: Vec3, eta: f32) -> Option<Vec3> {
    let c = w.dot(n);
    let k = 1.0 - (1.0 - c * c) / (eta * eta);
    if !(eta > 0.0 && k > 0.0) {
        return None;
    }
    (n * (c / eta - k.sqrt() * c.signum()) - w / eta).try_normalize()
}
