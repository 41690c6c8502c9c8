//! `--userdata` and `--attributes`: the named data of surfaces and objects; with the globals of
//! `--global`.

use super::dialect;
use super::input;
use crate::Failure;
use crate::request::{Image, Reading};
use crate::spoken::Spoken;
use osl_exec::Datum;
use osl_ir::ir::{Body, Const, Kernel, Kind, Op, ValueId};
use osl_ir::passes;
use osl_limits::Limits;
use osl_lower::group::{Group, Rules};
use osl_numeric::matrix::diagonal;
use osl_scene::Data;
use osl_scene::answers::Place;
use osl_scene::glam::Vec2;
use osl_scene::mesh::Bounds;
use osl_syntax::spelling::closest;
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::Arc;

/// Reads the values on the command line and the attribute file, with the answers of a dialect.
pub fn read(image: &Image, spoken: Option<&Spoken>) -> Result<Data, Failure> {
    let read = &image.shader.read;
    let mut data = match image.provided.attributes.as_deref() {
        Some(path) => read.snapshot.keep(
            |kept| &mut kept.data,
            || path.display().to_string(),
            || Ok((attributes(path, read)?, Some(vec![path.to_owned()]))),
        )?,
        None => Data::default(),
    };
    data.globals = image.provided.globals.values();
    data.answers =
        spoken.map(|spoken| Arc::new(dialect::answers(&spoken.dialect, image))).unwrap_or_default();
    data.place = patch(image);
    for (name, text) in &image.provided.userdata {
        data.user.insert(name.clone(), user_datum(text));
    }
    Ok(data)
}

