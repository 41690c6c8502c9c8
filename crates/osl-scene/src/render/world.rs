//! What there is to see, ready to be met by rays.

use crate::camera::View;
use crate::light::{Sky, SphereLight};
use crate::mesh::{Bvh, SurfacePoint, Triangles};
use glam::{Vec2, Vec3};
use osl_exec::{Program, Services};
use std::sync::Arc;

/// Triangles with what shades them.
pub struct Object {
    /// The triangles, in common space.
    pub mesh: Triangles,
    /// The same, sorted.
    pub bvh: Bvh,
    /// Which of the materials.
    pub material: usize,
}

impl Object {
    /// Sorts triangles.
    pub fn new(mesh: Triangles, material: usize) -> Object {
        let bvh = Bvh::new(&mesh);
        Object { mesh, bvh, material }
    }
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
    pub(super) on: On,
}

/// Where on what.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum On {
    Object { object: usize, triangle: usize, barycentric: [f32; 2] },
    Ground(usize),
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
        let reach = |best: &Option<Hit>| best.map_or(FAR, |hit| hit.t);
        for (index, object) in self.objects.iter().enumerate() {
            if let Some(hit) = object.bvh.hit(origin, direction, 0.0..reach(&best)) {
                let on = On::Object { object: index, triangle: hit.triangle, barycentric: hit.barycentric };
                best = Some(Hit { t: hit.t, on });
            }
        }
        for (index, ground) in self.grounds.iter().enumerate() {
            if let Some(t) = ground.hit(origin, direction, reach(&best)) {
                best = Some(Hit { t, on: On::Ground(index) });
            }
        }
        best
    }

    /// Whether anything is on the way.
    pub(super) fn blocked(&self, origin: Vec3, direction: Vec3, distance: f32) -> bool {
        let reach = distance.min(FAR);
        self.grounds.iter().any(|g| g.hit(origin, direction, reach).is_some())
            || self.objects.iter().any(|o| o.bvh.blocked(origin, direction, 0.0..reach))
    }

    /// What a shader is told about a hit, and which material it is of.
    pub(super) fn point(&self, hit: &Hit, origin: Vec3, direction: Vec3) -> Option<(SurfacePoint, usize)> {
        match hit.on {
            On::Object { object, triangle, barycentric } => {
                let object = self.objects.get(object)?;
                Some((object.mesh.point(triangle, barycentric), object.material))
            }
            On::Ground(index) => {
                let ground = self.grounds.get(index)?;
                Some((ground.at(origin + direction * hit.t), ground.material))
            }
        }
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
