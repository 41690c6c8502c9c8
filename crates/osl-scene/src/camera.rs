//! The perspective camera: the ray through a position on the image, and the size of objects there.
//!
//! Pixels count from the left and from the top; the centre of the first is (0.5, 0.5). This module must not
//! know what the rays hit.

use crate::camera_facts::CameraFacts;
use crate::grid::set_projections;
use crate::math;
use glam::{DMat3, DVec2, DVec3, Mat4, Vec3};
use osl_exec::Spaces;

/// A perspective camera as scenes describe it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Its position.
    pub position: Vec3,
    /// The point that it looks at.
    pub look_at: Vec3,
    /// The upward direction of the image.
    pub up: Vec3,
    /// Angle between the left and the right border of the image, in degrees: above 0 and below 180.
    pub fov_degrees: f32,
    /// Width and height of the image in pixels.
    pub resolution: [usize; 2],
}

/// Why a camera is invalid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// It looks at its own position, or a coordinate is NaN or infinite.
    #[error("the camera has no direction: its position and what it looks at are to be two different points")]
    Direction,
    /// The angle is out of range.
    #[error("the camera's field of view is to lie between 0 and 180 degrees, not {0}")]
    Fov(f32),
    /// The image has no pixels.
    #[error("the camera's image has no pixels")]
    Resolution,
}

/// A ray, and its change from one pixel to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Its start.
    pub origin: Vec3,
    /// Its direction, of length 1.
    pub direction: Vec3,
    /// The change of the origin to the pixel on the right, and to the pixel above.
    pub origin_derivs: [Vec3; 2],
    /// The change of the direction to the pixel on the right, and to the pixel above. Above, so that the
    /// cross product of a surface's derivatives points to the camera, as `calculatenormal` expects.
    pub direction_derivs: [Vec3; 2],
}

/// A camera that is ready to take a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    position: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    fov_degrees: f32,
    /// Tangent of half the horizontal angle.
    half_width: f64,
    /// The distance of what it looks at.
    sight: f64,
    resolution: [usize; 2],
}

impl Camera {
    /// Prepares the camera. Where `up` is along the line of sight, any other direction takes its place.
    ///
    /// # Errors
    /// There is no direction, no angle or no image.
    pub fn view(&self) -> Result<View, CameraError> {
        let Camera { position, look_at, up, fov_degrees, resolution } = *self;
        if !(fov_degrees > 0.0 && fov_degrees < 180.0) {
            return Err(CameraError::Fov(fov_degrees));
        }
        if resolution.contains(&0) {
            return Err(CameraError::Resolution);
        }
        let position = position.as_dvec3();
        let ahead = look_at.as_dvec3() - position;
        let forward = ahead.try_normalize().ok_or(CameraError::Direction)?;
        let across = |up: DVec3| {
            let right = forward.cross(up);
            (right.length_squared() > 1e-12 * up.length_squared()).then(|| right.try_normalize()).flatten()
        };
        let right = across(up.as_dvec3())
            .or_else(|| across(DVec3::Y))
            .or_else(|| across(DVec3::X))
            .ok_or(CameraError::Direction)?;
        let half_width = math::tan((f64::from(fov_degrees) * 0.5).to_radians());
        let up = right.cross(forward);
        Ok(View { position, right, up, forward, fov_degrees, half_width, sight: ahead.length(), resolution })
    }
}

impl View {
    /// Width and height of the image in pixels.
    pub fn resolution(&self) -> [usize; 2] {
        self.resolution
    }

    /// Where the camera stands.
    pub fn position(&self) -> Vec3 {
        self.position.as_vec3()
    }

    /// The distance of what it looks at.
    pub fn sight(&self) -> f32 {
        self.sight as f32
    }

    /// The directions of the image to the right, upwards and ahead, each of length 1.
    pub fn axes(&self) -> [DVec3; 3] {
        [self.right, self.up, self.forward]
    }

