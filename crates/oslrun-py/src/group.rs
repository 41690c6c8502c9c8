//! Groups: layers with values of parameters and connections.

use crate::error::raised;
use crate::program::{Program, Renderer};
use crate::shader::{Given, Shader};
use crate::values::{from_python, type_of};
use crate::work::detached;
use osl::{Arithmetic, CompileOptions, ReadOptions};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A group, whose layers are added one after the other.
#[pyclass(module = "oslrun._native")]
pub(crate) struct Group(osl::Group);

#[pymethods]
impl Group {
    #[new]
    fn new(name: Option<&str>) -> Group {
        Group(name.map_or_else(osl::Group::new, osl::Group::named))
    }

    /// Reads a serialized group.
    #[staticmethod]
    fn text(
        py: Python<'_>,
        named: (String, String),
        shaders: BTreeMap<String, Vec<u8>>,
        folders: Vec<PathBuf>,
    ) -> PyResult<Group> {
        let read = detached(py, |_| {
            let files = Given::new(&shaders, folders);
            osl::Group::read(&named.0, &named.1, &files, &ReadOptions::default())
        })?;
        read.map(Group).map_err(|error| raised(py, &error))
    }

    /// Adds a layer with values of parameters; the last ones take the data of the points.
    fn layer(
        &mut self,
        name: &str,
        shader: &Shader,
        params: Vec<(String, Bound<'_, PyAny>)>,
        varying: Vec<String>,
    ) -> PyResult<()> {
        let mut group = self.0.clone().layer(name, &shader.shader);
        for (param, object) in params {
            let ty = type_of(&shader.params, &param);
            let ty = ty.ok_or_else(|| PyKeyError::new_err(format!("no parameter `{param}`")))?;
            let value = from_python(ty, &object).map_err(|error| named(object.py(), &param, &error))?;
            group = group.param(&param, value);
        }
        self.0 = varying.iter().fold(group, |group, param| group.interpolate(param));
        Ok(())
    }

    /// Connects `LAYER.OUTPUT` to `LAYER.PARAMETER`.
    fn connect(&mut self, from: &str, to: &str) {
        self.0 = self.0.clone().connect(from, to);
    }

    /// Compiles for some outputs, at points that have lists of these globals, and for a renderer unless
    /// services have spaces.
    fn compile(
        &self,
        py: Python<'_>,
        outputs: Vec<String>,
        lists: Vec<String>,
        fast: bool,
        renderer: Option<PyRef<'_, Renderer>>,
    ) -> PyResult<Program> {
        let names: Vec<&str> = outputs.iter().map(String::as_str).collect();
        let arithmetic = if fast { Arithmetic::Fast } else { Arithmetic::Strict };
        let points = Program::points(0, lists.iter().map(|name| (name.as_str(), &[][..])))?;
        let mut options = CompileOptions::outputs(&names).arithmetic(arithmetic).points(&points);
        if let Some(renderer) = renderer {
            options = options.renderer(&renderer.0);
        }
        let compiled = detached(py, |_| self.0.clone().compile_with(&options))?;
        let program = compiled.map_err(|error| raised(py, &error))?;
        Program::new(program).map_err(|error| raised(py, &error))
    }
}

/// The same exception, whose text names the parameter.
fn named(py: Python<'_>, param: &str, error: &PyErr) -> PyErr {
    PyErr::from_type(error.get_type(py), format!("parameter `{param}`: {}", error.value(py)))
}
