//! Parameter values from text: `radius=0.3`, `tint=1,0.5,0`, `spacename=object`.

use osl_hir::hir::{Expr, ExprKind, Init, MetaValue, Program};
use osl_ir::ir::Const;
use osl_ir::types::{Base, Extent, MAX_ARRAY_LENGTH, Type};
use osl_syntax::spelling::closest;
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::Arc;

/// Maximum number of parameters in a message.
const MOST_NAMES: usize = 20;

/// Why a value cannot be given to a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ParamError {
    /// The shader has no parameter with this name.
    Unknown {
        /// The name.
        name: String,
        /// The closest name of a parameter.
        close: Option<String>,
        /// The parameters that there are.
        known: Vec<String>,
    },
    /// The parameter does not take values of this type.
    Type {
        /// The parameter.
        name: String,
        /// Its type.
        ty: String,
        /// The type of the value.
        given: String,
    },
    /// The text is not a value of the parameter's type.
    Mismatch {
        /// The parameter.
        name: String,
        /// Its type.
        ty: String,
        /// The text.
        text: String,
        /// The names of values that the metadata define.
        names: Vec<String>,
    },
}

impl std::fmt::Display for ParamError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ParamError::Unknown { name, close: Some(close), .. } => {
                write!(f, "the shader has no parameter `{name}`; there is one named `{close}`")
            }
            ParamError::Unknown { name, close: None, known } => match &known[..] {
                [] => write!(f, "the shader has no parameter `{name}`: it has none at all"),
                known => {
                    let more = known.len().saturating_sub(MOST_NAMES);
                    let shown: Vec<&str> = known.iter().take(MOST_NAMES).map(String::as_str).collect();
                    write!(f, "the shader has no parameter `{name}`; it has {}", shown.join(", "))?;
                    if more > 0 { write!(f, " and {more} more") } else { Ok(()) }
                }
            },
            ParamError::Type { name, ty, given } => {
                write!(f, "parameter `{name}` is of type {ty} and takes no value of type {given}")
            }
            ParamError::Mismatch { name, ty, text, names } => {
                let article = if ty.starts_with("int") { "an" } else { "a" };
                write!(f, "parameter `{name}` is {article} {ty}, and `{text}` is none")?;
                match ty.as_str() {
                    "int" if !names.is_empty() => {
                        write!(f, ": write a number, or one of {}", names.join(", "))
                    }
                    "color" => write!(f, ": write three numbers, or #ff8800"),
                    "point" | "vector" | "normal" => write!(f, ": write three numbers"),
                    "matrix" => write!(f, ": write sixteen numbers"),
                    _ => Ok(()),
                }
            }
        }
    }
}

impl std::error::Error for ParamError {}

/// Instance values of parameters.
#[derive(Clone, Debug, Default)]
pub struct ParamValues {
    /// By name, `s.a` for a field: the elements in order.
    values: FxHashMap<Arc<str>, Vec<Const>>,
    /// Parameters that take the point's user data with their name and type, where there are any, as with the
    /// metadata `lockgeom = 0`.
    interpolated: FxHashSet<Arc<str>>,
    /// Parameters whose values are set before a run instead of being compiled in.
    live: FxHashSet<Arc<str>>,
}

impl ParamValues {
    /// The elements of a parameter's value.
    pub fn get(&self, name: &str) -> Option<&[Const]> {
        self.values.get(name).map(Vec::as_slice)
    }

    /// The given values with their names: in the order of the parameters, fields of structs by name.
    pub fn given<'a>(&'a self, program: &Program) -> Vec<(&'a str, &'a [Const])> {
        let place = |name: &str| {
            let first = name.split('.').next().unwrap_or(name);
            program.param(first)
        };
        let mut list: Vec<(&str, &[Const])> = self.values.iter().map(|(n, v)| (&**n, &v[..])).collect();
        list.sort_by_key(|(name, _)| (place(name), *name));
        list
    }

    /// Lets a parameter take the point's user data where there are any.
    pub fn interpolate(&mut self, name: &str) {
        self.interpolated.insert(name.into());
    }

    /// Makes a parameter with a value an input of the program: the value is the first one, and others can be
    /// set without compiling again. Has no effect on
    /// strings and closures, whose values decide what is compiled, and on parameters without a value.
    pub fn make_live(&mut self, name: &str) {
        self.live.insert(name.into());
    }

    /// Whether a parameter was given to [`ParamValues::make_live`].
    pub fn is_live(&self, name: &str) -> bool {
        self.live.contains(name)
    }

    /// Whether a parameter was given to [`ParamValues::interpolate`].
    pub fn is_interpolated(&self, name: &str) -> bool {
        self.interpolated.contains(name)
    }
}

