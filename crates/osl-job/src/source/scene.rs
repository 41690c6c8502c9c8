//! Reads a scene with its includes and shaders, and builds its world.

use super::dialect;
use super::folders::Folders;
use super::input;
use crate::event::{Event, Sink};
use crate::host::{self, Within};
use crate::request::{Image, Points, Reading};
use crate::{Failure, Snapshot};
use osl::stages::{self, ShaderFiles};
use osl_exec::Services;
use osl_files::{FileError, Roots};
use osl_hir::hir;
use osl_image::TextureCache;
use osl_lower::group::text::Shaders;
use osl_scene::render::World;
use osl_scene::scene::{self, Messages, Networks, SceneFiles, Surroundings};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A scene to read.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// Its file.
    pub file: &'a Path,
    /// Folders to search for shaders, textures and included scenes, after the scene's own folder.
    pub search_path: &'a [PathBuf],
    /// Whether the scene and its shaders may open any file.
    pub allow_files: bool,
    /// Whether missing brackets are inserted into shaders.
    pub repair: bool,
    /// Values of parameters of shader nodes, by `NODE.NAME`.
    pub params: &'a [(String, String)],
    /// Columns and rows of the picture, if not those of the scene.
    pub size: Option<(usize, usize)>,
    /// How sources are read.
    pub read: &'a Reading,
}

/// A scene that was read.
pub struct LoadedScene {
    /// What there is to see.
    pub world: World,
    /// Paths for each pixel, according to the scene.
    pub samples: u32,
    /// The files of the shaders.
    pub sources: SourceMap,
    /// The textures of all materials.
    pub textures: TextureCache,
}

/// Reads a scene and builds its world. Errors in a shader are sent; the scene then lacks that shader.
///
/// # Errors
/// The scene cannot be read or has errors.
pub fn load(wanted: &Scene<'_>, sink: &mut dyn Sink) -> Result<LoadedScene, Failure> {
    let limits = &wanted.read.limits;
    let name = wanted.file.display().to_string();
    let text = input::read_text(wanted.file, wanted.read)
        .map_err(|e| Failure::new(format!("cannot read {name}: {e}")))?;
    let mut messages = Messages::within(limits);
    let description = scene::read(&name, &text, &Includes::new(wanted), &mut messages);
    let mut library = Library::new(wanted);
    // All materials share the texture cache.
    let textures = textures(wanted);
    let services =
        || Services { ray: "camera".to_string(), textures: textures.clone(), ..Services::default() };
    let around = Surroundings { size: wanted.size.map(|(w, h)| [w, h]), services: &services };
    let world = (!messages.failed()).then(|| {
        let mut networks = Networks::new(&description, &mut library, &mut messages);
        networks.give(wanted.params, &mut messages);
        scene::build(&description, &mut networks, &around, &mut messages)
    });
    let Library { diagnostics, sources, files, .. } = library;
    sink.event(Event::Diagnostics { list: &diagnostics, sources: &sources, asked: None });
    messages.list().iter().for_each(|message| sink.event(Event::Scene(message)));
    let mut world = world.flatten().ok_or_else(Failure::said)?;
    if let Some(spoken) = files.spoken().last() {
        dialect::send(spoken, sink);
        let points = Points { grid: world.view.resolution().into(), ..Points::default() };
        let answers = dialect::answers(&spoken.dialect, &Image { points, ..Image::default() });
        let answers = Arc::new(answers);
        world.materials.iter_mut().for_each(|material| material.data.answers = answers.clone());
    }
    Ok(LoadedScene { world, samples: description.settings.samples, sources, textures })
}

/// The folder of a scene.
fn folder<'a>(wanted: &Scene<'a>) -> &'a Path {
    wanted.file.parent().unwrap_or(Path::new(""))
}

