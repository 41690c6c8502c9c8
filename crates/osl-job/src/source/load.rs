//! Loads a shader file, or a group from a file, a text or the command line, up to the lowered body.

use super::dialect;
use super::folders::Folders;
use super::{data, input, levels, repair};
use crate::event::{Event, Sink};
use crate::open;
use crate::request::{Image, Lints, Network, Reading};
use crate::session::{Resolved, Source};
use crate::spoken::Spoken;
use crate::{Failure, NoSink};
use osl::stages::{self, CompileError};
use osl_hir::hir;
use osl_hir::lint::Level;
use osl_ir::ir::{Body, Const};
use osl_ir::types::Type;
use osl_limits::Limits;
use osl_lower::group::{End, Group, Layer};
use osl_lower::params::{self, ParamError, ParamValues};
use osl_lower::taps::{self, Tap, TapPath};
use osl_lower::{Last, Requests};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use std::any::Any;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Whether a file holds the text of a group, by its name.
pub fn is_group(file: &Path) -> bool {
    let ending = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    GROUP_ENDINGS.contains(&ending.as_str())
}

/// Endings of files that hold the text of a group.
const GROUP_ENDINGS: [&str; 3] = ["group", "oslgroup", "txt"];

/// A loaded shader or group.
pub struct LoadedShader {
    /// The files of the positions in the body.
    pub sources: SourceMap,
    /// The body, specialised for the given parameter values.
    pub body: Body,
    /// Name of the shader, or of the last one of a group.
    pub name: Arc<str>,
    /// Where its textures may be.
    pub folder: TextureFiles,
    /// The resolved shader; in a group, the last one.
    pub program: hir::Program,
    /// The values of string parameters, with the names that `-p` accepts.
    pub texts: Vec<(String, Arc<str>)>,
    /// The names of the outputs that taps add.
    pub tapped: Vec<Arc<str>>,
    /// The body with notes on the source's statements, if requested.
    pub noted: Option<Body>,
    /// The layers of a group; empty for a single shader.
    layers: Option<Group>,
    /// The values of the parameters of a single shader.
    given: ParamValues,
    /// The source, and a text that decides the body together with it; none if programs are not kept.
    pub(crate) kept: Option<(Arc<Source>, String)>,
    /// The dialect of the shader; of a group, that of the last shader that has one.
    pub spoken: Option<Spoken>,
}

impl LoadedShader {
    /// The outputs to compute, if not all: those that the command line names, and those of taps.
    pub fn outputs(&self, image: &Image) -> Option<Vec<Arc<str>>> {
        let named = image.shader.outputs.iter().flatten().map(|name| Arc::from(name.as_str()));
        let all = named.chain(self.tapped.iter().cloned());
        (image.shader.outputs.is_some() || !self.tapped.is_empty()).then(|| all.collect())
    }

    /// The type of a parameter, by the name that `-p` accepts.
    pub fn type_of(&self, name: &str) -> Option<Type> {
        let Some(group) = &self.layers else { return params::type_of(&self.program, name) };
        let (layer, name) = layer_of(group, name);
        params::type_of(&group.layers().get(layer)?.program, name)
    }

    /// Its layers, to which others can be added. A single shader is a group of one layer.
    pub fn group(&self, limits: &Limits) -> Group {
        self.layers.clone().unwrap_or_else(|| {
            let mut group = Group::new(self.name.clone()).with_limits(limits);
            let program = Arc::new(self.program.clone());
            let layer = Layer { name: self.name.clone(), program, values: self.given.clone(), base: 0 };
            // Without layers before it, a layer is refused only by a limit; then so is the one that follows.
            let _ = group.add(layer);
            group
        })
    }
}

/// Where the textures of a shader may be.
#[derive(Clone, Debug, Default)]
pub struct TextureFiles {
    /// The folder of the shader, which is searched.
    pub folder: PathBuf,
    /// The values of string parameters that the user typed. A file with such a name may be anywhere.
    pub typed: Vec<String>,
}

/// Makes taps from a program and its files.
pub type MoreTaps<'a> = dyn Fn(&hir::Program, &SourceMap) -> Vec<Tap> + 'a;

