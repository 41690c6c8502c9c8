//! Finds the first triangle that a ray hits.

use super::tree::tree;
use super::{Bounds, FARTHEST, Triangles};
use glam::{DVec3, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::ray;
use obvhs::ray::RayHit;
use std::hash::{Hash, Hasher};
use std::ops::Range;

/// How much the box of a triangle is enlarged, for coordinates of 1.
const SLACK: f32 = 1e-6;

/// The point at which a ray hits a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshHit {
    /// Distance along the ray, in units of its direction's length.
    pub t: f32,
    /// Index of the triangle.
    pub triangle: usize,
    /// Weights of its second and third corner.
    pub barycentric: [f32; 2],
}

/// Triangles in a tree of boxes.
pub struct Bvh {
    tree: Option<CwBvh>,
    /// Corners in the order of the tree, and the index of each triangle in the mesh.
    corners: Vec<[Vec3; 3]>,
    numbers: Vec<u32>,
}

impl Bvh {
    /// Builds the tree. Triangles with a coordinate that is not finite or beyond [`FARTHEST`] are never hit;
    /// of several identical triangles, only the first is kept.
    pub fn new(mesh: &Triangles) -> Bvh {
        let near = |p: &Vec3| p.is_finite() && p.abs().max_element() <= FARTHEST;
        let mut kept: Vec<usize> =
            (0..mesh.indices.len()).filter(|at| mesh.corners(*at).iter().all(near)).collect();
        leave_out_copies(&mut kept, mesh);
        let list: Vec<Aabb> = kept.iter().map(|at| around(mesh.corners(*at))).collect();
        if list.is_empty() {
            return Bvh { tree: None, corners: Vec::new(), numbers: Vec::new() };
        }
        let tree = tree(&list);
        drop(list);
        let order = tree.primitive_indices.iter().filter_map(|at| kept.get(*at as usize));
        let numbers: Vec<u32> = order.map(|at| *at as u32).collect();
        let corners = numbers.iter().map(|at| mesh.corners(*at as usize)).collect();
        Bvh { tree: Some(tree), corners, numbers }
    }

    /// The nearest hit of a ray within a range of distances. A ray through a shared edge hits one of its
    /// triangles.
    pub fn hit(&self, origin: Vec3, direction: Vec3, range: Range<f32>) -> Option<MeshHit> {
        let tree = self.tree.as_ref()?;
        if !(origin.is_finite() && direction.is_finite()) {
            return None;
        }
        let ray = ray_in(origin, direction, range);
        let from = origin.as_dvec3();
        let along = direction.as_dvec3();
        let mut hit = RayHit::none();
        let mut best = None;
        tree.ray_traverse(ray, &mut hit, |ray, id| {
            let Some(corners) = self.corners.get(id) else { return f32::INFINITY };
            let Some((t, barycentric)) = meet(corners, from, along) else { return f32::INFINITY };
            if !(t >= ray.tmin && t < ray.tmax) {
                return f32::INFINITY;
            }
            best = Some((id, barycentric));
            t
        });
        let (id, barycentric) = best?;
        let triangle = *self.numbers.get(id)? as usize;
        Some(MeshHit { t: hit.t, triangle, barycentric })
    }

    /// Whether a ray hits anything within a range of distances.
    pub fn blocked(&self, origin: Vec3, direction: Vec3, range: Range<f32>) -> bool {
        let Some(tree) = self.tree.as_ref().filter(|_| origin.is_finite() && direction.is_finite()) else {
            return false;
        };
        let ray = ray_in(origin, direction, range);
        let (from, along) = (origin.as_dvec3(), direction.as_dvec3());
        !tree.ray_traverse_miss(ray, |ray, id| {
            let met = self.corners.get(id).and_then(|corners| meet(corners, from, along));
            met.map(|(t, _)| t).filter(|t| *t >= ray.tmin && *t < ray.tmax).unwrap_or(f32::INFINITY)
        })
    }
}

/// The box of a triangle, slightly enlarged, so that rounding does not lose a hit.
fn around(corners: [Vec3; 3]) -> Aabb {
    let bounds = Bounds::of(corners);
    let slack = bounds.min.abs().max(bounds.max.abs()).max_element() * SLACK + f32::MIN_POSITIVE;
    Aabb::new(Vec3A::from(bounds.min) - slack, Vec3A::from(bounds.max) + slack)
}

