//! Brings the dialect of a renderer and a shader together: which one a file is in, and what it answers.

use crate::Failure;
use crate::event::Sink;
use crate::request::{Image, Reading};
use crate::spoken::Spoken;
use osl::stages;
pub use osl_dialects::Role;
use osl_dialects::{Attribute, Dialect, Dialects, NAMES, NONE, Rule, Source, Value};
use osl_exec::Datum;
use osl_hir::hir;
use osl_ir::ir::Const;
use osl_limits::Limits;
use osl_scene::answers::{Answer, Answers, Of, Types};
use osl_syntax::spelling::closest;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Sends a note on a dialect that the user did not name, and one on each word without a public meaning.
pub fn send(spoken: &Spoken, sink: &mut dyn Sink) {
    let Spoken { dialect, reason, unknown } = spoken;
    let title = &dialect.names.title;
    if let Some(reason) = reason {
        let name = &dialect.name;
        sink.note(&format!(
            "the file is in the dialect of {title} ({name}): {reason}; --dialect overrides it"
        ));
    }
    for (word, why) in unknown {
        sink.note(&format!("`{word}` of {title}: {why}"));
    }
}

/// The dialects that a request knows.
///
/// # Errors
/// A folder of the user cannot be read, or is no dialect.
pub fn known(reading: &Reading) -> Result<Cow<'static, Dialects>, Failure> {
    let built_in = Dialects::built_in();
    if reading.dialect_path.is_empty() {
        return Ok(Cow::Borrowed(built_in));
    }
    let mut own = Vec::new();
    for folder in &reading.dialect_path {
        own.extend(folders(folder, &reading.limits)?);
    }
    Ok(Cow::Owned(built_in.with(own)))
}

/// The dialect with a name.
///
/// # Errors
/// There is none.
pub fn named(name: &str, known: &Dialects) -> Result<Arc<Dialect>, Failure> {
    if let Some(dialect) = known.named(name) {
        return Ok(dialect.clone());
    }
    let names: Vec<&str> = known.list().iter().map(|dialect| dialect.name.as_str()).collect();
    let close = closest(name, names.iter().copied());
    let close = close.map_or_else(String::new, |close| format!("; did you mean `{close}`?"));
    Err(Failure::usage(format!("there is no dialect `{name}`, only {}{close}", names.join(", "))))
}

/// The dialect of a text: the one that the request names, else the one that the text shows.
///
/// # Errors
/// The named dialect does not exist, or a folder of the user is no dialect.
pub fn of(text: &str, reading: &Reading) -> Result<Option<Spoken>, Failure> {
    let (dialect, reason) = match &reading.dialect {
        Some(name) => (named(name, known(reading)?.as_ref())?, None),
        // The reference compiler knows no dialects.
        None if reading.strict_syntax => return Ok(None),
        None => match known(reading)?.detect(text) {
            Some((dialect, reason)) => (dialect, Some(reason)),
            None => return Ok(None),
        },
    };
    if dialect.name == NONE {
        return Ok(None);
    }
    let unknown = dialect.unknown_in(text);
    Ok(Some(Spoken { dialect, reason, unknown }))
}

/// Maximum number of files in a folder of a user's dialect.
const MOST_FILES: usize = 256;

/// The dialects of a folder: itself, if it has a `dialect.toml`, else the folders in it that have one.
fn folders(folder: &Path, limits: &Limits) -> Result<Vec<Dialect>, Failure> {
    let own = [folder.to_path_buf()];
    let mut inner = Vec::new();
    if !folder.join(NAMES).exists() {
        let cannot = |e| Failure::new(format!("--dialect-path {}: {e}", folder.display()));
        let entries = std::fs::read_dir(folder).map_err(cannot)?.flatten().take(MOST_FILES);
        inner.extend(entries.map(|entry| entry.path()).filter(|path| path.join(NAMES).exists()));
        inner.sort();
        if inner.is_empty() {
            return Err(Failure::new(format!("--dialect-path {}: it has no {NAMES}", folder.display())));
        }
    }
    let all = if inner.is_empty() { own.as_slice() } else { inner.as_slice() };
    all.iter().map(|path| folder_of(path, limits)).collect()
}

/// The dialect of one folder.
fn folder_of(folder: &Path, limits: &Limits) -> Result<Dialect, Failure> {
    let name =
        folder.canonicalize().ok().and_then(|real| Some(real.file_name()?.to_string_lossy().into_owned()));
    let mut files = BTreeMap::new();
    let mut waiting = vec![PathBuf::new()];
    let wrong = |path: &Path, why: &dyn std::fmt::Display| {
        Failure::new(format!("--dialect-path {}: {why}", folder.join(path).display()))
    };
    while let Some(inner) = waiting.pop() {
        let entries = std::fs::read_dir(folder.join(&inner)).map_err(|e| wrong(&inner, &e))?;
        for entry in entries.flatten() {
            let path = inner.join(entry.file_name());
            let ending = path.extension().unwrap_or_default();
            match entry.file_type() {
                Ok(kind) if kind.is_dir() => waiting.push(path),
                Ok(kind) if kind.is_file() && (ending == "h" || ending == "toml") => {
                    let text = osl_files::open_named(&folder.join(&path));
                    let text = text.and_then(|file| file.text(limits.reading.file_bytes));
                    files.insert(path.display().to_string(), text.map_err(|e| wrong(&path, &e))?);
                }
                _ => {}
            }
            if files.len() + waiting.len() > MOST_FILES {
                return Err(wrong(&inner, &format!("there are more than {MOST_FILES} files")));
            }
        }
    }
    Dialect::new(&name.unwrap_or_default(), files).map_err(Failure::new)
}