/// The attributes in a file.
fn attributes(path: &Path, read: &Reading) -> Result<Data, Failure> {
    let mut data = Data::default();
    let wrong = |why: &dyn std::fmt::Display| Failure::new(format!("attributes {}: {why}", path.display()));
    let text = input::read_text(path, read).map_err(|e| wrong(&e))?;
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

/// Where the grid is.
fn patch(image: &Image) -> Place {
    let (scale, offset) = (Vec2::from(image.points.uv_scale), Vec2::from(image.points.uv_offset));
    let (first, last) = (offset, offset + scale);
    let bounds = Bounds { min: first.min(last).extend(1.0), max: first.max(last).extend(1.0) };
    Place { bounds, ..Place::default() }
}

fn no_value(name: &str) -> String {
    format!("`{name}` is no number, string, or list of numbers or of strings")
}

/// The text as a value of each type that it may have: as for a parameter, one or three numbers are a triple,
/// one or sixteen a matrix, and an array has all numbers or strings. Text in quotes is a string only.
fn user_datum(text: &str) -> Datum {
    let string = |text: &str| Const::Str(text.into());
    if let Some(inside) = text.strip_prefix('"').and_then(|t| t.strip_suffix('"')) {
        return Datum::one(string(inside));
    }
    let parts: Vec<&str> = text.split([',', ' ']).map(str::trim).filter(|part| !part.is_empty()).collect();
    let floats: Vec<f32> = parts.iter().map_while(|part| part.parse().ok()).collect();
    let ints: Vec<i32> = parts.iter().map_while(|part| part.parse().ok()).collect();
    let all = |values: Vec<Const>, each: usize| {
        (!values.is_empty() && values.len() * each == parts.len()).then_some(values)
    };
    let ints = all(ints.into_iter().map(Const::Int).collect(), 1);
    let number = all(floats.iter().copied().map(Const::Float).collect(), 1);
    let triples = floats.chunks_exact(3).filter_map(|t| t.try_into().ok()).map(Const::Triple).collect();
    let triples = all(triples, 3);
    let matrices = floats.chunks_exact(16).filter_map(|m| <[f32; 16]>::try_from(m).ok());
    let matrices = all(matrices.map(|m| Const::Matrix(Box::new(m))).collect(), 16);
    let repeated = match floats[..] {
        [x] if parts.len() == 1 => vec![Const::Triple([x; 3]), Const::Matrix(Box::new(diagonal(x)))],
        _ => Vec::new(),
    };
    let arrays = [ints, number, triples, matrices];
    let single = arrays.iter().flatten().filter(|values| values.len() == 1).flatten();
    let singles = single.cloned().chain(repeated).map(Datum::one);
    let arrays = arrays.iter().flatten().cloned().map(Datum::array);
    let strings = Datum::array(text.split(',').map(string).collect());
    singles.chain(arrays).chain([strings]).fold(Datum::one(string(text)), Datum::or)
}

/// The names of data that a program reads, with the types: kind and number of values, 0 for a single one.
type Requested = BTreeMap<Arc<str>, Vec<(Kind, u8)>>;

/// The data of the point that a program reads; `None` if a name is not known before the run.
fn requested(body: &Body) -> Option<Requested> {
    let constants: HashMap<ValueId, &Const> = body.constants().collect();
    let mut names = Requested::new();
    for inst in body.insts() {
        let Op::Kernel(Kernel::Attribute { kind, count, .. }, image) = &inst.op else { continue };
        match image.iter().map(|arg| constants.get(arg)).collect::<Vec<_>>()[..] {
            [Some(Const::Str(object)), ..] if !object.is_empty() => {}
            [_, Some(Const::Str(name)), ..] => {
                let types = names.entry(name.clone()).or_default();
                if !types.contains(&(*kind, *count)) {
                    types.push((*kind, *count));
                }
            }
            _ => return None,
        }
    }
    Some(names)
}

/// A warning for each name of `--userdata` that a shader does not read, or not with a type of the value.
pub fn unused(given: &[(String, String)], body: &Body, group: &Group, limits: &Limits) -> Vec<String> {
    let known = requested(body).or_else(|| {
        // Names that come from parameters are constants after the passes.
        let mut body = body.clone();
        passes::run(&mut body, &passes::Options { limits: limits.clone(), ..passes::Options::default() });
        requested(&body)
    });
    let Some(known) = known else { return Vec::new() };
    let mut params: BTreeMap<&str, bool> = BTreeMap::new();
    for layer in group.layers() {
        for param in &layer.program.shader.params {
            let Some(var) = layer.program.vars.get(param.var.0 as usize) else { continue };
            let is_open = Rules::default().interpolates(param) || layer.values.is_interpolated(&var.name);
            *params.entry(&*var.name).or_default() |= is_open;
        }
    }
    let why = |name: &str, text: &str| match known.get(name) {
        Some(types) => {
            let datum = user_datum(text);
            let fits = |(kind, count): &(Kind, u8)| datum.of_type(*kind, usize::from(*count)).is_some();
            let names: Vec<String> = types.iter().map(shown).collect();
            (!types.iter().any(fits)).then(|| format!("the shader reads it as {}", names.join(" or ")))
        }
        None => Some(match params.get(name) {
            Some(true) => "a parameter of this type takes no user data".to_string(),
            Some(false) => {
                "a parameter takes user data only with the metadata lockgeom = 0; -p sets any parameter"
                    .to_string()
            }
            None => {
                let close = closest(name, known.keys().map(|name| &**name).chain(params.keys().copied()));
                let close = close.map_or_else(String::new, |name| format!("; did you mean `{name}`?"));
                format!("the shader reads no data with this name{close}")
            }
        }),
    };
    let warning = |(name, text): &(String, String)| {
        Some(format!("--userdata {name}={text} is not used: {}", why(name, text)?))
    };
    given.iter().filter_map(warning).collect()
}

/// A type in the language.
fn shown((kind, count): &(Kind, u8)) -> String {
    let name = match kind {
        Kind::Int => "int",
        Kind::Float => "float",
        Kind::Triple => "color, point, vector or normal",
        Kind::Matrix => "matrix",
        Kind::Str => "string",
        Kind::Closure => "closure color",
    };
    match (count, kind) {
        (0, _) => name.to_string(),
        (n, Kind::Triple) => format!("color[{n}]"),
        (n, _) => format!("{name}[{n}]"),
    }
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