/// What to load, according to the command line.
pub struct Request<'a> {
    /// A source, a compiled shader, or the text of a group.
    pub file: Option<&'a Path>,
    /// A group of shaders.
    pub network: &'a Network,
    /// Values of parameters, as text.
    pub params: &'a [(String, String)],
    /// The data of the points, by name.
    pub userdata: &'a [(String, String)],
    /// Outputs to compute; all if not given.
    pub outputs: Option<&'a [String]>,
    /// Variables at a line that become outputs.
    pub taps: &'a [TapPath],
    /// Further taps of a single shader, from what it is found to do.
    pub more_taps: Option<&'a MoreTaps<'a>>,
    /// An output that is needed but not shown.
    pub displace: Option<&'a str>,
    /// How source files are read.
    pub read: &'a Reading,
    /// The warnings to report.
    pub lints: &'a Lints,
    /// Whether to insert missing brackets, and where to save the repaired text.
    pub repair: Option<Option<&'a Path>>,
    /// The file for a changed source, which may be the source itself.
    pub write: Option<&'a Path>,
    /// Whether the shaders of a group may be in any folder.
    pub allow_files: bool,
    /// The number of points to run.
    pub points: usize,
    /// The time in seconds, and the frame.
    pub time: (f32, f32),
    /// Whether notes have the derivatives of variables.
    pub note_derivs: bool,
    /// Whether parameters may be inputs of the program, and the program may be kept.
    pub opens: bool,
}

impl Request<'_> {
    /// What a picture needs.
    pub fn of(image: &Image) -> Request<'_> {
        let Image { shader, points, .. } = image;
        Request {
            file: shader.file.as_deref(),
            network: &shader.network,
            params: &shader.params,
            userdata: &image.provided.userdata,
            outputs: shader.outputs.as_deref(),
            taps: &shader.taps,
            more_taps: None,
            displace: points.surface.displace.as_ref().map(|output| output.name.as_str()),
            read: &shader.read,
            lints: &shader.lints,
            repair: shader.repair.then_some(shader.write.as_deref()),
            write: shader.write.as_deref(),
            allow_files: shader.allow_files,
            points: image.size().0.saturating_mul(image.size().1),
            time: (image.provided.globals.seconds(), image.provided.globals.frame()),
            note_derivs: false,
            opens: false,
        }
    }
}

/// Reads, resolves and lowers the shader or group, and reports its diagnostics.
pub fn load(request: &Request<'_>, sink: &mut dyn Sink) -> Result<LoadedShader, Failure> {
    load_as(request, false, sink)
}

/// The same, with notes on the source's statements.
pub fn load_noted(request: &Request<'_>, sink: &mut dyn Sink) -> Result<(LoadedShader, Body), Failure> {
    let mut loaded = load_as(request, true, sink)?;
    let noted = loaded.noted.take().unwrap_or_else(|| loaded.body.clone());
    Ok((loaded, noted))
}

/// The body with notes that have the derivatives of variables; its diagnostics are reported by
/// [`load_noted`].
pub fn load_with_derivs(request: &Request<'_>) -> Result<Body, Failure> {
    let request = Request { note_derivs: true, repair: request.repair.map(|_| None), ..*request };
    Ok(load_noted(&request, &mut NoSink)?.1)
}

/// The body of a changed source of the shader that was loaded, with notes or without; `None` if it cannot be
/// lowered. The `live` parameter is an input.
pub fn lowered_again(
    program: &hir::Program,
    request: &Request<'_>,
    notes: bool,
    live: Option<&str>,
) -> Option<Body> {
    let mut values = ParamValues::default();
    for (name, text) in request.params {
        params::set(program, &mut values, name, text).ok()?;
    }
    live.into_iter().for_each(|name| values.make_live(name));
    let requests = Requests { notes, ..requests(Vec::new(), request) };
    osl_lower::lower_for(program, &values, &requests).ok()
}

/// The body of a loaded shader in which these parameters, with their first values, are inputs; and the names
/// of the inputs.
pub fn lowered_open(
    loaded: &LoadedShader,
    request: &Request<'_>,
    open: &[(&str, &str)],
) -> Result<(Body, Vec<Arc<str>>), Failure> {
    let mut group = loaded.group(&request.read.limits);
    let mut inputs = Vec::new();
    for (path, text) in open {
        let (at, name) = layer_of(&group, path);
        let Some(layer) = group.layer_mut(at) else { continue };
        params::set(&layer.program, &mut layer.values, name, text).map_err(Failure::new)?;
        layer.values.make_live(name);
        inputs.push(format!("{}.{name}", layer.name).into());
    }
    let outputs = match &loaded.layers {
        Some(_) => asked(&group, &loaded.program, request.outputs)?,
        None => Vec::new(),
    };
    // The same shader was lowered before, so that only a limit can fail.
    let lowered = osl_lower::lower_group_for(&group, &requests(outputs, request));
    let body = lowered.map_err(|list| Failure::new(list.first().map_or("", |d| &d.message)))?;
    Ok((body, inputs))
}

