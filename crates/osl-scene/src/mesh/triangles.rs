//! Triangles for rendering, and points on them.

use glam::{Mat4, Vec2, Vec3};

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Minimum coordinates; above `max` if the box is empty.
    pub min: Vec3,
    /// Maximum coordinates.
    pub max: Vec3,
}

impl Bounds {
    /// The empty box.
    pub const EMPTY: Bounds = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The box around some points.
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Bounds {
        let grow = |b: Bounds, p: Vec3| Bounds { min: b.min.min(p), max: b.max.max(p) };
        points.into_iter().fold(Bounds::EMPTY, grow)
    }

    /// Whether it is empty.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Its middle; the origin if it is empty.
    pub fn center(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { (self.min + self.max) * 0.5 }
    }

    /// Half its diagonal.
    pub fn radius(&self) -> f32 {
        if self.is_empty() { 0.0 } else { (self.max - self.min).length() * 0.5 }
    }
}

/// The shading data of a surface point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfacePoint {
    /// Its position.
    pub p: Vec3,
    /// Shading normal, of length 1.
    pub n: Vec3,
    /// Geometric normal, of length 1, on the side of the shading normal.
    pub ng: Vec3,
    /// Surface coordinates.
    pub uv: Vec2,
    /// The change of the position with u; 0 on surfaces without coordinates.
    pub dpdu: Vec3,
    /// The change of the position with v; 0 on surfaces without coordinates.
    pub dpdv: Vec3,
}

impl SurfacePoint {
    /// The surface point transformed by a matrix, given with its inverse.
    #[must_use]
    pub fn transform(&self, matrix: &Mat4, inverse: &Mat4) -> SurfacePoint {
        let for_normals = inverse.transpose();
        let turn = |n: Vec3| for_normals.transform_vector3(n).normalize_or(n);
        SurfacePoint {
            p: matrix.transform_point3(self.p),
            n: turn(self.n),
            ng: turn(self.ng),
            uv: self.uv,
            dpdu: matrix.transform_vector3(self.dpdu),
            dpdv: matrix.transform_vector3(self.dpdv),
        }
    }
}

/// Triangles that share vertices.
///
/// At a seam, several vertices with different coordinates or normals are at the same position. They have the
/// same number in `places` and move together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangles {
    /// Position of each vertex.
    pub positions: Vec<Vec3>,
    /// Smooth normal of each vertex, of length 1.
    pub normals: Vec<Vec3>,
    /// Surface coordinates of each vertex; all 0 if the surface has none.
    pub uvs: Vec<Vec2>,
    /// Change of the position with u at each vertex; 0 if the surface has no coordinates.
    pub dpdu: Vec<Vec3>,
    /// Change of the position with v at each vertex.
    pub dpdv: Vec<Vec3>,
    /// The place number of each vertex.
    pub places: Vec<u32>,
    /// The vertices of each triangle, counterclockwise as seen from outside.
    pub indices: Vec<[u32; 3]>,
}

impl Triangles {
    /// The corners of a triangle. If it does not exist, all are at the origin.
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.attribute(&self.positions, triangle)
    }

    fn attribute<T: Copy + Default>(&self, list: &[T], triangle: usize) -> [T; 3] {
        let corners = self.indices.get(triangle).copied().unwrap_or_default();
        corners.map(|at| list.get(at as usize).copied().unwrap_or_default())
    }

    /// The box around all vertices.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.positions.iter().copied())
    }

    /// The sum of the triangles' areas.
    pub fn area(&self) -> f32 {
        let doubled = |triangle: usize| {
            let [a, b, c] = self.corners(triangle).map(|p| p.as_dvec3());
            (b - a).cross(c - a).length()
        };
        ((0..self.indices.len()).map(doubled).sum::<f64>() * 0.5) as f32
    }

    /// The point of a triangle at barycentric coordinates: the weights of its second and third corner.
    pub fn point(&self, triangle: usize, barycentric: [f32; 2]) -> SurfacePoint {
        let [b, c] = barycentric;
        let weights = [1.0 - b - c, b, c];
        let mix = |list: &[Vec3]| {
            let [x, y, z] = self.attribute(list, triangle);
            x * weights[0] + y * weights[1] + z * weights[2]
        };
        let [p0, p1, p2] = self.corners(triangle);
        let flat = (p1 - p0).cross(p2 - p0).normalize_or_zero();
        let n = mix(&self.normals).normalize_or(flat);
        let ng = if flat == Vec3::ZERO { n } else { flat };
        let [t0, t1, t2] = self.attribute(&self.uvs, triangle);
        SurfacePoint {
            p: mix(&self.positions),
            n,
            ng: if ng.dot(n) < 0.0 { -ng } else { ng },
            uv: t0 * weights[0] + t1 * weights[1] + t2 * weights[2],
            dpdu: mix(&self.dpdu),
            dpdv: mix(&self.dpdv),
        }
    }

    /// Transforms the triangles by a matrix. If it mirrors, normals still point outwards.
    pub fn transform(&mut self, matrix: &Mat4) {
        self.positions.iter_mut().for_each(|p| *p = matrix.transform_point3(*p));
        let for_normals = matrix.inverse().transpose();
        let turn = |n: &mut Vec3| *n = for_normals.transform_vector3(*n).normalize_or(*n);
        self.normals.iter_mut().for_each(turn);
        for list in [&mut self.dpdu, &mut self.dpdv] {
            list.iter_mut().for_each(|t| *t = matrix.transform_vector3(*t));
        }
        if matrix.determinant() < 0.0 {
            self.indices.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
    }

    /// The number of places: one more than the largest place number.
    pub fn place_count(&self) -> usize {
        self.places.iter().max().map_or(0, |last| *last as usize + 1)
    }
}
