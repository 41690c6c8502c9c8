//! The surroundings of a single surface in a preview: a camera, a lamp, a sky and a floor, all in proportion
//! to the surface. The caller gives the surface and the floor their materials.

use crate::camera::Camera;
use crate::light::{Sky, SphereLight};
use crate::mesh::Bounds;
use crate::view::camera_for;
use glam::Vec3;

/// The place of a surface in common space.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// A box around the surface.
    pub bounds: Bounds,
    /// The radius around the middle of the box.
    pub reach: f32,
}

/// The part of the picture's narrow side that the surface leaves for the floor.
const ROOM: f32 = 1.22;
/// The camera looks below the middle of the surface by this share of its reach.
const LOWER: f32 = 0.08;
/// The direction from the surface to the camera.
const FRONT: Vec3 = Vec3::new(0.35, 0.42, 1.2);
/// The direction from the surface to the lamp, its distance and its radius, in reaches.
const LAMP: (Vec3, f32, f32) = (Vec3::new(-0.75, 1.0, 0.7), 6.0, 0.8);

impl Stage {
    /// A camera that shows the surface and the floor around it, from `eye` or from the front.
    pub fn camera(&self, eye: Option<Vec3>, resolution: [usize; 2]) -> Camera {
        let camera = camera_for(&self.bounds, self.reach * ROOM, eye, resolution);
        let center = self.bounds.center() - Vec3::Y * (LOWER * self.reach);
        let distance = camera.position.distance(self.bounds.center());
        let position = eye.unwrap_or(center + FRONT.normalize() * distance);
        Camera { position, look_at: center, ..camera }
    }

    /// The lamp: from above, on the left.
    pub fn lamp(&self) -> SphereLight {
        let (direction, distance, radius) = LAMP;
        let position = self.bounds.center() + direction.normalize() * (distance * self.reach);
        SphereLight { position, radius: radius * self.reach, color: Vec3::new(1.05, 1.0, 0.92) }
    }

    /// A point of the floor, just below the surface.
    pub fn floor(&self) -> Vec3 {
        let below = Vec3::new(0.0, self.bounds.min.y - 2e-3 * self.reach, 0.0);
        let center = self.bounds.center();
        Vec3::new(center.x, below.y, center.z)
    }

    /// The sky: brighter above. It is no image, so that it costs no shadow rays.
    pub fn sky() -> Sky {
        Sky::gradient(Vec3::new(0.24, 0.26, 0.29), Vec3::new(0.46, 0.51, 0.60))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{Shape, Surface};
    use crate::view::look;

    #[test]
    fn the_surface_is_in_the_picture_whole() {
        for (name, shape) in Shape::NAMED {
            let stage = Stage { bounds: shape.bounds(), reach: shape.reach() };
            for resolution in [[64, 64], [96, 48], [40, 80]] {
                let seen = look(&stage.camera(None, resolution).view().unwrap(), &shape);
                let [width, height] = resolution;
                let inside = |pixel: &u32| {
                    let (x, y) = (*pixel as usize % width, *pixel as usize / width);
                    x > 0 && y > 0 && x + 1 < width && y + 1 < height
                };
                assert!(seen.pixels.len() > 100 && seen.pixels.iter().all(inside), "{name} {resolution:?}");
            }
            assert!(stage.floor().y < stage.bounds.min.y, "{name}");
            assert!(stage.lamp().position.y > stage.bounds.max.y, "{name}");
        }
        assert!(Stage::sky().radiance(Vec3::Y).min_element() > Stage::sky().radiance(Vec3::NEG_Y).x);
    }
}
