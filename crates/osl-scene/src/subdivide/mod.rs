//! From polygons to triangles: unchanged meshes, linear refinement, or Catmull-Clark surfaces.
//!
//! `topology` joins faces along edges, `refine` computes a level from the previous one, `limit` moves
//! vertices to the limit surface, `triangles` triangulates the result, and `adaptive` chooses the level. The
//! arithmetic is in double precision. Surface coordinates are interpolated linearly within each face of the
//! mesh.

mod adaptive;
mod limit;
mod refine;
mod topology;
mod triangles;

pub(crate) use adaptive::choose;
pub use adaptive::longest_edge;

use crate::camera::View;
use crate::mesh::{Mesh, MeshError, Oddities, Triangles};
use osl_limits::Limits;
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
    /// This many levels. Each level divides every face into four.
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
    tessellate_within(mesh, scheme, detail, &Limits::default())
}

/// Like [`tessellate`], with explicit limits.
///
/// # Errors
/// Those of [`tessellate`]; the command has to stop.
pub fn tessellate_within(
    mesh: &Mesh,
    scheme: Scheme,
    detail: &Detail<'_>,
    limits: &Limits,
) -> Result<Tessellated, MeshError> {
    let bounds = &limits.scenes;
    mesh.check_within(bounds.corners)?;
    // Checked before anything is allocated.
    if let Detail::Level(level) = *detail
        && (level > most_level(mesh.corners.len(), bounds.triangles)
            || mesh.corners.len() as u64 > bounds.triangles)
    {
        return Err(MeshError::TooFine { most: bounds.triangles });
    }
    let (base, oddities) = Level::new(mesh, scheme)?;
    let most = |triangles| most_level(base.corners.len(), triangles);
    match *detail {
        Detail::Level(level) => {
            let triangles = at_level(&base, level, scheme, limits)?;
            Ok(Tessellated { triangles, level, fine: true, oddities })
        }
        Detail::Pixels { view, edge } => {
            let (triangles, level, fine) = choose(
                |level| at_level(&base, level, scheme, limits),
                most(bounds.pixel_triangles.min(bounds.triangles)),
                view,
                edge,
            )?;
            Ok(Tessellated { triangles, level, fine, oddities })
        }
    }
}

/// The finest level at which a mesh with this many corners stays within the permitted number of triangles.
fn most_level(corners: usize, triangles: u64) -> u32 {
    // The first level has one quad per corner, each further level four times as many.
    (0..30).take_while(|level| (corners as u64).saturating_mul(2 << (2 * level)) <= triangles).count() as u32
}

/// The triangles of a level. Fails before a level if the command has to stop.
fn at_level(base: &Level, level: u32, scheme: Scheme, limits: &Limits) -> Result<Triangles, MeshError> {
    let goes_on = || limits.halted().map_or(Ok(()), |why| Err(MeshError::Halted(why)));
    goes_on()?;
    Ok(match level {
        0 => triangles::of_base(base, scheme),
        _ => {
            let mut current = base.refine(scheme);
            for _ in 1..level {
                goes_on()?;
                current = current.refine(scheme);
            }
            goes_on()?;
            triangles::of_quads(&current, scheme)
        }
    })
}
