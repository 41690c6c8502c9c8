//! Any text as a scene: the reader, and what becomes of a scene that it takes, up to a picture of a few pixels.
//!
//! A panic, a hang, or no world without a reason is a bug. Files include the text itself.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osl_exec::Services;
use osl_ir::group::text::Shaders;
use osl_ir::hir;
use osl_scene::render::{RenderOptions, render};
use osl_scene::scene::{self, Messages, Networks, SceneFiles, Surroundings};
use osl_syntax::{NoFiles, Options};
use oslrun::pipeline;
use std::collections::HashMap;
use std::sync::{Arc, LazyLock};

struct Itself<'a>(&'a str);

impl SceneFiles for Itself<'_> {
    fn include(&self, name: &str, _: &str) -> Result<(String, String), String> {
        if name.len() > 8 { Err("no such file".to_owned()) } else { Ok((name.to_owned(), self.0.to_owned())) }
    }
}

/// The shaders that are built in, read once.
struct BuiltIn;

static KNOWN: LazyLock<HashMap<String, Arc<hir::Program>>> = LazyLock::new(|| {
    let names = ["lambert", "standard", "ramp", "fractal", "nonlinear_noise"];
    let read = |name: &str| {
        let text = oslrun::nodes::find(name)?;
        let program = pipeline::check("fuzz.osl", text, &NoFiles, &Options::default()).program?;
        Some((name.to_owned(), Arc::new(program)))
    };
    names.into_iter().filter_map(read).collect()
});

impl Shaders for BuiltIn {
    fn load(&mut self, name: &str) -> Result<(Arc<hir::Program>, u32), String> {
        KNOWN.get(name).map(|program| (program.clone(), 0)).ok_or_else(|| "there is none".to_owned())
    }
}

/// Faces of a scene that is built; larger ones are read alone.
const MAX_FACES: u64 = 1 << 12;

fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    let mut messages = Messages::default();
    let scene = scene::read("fuzz.ass", &text, &Itself(&text), &mut messages);
    let faces: u64 = scene
        .surfaces
        .iter()
        .map(|surface| match &surface.form {
            scene::Form::Mesh(p) => (p.mesh.corners.len() as u64) << (2 * p.iterations),
            _ => 0,
        })
        .sum();
    let displaced = scene.surfaces.iter().any(|s| s.displacement.is_some());
    if messages.failed() || faces > MAX_FACES || scene.surfaces.len() > 16 || displaced && faces == 0 {
        return;
    }
    let mut shaders = BuiltIn;
    let mut networks = Networks::new(&scene, &mut shaders, &mut messages);
    let around = Surroundings { size: Some([4, 3]), services: &Services::default };
    match scene::build(&scene, &mut networks, &around, &mut messages) {
        None => assert!(messages.failed()),
        Some(world) => {
            let options = RenderOptions { samples: 1, ..RenderOptions::default() };
            let _ = render(&world, &options, &|_| ());
        }
    }
});
