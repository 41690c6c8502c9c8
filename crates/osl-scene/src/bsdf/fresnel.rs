//! What an interface between two media reflects, and where it sends the rest.

use glam::Vec3;

/// The share of unpolarised light that an interface reflects. `cosine` is that of the angle to the normal, on the side
/// that the light comes from, from 0 to 1; `eta` the index of refraction beyond by that before. An `eta` that is not above
/// 0 stands for a mirror: all of it.
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

/// Where light from `w` goes behind the interface, by `eta` as in [`dielectric`]; `None` where all is reflected.
pub(super) fn refract(w: Vec3, n: Vec3, eta: f32) -> Option<Vec3> {
    let c = w.dot(n);
    let k = 1.0 - (1.0 - c * c) / (eta * eta);
    if !(eta > 0.0 && k > 0.0) {
        return None;
    }
    (n * (c / eta - k.sqrt() * c.signum()) - w / eta).try_normalize()
}
