//! Displacement: a shader moves the vertices of a surface.
//!
//! Vertices become shading points, one per place, so that the shader runs over them in batches as over any
//! other points; its output moves them.

use crate::mesh::{SurfacePoint, Triangles};
use crate::surface_points::{Footprint, SurfacePoints};
use glam::Vec3;

/// The new positions of a surface's points: a value for each point, in order.
#[derive(Clone, Debug, PartialEq)]
pub enum Displacement {
    /// A distance along the normal.
    Along(Vec<f32>),
    /// By a vector, in common space.
    By(Vec<Vec3>),
    /// To a position, in common space.
    To(Vec<Vec3>),
}

/// The result of a displacement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Displaced {
    /// Points that were displaced, including those displaced by zero.
    pub points: usize,
    /// Points that stayed in place because their displacement was missing or not finite.
    pub stayed: usize,
    /// The largest distance that a point moved.
    pub farthest: f32,
}

impl Triangles {
    /// The shading points of a surface, one per place. The normal is smooth across edges, the coordinates are
    /// those of the first vertex at the place, and the footprint is a square whose side is the mean length of
    /// the adjacent edges.
    pub fn shading_points(&self) -> SurfacePoints {
        let normals = self.place_normals();
        let sides = self.edge_lengths();
        let mut first = vec![usize::MAX; self.place_count()];
        for (vertex, place) in self.places.iter().enumerate().rev() {
            if let Some(first) = first.get_mut(*place as usize) {
                *first = vertex;
            }
        }
        let several = self.places.len() > first.len();
        let mut points = SurfacePoints::with_capacity(first.len());
        let area = self.area();
        for (place, vertex) in first.into_iter().enumerate() {
            let own = self.normals.get(vertex).copied().unwrap_or(Vec3::Z);
            let flat = normals.get(place).copied().unwrap_or_default().normalize_or(own);
            let get = |list: &[Vec3]| list.get(vertex).copied().unwrap_or_default();
            let point = SurfacePoint {
                p: get(&self.positions),
                // If every vertex has its own place, its normal is exact.
                n: if several { flat } else { own },
                ng: flat,
                uv: self.uvs.get(vertex).copied().unwrap_or_default(),
                dpdu: get(&self.dpdu),
                dpdv: get(&self.dpdv),
            };
            let side = sides.get(place).copied().unwrap_or_default();
            points.push(point, -point.n, Footprint::square(&point, side), area);
        }
        points
    }

    /// The mean length of the edges at each place.
    fn edge_lengths(&self) -> Vec<f32> {
        let mut sums = vec![(0.0_f32, 0_u32); self.place_count()];
        for (triangle, vertices) in self.indices.iter().enumerate() {
            let p = self.corners(triangle);
            for corner in 0..3 {
                let next = (corner + 1) % 3;
                let length = p[corner].distance(p[next]);
                for vertex in [vertices[corner], vertices[next]] {
                    let place = self.places.get(vertex as usize).and_then(|at| sums.get_mut(*at as usize));
                    place.into_iter().for_each(|(sum, count)| {
                        *sum += length;
                        *count += 1;
                    });
                }
            }
        }
        sums.into_iter().map(|(sum, count)| sum / count.max(1) as f32).collect()
    }
}

/// Displaces the points of a surface. `shade` gets the points and returns their displacement. All vertices of
/// a place move together, so that seams stay closed; normals and tangents are recomputed.
///
/// # Errors
/// Those of `shade`; the surface is then unchanged.
pub fn displace<E>(
    triangles: &mut Triangles,
    shade: impl FnOnce(&SurfacePoints) -> Result<Displacement, E>,
) -> Result<Displaced, E> {
    let points = triangles.shading_points();
    let displacement = shade(&points)?;
    let list = points.points();
    let mut done = Displaced { points: list.len(), ..Displaced::default() };
    let mut moved = Vec::with_capacity(list.len());
    for (at, point) in list.iter().enumerate() {
        let to = match &displacement {
            Displacement::Along(by) => by.get(at).map(|by| point.p + point.n * *by),
            Displacement::By(by) => by.get(at).map(|by| point.p + *by),
            Displacement::To(to) => to.get(at).copied(),
        };
        let to = to.filter(|p| p.is_finite());
        done.stayed += usize::from(to.is_none());
        let to = to.unwrap_or(point.p);
        done.farthest = done.farthest.max(to.distance(point.p));
        moved.push(to);
    }
    for (p, place) in triangles.positions.iter_mut().zip(&triangles.places) {
        *p = moved.get(*place as usize).copied().unwrap_or(*p);
    }
    triangles.renew_normals();
    if triangles.dpdu.iter().any(|t| *t != Vec3::ZERO) {
        triangles.renew_tangents();
    }
    Ok(done)
}
