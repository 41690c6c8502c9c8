//! Shaders, read from files or from text.

use crate::error::{diagnostics, failed, raised, rejected};
use crate::values;
use crate::work::detached;
use osl::{Analysis, Files, Levels, Limits, MemoryFiles, ReadOptions};
use osl_files::Roots;
use osl_job::request::Reading;
use osl_job::source::{input, repair};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// A shader that was read and checked.
#[pyclass(frozen, module = "oslrun._native")]
pub(crate) struct Shader {
    pub(crate) shader: osl::Shader,
    pub(crate) params: Vec<osl::Param>,
    /// Its diagnostics: warnings and lints.
    lints: Vec<osl::Diagnostic>,
}

/// Texts by name, folders for what they lack, and then the built-in shaders.
pub(crate) struct Given {
    texts: MemoryFiles,
    folders: Vec<PathBuf>,
    roots: Roots,
    limits: Limits,
}

impl Given {
    pub(crate) fn new(texts: &BTreeMap<String, Vec<u8>>, folders: Vec<PathBuf>) -> Given {
        let mut memory = MemoryFiles::new();
        texts.iter().for_each(|(name, bytes)| memory.insert(name, bytes));
        Given { texts: memory, roots: Roots::new(&folders), folders, limits: Limits::default() }
    }
}

impl Files for Given {
    fn read(&self, name: &str) -> Option<Arc<[u8]>> {
        let open = || {
            let found = self.roots.first(self.folders.iter().map(|folder| folder.join(name))).ok()?;
            Some(found.bytes(self.limits.reading.file_bytes).ok()?.into())
        };
        let built_in = || Some(oslrun::nodes::find(name.strip_suffix(".osl")?)?.as_bytes().into());
        self.texts.read(name).or_else(open).or_else(built_in)
    }
}

#[pymethods]
impl Shader {
    /// Reads a file as the command does.
    #[staticmethod]
    fn file(
        py: Python<'_>,
        path: PathBuf,
        include: Vec<PathBuf>,
        define: Vec<String>,
        strict: bool,
        repair: bool,
    ) -> PyResult<Shader> {
        let reading = Reading { include, define, strict_syntax: strict, ..Reading::default() };
        let read = detached(py, |_| {
            let mut input = input::read(&path, &reading).map_err(|failure| failure.text)?;
            if repair {
                repair::apply(&mut input, None).map_err(|failure| failure.text)?;
            }
            let checked = osl::stages::check(&input.name, &input.text, &input.files, &input.options);
            Ok(Analysis::of_checked(checked, &reading.limits))
        })?;
        Shader::of(py, read.map_err(|text: String| failed(py, &text))?)
    }

    /// Reads a text.
    #[staticmethod]
    fn text(
        py: Python<'_>,
        named: (String, String),
        headers: BTreeMap<String, Vec<u8>>,
        include: Vec<PathBuf>,
        define: Vec<String>,
        strict: bool,
    ) -> PyResult<Shader> {
        let read = detached(py, |_| {
            let mut options = ReadOptions::default().strict(strict);
            for text in &define {
                let (name, value) = text.split_once('=').unwrap_or((text, "1"));
                options = options.define(name, value);
            }
            Analysis::of(&named.0, &named.1, &Given::new(&headers, include), &options)
        })?;
        Shader::of(py, read)
    }

    #[getter]
    fn name(&self) -> &str {
        self.shader.name()
    }

    #[getter]
    fn kind(&self) -> &str {
        self.shader.kind()
    }

    #[getter]
    fn params<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        values::params(py, &self.params)
    }

    #[getter]
    fn metadata<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        values::metadata(py, &self.shader.metadata())
    }

    #[getter]
    fn warnings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        diagnostics(py, &self.lints)
    }

    /// The kind and shape of one value of a parameter or of a field `s.a`; `None` if it is none of numbers.
    fn shape_of(&self, path: &str) -> Option<(&'static str, Vec<usize>)> {
        values::shape_of(values::type_of(&self.params, path)?)
    }
}

impl Shader {
    fn of(py: Python<'_>, analysis: Analysis) -> PyResult<Shader> {
        let limits = Limits::default();
        if analysis.has_errors() {
            let checked = analysis.checked();
            let judged = osl::stages::judge(checked, &Levels::default(), |_| true, &limits);
            let list: Vec<_> = judged.into_iter().map(|(diagnostic, _)| diagnostic).collect();
            let text = oslrun::cli::rejected(&list, &checked.sources);
            return Err(rejected(py, &text, &osl::stages::describe(&list, &checked.sources)));
        }
        let lints = analysis.diagnostics(&Levels::default());
        let shader = analysis.shader().map_err(|error| raised(py, &error))?;
        Ok(Shader { params: shader.params(), shader, lints })
    }
}
