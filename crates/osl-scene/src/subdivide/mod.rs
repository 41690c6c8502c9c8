//! From polygons to triangles: unchanged meshes, linear refinement, or Catmull-Clark surfaces.
//!
//! `topology` joins faces along edges, `refine` computes a level from the previous one, `limit` moves
//! vertices to the limit surface, `triangles` triangulates the result, and `adaptive` chooses the level. The
//! arithmetic is in double precision. Surface coordinates are interpolated linearly within each face of the
//! mesh. This module must not know shaders.

mod adaptive;
mod limit;
mod refine;
mod topology;
mod triangles;

pub(crate) use adaptive::choose;
pub use adaptive::longest_edge;

use crate::camera::View;
use crate::mesh::{Mesh, MeshError, Oddities, Triangles};
use osl_limits::Scenes;
use topology::Level;

/// The surface that a mesh represents.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheme {
    /// The faces themselves; levels only divide them.
    #[default]
    Linear,
    /// The smooth surface of E. Catmull and J. Clark, "Recursively generated B-spline surfaces on arbitrary
    /// topological meshes", 1978. Creases after T. DeRose, M. Kass and T. Truong, "Subdivision Surfaces in
    /// Character Animation", 1998; borders are creases.
    CatmullClark,
}

/// How finely a surface is divided.
#[derive(Clone, Copy, Debug)]
pub enum Detail<'a> {
    /// This many levels, each of which divides faces into four.
    Level(u32),
    /// Until no edge in the picture is longer than a number of pixels.
    Pixels {
        /// The camera.
        view: &'a View,
        /// The maximum length in pixels.
        edge: f64,
    },
}

/// A surface as triangles.
#[derive(Clone, Debug)]
pub struct Tessellated {
    /// The triangles.
    pub triangles: Triangles,
    /// The number of levels.
    pub level: u32,
    /// Whether the requested detail was reached; a level always is.
    pub fine: bool,
    /// Irregularities of the mesh.
    pub oddities: Oddities,
}

/// Divides a mesh into triangles: each level divides all faces into four, so that there are no cracks.
/// Vertices of a Catmull-Clark surface are on the limit surface and have its normals.
///
/// # Errors
/// The mesh is invalid, or a level has too many triangles. A detail in pixels stops at the permitted number
/// instead.
pub fn tessellate(mesh: &Mesh, scheme: Scheme, detail: &Detail<'_>) -> Result<Tessellated, MeshError> {
    tessellate_within(mesh, scheme, detail, &Scenes::default())
}

/// Like [`tessellate`], with explicit limits.
///
/// # Errors
/// Those of [`tessellate`].
pub fn tessellate_within(
    mesh: &Mesh,
    scheme: Scheme,
    detail: &Detail<'_>,
    limits: &Scenes,
) -> Result<Tessellated, MeshError> {
    mesh.check_within(limits.corners)?;
    // Checked before anything is allocated.
    if let Detail::Level(level) = *detail
        && (level > most_level(mesh.corners.len(), limits.triangles)
            || mesh.corners.len() as u64 > limits.triangles)
    {
        return Err(MeshError::TooFine { most: limits.triangles });
    }
    let (base, oddities) = Level::new(mesh, scheme)?;
    let most = |triangles| most_level(base.corners.len(), triangles);
    match *detail {
        Detail::Level(level) => {
            let triangles = at_level(&base, level, scheme);
            Ok(Tessellated { triangles, level, fine: true, oddities })
        }
        Detail::Pixels { view, edge } => {
            let (triangles, level, fine) = choose(
                |level| at_level(&base, level, scheme),
                most(limits.pixel_triangles.min(limits.triangles)),
                view,
                edge,
            );
            Ok(Tessellated { triangles, level, fine, oddities })
        }
    }
}

/// The finest level at which a mesh with this many corners stays within the permitted number of triangles.
fn most_level(corners: usize, triangles: u64) -> u32 {
    // The first level has one quad per corner, each further level four times as many.
    (0..30).take_while(|level| (corners as u64).saturating_mul(2 << (2 * level)) <= triangles).count() as u32
}

fn at_level(base: &Level, level: u32, scheme: Scheme) -> Triangles {
    match level {
        0 => triangles::of_base(base, scheme),
        _ => {
            let mut current = base.refine(scheme);
            for _ in 1..level {
                current = current.refine(scheme);
            }
            triangles::of_quads(&current, scheme)
        }
    }
}
