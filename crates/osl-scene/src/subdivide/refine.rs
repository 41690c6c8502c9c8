//! Computes a level from the previous one: each face becomes one quad per corner.
//!
//! Vertices keep their numbers; they are followed by the edges' vertices, then those of the faces. The quad
//! of a corner has the corner's number; its corners are the vertex, the next edge, the face, and the previous
//! edge.

use super::Scheme;
use super::topology::{Level, NONE};
use glam::DVec3;
use std::ops::{Add, Mul};

impl Level {
    /// The next level.
    pub(super) fn refine(&self, scheme: Scheme) -> Level {
        let faces = self.face_points();
        let mut positions = match scheme {
            Scheme::Linear => self.positions.clone(),
            Scheme::CatmullClark => self.vertex_points(&faces),
        };
        positions.extend(self.edge_points(&faces, scheme));
        positions.extend(faces);
        self.quads(positions)
    }

    fn face_points(&self) -> Vec<DVec3> {
        let at = |corner: &u32| self.positions[*corner as usize];
        self.faces().map(|face| mean(self.corners[face].iter().map(at))).collect()
    }

    fn edge_points(&self, faces: &[DVec3], scheme: Scheme) -> Vec<DVec3> {
        let mut around = vec![DVec3::ZERO; self.ends.len()];
        if scheme == Scheme::CatmullClark {
            for (face, corners) in self.faces().enumerate() {
                self.edges[corners].iter().for_each(|edge| around[*edge as usize] += faces[face]);
            }
        }
        let point = |(([a, b], sharpness), faces): ((&[u32; 2], &f64), DVec3)| {
            let ends = self.positions[*a as usize] + self.positions[*b as usize];
            let middle = ends * 0.5;
            if scheme == Scheme::Linear || *sharpness >= 1.0 {
                return middle;
            }
            let smooth = (ends + faces) * 0.25;
            if *sharpness > 0.0 { smooth.lerp(middle, *sharpness) } else { smooth }
        };
        self.ends.iter().zip(&self.sharpness).zip(around).map(point).collect()
    }

    /// The new positions of vertices: (Q + 2R + (n − 3)V) / n, with Q the mean of the adjacent face points
    /// and R that of the midpoints of the n edges; on creases (a + 6V + b) / 8.
    fn vertex_points(&self, faces: &[DVec3]) -> Vec<DVec3> {
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        let mut valence = vec![0_u32; self.positions.len()];
        for (face, corners) in self.faces().enumerate() {
            self.corners[corners].iter().for_each(|vertex| sums[*vertex as usize] += faces[face]);
        }
        for [a, b] in &self.ends {
            for (here, there) in [(*a as usize, *b as usize), (*b as usize, *a as usize)] {
                sums[here] += self.positions[there];
                valence[here] += 1;
            }
        }
        let creases = self.creases();
        let list = self.positions.iter().zip(sums).zip(valence).enumerate();
        list.map(|(vertex, ((v, sum), n))| {
            if n == 0 || self.is_fixed(vertex) {
                return *v;
            }
            let n = f64::from(n);
            // Q is the sum of the faces over n; R is half of V plus half of the mean of the other ends.
            let smooth = sum / (n * n) + *v * ((n - 2.0) / n);
            match &creases {
                Some(creases) => creases[vertex].blend(smooth, *v, |others| (others + *v * 6.0) / 8.0),
                None => smooth,
            }
        })
        .collect()
    }

    /// Whether a vertex stays in place.
    pub(super) fn is_fixed(&self, vertex: usize) -> bool {
        self.fixed.get(vertex).copied().unwrap_or(false)
    }

    /// The sharp edges at each vertex; `None` if there are none at all.
    pub(super) fn creases(&self) -> Option<Vec<Crease>> {
        if self.sharpness.iter().all(|s| *s <= 0.0) {
            return None;
        }
        let mut creases = vec![Crease::default(); self.positions.len()];
        for ([a, b], sharpness) in self.ends.iter().zip(&self.sharpness).filter(|(_, s)| **s > 0.0) {
            for (here, there) in [(*a as usize, *b as usize), (*b as usize, *a as usize)] {
                let crease = &mut creases[here];
                crease.count += 1;
                crease.others += self.positions[there];
                crease.sharpness += sharpness;
            }
        }
        Some(creases)
    }