/// The answers of a dialect to attributes, for a picture.
pub fn answers(dialect: &Dialect, image: &Image) -> Answers {
    let names = &dialect.names;
    let types = match names.types {
        Rule::Exact => Types::Exact,
        Rule::Mean => Types::Mean,
        Rule::Widen => Types::Widen,
    };
    let mut answers = Answers {
        types,
        any_object: names.any_object,
        index_is_length: names.quirks.index_is_length,
        ..Answers::default()
    };
    let objects = names.objects.iter().map(|(object, list)| (object.as_str(), list));
    for (object, list) in objects.chain([("", &names.attributes)]) {
        let found =
            list.iter().filter_map(|(name, row)| Some((name.clone(), answer(row, types, dialect, image)?)));
        answers.list.insert(object.to_string(), found.collect());
    }
    answers
}

/// The answer to an attribute; `None` if nothing here provides it.
fn answer(row: &Attribute, types: Types, dialect: &Dialect, image: &Image) -> Option<Answer> {
    let globals = &image.provided.globals;
    let floats = match row.ty.as_str() {
        "int" => None,
        "float2" | "float[2]" => Some(2),
        "float" => Some(1),
        _ => Some(3),
    };
    let number = |x: f32| if floats.is_none() { types.int(x as i32) } else { types.floats(&[x]) };
    let of = match row.source {
        None => {
            let by = format!("the default of {}, {}", dialect.name, row.shown());
            return Some(Answer::Same(datum(&row.value()?, row, types).instead(by.into())));
        }
        Some(Source::Time) => return Some(Answer::Same(number(globals.seconds()))),
        Some(Source::Frame) => return Some(Answer::Same(number(globals.frame()))),
        Some(Source::Version) => {
            let version = image.shader.read.version.unwrap_or_default().number();
            return Some(Answer::Same(types.int(version as i32)));
        }
        Some(Source::Resolution) => {
            let (width, height) = image.points.grid;
            let [x, y] = [width, height].map(|n| i32::try_from(n).unwrap_or(i32::MAX));
            let value = match row.ty.as_str() {
                "int[2]" => Value::Ints(vec![x, y]),
                _ => Value::Floats(vec![x as f32, y as f32]),
            };
            return Some(Answer::Same(datum(&value, row, types)));
        }
        Some(Source::Uv) => Of::Uv,
        Some(Source::U) => Of::U,
        Some(Source::V) => Of::V,
        Some(Source::Generated) => Of::Generated,
        Some(Source::Tangent) => Of::Tangent,
        Some(Source::Position) => Of::Position,
        Some(Source::Normal) => Of::Normal,
        Some(Source::ObjectPosition) => Of::ObjectPosition,
        Some(Source::ObjectNormal) => Of::ObjectNormal,
        Some(Source::Window) => Of::Window,
        Some(Source::Location) => Of::Location,
        Some(Source::Random) => Of::Random,
        Some(Source::Index) => Of::Index,
        Some(Source::Du) => Of::Du,
        Some(Source::Dv) => Of::Dv,
    };
    Some(Answer::Point(of, floats))
}

/// A value of the table as a datum.
fn datum(value: &Value, row: &Attribute, types: Types) -> Datum {
    match value {
        Value::Text(text) => Datum::one(Const::Str(text.as_str().into())),
        Value::Ints(list) if row.ty == "int" => types.int(list.first().copied().unwrap_or_default()),
        Value::Ints(list) => Datum::array(list.iter().copied().map(Const::Int).collect()),
        Value::Floats(list) => match <[f32; 16]>::try_from(list.as_slice()) {
            Ok(matrix) if row.ty == "matrix" => Datum::one(Const::Matrix(Box::new(matrix))),
            _ => types.floats(list),
        },
    }
}

/// The values of parameters that take the time or the frame by their metadata, unless they are given.
pub fn timed(
    spoken: Option<&Spoken>,
    program: &hir::Program,
    given: &[(String, String)],
    (seconds, frame): (f32, f32),
) -> Vec<(String, String)> {
    let Some(key) = spoken.and_then(|spoken| spoken.dialect.names.quirks.time_metadata.as_deref()) else {
        return Vec::new();
    };
    let asks = |param: &osl::Param| {
        let says = |m: &osl::Metadata| m.name == key && m.value == Some(osl::Value::Int(1));
        !param.output && param.metadata.iter().any(says) && !given.iter().any(|(name, _)| *name == param.name)
    };
    let params = stages::params(program).into_iter().filter(asks);
    let value = |param: osl::Param| match param.ty.to_string().as_str() {
        "float" => Some((param.name, seconds.to_string())),
        "int" => Some((param.name, (frame as i32).to_string())),
        _ => None,
    };
    params.filter_map(value).collect()
}

/// The output that a dialect has for a role, if the shader has it.
pub fn output_for(role: Role, spoken: Option<&Spoken>, program: &hir::Program) -> Option<String> {
    let outputs = &spoken?.dialect.names.outputs;
    let params = stages::params(program);
    let is =
        |name: &&String| params.iter().any(|p| p.output && p.name == **name && p.ty.to_string() == "color");
    outputs.iter().filter(|(_, output)| output.role == Some(role)).map(|(name, _)| name).find(is).cloned()
}