/// Adds the value in `text` for the parameter `name` of a program. A triple takes one or three numbers, a
/// matrix one or sixteen, an array one for each element in turn, a string its text unchanged; `s.a` is a
/// field. An int with the metadata `mapper` takes the names in it, and a color `#ff8800`, which is converted
/// from sRGB to linear.
///
/// # Errors
/// There is no such parameter, or the text is not a value of its type.
pub fn set(program: &Program, values: &mut ParamValues, name: &str, text: &str) -> Result<(), ParamError> {
    let ty = find(program, name)?;
    let value = match ty {
        Type::INT => mapped(program, name).into_iter().find(|(of, _)| *of == text).map(|(_, n)| n),
        Type::COLOR => hex_color(text),
        _ => None,
    };
    let value = value.map(|value| vec![value]).or_else(|| parse(ty, text));
    values.values.insert(name.into(), value.ok_or_else(|| mismatch(program, ty, name, text))?);
    Ok(())
}

/// `#ff8800` or `#f80`, from sRGB to linear, as color pickers mean it.
fn hex_color(text: &str) -> Option<Const> {
    let digits = text.strip_prefix('#').filter(|d| matches!(d.len(), 3 | 6) && d.is_ascii())?;
    let width = digits.len() / 3;
    let part = |n: usize| {
        let value = u32::from_str_radix(digits.get(n * width..(n + 1) * width)?, 16).ok()?;
        let value = if width == 1 { value * 17 } else { value };
        Some(osl_numeric::color::srgb_to_linear(value as f32 / 255.0))
    };
    Some(Const::Triple([part(0)?, part(1)?, part(2)?]))
}

/// A text in the metadata of a parameter.
fn metadata<'a>(program: &'a Program, name: &str, datum: &str) -> Option<&'a str> {
    let param = program.shader.params.get(program.param(name)?)?;
    param.metadata.iter().find(|(_, of, _)| &**of == datum).and_then(|(_, _, value)| match value {
        MetaValue::Text(text) => Some(&**text),
        _ => None,
    })
}

/// The names of values that the metadata of an int define, as in `mapper = "Radial:1|Linear:2"`.
fn mapped<'a>(program: &'a Program, name: &str) -> Vec<(&'a str, Const)> {
    let texts = ["mapper", "options"].into_iter().filter_map(|datum| metadata(program, name, datum));
    let pairs = texts.flat_map(|text| text.split('|')).filter_map(|pair| pair.rsplit_once(':'));
    pairs.filter_map(|(name, n)| Some((name.trim(), Const::Int(n.trim().parse().ok()?)))).collect()
}

/// A doubt about a value that is accepted, in a sentence: a string that is none of the options of its
/// metadata, or fewer values than an array has elements.
pub fn doubt(program: &Program, name: &str, text: &str) -> Option<String> {
    let ty = type_of(program, name)?;
    if let Extent::Array(n) = ty.extent {
        let given = parse(ty, text)?.len();
        let values = if given == 1 { "1 value is".to_string() } else { format!("{given} values are") };
        return (given < n as usize).then(|| {
            format!("parameter `{name}` has {n} elements, and {values} given: the other elements are zero")
        });
    }
    let options = metadata(program, name, "options").filter(|_| ty == Type::STRING)?;
    let options: Vec<&str> = options.split('|').map(str::trim).filter(|option| !option.is_empty()).collect();
    // `Name:value` names a value, which is what a shader compares.
    let value = |option: &str| option.rsplit_once(':').map_or(option, |(_, value)| value).to_string();
    if options.is_empty() || options.iter().any(|option| *option == text || value(option) == text) {
        return None;
    }
    let hint = match closest(text, options.iter().copied()) {
        Some(close) => format!("; there is one named `{close}`"),
        None => String::new(),
    };
    Some(format!("`{text}` is none of the options of `{name}`, which are {}{hint}", options.join(", ")))
}