    /// What shaders can ask about it, with the nearest and the farthest distance.
    pub fn facts(&self, clip: [f32; 2]) -> CameraFacts {
        CameraFacts { resolution: self.resolution, fov_degrees: self.fov_degrees, clip }
    }

    /// Side of a pixel on a plane at distance 1.
    fn pixel(&self) -> f64 {
        2.0 * self.half_width / self.resolution[0] as f64
    }

    /// The ray through a place on the image.
    pub fn ray(&self, x: f32, y: f32) -> Ray {
        let [width, height] = self.resolution.map(|n| n as f64);
        let pixel = self.pixel();
        let (right, up) = (self.right * pixel, self.up * pixel);
        let through =
            self.forward + right * (f64::from(x) - 0.5 * width) - up * (f64::from(y) - 0.5 * height);
        let length = through.length();
        let direction = through / length;
        // The derivative of a normalised vector: what is across it, by its length.
        let deriv = |d: DVec3| ((d - direction * direction.dot(d)) / length).as_vec3();
        Ray {
            origin: self.position(),
            direction: direction.as_vec3(),
            origin_derivs: [Vec3::ZERO; 2],
            direction_derivs: [deriv(right), deriv(up)],
        }
    }

    /// The distance of a point in front of the camera, along the line of sight.
    pub fn depth(&self, point: Vec3) -> f64 {
        (point.as_dvec3() - self.position).dot(self.forward)
    }

    /// The position of a point on the image; `None` if it is not in front of the camera.
    pub fn project(&self, point: Vec3) -> Option<DVec2> {
        let away = point.as_dvec3() - self.position;
        let depth = away.dot(self.forward);
        let scale = 1.0 / (depth * self.pixel());
        let [width, height] = self.resolution.map(|n| n as f64);
        let place =
            DVec2::new(0.5 * width + away.dot(self.right) * scale, 0.5 * height - away.dot(self.up) * scale);
        (depth > 0.0 && place.is_finite()).then_some(place)
    }

