//! From forms to triangles: subdivided, displaced, in common space.

use super::describe::{Form, Surface};
use super::message::Messages;
use super::network::Network;
use crate::mesh::Triangles;
use osl_exec::Services;

/// The triangles of a surface; `None` after an error.
pub(super) fn tessellate(
    surface: &Surface,
    _moved: Option<&Network>,
    _services: &Services,
    messages: &mut Messages,
) -> Option<Triangles> {
    let mut triangles = Triangles::default();
    match &surface.form {
        Form::Mesh(polygons) => {
            let mesh = &polygons.mesh;
            triangles.positions = mesh.positions.clone();
            triangles.places = (0..mesh.positions.len() as u32).collect();
            triangles.uvs = vec![glam::Vec2::ZERO; mesh.positions.len()];
            for (first, n) in mesh.faces() {
                for k in 2..n {
                    triangles.indices.push([mesh.corners[first], mesh.corners[first + k - 1], mesh.corners[first + k]]);
                }
            }
        }
        _ => {
            messages.error(&surface.place, "not yet");
        }
    }
    triangles.transform(&surface.matrix);
    triangles.renew_normals();
    triangles.renew_tangents();
    Some(triangles)
}
