//! Reads meshes from the text of OBJ files.

use super::{Mesh, MeshError};
use glam::{Vec2, Vec3};
use osl_limits::Limits;
use std::collections::HashMap;

/// Why an OBJ file was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObjError {
    /// A line that cannot be read.
    #[error("{0}")]
    Text(String),
    /// A vertex index that no file can have.
    #[error("line {line}: `{token}` is no vertex")]
    Vertex {
        /// The line, from 1.
        line: usize,
        /// The text of the index.
        token: String,
    },
    /// Its mesh is invalid.
    #[error("{0}")]
    Mesh(#[from] MeshError),
}

/// Maximum number of digits of a vertex index: more do not fit 32 bits.
const MAX_DIGITS: usize = 9;

/// Reads the faces of an OBJ file; materials, lines and points are ignored. Objects and groups become one
/// mesh, joined where they share positions.
///
/// # Errors
/// A line or the mesh is invalid.
pub fn read_obj(text: &str) -> Result<Mesh, ObjError> {
    read_obj_within(text, &Limits::default())
}

/// Like [`read_obj`], with explicit limits.
///
/// # Errors
/// A line or the mesh is invalid.
pub fn read_obj_within(text: &str, limits: &Limits) -> Result<Mesh, ObjError> {
    let most = limits.scenes.corners;
    numbers_are_sane(text, most)?;
    let options =
        tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..tobj::LoadOptions::default() };
    let no_materials = |_: &std::path::Path| Ok((Vec::new(), std::collections::HashMap::default()));
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials)
        .map_err(|e| ObjError::Text(e.to_string()))?;
    let mut joined = Joined::default();
    for model in models {
        joined.add(model.mesh, most)?;
    }
    let mesh = joined.finish();
    mesh.check_within(most)?;
    Ok(mesh)
}

/// The library multiplies indices before it checks them, and reads all faces before it reports their number.
fn numbers_are_sane(text: &str, most: u64) -> Result<(), ObjError> {
    let mut corners = 0;
    for (line, content) in text.lines().enumerate() {
        let mut words = content.split_whitespace();
        if !matches!(words.next(), Some("f" | "l")) {
            continue;
        }
        corners += words.clone().count() as u64;
        if corners > most {
            return Err(MeshError::TooLarge { most }.into());
        }
        if let Some(token) = words.find(|word| word.split('/').any(|n| n.len() > MAX_DIGITS)) {
            let token = token.chars().take(40).collect();
            return Err(ObjError::Vertex { line: line + 1, token });
        }
    }
    Ok(())
}

/// The parts of a file, joined into one mesh.
#[derive(Default)]
struct Joined {
    mesh: Mesh,
    /// Vertices of the parts so far, by the bits of their positions.
    known: HashMap<[u32; 3], u32>,
    /// Whether all parts so far have coordinates, and whether all have normals.
    complete: Option<[bool; 2]>,
}

