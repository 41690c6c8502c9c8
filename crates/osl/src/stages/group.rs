//! Compiles the text of a group to one program.
//!
//! Each shader is read and resolved once. Each layer has its own part of the source map, so that a location
//! also identifies the layer.

use super::{Checked, check};
use osl_hir::hir;
use osl_lower::group::Group;
use osl_lower::group::text::{self, Shaders, Statement};
use osl_syntax::Options;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::{SourceMap, SourceProvider};
use osl_syntax::span::Span;
use std::collections::HashMap;
use std::sync::Arc;

/// Provides the shaders of a group.
pub trait ShaderFiles {
    /// The file name of a shader, and its text.
    ///
    /// # Errors
    /// Why the shader is not available, as text for the user.
    fn find(&self, shader: &str) -> Result<(String, String), String>;

    /// Provides the files that the shaders include.
    fn includes(&self) -> &dyn SourceProvider;
}

/// A group that was read, with or without errors.
pub struct CheckedGroup {
    /// The text of the group, followed by the files of each layer.
    pub sources: SourceMap,
    /// The diagnostics; those of the group's text come first.
    pub diagnostics: Vec<Diagnostic>,
    /// The group, if there is no error.
    pub group: Option<Group>,
}

/// Reads the text of a group and its shaders.
pub fn check_group(
    file: &str,
    text: &str,
    name: &str,
    files: &dyn ShaderFiles,
    options: &Options,
) -> CheckedGroup {
    let mut sources = SourceMap::default();
    sources.add(file, text.into());
    let (statements, mut diagnostics) = text::parse(text, 0, &options.limits);
    let mut linked = link(sources, &statements, name, files, options);
    diagnostics.append(&mut linked.diagnostics);
    let failed = diagnostics.iter().any(Diagnostic::is_error);
    CheckedGroup { group: linked.group.filter(|_| !failed), diagnostics, ..linked }
}

/// Builds a group from statements whose locations are in `sources`, and reads its shaders.
pub fn link(
    sources: SourceMap,
    statements: &[Statement],
    name: &str,
    files: &dyn ShaderFiles,
    options: &Options,
) -> CheckedGroup {
    let mut library = Library::new(sources, files, options);
    let (group, mut diagnostics) = text::build(name, statements, &mut library, &options.limits);
    diagnostics.append(&mut library.diagnostics);
    let failed = diagnostics.iter().any(Diagnostic::is_error);
    CheckedGroup { sources: library.sources, diagnostics, group: Some(group).filter(|_| !failed) }
}

/// The shaders read so far.
pub struct Library<'a> {
    files: &'a dyn ShaderFiles,
    options: &'a Options,
    /// Their files, once for each layer.
    pub sources: SourceMap,
    known: HashMap<String, Result<LayerSource, String>>,
    /// The diagnostics from reading them, with locations in `sources`.
    pub diagnostics: Vec<Diagnostic>,
}

struct LayerSource {
    program: Arc<hir::Program>,
    sources: SourceMap,
}

impl Shaders for Library<'_> {
    fn load(&mut self, name: &str) -> Result<(Arc<hir::Program>, u32), String> {
        if !self.known.contains_key(name) {
            let known = self.read(name);
            self.known.insert(name.to_string(), known);
        }
        let Some(Ok(known)) = self.known.get(name) else {
            let why = self.known.get(name).and_then(|k| k.as_ref().err());
            return Err(why.cloned().unwrap_or_default());
        };
        let base = self.sources.append(&known.sources).ok_or("the sources have more than 4 GiB")?;
        Ok((known.program.clone(), base))
    }
}

impl<'a> Library<'a> {
    /// An empty library. Files that it reads are appended to those of `sources`.
    pub fn new(sources: SourceMap, files: &'a dyn ShaderFiles, options: &'a Options) -> Library<'a> {
        Library { files, options, sources, known: HashMap::new(), diagnostics: Vec::new() }
    }

    fn read(&mut self, name: &str) -> Result<LayerSource, String> {
        let (file, text) = self.files.find(name)?;
        let checked = check(&file, &text, self.files.includes(), self.options);
        let Checked { sources, diagnostics, program, .. } = checked;
        let base = self.sources.append(&sources).ok_or("the sources have more than 4 GiB")?;
        self.diagnostics.extend(diagnostics.into_iter().map(|d| moved(d, base)));
        let program = program.ok_or_else(|| format!("{file} has errors"))?;
        Ok(LayerSource { program: Arc::new(program), sources })
    }
}

/// A diagnostic whose files were appended to another source map.
pub fn moved(mut d: Diagnostic, by: u32) -> Diagnostic {
    let mv = |span: &mut Span| *span = span.moved(by);
    mv(&mut d.span);
    d.labels.iter_mut().for_each(|(span, _)| mv(span));
    d.fixes.iter_mut().flat_map(|fix| &mut fix.edits).for_each(|edit| mv(&mut edit.span));
    d
}
