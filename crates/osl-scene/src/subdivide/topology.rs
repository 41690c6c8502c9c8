//! Joins faces along edges, for any mesh.
//!
//! A corner also stands for the half edge from its vertex to that of the next corner. Edges join vertices,
//! whatever the number of faces on them, so that there are no cracks. Twins pair half edges where two faces
//! are properly adjacent.

use super::Scheme;
use crate::mesh::{Mesh, MeshError, Oddities};
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// No half edge.
pub(super) const NONE: u32 = u32::MAX;

/// A level of subdivision.
pub(super) struct Level {
    pub(super) positions: Vec<DVec3>,
    /// Vertices that stay in place; later vertices never do.
    pub(super) fixed: Vec<bool>,
    /// First corner of each face, and the number of corners.
    pub(super) starts: Vec<u32>,
    /// Whether all faces have four corners.
    pub(super) quads: bool,
    /// Vertex of each corner.
    pub(super) corners: Vec<u32>,
    /// Edge of each half edge.
    pub(super) edges: Vec<u32>,
    /// The half edge on the other side of each, or [`NONE`].
    pub(super) twins: Vec<u32>,
    /// Vertices of each edge.
    pub(super) ends: Vec<[u32; 2]>,
    /// For how many levels each edge stays sharp; infinite at borders.
    pub(super) sharpness: Vec<f64>,
    /// Surface coordinates of each corner; empty if there are none.
    pub(super) uvs: Vec<DVec2>,
    /// Normals of each corner, if the mesh has its own and is not smoothed; else empty.
    pub(super) normals: Vec<DVec3>,
}

impl Level {
    /// The mesh itself, after [`Mesh::check`].
    pub(super) fn new(mesh: &Mesh, scheme: Scheme) -> Result<(Level, Oddities), MeshError> {
        let mut oddities = Oddities::default();
        let kept = sound_faces(mesh, &mut oddities);
        if kept.starts.len() < 2 {
            return Err(MeshError::Empty);
        }
        let pick = |list: &[u32], at: u32| list.get(at as usize).copied().unwrap_or(0) as usize;
        let corners: Vec<u32> = kept.from.iter().map(|at| pick(&mesh.corners, *at) as u32).collect();
        let uv = |at: &u32| mesh.uvs.get(pick(&mesh.uv_corners, *at)).copied().unwrap_or_default();
        let normal =
            |at: &u32| mesh.normals.get(pick(&mesh.normal_corners, *at)).copied().unwrap_or_default();
        let uvs = match mesh.uv_corners.is_empty() {
            true => Vec::new(),
            false => kept.from.iter().map(|at| uv(at).as_dvec2()).collect(),
        };
        let normals = match mesh.normal_corners.is_empty() || scheme != Scheme::Linear {
            true => Vec::new(),
            false => kept.from.iter().map(|at| normal(at).as_dvec3()).collect(),
        };
        let mut level = Level {
            positions: mesh.positions.iter().map(|p| p.as_dvec3()).collect(),
            fixed: vec![false; mesh.positions.len()],
            starts: kept.starts,
            quads: false,
            edges: vec![NONE; corners.len()],
            twins: vec![NONE; corners.len()],
            corners,
            ends: Vec::new(),
            sharpness: Vec::new(),
            uvs,
            normals,
        };
        level.join(mesh, &mut oddities);
        level.fix_meeting_points(&mut oddities);
        Ok((level, oddities))
    }