/// Adds a value with a given type, `float` or `color[2]`. It must be the parameter's type, except that kinds
/// of triples are interchangeable, a float is broadcast to a triple, and an open array takes any length.
///
/// # Errors
/// There is no such parameter, it has another type, or the text is not a value of the type.
pub fn set_typed(
    program: &Program,
    values: &mut ParamValues,
    given: Type,
    name: &str,
    text: &str,
) -> Result<(), ParamError> {
    set_parsed(program, values, given, name, text, || parse(given, text))
}

/// Adds a value with a given type as a list of words: numbers one by one, or strings. Missing words are 0 or
/// empty.
///
/// # Errors
/// Those of [`set_typed`].
pub fn set_words(
    program: &Program,
    values: &mut ParamValues,
    given: Type,
    name: &str,
    words: &[Arc<str>],
) -> Result<(), ParamError> {
    set_parsed(program, values, given, name, &words.join(" "), || from_words(given, words))
}

/// Adds a value with a given type as constants: one, or the elements of an array. Missing elements of an
/// array are zero.
///
/// # Errors
/// There is no such parameter, or it has another type.
pub fn set_constants(
    program: &Program,
    values: &mut ParamValues,
    given: Type,
    name: &str,
    constants: Vec<Const>,
) -> Result<(), ParamError> {
    let ty = find(program, name)?;
    let given = match (given.extent, ty.extent) {
        (Extent::Array(given_len), Extent::Array(len)) if given_len <= len => {
            Type { extent: ty.extent, ..given }
        }
        _ => given,
    };
    let value = || Some(constants).filter(|list| !list.is_empty());
    set_parsed(program, values, given, name, "{}", value)
}

fn set_parsed(
    program: &Program,
    values: &mut ParamValues,
    given: Type,
    name: &str,
    text: &str,
    value: impl FnOnce() -> Option<Vec<Const>>,
) -> Result<(), ParamError> {
    let ty = find(program, name)?;
    let error = || mismatch(program, ty, name, text);
    let wrong = || ParamError::Type {
        name: name.to_string(),
        ty: program.structs.show(ty),
        given: program.structs.show(given),
    };
    let triples = given.element().is_triple() && ty.element().is_triple();
    let same = given.base == ty.base || triples || (given == Type::FLOAT && ty.is_triple());
    let extent = given.extent == ty.extent || (given.is_array() && ty.extent == Extent::Unsized);
    if !same || !extent {
        return Err(wrong());
    }
    let value = value().ok_or_else(error)?;
    let broadcast = |v: Const| match v {
        Const::Float(x) if ty.element().is_triple() => Const::Triple([x; 3]),
        v => v,
    };
    values.values.insert(name.into(), value.into_iter().map(broadcast).collect());
    Ok(())
}

fn mismatch(program: &Program, ty: Type, name: &str, text: &str) -> ParamError {
    let names = mapped(program, name).into_iter().map(|(name, _)| name.to_string()).collect();
    ParamError::Mismatch {
        name: name.to_string(),
        ty: program.structs.show(ty),
        text: text.to_string(),
        names,
    }
}

/// The string parameters of a program with known values, given or by default: name and value, arrays element
/// by element.
pub fn texts(program: &Program, given: &ParamValues) -> Vec<(Arc<str>, Arc<str>)> {
    let mut texts = Vec::new();
    for param in &program.shader.params {
        let Some(var) = program.vars.get(param.var.0 as usize) else { continue };
        if var.ty.base != Base::String || param.output {
            continue;
        }
        let mut add = |text: &Arc<str>| texts.push((var.name.clone(), text.clone()));
        match given.get(&var.name) {
            Some(values) => values.iter().for_each(|value| {
                if let Const::Str(text) = value {
                    add(text);
                }
            }),
            None => constants(&param.init).into_iter().for_each(add),
        }
    }
    texts
}

/// The string constants that a value contains.
fn constants(init: &Init) -> Vec<&Arc<str>> {
    match init {
        Init::Value(Expr { kind: ExprKind::Str(text), .. }) => vec![text],
        Init::Value(_) => Vec::new(),
        Init::List(list) => list.iter().flat_map(constants).collect(),
    }
}

/// The type of a parameter or field, or an error if there is none.
fn find(program: &Program, name: &str) -> Result<Type, ParamError> {
    type_of(program, name).ok_or_else(|| {
        let inputs = program.shader.params.iter().filter(|param| !param.output);
        let names: Vec<&str> = inputs.map(|p| &*program.vars[p.var.0 as usize].name).collect();
        let close = closest(name, names.iter().copied()).map(str::to_string);
        let known = names.into_iter().map(str::to_string).collect();
        ParamError::Unknown { name: name.to_string(), close, known }
    })
}