    /// The next level's faces and edges.
    fn quads(&self, positions: Vec<DVec3>) -> Level {
        let (n_vertices, n_edges, n_corners) =
            (self.positions.len() as u32, self.ends.len() as u32, self.corners.len());
        let mut next = Level {
            positions,
            fixed: self.fixed.clone(),
            starts: (0..=n_corners as u32).map(|face| face * 4).collect(),
            quads: true,
            corners: Vec::with_capacity(4 * n_corners),
            edges: Vec::with_capacity(4 * n_corners),
            twins: Vec::with_capacity(4 * n_corners),
            ends: Vec::with_capacity(2 * self.ends.len() + n_corners),
            sharpness: Vec::with_capacity(2 * self.ends.len() + n_corners),
            uvs: self.faces().flat_map(|face| quartered(self.uvs.get(face).unwrap_or_default())).collect(),
            normals: self
                .faces()
                .flat_map(|face| quartered(self.normals.get(face).unwrap_or_default()))
                .collect(),
        };
        for (edge, ([a, b], sharpness)) in (0..).zip(self.ends.iter().zip(&self.sharpness)) {
            next.ends.extend([[*a, n_vertices + edge], [*b, n_vertices + edge]]);
            next.sharpness.extend([(sharpness - 1.0).max(0.0); 2]);
        }
        for (number, face) in (0..).zip(self.faces()) {
            let middle = n_vertices + n_edges + number;
            for corner in face.clone() {
                let before = if corner == face.start { face.end - 1 } else { corner - 1 };
                let after = if corner + 1 == face.end { face.start } else { corner + 1 };
                let vertex = self.corners[corner];
                let (out, back) = (self.edges[corner], self.edges[before]);
                let half = |edge: u32| 2 * edge + u32::from(self.ends[edge as usize][0] != vertex);
                next.corners.extend([vertex, n_vertices + out, middle, n_vertices + back]);
                let spoke = |corner: usize| 2 * n_edges + corner as u32;
                next.edges.extend([half(out), spoke(corner), spoke(before), half(back)]);
                next.ends.push([n_vertices + out, middle]);
                let (out, back) = (self.twins[corner], self.twins[before]);
                next.twins.extend([
                    if out == NONE { NONE } else { 4 * self.after(out) + 3 },
                    4 * after as u32 + 2,
                    4 * before as u32 + 1,
                    if back == NONE { NONE } else { 4 * back },
                ]);
            }
        }
        next.sharpness.resize(next.ends.len(), 0.0);
        next
    }
}

/// The sharp edges at a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Crease {
    /// Their number.
    pub(super) count: u32,
    /// Sum of their other ends.
    pub(super) others: DVec3,
    /// Sum of their sharpnesses.
    pub(super) sharpness: f64,
}

impl Crease {
    /// Blends the smooth rule and the rule for sharp edges: with one sharp edge the vertex is smooth, with
    /// two it is on the crease, given by their other ends; with more it stays in place.
    pub(super) fn blend(&self, smooth: DVec3, stays: DVec3, crease: impl Fn(DVec3) -> DVec3) -> DVec3 {
        let sharp = match self.count {
            0 | 1 => return smooth,
            2 => crease(self.others),
            _ => stays,
        };
        let weight = self.sharpness / f64::from(self.count);
        if weight >= 1.0 { sharp } else { smooth.lerp(sharp, weight) }
    }
}

fn mean<T: Default + Add<Output = T> + Mul<f64, Output = T>>(list: impl Iterator<Item = T>) -> T {
    let (sum, count) = list.fold((T::default(), 0), |(sum, count), x| (sum + x, count + 1));
    sum * (1.0 / f64::from(count.max(1)))
}

/// The values at the corners of a face's quads, from those at its corners.
fn quartered<T: Copy + Default + Add<Output = T> + Mul<f64, Output = T>>(corners: &[T]) -> Vec<T> {
    let middle = mean(corners.iter().copied());
    let count = corners.len();
    let half = |a: T, b: T| (a + b) * 0.5;
    let quad = |(at, own): (usize, &T)| {
        let (after, before) = (corners[(at + 1) % count], corners[(at + count - 1) % count]);
        [*own, half(*own, after), middle, half(before, *own)]
    };
    corners.iter().enumerate().flat_map(quad).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn coordinates_are_cut_linearly() {
        let square = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
        let quads = quartered(&square);
        assert_eq!(quads.len(), 16);
        assert_eq!(&quads[..4], [DVec2::ZERO, DVec2::new(0.5, 0.0), DVec2::splat(0.5), DVec2::new(0.0, 0.5)]);
    }
}