fn load_as(request: &Request<'_>, notes: bool, sink: &mut dyn Sink) -> Result<LoadedShader, Failure> {
    let most = request.read.limits.running.points;
    if request.points as u64 > most {
        let points = request.points;
        return Err(Failure::new(format!("{points} points are more than {most} (--limit running.points=N)")));
    }
    let is_group = request.file.is_some_and(is_group);
    let loaded = match request.file {
        Some(path) if request.network.is_empty() && !is_group => shader(path, request, notes, sink),
        _ => group(request, is_group, notes, sink),
    }?;
    if let Some(spoken) = &loaded.spoken {
        dialect::send(spoken, sink);
    }
    if !request.userdata.is_empty() {
        let limits = &request.read.limits;
        for warning in data::unused(request.userdata, &loaded.body, &loaded.group(limits), limits) {
            sink.event(Event::Doubt(&warning));
        }
    }
    Ok(loaded)
}

fn shader(
    path: &Path,
    request: &Request<'_>,
    notes: bool,
    sink: &mut dyn Sink,
) -> Result<LoadedShader, Failure> {
    if let Some(write) = request.write.filter(|write| osl_files::is_same(write, path)) {
        osl_files::permit_rewrite(write);
    }
    let source = source(request, || read(path, request, sink))?;
    diagnostics(&source.list, &source.sources, Some(request.lints), sink)?;
    let Some(Resolved::Shader(program)) = &source.resolved else { return Err(Failure::said()) };
    wanted(program, request.outputs)?;
    let failed = |e| match e {
        CompileError::Param(e) => Failure::new(e),
        CompileError::Program(list) => told(&list, &source.sources, sink),
    };
    let mut values = dialect::timed(source.spoken.as_ref(), program, request.params, request.time);
    // Values that come with the time are not those of the request.
    let opens = request.opens && values.is_empty();
    values.extend(request.params.iter().cloned());
    let mut taps = taps(request.taps, &[(program, 0)], &source.sources)?;
    let wanted = taps.len();
    taps.extend(request.more_taps.map(|more| more(program, &source.sources)).unwrap_or_default());
    let requests = Requests { taps, ..requests(Vec::new(), request) };
    let lower = |requests: &Requests| stages::lower_for(program, &values, requests);
    let opened = opens.then(|| {
        let wanted = (source.clone() as Arc<dyn Any + Send + Sync>, wish(request));
        open::body(&request.read.snapshot, wanted, (program, request.params), &requests)
    });
    let opened = opened.flatten();
    let kept = opens.then(|| {
        let open = opened.as_ref().map_or(&[][..], |(open, _)| open);
        let is_fixed = |(name, _): &&(String, String)| !open.contains(name);
        let fixed: Vec<_> = request.params.iter().filter(is_fixed).collect();
        (source.clone(), format!("{:p} {:?}", Arc::as_ptr(&source), (wish(request), open, fixed)))
    });
    let lowered = opened.map_or_else(|| lower(&requests), |(_, body)| Ok(body)).and_then(|body| {
        Ok((body, notes.then(|| lower(&Requests { notes: true, ..requests.clone() })).transpose()?))
    });
    let (body, noted) = lowered.map_err(failed)?;
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    let mut given = ParamValues::default();
    for (name, text) in &values {
        params::set(program, &mut given, name, text).map_err(Failure::new)?;
        if let Some(doubt) = params::doubt(program, name, text) {
            sink.event(Event::Doubt(&doubt));
        }
    }
    let texts = params::texts(program, &given);
    let texts = texts.into_iter().map(|(name, text)| (name.to_string(), text)).collect();
    let folder = TextureFiles { folder, typed: strings(program, &given).collect() };
    let name = program.shader.name.clone();
    let (sources, program) = (source.sources.clone(), (**program).clone());
    let spoken = source.spoken.clone();
    let (wanted, more) = requests.taps.split_at(wanted);
    let mut tapped = names_of(wanted, &body);
    // A function that is not called has none of the taps that were found in it.
    let exists = |name: &Arc<str>| body.outputs.iter().any(|output| output.name == *name);
    tapped.extend(names_of(more, &body).into_iter().filter(exists));
    let layers = None;
    Ok(LoadedShader {
        sources,
        body,
        name,
        folder,
        program,
        texts,
        tapped,
        noted,
        layers,
        given,
        kept,
        spoken,
    })
}

