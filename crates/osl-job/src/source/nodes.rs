//! The built-in shaders: those of `osl/nodes`, which networks need in addition to the user's shaders.
//!
//! A group's shaders are searched for here last, so that a file of the same name takes precedence. A test
//! compares the list with the folder.

macro_rules! nodes {
    ($($name:literal)*) => {
        /// Name and source text of each, by name.
        const NODES: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../../../../osl/nodes/", $name, ".osl")))),*];
    };
}

nodes! {
    "bump" "chaos_image" "clamp" "color_correct" "displacement_layer" "fractal" "image" "lambert" "mix" "project_cylindrical"
    "project_planar" "project_spherical" "project_triplanar" "ramp" "remap" "standard" "uv_transform"
}

/// Shaders of this project that are not nodes, but that scenes name.
const PATTERNS: [(&str, &str); 2] = [
    ("nonlinear_noise", include_str!("../../../../osl/nonlinear_noise.osl")),
    ("strips", include_str!("../../../../osl/strips.osl")),
];

/// The shaders of previews, which no scene or group finds by name.
const PREVIEWS: [(&str, &str); 3] = [
    ("camera_ray", include_str!("preview/camera_ray.osl")),
    ("preview_floor", include_str!("preview/preview_floor.osl")),
    ("preview_material", include_str!("preview/preview_material.osl")),
];

/// The source text of a shader of previews.
pub fn preview(name: &str) -> Option<&'static str> {
    PREVIEWS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// The names of all nodes, in order.
pub fn names() -> impl Iterator<Item = &'static str> {
    NODES.iter().map(|(name, _)| *name)
}

/// The source text of a node or of another built-in shader.
pub fn find(name: &str) -> Option<&'static str> {
    let node = NODES.binary_search_by_key(&name, |(name, _)| name).ok().and_then(|at| NODES.get(at));
    node.or_else(|| PATTERNS.iter().find(|(n, _)| *n == name)).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn the_list_is_the_folder() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl/nodes");
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut files: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        files.sort();
        assert_eq!(names().map(|name| format!("{name}.osl")).collect::<Vec<_>>(), files);
        assert!(names().all(|name| find(name).is_some()), "the list is sorted");
        assert_eq!(find("nothing"), None);
    }
}
