//! From polygons to triangles: meshes as they are, linearly refined, or Catmull-Clark surfaces.
//!
//! `topology` joins faces along edges, `refine` makes a level of the one before, `limit` moves vertices onto the limit
//! surface, `triangles` cuts what comes of it, `adaptive` chooses the level. Arithmetic is in 64 bits. Surface coordinates
//! are interpolated linearly within each face of the mesh. It must not know shaders.

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

/// What a mesh stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheme {
    /// The faces themselves; levels cut them finer.
    #[default]
    Linear,
    /// The smooth surface of E. Catmull and J. Clark, "Recursively generated B-spline surfaces on arbitrary
    /// topological meshes", 1978. Creases after T. DeRose, M. Kass and T. Truong, "Subdivision Surfaces in Character
    /// Animation", 1998; borders are creases.
    CatmullClark,
}

/// How finely a surface is cut.
#[derive(Clone, Copy, Debug)]
pub enum Detail<'a> {
    /// So many times into four.
    Level(u32),
    /// Until no edge in the picture is longer than a number of pixels.
    Pixels {
        /// The camera.
        view: &'a View,
        /// Pixels.
        edge: f64,
    },
}

/// A surface as triangles.
#[derive(Clone, Debug)]
pub struct Tessellated {
    /// The triangles.
    pub triangles: Triangles,
    /// How often faces were cut into four.
    pub level: u32,
    /// Whether the detail that was asked for is reached; a level always is.
    pub fine: bool,
    /// What was odd about the mesh.
    pub oddities: Oddities,
}

/// Cuts a mesh into triangles: all faces into four, as often as the detail asks, so that there are no cracks. Vertices of
/// a Catmull-Clark surface lie on the limit surface, with its normals.
///
/// # Errors
/// The mesh is wrong, or a level has too many triangles. Pixels only go as far as there may be triangles.
pub fn tessellate(mesh: &Mesh, scheme: Scheme, detail: &Detail<'_>) -> Result<Tessellated, MeshError> {
    tessellate_within(mesh, scheme, detail, &Scenes::default())
}

/// As [`tessellate`], with limits of its own.
///
/// # Errors
/// As those of [`tessellate`].
pub fn tessellate_within(
    mesh: &Mesh,
    scheme: Scheme,
    detail: &Detail<'_>,
    limits: &Scenes,
) -> Result<Tessellated, MeshError> {
    mesh.check_within(limits.corners)?;
    // Known before anything is made.
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

/// The finest level at which a mesh with so many corners has no more triangles than it may.
fn most_level(corners: usize, triangles: u64) -> u32 {
    // The first level has a quad for each corner, each further one four times as many.
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