/// What a request wants of its source, except the values of parameters.
fn wish(request: &Request<'_>) -> String {
    format!("{:?}", (request.outputs, request.taps, request.displace, &request.read.limits))
}

/// Reads and resolves a shader.
fn read(path: &Path, request: &Request<'_>, sink: &mut dyn Sink) -> Result<Source, Failure> {
    let mut input = input::read(path, request.read)?;
    input.files = input.files.or_anywhere(request.allow_files);
    if let Some(write) = request.repair
        && let Some(edits) = repair::apply(&mut input, write)?
    {
        edits.send(sink);
    }
    let checked = stages::check(&input.name, &input.text, &input.files, &input.options);
    let list = levels::judge(&checked, Level::Always, request.lints, &request.read.limits);
    Ok(Source {
        sources: checked.sources,
        spoken: input.files.spoken(),
        list,
        resolved: checked.program.map(|program| Resolved::Shader(Box::new(program))),
    })
}

/// The part of a request that decides what its source is.
fn key(request: &Request<'_>) -> String {
    let Request { file, network, lints, allow_files, repair, read, .. } = request;
    let Reading {
        include,
        define,
        strict_syntax,
        version,
        reach,
        dialect,
        dialect_path,
        limits: _,
        snapshot: _,
    } = read;
    let syntax = (define, strict_syntax, version, repair.is_some(), dialect, dialect_path);
    format!("{:?}", (file, network, lints, allow_files, include, reach, syntax))
}

/// The source of a request: the one that is kept, or what `read` makes.
fn source(
    request: &Request<'_>,
    read: impl FnOnce() -> Result<Source, Failure>,
) -> Result<Arc<Source>, Failure> {
    // A repaired source that is saved must be written.
    if request.repair.flatten().is_some() {
        return read().map(Arc::new);
    }
    let kept = || {
        let source = Arc::new(read()?);
        let files = source.sources.files().iter().map(|file| PathBuf::from(&*file.name));
        // A source with errors is read again.
        let files = source.resolved.is_some().then(|| files.collect());
        Ok((source, files))
    };
    request.read.snapshot.keep(|kept| &mut kept.source, || key(request), kept)
}

/// The names of the outputs of taps, as they are requested: a struct's name stands for its fields.
fn names_of(taps: &[Tap], body: &Body) -> Vec<Arc<str>> {
    let exists = |name: &Arc<str>| body.outputs.iter().any(|output| output.name == *name);
    taps.iter()
        .flat_map(|tap| std::iter::once(tap.name.clone()).chain(Some(tap.mask.clone()).filter(exists)))
        .collect()
}

/// The strings among given values.
fn strings<'a>(program: &hir::Program, given: &'a ParamValues) -> impl Iterator<Item = String> + 'a {
    let values = given.given(program).into_iter().flat_map(|(_, values)| values);
    values.filter_map(|value| if let Const::Str(text) = value { Some(text.to_string()) } else { None })
}

/// The requested outputs, for the lowering; `others` are outputs of layers before the last.
fn requests(others: Vec<Arc<str>>, request: &Request<'_>) -> Requests {
    let last = match request.outputs {
        None => Last::All,
        Some(list) => {
            let names = list.iter().map(String::as_str).chain(request.displace);
            Last::Named(names.map(Arc::from).collect())
        }
    };
    let limits = request.read.limits.clone();
    Requests { outputs: others, last, limits, note_derivs: request.note_derivs, ..Requests::default() }
}

/// The taps, each once, in the layers of a group or in the only one.
fn taps(list: &[TapPath], layers: &[(&hir::Program, u32)], sources: &SourceMap) -> Result<Vec<Tap>, Failure> {
    let mut taps: Vec<Tap> = Vec::new();
    for wanted in list {
        let found = taps::find_in(wanted, layers, sources);
        let tap = found.map_err(|why| Failure::new(format!("--tap: {why}")))?;
        if !taps.iter().any(|known| known.name == tap.name) {
            taps.push(tap);
        }
    }
    Ok(taps)
}

/// Sends diagnostics; fails if one is an error.
pub fn diagnostics(
    list: &[Diagnostic],
    sources: &SourceMap,
    asked: Option<&Lints>,
    sink: &mut dyn Sink,
) -> Result<(), Failure> {
    sink.event(Event::Diagnostics { list, sources, asked });
    if list.iter().any(Diagnostic::is_error) { Err(Failure::said()) } else { Ok(()) }
}

