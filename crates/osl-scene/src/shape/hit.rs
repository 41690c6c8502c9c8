//! Intersects rays with analytic shapes.

use super::solve::roots;
use super::{FACES, Shape};
use crate::math;
use crate::mesh::SurfacePoint;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// A candidate hit: its distance, the face, and u and v.
type Candidate = (f64, usize, [f64; 2]);

/// Takes candidates: the distance along the line, the face, and the coordinates.
type Offer<'a> = &'a mut dyn FnMut(f64, usize, &dyn Fn() -> [f64; 2]);

/// The nearest hit within a range of distances.
pub(super) fn nearest(
    shape: &Shape,
    origin: DVec3,
    direction: DVec3,
    range: Range<f32>,
) -> Option<(f32, SurfacePoint)> {
    let (t, face, uv) = candidate(shape, origin, direction, range)?;
    Some((t as f32, shape.point(face, uv)))
}

/// Whether there is a hit within a range of distances.
pub(super) fn any(shape: &Shape, origin: DVec3, direction: DVec3, range: Range<f32>) -> bool {
    candidate(shape, origin, direction, range).is_some()
}

fn candidate(shape: &Shape, origin: DVec3, direction: DVec3, range: Range<f32>) -> Option<Candidate> {
    let length = direction.length();
    if !(length > 0.0 && length.is_finite() && origin.is_finite()) {
        return None;
    }
    let mut best: Option<Candidate> = None;
    // Computed from the ray's closest point to the centre, numbers are as small as the shape.
    let along = direction / length;
    let shift = -origin.dot(along);
    let ray = Line { start: origin + along * shift, along };
    // Coordinates of candidates that are farther or out of range are not needed.
    let mut offer = |s: f64, face: usize, uv: &dyn Fn() -> [f64; 2]| {
        let t = (s + shift) / length;
        let inside = t >= f64::from(range.start) && t < f64::from(range.end);
        if inside && best.is_none_or(|(nearest, ..)| t < nearest) {
            best = Some((t, face, uv()));
        }
    };
    match *shape {
        Shape::Sphere { radius } => sphere(&ray, f64::from(radius), &mut offer),
        Shape::Cylinder { radius, height } => {
            cylinder(&ray, f64::from(radius), f64::from(height), &mut offer);
        }
        Shape::Torus { major, minor } => torus(&ray, f64::from(major), f64::from(minor), &mut offer),
        Shape::Plane { size, bounded } => plane(&ray, f64::from(size), bounded, &mut offer),
        Shape::Cube { size } => cube(&ray, f64::from(size), &mut offer),
    }
    best
}

/// A ray that starts at its closest point to the centre; the direction has length 1.
struct Line {
    start: DVec3,
    along: DVec3,
}

impl Line {
    fn at(&self, s: f64) -> DVec3 {
        self.start + self.along * s
    }
}

/// The angle around the y axis as a fraction of a turn; 0 and 1 are at the back.
fn turn(p: DVec3) -> f64 {
    math::atan2(p.x, p.z) / TAU + 0.5
}

fn sphere(ray: &Line, radius: f64, offer: Offer<'_>) {
    let half = (radius * radius - ray.start.length_squared()).sqrt();
    // For a ray that misses, this is NaN, which is in no range.
    for s in [-half, half] {
        let p = ray.at(s);
        offer(s, 0, &|| [turn(p), 0.5 + math::atan2(p.y, math::hypot(p.x, p.z)) / PI]);
    }
}

fn cylinder(ray: &Line, radius: f64, height: f64, offer: Offer<'_>) {
    let across = |p: DVec3| DVec2::new(p.x, p.z);
    let (start, along) = (across(ray.start), across(ray.along));
    let nearest = -start.dot(along) / along.length_squared();
    let half =
        ((radius * radius - (start + along * nearest).length_squared()) / along.length_squared()).sqrt();
    for s in [nearest - half, nearest + half] {
        let p = ray.at(s);
        let v = p.y / height + 0.5;
        if (0.0..=1.0).contains(&v) {
            offer(s, 0, &|| [turn(p), v]);
        }
    }
}

/// (|p|² + R² − r²)² = 4 R² (x² + z²), of degree four along the ray, without a cubic term because the ray
/// starts at its closest point to the centre.
fn torus(ray: &Line, major: f64, minor: f64, offer: Offer<'_>) {
    let (start, along) = (ray.start, ray.along);
    let reach = (major + minor) * (major + minor) - start.length_squared();
    if reach <= 0.0 {
        return;
    }
    let k = start.length_squared() + major * major - minor * minor;
    let four = 4.0 * major * major;
    let flat = |a: DVec3, b: DVec3| a.x * b.x + a.z * b.z;
    let polynomial = [
        k * k - four * flat(start, start),
        // The start of the ray is perpendicular to it only up to rounding.
        4.0 * k * start.dot(along) - 2.0 * four * flat(start, along),
        2.0 * k - four * flat(along, along),
        0.0,
        1.0,
    ];
    let reach = reach.sqrt() * (1.0 + 1e-9);
    for s in roots(&polynomial, -reach, reach) {
        let p = ray.at(s);
        offer(s, 0, &|| [turn(p), 0.5 + math::atan2(p.y, math::hypot(p.x, p.z) - major) / TAU]);
    }
}

fn plane(ray: &Line, size: f64, bounded: bool, offer: Offer<'_>) {
    let s = -ray.start.y / ray.along.y;
    let p = ray.at(s);
    let uv = [p.x / size + 0.5, 0.5 - p.z / size];
    if s.is_finite() && (!bounded || uv.iter().all(|x| (0.0..=1.0).contains(x))) {
        offer(s, 0, &|| uv);
    }
}

fn cube(ray: &Line, size: f64, offer: Offer<'_>) {
    for (face, [along_u, along_v]) in FACES.into_iter().enumerate() {
        let n = along_u.cross(along_v);
        let s = (0.5 * size - ray.start.dot(n)) / ray.along.dot(n);
        let p = ray.at(s);
        let uv = [p.dot(along_u) / size + 0.5, p.dot(along_v) / size + 0.5];
        if s.is_finite() && uv.iter().all(|x| (0.0..=1.0).contains(x)) {
            offer(s, face, &|| uv);
        }
    }
}