/// The textures of a scene: in its folder, or in a search path.
fn textures(wanted: &Scene<'_>) -> TextureCache {
    let Scene { allow_files, read, .. } = *wanted;
    let mut folders = vec![folder(wanted).to_path_buf()];
    folders.extend(wanted.search_path.iter().cloned());
    let key = || format!("{folders:?} {allow_files} scene");
    let make = || read.snapshot.host().textures(folders.clone(), &read.limits).allow_files(allow_files);
    read.snapshot.textures(key, &read.limits, make)
}

/// Finds included scenes: in the folder of the including scene, or in a search path.
struct Includes<'a> {
    folders: &'a [PathBuf],
    roots: Roots,
    most: u64,
    snapshot: &'a Snapshot,
}

impl<'a> Includes<'a> {
    fn new(wanted: &Scene<'a>) -> Includes<'a> {
        let Scene { search_path: folders, read, .. } = *wanted;
        let snapshot = &read.snapshot;
        let mut roots = Roots::default().or_anywhere(wanted.allow_files);
        let all = [folder(wanted), Path::new("")].into_iter().chain(folders.iter().map(PathBuf::as_path));
        all.for_each(|folder| snapshot.host().permit(folder, false, &mut roots));
        Includes { folders, roots, most: read.limits.reading.file_bytes, snapshot }
    }
}

impl SceneFiles for Includes<'_> {
    fn include(&self, name: &str, from: &str) -> Result<(String, String), String> {
        let beside = Path::new(from).parent().map(Path::to_path_buf).unwrap_or_default();
        let folders = std::iter::once(beside).chain(self.folders.iter().cloned());
        let read = |path: &Path| self.snapshot.host().read(path, Within::Roots(&self.roots), self.most);
        let found = host::first(folders.map(|folder| folder.join(name)), read);
        let found = found.and_then(|(path, bytes)| Ok((path.display().to_string(), osl_files::text(bytes)?)));
        found.map_err(|error| match error {
            FileError::Outside => "it lies outside of the search paths; --allow-files lets it".to_string(),
            error => error.to_string(),
        })
    }
}

/// The shaders of a scene: each file is read once, and has a part of the source map for each layer.
struct Library<'a> {
    files: Folders<'a>,
    options: osl_syntax::Options,
    sources: SourceMap,
    known: HashMap<String, Result<LayerSource, String>>,
    diagnostics: Vec<Diagnostic>,
}

struct LayerSource {
    program: Arc<hir::Program>,
    sources: SourceMap,
}

impl<'a> Library<'a> {
    fn new(wanted: &Scene<'a>) -> Library<'a> {
        let Scene { search_path, allow_files, repair, read, .. } = *wanted;
        Library {
            files: Folders::of(folder(wanted), search_path, allow_files, repair, read),
            options: input::options(read),
            sources: SourceMap::default(),
            known: HashMap::new(),
            diagnostics: Vec::new(),
        }
    }

    fn read(&mut self, name: &str) -> Result<LayerSource, String> {
        let (file, text) = self.files.find(name)?;
        let checked = stages::check(&file, &text, self.files.includes(), &self.options);
        let base = self.sources.append(&checked.sources).ok_or("the sources have more than 4 GiB")?;
        self.diagnostics.extend(checked.diagnostics.into_iter().map(|d| stages::moved(d, base)));
        let program = checked.program.ok_or_else(|| format!("{file} has errors"))?;
        Ok(LayerSource { program: Arc::new(program), sources: checked.sources })
    }
}

impl Shaders for Library<'_> {
    fn load(&mut self, name: &str) -> Result<(Arc<hir::Program>, u32), String> {
        if !self.known.contains_key(name) {
            let known = self.read(name);
            self.known.insert(name.to_string(), known);
        }
        match self.known.get(name) {
            Some(Ok(known)) => {
                let base = self.sources.append(&known.sources).ok_or("the sources have more than 4 GiB")?;
                Ok((known.program.clone(), base))
            }
            Some(Err(why)) => Err(why.clone()),
            None => Err(String::new()),
        }
    }
}
