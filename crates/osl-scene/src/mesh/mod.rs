//! Meshes: polygons from scenes and files, and triangles for rendering.
//!
//! `Mesh` is the input, checked by [`Mesh::check`]; `Triangles` is what `subdivide` makes of it.

mod bvh;
mod normals;
mod obj;
mod tree;
mod triangles;

pub use bvh::{Bvh, MeshHit};
pub use obj::{ObjError, read_obj, read_obj_within};
pub use triangles::{Bounds, SurfacePoint, Triangles};

use glam::{Mat4, Vec2, Vec3};
use osl_limits::{Halt, Limits};
use std::fmt;

/// A mesh of polygons.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The vertices.
    pub positions: Vec<Vec3>,
    /// Number of corners of each face. Their sum is the number of corners.
    pub face_sizes: Vec<u32>,
    /// For each corner, face by face, the index of its vertex. Corners run counterclockwise as seen from
    /// outside.
    pub corners: Vec<u32>,
    /// Surface coordinates; may be empty.
    pub uvs: Vec<Vec2>,
    /// For each corner, the index of its surface coordinates; empty if there are none.
    pub uv_corners: Vec<u32>,
    /// Shading normals; may be empty.
    pub normals: Vec<Vec3>,
    /// For each corner, the index of its normal; empty if there are none.
    pub normal_corners: Vec<u32>,
    /// Edges that stay sharp: two vertices, and the number of subdivision levels.
    pub creases: Vec<([u32; 2], f32)>,
}

/// The largest permitted coordinate of a vertex: sums of box areas still fit in a single-precision float.
pub const FARTHEST: f32 = 1e12;

/// What is wrong with a mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// The sizes of the faces do not add up to the corners.
    #[error("the faces have {sizes} corners, but {corners} are listed")]
    Corners {
        /// Sum of the sizes.
        sizes: u64,
        /// Listed corners.
        corners: usize,
    },
    /// A list with one entry per corner has a different length.
    #[error("there are {corners} corners, but {count} of their {what}")]
    Count {
        /// The name of the list.
        what: &'static str,
        /// Corners of the mesh.
        corners: usize,
        /// Entries of the list.
        count: usize,
    },
    /// An index beyond its list.
    #[error("{what} {index} does not exist: there are {count}")]
    Index {
        /// The name of the index list.
        what: &'static str,
        /// The index.
        index: u32,
        /// How many there are.
        count: usize,
    },
    /// A coordinate is not a finite number.
    #[error("{what} {index} is not finite")]
    NotFinite {
        /// The name of the coordinate list.
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// A vertex so far away that squared distances overflow single precision.
    #[error("vertex {index} is farther than {FARTHEST:e} from the origin")]
    Far {
        /// Its index.
        index: usize,
    },
    /// There is nothing to render.
    #[error("the mesh has no faces")]
    Empty,
    /// There are more vertices or corners than can be numbered.
    #[error("the mesh has more than {most} corners or vertices (--limit scenes.corners=N)")]
    TooLarge {
        /// The permitted number.
        most: u64,
    },
    /// The subdivision would produce too many triangles.
    #[error("there would be more than {most} triangles (--limit scenes.triangles=N)")]
    TooFine {
        /// The permitted number.
        most: u64,
    },
    /// The command has to stop.
    #[error("{0}")]
    Halted(Halt),
}

/// Irregularities of a mesh that do not prevent rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Oddities {
    /// Faces with fewer than three distinct corners, which are left out.
    pub degenerate_faces: usize,
    /// Edges with more than two faces, or with two faces of opposite orientation, which stay sharp.
    pub bad_edges: usize,
    /// Vertices at which parts of the surface only touch, which stay in place.
    pub bad_vertices: usize,
}

impl Oddities {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        *self == Oddities::default()
    }
}

impl fmt::Display for Oddities {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = [
            (self.degenerate_faces, "faces with fewer than three corners, left out"),
            (self.bad_edges, "edges that do not join two faces of one side, kept sharp"),
            (self.bad_vertices, "vertices where surfaces merely touch, kept in place"),
        ];
        for (at, (count, what)) in list.into_iter().filter(|(count, _)| *count > 0).enumerate() {
            write!(f, "{}{count} {what}", if at > 0 { "; " } else { "" })?;
        }
        Ok(())
    }
}

impl Mesh {
    /// Checks that all indices and numbers are valid. Subdivision tolerates other irregularities.
    ///
    /// # Errors
    /// The first problem found.
    pub fn check(&self) -> Result<(), MeshError> {
        self.check_within(Limits::default().scenes.corners)
    }

    /// Like [`Mesh::check`], with a maximum number of corners and vertices.
    ///
    /// # Errors
    /// The first problem found.
    pub fn check_within(&self, most: u64) -> Result<(), MeshError> {
        let corners = self.corners.len();
        // Places are numbered with 32 bits, and each level multiplies them by four.
        if corners.max(self.positions.len()) as u64 > most.min(1 << 28) {
            return Err(MeshError::TooLarge { most });
        }
        let sizes: u64 = self.face_sizes.iter().map(|n| u64::from(*n)).sum();
        if sizes != corners as u64 {
            return Err(MeshError::Corners { sizes, corners });
        }
        if corners == 0 {
            return Err(MeshError::Empty);
        }
        indices("vertex", &self.corners, self.positions.len())?;
        for (what, list, values) in [
            ("surface coordinates", &self.uv_corners, self.uvs.len()),
            ("normals", &self.normal_corners, self.normals.len()),
        ] {
            if !list.is_empty() && list.len() != corners {
                return Err(MeshError::Count { what, corners, count: list.len() });
            }
            indices(what, list, values)?;
        }
        for (ends, _) in &self.creases {
            indices("vertex of a crease", ends, self.positions.len())?;
        }
        finite("vertex", self.positions.iter().map(|p| p.is_finite()))?;
        if let Some(index) = self.positions.iter().position(|p| p.abs().max_element() > FARTHEST) {
            return Err(MeshError::Far { index });
        }
        finite("surface coordinate", self.uvs.iter().map(|p| p.is_finite()))?;
        finite("normal", self.normals.iter().map(|p| p.is_finite()))
    }

    /// Moves the mesh by a matrix.
    pub fn transform(&mut self, matrix: &Mat4) {
        self.positions.iter_mut().for_each(|p| *p = matrix.transform_point3(*p));
        let for_normals = matrix.inverse().transpose();
        let turn = |n: &mut Vec3| *n = for_normals.transform_vector3(*n).normalize_or(*n);
        self.normals.iter_mut().for_each(turn);
    }

    /// The faces: the first corner of each and its number of corners.
    pub fn faces(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.face_sizes.iter().scan(0, |first, size| {
            let here = *first;
            *first += *size as usize;
            Some((here, *size as usize))
        })
    }
}

fn indices(what: &'static str, list: &[u32], count: usize) -> Result<(), MeshError> {
    match list.iter().find(|i| **i as usize >= count) {
        Some(index) => Err(MeshError::Index { what, index: *index, count }),
        None => Ok(()),
    }
}

fn finite(what: &'static str, mut list: impl Iterator<Item = bool>) -> Result<(), MeshError> {
    match list.position(|finite| !finite) {
        Some(index) => Err(MeshError::NotFinite { what, index }),
        None => Ok(()),
    }
}