/// Sends the errors that stopped the lowering.
fn told(list: &[Diagnostic], sources: &SourceMap, sink: &mut dyn Sink) -> Failure {
    match diagnostics(list, sources, None, sink) {
        Ok(()) => Failure::said(),
        Err(failure) => failure,
    }
}

/// Checks that all requested outputs exist.
fn wanted(program: &hir::Program, outputs: Option<&[String]>) -> Result<(), Failure> {
    let names = outputs_of(program);
    let first = |name: &str| name.split('.').next().unwrap_or(name).to_string();
    match outputs.into_iter().flatten().find(|o| !names.contains(&first(o).as_str())) {
        Some(unknown) => {
            Err(Failure::new(format!("the shader has no output `{unknown}`; it has {}", names.join(", "))))
        }
        None => Ok(()),
    }
}

fn outputs_of(program: &hir::Program) -> Vec<&str> {
    let outputs = program.shader.params.iter().filter(|p| p.output);
    outputs.filter_map(|p| program.vars.get(p.var.0 as usize)).map(|v| &*v.name).collect()
}

/// The text of a group.
struct Written {
    text: String,
    /// The name of its file in messages.
    file: String,
    /// The folder of its shaders.
    folder: PathBuf,
}

/// The text of a group, from its file or the request, with the layers and connections of the request.
fn written(request: &Request<'_>, is_group: bool) -> Result<Written, Failure> {
    let network = request.network;
    let mut text = String::new();
    let mut file = "<group>".to_string();
    let mut folder = PathBuf::new();
    if let Some(path) = request.file.filter(|_| is_group) {
        text = input::read_text(path, request.read)
            .map_err(|e| Failure::new(format!("cannot read {}: {e}", path.display())))?;
        file = path.display().to_string();
        folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    }
    if let Some(given) = &network.group {
        text = given.clone();
    }
    // The layers on the command line follow, in the same form.
    for (name, shader) in &network.layer {
        let _ = write!(text, "\nshader {shader} {name} ;");
    }
    if let Some(path) = request.file.filter(|_| !is_group) {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let _ = write!(text, "\nshader \"{}\" {stem} ;", path.display());
    }
    for (from, to) in &network.connect {
        let _ = write!(text, "\nconnect {from} {to} ;");
    }
    Ok(Written { text, file, folder })
}

fn group(
    request: &Request<'_>,
    is_group: bool,
    notes: bool,
    sink: &mut dyn Sink,
) -> Result<LoadedShader, Failure> {
    let network = request.network;
    let Written { text, file, folder } = written(request, is_group)?;
    if request.repair.flatten().is_some() {
        return Err(Failure::usage("--write is for a single shader, not for a group"));
    }
    let source = source(request, || {
        let own = request.file.filter(|_| !is_group).map(Path::to_path_buf);
        let (anywhere, repair) = (request.allow_files, request.repair.is_some());
        let files = Folders::of(&folder, &network.shader_path, anywhere, repair, request.read).with(own);
        let options = input::options(request.read);
        let checked = stages::check_group(&file, &text, &network.name, &files, &options);
        files.edits().iter().for_each(|edits| edits.send(sink));
        let list = levels::sift(checked.diagnostics, request.lints);
        Ok(Source {
            sources: checked.sources,
            spoken: files.spoken().pop(),
            list,
            resolved: checked.group.map(|group| Resolved::Group(Box::new(group))),
        })
    })?;
    diagnostics(&source.list, &source.sources, None, sink)?;
    let Some(Resolved::Group(group)) = &source.resolved else { return Err(Failure::said()) };
    let mut group = (**group).clone();
    let Some(last) = group.layers().last().map(|l| l.program.clone()) else {
        return Err(Failure::new("the group has no layers"));
    };
    // The text of a file may come from anywhere; a text on the command line was typed.
    let mut typed = Vec::new();
    if !is_group {
        typed.extend(group.layers().iter().flat_map(|layer| strings(&layer.program, &layer.values)));
    }
    typed.extend(set_params(&mut group, request.params)?);
    for doubt in doubts(&group, request.params) {
        sink.event(Event::Doubt(&doubt));
    }
    let outputs = asked(&group, &last, request.outputs)?;
    let layers: Vec<_> = group.layers().iter().map(|layer| (&*layer.program, layer.base)).collect();
    let taps = taps(request.taps, &layers, &source.sources)?;
    let requests = Requests { taps, ..requests(outputs, request) };
    let lower = |requests: &Requests| osl_lower::lower_group_for(&group, requests);
    let noted = notes.then(|| lower(&Requests { notes: true, ..requests.clone() })).transpose();
    let (body, noted) = lower(&requests)
        .and_then(|body| Ok((body, noted?)))
        .map_err(|list| told(&list, &source.sources, sink))?;
    let name = last.shader.name.clone();
    let program = (*last).clone();
    let texts = texts_of(&group);
    let folder = TextureFiles { folder, typed };
    let (sources, given) = (source.sources.clone(), ParamValues::default());
    let tapped = names_of(&requests.taps, &body);
    Ok(LoadedShader {
        sources,
        body,
        name,
        folder,
        program,
        texts,
        tapped,
        noted,
        layers: Some(group),
        given,
        kept: None,
        spoken: source.spoken.clone(),
    })
}

