//! Spheres, quads and meshes: ray intersection, shading data of a hit, and sampling of light from them.

use super::background::find;
use super::camera::Ray;
use crate::bsdf::Frame;
use crate::math::positive;
use crate::mesh::{Mesh, MeshHit, SurfacePoint, Triangles};
use crate::shape::{Solid, Surface};
use crate::surface_points::{Footprint, uv_change};
use glam::{Vec2, Vec3};
use osl_numeric::strict::{acos, atan2, sincos};
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

/// Triangles, with the running sums of their areas from 0 to 1, by which light from them is sampled.
pub struct Model {
    solid: Solid,
    sums: Vec<f32>,
}

impl Model {
    /// Prepares triangles for rays.
    pub fn new(triangles: Triangles) -> Model {
        let area = |at: usize| {
            let [a, b, c] = triangles.corners(at);
            (b - a).cross(c - a).length()
        };
        let mut sums: Vec<f32> = (0..triangles.indices.len())
            .scan(0.0_f64, |sum, at| {
                *sum += f64::from(area(at));
                Some(*sum as f32)
            })
            .collect();
        let whole = sums.last().copied().unwrap_or(0.0).max(f32::MIN_POSITIVE);
        sums.iter_mut().for_each(|sum| *sum /= whole);
        Model { solid: Solid::new(triangles), sums }
    }
}

/// The geometry of a shape.
#[derive(Clone)]
pub enum Form {
    /// A mesh of triangles.
    Mesh(Arc<Model>),
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
#[derive(Clone)]
pub struct Shape {
    /// Its form.
    pub form: Form,
    /// The index of its shader group.
    pub group: Option<usize>,
    /// Whether it is sampled as a light.
    pub is_light: bool,
    /// Rows of faces in its place if a displacement moves it.
    pub resolution: u32,
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
    /// The triangle that was chosen; 0 for other forms.
    pub triangle: usize,
}

/// The density by solid angle of a point that is chosen by area.
fn area_pdf(way: Vec3, area: f32, normal: Vec3) -> f32 {
    let facing = way.normalize_or_zero().dot(normal).abs();
    way.length_squared() / (area * facing)
}

impl Form {
    /// The place at which a ray hits it. `from` is the triangle on which the ray starts if it starts on this
    /// shape; forms without triangles count as one.
    pub fn hit(&self, ray: &Ray, from: Option<usize>) -> Option<MeshHit> {
        if let Form::Mesh(model) = self {
            let hit = |start| model.solid.bvh.hit(ray.origin, ray.direction, start..f32::INFINITY);
            let found = hit(0.0)?;
            return if from == Some(found.triangle) { hit(found.t.next_up()) } else { Some(found) };
        }
        self.distance(ray, from.is_some()).map(|t| MeshHit { t, triangle: 0, barycentric: [0.0; 2] })
    }

