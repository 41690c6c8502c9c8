//! A level as triangles: corners with the same place, coordinates and normal become one vertex.

use super::Scheme;
use super::limit::Limit;
use super::topology::{Level, NONE};
use crate::mesh::Triangles;
use glam::{DVec3, Vec2, Vec3};
use std::ops::Range;

/// The mesh itself: polygons become fans.
pub(super) fn of_base(base: &Level, scheme: Scheme) -> Triangles {
    let limit = match scheme {
        Scheme::Linear => as_it_is(base),
        // The first vertices of the next level are those of this one.
        Scheme::CatmullClark => base.refine(scheme).limit(base.positions.len()),
    };
    triangles(base, limit, |face, _, add| {
        let first = face.start as u32;
        (first + 1..face.end as u32 - 1).for_each(|at| add([first, at, at + 1]));
    })
}

/// Quads, each cut along the shorter diagonal.
pub(super) fn of_quads(level: &Level, scheme: Scheme) -> Triangles {
    let limit = match scheme {
        Scheme::Linear => as_it_is(level),
        Scheme::CatmullClark => level.limit(level.positions.len()),
    };
    triangles(level, limit, |face, positions, add| {
        let a = face.start as u32;
        let p = |at: usize| positions[level.corners[face.start + at] as usize];
        let first_way = p(0).distance_squared(p(2)) <= p(1).distance_squared(p(3));
        add([a, a + 1, if first_way { a + 2 } else { a + 3 }]);
        add([if first_way { a } else { a + 1 }, a + 2, a + 3]);
    })
}

fn as_it_is(level: &Level) -> Limit {
    Limit { positions: level.positions.clone(), normals: vec![DVec3::ZERO; level.positions.len()] }
}

/// Makes triangles of faces; `cut` is given a face and adds triangles of its corners.
fn triangles(
    level: &Level,
    limit: Limit,
    cut: impl Fn(Range<usize>, &[DVec3], &mut dyn FnMut([u32; 3])),
) -> Triangles {
    let mut welded = Welded::new(level, &limit);
    let mut indices = Vec::with_capacity(level.corners.len());
    for face in level.faces() {
        let mut add = |corners: [u32; 3]| indices.push(corners.map(|at| welded.vertex_of[at as usize]));
        cut(face, &limit.positions, &mut add);
    }
    welded.triangles.indices = indices;
    let mut triangles = welded.triangles;
    if level.normals.is_empty() {
        let smooth = triangles.place_normals();
        for (normal, place) in triangles.normals.iter_mut().zip(&triangles.places) {
            if *normal == Vec3::ZERO {
                *normal = smooth.get(*place as usize).copied().unwrap_or_default().normalize_or(Vec3::Z);
            }
        }
    }
    match level.uvs.is_empty() {
        true => {
            triangles.dpdu = vec![Vec3::ZERO; triangles.positions.len()];
            triangles.dpdv = vec![Vec3::ZERO; triangles.positions.len()];
        }
        false => triangles.renew_tangents(),
    }
    triangles
}

/// The vertices, as many as are needed.
struct Welded {
    triangles: Triangles,
    /// The vertex of each corner.
    vertex_of: Vec<u32>,
}

impl Welded {
    fn new(level: &Level, limit: &Limit) -> Welded {
        let count = level.positions.len();
        let mut t = Triangles::default();
        for list in [&mut t.positions, &mut t.normals] {
            list.reserve(count);
        }
        let mut vertex_of = Vec::with_capacity(level.corners.len());
        // The first vertex of each place, and behind each vertex the next one there.
        let mut first = vec![NONE; count];
        let mut next: Vec<u32> = Vec::with_capacity(count);
        let mut n_places = 0;
        for (corner, place) in level.corners.iter().enumerate() {
            let uv = level.uvs.get(corner).map_or(Vec2::ZERO, |uv| uv.as_vec2());
            let own = level.normals.get(corner).map(|n| n.as_vec3().normalize_or_zero());
            let normal = own.unwrap_or_else(|| limit.normals[*place as usize].as_vec3());
            let head = first[*place as usize];
            let mut at = head;
            while at != NONE && (t.uvs[at as usize] != uv || t.normals[at as usize] != normal) {
                at = next[at as usize];
            }
            if at == NONE {
                at = t.positions.len() as u32;
                let number = if head == NONE { n_places } else { t.places[head as usize] };
                n_places += u32::from(head == NONE);
                t.positions.push(limit.positions[*place as usize].as_vec3());
                t.normals.push(normal);
                t.uvs.push(uv);
                t.places.push(number);
                next.push(head);
                first[*place as usize] = at;
            }
            vertex_of.push(at);
        }
        Welded { triangles: t, vertex_of }
    }
}
