//! Shapes as triangles, for displacement.

use super::Shape;
use crate::mesh::{Mesh, MeshError, Triangles};
use crate::subdivide::{Detail, Scheme, choose, tessellate_within};
use glam::{Mat4, Vec2, Vec3};
use osl_limits::Limits;

impl Shape {
    /// The shape as triangles, transformed by a matrix, with the normals and tangents of the shape itself.
    /// Also returns the level, and whether the detail is reached. Each level halves the steps of u and v; at
    /// level 0, round shapes have eight steps around. A plane ends at its square.
    ///
    /// # Errors
    /// The level has too many triangles.
    pub fn triangles(
        &self,
        to_common: &Mat4,
        detail: &Detail<'_>,
    ) -> Result<(Triangles, u32, bool), MeshError> {
        self.triangles_within(to_common, detail, &Limits::default())
    }

    /// Like [`Shape::triangles`], with explicit limits.
    ///
    /// # Errors
    /// The level has too many triangles, or the command has to stop.
    pub fn triangles_within(
        &self,
        to_common: &Mat4,
        detail: &Detail<'_>,
        limits: &Limits,
    ) -> Result<(Triangles, u32, bool), MeshError> {
        let bounds = &limits.scenes;
        if let Shape::Cube { size } = *self {
            let mut mesh = cube(size);
            mesh.transform(to_common);
            let found = tessellate_within(&mesh, Scheme::Linear, detail, limits)?;
            return Ok((found.triangles, found.level, found.fine));
        }
        let at = |level: u32| {
            if let Some(why) = limits.halted() {
                return Err(MeshError::Halted(why));
            }
            let mut triangles = self.grid(level);
            triangles.transform(to_common);
            Ok(triangles)
        };
        let [across, up] = self.steps(0);
        let most = |triangles: u64| {
            let finer = |l: &u32| ((2 * across * up) as u64) << (2 * (l + 1)) <= triangles;
            (0..16).take_while(finer).count() as u32
        };
        match *detail {
            Detail::Level(level) if level > most(bounds.triangles) => {
                Err(MeshError::TooFine { most: bounds.triangles })
            }
            Detail::Level(level) => Ok((at(level)?, level, true)),
            Detail::Pixels { view, edge } => {
                choose(at, most(bounds.pixel_triangles.min(bounds.triangles)), view, edge)
            }
        }
    }

    /// Number of steps of u and v.
    fn steps(&self, level: u32) -> [usize; 2] {
        let first = match self {
            Shape::Sphere { .. } => [8, 4],
            Shape::Cylinder { .. } => [8, 2],
            Shape::Torus { .. } => [8, 8],
            Shape::Plane { .. } | Shape::Cube { .. } => [1, 1],
        };
        first.map(|n| n << level)
    }

    fn grid(&self, level: u32) -> Triangles {
        let [across, up] = self.steps(level);
        let mut t = Triangles::default();
        for row in 0..=up {
            for column in 0..=across {
                let pole = self.is_pole(row, up);
                // At a pole, u belongs to the triangle between two meridians.
                let u = if pole { column as f64 + 0.5 } else { column as f64 } / across as f64;
                let point = self.point(0, [u, row as f64 / up as f64]);
                // Where the surface closes, the place is that on the other side.
                let first = Shape::place(self.around(row, up), across, self.closed(column, across, pole));
                let seen = t.places.len();
                let twin = (first < seen).then(|| t.positions.get(first).copied()).flatten();
                t.positions.push(twin.unwrap_or(point.p));
                t.normals.push(point.n);
                t.uvs.push(point.uv);
                t.dpdu.push(point.dpdu);
                t.dpdv.push(point.dpdv);
                t.places.push(first as u32);
            }
        }
        for row in 0..up {
            for column in 0..across {
                let [a, b] = [column, column + 1].map(|at| Shape::place(row, across, at) as u32);
                let [d, c] = [column, column + 1].map(|at| Shape::place(row + 1, across, at) as u32);
                if !self.is_pole(row, up) {
                    t.indices.push([a, b, if self.is_pole(row + 1, up) { d } else { c }]);
                }
                if !self.is_pole(row + 1, up) {
                    t.indices.push([a, c, d]);
                }
            }
        }
        number_places(&mut t);
        t
    }

    fn place(row: usize, across: usize, column: usize) -> usize {
        row * (across + 1) + column
    }

    /// Whether a row is a single point.
    fn is_pole(&self, row: usize, up: usize) -> bool {
        matches!(self, Shape::Sphere { .. }) && (row == 0 || row == up)
    }

    /// The first row at the same position as a row.
    fn around(&self, row: usize, up: usize) -> usize {
        if matches!(self, Shape::Torus { .. }) && row == up { 0 } else { row }
    }

    /// The first column at the same position as a column.
    fn closed(&self, column: usize, across: usize, pole: bool) -> usize {
        let round = !matches!(self, Shape::Plane { .. });
        if pole || (round && column == across) { 0 } else { column }
    }
}

/// Numbers the places from 0 without gaps; each was the number of its first vertex.
fn number_places(t: &mut Triangles) {
    let mut numbers = vec![0; t.places.len()];
    let mut count = 0;
    for vertex in 0..t.places.len() {
        let first = t.places[vertex] as usize;
        if first == vertex {
            numbers[vertex] = count;
            count += 1;
        }
        t.places[vertex] = numbers[first];
    }
}

/// The cube as a mesh, with coordinates and flat faces.
fn cube(size: f32) -> Mesh {
    let shape = Shape::Cube { size };
    let uvs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut mesh =
        Mesh { uvs: uvs.iter().map(|[u, v]| Vec2::new(*u as f32, *v as f32)).collect(), ..Mesh::default() };
    for face in 0..shape.faces() {
        mesh.face_sizes.push(4);
        mesh.normals.push(shape.point(face, [0.5; 2]).n);
        for (corner, uv) in uvs.iter().enumerate() {
            let p: Vec3 = shape.point(face, *uv).p;
            let known = mesh.positions.iter().position(|q| *q == p);
            let vertex = known.unwrap_or(mesh.positions.len());
            if known.is_none() {
                mesh.positions.push(p);
            }
            mesh.corners.push(vertex as u32);
            mesh.uv_corners.push(corner as u32);
            mesh.normal_corners.push(face as u32);
        }
    }
    mesh
}
