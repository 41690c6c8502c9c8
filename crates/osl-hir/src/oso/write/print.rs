//! The text: symbols by class, then the operations with their source lines.

use super::Writer;
use super::table::{Class, Op, Symbol, Value};
use super::usage::{self, Usage};
use crate::hir::MetaValue;
use crate::oso::text::{self, number, quote};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::ast::ShaderKind;
use osl_syntax::source::{SourceFile, SourceMap};
use osl_syntax::span::Span;
use std::fmt::Write;
use std::sync::Arc;

/// The whole text.
pub(super) fn print(writer: &Writer<'_>, sources: &SourceMap) -> String {
    let shader = &writer.program.shader;
    let kind = match shader.kind {
        ShaderKind::Generic => "shader",
        ShaderKind::Surface => "surface",
        ShaderKind::Displacement => "displacement",
        ShaderKind::Volume => "volume",
    };
    let mut out = format!("{} 1.00\n# Compiled by oslrun {}\n", text::HEADER, env!("CARGO_PKG_VERSION"));
    let _ = write!(out, "{kind} {}", shader.name);
    let separator = if shader.metadata.is_empty() { "" } else { "\t\t" };
    out.push_str(separator);
    metadata(&shader.metadata, &mut out);
    out.push('\n');
    let usages = usage::usages(&writer.table, &writer.ops);
    let rank = |class: Class| match class {
        Class::Param { .. } => 0,
        Class::Global => 1,
        Class::Local => 2,
        Class::Temp | Class::Const => 3,
    };
    let mut order: Vec<(usize, &Symbol)> = writer.table.symbols.iter().enumerate().collect();
    order.sort_by_key(|(_, symbol)| {
        (rank(symbol.class), if symbol.class == Class::Global { text::global(&symbol.name) } else { None })
    });
    for (index, symbol) in order {
        line_of(writer, symbol, usages.get(index), &mut out);
    }
    for (index, (name, start)) in writer.sections.iter().enumerate() {
        let end = writer.sections.get(index + 1).map_or(writer.ops.len(), |(_, next)| *next);
        let _ = writeln!(out, "code {name}");
        // A run time forgets file and line at the head of each section.
        let mut lines = Lines { sources, file: None, line: 0 };
        for op in writer.ops.get(*start..end).unwrap_or_default() {
            operation(writer, op, &mut lines, &mut out);
        }
    }
    out
}

fn type_name(writer: &Writer<'_>, symbol: &Symbol) -> String {
    let base = match symbol.ty.base {
        Base::Struct(id) => format!("struct {}", writer.program.structs.get(id).name),
        _ => writer.program.structs.show(symbol.ty.element()),
    };
    match symbol.ty.extent {
        _ if symbol.open => format!("{base}[]"),
        Extent::Array(n) => format!("{base}[{n}]"),
        Extent::Unsized => format!("{base}[]"),
        Extent::One => base,
    }
}

/// The line of a symbol.
fn line_of(writer: &Writer<'_>, symbol: &Symbol, usage: Option<&Usage>, out: &mut String) {
    let class = match symbol.class {
        Class::Param { output: false } => "param",
        Class::Param { output: true } => "oparam",
        Class::Global => "global",
        Class::Local => "local",
        Class::Temp => "temp",
        Class::Const => "const",
    };
    let _ = write!(out, "{class}\t{}\t{}\t", type_name(writer, symbol), symbol.name);
    let has_value = matches!(symbol.class, Class::Param { .. } | Class::Const);
    if has_value {
        values(&symbol.values, out);
        out.push_str("\t\t");
    }
    metadata(&symbol.metadata, out);
    let Usage { read, written } = usage.copied().unwrap_or(Usage { read: text::NEVER, written: text::NEVER });
    let _ = write!(out, "%read{{{},{}}} %write{{{},{}}}", read.0, read.1, written.0, written.1);
    if symbol.derivs {
        out.push_str(" %derivs");
    }
    if let Base::Struct(id) = symbol.ty.base {
        let structure = writer.program.structs.get(id);
        let names: Vec<&str> = structure.fields.iter().map(|f| &*f.name).collect();
        let types: String = structure.fields.iter().map(|f| letter(writer, f.ty)).collect();
        let _ = write!(
            out,
            " %struct{{\"{}\"}} %structfields{{{}}} %structfieldtypes{{\"{types}\"}} %structnfields{{{}}}",
            structure.name,
            names.join(","),
            names.len()
        );
    }
    if let Some((parent, index)) = &symbol.parent {
        let _ = write!(out, " %mystruct{{{parent}}} %mystructfield{{{index}}}");
    }
    if symbol.computed {
        out.push_str(" %initexpr");
    }
    out.push('\n');
}

