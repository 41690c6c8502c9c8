//! What there is to see, ready to be met by rays.

use crate::camera::View;
use crate::light::{Sky, SphereLight};
use crate::mesh::SurfacePoint;
use crate::shape::{Placed, Shape, Solid, Surface};
use glam::{Vec2, Vec3};
use osl_exec::{Program, Services};
use std::sync::Arc;

/// Something that rays meet.
pub enum Body {
    /// Triangles, in common space.
    Solid(Solid),
    /// A shape with a formula.
    Shape(Placed<Shape>),
}

impl Body {
    /// The nearest point within reach, and its distance.
    pub(super) fn hit(&self, origin: Vec3, direction: Vec3, reach: f32) -> Option<(f32, SurfacePoint)> {
        match self {
            Body::Solid(solid) => solid.hit(origin, direction, 0.0..reach),
            Body::Shape(shape) => shape.hit(origin, direction, 0.0..reach),
        }
    }

    fn blocks(&self, origin: Vec3, direction: Vec3, reach: f32) -> bool {
        match self {
            Body::Solid(solid) => solid.bvh.blocked(origin, direction, 0.0..reach),
            Body::Shape(shape) => shape.hit(origin, direction, 0.0..reach).is_some(),
        }
    }

    /// How many triangles it has.
    pub fn triangles(&self) -> usize {
        match self {
            Body::Solid(solid) => solid.triangles.indices.len(),
            Body::Shape(_) => 0,
        }
    }
}

/// Something with what shades it.
pub struct Object {
    /// Its form.
    pub body: Body,
    /// Which of the materials.
    pub material: usize,
}

/// An endless plane with what shades it. Its coordinates are lengths along two axes.
#[derive(Clone, Copy, Debug)]
pub struct Ground {
    /// A point of it, where u and v are 0.
    pub point: Vec3,
    /// Its normal, of length 1.
    pub normal: Vec3,
    /// Which of the materials.
    pub material: usize,
}

/// What shades a surface.
#[derive(Debug)]
pub struct Material {
    /// Yields the closure and all other outputs; it runs for what the camera sees.
    pub program: Program,
    /// Yields the closure, or the color that stands for it; it runs for all other rays.
    pub lean: Program,
    /// What both may ask for.
    pub services: Services,
    /// The output that is shown as a matt color, where there is no closure.
    pub color: Option<Arc<str>>,
}

/// All that a picture needs.
pub struct World {
    /// The camera.
    pub view: View,
    /// Things of triangles.
    pub objects: Vec<Object>,
    /// Planes.
    pub grounds: Vec<Ground>,
    /// What shades them.
    pub materials: Vec<Material>,
    /// Lights.
    pub lights: Vec<SphereLight>,
    /// Light from all around.
    pub sky: Option<Sky>,
    /// Whether the camera sees the sky.
    pub background: bool,
    /// Times that light is reflected diffusely before it meets what the camera sees.
    pub diffuse_depth: u32,
    /// The same for mirrors and gloss.
    pub glossy_depth: u32,
}

/// A surface that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    pub(super) t: f32,
    pub(super) point: SurfacePoint,
    pub(super) material: usize,
    /// Which of the objects; a plane is none.
    pub(super) object: Option<usize>,
}

/// Farther than anything.
const FAR: f32 = 1e30;

/// Where a ray leaves a point of a surface: a little off, on the side that it goes to, so that rounding does not let it
/// meet the surface again.
pub(super) fn leave(p: Vec3, ng: Vec3, direction: Vec3) -> Vec3 {
    let step = 2e-5 * p.abs().max_element().max(1e-2);
    p + ng * if ng.dot(direction) < 0.0 { -step } else { step }
}

impl World {
    /// The nearest surface along a ray.
    pub(super) fn hit(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        for (index, object) in self.objects.iter().enumerate() {
            let reach = best.map_or(FAR, |hit| hit.t);
            if let Some((t, point)) = object.body.hit(origin, direction, reach) {
                best = Some(Hit { t, point, material: object.material, object: Some(index) });
            }
        }
        for ground in &self.grounds {
            let reach = best.map_or(FAR, |hit| hit.t);
            if let Some(t) = ground.hit(origin, direction, reach) {
                let point = ground.at(origin + direction * t);
                best = Some(Hit { t, point, material: ground.material, object: None });
            }
        }
        best
    }

    /// Whether anything is on the way.
    pub(super) fn blocked(&self, origin: Vec3, direction: Vec3, distance: f32) -> bool {
        let reach = distance.min(FAR);
        self.grounds.iter().any(|g| g.hit(origin, direction, reach).is_some())
            || self.objects.iter().any(|o| o.body.blocks(origin, direction, reach))
    }
}

impl Ground {
    fn hit(&self, origin: Vec3, direction: Vec3, reach: f32) -> Option<f32> {
        let facing = self.normal.dot(direction);
        let t = (self.point - origin).dot(self.normal) / facing;
        (facing != 0.0 && t > 0.0 && t < reach).then_some(t)
    }

    fn at(&self, p: Vec3) -> SurfacePoint {
        // Exactly on the plane, whatever the distance did to the point.
        let p = p - self.normal * (p - self.point).dot(self.normal);
        let (x, y) = self.axes();
        let away = p - self.point;
        let uv = Vec2::new(away.dot(x), away.dot(y));
        SurfacePoint { p, n: self.normal, ng: self.normal, uv, dpdu: x, dpdv: y }
    }

    /// Along u and v: for a floor +x and −z.
    fn axes(&self) -> (Vec3, Vec3) {
        let aside = if self.normal.x.abs() > 0.9 { Vec3::Y } else { Vec3::X };
        let x = (aside - self.normal * self.normal.dot(aside)).normalize_or(Vec3::X);
        (x, self.normal.cross(x))
    }
}
