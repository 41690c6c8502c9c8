//! Values, types and parameters as Python objects.

use osl::{Base, Length, Metadata, Param, Type, Value};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// A value as a Python object: numbers, strings, and lists of these; a struct as a dict.
pub(crate) fn to_python<'py>(py: Python<'py>, value: Option<&Value>) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Some(Value::Int(x)) => x.into_pyobject(py)?.into_any(),
        Some(Value::Float(x)) => x.into_pyobject(py)?.into_any(),
        Some(Value::Triple(x)) => x.to_vec().into_pyobject(py)?.into_any(),
        Some(Value::Matrix(x)) => rows(x).into_pyobject(py)?.into_any(),
        Some(Value::String(x)) => x.into_pyobject(py)?.into_any(),
        Some(Value::Ints(x)) => x.into_pyobject(py)?.into_any(),
        Some(Value::Floats(x)) => x.into_pyobject(py)?.into_any(),
        Some(Value::Triples(x)) => {
            x.iter().map(|t| t.to_vec()).collect::<Vec<_>>().into_pyobject(py)?.into_any()
        }
        Some(Value::Matrices(x)) => x.iter().map(rows).collect::<Vec<_>>().into_pyobject(py)?.into_any(),
        Some(Value::Strings(x)) => x.into_pyobject(py)?.into_any(),
        Some(Value::Struct(fields)) => {
            let dict = PyDict::new(py);
            for (name, value) in fields {
                dict.set_item(name, to_python(py, Some(value))?)?;
            }
            dict.into_any()
        }
        Some(Value::List(list)) => {
            let made = PyList::empty(py);
            for value in list {
                made.append(to_python(py, Some(value))?)?;
            }
            made.into_any()
        }
        _ => py.None().into_bound(py),
    })
}

fn rows(matrix: &[f32; 16]) -> Vec<Vec<f32>> {
    matrix.chunks(4).map(<[f32]>::to_vec).collect()
}

/// The value of a Python object for a parameter of this type.
pub(crate) fn from_python(ty: &Type, object: &Bound<'_, PyAny>) -> PyResult<Value> {
    let wrong = |why: PyErr| {
        let given = object.get_type().name().map_or_else(|_| String::new(), |name| name.to_string());
        PyTypeError::new_err(format!("{given} is no value of type {ty}: {}", why.value(object.py())))
    };
    if let Base::Struct(of) = &ty.base {
        let dict = object.cast::<PyDict>().map_err(|why| wrong(why.into()))?;
        let mut fields = Vec::new();
        for (name, value) in dict.iter() {
            let name: String = name.extract()?;
            let Some((_, ty)) = of.fields.iter().find(|(field, _)| *field == name) else {
                return Err(PyValueError::new_err(format!("struct `{}` has no field `{name}`", of.name)));
            };
            fields.push((name, from_python(ty, &value)?));
        }
        return Ok(Value::Struct(fields));
    }
    let one = ty.length == Length::One;
    let value = match (&ty.base, one) {
        (Base::Int, true) => object.extract().map(Value::Int),
        (Base::Int, false) => object.extract().map(Value::Ints),
        (Base::Float, true) => object.extract().map(Value::Float),
        (Base::Float, false) => object.extract().map(Value::Floats),
        (Base::String, true) => object.extract().map(Value::String),
        (Base::String, false) => object.extract().map(Value::Strings),
        (Base::Matrix, true) => matrix(object).map(Value::Matrix),
        (Base::Matrix, false) => each(object, matrix).map(Value::Matrices),
        (Base::Closure, _) => Err(PyTypeError::new_err("closures have no value in Python")),
        (_, true) => triple(object).map(Value::Triple),
        (_, false) => each(object, triple).map(Value::Triples),
    };
    value.map_err(wrong)
}

