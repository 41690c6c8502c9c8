//! Answers a shader's questions about its surroundings: attributes, data of the surface, named spaces, and
//! the folders of textures.
//!
//! `cargo run -p osl-examples --bin renderer_services` prints the values that a shader finds in a small
//! scene.

#![allow(clippy::print_stdout, reason = "its purpose is to print")]

use osl::{Error, Group, Points, Renderer, RendererServices, RunOptions, Shader, Value};
use std::path::{Path, PathBuf};

const SHADER: &str = "
    shader paint(float wear = 0 [[ int lockgeom = 0 ]], string picture = \"pebbles.png\", output color result = 0) {
        string name = \"nobody\";
        getattribute(\"object:name\", name);
        float fov = 0;
        getattribute(\"camera\", \"fov\", fov);
        point local = transform(\"trunk\", P);
        result = mix((color) texture(picture, u, v), color(0.2, 0.1, 0), wear);
        printf(\"%s: worn %.2f, at (%g) of the trunk, seen at %g degrees\\n\", name, wear, local, fov);
    }";

/// A scene with one trunk, which stands at (10, 0, 0).
struct Scene {
    /// Its wear, point by point.
    wear: Vec<f32>,
}

impl RendererServices for Scene {
    fn attribute(&self, object: &str, name: &str, _: usize) -> Option<Value> {
        match (object, name) {
            ("", "object:name") => Some("trunk".into()),
            ("camera", "fov") => Some(35.0.into()),
            _ => None,
        }
    }

    fn user_data(&self, name: &str, point: usize) -> Option<Value> {
        (name == "wear").then(|| self.wear.get(point).copied())?.map(Value::Float)
    }

    fn transform(&self, space: &str) -> Option<[f32; 16]> {
        let trunk = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 10., 0., 0., 1.];
        (space == "trunk").then_some(trunk)
    }

    fn texture_folders(&self) -> Vec<PathBuf> {
        vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("textures")]
    }
}

fn main() -> Result<(), Error> {
    let paint = Shader::compile("paint.osl", SHADER)?;
    let program = Group::new().layer("paint", &paint).compile(&["result"])?;
    let points = Points::new(3)
        .p(&[[10.0, 0.0, 0.0], [10.5, 1.0, 0.0], [11.0, 2.0, 0.0]])
        .u(&[0.1, 0.5, 0.9])
        .v(&[0.1, 0.5, 0.9]);
    // All programs of a scene share one renderer, which caches the textures.
    let renderer = Renderer::new(Scene { wear: vec![0.0, 0.25, 1.0] });
    let outputs = program.run_with(&points, &renderer, &RunOptions::default())?;
    print!("{}", outputs.printed());
    for message in outputs.messages() {
        println!("{}: {}", if message.error { "error" } else { "warning" }, message.text);
    }
    println!("{:.3?}", outputs.triples("result").unwrap_or_default());
    Ok(())
}
