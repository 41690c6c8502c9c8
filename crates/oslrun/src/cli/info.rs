//! `oslrun info FILE`: describes a shader, as text or JSON.

use super::args::InfoArgs;
use super::{Failure, input, report};
use crate::pipeline;
use osl_ir::hir::{Expr, ExprKind, Init, MetaValue, Param, Program};
use osl_ir::types::{Extent, Type};
use osl_syntax::ast::ShaderKind;
use serde::Serialize;
use serde_json::{Number, Value};
use std::io::Write;

/// Shows the shader of a file.
pub(super) fn info(args: &InfoArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let input = input::read(&args.file, &args.read)?;
    let checked = pipeline::check(&input.name, &input.text, &input.files, &input.options);
    let errors: Vec<_> = checked.diagnostics.iter().filter(|d| d.is_error()).cloned().collect();
    report::diagnostics(&errors, &checked.sources, &args.read, err)?;
    let program = checked.program.ok_or_else(Failure::said)?;
    let shader = describe(&program);
    let text = if args.json {
        serde_json::to_string_pretty(&shader).map_err(Failure::new)? + "\n"
    } else {
        shader.text()
    };
    let _ = out.write_all(text.as_bytes());
    Ok(())
}

#[derive(Serialize)]
pub(super) struct Shader {
    pub(super) kind: &'static str,
    pub(super) name: String,
    pub(super) metadata: Vec<Metadatum>,
    pub(super) parameters: Vec<Parameter>,
}

#[derive(Serialize)]
pub(super) struct Parameter {
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) ty: String,
    pub(super) output: bool,
    /// `null` if code computes it.
    pub(super) default: Value,
    pub(super) metadata: Vec<Metadatum>,
}

#[derive(Serialize)]
pub(super) struct Metadatum {
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) ty: String,
    pub(super) value: Value,
}

/// The description of a shader.
pub(super) fn describe(program: &Program) -> Shader {
    let shader = &program.shader;
    Shader {
        kind: match shader.kind {
            ShaderKind::Generic => "shader",
            ShaderKind::Surface => "surface",
            ShaderKind::Displacement => "displacement",
            ShaderKind::Volume => "volume",
        },
        name: shader.name.to_string(),
        metadata: metadata(&shader.metadata),
        parameters: shader.params.iter().filter_map(|p| parameter(program, p)).collect(),
    }
}

fn parameter(program: &Program, param: &Param) -> Option<Parameter> {
    let var = program.vars.get(param.var.0 as usize)?;
    let shown = if param.open { Type { extent: Extent::Unsized, ..var.ty } } else { var.ty };
    Some(Parameter {
        name: var.name.to_string(),
        ty: program.structs.show(shown),
        output: param.output,
        default: initial(program, var.ty, Some(&param.init)).unwrap_or(Value::Null),
        metadata: metadata(&param.metadata),
    })
}

/// The value of an initialiser; missing elements of a list are zero. `None` if it is not a constant.
fn initial(program: &Program, ty: Type, init: Option<&Init>) -> Option<Value> {
    let items = match init {
        Some(Init::Value(e)) => return constant(e),
        Some(Init::List(items)) => items.as_slice(),
        None => &[],
    };
    if let Extent::Array(n) = ty.extent {
        let element = |at| initial(program, ty.element(), items.get(at));
        return (0..n as usize).map(element).collect::<Option<Vec<_>>>().map(Value::Array);
    }
    if let Some(id) = ty.as_struct() {
        let fields = program.structs.get(id).fields.iter().enumerate();
        let field = |(at, f): (usize, &osl_ir::types::Field)| {
            Some((f.name.to_string(), initial(program, f.ty, items.get(at))?))
        };
        return fields.map(field).collect::<Option<serde_json::Map<_, _>>>().map(Value::Object);
    }
    Some(match ty {
        Type::INT => Value::from(0),
        Type::STRING => Value::from(""),
        Type::MATRIX => Value::from(vec![float(0.0); 16]),
        Type::CLOSURE => Value::from(0),
        ty if ty.is_triple() => Value::from(vec![float(0.0); 3]),
        _ => float(0.0),
    })
}

fn constant(e: &Expr) -> Option<Value> {
    Some(match &e.kind {
        ExprKind::Int(n) => Value::from(*n),
        ExprKind::Float(x) => float(*x),
        ExprKind::Str(text) => Value::from(&**text),
        ExprKind::NullClosure => Value::from(0),
        ExprKind::Triple(parts) => Value::Array(parts.iter().map(constant).collect::<Option<_>>()?),
        ExprKind::Matrix(cells) => Value::Array(cells.iter().map(constant).collect::<Option<_>>()?),
        ExprKind::Convert(inner) => converted(e.ty, constant(inner)?)?,
        _ => return None,
    })
}

fn converted(to: Type, value: Value) -> Option<Value> {
    let number = match &value {
        Value::Number(n) => float(n.as_f64()? as f32),
        Value::Array(_) if to.is_triple() => return Some(value),
        _ => return None,
    };
    Some(match to {
        Type::INT => Value::from(number.as_f64()? as i32),
        Type::FLOAT => number,
        Type::MATRIX => Value::from(
            (0..16).map(|at| if at % 5 == 0 { number.clone() } else { float(0.0) }).collect::<Vec<_>>(),
        ),
        ty if ty.is_triple() => Value::from(vec![number; 3]),
        _ => return None,
    })
}

/// The shortest decimal number that denotes this float. JSON has no infinities and NaN, so these become text.
fn float(x: f32) -> Value {
    let short = x.to_string().parse().ok().and_then(Number::from_f64);
    short.map_or_else(|| Value::from(x.to_string()), Value::Number)
}

fn metadata(list: &[(String, std::sync::Arc<str>, MetaValue)]) -> Vec<Metadatum> {
    let numbers = |ty: &str, list: &[f64]| -> Vec<Value> {
        let one = |x: &f64| if ty.starts_with("int") { Value::from(*x as i64) } else { float(*x as f32) };
        list.iter().map(one).collect()
    };
    let datum = |(ty, name, value): &(String, std::sync::Arc<str>, MetaValue)| Metadatum {
        name: name.to_string(),
        ty: ty.clone(),
        value: match value {
            MetaValue::Text(text) => Value::from(&**text),
            MetaValue::Texts(texts) => {
                Value::from(texts.iter().map(|t| Value::from(&**t)).collect::<Vec<_>>())
            }
            MetaValue::Numbers(list) => match numbers(ty, list).as_slice() {
                [one] if !ty.ends_with(']') => one.clone(),
                all => Value::from(all),
            },
            MetaValue::Unknown => Value::Null,
        },
    };
    list.iter().map(datum).collect()
}

impl Shader {
    /// One line for the shader and one for each parameter, with metadata below.
    fn text(&self) -> String {
        let mut out = format!("{} {}\n", self.kind, self.name);
        lines(&self.metadata, "    ", &mut out);
        for p in &self.parameters {
            let output = if p.output { "output " } else { "" };
            let default = match &p.default {
                Value::Null => "(computed)".to_string(),
                value => value.to_string(),
            };
            out += &format!("    {output}{} {} = {default}\n", p.ty, p.name);
            lines(&p.metadata, "        ", &mut out);
        }
        out
    }
}

fn lines(list: &[Metadatum], indent: &str, out: &mut String) {
    for m in list {
        *out += &format!("{indent}[[ {} {} = {} ]]\n", m.ty, m.name, m.value);
    }
}
