//! Spheres and quads: ray intersection, shading data of a hit, and sampling of light from them.

use super::camera::Ray;
use crate::bsdf::Frame;
use crate::math::positive;
use crate::mesh::SurfacePoint;
use crate::surface_points::Footprint;
use glam::{Vec2, Vec3};
use osl_numeric::strict::{acos, atan2, sincos};
use std::f32::consts::{PI, TAU};

/// The geometry of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// A sphere.
    Sphere {
        /// Its center.
        center: Vec3,
        /// Its radius.
        radius: f32,
    },
    /// A parallelogram.
    Quad {
        /// Its first corner.
        corner: Vec3,
        /// From there to the next corner along u.
        edge_x: Vec3,
        /// From there to the next corner along v.
        edge_y: Vec3,
    },
}

/// A shape of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Its form.
    pub form: Form,
    /// The index of its shader group.
    pub group: Option<usize>,
    /// Whether it is sampled as a light.
    pub is_light: bool,
}

/// A point on a shape as a ray sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The point; its normals point outwards.
    pub on: SurfacePoint,
    /// The ray's direction.
    pub incident: Vec3,
    /// The changes to its neighbours.
    pub footprint: Footprint,
    /// The surface area that a shader sees.
    pub area: f32,
}

/// A direction to a light and its probability density by solid angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToLight {
    /// The direction, of length 1.
    pub direction: Vec3,
    /// The density.
    pub pdf: f32,
}

impl Form {
    /// The distance at which a ray hits it. `from_itself` means that the ray starts on it.
    pub fn hit(&self, ray: &Ray, from_itself: bool) -> Option<f32> {
        match self {
            Form::Sphere { center, radius } => {
                let to_center = *center - ray.origin;
                let b = to_center.dot(ray.direction);
                let discriminant = b * b - to_center.length_squared() + radius * radius;
                if discriminant < 0.0 || discriminant.is_nan() {
                    return None;
                }
                let half = discriminant.sqrt();
                let (near, far) = (b - half, b + half);
                let found = match from_itself {
                    // The root near 0 is the start of the ray.
                    true if near.abs() > far.abs() => near,
                    true => far,
                    false if near > 0.0 => near,
                    false => far,
                };
                (found > 0.0).then_some(found)
            }
            Form::Quad { .. } if from_itself => None,
            Form::Quad { corner, edge_x, edge_y } => {
                let n = self.quad_normal();
                let facing = ray.direction.dot(n);
                let t = (*corner - ray.origin).dot(n) / facing;
                if facing == 0.0 || !positive(t) {
                    return None;
                }
                let away = ray.origin + ray.direction * t - *corner;
                let inside = |edge: &Vec3| (0.0..1.0).contains(&(away.dot(*edge) / edge.length_squared()));
                (inside(edge_x) && inside(edge_y)).then_some(t)
            }
        }
    }

    fn quad_normal(&self) -> Vec3 {
        match self {
            Form::Quad { edge_x, edge_y, .. } => edge_x.cross(*edge_y).normalize_or_zero(),
            Form::Sphere { .. } => Vec3::ZERO,
        }
    }

    /// The point at which a ray hits it.
    pub fn point(&self, ray: &Ray, distance: f32) -> Point {
        let p = ray.origin + ray.direction * distance;
        // Measured: on a sphere, the derivatives of u have the opposite sign.
        let (n, uv, [dpdu, dpdv], area, sign) = match self {
            Form::Sphere { center, radius } => {
                let n = ((p - *center) * (1.0 / radius)).normalize_or_zero();
                let uv = Vec2::new((atan2(n.x, n.z) + PI) * (1.0 / TAU), acos(n.y) * (1.0 / PI));
                let ((sin_u, cos_u), (sin_v, cos_v)) = (sincos(TAU * uv.x), sincos(PI * uv.y));
                let dpdu = Vec3::new(-cos_u * sin_v, 0.0, sin_u * sin_v) * (TAU * radius);
                let dpdv = Vec3::new(-sin_u * cos_v, -sin_v, -cos_u * cos_v) * (PI * radius);
                (n, uv, [dpdu, dpdv], PI * radius * radius, -1.0)
            }
            Form::Quad { corner, edge_x, edge_y } => {
                let along = |edge: &Vec3| (p - *corner).dot(*edge) * (1.0 / edge.length_squared());
                let uv = Vec2::new(along(edge_x), along(edge_y));
                (self.quad_normal(), uv, [*edge_x, *edge_y], edge_x.cross(*edge_y).length(), 1.0)
            }
        };
        let mut footprint = ray.footprint(distance);
        let along = |way: Vec3, d: Vec3| {
            let change = way.dot(d) / d.length_squared();
            if change.is_finite() { change } else { 0.0 }
        };
        footprint.uv = footprint.p.map(|way| Vec2::new(sign * along(way, dpdu), along(way, dpdv)));
        let on = SurfacePoint { p, n, ng: n, uv, dpdu, dpdv };
        Point { on, incident: ray.direction, footprint, area }
    }

    /// The cosine of the angular radius of a sphere as seen from a point.
    fn cone(center: Vec3, radius: f32, from: Vec3) -> f32 {
        (1.0 - radius * radius / (center - from).length_squared()).max(0.0).sqrt()
    }

    /// The density with which [`Form::sample`] chooses the direction from one point to another on the shape.
    pub fn pdf(&self, from: Vec3, on: Vec3) -> f32 {
        match self {
            Form::Sphere { center, radius } => 1.0 / (TAU * (1.0 - Form::cone(*center, *radius, from))),
            Form::Quad { .. } => self.quad_pdf(on - from),
        }
    }

