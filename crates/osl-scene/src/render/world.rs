//! The scene in the form that rays traverse.

use crate::camera::View;
use crate::data::Data;
use crate::lens::Lens;
use crate::light::{Sky, SphereLight};
use crate::mesh::{Bounds, SurfacePoint};
use crate::shape::{Placed, Solid, Surface};
#[cfg(doc)]
use crate::surface_points::SurfacePoints;
use glam::{Vec2, Vec3};
use osl_exec::{Program, RunError, Services};
use osl_limits::Limits;
use std::ops::Range;
use std::sync::Arc;

/// A surface that rays can hit.
pub enum Body {
    /// Triangles, in common space.
    Solid(Solid),
    /// A shape with a formula.
    Shape(Placed),
}

impl Body {
    /// The nearest point within reach, and its distance.
    pub(super) fn nearest(&self, origin: Vec3, direction: Vec3, reach: f32) -> Option<(f32, SurfacePoint)> {
        self.hit(origin, direction, 0.0..reach)
    }

    /// Whether it is hit within reach.
    fn obstructs(&self, origin: Vec3, direction: Vec3, reach: f32) -> bool {
        match self {
            Body::Solid(solid) => solid.bvh.blocked(origin, direction, 0.0..reach),
            Body::Shape(shape) => shape.blocks(origin, direction, 0.0..reach),
        }
    }

    /// The number of triangles.
    pub fn triangles(&self) -> usize {
        match self {
            Body::Solid(solid) => solid.triangles.indices.len(),
            Body::Shape(_) => 0,
        }
    }
}

impl Surface for Body {
    fn hit(&self, origin: Vec3, direction: Vec3, range: Range<f32>) -> Option<(f32, SurfacePoint)> {
        match self {
            Body::Solid(solid) => solid.hit(origin, direction, range),
            Body::Shape(shape) => shape.hit(origin, direction, range),
        }
    }

    fn bounds(&self) -> Bounds {
        match self {
            Body::Solid(solid) => solid.bounds(),
            Body::Shape(shape) => shape.bounds(),
        }
    }

    fn reach(&self) -> f32 {
        match self {
            Body::Solid(solid) => solid.reach(),
            Body::Shape(shape) => shape.reach(),
        }
    }

    fn area(&self) -> f32 {
        match self {
            Body::Solid(solid) => solid.area(),
            Body::Shape(shape) => shape.area(),
        }
    }
}

/// A surface with its material.
pub struct Object {
    /// Its shape.
    pub body: Body,
    /// Index of its material.
    pub material: usize,
}

/// An infinite plane with its material. Its coordinates are lengths along two axes.
#[derive(Clone, Copy, Debug)]
pub struct Ground {
    /// A point of it, where u and v are 0.
    pub point: Vec3,
    /// Its normal, of length 1.
    pub normal: Vec3,
    /// Index of its material.
    pub material: usize,
}

/// The shaders of a surface.
#[derive(Debug)]
pub struct Material {
    /// Computes the closure and all other outputs, for surfaces that the camera sees.
    pub program: Program,
    /// Computes only the closure, or the color in its place, for all other rays.
    pub lean: Program,
    /// The services of both programs.
    pub services: Services,
    /// The output that is rendered as a matt color if there is no closure.
    pub color: Option<Arc<str>>,
    /// The factor and the offset of u and v, as for [`SurfacePoints::stretch`]; `None` leaves them.
    pub stretch: Option<[Vec2; 2]>,
    /// The output whose color is the part of the surface that lets the light behind it through.
    pub through: Option<Arc<str>>,
    /// Data of the points.
    pub data: Data,
}

