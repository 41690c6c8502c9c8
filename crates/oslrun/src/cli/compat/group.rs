//! Builds a shader group as the reference's tools do: step by step. Each failure is reported at once, in the
//! words of those tools, because scripts read them. All tools that run groups use it. `osl_lower::group`
//! decides which connections are valid.

use super::Console;
use super::settings::Settings;
use osl::stages::{Library, ShaderFiles, is_compiled};
use osl_hir::hir::Program;
use osl_limits::Limits;
use osl_lower::group::text::{self, Shaders, Statement};
use osl_lower::group::{ConnectError, Group, Layer};
use osl_lower::params::{self, ParamError, ParamValues};
use osl_syntax::Options;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use std::path::Path;
use std::sync::Arc;

/// A group under construction.
pub(super) struct GroupBuilder<'a> {
    group: Group,
    library: Library<'a>,
    limits: Limits,
    /// Values for the next shader.
    waiting: Vec<Statement>,
    connection_error: bool,
}

impl<'a> GroupBuilder<'a> {
    /// A group without layers.
    pub(super) fn new(
        name: &str,
        files: &'a dyn ShaderFiles,
        options: &'a Options,
        settings: &Settings,
    ) -> GroupBuilder<'a> {
        GroupBuilder {
            group: Group::new(name).with_limits(&options.limits),
            limits: options.limits.clone(),
            library: Library::new(SourceMap::default(), files, options),
            waiting: Vec::new(),
            connection_error: settings.connection_error,
        }
    }

    /// Starts another group. Shaders that were read stay in memory.
    pub(super) fn restart(&mut self, name: &str) {
        self.group = Group::new(name).with_limits(&self.limits);
        self.waiting.clear();
    }

    /// The group so far; later calls belong to another, unnamed group.
    pub(super) fn take(&mut self) -> Group {
        self.waiting.clear();
        std::mem::replace(&mut self.group, Group::new("").with_limits(&self.limits))
    }

    /// The group, and the files of its layers.
    pub(super) fn finish(self) -> (Group, SourceMap) {
        (self.group, self.library.sources)
    }

    /// Stores a value for the next shader: a [`Statement::Param`].
    pub(super) fn value(&mut self, statement: Statement) {
        self.waiting.push(statement);
    }

    /// Adds a layer. If its shader cannot be read, reports this and keeps the values for the next shader.
    pub(super) fn shader(&mut self, shader: &str, layer: Option<&str>, console: &mut Console<'_>) -> bool {
        let told = self.library.diagnostics.len();
        let Ok(loaded) = self.library.load(shader) else {
            self.unread(shader, told, console);
            let name = &self.group.name;
            console.error(&format!("Could not find shader \"{shader}\"\n        group: {name}"));
            return false;
        };
        self.add(loaded, layer, told, console)
    }

    /// Adds a layer whose shader the tool has generated. If it does not compile, reports its errors like a
    /// compiler.
    pub(super) fn written(&mut self, shader: &str, layer: Option<&str>, console: &mut Console<'_>) -> bool {
        let told = self.library.diagnostics.len();
        let Ok(loaded) = self.library.load(shader) else {
            for d in self.library.diagnostics.get(told..).unwrap_or(&[]).iter().filter(|d| d.is_error()) {
                let place = self.library.sources.place(d.span);
                let place = place.map_or_else(String::new, |p| format!("{}:{}: ", p.file, p.line));
                console.error(&format!("{place}error: {}", compiler_message(d)));
            }
            let _ = writeln!(console.err, "Could not compile \"{shader}\"");
            return false;
        };
        self.add(loaded, layer, told, console)
    }

    /// Adds a layer with this shader, and reports the diagnostics from reading it.
    fn add(
        &mut self,
        (program, base): (Arc<Program>, u32),
        layer: Option<&str>,
        told: usize,
        console: &mut Console<'_>,
    ) -> bool {
        for d in self.library.diagnostics.get(told..).unwrap_or(&[]) {
            console.diagnostic(d, &self.library.sources);
        }
        let values = self.values(&program, console);
        let name: Arc<str> = match layer {
            Some(name) => name.into(),
            None => format!("{}_{}", program.shader.name, self.group.layers().len()).into(),
        };
        if let Err(layer) = self.group.add(Layer { name, program, values, base }) {
            console.error(&format!("there is a layer \"{}\" already", layer.name));
            return false;
        }
        true
    }

    /// Reports why a shader was not read.
    fn unread(&self, shader: &str, told: usize, console: &mut Console<'_>) {
        let said = self.library.diagnostics.get(told..).unwrap_or(&[]);
        let sources = &self.library.sources;
        let Some(first) = said.iter().find(|d| d.is_error()) else {
            console.error(&format!("No .oso file could be found for shader \"{shader}\""));
            return;
        };
        let file = sources.file_at(first.span.start).map_or("", |f| &f.name);
        if !is_compiled(file) {
            said.iter().for_each(|d| console.diagnostic(d, sources));
            return;
        }
        let unknown = first.message.strip_prefix("there is no operation `").and_then(|m| m.strip_suffix('`'));
        let why = match unknown {
            Some(name) => {
                format!("instruction \"{name}\" is not known. Maybe compiled with a too-new oslc?")
            }
            None => first.message.clone(),
        };
        console.error(&format!("Parsing shader \"{}\": {why}", stem(shader)));
        console.error(&format!("Unable to read \"{file}\""));
    }

    /// The stored values, converted to the parameters of a shader.
    fn values(&mut self, program: &Program, console: &mut Console<'_>) -> ParamValues {
        let mut values = ParamValues::default();
        for statement in std::mem::take(&mut self.waiting) {
            let Statement::Param { ty, name, values: words, interpolated, .. } = statement else { continue };
            let words: Vec<Arc<str>> = words.into_iter().map(|w| w.text).collect();
            match params::set_words(program, &mut values, ty, &name.text, &words) {
                Ok(()) if interpolated => values.interpolate(&name.text),
                Ok(()) => {}
                Err(ParamError::Unknown { name, .. }) => {
                    console.warning(&format!("attempting to set nonexistent parameter: {name}"));
                }
                Err(ParamError::Type { name, ty, given }) => console.warning(&format!(
                    "attempting to set parameter with wrong type: {name} (expected '{ty}', received '{given}')"
                )),
                Err(why) => console.warning(&why.to_string()),
            }
        }
        values
    }

    /// Names of values that no shader has used.
    pub(super) fn waiting(&self) -> Vec<&str> {
        self.waiting
            .iter()
            .filter_map(|s| match s {
                Statement::Param { name, .. } => Some(&*name.text),
                _ => None,
            })
            .collect()
    }

    /// Makes a connection, or reports why it is invalid. False if the group is invalid then.
    pub(super) fn connect(
        &mut self,
        from: (&str, &str),
        to: (&str, &str),
        console: &mut Console<'_>,
    ) -> bool {
        let Err(why) = self.group.connect(from, to) else { return true };
        let lines = self.refused(&why, from, to);
        let count = lines.len();
        for (index, mut line) in lines.into_iter().enumerate() {
            line = format!("ConnectShaders: {line}");
            if index + 1 == count {
                line += &format!("\n        group: {}", self.group.name);
            }
            if self.connection_error { console.error(&line) } else { console.warning(&line) }
        }
        !self.connection_error
    }

    /// The reasons why a connection is invalid, one per line.
    fn refused(&self, why: &ConnectError, from: (&str, &str), to: (&str, &str)) -> Vec<String> {
        match why {
            ConnectError::NoLayer(layer, _) => {
                let side = if self.group.find(from.0).is_none() { "source" } else { "destination" };
                vec![format!("{side} layer \"{layer}\" not found")]
            }
            ConnectError::Order { .. } => vec![format!(
                "destination layer must follow source layer (tried to connect {}.{} -> {}.{})",
                from.0, from.1, to.0, to.1
            )],
            ConnectError::Forbidden(_) => {
                vec![format!("cannot connect to {}.{} because it has metadata allowconnect=0", to.0, to.1)]
            }
            ConnectError::Types { from: source, to: target } => {
                vec![format!("cannot connect a {source} ({}) to a {target} ({})", from.1, to.1)]
            }
            ConnectError::NoParameter { .. } | ConnectError::NoPart(_) => {
                let mut lines: Vec<String> =
                    [from, to].into_iter().filter_map(|end| self.missing(end)).collect();
                let types = [from, to].map(|end| self.type_of(end));
                lines.push(format!(
                    "cannot connect a {} ({}) to a {} ({}), invalid connection",
                    types[0], from.1, types[1], to.1
                ));
                lines
            }
        }
    }

    /// The message for a connection end whose parameter does not exist.
    fn missing(&self, (layer, path): (&str, &str)) -> Option<String> {
        let found = self.group.layers().get(self.group.find(layer)?)?;
        let name = path.split(['[', '.']).next().unwrap_or(path);
        let exists = params::type_of(&found.program, name).is_some();
        (!exists).then(|| {
            let shader = &found.program.shader.name;
            format!("\"{name}\" is not a parameter or global of layer \"{layer}\" (shader \"{shader}\")")
        })
    }

    /// The type of an end in words.
    fn type_of(&self, (layer, path): (&str, &str)) -> String {
        let found = self.group.find(layer).and_then(|at| self.group.layers().get(at));
        let path = path.split('[').next().unwrap_or(path);
        let ty = found.and_then(|l| Some(l.program.structs.show(params::type_of(&l.program, path)?)));
        ty.unwrap_or_else(|| "unknown".to_string())
    }

    /// Adds the layers and connections in the text of a group, up to its first error. False if there is one.
    pub(super) fn text(&mut self, text: &str, console: &mut Console<'_>) -> bool {
        let (statements, diagnostics) = text::parse(text, 0, &self.limits);
        let broken = diagnostics.iter().find(|d| d.is_error());
        let end = broken.map_or(u32::MAX, |d| d.span.start);
        for statement in statements {
            let start = start(&statement);
            if start >= end {
                break;
            }
            let made = match statement {
                Statement::Param { .. } => {
                    self.value(statement);
                    true
                }
                Statement::Shader { shader, layer } => {
                    self.shader(&shader.text, layer.as_ref().map(|l| &*l.text), console)
                }
                Statement::Connect { from, to, .. } => {
                    self.connect((&from.0.text, &from.1.text), (&to.0.text, &to.1.text), console)
                }
            };
            if !made {
                self.malformed("", text.get(begin(text, start)..).unwrap_or(""), console);
                return false;
            }
        }
        let Some(broken) = broken else { return true };
        let first = begin(text, broken.span.start);
        let near = text.get(first..).unwrap_or("");
        let near = near.split_inclusive(';').next().unwrap_or(near);
        self.malformed(&description(near, broken), near, console);
        false
    }

    fn malformed(&self, why: &str, near: &str, console: &mut Console<'_>) {
        console.error(&format!(
            "ShaderGroupBegin: error parsing group description: {why}\n        group: {}\n        problem might be here: {near}",
            self.group.name
        ));
    }
}