    fn quad_pdf(&self, way: Vec3) -> f32 {
        let Form::Quad { edge_x, edge_y, .. } = self else { return 0.0 };
        let area = edge_x.cross(*edge_y).length();
        let facing = way.normalize_or_zero().dot(self.quad_normal()).abs();
        way.length_squared() / (area * facing)
    }

    /// Samples a direction from a point to the shape with two numbers from 0 to 1.
    pub fn sample(&self, from: Vec3, [xi, yi]: [f32; 2]) -> ToLight {
        match self {
            Form::Sphere { center, radius } => {
                let axis = (*center - from).normalize_or_zero();
                let Frame { x, y, .. } = Frame::around(axis);
                let limit = Form::cone(*center, *radius, from);
                let cos = 1.0 - xi + xi * limit;
                let sin = (1.0 - cos * cos).max(0.0).sqrt();
                let (sin_phi, cos_phi) = sincos(TAU * yi);
                let direction = x * (cos_phi * sin) + y * (sin_phi * sin) + axis * cos;
                ToLight { direction: direction.normalize_or_zero(), pdf: 1.0 / (TAU * (1.0 - limit)) }
            }
            Form::Quad { corner, edge_x, edge_y } => {
                let way = *corner + *edge_x * xi + *edge_y * yi - from;
                ToLight { direction: way.normalize_or_zero(), pdf: self.quad_pdf(way) }
            }
        }
    }
}

/// The nearest shape that a ray hits, and its distance; the first of several at the same distance. `from` is
/// the shape on which the ray starts.
pub fn nearest(shapes: &[Shape], ray: &Ray, from: Option<usize>) -> Option<(usize, f32)> {
    let mut best: Option<(usize, f32)> = None;
    for (index, shape) in shapes.iter().enumerate() {
        if let Some(t) = shape.form.hit(ray, from == Some(index))
            && best.is_none_or(|(_, nearest)| t < nearest)
        {
            best = Some((index, t));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPHERE: Form = Form::Sphere { center: Vec3::new(1.0, 2.0, -5.0), radius: 2.0 };
    const QUAD: Form =
        Form::Quad { corner: Vec3::new(-1.0, -1.0, -3.0), edge_x: Vec3::new(2.0, 0.0, 0.0), edge_y: Vec3::Y };

    fn ray(origin: Vec3, direction: Vec3) -> Ray {
        Ray { origin, direction: direction.normalize(), radius: 0.1, spread: 0.02 }
    }

    #[test]
    fn hits_of_a_sphere() {
        let from_outside = ray(Vec3::new(1.0, 2.0, 0.0), Vec3::NEG_Z);
        assert_eq!(SPHERE.hit(&from_outside, false), Some(3.0));
        assert_eq!(SPHERE.hit(&ray(Vec3::new(1.0, 2.0, -5.0), Vec3::Y), false), Some(2.0), "from inside");
        let on_it = Vec3::new(1.0, 2.0, -3.0);
        assert_eq!(SPHERE.hit(&ray(on_it, Vec3::NEG_Z), true), Some(4.0), "through it");
        assert_eq!(SPHERE.hit(&ray(on_it, Vec3::Z), true), None, "away from it");
        assert_eq!(SPHERE.hit(&ray(Vec3::ZERO, Vec3::Z), false), None);
    }

    #[test]
    fn hits_of_a_quad() {
        assert_eq!(QUAD.hit(&ray(Vec3::new(0.0, -0.5, 0.0), Vec3::NEG_Z), false), Some(3.0));
        assert_eq!(QUAD.hit(&ray(Vec3::new(0.0, -0.5, 0.0), Vec3::NEG_Z), true), None);
        assert_eq!(QUAD.hit(&ray(Vec3::new(0.0, 0.1, 0.0), Vec3::NEG_Z), false), None);
        assert_eq!(QUAD.hit(&ray(Vec3::new(0.0, -0.5, 0.0), Vec3::X), false), None);
    }

    #[test]
    fn slopes_of_coordinates_are_those_of_neighbouring_points() {
        for form in [SPHERE, QUAD] {
            let ray = ray(Vec3::new(0.0, -0.3, 0.0), Vec3::new(0.1, 0.05, -1.0));
            let ray = if form == SPHERE {
                Ray { direction: Vec3::new(0.1, 0.5, -1.0).normalize(), ..ray }
            } else {
                ray
            };
            let t = form.hit(&ray, false).expect("a hit");
            let here = form.point(&ray, t);
            // dP = dPdu du + dPdv dv, for the component of dP on the surface.
            let (on, footprint) = (here.on, here.footprint);
            for axis in 0..2 {
                let flat = footprint.p[axis] - on.n * footprint.p[axis].dot(on.n);
                let sign = if form == SPHERE { -1.0 } else { 1.0 };
                let uv = footprint.uv[axis];
                let by_uv = on.dpdu * (sign * uv.x) + on.dpdv * uv.y;
                assert!(flat.distance(by_uv) < 2e-2 * flat.length(), "{form:?} {flat} {by_uv}");
            }
        }
    }

    #[test]
    fn sampled_directions_hit_the_light_with_their_density() {
        for form in [SPHERE, QUAD] {
            for k in 0..64 {
                let u = [(k % 8) as f32 / 8.0 + 0.05, (k / 8) as f32 / 8.0 + 0.05];
                let from = Vec3::new(0.3, -0.2, 1.0);
                let found = form.sample(from, u);
                let t = form.hit(&ray(from, found.direction), false).expect("a hit");
                let pdf = form.pdf(from, from + found.direction * t);
                assert!((pdf / found.pdf - 1.0).abs() < 1e-3, "{form:?} {pdf} {}", found.pdf);
            }
        }
    }
}
