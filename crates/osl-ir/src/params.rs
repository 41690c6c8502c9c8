//! Parameter values from text: `radius=0.3`, `tint=1,0.5,0`, `spacename=object`.

use crate::hir::{Param, Program};
use crate::ir::Const;
use crate::lower::ParamValues;
use crate::types::{Base, Extent, Type};
use std::sync::Arc;

/// Why a value cannot be given to a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ParamError {
    /// The shader has no parameter of this name; the closest one.
    Unknown(String, Option<String>),
    /// The text is no value of the parameter's type.
    Mismatch {
        /// The parameter.
        name: String,
        /// Its type.
        ty: String,
        /// The text.
        text: String,
    },
}

impl std::fmt::Display for ParamError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ParamError::Unknown(name, None) => write!(f, "the shader has no parameter `{name}`"),
            ParamError::Unknown(name, Some(close)) => {
                write!(f, "the shader has no parameter `{name}`; there is one named `{close}`")
            }
            ParamError::Mismatch { name, ty, text } => {
                write!(f, "parameter `{name}` is a {ty}, and `{text}` is none")
            }
        }
    }
}

impl std::error::Error for ParamError {}

/// Adds the value that `text` gives to the parameter `name` of a program. A triple takes one or three numbers, a
/// matrix one or sixteen, an array one for each element in turn, a string its text as it is; `s.a` is a field.
///
/// # Errors
/// There is no such parameter, or the text is no value of its type.
pub fn set(program: &Program, values: &mut ParamValues, name: &str, text: &str) -> Result<(), ParamError> {
    let ty = find(program, name).ok_or_else(|| {
        let names = program.shader.params.iter().map(|p| &*program.vars[p.var.0 as usize].name);
        let close = names.min_by_key(|n| strsim::damerau_levenshtein(n, name)).map(str::to_string);
        ParamError::Unknown(name.to_string(), close)
    })?;
    let value = parse(ty, text).ok_or_else(|| ParamError::Mismatch {
        name: name.to_string(),
        ty: program.structs.show(ty),
        text: text.to_string(),
    })?;
    values.insert(name.into(), value);
    Ok(())
}

fn find(program: &Program, name: &str) -> Option<Type> {
    let mut parts = name.split('.');
    let first = parts.next()?;
    let of = |p: &&Param| &*program.vars[p.var.0 as usize].name == first;
    let param = program.shader.params.iter().find(of)?;
    let mut ty = program.vars[param.var.0 as usize].ty;
    for part in parts {
        let fields = &program.structs.get(ty.as_struct()?).fields;
        ty = fields.iter().find(|f| &*f.name == part)?.ty;
    }
    Some(ty)
}

fn parse(ty: Type, text: &str) -> Option<Vec<Const>> {
    let len = match ty.extent {
        Extent::One => 1,
        Extent::Array(n) => n as usize,
        Extent::Unsized => return None,
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
            return Some(vec![Const::Matrix(Box::new(crate::numeric::matrix::diagonal(*x)))]);
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