impl Joined {
    fn add(&mut self, piece: tobj::Mesh, most: u64) -> Result<(), MeshError> {
        let mesh = &mut self.mesh;
        if (mesh.corners.len() + piece.indices.len()) as u64 > most {
            return Err(MeshError::TooLarge { most });
        }
        if piece.indices.is_empty() {
            return Ok(());
        }
        let triples = |list: &[f32]| -> Vec<Vec3> { list.chunks_exact(3).map(Vec3::from_slice).collect() };
        // Adding zero gives zeros the same sign, so that equal positions have equal bits.
        let key = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
        let mut own = Vec::new();
        let mut new = Vec::new();
        for p in triples(&piece.positions) {
            let next = mesh.positions.len() as u32;
            let vertex = self.known.get(&key(p)).copied().unwrap_or(next);
            if vertex == next {
                mesh.positions.push(p);
                new.push((key(p), next));
            }
            own.push(vertex);
        }
        // Vertices of one part stay separate even if they have the same position, as in the file.
        self.known.extend(new);
        let vertex = |at: &u32| own.get(*at as usize).copied().unwrap_or(u32::MAX);
        mesh.corners.extend(piece.indices.iter().map(vertex));
        if piece.face_arities.is_empty() {
            mesh.face_sizes.extend(std::iter::repeat_n(3, piece.indices.len() / 3));
        } else {
            mesh.face_sizes.extend(piece.face_arities.iter().filter(|n| **n > 0));
        }
        let count = piece.indices.len();
        let has = [piece.texcoord_indices.len() == count, piece.normal_indices.len() == count];
        let so_far = self.complete.unwrap_or([true; 2]);
        self.complete = Some([so_far[0] && has[0], so_far[1] && has[1]]);
        let (uv, normal) = (mesh.uvs.len() as u32, mesh.normals.len() as u32);
        mesh.uvs.extend(piece.texcoords.chunks_exact(2).map(Vec2::from_slice));
        mesh.normals.extend(triples(&piece.normals));
        mesh.uv_corners.extend(piece.texcoord_indices.iter().map(|at| at.saturating_add(uv)));
        mesh.normal_corners.extend(piece.normal_indices.iter().map(|at| at.saturating_add(normal)));
        Ok(())
    }

    /// The mesh, without the data that only some faces have.
    fn finish(mut self) -> Mesh {
        let [uvs, normals] = self.complete.unwrap_or_default();
        if !uvs {
            self.mesh.uvs.clear();
            self.mesh.uv_corners.clear();
        }
        if !normals {
            self.mesh.normals.clear();
            self.mesh.normal_corners.clear();
        }
        self.mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn polygons_coordinates_and_normals_are_read() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n\
                    f 1/1/1 2/2/1 3/3/1 4/4/1\ng second\nf 2/1/1 5/2/1 3/4/1\n";
        let mesh = read_obj(text).unwrap();
        assert_eq!(mesh.face_sizes, [4, 3]);
        assert_eq!(mesh.positions.len(), 5, "groups share their vertices");
        assert_eq!(mesh.corners, [0, 1, 2, 3, 1, 4, 2]);
        let uv = |corner: usize| mesh.uvs[mesh.uv_corners[corner] as usize];
        assert_eq!((uv(0), uv(2), uv(6)), (Vec2::ZERO, Vec2::ONE, Vec2::Y));
        assert_eq!(mesh.normals[mesh.normal_corners[4] as usize], Vec3::Z);
    }

    #[test]
    fn what_is_wrong_is_said() {
        assert_eq!(read_obj("").unwrap_err(), ObjError::Mesh(MeshError::Empty));
        assert!(matches!(read_obj("v 0 0 0\nf 1 2 3\n"), Err(ObjError::Text(_))));
        assert!(matches!(read_obj("v 0 0\n"), Err(ObjError::Text(_))));
        let huge = read_obj("v 0 0 0\nf 1 2 -9223372036854775808\n").unwrap_err();
        assert!(huge.to_string().starts_with("line 2: `-92233"), "{huge}");
        let nan = read_obj("v 0 0 0\nv 1 0 0\nv nan 0 0\nf 1 2 3\n").unwrap_err();
        assert_eq!(nan, ObjError::Mesh(MeshError::NotFinite { what: "vertex", index: 2 }));
    }

    proptest! {
        #[test]
        fn hostile_text_is_read_or_refused(lines in prop::collection::vec(
            "(v|vt|vn|f|l|o|g|usemtl|mtllib|#|)( (-?[0-9]{1,3}|nan|inf|1e39|-?[0-9]{0,2}/-?[0-9]{0,2}/-?[0-9]{0,12}|é)){0,5}",
            0..12,
        )) {
            let _ = read_obj(&lines.join("\n"));
        }

        #[test]
        fn any_text_is_read_or_refused(text in "\\PC{0,80}") {
            let _ = read_obj(&text);
        }
    }
}