/// The letter of a field's type in a struct's hint.
fn letter(writer: &Writer<'_>, ty: Type) -> String {
    let base = match ty.base {
        Base::Int => "i",
        Base::Float => "f",
        Base::Color => "c",
        Base::Point => "p",
        Base::Vector => "v",
        Base::Normal => "n",
        Base::Matrix => "m",
        Base::String => "s",
        Base::Closure => "C",
        Base::Struct(id) => return format!("S{}", writer.program.structs.get(id).name),
        Base::Void | Base::Error => "x",
    };
    match ty.extent {
        Extent::Array(n) => format!("{base}[{n}]"),
        _ => base.to_string(),
    }
}

fn values(list: &[Value], out: &mut String) {
    for (index, value) in list.iter().enumerate() {
        if index > 0 {
            out.push(' ');
        }
        match value {
            Value::Int(n) => {
                let _ = write!(out, "{n}");
            }
            Value::Float(x) => out.push_str(&number(*x)),
            Value::Text(text) => quote(text, out),
        }
    }
}

/// Hints of metadata, each followed by a blank, and one more after the last.
fn metadata(list: &[(String, Arc<str>, MetaValue)], out: &mut String) {
    for (ty, name, value) in list {
        let _ = write!(out, "%meta{{{ty},{name}");
        match value {
            MetaValue::Text(text) => {
                out.push(',');
                quote(text, out);
            }
            MetaValue::Texts(texts) => texts.iter().for_each(|text| {
                out.push(',');
                quote(text, out);
            }),
            MetaValue::Numbers(numbers) => numbers.iter().for_each(|x| {
                out.push(',');
                if ty.starts_with("int") {
                    let _ = write!(out, "{x}");
                } else {
                    out.push_str(&number(*x as f32));
                }
            }),
            MetaValue::Unknown => {}
        }
        out.push_str("} ");
    }
    if !list.is_empty() {
        out.push(' ');
    }
}

/// The source locations of the operations, as far as they were written.
struct Lines<'a> {
    sources: &'a SourceMap,
    file: Option<usize>,
    line: usize,
}

impl<'a> Lines<'a> {
    /// The file and the line, from 1, with the index in the list of files and the offset in the file.
    fn place(&self, span: Span) -> Option<(usize, &'a SourceFile, usize)> {
        let sources = self.sources;
        let index = sources.files().partition_point(|f| f.base <= span.start).checked_sub(1)?;
        let (file, line) = sources.line(span)?;
        Some((index, file, line as usize))
    }
}

/// Characters of a line that are quoted, since operations of two long lines may take turns. This is a choice
/// of presentation.
const MAX_QUOTED: usize = 500;

/// The quoted part of a line.
fn quoted(file: &SourceFile, line: usize) -> &str {
    let text = file.line(line as u32).unwrap_or_default();
    text.char_indices().nth(MAX_QUOTED).map_or(text, |(end, _)| &text[..end])
}

/// The name of a file as a hint and a comment can have it. The format has no escapes for either, so quotes
/// become apostrophes, control characters spaces, and no backslash stands before the closing quote.
fn file_name(name: &str) -> String {
    let plain = |c: char| match c {
        '"' => '\'',
        c if c.is_control() => ' ',
        c => c,
    };
    let mut name: String = name.chars().map(plain).collect();
    if name.ends_with('\\') {
        name.push(' ');
    }
    name
}

fn operation(writer: &Writer<'_>, op: &Op, lines: &mut Lines<'_>, out: &mut String) {
    let mut hints = String::new();
    if let Some((index, file, line)) = lines.place(op.span).filter(|_| op.name != "end")
        && (lines.file, lines.line) != (Some(index), line)
    {
        let name = file_name(&file.name);
        let _ = writeln!(out, "# {name}:{line}\n# {}", quoted(file, line));
        if lines.file != Some(index) {
            let _ = write!(hints, " %filename{{\"{name}\"}}");
        }
        let _ = write!(hints, " %line{{{line}}}");
        (lines.file, lines.line) = (Some(index), line);
    }
    let _ = write!(out, "\t{}", op.name);
    if op.args.is_empty() {
        out.push_str(&hints);
        out.push('\n');
        return;
    }
    out.push_str(if op.name.len() < 8 { "\t\t" } else { "\t" });
    for sym in &op.args {
        let _ = write!(out, "{} ", writer.table.get(*sym).map_or("", |s| s.name.as_str()));
    }
    for target in &op.jumps {
        let _ = write!(out, "{target} ");
    }
    let access: String = op.usage.access.iter().map(|a| char::from(*a)).collect();
    out.push('\t');
    if !hints.is_empty() {
        let _ = write!(out, "{} ", hints.trim_start());
    }
    let _ = write!(out, "%argrw{{\"{access}\"}}");
    let derivs: Vec<String> = op.usage.derivatives.iter().map(usize::to_string).collect();
    if !derivs.is_empty() {
        let _ = write!(out, " %argderivs{{{}}}", derivs.join(","));
    }
    out.push('\n');
}
