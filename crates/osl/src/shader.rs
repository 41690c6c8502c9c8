//! Shaders, compiled from text.

use crate::error::{self, Diagnostic, Error};
use crate::pipeline;
use osl_ir::hir;
use osl_limits::Limits;
use osl_syntax::source::{SourceMap, SourceProvider};
use osl_syntax::{NoFiles, Options};
use std::sync::Arc;

/// A shader that was read and checked, and that can be a layer of any number of groups.
#[derive(Clone, Debug)]
pub struct Shader {
    pub(crate) program: Arc<hir::Program>,
    pub(crate) sources: Arc<SourceMap>,
    warnings: Vec<Diagnostic>,
}

/// A parameter of a shader.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Param {
    /// Its name.
    pub name: String,
    /// Its type as written: `float`, `color[3]`.
    pub ty: String,
    /// Whether it is an output.
    pub output: bool,
}

impl Shader {
    /// Compiles a text; `name` is the file name in diagnostics. The text may include the headers that come
    /// with the compiler, such as `vector2.h`; other includes fail: see [`Shader::compile_with`].
    ///
    /// # Errors
    /// The text has errors.
    pub fn compile(name: &str, text: &str) -> Result<Shader, Error> {
        Shader::read(name, text, &NoFiles, &Limits::default())
    }

    /// Compiles a text with includes: `include` returns the text for a name. If it returns a `stdosl.h`, that
    /// replaces the compiler's own header before the first line. The compiler's other headers are used where
    /// `include` returns none.
    ///
    /// # Errors
    /// The text or an included one has errors, or an included file does not exist.
    pub fn compile_with(
        name: &str,
        text: &str,
        include: impl Fn(&str) -> Option<String>,
    ) -> Result<Shader, Error> {
        Shader::compile_within(name, text, include, &Limits::default())
    }

    /// As [`Shader::compile_with`], with limits of its own for reading.
    ///
    /// # Errors
    /// As [`Shader::compile_with`].
    pub fn compile_within(
        name: &str,
        text: &str,
        include: impl Fn(&str) -> Option<String>,
        limits: &Limits,
    ) -> Result<Shader, Error> {
        Shader::read(name, text, &Includes(include), limits)
    }

    fn read(name: &str, text: &str, files: &dyn SourceProvider, limits: &Limits) -> Result<Shader, Error> {
        let options = Options { limits: limits.clone(), ..Options::default() };
        let checked = pipeline::check(name, text, files, &options);
        let Some(program) = checked.program else {
            return Err(Error::of(&checked.diagnostics, &checked.sources));
        };
        let warnings = error::diagnostics(&checked.diagnostics, &checked.sources);
        Ok(Shader { program: Arc::new(program), sources: Arc::new(checked.sources), warnings })
    }

    /// Its name, as declared in the text.
    pub fn name(&self) -> &str {
        &self.program.shader.name
    }

    /// Its parameters, in order.
    pub fn params(&self) -> Vec<Param> {
        let program = &self.program;
        let of = |p: &hir::Param| {
            let var = program.vars.get(p.var.0 as usize)?;
            Some(Param { name: var.name.to_string(), ty: program.structs.show(var.ty), output: p.output })
        };
        program.shader.params.iter().filter_map(of).collect()
    }

    /// The warnings about a text that compiles.
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.warnings
    }
}

/// Includes from a function.
struct Includes<F>(F);

impl<F: Fn(&str) -> Option<String>> SourceProvider for Includes<F> {
    fn include(&self, name: &str, _: bool, _: &str) -> Result<(String, Arc<str>), String> {
        let text = (self.0)(name).ok_or("no such file")?;
        Ok((name.to_string(), text.into()))
    }

    fn standard(&self) -> Option<Result<(String, Arc<str>), String>> {
        self.include("stdosl.h", false, "").ok().map(Ok)
    }
}
