//! Random textures and scenes with fixed seeds: they are read or refused, within their memory, without a
//! panic.
use osl_image::{SubImage, Texture, decode_part};
use osl_limits::Limits;
use osl_scene::mesh::read_obj_within;
use osl_scene::scene::{Messages, SceneFiles};
use osl_scene::subdivide::{Detail, Scheme, tessellate_within};
use osl_tests::{scenes, textures};
use std::path::Path;

/// The bytes of a seed.
fn bytes(seed: u64) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let next = |_| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    (0..600).map(next).collect()
}

#[test]
fn textures_are_refused_or_read() {
    let mut limits = Limits::default();
    (limits.images.texture_memory, limits.images.working_memory) = (4 << 20, 4 << 20);
    let mut read = 0;
    for seed in 0..1500 {
        let (name, file) = textures::texture(&bytes(seed));
        for part in [0, 1] {
            match decode_part(Path::new(&name), &file, &limits, SubImage::Index(part)) {
                Ok(image) => {
                    let count = image.width * image.height * image.channels.len();
                    assert_eq!(image.samples.len(), count, "seed {seed}");
                    let _ = Texture::new(image).average();
                    read += 1;
                }
                // Panics of decoders are caught, but each one is a bug, here or in the decoder.
                Err(error) => {
                    assert!(!error.to_string().contains("the decoder failed"), "seed {seed}: {error}")
                }
            }
        }
    }
    assert!(read > 50, "only {read} of the files are pictures");
}

struct Itself<'a>(&'a str);

impl SceneFiles for Itself<'_> {
    fn include(&self, name: &str, _: &str) -> Result<(String, String), String> {
        Ok((name.to_owned(), self.0.to_owned()))
    }
}

#[test]
fn scenes_and_meshes_are_refused_or_read() {
    let mut limits = Limits::default();
    limits.scenes.triangles = 1 << 12;
    let mut read = 0;
    for seed in 0..1500 {
        let text = scenes::scene(&bytes(seed));
        let mut messages = Messages::within(&limits);
        let scene = osl_scene::scene::read("a.ass", &text, &Itself(&text), &mut messages);
        for surface in &scene.surfaces {
            let osl_scene::scene::Form::Mesh(polygons) = &surface.form else { continue };
            let detail = Detail::Level(polygons.iterations);
            if let Ok(found) = tessellate_within(&polygons.mesh, polygons.scheme, &detail, &limits) {
                assert!(found.triangles.indices.len() as u64 <= limits.scenes.triangles, "seed {seed}");
                let _ = osl_scene::mesh::Bvh::new(&found.triangles);
                read += 1;
            }
        }
        if let Ok(mesh) = read_obj_within(&scenes::mesh(&bytes(seed)), &limits) {
            let _ = tessellate_within(&mesh, Scheme::CatmullClark, &Detail::Level(1), &limits);
            read += 1;
        }
    }
    assert!(read > 30, "only {read} are meshes");
}
