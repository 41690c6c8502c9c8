//! Converts the arrays of a polymesh to a mesh. Values out of range are errors; irregularities are reported
//! when the mesh is built.

use super::fields::Fields;
use crate::mesh::Mesh;
use crate::subdivide::Scheme;
use glam::{Vec2, Vec3};

/// A `polymesh`.
#[derive(Clone, Debug, Default)]
pub struct Polygons {
    /// The mesh, in object space. It has passed [`Mesh::check`].
    pub mesh: Mesh,
    /// Whether normals are smooth across edges.
    pub smooth: bool,
    /// The subdivision scheme.
    pub scheme: Scheme,
    /// The number of subdivisions.
    pub iterations: u32,
}

/// Reads the polygons of a node; `None` after an error.
pub(super) fn polygons(fields: &mut Fields<'_>) -> Option<Polygons> {
    let place = fields.place();
    let points = fields.groups::<3>("vlist");
    let (sides, corners) = (fields.indices("nsides"), fields.indices("vidxs"));
    let (normals, normal_corners) = (fields.groups::<3>("nlist"), fields.indices("nidxs"));
    let (uvs, uv_corners) = (fields.groups::<2>("uvlist"), fields.indices("uvidxs"));
    let smooth = fields.flag("smoothing", false);
    let (scheme, iterations) = subdivision(fields);
    let (Some(points), Some(corners)) = (points, corners) else {
        if !fields.messages.failed() {
            fields.messages.error(place, "a polymesh has points (`vlist`) and corners (`vidxs`)");
        }
        return None;
    };
    let uvs: Vec<Vec2> = uvs.unwrap_or_default().into_iter().map(Vec2::from_array).collect();
    let normals: Vec<Vec3> = normals.unwrap_or_default().into_iter().map(Vec3::from_array).collect();
    let lists = (points.len(), &corners);
    let uv_corners = indices(fields, "uvlist", lists, uvs.len(), uv_corners);
    let normal_corners = indices(fields, "nlist", lists, normals.len(), normal_corners);
    let mesh = Mesh {
        positions: points.into_iter().map(Vec3::from_array).collect(),
        // Without `nsides`, all polygons are triangles.
        face_sizes: sides.unwrap_or_else(|| vec![3; corners.len() / 3]),
        uvs: if uv_corners.is_empty() { Vec::new() } else { uvs },
        normals: if normal_corners.is_empty() { Vec::new() } else { normals },
        corners,
        uv_corners,
        normal_corners,
        creases: Vec::new(),
    };
    match mesh.check_within(fields.messages.limits().scenes.corners) {
        Err(why) => {
            fields.messages.error(place, format!("the mesh cannot be used: {why}"));
            None
        }
        Ok(()) => Some(Polygons { mesh, smooth, scheme, iterations }),
    }
}

/// The value index of each corner, if the file leaves it out: one value per vertex, or one per corner.
fn indices(
    fields: &mut Fields<'_>,
    name: &str,
    (points, corners): (usize, &Vec<u32>),
    values: usize,
    given: Option<Vec<u32>>,
) -> Vec<u32> {
    match given {
        Some(list) => list,
        None if values == 0 => Vec::new(),
        None if values == points => corners.clone(),
        None if values == corners.len() => (0..values as u32).collect(),
        None => {
            let text = format!(
                "`{name}` has {values} values for {points} points and {} corners: no effect",
                corners.len()
            );
            fields.messages.warning(fields.place(), text);
            Vec::new()
        }
    }
}

fn subdivision(fields: &mut Fields<'_>) -> (Scheme, u32) {
    let wanted = fields.int("subdiv_iterations", 1, (0, 64));
    let place = fields.place();
    let most = u32::try_from(fields.messages.limits().scenes.subdivisions).unwrap_or(u32::MAX);
    if wanted > most {
        let text = format!("{wanted} subdivisions are too many; it is subdivided {most} times");
        fields.messages.warning(place, text);
    }
    let times = wanted.min(most);
    match fields.word("subdiv_type").map(|w| w.text.as_str()) {
        None | Some("none") => (Scheme::Linear, 0),
        Some("catclark") => (Scheme::CatmullClark, times),
        Some("linear") => (Scheme::Linear, times),
        Some(other) => {
            fields
                .messages
                .warning(place, format!("subdiv_type `{other}` is not known: it is not subdivided"));
            (Scheme::Linear, 0)
        }
    }
}
