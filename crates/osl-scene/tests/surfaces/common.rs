//! Meshes for several tests.

use glam::{Vec2, Vec3};
use osl_scene::mesh::{Mesh, Triangles};
use std::collections::HashMap;

/// The cube with corners at ±1.
pub(crate) fn cube() -> Mesh {
    let positions = (0..8).map(|i| {
        let bit = |b: i32| if i & b != 0 { 1.0 } else { -1.0 };
        Vec3::new(bit(1), bit(2), bit(4))
    });
    Mesh {
        positions: positions.collect(),
        face_sizes: vec![4; 6],
        corners: vec![0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4, 2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6],
        ..Mesh::default()
    }
}

/// The cube, each face with the unit square as coordinates.
pub(crate) fn cube_with_uvs() -> Mesh {
    let uvs = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    Mesh { uvs, uv_corners: (0..24).map(|corner| corner % 4).collect(), ..cube() }
}

/// A grid of quads in the plane z = 0, from 0 to `side` in steps of 1, with coordinates from 0 to 1.
pub(crate) fn grid(side: u32) -> Mesh {
    let row = side + 1;
    let mut mesh = Mesh::default();
    for y in 0..row {
        for x in 0..row {
            mesh.positions.push(Vec3::new(x as f32, y as f32, 0.0));
            mesh.uvs.push(Vec2::new(x as f32, y as f32) / side as f32);
        }
    }
    for y in 0..side {
        for x in 0..side {
            let first = y * row + x;
            mesh.face_sizes.push(4);
            mesh.corners.extend([first, first + 1, first + row + 1, first + row]);
        }
    }
    mesh.uv_corners = mesh.corners.clone();
    mesh
}

/// The number of triangles at each edge, by the places of its ends and by direction.
pub(crate) fn edges(triangles: &Triangles) -> HashMap<[u32; 2], [u32; 2]> {
    let mut edges: HashMap<[u32; 2], [u32; 2]> = HashMap::new();
    for vertices in &triangles.indices {
        let places = vertices.map(|v| triangles.places[v as usize]);
        for corner in 0..3 {
            let (a, b) = (places[corner], places[(corner + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)] += 1;
        }
    }
    edges
}

/// Every edge is used once in each direction, and all vertices of a place have the same position.
pub(crate) fn assert_watertight(triangles: &Triangles) {
    let open = edges(triangles).into_values().filter(|uses| *uses != [1, 1]).count();
    assert_eq!(open, 0, "edges without exactly two triangles");
    let mut at: HashMap<u32, Vec3> = HashMap::new();
    for (p, place) in triangles.positions.iter().zip(&triangles.places) {
        assert_eq!(at.entry(*place).or_insert(*p), p, "place {place}");
    }
}
