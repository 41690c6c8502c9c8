//! The kernels of the text, without their arguments.

use super::Cursor;
use crate::ir::{
    GaborOption, Kernel, Kind, MessageForm, NoiseField, Note, Shape, Sink, Test, TextFn, TextureOption,
};
use crate::types::Base;
use osl_syntax::span::Span;

const TEXT_FNS: [TextFn; 9] = [
    TextFn::Concat,
    TextFn::Length,
    TextFn::Substring,
    TextFn::Character,
    TextFn::StartsWith,
    TextFn::EndsWith,
    TextFn::ToInt,
    TextFn::ToFloat,
    TextFn::Hash,
];

const TEXTURE_OPTIONS: [TextureOption; 16] = [
    TextureOption::Blur,
    TextureOption::SBlur,
    TextureOption::TBlur,
    TextureOption::Width,
    TextureOption::SWidth,
    TextureOption::TWidth,
    TextureOption::Wrap,
    TextureOption::SWrap,
    TextureOption::TWrap,
    TextureOption::FirstChannel,
    TextureOption::Fill,
    TextureOption::Interp,
    TextureOption::MissingColor,
    TextureOption::MissingAlpha,
    TextureOption::SubImage,
    TextureOption::SubImageName,
];

const GABOR_OPTIONS: [GaborOption; 5] = [
    GaborOption::Anisotropic,
    GaborOption::Direction,
    GaborOption::Bandwidth,
    GaborOption::Impulses,
    GaborOption::DoFilter,
];

const FIELDS: [NoiseField; 6] = [
    NoiseField::Cell,
    NoiseField::Hash,
    NoiseField::Perlin,
    NoiseField::UPerlin,
    NoiseField::Simplex,
    NoiseField::USimplex,
];

/// The element of a list that prints as the word, in small letters.
fn named<T: Copy + std::fmt::Debug>(list: &[T], word: &str) -> Option<T> {
    list.iter().copied().find(|item| format!("{item:?}").to_lowercase() == word)
}

/// The kernel that a word begins. `line` continues after the word.
pub(super) fn kernel(word: &str, line: &mut Cursor<'_>) -> Result<Kernel, String> {
    let mut parts = word.split('.');
    let name = parts.next().unwrap_or_default();
    let flags: Vec<&str> = parts.collect();
    let has = |flag: &str| flags.contains(&flag);
    let has_derivs = has("derivs");
    let plain = match word {
        "space_matrix" | "space_matrix.both" => Some(Kernel::SpaceMatrix { both: has("both") }),
        "find_space" => Some(Kernel::FindSpace),
        "color_between" => Some(Kernel::ColorBetween),
        "hash.words" => Some(Kernel::Hash),
        "dict_find" => Some(Kernel::DictFind),
        "dict_next" => Some(Kernel::DictNext),
        "is_constant" => Some(Kernel::IsConstant),
        "raytype" => Some(Kernel::RayType),
        "trace" => Some(Kernel::Trace),
        _ => TEXT_FNS.into_iter().find(|f| f.text() == word).map(Kernel::Text),
    };
    if let Some(kernel) = plain {
        return Ok(kernel);
    }
    Ok(match (name, flags.first().copied().unwrap_or_default()) {
        ("noise", field) => noise(field, &flags, line)?,
        ("texture", _) => {
            let (triple, footprint, quiet) = (has("triple"), has("footprint"), has("quiet"));
            Kernel::Texture { triple, options: options(line), footprint, quiet, has_derivs }
        }
        ("environment", _) => {
            let (triple, footprint, quiet) = (has("triple"), has("footprint"), has("quiet"));
            Kernel::Environment { triple, options: options(line), footprint, quiet }
        }
        ("volume", _) => {
            Kernel::Volume { triple: has("triple"), options: options(line), quiet: has("quiet") }
        }
        ("texture_info", _) => {
            let (kind, count) = kind_and_count(line)?;
            Kernel::TextureInfo { kind, count }
        }
        ("attribute", _) => {
            let (kind, count) = kind_and_count(line)?;
            Kernel::Attribute { kind, count, has_derivs }
        }
        ("dict_value", _) => {
            let (kind, count) = kind_and_count(line)?;
            Kernel::DictValue { kind, count }
        }
        ("source_message", _) => source_message(line)?,
        ("format", _) => Kernel::Format(shapes(line)?),
        ("print", sink) => {
            let sink = named(&[Sink::Print, Sink::File, Sink::Error, Sink::Warning], sink);
            Kernel::Print { sink: sink.ok_or("no such sink")?, shapes: shapes(line)? }
        }
        ("split", _) => Kernel::Split { pieces: line.slot()? },
        ("regex", _) => Kernel::Regex { whole: has("whole"), places: line.slot().ok() },
        ("spline_inverse", _) => Kernel::SplineInverse { knots: line.slot()?, has_derivs },
        ("closure", of) => {
            // Only components have forms of arguments: a closure may have the name of an operation.
            match (line.rest.starts_with(" ("), of) {
                (false, "sum") => Kernel::ClosureSum,
                (false, "scale") => Kernel::ClosureScale,
                _ => {
                    let name = word.strip_prefix("closure.").unwrap_or_default().into();
                    Kernel::Component { name, shapes: shapes(line)? }
                }
            }
        }
        ("message", "set") => Kernel::SetMessage(message(line)?),
        ("message", "get") => Kernel::GetMessage(message(line)?),
        ("report", _) => Kernel::Report { text: line.string()?.into(), places: Vec::new() },
        ("check_index", _) => Kernel::CheckIndex { name: line.string()?.into() },
        ("check_finite", _) => Kernel::CheckFinite { name: line.string()?.into(), op: line.string()?.into() },
        ("check_set", _) => Kernel::CheckSet { what: line.string()?.into(), reader: line.string()?.into() },
        ("note", what) => {
            let site = line.name().parse().map_err(|_| "expected the number of the note")?;
            Kernel::Note { site, note: note(what, &flags, line)? }
        }
        _ => return Err(format!("no operation `{word}`")),
    })
}

