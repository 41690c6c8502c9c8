//! Scenes and shaders from text.

use osl::stages;
use osl_exec::Services;
use osl_hir::hir;
use osl_lower::group::text::Shaders;
use osl_scene::render::{Picture, RenderOptions, World, render};
use osl_scene::scene::{self, Messages, Networks, SceneFiles, Surroundings};
use osl_syntax::source::SourceMap;
use osl_syntax::{NoFiles, Options};
use std::sync::Arc;

/// Shaders given by their texts; each has the name in its text.
pub(crate) struct Texts<'a>(pub(crate) &'a [&'a str]);

impl Shaders for Texts<'_> {
    fn load(&mut self, name: &str) -> Result<(Arc<hir::Program>, u32), String> {
        for text in self.0 {
            let checked = stages::check("test.osl", text, &NoFiles, &Options::default());
            let program = checked.program.ok_or("it has errors")?;
            if &*program.shader.name == name {
                let mut sources = SourceMap::default();
                let base = sources.append(&checked.sources).unwrap_or_default();
                return Ok((Arc::new(program), base));
            }
        }
        Err("there is none".to_string())
    }
}

/// No file includes another.
pub(crate) struct NoIncludes;

impl SceneFiles for NoIncludes {
    fn include(&self, _: &str, _: &str) -> Result<(String, String), String> {
        Err("no such file".to_string())
    }
}

/// The world of a scene, or the messages about it.
pub(crate) fn world(text: &str, shaders: &[&str], size: [usize; 2]) -> Result<World, String> {
    let mut messages = Messages::default();
    let scene = scene::read("test.ass", text, &NoIncludes, &mut messages);
    let mut texts = Texts(shaders);
    let mut networks = Networks::new(&scene, &mut texts, &mut messages);
    let around = Surroundings { size: Some(size), services: &Services::default };
    let world = scene::build(&scene, &mut networks, &around, &mut messages);
    let said: Vec<String> = messages.list().iter().map(ToString::to_string).collect();
    world.ok_or_else(|| said.join("\n"))
}

/// A picture of a valid scene.
pub(crate) fn picture(text: &str, shaders: &[&str], size: [usize; 2], options: RenderOptions) -> Picture {
    let world = world(text, shaders, size).unwrap();
    render(&world, &options, &|_| ()).unwrap()
}

/// The mean of each channel over the pixels for which `wanted` is true, with its standard error.
pub(crate) fn mean(picture: &Picture, wanted: impl Fn(usize, usize) -> bool) -> [(f64, f64); 3] {
    [0, 1, 2].map(|channel| {
        let plane = &picture.layers[0].planes[channel];
        let pixels = (0..plane.len()).filter(|at| wanted(at % picture.width, at / picture.width));
        let values: Vec<f64> = pixels.map(|at| f64::from(plane[at])).collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0);
        (mean, (variance / n).sqrt())
    })
}
