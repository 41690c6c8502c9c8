//! Axes around a normal, and sampling of directions in them.

use crate::math;
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

/// Three axes at right angles, each of length 1.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// First tangent.
    pub x: Vec3,
    /// Second tangent.
    pub y: Vec3,
    /// The normal.
    pub n: Vec3,
}

impl Frame {
    /// Axes around a normal of length 1.
    pub fn around(n: Vec3) -> Frame {
        let aside = if n.x.abs() > 0.01 { Vec3::new(n.z, 0.0, -n.x) } else { Vec3::new(0.0, -n.z, n.y) };
        let x = aside.normalize_or_zero();
        Frame { x, y: n.cross(x), n }
    }

    /// Axes around a normal, the first along a tangent if it has a part across the normal. Their length is
    /// that of this part, which testrender does not normalise.
    pub fn along(n: Vec3, tangent: Vec3) -> Frame {
        let y = n.cross(tangent);
        if y.length_squared() > 0.0 { Frame { x: y.cross(n), y, n } } else { Frame::around(n) }
    }

    /// Converts a direction to these axes.
    pub fn local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(v), self.y.dot(v), self.n.dot(v))
    }

    /// Converts a direction from these axes.
    pub fn world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.n * v.z
    }
}

/// Maps a point of the unit square uniformly to the unit disk. P. Shirley and K. Chiu, "A Low Distortion Map
/// Between Disk and Square", 1997.
pub fn disk(u: [f32; 2]) -> Vec2 {
    let [a, b] = u.map(|x| 2.0 * x - 1.0);
    if a == 0.0 && b == 0.0 {
        return Vec2::ZERO;
    }
    let (r, angle) =
        if a.abs() > b.abs() { (a, FRAC_PI_4 * (b / a)) } else { (b, FRAC_PI_2 - FRAC_PI_4 * (a / b)) };
    let (sin, cos) = math::sin_cos(angle);
    Vec2::new(r * cos, r * sin)
}

/// A direction in the upper half, with the density z / π (cosine-weighted).
pub fn cosine(u: [f32; 2]) -> Vec3 {
    let p = disk(u);
    Vec3::new(p.x, p.y, (1.0 - p.length_squared()).max(0.0).sqrt())
}

/// A uniform direction, with the density 1 / 4π.
pub fn sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = math::sin_cos(std::f32::consts::TAU * u[1]);
    Vec3::new(r * cos, r * sin, z)
}
