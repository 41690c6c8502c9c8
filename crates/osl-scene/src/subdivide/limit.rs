//! The positions of a level's vertices on the limit surface, and the normals there.
//!
//! In a mesh of quads, the limit of a vertex is a fixed weighted mean of it and the ring of vertices around
//! it, and so are two tangents. M. Halstead, M. Kass and T. DeRose, "Efficient, Fair Interpolation using
//! Catmull-Clark Surfaces", 1993; at borders H. Biermann, A. Levin and D. Zorin, "Piecewise Smooth
//! Subdivision Surfaces with Normal Control", 2000.

use super::topology::{Level, NONE};
use crate::math;
use glam::DVec3;
use std::f64::consts::PI;

/// The limit of the first vertices of a level of quads.
pub(super) struct Limit {
    pub(super) positions: Vec<DVec3>,
    /// Normals of length 1; 0 at creases and corners, where the surface has none.
    pub(super) normals: Vec<DVec3>,
}

/// The vertices around one, counterclockwise: across edges and across faces; each edge is followed by its
/// face. If the fan ends at a border, there is one edge more than faces.
#[derive(Default)]
struct Ring {
    edges: Vec<DVec3>,
    faces: Vec<DVec3>,
}

impl Level {
    /// The limit of the first `count` vertices of a level of quads.
    pub(super) fn limit(&self, count: usize) -> Limit {
        let creases = self.creases();
        let starts = self.first_corners();
        let mut limit = Limit { positions: Vec::with_capacity(count), normals: Vec::with_capacity(count) };
        let mut ring = Ring::default();
        for (vertex, v) in self.positions.iter().enumerate().take(count) {
            let start = starts[vertex];
            let (mut position, mut normal) = (*v, DVec3::ZERO);
            if start != NONE && !self.is_fixed(vertex) {
                let border = self.ring(start, &mut ring);
                let crease = creases.as_ref().map(|c| c[vertex]).unwrap_or_default();
                let smooth = if border { *v } else { ring.position(*v) };
                // The limit of a cubic spline curve is (a + 4v + b) / 6.
                position = crease.blend(smooth, *v, |others| (others + *v * 4.0) / 6.0);
                normal = match (border, crease.count) {
                    (false, 0 | 1) => ring.normal(),
                    // Both sharp edges form the border.
                    (true, 2) => ring.border_normal(*v),
                    _ => DVec3::ZERO,
                };
            }
            limit.positions.push(position);
            limit.normals.push(normal.normalize_or_zero());
        }
        limit
    }

    /// A corner of each vertex; at a border, the first corner of the fan.
    fn first_corners(&self) -> Vec<u32> {
        let mut first = vec![NONE; self.positions.len()];
        for (corner, vertex) in (0..).zip(&self.corners) {
            let first = &mut first[*vertex as usize];
            if *first == NONE || self.twins[corner as usize] == NONE {
                *first = corner;
            }
        }
        first
    }

    /// Collects the ring around the vertex of a corner. Returns whether it ends at a border.
    fn ring(&self, start: u32, ring: &mut Ring) -> bool {
        ring.edges.clear();
        ring.faces.clear();
        let at = |corner: u32| self.positions[self.corners[corner as usize] as usize];
        let mut corner = start;
        loop {
            let [first, second, third] = [1, 2, 3].map(|step| corner / 4 * 4 + (corner + step) % 4);
            ring.edges.push(at(first));
            ring.faces.push(at(second));
            let twin = self.twins[third as usize];
            if twin == NONE {
                ring.edges.push(at(third));
                return true;
            }
            // Twins are paired half edges, so the walk returns to its start.
            if twin == start {
                return false;
            }
            corner = twin;
        }
    }
}

impl Ring {
    /// (n² v + 4 Σ edges + Σ faces) / (n (n + 5)).
    fn position(&self, v: DVec3) -> DVec3 {
        let n = self.edges.len() as f64;
        let sum = |list: &[DVec3]| list.iter().copied().sum::<DVec3>();
        (v * (n * n) + sum(&self.edges) * 4.0 + sum(&self.faces)) / (n * (n + 5.0))
    }

    /// The cross product of the tangents, which are sums over the ring weighted by the cosines and the sines
    /// of the angles in a regular ring.
    fn normal(&self) -> DVec3 {
        if let ([e0, e1, e2, e3], [f0, f1, f2, f3]) = (self.edges.as_slice(), self.faces.as_slice()) {
            let along = (*e0 - *e2) * 4.0 + (*f0 - *f1 - *f2 + *f3);
            let across = (*e1 - *e3) * 4.0 + (*f0 + *f1 - *f2 - *f3);
            return along.cross(across);
        }
        let step = 2.0 * PI / self.edges.len() as f64;
        let weight = 1.0 + math::cos(step) + math::cos(step * 0.5) * (2.0 * (9.0 + math::cos(step))).sqrt();
        let (mut along, mut across) = (DVec3::ZERO, DVec3::ZERO);
        for (at, (edge, face)) in self.edges.iter().zip(&self.faces).enumerate() {
            let (sin, cos) = math::sin_cos(step * at as f64);
            let (next_sin, next_cos) = math::sin_cos(step * (at + 1) as f64);
            along += *edge * (weight * cos) + *face * (cos + next_cos);
            across += *edge * (weight * sin) + *face * (sin + next_sin);
        }
        along.cross(across)
    }

    /// The same for a fan that ends at a smooth border; 0 for a single face, which has a tangent along the
    /// border only.
    fn border_normal(&self, v: DVec3) -> DVec3 {
        let k = self.faces.len();
        let (Some(first), Some(last)) = (self.edges.first(), self.edges.last()) else { return DVec3::ZERO };
        if k < 2 {
            return DVec3::ZERO;
        }
        let step = PI / k as f64;
        let (sin, cos) = math::sin_cos(step);
        let ratio = (1.0 + cos) / sin;
        let mut across = v * (4.0 * ratio * (cos - 1.0)) - (*first + *last) * (ratio * (1.0 + 2.0 * cos));
        for (at, edge) in self.edges.iter().enumerate().take(k).skip(1) {
            across += *edge * (4.0 * math::sin(step * at as f64));
        }
        for (at, face) in self.faces.iter().enumerate() {
            across += *face * (math::sin(step * at as f64) + math::sin(step * (at + 1) as f64));
        }
        (*first - *last).cross(across)
    }
}