/// Offset of the first byte of a statement.
fn start(statement: &Statement) -> u32 {
    match statement {
        Statement::Param { span, .. } | Statement::Connect { span, .. } => span.start,
        Statement::Shader { shader, .. } => shader.span.start,
    }
}

/// The start of the statement that contains a byte of a text.
fn begin(text: &str, at: u32) -> usize {
    let before = text.get(..at as usize).unwrap_or("");
    let first = before.rfind([';', ',']).map_or(0, |at| at + 1);
    let rest = text.get(first..).unwrap_or("");
    first + rest.len() - rest.trim_start().len()
}

/// The message for an invalid statement.
fn description(near: &str, broken: &Diagnostic) -> String {
    let mut words = near.split(|c: char| c.is_whitespace() || matches!(c, ';' | ','));
    let keyword = words.next().unwrap_or("");
    let is_type = |word: &str| osl_ir::types::Type::parse(word).is_some();
    if keyword == "param" {
        let ty = words.find(|w| !w.is_empty()).unwrap_or("");
        if !is_type(ty) {
            return format!("Unknown type: {ty}");
        }
    } else if !matches!(keyword, "shader" | "connect") && !is_type(keyword) {
        return format!("Unknown statement (expected 'param', 'shader', or 'connect'): \"{keyword}\"");
    }
    broken.message.clone()
}

/// The message of a diagnostic, in the reference's words if scripts know them.
fn compiler_message(d: &Diagnostic) -> String {
    let unknown = d.message.strip_suffix("` is not declared").and_then(|m| m.split_once('`'));
    unknown.map_or_else(|| d.message.clone(), |(_, name)| format!("'{name}' was not declared in this scope"))
}

/// The shader name that a file name stands for.
fn stem(shader: &str) -> String {
    if !shader.ends_with(".oso") && !shader.ends_with(".osl") {
        return shader.to_string();
    }
    Path::new(shader).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