/// The rest of a note, after its number.
fn note(what: &str, flags: &[&str], line: &mut Cursor<'_>) -> Result<Note, String> {
    Ok(match what {
        "reach" => Note::Reach,
        "loop" => Note::Loop,
        "round" => Note::Round,
        "leave" => Note::Leave,
        "set" => Note::Set(line.string()?.into()),
        "result" => Note::Result { names: line.string()?.into() },
        "branch" => {
            let test = Test::ALL.into_iter().find(|test| flags.last() == Some(&test.text()));
            Note::Branch(test.ok_or("no such condition")?)
        }
        "call" => {
            let args = line.name().parse().map_err(|_| "expected a number of arguments")?;
            Note::Call { args, form: line.string()?.into(), why: line.string()?.into() }
        }
        "enter" => Note::Enter {
            form: line.string()?.into(),
            why: line.string()?.into(),
            names: line.string()?.into(),
        },
        _ => return Err(format!("no note `{what}`")),
    })
}

/// `noise.FIELD.DIMENSIONS` or `noise.named.DIMENSIONS`, with flags, and the options of the latter.
fn noise(field: &str, flags: &[&str], line: &mut Cursor<'_>) -> Result<Kernel, String> {
    let has = |flag: &str| flags.contains(&flag);
    let dims = flags.get(1).and_then(|dims| dims.strip_suffix('d')).and_then(|dims| dims.parse().ok());
    let dims = dims.filter(|dims| (1..=4).contains(dims)).ok_or("no such dimension")?;
    let (triple, periodic, has_derivs) = (has("triple"), has("periodic"), has("derivs"));
    if field == "named" {
        let options = std::iter::from_fn(|| line.known(|word| named(&GABOR_OPTIONS, word))).collect();
        return Ok(Kernel::NamedNoise { dims, triple, periodic, options, has_derivs });
    }
    let field = named(&FIELDS, field).ok_or_else(|| format!("no noise `{field}`"))?;
    Ok(Kernel::Noise { field, dims, triple, periodic, has_derivs })
}

fn options(line: &mut Cursor<'_>) -> Vec<TextureOption> {
    std::iter::from_fn(|| line.known(|word| named(&TEXTURE_OPTIONS, word))).collect()
}

/// `float[3]`
fn kind_and_count(line: &mut Cursor<'_>) -> Result<(Kind, u8), String> {
    let kind = line.kind()?;
    line.word("[")?;
    Ok((kind, count(line)?))
}

fn count(line: &mut Cursor<'_>) -> Result<u8, String> {
    u8::try_from(line.number_until("]")?).map_err(|_| "too many values".to_string())
}

fn source_message(line: &mut Cursor<'_>) -> Result<Kernel, String> {
    let bases = [
        (Base::Int, Kind::Int),
        (Base::Float, Kind::Float),
        (Base::Color, Kind::Triple),
        (Base::Point, Kind::Triple),
        (Base::Vector, Kind::Triple),
        (Base::Normal, Kind::Triple),
        (Base::Matrix, Kind::Matrix),
        (Base::String, Kind::Str),
        (Base::Closure, Kind::Closure),
    ];
    let base = |word: &str| bases.into_iter().find(|(base, _)| format!("{base:?}").to_lowercase() == word);
    let (base, kind) = line.known(base).ok_or("expected a type")?;
    line.word("[")?;
    Ok(Kernel::SourceMessage { base, kind, count: count(line)? })
}

/// `"color" s3`
fn message(line: &mut Cursor<'_>) -> Result<MessageForm, String> {
    Ok(MessageForm { ty: line.string()?.into(), array: line.slot().ok(), place: Span::default() })
}

/// `(float, int[3], "key": string)`
fn shapes(line: &mut Cursor<'_>) -> Result<Vec<Shape>, String> {
    let mut shapes = Vec::new();
    line.word("(")?;
    while !line.eat(")") {
        if !shapes.is_empty() {
            line.word(",")?;
        }
        let key = match line.rest.trim_start().starts_with('"') {
            true => {
                let key = line.string()?;
                line.word(":")?;
                Some(key.into())
            }
            false => None,
        };
        let kind = line.kind()?;
        let count = if line.eat("[") { line.number_until("]")? } else { 1 };
        shapes.push(Shape { kind, count, key });
    }
    Ok(shapes)
}
