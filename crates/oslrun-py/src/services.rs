//! The services of a renderer as a Python object, which is asked once a run for each name; and closures as
//! arrays.

use crate::values::{of_kind, to_python};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn};
use osl::{Cancel, Closures, Value};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// The object, and its answers in this run.
pub(crate) struct Answers {
    object: Py<PyAny>,
    shape: Vec<usize>,
    has_spaces: bool,
    asked: Mutex<Asked>,
}

#[derive(Default)]
struct Asked {
    /// By object and name.
    attributes: BTreeMap<String, BTreeMap<String, Option<Answer>>>,
    spaces: BTreeMap<String, Option<[f32; 16]>>,
    /// The first exception that the object has raised, and what it cancels.
    error: Option<PyErr>,
    cancel: Option<Cancel>,
}

/// An answer: one value, or one for each point.
enum Answer {
    Same(Value),
    Ints(Vec<i32>),
    Floats(Vec<f32>),
    Triples(Vec<[f32; 3]>),
    Matrices(Vec<[f32; 16]>),
}

impl Answer {
    fn at(&self, point: usize) -> Option<Value> {
        match self {
            Answer::Same(value) => Some(value.clone()),
            Answer::Ints(list) => list.get(point).copied().map(Value::Int),
            Answer::Floats(list) => list.get(point).copied().map(Value::Float),
            Answer::Triples(list) => list.get(point).copied().map(Value::Triple),
            Answer::Matrices(list) => list.get(point).copied().map(Value::Matrix),
        }
    }
}

impl Answers {
    pub(crate) fn new(object: Py<PyAny>, shape: Vec<usize>, has_spaces: bool) -> Answers {
        Answers { object, shape, has_spaces, asked: Mutex::default() }
    }

    /// Cancels this if the object raises an exception.
    pub(crate) fn stop(&self, cancel: &Cancel) {
        self.lock().cancel = Some(cancel.clone());
    }

    /// The exception that the object has raised.
    pub(crate) fn error(&self) -> Option<PyErr> {
        self.lock().error.take()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Asked> {
        self.asked.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The answer to a question; none if it raises an exception, which ends the run.
    fn ask<T>(
        &self,
        asked: &mut Asked,
        question: impl FnOnce(Python<'_>) -> PyResult<Option<T>>,
    ) -> Option<T> {
        if asked.error.is_some() {
            return None;
        }
        Python::attach(question).unwrap_or_else(|error| {
            asked.error = Some(error);
            asked.cancel.iter().for_each(Cancel::cancel);
            None
        })
    }

    fn attribute(&self, py: Python<'_>, object: &str, name: &str) -> PyResult<Option<Answer>> {
        let found = py.import("oslrun._arrays")?.getattr("answer")?;
        let found = found.call1((self.object.bind(py), object, name, &self.shape))?;
        let Some((kind, value)) = found.extract::<Option<(String, Bound<'_, PyAny>)>>()? else {
            return Ok(None);
        };
        let floats = || -> PyResult<Vec<f32>> {
            let array: PyReadonlyArrayDyn<'_, f32> = value.extract()?;
            Ok(array.as_slice().map_err(|why| PyValueError::new_err(why.to_string()))?.to_vec())
        };
        Ok(Some(match kind.as_str() {
            "int" => {
                let array: PyReadonlyArrayDyn<'_, i32> = value.extract()?;
                Answer::Ints(array.as_slice().map_err(|why| PyValueError::new_err(why.to_string()))?.to_vec())
            }
            "float" => Answer::Floats(floats()?),
            "triple" => Answer::Triples(floats()?.as_chunks().0.to_vec()),
            "matrix" => Answer::Matrices(floats()?.as_chunks().0.to_vec()),
            kind => Answer::Same(of_kind(kind, &value)?),
        }))
    }
}

/// The services of one run.
pub(crate) struct Services(pub(crate) std::sync::Arc<Answers>);

impl osl::RendererServices for Services {
    fn attribute(&self, object: &str, name: &str, point: usize) -> Option<Value> {
        let mut asked = self.0.lock();
        if let Some(known) = asked.attributes.get(object).and_then(|names| names.get(name)) {
            return known.as_ref()?.at(point);
        }
        let answer = self.0.ask(&mut asked, |py| self.0.attribute(py, object, name));
        let value = answer.as_ref().and_then(|answer| answer.at(point));
        asked.attributes.entry(object.to_string()).or_default().insert(name.to_string(), answer);
        value
    }

    fn has_spaces(&self) -> bool {
        self.0.has_spaces
    }

    fn transform(&self, space: &str) -> Option<[f32; 16]> {
        let mut asked = self.0.lock();
        if let Some(known) = asked.spaces.get(space) {
            return *known;
        }
        let matrix = self.0.ask(&mut asked, |py| {
            let found = py.import("oslrun._arrays")?.getattr("space")?;
            let found = found.call1((self.0.object.bind(py), space))?;
            if found.is_none() { Ok(None) } else { crate::values::matrix(&found).map(Some) }
        });
        asked.spaces.insert(space.to_string(), matrix);
        matrix
    }
}

/// The components of one kind of closure, point after point.
#[derive(Default)]
struct Rows<'py> {
    points: Vec<i64>,
    weights: Vec<f32>,
    params: Vec<Vec<Bound<'py, PyAny>>>,
    numbers: Vec<Vec<f32>>,
}

/// Closures as a list of kinds: name, points, weights, and the parameters, each with its keyword, type, and a
/// list.
pub(crate) fn closures<'py>(py: Python<'py>, closures: Closures<'_>) -> PyResult<Bound<'py, PyList>> {
    let kinds = closures.kinds();
    let mut rows: Vec<Rows<'py>> = kinds.iter().map(|_| Rows::default()).collect();
    for (kind, rows) in kinds.iter().zip(&mut rows) {
        rows.params.resize_with(kind.params.len(), Vec::new);
        rows.numbers.resize_with(kind.params.len(), Vec::new);
    }
    for point in 0..closures.len() {
        for component in closures.at(point) {
            let Some(rows) = rows.get_mut(component.kind()) else { continue };
            rows.points.push(point as i64);
            rows.weights.extend(component.weight());
            for (at, (params, numbers)) in rows.params.iter_mut().zip(&mut rows.numbers).enumerate() {
                match (component.float(at), component.triple(at)) {
                    (Some(x), _) => numbers.push(x),
                    (_, Some(triple)) => numbers.extend(triple),
                    _ => params.push(to_python(py, component.value(at).as_ref())?),
                }
            }
        }
    }
    let made = PyList::empty(py);
    for (kind, rows) in kinds.iter().zip(rows) {
        let dict = PyDict::new(py);
        dict.set_item("name", &kind.name)?;
        dict.set_item("point", PyArray1::from_vec(py, rows.points))?;
        let weights: Bound<'py, PyArray2<f32>> =
            PyArray1::from_vec(py, rows.weights.clone()).reshape([rows.weights.len() / 3, 3])?;
        dict.set_item("weight", weights)?;
        let params = PyList::empty(py);
        for ((param, objects), numbers) in kind.params.iter().zip(rows.params).zip(rows.numbers) {
            let numbers = PyArray1::from_vec(py, numbers);
            params.append((&param.key, param.ty.to_string(), numbers, objects))?;
        }
        dict.set_item("params", params)?;
        made.append(dict)?;
    }
    Ok(made)
}
