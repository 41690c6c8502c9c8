//! `--userdata` and `--attributes`: the named data of surfaces and objects; with the globals of
//! `--global`.

use super::args::RunArgs;
use super::{Failure, input};
use osl_exec::Datum;
use osl_ir::ir::Const;
use osl_scene::Data;
use serde_json::Value;

/// Reads the values on the command line and the attribute file.
pub(super) fn read(args: &RunArgs) -> Result<Data, Failure> {
    let limits = args.read.limits.limits();
    let mut data = Data { globals: args.globals.values(), ..Data::default() };
    for (name, text) in &args.userdata {
        data.user.insert(name.clone(), user_datum(text));
    }
    let Some(path) = args.attributes.as_deref() else { return Ok(data) };
    let wrong = |why: &dyn std::fmt::Display| Failure::new(format!("attributes {}: {why}", path.display()));
    let text = input::read_text(path, limits).map_err(|e| wrong(&e))?;
    let value: Value = serde_json::from_str(&text).map_err(|e| wrong(&e))?;
    let Value::Object(list) = value else {
        return Err(wrong(&"the file is to hold an object: {\"name\": value, …}"));
    };
    for (name, value) in &list {
        match value {
            Value::Object(own) => {
                let object = data.objects.entry(name.clone()).or_default();
                for (attribute, value) in own {
                    let found = datum(value);
                    let path = format!("{name}.{attribute}");
                    object.insert(attribute.clone(), found.ok_or_else(|| wrong(&no_value(&path)))?);
                }
            }
            value => {
                let found = datum(value).ok_or_else(|| wrong(&no_value(name)))?;
                data.attributes.insert(name.clone(), found);
            }
        }
    }
    Ok(data)
}

fn no_value(name: &str) -> String {
    format!("`{name}` is no number, string, or list of numbers or of strings")
}

/// One number is a float, three are a triple; everything else, and text in quotes, is a string.
fn user_datum(text: &str) -> Datum {
    let numbers: Option<Vec<f32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    Datum::one(match numbers.as_deref() {
        Some([x]) => Const::Float(*x),
        Some([x, y, z]) => Const::Triple([*x, *y, *z]),
        _ => {
            let inside = text.strip_prefix('"').and_then(|t| t.strip_suffix('"'));
            Const::Str(inside.unwrap_or(text).into())
        }
    })
}

/// The datum for a JSON value: an int or a float as written, a triple or a matrix for 3 or 16 numbers, an
/// array for any other length.
fn datum(value: &Value) -> Option<Datum> {
    let Value::Array(list) = value else { return scalar(value).map(Datum::one) };
    let numbers: Option<Vec<f32>> = list.iter().map(|x| x.as_f64().map(|x| x as f32)).collect();
    if let Some(numbers) = numbers {
        if let Ok(triple) = <[f32; 3]>::try_from(numbers.as_slice()) {
            return Some(Datum::one(Const::Triple(triple)));
        }
        if let Ok(matrix) = <[f32; 16]>::try_from(numbers.as_slice()) {
            return Some(Datum::one(Const::Matrix(Box::new(matrix))));
        }
        if !list.iter().all(|x| x.is_i64()) {
            return Some(Datum::array(numbers.into_iter().map(Const::Float).collect()));
        }
    }
    let values: Vec<Const> = list.iter().map(scalar).collect::<Option<_>>()?;
    let same = values.windows(2).all(|w| w.first().map(Const::kind) == w.last().map(Const::kind));
    (same && !values.is_empty()).then(|| Datum::array(values))
}

fn scalar(value: &Value) -> Option<Const> {
    match value {
        Value::Number(n) => match n.as_i64() {
            Some(int) => i32::try_from(int).ok().map(Const::Int),
            None => n.as_f64().map(|x| Const::Float(x as f32)),
        },
        Value::String(text) => Some(Const::Str(text.as_str().into())),
        _ => None,
    }
}
