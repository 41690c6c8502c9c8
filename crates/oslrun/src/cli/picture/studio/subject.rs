//! The shader of a page: describes it and explains its pixels, each as the command of that name does.
//! [`picture`] makes its pictures, [`save`] saves its file.
//!
//! Every answer starts from the options of the command line with the values of the page in place of theirs,
//! and has the limits of a command of its own. Values from a page are not typed by the user: they open no
//! files outside of the permitted folders, and a run for a page appends to no files. This module must not
//! know connections.

use super::difference::Pinned;
use super::picture::outputs;
use super::save::SOURCE;
use super::told::{Told, answer, told, watch};
use super::{export, line, picture, save};
use crate::cli::measure::explain;
use crate::cli::source::info;
use osl::stages;
use osl_files::{FileError, Roots, open_named, stamp};
use osl_hir::lint::Level;
use osl_job::host::{Disk, Watching, Within};
use osl_job::request::{Reading, Trust};
use osl_job::source::load::{self, Request};
use osl_job::source::reads::Reads;
use osl_job::source::{input, levels, repair};
use osl_job::{Failure, Image, NoSink, Session, Sink};
use osl_limits::{Cancel, Limits};
use osl_scene::shape::Shape;
use osl_studio::{
    Edit, Files, First, Layer, Line, Outdate, Picture, Saved, Shader, State, Stop, Subject, Unsaved,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Endings of the files that a page can show.
const ENDINGS: [&str; 4] = [SOURCE, "oso", "group", "oslgroup"];
/// Endings of the image files that a page proposes for parameters.
const IMAGES: [&str; 19] = [
    "bmp", "dds", "exr", "gif", "hdr", "jpeg", "jpg", "pam", "pbm", "pgm", "png", "pnm", "ppm", "tex", "tga",
    "tif", "tiff", "tx", "webp",
];
/// The surface that is no surface: the grid.
const PATCH: &str = "patch";

/// The shader of a page.
pub(super) struct Studio {
    /// The picture that the command line describes.
    image: Image,
    session: Session,
    /// Makes the limits of an answer.
    limits: Box<dyn Fn(&Cancel) -> Limits + Send>,
    /// The words of the command line that the page does not set.
    words: Vec<String>,
    /// The picture that is compared with later ones.
    pinned: Option<Pinned>,
    /// The file and the output of the last picture with one sample for each pixel, and the seconds that it
    /// ran.
    plain: Option<(PathBuf, String, f64)>,
}

impl Studio {
    /// The shader of a page. The values of parameters in `image` were typed.
    pub(super) fn new(
        mut image: Image,
        limits: impl Fn(&Cancel) -> Limits + Send + 'static,
        words: Vec<String>,
    ) -> Studio {
        image.trust = Trust::Only(image.shader.params.iter().map(|(_, value)| value.clone()).collect());
        image.wanted.values = true;
        image.wanted.samples = true;
        let session = Session::new(Disk);
        Studio { image, session, limits: Box::new(limits), words, pinned: None, plain: None }
    }

    fn main(&self) -> &Path {
        self.image.shader.file.as_deref().unwrap_or(Path::new(""))
    }

    fn folder(&self) -> &Path {
        self.main().parent().unwrap_or(Path::new(""))
    }

    /// The folder of the file on the command line, in which a page reads and saves shaders.
    fn roots(&self) -> Roots {
        Roots::new([self.folder()])
    }

    /// The file of a state. It is below the folder of the file on the command line, also if links are
    /// followed.
    fn file(&self, state: &State) -> Result<PathBuf, Stop> {
        let Some(name) = &state.file else { return Ok(self.main().to_path_buf()) };
        let path = self.folder().join(name);
        if path == self.main() {
            return Ok(path);
        }
        let is_inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        if !is_inside || !ENDINGS.contains(&ending) {
            return Err(Stop::error(format!(
                "{name}: a page shows only shaders below the folder of its file"
            )));
        }
        match self.roots().open(&path) {
            Ok(_) => Ok(path),
            Err(error) => Err(Stop::error(format!("{name}: {error}"))),
        }
    }

    /// The picture of the command line with the values of a state.
    fn request(&self, state: &State, cancel: &Cancel) -> Result<Image, Stop> {
        let mut image = self.image.clone();
        image.shader.file = Some(self.file(state)?);
        if let Some(params) = &state.params {
            image.shader.params.clone_from(params);
        }
        let surface = &mut image.points.surface;
        if let Some(on) = state.on.as_deref() {
            surface.on = match on {
                PATCH => None,
                on if Shape::named(on).is_some() || surface.on.as_deref() == Some(on) => Some(on.to_string()),
                on => {
                    return Err(Stop::error(format!(
                        "a page has no surface {on}; the option --on names a mesh"
                    )));
                }
            };
            if surface.on.is_none() {
                surface.displace = None;
            }
        }
        image.shader.read.snapshot = self.session.snapshot();
        image.shader.read.limits = (self.limits)(cancel);
        Ok(image)
    }

    /// Files of the folder that can be shown.
    fn files(&self) -> Vec<String> {
        ENDINGS.iter().flat_map(|ending| input::names_in(&Disk, self.folder(), ending)).collect()
    }

    /// Image files in the folder and in the folders of textures.
    fn images(&self) -> Vec<String> {
        let folders = || {
            std::iter::once(self.folder())
                .chain(self.image.provided.texture_path.iter().map(PathBuf::as_path))
        };
        let mut names: Vec<String> = IMAGES
            .iter()
            .flat_map(|ending| folders().flat_map(|folder| input::names_in(&Disk, folder, ending)))
            .collect();
        names.sort();
        names.dedup();
        names
    }
}

/// The lessons of the codes of diagnostics.
fn lessons(diagnostics: &[Value]) -> BTreeMap<String, String> {
    let codes = diagnostics.iter().filter_map(|diagnostic| diagnostic["code"].as_str());
    let text = |code: &str| osl::lessons::find(code).first().map(|lesson| lesson.text.trim_end().to_string());
    codes.filter_map(|code| Some((code.to_string(), text(code)?))).collect()
}

impl Subject for Studio {
    fn outdate(&self) -> Outdate {
        let (session, roots, folder) = (self.session.clone(), self.roots(), self.folder().to_path_buf());
        let host = Mutex::new(Watching::default());
        Box::new(move |unsaved| {
            let path = |name: &str| Some(folder.join(name)).filter(|path| save::is_source(&roots, path));
            let Some((Unsaved { text, .. }, path)) = unsaved.and_then(|new| Some((new, path(&new.file)?)))
            else {
                return session.outdate().cancel().clone();
            };
            let mut host = host.lock().unwrap_or_else(PoisonError::into_inner);
            match text {
                Some(text) => host.edit(path, text),
                None => host.close(path),
            }
            session.change(host.clone()).cancel().clone()
        })
    }

    fn shader(&mut self, state: &State, files: &mut Files) -> Result<Shader, Stop> {
        let cancel = Cancel::new();
        let path = self.file(state)?;
        // The stamp is older than the text, so no change is missed.
        files.insert(path.clone(), stamp(&path));
        let mut image = self.request(&State { params: Some(Vec::new()), ..state.clone() }, &cancel)?;
        image.shader.outputs = None;
        let limits = image.limits().clone();
        let read = open_named(&path).and_then(|file| file.text(limits.reading.file_bytes));
        let unreadable = |why: &FileError| format!("cannot read {}: {why}", path.display());
        let (text, is_text) = match read {
            Ok(text) => (text, Ok(())),
            // The page says so in place of a text.
            Err(why @ (FileError::NotUtf8(_) | FileError::Zero(_))) => (String::new(), Err(why)),
            Err(why) => return Err(Stop::error(unreadable(&why))),
        };
        let unsaved = unsaved(&path, &text, &image);
        let mut shader = Shader {
            unsaved: unsaved.is_some(),
            file: path.strip_prefix(self.folder()).unwrap_or(&path).display().to_string(),
            files: self.files(),
            images: self.images(),
            path: path.display().to_string(),
            command: self.words.clone(),
            given: self.image.shader.params.clone(),
            output: self.image.shader.outputs.as_ref().and_then(|list| list.first().cloned()),
            on: self.image.points.surface.on.clone(),
            size: self.image.points.grid.into(),
            text,
            locked: save::locked(&self.roots(), &path),
            ..Shader::default()
        };
        shader.surfaces = surfaces(shader.on.as_deref());
        if let Err(why) = is_text {
            shader.diagnostics = vec![json!({ "severity": "error", "message": unreadable(&why) })];
            shader.locked = Some(why.to_string());
            return Ok(shader);
        }
        let is_group = load::is_group(&path) || !image.shader.network.is_empty();
        let mut reads = Reads::default();
        let mut found = Vec::new();
        let work = |sink: &mut Told| {
            if !is_group {
                let checked = check(&path, unsaved.as_deref().unwrap_or(&shader.text), &image)?;
                reads.sources(&checked.sources);
                let list = levels::judge(&checked, Level::Check, &image.shader.lints, &limits);
                load::diagnostics(&list, &checked.sources, None, sink)?;
                if let Some(program) = &checked.program {
                    if has_lines(&path) {
                        shader.lines = line::lines(program, &checked.sources);
                    }
                    let description = serde_json::to_value(info::describe(program)).unwrap_or_default();
                    found.push(Layer { name: String::new(), description });
                }
            }
            // What `check` has said is not said again.
            let sink: &mut dyn Sink = if is_group { sink } else { &mut NoSink };
            let loaded = load::load(&Request::of(&image), sink)?;
            reads.sources(&loaded.sources);
            if is_group {
                let group = loaded.group(&limits);
                let last = group.layers().len().saturating_sub(1);
                found.extend(group.layers().iter().enumerate().map(|(at, layer)| Layer {
                    name: if at == last { String::new() } else { layer.name.to_string() },
                    description: serde_json::to_value(info::describe(&layer.program)).unwrap_or_default(),
                }));
            }
            shader.outputs = outputs(&loaded.body);
            Ok(())
        };
        let (told, done) = told(work);
        shader.lessons = lessons(&told.messages);
        shader.diagnostics = told.messages;
        shader.layers = if done.is_some() { found } else { Vec::new() };
        watch(reads, files);
        Ok(shader)
    }

    fn picture(
        &mut self,
        state: &State,
        first: Option<First<'_>>,
        cancel: &Cancel,
        files: &mut Files,
    ) -> Result<Picture, Stop> {
        let image = self.request(state, cancel)?;
        let path = image.shader.file.clone().unwrap_or_default();
        let job = picture::Job::new(image, state, self.pinned.as_ref(), cancel)?;
        let (is_plain, is_patch) = (job.is_plain(), job.is_patch());
        let mut picture = job.picture(first, files)?;
        let ran = picture.phases.iter().find(|(name, _)| *name == picture::RUN).map(|(_, seconds)| *seconds);
        match (ran, &self.plain) {
            (Some(seconds), _) if is_plain => self.plain = Some((path, picture.output.clone(), seconds)),
            (Some(seconds), Some((known, output, before)))
                if state.max_error.is_some() && is_patch && *known == path && *output == picture.output =>
            {
                let message = format!(
                    "it ran for {:.0} ms; the last picture with one sample for each pixel ran for {:.0} ms",
                    seconds * 1000.0,
                    before * 1000.0
                );
                picture.messages.push(json!({ "severity": "note", "message": message }));
            }
            _ => {}
        }
        Ok(picture)
    }

    fn pin(&mut self, state: Option<&State>, cancel: &Cancel) -> Result<(), Stop> {
        self.pinned = None;
        if let Some(state) = state.filter(|state| !state.lit) {
            let state = State { layer: None, ..state.clone() };
            let image = self.request(&state, cancel)?;
            self.pinned = Some(picture::Job::new(image, &state, None, cancel)?.pinned()?);
        }
        Ok(())
    }

    fn explain(&mut self, state: &State, [x, y]: [usize; 2], cancel: &Cancel) -> Result<String, Stop> {
        if state.lit {
            return Err(Stop::error("a picture with light has no explanation of its pixels: switch Lit off"));
        }
        let image = self.request(state, cancel)?;
        answer(cancel, |sink| explain::pixel_json(&image, (x, y), sink))
    }

    fn group(&mut self, state: &State, cancel: &Cancel) -> Result<String, Stop> {
        let image = self.request(state, cancel)?;
        answer(cancel, |sink| export::group(&image, sink))
    }

    fn save(&mut self, state: &State, edit: &Edit) -> Result<Saved, Stop> {
        let path = self.file(state)?;
        if path != self.folder().join(&edit.file) {
            return Err(Stop::error(format!("not saved: the page does not show {}", edit.file)));
        }
        save::save(&self.roots(), &path, edit, self.image.limits())
    }

    fn line(&mut self, state: &State, line: u32, cancel: &Cancel) -> Result<Line, Stop> {
        let image = self.request(state, cancel)?;
        if !image.shader.file.as_deref().is_some_and(has_lines) || !image.shader.network.is_empty() {
            return Err(Stop::error("only the lines of a source have pictures: open the .osl file"));
        }
        answer(cancel, |sink| {
            let (pictures, more) = line::pictures(image, line, sink)?;
            Ok(Line { pictures, more })
        })
    }
}

/// The text of a file that a page has not saved, if it differs from the one on the disk.
fn unsaved(path: &Path, text: &str, image: &Image) -> Option<String> {
    let Reading { snapshot, limits, .. } = &image.shader.read;
    let read = snapshot.host().read(path, Within::Anywhere, limits.reading.file_bytes);
    read.and_then(osl_files::text).ok().filter(|unsaved| unsaved != text)
}

/// The surfaces that a page offers, with the one of the command line, which may be a mesh.
fn surfaces(given: Option<&str>) -> Vec<String> {
    let named = Shape::NAMED.iter().map(|(name, _)| *name);
    let mesh = given.filter(|on| Shape::named(on).is_none());
    std::iter::once(PATCH).chain(named).chain(mesh).map(str::to_string).collect()
}

/// Whether the lines of a file have pictures: whether it is the source of a single shader.
fn has_lines(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == SOURCE)
}

/// Checks a shader that was read.
fn check(path: &Path, text: &str, image: &Image) -> Result<stages::Checked, Failure> {
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    let mut input = input::input(path.display().to_string(), text.to_string(), folder, &image.shader.read)?;
    input.files = input.files.or_anywhere(image.shader.allow_files);
    if image.shader.repair {
        repair::apply(&mut input, None)?;
    }
    Ok(stages::check(&input.name, &input.text, &input.files, &input.options))
}