/// Three numbers, or one for all three.
pub(crate) fn triple(object: &Bound<'_, PyAny>) -> PyResult<[f32; 3]> {
    object.extract::<f32>().map(|x| [x; 3]).or_else(|_| object.extract())
}

/// Sixteen numbers, or four rows of four.
pub(crate) fn matrix(object: &Bound<'_, PyAny>) -> PyResult<[f32; 16]> {
    let flat = |rows: Vec<[f32; 4]>| rows.into_flattened();
    let list: Vec<f32> = object.extract::<Vec<[f32; 4]>>().map(flat).or_else(|_| object.extract())?;
    <[f32; 16]>::try_from(list)
        .map_err(|list| PyValueError::new_err(format!("{} numbers, not 16", list.len())))
}

fn each<T>(object: &Bound<'_, PyAny>, of: impl Fn(&Bound<'_, PyAny>) -> PyResult<T>) -> PyResult<Vec<T>> {
    object.try_iter()?.map(|item| of(&item?)).collect()
}

/// Parameters as dicts: name, type, output, default, metadata, and the shape of a value, which is `None` if
/// it is no array of numbers or if its length is open.
pub(crate) fn params<'py>(py: Python<'py>, list: &[Param]) -> PyResult<Bound<'py, PyList>> {
    let made = PyList::empty(py);
    for param in list {
        let dict = PyDict::new(py);
        dict.set_item("name", &param.name)?;
        dict.set_item("type", param.ty.to_string())?;
        dict.set_item("output", param.output)?;
        dict.set_item("default", to_python(py, param.default.as_ref())?)?;
        dict.set_item("metadata", metadata(py, &param.metadata)?)?;
        made.append(dict)?;
    }
    Ok(made)
}

/// Metadata as a dict.
pub(crate) fn metadata<'py>(py: Python<'py>, list: &[Metadata]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for Metadata { name, value, .. } in list {
        dict.set_item(name, to_python(py, value.as_ref())?)?;
    }
    Ok(dict)
}

/// The type of a parameter, or of a field `s.a` of one.
pub(crate) fn type_of<'p>(params: &'p [Param], path: &str) -> Option<&'p Type> {
    let mut parts = path.split('.');
    let first = parts.next()?;
    let mut ty = &params.iter().find(|param| param.name == first)?.ty;
    for part in parts {
        let Base::Struct(of) = &ty.base else { return None };
        ty = &of.fields.iter().find(|(name, _)| name == part)?.1;
    }
    Some(ty)
}

/// What an array of one value for each point has after the axes of the points: the kind of its numbers, and
/// the shape of a value. `None` if there are no such arrays.
pub(crate) fn shape_of(ty: &Type) -> Option<(&'static str, Vec<usize>)> {
    let (kind, own) = match ty.base {
        Base::Int => ("int", vec![]),
        Base::Float => ("float", vec![]),
        Base::Color | Base::Point | Base::Vector | Base::Normal => ("triple", vec![3]),
        Base::Matrix => ("matrix", vec![4, 4]),
        _ => return None,
    };
    let mut shape = match ty.length {
        Length::One => vec![],
        Length::Array(n) => vec![n],
        Length::Open => return None,
    };
    shape.extend(own);
    Some((kind, shape))
}

/// The value of a Python object of a kind: `same-float`, `same-int`, `same-triple`, `same-matrix`,
/// `same-string`.
pub(crate) fn of_kind(kind: &str, object: &Bound<'_, PyAny>) -> PyResult<Value> {
    match kind {
        "same-int" => object.extract().map(Value::Int),
        "same-float" => object.extract().map(Value::Float),
        "same-triple" => triple(object).map(Value::Triple),
        "same-matrix" => matrix(object).map(Value::Matrix),
        "same-string" => object.extract().map(Value::String),
        "same-floats" => object.extract().map(Value::Floats),
        "same-ints" => object.extract().map(Value::Ints),
        _ => Err(PyTypeError::new_err(format!("there are no values of kind `{kind}`"))),
    }
}
