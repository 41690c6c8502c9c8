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
use super::told::{stop, told, watch};
use super::{export, line, picture, save};
use crate::cli::args::levels;
use crate::cli::args::{Live, MessageFormat, RunArgs};
use crate::cli::load::{self, Request};
use crate::cli::reads::Reads;
use crate::cli::{Failure, explain, info, input, repair, report};
use osl::stages;
use osl_files::{FileError, Roots, open_named, stamp};
use osl_hir::lint::Level;
use osl_limits::Cancel;
use osl_scene::shape::Shape;
use osl_studio::{Edit, Files, First, Layer, Line, Picture, Saved, Shader, State, Stop, Subject};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Component, Path, PathBuf};

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
    run: RunArgs,
    /// The words of the command line that the page does not set.
    words: Vec<String>,
    /// The picture that is compared with later ones.
    pinned: Option<Pinned>,
    /// The file and the output of the last picture with one sample for each pixel, and the seconds that it
    /// ran.
    plain: Option<(PathBuf, String, f64)>,
}

impl Studio {
    pub(super) fn new(mut run: RunArgs, words: Vec<String>) -> Studio {
        run.read.message_format = MessageFormat::Json;
        run.live = Some(Live { typed: run.params.iter().map(|(_, value)| value.clone()).collect() });
        Studio { run, words, pinned: None, plain: None }
    }

