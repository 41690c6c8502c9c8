//! Rays per second for each shipped scene. Expect: half a million and more on two cores, fewer with
//! subsurface scattering.

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench stops where something is missing")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use osl::stages;
use osl_exec::Services;
use osl_hir::hir;
use osl_lower::group::text::Shaders;
use osl_scene::render::{RenderOptions, World, render};
use osl_scene::scene::{self, Messages, Networks, SceneFiles, Surroundings};
use osl_syntax::{NoFiles, Options};
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The shaders of the repository; those with missing brackets in repaired form.
struct Repository;

impl Shaders for Repository {
    fn load(&mut self, name: &str) -> Result<(Arc<hir::Program>, u32), String> {
        let repaired = root().join(format!("tests/data/seeds/{name}.repaired.osl"));
        let folders =
            ["osl", "osl/nodes", "examples/scenes"].map(|f| root().join(f).join(format!("{name}.osl")));
        let file = std::iter::once(repaired).chain(folders).find(|p| p.is_file()).ok_or("there is none")?;
        let text = std::fs::read_to_string(file).map_err(|e| e.to_string())?;
        let checked = stages::check("bench.osl", &text, &NoFiles, &Options::default());
        Ok((Arc::new(checked.program.ok_or("it has errors")?), 0))
    }
}

struct Beside;

impl SceneFiles for Beside {
    fn include(&self, name: &str, _: &str) -> Result<(String, String), String> {
        let path = root().join("examples/scenes").join(name);
        std::fs::read_to_string(path).map(|text| (name.to_string(), text)).map_err(|e| e.to_string())
    }
}

fn world(path: &Path) -> World {
    let mut messages = Messages::default();
    let text = std::fs::read_to_string(path).unwrap();
    let scene = scene::read("bench.ass", &text, &Beside, &mut messages);
    let mut shaders = Repository;
    let mut networks = Networks::new(&scene, &mut shaders, &mut messages);
    let around = Surroundings { size: Some([160, 120]), services: &Services::default };
    scene::build(&scene, &mut networks, &around, &mut messages).unwrap()
}

fn scenes(c: &mut Criterion) {
    let mut group = c.benchmark_group("render");
    group.sample_size(10);
    let mut files: Vec<PathBuf> = std::fs::read_dir(root().join("examples/scenes"))
        .unwrap()
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|path| path.extension().is_some_and(|e| e == "ass"))
        .collect();
    files.sort();
    for file in files {
        let world = world(&file);
        let options = RenderOptions { samples: 4, ..RenderOptions::default() };
        let rays = render(&world, &options, &|_| ()).unwrap().rays;
        group.throughput(Throughput::Elements(rays));
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        group.bench_function(name, |b| b.iter(|| render(&world, &options, &|_| ()).unwrap()));
    }
    group.finish();
}

criterion_group!(benches, scenes);
criterion_main!(benches);
