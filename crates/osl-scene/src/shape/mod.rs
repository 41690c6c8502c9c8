//! Analytic shapes: sphere, cylinder, torus, plane, cube; and the trait of everything that a ray can hit.
//!
//! Each shape is centred at the origin with y up. It maps the unit square of u and v to its points such that
//! the normal points along `dPdu × dPdv` and outwards; u increases to the right for a view along −z.

mod area;
mod hit;
mod solve;
mod tessellate;

use crate::math;
use crate::mesh::{Bounds, Bvh, SurfacePoint, Triangles};
use glam::{DVec2, DVec3, Mat4, Vec3};
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// An analytic shape. Lengths are positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A sphere. u is the longitude, from the back around the front (u = 1/2 is +z, u = 0 and 1 are −z); v
    /// runs from the lower pole to the upper.
    Sphere {
        /// Its radius.
        radius: f32,
    },
    /// A tube without ends: u runs around like that of the sphere, v from the lower border to the upper.
    Cylinder {
        /// Its radius.
        radius: f32,
        /// From border to border.
        height: f32,
    },
    /// A ring around the y axis: u runs around the ring like that of the sphere, v around the tube, with 1/2
    /// at the outside.
    Torus {
        /// From the centre to the middle of the tube.
        major: f32,
        /// Radius of the tube; less than `major`.
        minor: f32,
    },
    /// The plane y = 0, seen from above: u runs along x, v along −z, from 0 to 1 over the square around the
    /// origin.
    Plane {
        /// Side of the square.
        size: f32,
        /// Whether it ends at the square; otherwise it is infinite, and so are u and v.
        bounded: bool,
    },
    /// A cube: u and v run from 0 to 1 on each face, v upwards on the sides.
    Cube {
        /// Its side.
        size: f32,
    },
}

/// A surface that a ray can hit.
pub trait Surface: Sync {
    /// The nearest hit of a ray within a range of distances: distance and point. Distances are in units of
    /// the direction's length.
    fn hit(&self, origin: Vec3, direction: Vec3, range: Range<f32>) -> Option<(f32, SurfacePoint)>;

    /// Whether a ray hits it within a range of distances.
    fn blocks(&self, origin: Vec3, direction: Vec3, range: Range<f32>) -> bool {
        self.hit(origin, direction, range).is_some()
    }

    /// A box around it.
    fn bounds(&self) -> Bounds;

    /// The radius around the middle of the box; it may be slightly smaller.
    fn reach(&self) -> f32 {
        self.bounds().radius()
    }

    /// The area of its surface.
    fn area(&self) -> f32;
}

/// The directions of u and v on the faces of a cube.
const FACES: [[DVec3; 2]; 6] = [
    [DVec3::NEG_Z, DVec3::Y],
    [DVec3::Z, DVec3::Y],
    [DVec3::X, DVec3::NEG_Z],
    [DVec3::X, DVec3::Z],
    [DVec3::X, DVec3::Y],
    [DVec3::NEG_X, DVec3::Y],
];

/// A point with its tangents and normal, in double precision.
struct Exact {
    p: DVec3,
    dpdu: DVec3,
    dpdv: DVec3,
    n: DVec3,
}

impl Shape {
    /// The names of shapes, each with its default form: about two units wide.
    pub const NAMED: [(&'static str, Shape); 5] = [
        ("sphere", Shape::Sphere { radius: 1.0 }),
        ("cylinder", Shape::Cylinder { radius: 1.0, height: 2.0 }),
        ("torus", Shape::Torus { major: 1.0, minor: 0.4 }),
        ("plane", Shape::Plane { size: 2.0, bounded: true }),
        ("cube", Shape::Cube { size: 2.0 }),
    ];

    /// The shape with a name.
    pub fn named(name: &str) -> Option<Shape> {
        Shape::NAMED.iter().find(|(known, _)| *known == name).map(|(_, shape)| *shape)
    }

    /// The point at some coordinates; `face` matters only for the cube: +x, −x, +y, −y, +z, −z.
    pub fn point(&self, face: usize, uv: [f64; 2]) -> SurfacePoint {
        let Exact { p, dpdu, dpdv, n } = self.exact(face, uv);
        let n = n.as_vec3();
        let uv = DVec2::from(uv).as_vec2();
        SurfacePoint { p: p.as_vec3(), n, ng: n, uv, dpdu: dpdu.as_vec3(), dpdv: dpdv.as_vec3() }
    }

    fn exact(&self, face: usize, [u, v]: [f64; 2]) -> Exact {
        // A direction around the y axis, and its derivative with respect to u.
        let (sin, cos) = math::sin_cos(TAU * (u - 0.5));
        let (out, around) = (DVec3::new(sin, 0.0, cos), DVec3::new(cos, 0.0, -sin));
        match *self {
            Shape::Sphere { radius } => {
                let radius = f64::from(radius);
                let (sin, cos) = math::sin_cos(PI * (v - 0.5));
                let n = out * cos + DVec3::Y * sin;
                let dpdv = (DVec3::Y * cos - out * sin) * (PI * radius);
                Exact { p: n * radius, dpdu: around * (TAU * radius * cos), dpdv, n }
            }
            Shape::Cylinder { radius, height } => {
                let (radius, height) = (f64::from(radius), f64::from(height));
                let p = out * radius + DVec3::Y * (height * (v - 0.5));
                Exact { p, dpdu: around * (TAU * radius), dpdv: DVec3::Y * height, n: out }
            }
            Shape::Torus { major, minor } => {
                let (major, minor) = (f64::from(major), f64::from(minor));
                let (sin, cos) = math::sin_cos(TAU * (v - 0.5));
                let n = out * cos + DVec3::Y * sin;
                let dpdv = (DVec3::Y * cos - out * sin) * (TAU * minor);
                Exact { p: out * major + n * minor, dpdu: around * (TAU * (major + minor * cos)), dpdv, n }
            }
            Shape::Plane { size, .. } => {
                let size = f64::from(size);
                let (x, z) = (DVec3::X * size, DVec3::NEG_Z * size);
                Exact { p: x * (u - 0.5) + z * (v - 0.5), dpdu: x, dpdv: z, n: DVec3::Y }
            }
            Shape::Cube { size } => {
                let size = f64::from(size);
                let [along_u, along_v] = FACES[face % FACES.len()];
                let n = along_u.cross(along_v);
                let p = (along_u * (u - 0.5) + along_v * (v - 0.5) + n * 0.5) * size;
                Exact { p, dpdu: along_u * size, dpdv: along_v * size, n }
            }
        }
    }

    /// The number of faces with separate u and v.
    pub fn faces(&self) -> usize {
        if matches!(self, Shape::Cube { .. }) { FACES.len() } else { 1 }
    }
}

impl Surface for Shape {
    fn hit(&self, origin: Vec3, direction: Vec3, range: Range<f32>) -> Option<(f32, SurfacePoint)> {
        hit::nearest(self, origin.as_dvec3(), direction.as_dvec3(), range)
    }