    fn main(&self) -> &Path {
        self.run.file.as_deref().unwrap_or(Path::new(""))
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

    /// The options of the command line with the values of a state.
    fn args(&self, state: &State, cancel: &Cancel) -> Result<RunArgs, Stop> {
        let mut args = self.run.clone();
        args.file = Some(self.file(state)?);
        if let Some(params) = &state.params {
            args.params.clone_from(params);
        }
        if let Some(on) = state.on.as_deref() {
            args.on.on = match on {
                PATCH => None,
                on if Shape::named(on).is_some() || args.on.on.as_deref() == Some(on) => Some(on.to_string()),
                on => {
                    return Err(Stop::error(format!(
                        "a page has no surface {on}; the option --on names a mesh"
                    )));
                }
            };
            if args.on.on.is_none() {
                args.on.displace = None;
            }
        }
        args.read.limits = args.read.limits.until(cancel);
        Ok(args)
    }

    /// Files of the folder that can be shown.
    fn files(&self) -> Vec<String> {
        ENDINGS.iter().flat_map(|ending| input::names_in(self.folder(), ending)).collect()
    }

    /// Image files in the folder and in the folders of textures.
    fn images(&self) -> Vec<String> {
        let folders =
            || std::iter::once(self.folder()).chain(self.run.texture_path.iter().map(PathBuf::as_path));
        let mut names: Vec<String> = IMAGES
            .iter()
            .flat_map(|ending| folders().flat_map(|folder| input::names_in(folder, ending)))
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
    fn shader(&mut self, state: &State, files: &mut Files) -> Result<Shader, Stop> {
        let cancel = Cancel::new();
        let path = self.file(state)?;
        // The stamp is older than the text, so no change is missed.
        files.insert(path.clone(), stamp(&path));
        let mut args = self.args(&State { params: Some(Vec::new()), ..state.clone() }, &cancel)?;
        args.outputs = None;
        let read = open_named(&path).and_then(|file| file.text(args.read.limits.limits().reading.file_bytes));
        let unreadable = |why: &FileError| format!("cannot read {}: {why}", path.display());
        let (text, is_text) = match read {
            Ok(text) => (text, Ok(())),
            // The page says so in place of a text.
            Err(why @ (FileError::NotUtf8(_) | FileError::Zero(_))) => (String::new(), Err(why)),
            Err(why) => return Err(Stop::error(unreadable(&why))),
        };
        let mut shader = Shader {
            file: path.strip_prefix(self.folder()).unwrap_or(&path).display().to_string(),
            files: self.files(),
            images: self.images(),
            path: path.display().to_string(),
            command: self.words.clone(),
            given: self.run.params.clone(),
            output: self.run.outputs.as_ref().and_then(|list| list.first().cloned()),
            on: self.run.on.on.clone(),
            size: [self.run.grid.0, self.run.grid.1],
            text,
            locked: save::locked(&self.roots(), &path),
            ..Shader::default()
        };
        let named = Shape::NAMED.iter().map(|(name, _)| (*name).to_string());
        let mesh = self.run.on.on.clone().filter(|on| Shape::named(on).is_none());
        shader.surfaces = std::iter::once(PATCH.to_string()).chain(named).chain(mesh).collect();
        if let Err(why) = is_text {
            shader.diagnostics = vec![json!({ "severity": "error", "message": unreadable(&why) })];
            shader.locked = Some(why.to_string());
            return Ok(shader);
        }
        let is_group = load::is_group(&path) || !args.network.is_empty();
        let mut reads = Reads::default();
        let mut found = Vec::new();
        let work = |err: &mut dyn Write| {
            if !is_group {
                let checked = check(&path, &shader.text, &args)?;
                reads.sources(&checked.sources);
                let list = levels::judge(&checked, Level::Check, &args.lints, args.read.limits.limits());
                report::diagnostics(&list, &checked.sources, &args.read, err)?;
                if let Some(program) = &checked.program {
                    if has_lines(&path) {
                        shader.lines = line::lines(program, &checked.sources);
                    }
                    let description = serde_json::to_value(info::describe(program)).unwrap_or_default();
                    found.push(Layer { name: String::new(), description });
                }
            }
            // What `check` has said is not said again.
            let mut quiet = std::io::sink();
            let err: &mut dyn Write = if is_group { err } else { &mut quiet };
            let loaded = load::load(&Request::of(&args), err)?;
            reads.sources(&loaded.sources);
            if is_group {
                let group = loaded.group(args.read.limits.limits());
                let last = group.layers().len().saturating_sub(1);
                found.extend(group.layers().iter().enumerate().map(|(at, layer)| Layer {
                    name: if at == last { String::new() } else { layer.name.to_string() },
                    description: serde_json::to_value(info::describe(&layer.program)).unwrap_or_default(),
                }));
            }
            shader.outputs = outputs(&loaded.body);
            Ok(())
        };
        let (messages, failed) = told(work);
        shader.lessons = lessons(&messages);
        shader.diagnostics = messages;
        shader.layers = if failed { Vec::new() } else { found };
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
        let args = self.args(state, cancel)?;
        let path = args.file.clone().unwrap_or_default();
        let job = picture::Job::new(args, state, self.pinned.as_ref(), cancel)?;
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
            let args = self.args(&state, cancel)?;
            self.pinned = Some(picture::Job::new(args, &state, None, cancel)?.pinned()?);
        }
        Ok(())
    }

    fn explain(&mut self, state: &State, [x, y]: [usize; 2], cancel: &Cancel) -> Result<String, Stop> {
        if state.lit {
            return Err(Stop::error("a picture with light has no explanation of its pixels: switch Lit off"));
        }
        let args = self.args(state, cancel)?;
        let mut text = String::new();
        let (messages, failed) = told(|err| {
            text = explain::pixel_json(&args, (x, y), err)?;
            Ok(())
        });
        if failed || cancel.is_cancelled() { Err(stop(messages, cancel)) } else { Ok(text) }
    }

    fn group(&mut self, state: &State, cancel: &Cancel) -> Result<String, Stop> {
        let args = self.args(state, cancel)?;
        let mut text = String::new();
        let (messages, failed) = told(|err| {
            text = export::group(&args, err)?;
            Ok(())
        });
        if failed || cancel.is_cancelled() { Err(stop(messages, cancel)) } else { Ok(text) }
    }

    fn save(&mut self, state: &State, edit: &Edit) -> Result<Saved, Stop> {
        let path = self.file(state)?;
        if path != self.folder().join(&edit.file) {
            return Err(Stop::error(format!("not saved: the page does not show {}", edit.file)));
        }
        save::save(&self.roots(), &path, edit, self.run.read.limits.limits())
    }

    fn line(&mut self, state: &State, line: u32, cancel: &Cancel) -> Result<Line, Stop> {
        let args = self.args(state, cancel)?;
        if !args.file.as_deref().is_some_and(has_lines) || !args.network.is_empty() {
            return Err(Stop::error("only the lines of a source have pictures: open the .osl file"));
        }
        let mut found = Line::default();
        let (messages, failed) = told(|err| {
            (found.pictures, found.more) = line::pictures(args, line, err)?;
            Ok(())
        });
        if failed || cancel.is_cancelled() { Err(stop(messages, cancel)) } else { Ok(found) }
    }
}

/// Whether the lines of a file have pictures: whether it is the source of a single shader.
fn has_lines(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == SOURCE)
}

/// Checks a shader that was read.
fn check(path: &Path, text: &str, args: &RunArgs) -> Result<stages::Checked, Failure> {
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    let mut input = input::input(path.display().to_string(), text.to_string(), folder, &args.read);
    input.files = input.files.or_anywhere(args.allow_files);
    if args.repair {
        repair::apply(&mut input, None, &mut std::io::sink())?;
    }
    Ok(stages::check(&input.name, &input.text, &input.files, &input.options))
}