/// Removes triangles whose corners equal those of an earlier one, because a ray would have to test each of a
/// stack.
fn leave_out_copies(kept: &mut Vec<usize>, mesh: &Triangles) {
    let bits = |at: usize| mesh.corners(at).map(|p| p.to_array().map(f32::to_bits));
    let hash = |at: usize| {
        let mut hasher = rustc_hash::FxHasher::default();
        bits(at).hash(&mut hasher);
        hasher.finish()
    };
    let mut hashes: Vec<(u64, usize)> = kept.iter().map(|at| (hash(*at), *at)).collect();
    hashes.sort_unstable();
    // Triangles with one hash are nearly always copies. Otherwise only the first of a run is compared.
    let mut copies: Vec<usize> = Vec::new();
    for run in hashes.chunk_by(|a, b| a.0 == b.0) {
        let [(_, first), others @ ..] = run else { continue };
        let own = bits(*first);
        copies.extend(others.iter().map(|(_, at)| *at).filter(|at| bits(*at) == own));
    }
    if !copies.is_empty() {
        copies.sort_unstable();
        kept.retain(|at| copies.binary_search(at).is_err());
    }
}

/// A ray for the tree, which tests the signs of coordinates: a zero must have the sign of its inverse.
fn ray_in(origin: Vec3, direction: Vec3, range: Range<f32>) -> ray::Ray {
    ray::Ray::new(origin.into(), (direction + Vec3::ZERO).into(), range.start, range.end)
}

/// The distance at which a ray hits a triangle, and the weights of its second and third corner.
///
/// The sign of a triple product tells on which side of an edge the ray passes. For the triangle on the other
/// side it is the exact negative, and 0 counts as inside, so no ray passes between two triangles.
fn meet(corners: &[Vec3; 3], origin: DVec3, direction: DVec3) -> Option<(f32, [f32; 2])> {
    let [a, b, c] = corners.map(|p| p.as_dvec3() - origin);
    let weights = [b.cross(c), c.cross(a), a.cross(b)].map(|side| direction.dot(side));
    let outside = weights.iter().any(|w| *w < 0.0) && weights.iter().any(|w| *w > 0.0);
    let sum = weights[0] + weights[1] + weights[2];
    if outside || sum == 0.0 {
        return None;
    }
    let [wa, wb, wc] = weights.map(|w| w / sum);
    let t = direction.dot(a * wa + b * wb + c * wc) / direction.length_squared();
    t.is_finite().then_some((t as f32, [wb as f32, wc as f32]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Triangles {
        Triangles {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y, Vec3::NAN],
            indices: vec![[0, 1, 2], [0, 2, 3], [0, 1, 4], [9, 9, 9]],
            ..Triangles::default()
        }
    }

    #[test]
    fn rays_hit_what_is_there_and_nothing_else() {
        let bvh = Bvh::new(&square());
        let all = 0.0..f32::INFINITY;
        let hit = bvh.hit(Vec3::new(0.75, 0.25, 2.0), -Vec3::Z, all.clone()).unwrap();
        assert_eq!((hit.triangle, hit.t, hit.barycentric), (0, 2.0, [0.5, 0.25]));
        let diagonal = bvh.hit(Vec3::new(0.5, 0.5, -1.0), Vec3::Z, all.clone());
        assert!(diagonal.is_some(), "the shared edge belongs to one of the two");
        assert_eq!(bvh.hit(Vec3::new(1.5, 0.5, 2.0), -Vec3::Z, all.clone()), None);
        assert!(bvh.blocked(Vec3::new(0.5, 0.25, 2.0), -Vec3::Z, all.clone()));
        assert!(!bvh.blocked(Vec3::new(0.5, 0.25, 2.0), -Vec3::Z, 0.0..1.5));
        assert_eq!(bvh.hit(Vec3::NAN, Vec3::Z, all.clone()), None);
        assert_eq!(Bvh::new(&Triangles::default()).hit(Vec3::ZERO, Vec3::Z, all.clone()), None);
        let mut far = square();
        far.positions[4] = Vec3::splat(-1.8e25);
        assert!(
            Bvh::new(&far).hit(Vec3::new(0.75, 0.25, 2.0), -Vec3::Z, all).is_some(),
            "far ones are left out"
        );
    }
}
