//! `oslrun info FILE…`: describes shaders, as text or JSON.

use super::many;
use crate::cli::options::reading::{FormatArgs, ReadArgs};
use crate::cli::print::Console;
use clap::Args;
use osl::stages;
use osl_hir::hir::Program;
use osl_hir::oso;
use osl_job::Failure;
use osl_job::request::Reading;
use osl_job::source::input::{self, Input};
use osl_job::source::nodes;
use osl_syntax::ast::ShaderKind;
use osl_syntax::source::SourceMap;
use serde::Serialize;
use serde_json::{Number, Value};
use std::path::{Path, PathBuf};

/// Which shaders to show.
#[derive(Debug, Args)]
pub(in crate::cli) struct InfoArgs {
    /// Shader files, sources or compiled; or names of built-in nodes, such as remap. A folder stands for the
    /// .osl files in it and in the folders below it.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print one JSON object; of several files, a list with the name of the file in each object.
    #[arg(long)]
    json: bool,
    /// Check whether the run times of renderers run the compiled shader: the file itself, or what a source
    /// compiles to. Prints each violation with its line and operation. Exit code 1 if there is any.
    #[arg(long)]
    check_oso: bool,
    #[command(flatten)]
    read: ReadArgs,
    #[command(flatten)]
    format: FormatArgs,
}

/// Shows the shaders of the files.
pub(in crate::cli) fn info(args: &InfoArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let reading = args.read.reading();
    let files = many::files(&args.files)?;
    let (mut shaders, mut violations) = (Vec::new(), Vec::new());
    let result = many::each(&files, console, |file, console| {
        let input = opened(file, &reading)?;
        if args.check_oso {
            let (name, text) = compiled(&input, &reading, console)?;
            let found = check_oso(&name, &text, &reading);
            if !args.json {
                console.report(&found_text(&name, &found));
            }
            let fails = !found.is_empty();
            violations.extend(found);
            return if fails { Err(Failure::said()) } else { Ok(()) };
        }
        let mut shader = describe(&program(&input, console)?.0);
        shader.dialect = input.files.spoken().map(|spoken| DialectOf {
            name: spoken.dialect.name.clone(),
            because: spoken.reason.map(|reason| reason.to_string()),
        });
        if args.json {
            shaders.push(Named { file: input.name, shader });
        } else {
            let name = if files.len() > 1 { format!("{}: ", input.name) } else { String::new() };
            console.report(&format!("{name}{}", shader.text()));
        }
        Ok(())
    });
    match &shaders[..] {
        _ if !args.json => {}
        _ if args.check_oso => console.object(&violations)?,
        [one] if files.len() == 1 => console.object(&one.shader)?,
        _ if files.len() > 1 => console.object(&shaders)?,
        _ => {}
    }
    result
}

/// One of several shaders in the JSON output.
#[derive(Serialize)]
struct Named {
    file: String,
    #[serde(flatten)]
    shader: Shader,
}

/// The text of a file or of a built-in node.
fn opened(file: &Path, reading: &Reading) -> Result<Input, Failure> {
    match file.to_str().filter(|_| !file.exists()).and_then(nodes::find) {
        Some(text) => {
            let name = format!("{}.osl (built in)", file.display());
            input::input(name, text.to_string(), PathBuf::new(), reading)
        }
        None => input::read(file, reading),
    }
}

/// The program of a text, and its sources. Its errors are printed.
fn program(input: &Input, console: &mut Console<'_>) -> Result<(Program, SourceMap), Failure> {
    let checked = stages::check(&input.name, &input.text, &input.files, &input.options);
    let errors: Vec<_> = checked.diagnostics.iter().filter(|d| d.is_error()).cloned().collect();
    console.diagnostics(&errors, &checked.sources)?;
    Ok((checked.program.ok_or_else(Failure::said)?, checked.sources))
}

/// Name and text of the compiled shader: the file itself, or what a source compiles to.
fn compiled(
    input: &Input,
    reading: &Reading,
    console: &mut Console<'_>,
) -> Result<(String, String), Failure> {
    if stages::is_compiled(&input.name) {
        return Ok((input.name.clone(), input.text.clone()));
    }
    let (program, sources) = program(input, console)?;
    match oso::write(&program, &sources, &reading.limits) {
        Ok(text) => Ok((format!("{}.oso", program.shader.name), text)),
        Err(list) => {
            console.diagnostics(&list, &sources)?;
            Err(Failure::said())
        }
    }
}

/// A violation in the JSON output.
#[derive(Serialize)]
struct Violation {
    file: String,
    line: u32,
    operation: String,
    rule: &'static str,
    message: String,
}

