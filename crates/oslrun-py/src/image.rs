//! Pictures of the grid, as the command makes them.

use crate::error::failed;
use crate::work::detached;
use numpy::PyArray1;
use osl_exec::Plane;
use osl_ir::ir::Kind;
use osl_job::host::Watching;
use osl_job::picture::{self, Extras};
use osl_job::{Event, Image, Session, Sink};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What is wanted of a picture.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Wanted {
    path: PathBuf,
    /// Texts in place of files.
    texts: BTreeMap<PathBuf, String>,
    include: Vec<PathBuf>,
    define: Vec<String>,
    strict: bool,
    repair: bool,
    params: Vec<(String, String)>,
    outputs: Option<Vec<String>>,
    grid: (usize, usize),
    samples: Option<u32>,
    threads: Option<u16>,
}

/// Keeps what the command would print.
#[derive(Default)]
struct Texts {
    messages: Vec<(bool, String)>,
    printed: String,
}

impl Sink for Texts {
    fn event(&mut self, event: Event<'_>) {
        match event {
            Event::Message(message) => {
                self.messages.push((message.severity == osl_job::Severity::Error, message.text()));
            }
            Event::Line(severity, text) => {
                self.messages.push((severity == osl_job::Severity::Error, text.to_string()))
            }
            Event::Doubt(text) => self.messages.push((false, text.to_string())),
            Event::Printed(text) => self.printed.push_str(text),
            Event::Diagnostics { .. } | Event::Scene(_) | Event::Text(_) => {}
        }
    }
}

/// A plane: its output, its component, and its values.
type Found<'py> = (String, usize, Bound<'py, PyAny>);

/// The planes of a picture, its messages, and the text that the shader prints.
#[pyfunction]
#[expect(clippy::type_complexity, reason = "a tuple for Python")]
pub(crate) fn image<'py>(
    py: Python<'py>,
    wanted: Wanted,
) -> PyResult<(Vec<Found<'py>>, Vec<(bool, String)>, String)> {
    let mut host = Watching::default();
    wanted.texts.iter().for_each(|(path, text)| host.edit(path, text));
    let session = Session::new(host);
    let mut image = Image::default().on(session.snapshot());
    image.shader.file = Some(wanted.path);
    image.shader.params = wanted.params;
    image.shader.outputs = wanted.outputs;
    image.shader.read.include = wanted.include;
    image.shader.read.define = wanted.define;
    image.shader.read.strict_syntax = wanted.strict;
    image.shader.repair = wanted.repair;
    image.points.grid = wanted.grid;
    image.sampling.samples = wanted.samples;
    image.running.threads = wanted.threads;
    image.wanted.values = true;
    let (done, texts) = detached(py, |cancel| {
        image.shader.read.limits = image.shader.read.limits.until(cancel);
        let mut texts = Texts::default();
        (picture::run(&image, Extras::default(), &mut texts), texts)
    })?;
    let done = done.map_err(|failure| failed(py, &failure.text))?;
    let plane = |plane: Plane| {
        let values = match plane.kind {
            Kind::Int => PyArray1::from_iter(py, plane.words.iter().map(|word| *word as i32)).into_any(),
            _ => PyArray1::from_slice(py, plane.words.as_floats()).into_any(),
        };
        (plane.output.to_string(), plane.component, values)
    };
    Ok((done.frame.planes.into_iter().map(plane).collect(), texts.messages, texts.printed))
}
