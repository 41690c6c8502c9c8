//! The camera of a scene, and rays with a width.

use crate::bsdf::Frame;
use crate::surface_points::Footprint;
use glam::Vec3;
use osl_numeric::strict;

/// A camera as a scene describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Its position.
    pub eye: Vec3,
    /// Its viewing direction, of length 1.
    pub dir: Vec3,
    /// The approximate upward direction.
    pub up: Vec3,
    /// The field of view in degrees. At distance 1, the picture is as high as the tangent of half of it.
    pub fov: f32,
}

impl Default for Camera {
    fn default() -> Self {
        Camera { eye: Vec3::ZERO, dir: Vec3::NEG_Z, up: Vec3::Y, fov: 90.0 }
    }
}

/// A ray with its width and spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Its start.
    pub origin: Vec3,
    /// Its direction, of length 1.
    pub direction: Vec3,
    /// Its width at the start.
    pub radius: f32,
    /// The growth of its width per unit of distance.
    pub spread: f32,
}

impl Ray {
    /// Its width at a distance.
    pub fn radius_at(&self, distance: f32) -> f32 {
        self.radius + self.spread * distance
    }

    /// The footprint at a distance: perpendicular to the ray, as long as its width there. The surface
    /// coordinates are still those of the ray.
    pub fn footprint(&self, distance: f32) -> Footprint {
        let Frame { x, y, .. } = Frame::around(self.direction);
        let (p, i) = (self.radius_at(distance), self.spread);
        Footprint { p: [x * p, y * p], i: [x * i, y * i], ..Footprint::default() }
    }
}

/// A camera and the size of its picture.
#[derive(Clone, Copy, Debug)]
pub struct View {
    eye: Vec3,
    dir: Vec3,
    /// The picture's width and height at distance 1.
    across: [Vec3; 2],
    size: [f32; 2],
}

impl View {
    /// The view of a camera for a picture size.
    pub fn new(camera: &Camera, size: [usize; 2]) -> View {
        let size = size.map(|n| n.max(1) as f32);
        let k = strict::tan(camera.fov.to_radians() / 2.0);
        let right = camera.dir.cross(camera.up).normalize_or_zero() * (size[0] * k / size[1]);
        let up = right.cross(camera.dir).normalize_or_zero() * k;
        View { eye: camera.eye, dir: camera.dir, across: [right, up], size }
    }

    /// The ray through a position of the picture, in pixels from its upper left corner.
    pub fn ray(&self, [x, y]: [f32; 2]) -> Ray {
        let [right, up] = self.across;
        let way = right * (x / self.size[0] - 0.5) + up * (0.5 - y / self.size[1]) + self.dir;
        let direction = way.normalize_or(self.dir);
        let cosine = self.dir.dot(direction);
        let area = right.length() * up.length() * cosine / (self.size[0] * self.size[1]);
        Ray { origin: self.eye, direction, radius: 0.0, spread: area.sqrt() * cosine }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_is_as_high_as_the_tangent_of_half_the_angle() {
        let view = View::new(&Camera::default(), [200, 100]);
        assert!(view.ray([100.0, 50.0]).direction.distance(Vec3::NEG_Z) < 1e-6);
        let corner = view.ray([0.0, 0.0]).direction;
        assert!((corner / -corner.z).distance(Vec3::new(-1.0, 0.5, -1.0)) < 1e-6, "{corner}");
    }

    #[test]
    fn rays_cover_a_pixel() {
        let ray = View::new(&Camera::default(), [100, 100]).ray([50.0, 50.0]);
        assert!((ray.spread - 0.01).abs() < 1e-6, "{}", ray.spread);
        let [a, b] = ray.footprint(3.0).p;
        assert!((a.length() - 0.03).abs() < 1e-6 && (b.length() - 0.03).abs() < 1e-6);
        assert!(a.dot(b).abs() < 1e-6 && a.dot(ray.direction).abs() < 1e-6);
    }
}