/// Everything needed to render a picture.
pub struct World {
    /// The camera.
    pub view: View,
    /// The shader that makes the camera's rays, if there is one.
    pub lens: Option<Lens>,
    /// Objects.
    pub objects: Vec<Object>,
    /// Planes.
    pub grounds: Vec<Ground>,
    /// Their materials.
    pub materials: Vec<Material>,
    /// Lights.
    pub lights: Vec<SphereLight>,
    /// Light from all directions.
    pub sky: Option<Sky>,
    /// Whether the camera sees the sky.
    pub background: bool,
    /// Maximum number of diffuse reflections before light reaches the visible surface.
    pub diffuse_depth: u32,
    /// The same for mirrors and glossy reflections.
    pub glossy_depth: u32,
    /// What shaders and the picture may cost.
    pub limits: Limits,
}

/// A surface hit by a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    pub(super) t: f32,
    pub(super) point: SurfacePoint,
    pub(super) material: usize,
    /// Index of the object; `None` for a plane.
    pub(super) object: Option<usize>,
}

/// Beyond any distance.
const FAR: f32 = 1e30;

/// The start of a ray that leaves a surface point: slightly off the surface, on the side of its direction, so
/// that rounding does not make it hit the surface again.
pub(super) fn leave(p: Vec3, ng: Vec3, direction: Vec3) -> Vec3 {
    let step = 2e-5 * p.abs().max_element().max(1e-2);
    p + ng * if ng.dot(direction) < 0.0 { -step } else { step }
}

impl World {
    /// Fails once the command has to stop.
    pub(super) fn goes_on(&self) -> Result<(), RunError> {
        self.limits.halted().map_or(Ok(()), |why| Err(RunError::Halted(why)))
    }

    /// The nearest surface along a ray, within reach.
    pub(super) fn hit(&self, origin: Vec3, direction: Vec3, reach: f32) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let far = reach.min(FAR);
        for (index, object) in self.objects.iter().enumerate() {
            let reach = best.map_or(far, |hit| hit.t);
            if let Some((t, point)) = object.body.nearest(origin, direction, reach) {
                best = Some(Hit { t, point, material: object.material, object: Some(index) });
            }
        }
        for ground in &self.grounds {
            let reach = best.map_or(far, |hit| hit.t);
            if let Some(t) = ground.hit(origin, direction, reach) {
                let point = ground.at(origin + direction * t);
                best = Some(Hit { t, point, material: ground.material, object: None });
            }
        }
        best
    }

    /// The area of an object's surface; infinite for a plane.
    pub(super) fn area(&self, object: Option<usize>) -> f32 {
        object.and_then(|index| self.objects.get(index)).map_or(f32::INFINITY, |object| object.body.area())
    }

    /// Whether anything obstructs a ray.
    pub(super) fn blocked(&self, origin: Vec3, direction: Vec3, distance: f32) -> bool {
        let reach = distance.min(FAR);
        self.grounds.iter().any(|g| g.hit(origin, direction, reach).is_some())
            || self.objects.iter().any(|o| o.body.obstructs(origin, direction, reach))
    }
}

impl Ground {
    fn hit(&self, origin: Vec3, direction: Vec3, reach: f32) -> Option<f32> {
        let facing = self.normal.dot(direction);
        let t = (self.point - origin).dot(self.normal) / facing;
        (facing != 0.0 && t > 0.0 && t < reach).then_some(t)
    }

    fn at(&self, p: Vec3) -> SurfacePoint {
        // Moves the point exactly onto the plane, regardless of rounding in the distance.
        let p = p - self.normal * (p - self.point).dot(self.normal);
        let (x, y) = self.axes();
        let away = p - self.point;
        let uv = Vec2::new(away.dot(x), away.dot(y));
        SurfacePoint { p, n: self.normal, ng: self.normal, uv, dpdu: x, dpdv: y }
    }

    /// The directions of u and v: +x and −z for a floor.
    fn axes(&self) -> (Vec3, Vec3) {
        let aside = if self.normal.x.abs() > 0.9 { Vec3::Y } else { Vec3::X };
        let x = (aside - self.normal * self.normal.dot(aside)).normalize_or(Vec3::X);
        (x, self.normal.cross(x))
    }
}
