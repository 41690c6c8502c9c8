//! A level as triangles: adjacent corners at a place become one vertex, unless a seam separates them.

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

/// Makes triangles from faces; `cut` gets a face and adds triangles of its corners.
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

/// The vertices after welding.
struct Welded {
    triangles: Triangles,
    /// The vertex of each corner.
    vertex_of: Vec<u32>,
}

impl Welded {
    fn new(level: &Level, limit: &Limit) -> Welded {
        let count = level.positions.len();
        let mut t = Triangles::default();
        t.positions.reserve(count);
        t.normals.reserve(count);
        let mut vertex_of = vec![NONE; level.corners.len()];
        let mut numbers = vec![NONE; count];
        let mut n_places = 0;
        for corner in 0..level.corners.len() as u32 {
            if vertex_of[corner as usize] != NONE {
                continue;
            }
            let vertex = t.positions.len() as u32;
            let mut at = level.first_of_sector(corner);
            while at != NONE && vertex_of[at as usize] == NONE {
                vertex_of[at as usize] = vertex;
                let back = level.before(at);
                at = if level.is_seam(back) { NONE } else { level.twins[back as usize] };
            }
            let place = level.corners[corner as usize] as usize;
            if numbers[place] == NONE {
                numbers[place] = n_places;
                n_places += 1;
            }
            let own = level.normals.get(corner as usize).map(|n| n.as_vec3().normalize_or_zero());
            t.positions.push(limit.positions[place].as_vec3());
            t.normals.push(own.unwrap_or_else(|| limit.normals[place].as_vec3()));
            t.uvs.push(level.uvs.get(corner as usize).map_or(Vec2::ZERO, |uv| uv.as_vec2()));
            t.places.push(numbers[place]);
        }
        Welded { triangles: t, vertex_of }
    }
}

impl Level {
    /// The first of the corners around a vertex that no seam separates from this one.
    fn first_of_sector(&self, corner: u32) -> u32 {
        let mut first = corner;
        while !self.is_seam(first) {
            let next = self.after(self.twins[first as usize]);
            // A full turn has no first corner.
            if next == corner {
                return corner;
            }
            first = next;
        }
        first
    }

    /// Whether coordinates or normals differ on the two sides of a half edge, or it has no other side.
    fn is_seam(&self, half: u32) -> bool {
        let twin = self.twins[half as usize];
        if twin == NONE {
            return true;
        }
        if self.uvs.is_empty() && self.normals.is_empty() {
            return false;
        }
        let pairs = [(half, self.after(twin)), (self.after(half), twin)];
        pairs.iter().any(|(a, b)| {
            let (a, b) = (*a as usize, *b as usize);
            self.uvs.get(a) != self.uvs.get(b) || self.normals.get(a) != self.normals.get(b)
        })
    }
}