    /// The ranges of the faces' corners.
    pub(super) fn faces(&self) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
        self.starts.windows(2).map(|w| w[0] as usize..w[1] as usize)
    }

    /// The next corner in the face.
    pub(super) fn after(&self, corner: u32) -> u32 {
        if self.quads {
            return if corner % 4 == 3 { corner - 3 } else { corner + 1 };
        }
        let face = self.starts.partition_point(|start| *start <= corner);
        let (first, end) = (self.starts[face - 1], self.starts[face]);
        if corner + 1 == end { first } else { corner + 1 }
    }

    /// The previous corner in the face.
    pub(super) fn before(&self, corner: u32) -> u32 {
        if self.quads {
            return if corner.is_multiple_of(4) { corner + 3 } else { corner - 1 };
        }
        let face = self.starts.partition_point(|start| *start <= corner);
        let (first, end) = (self.starts[face - 1], self.starts[face]);
        if corner == first { end - 1 } else { corner - 1 }
    }

    /// Finds edges, twins and sharp edges.
    fn join(&mut self, mesh: &Mesh, oddities: &mut Oddities) {
        /// An edge under construction: its number, its first half edge, and the number of half edges.
        struct EdgeEntry {
            number: u32,
            first: u32,
            count: u32,
        }
        let mut known: HashMap<[u32; 2], EdgeEntry> = HashMap::with_capacity(self.corners.len());
        let mut counts: Vec<u32> = Vec::new();
        let mut pairs: Vec<[u32; 2]> = Vec::new();
        for face in self.starts.windows(2) {
            for corner in face[0]..face[1] {
                let next = if corner + 1 == face[1] { face[0] } else { corner + 1 };
                let (a, b) = (self.corners[corner as usize], self.corners[next as usize]);
                let number = self.ends.len() as u32;
                let found = known.entry([a.min(b), a.max(b)]).or_insert(EdgeEntry {
                    number,
                    first: corner,
                    count: 0,
                });
                found.count += 1;
                if found.number == number {
                    self.ends.push([a, b]);
                    counts.push(0);
                    pairs.push([corner, NONE]);
                }
                let edge = found.number as usize;
                counts[edge] = found.count;
                if found.count == 2 {
                    pairs[edge] = [found.first, corner];
                }
                self.edges[corner as usize] = found.number;
            }
        }
        self.sharpness = vec![0.0; self.ends.len()];
        for (edge, (count, [first, second])) in counts.into_iter().zip(pairs).enumerate() {
            let opposite = second != NONE && self.corners[first as usize] != self.corners[second as usize];
            if count == 2 && opposite {
                self.twins[first as usize] = second;
                self.twins[second as usize] = first;
            } else {
                self.sharpness[edge] = f64::INFINITY;
                oddities.bad_edges += usize::from(count != 1);
            }
        }
        for ([a, b], sharpness) in &mesh.creases {
            if let Some(found) = known.get(&[*a.min(b), *a.max(b)]) {
                let edge = &mut self.sharpness[found.number as usize];
                // A comparison with NaN is false: such a crease is ignored.
                if f64::from(*sharpness) > *edge {
                    *edge = f64::from(*sharpness);
                }
            }
        }
    }

    /// Fixes vertices at which several fans of faces meet, for which the surface has no rule.
    fn fix_meeting_points(&mut self, oddities: &mut Oddities) {
        let mut fans = vec![0_u32; self.positions.len()];
        let mut seen = vec![false; self.corners.len()];
        // First the fans that end at a border, from their first corner, then the closed ones.
        for at_border in [true, false] {
            for corner in 0..self.corners.len() {
                if seen[corner] || (at_border && self.twins[corner] != NONE) {
                    continue;
                }
                fans[self.corners[corner] as usize] += 1;
                let mut at = corner as u32;
                while at != NONE && !std::mem::replace(&mut seen[at as usize], true) {
                    at = self.twins[self.before(at) as usize];
                }
            }
        }
        for (fixed, fans) in self.fixed.iter_mut().zip(fans) {
            *fixed = fans > 1;
            oddities.bad_vertices += usize::from(fans > 1);
        }
    }
}

/// The remaining faces: their first corners, and for each corner its index in the mesh.
struct Kept {
    starts: Vec<u32>,
    from: Vec<u32>,
}

/// Removes corners that repeat the previous one, and faces with fewer than three distinct vertices.
fn sound_faces(mesh: &Mesh, oddities: &mut Oddities) -> Kept {
    let mut kept = Kept { starts: vec![0], from: Vec::with_capacity(mesh.corners.len()) };
    for (first, size) in mesh.faces() {
        let corners = mesh.corners.get(first..first + size).unwrap_or_default();
        let start = kept.from.len();
        for (at, vertex) in corners.iter().enumerate() {
            let before = if at == 0 { corners.last() } else { corners.get(at - 1) };
            if before != Some(vertex) {
                kept.from.push((first + at) as u32);
            }
        }
        let mut others = kept.from[start..].iter().map(|at| mesh.corners[*at as usize]);
        let first = others.next();
        let second = others.find(|v| Some(*v) != first);
        let is_face = second.is_some() && others.any(|v| Some(v) != first && Some(v) != second);
        if !is_face {
            kept.from.truncate(start);
            oddities.degenerate_faces += 1;
        } else {
            kept.starts.push(kept.from.len() as u32);
        }
    }
    kept
}