/// Checks the text of a compiled shader.
fn check_oso(name: &str, text: &str, reading: &Reading) -> Vec<Violation> {
    let violation = |found: oso::Violation| Violation {
        file: name.to_string(),
        line: found.line,
        operation: found.subject,
        rule: found.rule.name(),
        message: found.message,
    };
    oso::check(text, &reading.limits).into_iter().map(violation).collect()
}

/// The violations of a compiled shader as text.
fn found_text(name: &str, list: &[Violation]) -> String {
    let line = |found: &Violation| {
        let Violation { line, operation, rule, message, .. } = found;
        format!("{name}:{line}: {rule}: `{operation}`: {message}\n")
    };
    match list {
        [] => format!("{name}: no violations\n"),
        list => list.iter().map(line).collect(),
    }
}

#[derive(Serialize)]
pub(in crate::cli) struct Shader {
    pub(in crate::cli) kind: &'static str,
    pub(in crate::cli) name: String,
    pub(in crate::cli) metadata: Vec<Metadatum>,
    pub(in crate::cli) parameters: Vec<Parameter>,
    /// The dialect of the file, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(in crate::cli) dialect: Option<DialectOf>,
}

/// A dialect, and what in the file shows it; nothing if the command line names it.
#[derive(Serialize)]
pub(in crate::cli) struct DialectOf {
    name: String,
    because: Option<String>,
}

#[derive(Serialize)]
pub(in crate::cli) struct Parameter {
    pub(in crate::cli) name: String,
    #[serde(rename = "type")]
    pub(in crate::cli) ty: String,
    pub(in crate::cli) output: bool,
    /// `null` if code computes it.
    pub(in crate::cli) default: Value,
    pub(in crate::cli) metadata: Vec<Metadatum>,
}

#[derive(Serialize)]
pub(in crate::cli) struct Metadatum {
    pub(in crate::cli) name: String,
    #[serde(rename = "type")]
    pub(in crate::cli) ty: String,
    pub(in crate::cli) value: Value,
}

/// The description of a shader.
pub(in crate::cli) fn describe(program: &Program) -> Shader {
    let shader = &program.shader;
    Shader {
        kind: match shader.kind {
            ShaderKind::Generic => "shader",
            ShaderKind::Surface => "surface",
            ShaderKind::Displacement => "displacement",
            ShaderKind::Volume => "volume",
        },
        name: shader.name.to_string(),
        metadata: metadata(stages::metadata(program)),
        parameters: stages::params(program).into_iter().map(parameter).collect(),
        dialect: None,
    }
}

fn parameter(param: osl::Param) -> Parameter {
    Parameter {
        ty: param.ty.to_string(),
        name: param.name,
        output: param.output,
        default: param.default.as_ref().map_or(Value::Null, json),
        metadata: metadata(param.metadata),
    }
}

fn metadata(list: Vec<osl::Metadata>) -> Vec<Metadatum> {
    let datum = |datum: osl::Metadata| Metadatum {
        name: datum.name,
        ty: datum.ty,
        value: datum.value.as_ref().map_or(Value::Null, json),
    };
    list.into_iter().map(datum).collect()
}

fn json(value: &osl::Value) -> Value {
    use osl::Value as V;
    let floats = |list: &[f32]| Value::Array(list.iter().map(|x| float(*x)).collect());
    match value {
        V::Int(n) => Value::from(*n),
        V::Float(x) => float(*x),
        V::Triple(x) => floats(x),
        V::Matrix(x) => floats(x),
        V::String(s) => Value::from(s.as_str()),
        V::Ints(list) => Value::from(list.as_slice()),
        V::Floats(list) => floats(list),
        V::Triples(list) => list.iter().map(|x| floats(x)).collect(),
        V::Matrices(list) => list.iter().map(|x| floats(x)).collect(),
        V::Strings(list) => Value::from(list.as_slice()),
        V::Struct(fields) => fields.iter().map(|(name, value)| (name.clone(), json(value))).collect(),
        V::List(list) => list.iter().map(json).collect(),
        V::NullClosure => Value::from(0),
        _ => Value::Null,
    }
}

/// The shortest decimal number that denotes this float. JSON has no infinities and NaN, so these become text.
fn float(x: f32) -> Value {
    let short = x.to_string().parse().ok().and_then(Number::from_f64);
    short.map_or_else(|| Value::from(x.to_string()), Value::Number)
}

impl Shader {
    /// One line for the shader and one for each parameter, with metadata below.
    fn text(&self) -> String {
        let mut out = format!("{} {}\n", self.kind, self.name);
        if let Some(DialectOf { name, because }) = &self.dialect {
            let because = because.as_ref().map_or(String::new(), |why| format!(": {why}"));
            out += &format!("    dialect {name}{because}\n");
        }
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