    fn blocks(&self, origin: Vec3, direction: Vec3, range: Range<f32>) -> bool {
        hit::any(self, origin.as_dvec3(), direction.as_dvec3(), range)
    }

    fn bounds(&self) -> Bounds {
        let half = match *self {
            Shape::Sphere { radius } => Vec3::splat(radius),
            Shape::Cylinder { radius, height } => Vec3::new(radius, height * 0.5, radius),
            Shape::Torus { major, minor } => Vec3::new(major + minor, minor, major + minor),
            Shape::Plane { size, bounded } => {
                let side = if bounded { size * 0.5 } else { f32::MAX };
                Vec3::new(side, 0.0, side)
            }
            Shape::Cube { size } => Vec3::splat(size * 0.5),
        };
        Bounds { min: -half, max: half }
    }

    fn reach(&self) -> f32 {
        match *self {
            Shape::Sphere { radius } => radius,
            Shape::Cylinder { radius, height } => math::hypot(radius, height * 0.5),
            Shape::Torus { major, minor } => major + minor,
            Shape::Plane { .. } | Shape::Cube { .. } => self.bounds().radius(),
        }
    }

    fn area(&self) -> f32 {
        self.area_after(&Mat4::IDENTITY)
    }
}

/// Triangles with their tree for ray intersection.
pub struct Solid {
    /// The triangles.
    pub triangles: Triangles,
    /// The tree.
    pub bvh: Bvh,
    area: f32,
}

impl Solid {
    /// Builds the tree of the triangles.
    pub fn new(triangles: Triangles) -> Solid {
        let (bvh, area) = (Bvh::new(&triangles), triangles.area());
        Solid { triangles, bvh, area }
    }
}

impl Surface for Solid {
    fn hit(&self, origin: Vec3, direction: Vec3, range: Range<f32>) -> Option<(f32, SurfacePoint)> {
        let hit = self.bvh.hit(origin, direction, range)?;
        Some((hit.t, self.triangles.point(hit.triangle, hit.barycentric)))
    }

    fn bounds(&self) -> Bounds {
        self.triangles.bounds()
    }

    fn reach(&self) -> f32 {
        let center = self.bounds().center();
        self.triangles.positions.iter().map(|p| p.distance(center)).fold(0.0, f32::max)
    }

    fn area(&self) -> f32 {
        self.area
    }
}

/// A shape with a transformation.
pub struct Placed {
    surface: Shape,
    to_common: Mat4,
    from_common: Mat4,
    area: f32,
}

impl Placed {
    /// Transforms a shape by a matrix; `None` if the matrix is singular.
    pub fn new(surface: Shape, to_common: Mat4) -> Option<Placed> {
        let from_common = to_common.inverse();
        let sound = to_common.is_finite() && from_common.is_finite() && to_common.determinant() != 0.0;
        sound.then(|| Placed { surface, to_common, from_common, area: surface.area_after(&to_common) })
    }
}

impl Surface for Placed {
    fn hit(&self, origin: Vec3, direction: Vec3, range: Range<f32>) -> Option<(f32, SurfacePoint)> {
        // Distances are in units of the direction's length, so they are the same on both sides.
        let origin = self.from_common.transform_point3(origin);
        let direction = self.from_common.transform_vector3(direction);
        let (t, point) = self.surface.hit(origin, direction, range)?;
        Some((t, point.transform(&self.to_common, &self.from_common)))
    }

    fn blocks(&self, origin: Vec3, direction: Vec3, range: Range<f32>) -> bool {
        let origin = self.from_common.transform_point3(origin);
        self.surface.blocks(origin, self.from_common.transform_vector3(direction), range)
    }

    fn bounds(&self) -> Bounds {
        let Bounds { min, max } = self.surface.bounds();
        let corner = |i: u8| {
            let pick = |bit: u8, low: f32, high: f32| if i & bit == 0 { low } else { high };
            Vec3::new(pick(1, min.x, max.x), pick(2, min.y, max.y), pick(4, min.z, max.z))
        };
        Bounds::of((0..8).map(|i| self.to_common.transform_point3(corner(i))))
    }

    fn reach(&self) -> f32 {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| self.to_common.transform_vector3(axis).length());
        let stretch = axes.into_iter().fold(0.0, f32::max);
        (self.surface.reach() * stretch).min(self.bounds().radius())
    }

    fn area(&self) -> f32 {
        self.area
    }
}