    /// Adds the spaces `camera` (x to the right, y up, z ahead), `screen` (−1 to 1 over the width, z from 0
    /// at `near` to 1 at `far`), `NDC` (0 to 1 from the left and from the top) and `raster` (pixels).
    pub fn set_spaces(&self, spaces: &mut Spaces, near: f32, far: f32) {
        let axes = DMat3::from_cols(self.right, self.up, self.forward);
        let to_common = Mat4::from_cols(
            axes.x_axis.as_vec3().extend(0.0),
            axes.y_axis.as_vec3().extend(0.0),
            axes.z_axis.as_vec3().extend(0.0),
            self.position.as_vec3().extend(1.0),
        );
        // The columns of glam's matrices are the rows for row vectors.
        let rows = |m: Mat4| m.to_cols_array();
        let from_common = to_common.inverse();
        let focal = (1.0 / self.half_width) as f32;
        let (a, b) = (far / (far - near), -near * far / (far - near));
        let lens = Mat4::from_cols_array_2d(&[
            [focal, 0.0, 0.0, 0.0],
            [0.0, focal, 0.0, 0.0],
            [0.0, 0.0, a, 1.0],
            [0.0, 0.0, b, 0.0],
        ]);
        let [width, height] = self.resolution.map(|n| n as f32);
        let aspect = width / height;
        let half = Mat4::from_translation(Vec3::new(0.5, 0.5, 0.0))
            * Mat4::from_scale(Vec3::new(0.5, -0.5 * aspect, 1.0));
        let raster = Mat4::from_scale(Vec3::new(width, height, 1.0));
        spaces.set("camera", rows(to_common));
        let screen = lens * from_common;
        let projections =
            [("screen", screen), ("NDC", half * screen), ("raster", raster * half * lens * from_common)];
        set_projections(spaces, projections);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            position: Vec3::new(3677.013, 1039.1904, 597.0592),
            look_at: Vec3::new(0.0, 250.0, 0.0),
            up: Vec3::Y,
            fov_degrees: 11.0,
            resolution: [640, 480],
        }
    }

    #[test]
    fn rays_go_through_the_pixels_that_their_points_appear_at() {
        let view = camera().view().unwrap();
        for (x, y) in [(0.0, 0.0), (320.0, 240.0), (639.5, 3.25), (17.0, 479.0)] {
            let ray = view.ray(x, y);
            let at = view.project(ray.origin + ray.direction * 3000.0).unwrap();
            assert!((at - DVec2::new(f64::from(x), f64::from(y))).length() < 0.01, "{x} {y}: {at}");
        }
        let centre = view.ray(320.0, 240.0).direction;
        let sight = (camera().look_at - camera().position).normalize();
        assert!((centre - sight).length() < 1e-6);
    }

    #[test]
    fn slopes_are_differences_to_the_next_rays() {
        let view = camera().view().unwrap();
        let ray = view.ray(100.0, 50.0);
        // A hundredth of a pixel is a small step, yet far above the rounding of a direction.
        let step = 32.0;
        let [dx, dy] = ray.direction_derivs;
        let right = (view.ray(100.0 + step, 50.0).direction - ray.direction) / step;
        let above = (view.ray(100.0, 50.0 - step).direction - ray.direction) / step;
        assert!((right - dx).length() < 2e-2 * dx.length(), "{right} {dx}");
        assert!((above - dy).length() < 2e-2 * dy.length(), "{above} {dy}");
    }

    #[test]
    fn the_field_of_view_is_that_of_the_width() {
        let view = Camera { fov_degrees: 90.0, ..camera() }.view().unwrap();
        let angle = view.ray(0.0, 240.0).direction.dot(view.ray(640.0, 240.0).direction);
        assert!(angle.abs() < 1e-6, "{angle}");
    }

    #[test]
    fn spaces_agree_with_rays() {
        let view = camera().view().unwrap();
        let mut spaces = Spaces::default();
        view.set_spaces(&mut spaces, 1.0, 10_000.0);
        let ray = view.ray(123.0, 45.0);
        let p = ray.origin + ray.direction * 3500.0;
        let to =
            |space: &str| Mat4::from_cols_array(&spaces.matrix("common", space).unwrap()).project_point3(p);
        let raster = to("raster");
        assert!((raster.x - 123.0).abs() < 0.02 && (raster.y - 45.0).abs() < 0.02, "{raster}");
        assert!((to("NDC").x * 640.0 - 123.0).abs() < 0.02);
        assert!((to("camera").z - view.depth(p) as f32).abs() < 0.01);
        view.set_spaces(&mut spaces, view.sight() * 0.01, view.sight() * 100.0);
        for space in ["camera", "screen", "NDC", "raster"] {
            let way = |from: &str, to: &str, p: Vec3| {
                Mat4::from_cols_array(&spaces.matrix(from, to).unwrap()).project_point3(p)
            };
            let back = way(space, "common", way("common", space, p));
            assert!((back - p).length() < 2e-4 * view.sight(), "{space}: {back} {p}");
            assert_eq!(spaces.matrix::<f32>(space, space).unwrap(), Mat4::IDENTITY.to_cols_array());
        }
    }

    #[test]
    fn impossible_cameras_are_errors() {
        let view = |camera: Camera| camera.view();
        assert_eq!(view(Camera { look_at: camera().position, ..camera() }), Err(CameraError::Direction));
        assert_eq!(view(Camera { fov_degrees: 180.0, ..camera() }), Err(CameraError::Fov(180.0)));
        assert!(view(Camera { fov_degrees: f32::NAN, ..camera() }).is_err());
        assert_eq!(view(Camera { resolution: [0, 4], ..camera() }), Err(CameraError::Resolution));
        let along = Camera { up: camera().look_at - camera().position, ..camera() };
        assert!(view(along).is_ok(), "another direction takes the place of up");
    }
}