/// The values of string parameters in all layers, with the names that `-p` accepts.
fn texts_of(group: &Group) -> Vec<(String, Arc<str>)> {
    let mut texts = Vec::new();
    for (at, layer) in group.layers().iter().enumerate() {
        let is_last = at + 1 == group.layers().len();
        let path = |name: &str| if is_last { name.to_string() } else { format!("{}.{name}", layer.name) };
        let own = params::texts(&layer.program, &layer.values);
        texts.extend(own.into_iter().map(|(name, text)| (path(&name), text)));
    }
    texts
}

/// The layer of `layer.name`, or the last one for another name; and the name there.
fn layer_of<'a>(group: &Group, path: &'a str) -> (usize, &'a str) {
    let named = path.split_once('.').and_then(|(layer, name)| Some((group.find(layer)?, name)));
    named.unwrap_or((group.layers().len().saturating_sub(1), path))
}

/// Sets `name=value` in the last layer, `layer.name=value` in any. Returns the strings among the values.
fn set_params(group: &mut Group, given: &[(String, String)]) -> Result<Vec<String>, Failure> {
    let mut texts = Vec::new();
    for (path, text) in given {
        let (layer, name) = layer_of(group, path);
        let Some(layer) = group.layer_mut(layer) else { continue };
        params::set(&layer.program, &mut layer.values, name, text).map_err(|e| match e {
            ParamError::Unknown { .. } => Failure::new(format!("layer `{}`: {e}", layer.name)),
            e => Failure::new(e),
        })?;
        let mut alone = ParamValues::default();
        if params::set(&layer.program, &mut alone, name, text).is_ok() {
            texts.extend(strings(&layer.program, &alone));
        }
    }
    Ok(texts)
}

/// Doubts about given values: those of each value, and values that a connection replaces.
fn doubts(group: &Group, given: &[(String, String)]) -> Vec<String> {
    let mut doubts = Vec::new();
    for (path, text) in given {
        let (at, name) = layer_of(group, path);
        let Some(layer) = group.layers().get(at) else { continue };
        doubts.extend(params::doubt(&layer.program, name, text));
        let whole = |end: &End| end.fields.is_empty() && end.component.is_none();
        let param = layer.program.param(name);
        let mut connections = group.connections().iter();
        let source = connections.find(|c| c.to.layer == at && Some(c.to.param) == param && whole(&c.to));
        if let Some(connection) = source {
            let from = group.show(&connection.from);
            doubts.push(format!("`-p {path}` has no effect: the parameter takes its value from {from}"));
        }
    }
    doubts
}

/// The requested outputs of layers before the last. Fails if a requested output does not exist.
fn asked(group: &Group, last: &hir::Program, outputs: Option<&[String]>) -> Result<Vec<Arc<str>>, Failure> {
    let mut asked = Vec::new();
    for name in outputs.into_iter().flatten() {
        let part = name.split_once('.').and_then(|(layer, output)| Some((group.find(layer)?, output)));
        match part {
            Some((layer, output)) => {
                let layer = &group.layers()[layer];
                let only = [output.to_string()];
                wanted(&layer.program, Some(&only)).map_err(|failure| {
                    let text = failure.text.replace("the shader", &format!("layer `{}`", layer.name));
                    Failure { text, ..failure }
                })?;
                asked.push(name.as_str().into());
            }
            None => wanted(last, Some(std::slice::from_ref(name)))?,
        }
    }
    Ok(asked)
}
