//! Smooth normals and tangents from the triangles around a vertex.

use super::Triangles;
use crate::math;
use glam::Vec3;

/// Normals at one place whose angle has a cosine above this are merged into one smooth normal.
const SAME_NORMAL: f32 = 0.9999;

/// Maximum number of vertices at one place whose normals are compared with that of another.
const COMPARED: usize = 256;

impl Triangles {
    /// The smooth normal of each place: the sum of the adjacent triangles' normals, weighted by the angle of
    /// the triangle at the place, so that the result does not depend on how faces were triangulated. G.
    /// Thürmer and C. A. Wüthrich, "Computing Vertex Normals from Polygonal Facets", 1998.
    pub fn place_normals(&self) -> Vec<Vec3> {
        let mut sums = vec![Vec3::ZERO; self.place_count()];
        self.each_corner(|vertex, normal, _| {
            let place = self.places.get(vertex).and_then(|at| sums.get_mut(*at as usize));
            place.into_iter().for_each(|sum| *sum += normal);
        });
        sums.into_iter().map(Vec3::normalize_or_zero).collect()
    }

    /// Recomputes normals from the triangles. Vertices of a place that shared a normal share one again, so
    /// that smooth areas stay smooth and edges stay edges.
    pub fn renew_normals(&mut self) {
        let groups = self.normal_groups();
        let count = groups.iter().max().map_or(0, |last| *last as usize + 1);
        let mut sums = vec![Vec3::ZERO; count];
        self.each_corner(|vertex, normal, _| {
            let group = groups.get(vertex).and_then(|at| sums.get_mut(*at as usize));
            group.into_iter().for_each(|sum| *sum += normal);
        });
        let found = groups.iter().map(|at| sums.get(*at as usize).copied().unwrap_or_default());
        let renewed: Vec<Vec3> = found.collect();
        self.normals.iter_mut().zip(renewed).for_each(|(n, sum)| *n = sum.normalize_or(*n));
    }

    /// A number for each vertex: equal for vertices of one place with one normal.
    fn normal_groups(&self) -> Vec<u32> {
        // The first vertex of each place, and for each vertex the next one of its place.
        let mut first = vec![u32::MAX; self.place_count()];
        let mut next = vec![u32::MAX; self.positions.len()];
        let mut groups: Vec<u32> = (0..self.positions.len() as u32).collect();
        for (vertex, place) in self.places.iter().enumerate() {
            let Some(head) = first.get_mut(*place as usize) else { continue };
            let mut other = *head;
            // Vertices with one normal are adjacent in the list; at a place with very many normals, not all
            // are compared.
            for _ in 0..COMPARED {
                let Some(normal) = self.normals.get(other as usize) else { break };
                if self.normals.get(vertex).is_some_and(|n| n.dot(*normal) > SAME_NORMAL) {
                    groups[vertex] = groups[other as usize];
                    break;
                }
                other = next[other as usize];
            }
            next[vertex] = *head;
            *head = vertex as u32;
        }
        groups
    }

    /// Calls `visit` for each corner with its vertex, the triangle's normal weighted by the angle there, and
    /// the triangle.
    fn each_corner(&self, mut visit: impl FnMut(usize, Vec3, usize)) {
        for (triangle, vertices) in self.indices.iter().enumerate() {
            let p = self.corners(triangle);
            let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
            if normal == Vec3::ZERO {
                continue;
            }
            for corner in 0..3 {
                let (to, from) = (p[(corner + 1) % 3] - p[corner], p[(corner + 2) % 3] - p[corner]);
                // Both have a nonzero length, or there would be no normal.
                let cosine = to.dot(from) / (to.length() * from.length());
                let angle = math::acos(cosine.clamp(-1.0, 1.0));
                visit(vertices[corner] as usize, normal * angle, triangle);
            }
        }
    }

    /// Recomputes `dpdu` and `dpdv` from the surface coordinates: at each vertex, the mean over its
    /// triangles, projected onto the tangent plane. They are 0 where the coordinates do not change.
    pub fn renew_tangents(&mut self) {
        let mut sums = vec![[Vec3::ZERO; 2]; self.positions.len()];
        let mut weights = vec![0.0_f32; self.positions.len()];
        let tangents: Vec<Option<[Vec3; 2]>> = (0..self.indices.len()).map(|t| self.slopes(t)).collect();
        self.each_corner(|vertex, normal, triangle| {
            let Some(Some([u, v])) = tangents.get(triangle) else { return };
            let angle = normal.length();
            if let (Some(sum), Some(weight)) = (sums.get_mut(vertex), weights.get_mut(vertex)) {
                sum[0] += *u * angle;
                sum[1] += *v * angle;
                *weight += angle;
            }
        });
        self.dpdu = vec![Vec3::ZERO; self.positions.len()];
        self.dpdv = vec![Vec3::ZERO; self.positions.len()];
        for (vertex, ([u, v], weight)) in
            sums.into_iter().zip(weights).enumerate().filter(|(_, (_, w))| *w > 0.0)
        {
            let normal = self.normals.get(vertex).copied().unwrap_or_default();
            let flat = |t: Vec3| t / weight - normal * (normal.dot(t) / weight);
            self.dpdu[vertex] = flat(u);
            self.dpdv[vertex] = flat(v);
        }
    }

    /// The change of the position with u and v on a triangle; `None` if the coordinates do not span a plane.
    fn slopes(&self, triangle: usize) -> Option<[Vec3; 2]> {
        let [p0, p1, p2] = self.corners(triangle);
        let [t0, t1, t2] = self.indices.get(triangle)?.map(|at| self.uvs.get(at as usize).copied());
        let (t0, t1, t2) = (t0?, t1?, t2?);
        let ((e1, e2), (d1, d2)) = ((p1 - p0, p2 - p0), (t1 - t0, t2 - t0));
        let determinant = d1.perp_dot(d2);
        let found = [e1 * d2.y - e2 * d1.y, e2 * d1.x - e1 * d2.x].map(|t| t / determinant);
        (determinant != 0.0 && found.iter().all(|t| t.is_finite())).then_some(found)
    }
}
