//! Errors and diagnostics as Python objects.

use osl::{Diagnostic, Edit, Error, ErrorKind, Fix, Label, Position, Range, Severity};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// The exception for an error: one of `oslrun._errors`, with the diagnostics.
pub(crate) fn raised(py: Python<'_>, error: &Error) -> PyErr {
    let class = match error.kind() {
        ErrorKind::Source => "CompileError",
        ErrorKind::Run => "RunError",
        ErrorKind::Cancelled => "Cancelled",
        _ => "RequestError",
    };
    let places = error.range().map(|range| range_of(py, Some(range)));
    let made = || {
        exception(py, class, &error.to_string(), diagnostics(py, error.diagnostics())?, places.transpose()?)
    };
    made().unwrap_or_else(|error| error)
}

/// The exception of a request that failed with this text.
pub(crate) fn failed(py: Python<'_>, text: &str) -> PyErr {
    let made = || exception(py, "RequestError", text, PyList::empty(py), None);
    made().unwrap_or_else(|_| PyRuntimeError::new_err(text.to_string()))
}

/// The exception for a source text with errors.
pub(crate) fn rejected(py: Python<'_>, text: &str, list: &[Diagnostic]) -> PyErr {
    let made = || exception(py, "CompileError", text.trim_end(), diagnostics(py, list)?, None);
    made().unwrap_or_else(|error| error)
}

fn exception(
    py: Python<'_>,
    class: &str,
    text: &str,
    diagnostics: Bound<'_, PyList>,
    range: Option<Bound<'_, PyAny>>,
) -> PyResult<PyErr> {
    let class = py.import("oslrun._errors")?.getattr(class)?;
    Ok(PyErr::from_value(class.call1((text, diagnostics, range))?))
}

/// Diagnostics as a list of `oslrun.Diagnostic`.
pub(crate) fn diagnostics<'py>(py: Python<'py>, list: &[Diagnostic]) -> PyResult<Bound<'py, PyList>> {
    let class = py.import("oslrun._errors")?.getattr("Diagnostic")?;
    let made = PyList::empty(py);
    for d in list {
        let values = PyDict::new(py);
        values.set_item("code", d.code)?;
        values.set_item("name", d.name)?;
        values.set_item("severity", if d.severity == Severity::Error { "error" } else { "warning" })?;
        values.set_item("message", &d.message)?;
        values.set_item("span", range_of(py, d.range.as_ref())?)?;
        values.set_item("label", &d.label)?;
        let labels = d.labels.iter().map(|Label { range, text }| Ok((range_of(py, range.as_ref())?, text)));
        values.set_item("labels", labels.collect::<PyResult<Vec<_>>>()?)?;
        values.set_item("notes", &d.notes)?;
        values.set_item("help", &d.help)?;
        let fixes = d.fixes.iter().map(|Fix { title, edits, safe }| {
            let edits = edits.iter().map(|Edit { range, text }| Ok((range_of(py, Some(range))?, text)));
            Ok((title, edits.collect::<PyResult<Vec<_>>>()?, *safe))
        });
        values.set_item("edits", fixes.collect::<PyResult<Vec<_>>>()?)?;
        made.append(class.call_method1("_made", (values,))?)?;
    }
    Ok(made)
}

/// A range as its file, and line and column of both ends, from 1; `None` without one.
fn range_of<'py>(py: Python<'py>, range: Option<&Range>) -> PyResult<Bound<'py, PyAny>> {
    let ends = |Range { file, start, end }: &Range| {
        let of = |at: &Position| (at.line, at.column, at.offset);
        (file.clone(), of(start), of(end))
    };
    Ok(range.map(ends).into_pyobject(py)?.into_any())
}