/// The type of a parameter, or of a field `s.a` of one.
pub fn type_of(program: &Program, name: &str) -> Option<Type> {
    let mut parts = name.split('.');
    let first = parts.next()?;
    let param = program.shader.params.get(program.param(first)?)?;
    let mut ty = program.vars[param.var.0 as usize].ty;
    if param.open {
        ty.extent = Extent::Unsized;
    }
    for part in parts {
        ty = program.structs.field(ty.as_struct()?, part)?.1.ty;
    }
    Some(ty)
}

/// The value of a list of words; `None` if they are not a value, or are too many.
fn from_words(ty: Type, words: &[Arc<str>]) -> Option<Vec<Const>> {
    let each = match ty.base {
        Base::Int | Base::Float | Base::String => 1,
        base if base.is_triple() => 3,
        Base::Matrix => 16,
        _ => return None,
    };
    let len = match ty.extent {
        Extent::One => 1,
        Extent::Array(n) => n as usize,
        Extent::Unsized => words.len().div_ceil(each).clamp(1, MAX_ARRAY_LENGTH as usize),
    };
    if words.len() > len * each || words.is_empty() {
        return None;
    }
    // Trailing elements of an array without words are zero and not stored, because a text may name many long
    // arrays.
    let whole = if ty.extent == Extent::One { each } else { words.len().next_multiple_of(each) };
    let missing = whole.saturating_sub(words.len());
    match ty.base {
        Base::String => {
            let rest = std::iter::repeat_n(Arc::from(""), missing);
            Some(words.iter().cloned().chain(rest).map(Const::Str).collect())
        }
        Base::Int => {
            let ints: Option<Vec<i32>> = words.iter().map(|w| w.parse().ok()).collect();
            Some(ints?.into_iter().chain(std::iter::repeat_n(0, missing)).map(Const::Int).collect())
        }
        _ => {
            let mut numbers: Vec<f32> = words.iter().map(|w| w.parse().ok()).collect::<Option<_>>()?;
            numbers.resize(whole, 0.0);
            Some(numbers.chunks_exact(each).filter_map(|c| constant(each, c)).collect())
        }
    }
}

fn parse(ty: Type, text: &str) -> Option<Vec<Const>> {
    let len = match ty.extent {
        Extent::One => 1,
        Extent::Array(n) => n as usize,
        Extent::Unsized => MAX_ARRAY_LENGTH as usize,
    };
    if ty.base == Base::String {
        let parts: Vec<&str> = if len == 1 { vec![text] } else { text.split(',').collect() };
        return (parts.len() <= len).then(|| parts.iter().map(|p| Const::Str(Arc::from(*p))).collect());
    }
    let parts: Vec<&str> = text.split([',', ' ']).map(str::trim).filter(|p| !p.is_empty()).collect();
    if ty.base == Base::Int {
        let ints: Option<Vec<Const>> = parts.iter().map(|p| p.parse().ok().map(Const::Int)).collect();
        return ints.filter(|v| (1..=len).contains(&v.len()));
    }
    let numbers: Vec<f32> = parts.iter().map(|p| p.parse().ok()).collect::<Option<_>>()?;
    let each = match ty.base {
        Base::Float => 1,
        base if base.is_triple() => 3,
        Base::Matrix => 16,
        _ => return None,
    };
    let spread = match (numbers.as_slice(), each) {
        ([x], 3) if len == 1 => return Some(vec![Const::Triple([*x; 3])]),
        ([x], 16) if len == 1 => {
            return Some(vec![Const::Matrix(Box::new(osl_numeric::matrix::diagonal(*x)))]);
        }
        _ => numbers,
    };
    let whole = !spread.is_empty() && spread.len().is_multiple_of(each) && spread.len() / each <= len;
    whole.then(|| spread.chunks_exact(each).filter_map(|c| constant(each, c)).collect())
}

fn constant(each: usize, numbers: &[f32]) -> Option<Const> {
    Some(match each {
        1 => Const::Float(*numbers.first()?),
        3 => Const::Triple(numbers.try_into().ok()?),
        _ => Const::Matrix(Box::new(numbers.try_into().ok()?)),
    })
}
