//! Shaders, compiled from text.

use crate::diagnostic::{self, Diagnostic};
use crate::files::{Files, NoFiles};
use crate::param::{self, Metadata, Param};
use crate::{Analysis, Error, ReadOptions};
use osl_hir::hir;
use osl_syntax::ast::ShaderKind;
use osl_syntax::source::SourceMap;
use std::sync::Arc;

/// A shader that was read and checked, and that can be a layer of any number of groups.
#[derive(Clone, Debug)]
pub struct Shader {
    pub(crate) program: Arc<hir::Program>,
    pub(crate) sources: Arc<SourceMap>,
    warnings: Vec<Diagnostic>,
}

impl Shader {
    /// Compiles a text; `name` is the file name in diagnostics. A name that ends in `.oso` means that the
    /// text is a compiled shader. The text may include the headers that come with the compiler, such as
    /// `vector2.h`; other includes fail: see [`Shader::read`].
    ///
    /// # Errors
    /// The text has errors.
    pub fn compile(name: &str, text: &str) -> Result<Shader, Error> {
        Shader::read(name, text, &NoFiles, &ReadOptions::default())
    }

    /// Compiles a text that may include the client's files. If these have a `stdosl.h`, it replaces the
    /// compiler's own header before the first line. The compiler's other headers are used where the client
    /// has none.
    ///
    /// # Errors
    /// The text or an included one has errors, or an included file does not exist.
    pub fn read(name: &str, text: &str, files: &dyn Files, options: &ReadOptions) -> Result<Shader, Error> {
        Analysis::of(name, text, files, options).shader()
    }

    pub(crate) fn new(
        program: hir::Program,
        sources: SourceMap,
        list: &[osl_syntax::diagnostic::Diagnostic],
    ) -> Shader {
        let warnings = diagnostic::diagnostics(list, &sources);
        Shader { program: Arc::new(program), sources: Arc::new(sources), warnings }
    }

    /// Its name, as declared in the text.
    pub fn name(&self) -> &str {
        &self.program.shader.name
    }

    /// Its kind, as declared: `shader`, `surface`, `displacement` or `volume`.
    pub fn kind(&self) -> &'static str {
        match self.program.shader.kind {
            ShaderKind::Generic => "shader",
            ShaderKind::Surface => "surface",
            ShaderKind::Displacement => "displacement",
            ShaderKind::Volume => "volume",
        }
    }

    /// Its parameters, in order.
    ///
    /// ```
    /// let text = "shader a(float size = 2 [[ float max = 10, string label = \"Size\" ]]) {}";
    /// let shader = osl::Shader::compile("a.osl", text)?;
    /// let size = &shader.params()[0];
    /// assert_eq!((size.ty.to_string(), size.default.clone()), ("float".to_string(), Some(2.0.into())));
    /// assert_eq!(size.metadatum("max"), Some(&10.0.into()));
    /// # Ok::<(), osl::Error>(())
    /// ```
    pub fn params(&self) -> Vec<Param> {
        param::params(&self.program)
    }

    /// Its own metadata, in order.
    pub fn metadata(&self) -> Vec<Metadata> {
        param::metadata(&self.program.shader.metadata)
    }

    /// The warnings about a text that compiles, without lints: see [`Analysis::diagnostics`].
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.warnings
    }
}