    fn distance(&self, ray: &Ray, from_itself: bool) -> Option<f32> {
        match self {
            Form::Mesh(_) => None,
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

    /// A mesh in place of a sphere or quad, with this many rows of faces, that a displacement can move.
    pub fn mesh(&self, resolution: u32) -> Option<Mesh> {
        let round = matches!(self, Form::Sphere { .. });
        let rows = resolution.max(if round { 2 } else { 1 });
        let columns = if round { 2 * rows } else { rows };
        let position = |u: f32, v: f32| match self {
            Form::Sphere { center, radius } => {
                let ((sin_u, cos_u), (sin_v, cos_v)) = (sincos(TAU * u), sincos(PI * v));
                Some(*center + Vec3::new(-sin_u * sin_v, cos_v, -cos_u * sin_v) * *radius)
            }
            Form::Quad { corner, edge_x, edge_y } => Some(*corner + *edge_x * u + *edge_y * v),
            Form::Mesh(_) => None,
        };
        // On a sphere, a pole is one vertex, and so are both ends of a row.
        let own = |x: u32, y: u32| y * (columns + 1) + x;
        let vertex = |x: u32, y: u32| match (round, y) {
            (true, 0) => own(0, 0),
            (true, _) if y == rows => own(0, rows),
            (true, _) => own(x % columns, y),
            (false, _) => own(x, y),
        };
        let mut mesh = Mesh::default();
        for (y, x) in (0..=rows).flat_map(|y| (0..=columns).map(move |x| (y, x))) {
            let (u, v) = (x as f32 / columns as f32, y as f32 / rows as f32);
            mesh.positions.push(position(u, v)?);
            mesh.uvs.push(Vec2::new(u, v));
            if x == columns || y == rows {
                continue;
            }
            let mut face = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
            if round {
                // From outside, v runs to the left of u.
                face.reverse();
            }
            let first = mesh.corners.len();
            for (x, y) in face {
                if !mesh.corners.get(first..).is_some_and(|own| own.contains(&vertex(x, y))) {
                    mesh.corners.push(vertex(x, y));
                    mesh.uv_corners.push(own(x, y));
                }
            }
            mesh.face_sizes.push((mesh.corners.len() - first) as u32);
        }
        Some(mesh)
    }

    fn quad_normal(&self) -> Vec3 {
        match self {
            Form::Quad { edge_x, edge_y, .. } => edge_x.cross(*edge_y).normalize_or_zero(),
            Form::Sphere { .. } | Form::Mesh(_) => Vec3::ZERO,
        }
    }

    /// The point at which a ray hits it.
    pub fn point(&self, ray: &Ray, hit: &MeshHit) -> Point {
        let mut footprint = ray.footprint(hit.t);
        let p = ray.origin + ray.direction * hit.t;
        // Measured: on a sphere, the derivatives of u have the opposite sign.
        let (n, uv, [dpdu, dpdv], area, sign) = match self {
            Form::Mesh(model) => {
                let on = model.solid.triangles.point(hit.triangle, hit.barycentric);
                footprint.uv = footprint.p.map(|way| uv_change(&on, way));
                return Point { on, incident: ray.direction, footprint, area: model.solid.area() };
            }
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
    pub fn pdf(&self, from: Vec3, on: &SurfacePoint) -> f32 {
        match self {
            Form::Sphere { center, radius } => 1.0 / (TAU * (1.0 - Form::cone(*center, *radius, from))),
            Form::Quad { edge_x, edge_y, .. } => {
                area_pdf(on.p - from, edge_x.cross(*edge_y).length(), self.quad_normal())
            }
            Form::Mesh(model) => area_pdf(on.p - from, model.solid.area(), on.ng),
        }
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
                let pdf = 1.0 / (TAU * (1.0 - limit));
                ToLight { direction: direction.normalize_or_zero(), pdf, triangle: 0 }
            }
            Form::Quad { corner, edge_x, edge_y } => {
                let way = *corner + *edge_x * xi + *edge_y * yi - from;
                let pdf = area_pdf(way, edge_x.cross(*edge_y).length(), self.quad_normal());
                ToLight { direction: way.normalize_or_zero(), pdf, triangle: 0 }
            }
            Form::Mesh(model) => {
                let (triangle, inside) = find(&model.sums, xi);
                let side = inside.sqrt();
                let on = model.solid.triangles.point(triangle, [side * (1.0 - yi), side * yi]);
                let way = on.p - from;
                let pdf = area_pdf(way, model.solid.area(), on.ng);
                ToLight { direction: way.normalize_or_zero(), pdf, triangle }
            }
        }
    }
}

/// The nearest shape that a ray hits, and where; the first of several at the same distance. `from` is the
/// shape on which the ray starts, with the triangle.
pub fn nearest(shapes: &[Shape], ray: &Ray, from: Option<(usize, usize)>) -> Option<(usize, MeshHit)> {
    let mut best: Option<(usize, MeshHit)> = None;
    for (index, shape) in shapes.iter().enumerate() {
        let own = from.filter(|(shape, _)| *shape == index).map(|(_, triangle)| triangle);
        if let Some(hit) = shape.form.hit(ray, own)
            && best.is_none_or(|(_, nearest)| hit.t < nearest.t)
        {
            best = Some((index, hit));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subdivide::{Detail, Scheme, tessellate};

    const SPHERE: Form = Form::Sphere { center: Vec3::new(1.0, 2.0, -5.0), radius: 2.0 };
    const QUAD: Form =
        Form::Quad { corner: Vec3::new(-1.0, -1.0, -3.0), edge_x: Vec3::new(2.0, 0.0, 0.0), edge_y: Vec3::Y };

    fn t(form: &Form, ray: &Ray, from_itself: bool) -> Option<f32> {
        form.hit(ray, from_itself.then_some(0)).map(|hit| hit.t)
    }

    /// A cube behind the origin.
    fn block() -> Form {
        let text = "v -1 -1 -4\nv 1 -1 -4\nv 1 1 -4\nv -1 1 -4\nv -1 -1 -6\nv 1 -1 -6\nv 1 1 -6\nv -1 1 -6\n\
                    f 1 2 3 4\nf 6 5 8 7\nf 2 6 7 3\nf 5 1 4 8\nf 4 3 7 8\nf 5 6 2 1\n";
        let mesh = crate::mesh::read_obj(text).expect("a mesh");
        let found = tessellate(&mesh, Scheme::Linear, &Detail::Level(0)).expect("triangles");
        Form::Mesh(Arc::new(Model::new(found.triangles)))
    }

    #[test]
    fn meshes_are_in_the_place_of_their_shapes() {
        for (form, area) in [(SPHERE, 4.0 * PI * 4.0), (QUAD, 2.0)] {
            let mesh = form.mesh(64).expect("a mesh");
            let triangles =
                tessellate(&mesh, Scheme::Linear, &Detail::Level(0)).expect("triangles").triangles;
            assert!((triangles.area() / area - 1.0).abs() < 2e-3, "{}", triangles.area());
            let solid = Form::Mesh(Arc::new(Model::new(triangles)));
            let ray =
                ray(Vec3::new(0.1, -0.3, 0.0), Vec3::new(0.2, if area > 3.0 { 0.5 } else { 0.0 }, -1.0));
            let (here, there) = (form.hit(&ray, None).expect("a hit"), solid.hit(&ray, None).expect("a hit"));
            let (here, there) = (form.point(&ray, &here).on, solid.point(&ray, &there).on);
            assert!(here.p.distance(there.p) < 1e-2 && here.uv.distance(there.uv) < 1e-2, "{there:?}");
            assert!(here.ng.distance(there.ng) < 0.1 && here.dpdu.distance(there.dpdu) < 0.7, "{there:?}");
        }
    }

    #[test]
    fn rays_leave_the_triangle_on_which_they_start() {
        let form = block();
        let from_outside = ray(Vec3::new(0.2, 0.1, 0.0), Vec3::NEG_Z);
        let front = form.hit(&from_outside, None).expect("the front");
        assert_eq!(front.t, 4.0);
        let on_it = ray(Vec3::new(0.2, 0.1, -4.0), Vec3::NEG_Z);
        assert_eq!(form.hit(&on_it, Some(front.triangle)).expect("the back").t, 2.0);
        assert!(form.hit(&ray(on_it.origin, Vec3::Z), Some(front.triangle)).is_none());
    }

    fn ray(origin: Vec3, direction: Vec3) -> Ray {
        Ray { origin, direction: direction.normalize(), radius: 0.1, spread: 0.02 }
    }

    #[test]
    fn hits_of_a_sphere() {
        let from_outside = ray(Vec3::new(1.0, 2.0, 0.0), Vec3::NEG_Z);
        assert_eq!(t(&SPHERE, &from_outside, false), Some(3.0));
        assert_eq!(t(&SPHERE, &ray(Vec3::new(1.0, 2.0, -5.0), Vec3::Y), false), Some(2.0), "from inside");
        let on_it = Vec3::new(1.0, 2.0, -3.0);
        assert_eq!(t(&SPHERE, &ray(on_it, Vec3::NEG_Z), true), Some(4.0), "through it");
        assert_eq!(t(&SPHERE, &ray(on_it, Vec3::Z), true), None, "away from it");
        assert_eq!(t(&SPHERE, &ray(Vec3::ZERO, Vec3::Z), false), None);
    }

    #[test]
    fn hits_of_a_quad() {
        assert_eq!(t(&QUAD, &ray(Vec3::new(0.0, -0.5, 0.0), Vec3::NEG_Z), false), Some(3.0));
        assert_eq!(t(&QUAD, &ray(Vec3::new(0.0, -0.5, 0.0), Vec3::NEG_Z), true), None);
        assert_eq!(t(&QUAD, &ray(Vec3::new(0.0, 0.1, 0.0), Vec3::NEG_Z), false), None);
        assert_eq!(t(&QUAD, &ray(Vec3::new(0.0, -0.5, 0.0), Vec3::X), false), None);
    }

    #[test]
    fn slopes_of_coordinates_are_those_of_neighbouring_points() {
        for (form, is_sphere) in [(SPHERE, true), (QUAD, false)] {
            let ray = ray(Vec3::new(0.0, -0.3, 0.0), Vec3::new(0.1, 0.05, -1.0));
            let ray =
                if is_sphere { Ray { direction: Vec3::new(0.1, 0.5, -1.0).normalize(), ..ray } } else { ray };
            let here = form.point(&ray, &form.hit(&ray, None).expect("a hit"));
            // dP = dPdu du + dPdv dv, for the component of dP on the surface.
            let (on, footprint) = (here.on, here.footprint);
            for axis in 0..2 {
                let flat = footprint.p[axis] - on.n * footprint.p[axis].dot(on.n);
                let sign = if is_sphere { -1.0 } else { 1.0 };
                let uv = footprint.uv[axis];
                let by_uv = on.dpdu * (sign * uv.x) + on.dpdv * uv.y;
                assert!(flat.distance(by_uv) < 2e-2 * flat.length(), "{is_sphere} {flat} {by_uv}");
            }
        }
    }

    #[test]
    fn sampled_directions_hit_the_light_with_their_density() {
        for form in [SPHERE, QUAD, block()] {
            for k in 0..64 {
                let u = [(k % 8) as f32 / 8.0 + 0.05, (k / 8) as f32 / 8.0 + 0.05];
                let from = Vec3::new(0.3, -0.2, 1.0);
                let found = form.sample(from, u);
                let ray = ray(from, found.direction);
                let hit = form.hit(&ray, None).expect("a hit");
                if hit.triangle != found.triangle {
                    continue; // Another triangle hides the chosen one.
                }
                let pdf = form.pdf(from, &form.point(&ray, &hit).on);
                assert!((pdf / found.pdf - 1.0).abs() < 1e-3, "{pdf} {}", found.pdf);
            }
        }
    }
}
