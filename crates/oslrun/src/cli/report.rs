//! Prints diagnostics and run-time messages for the user.

use super::Failure;
use super::args::{MessageFormat, ReadArgs};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::render::{RenderStyle, places, render};
use osl_syntax::source::{Place, SourceMap};
use serde::Serialize;
use std::io::Write;

/// Prints diagnostics; fails if one is an error.
pub(super) fn diagnostics(
    list: &[Diagnostic],
    sources: &SourceMap,
    args: &ReadArgs,
    err: &mut dyn Write,
) -> Result<(), Failure> {
    match args.message_format {
        MessageFormat::Human => {
            let _ = write!(err, "{}", render(list, sources, RenderStyle { color: true }));
        }
        MessageFormat::Json => {
            for diagnostic in list {
                let line = serde_json::to_string(&json(diagnostic, sources)).unwrap_or_default();
                let _ = writeln!(err, "{line}");
            }
        }
    }
    if list.iter().any(Diagnostic::is_error) { Err(Failure::said()) } else { Ok(()) }
}

#[derive(Serialize)]
struct Json<'a> {
    code: &'a str,
    name: &'a str,
    severity: &'a str,
    message: &'a str,
    #[serde(flatten)]
    at: Option<Range>,
    label: &'a str,
    related: Vec<Related<'a>>,
    notes: &'a [String],
    help: Option<&'a str>,
    fixes: Vec<Fix<'a>>,
}

#[derive(Serialize)]
struct Range {
    file: String,
    line: u32,
    column: u32,
    end_line: u32,
    end_column: u32,
}

#[derive(Serialize)]
struct Related<'a> {
    #[serde(flatten)]
    at: Option<Range>,
    message: &'a str,
}

#[derive(Serialize)]
struct Fix<'a> {
    title: &'a str,
    edits: Vec<Edit<'a>>,
}

#[derive(Serialize)]
struct Edit<'a> {
    #[serde(flatten)]
    at: Option<Range>,
    text: &'a str,
}

fn range(span: osl_syntax::span::Span, sources: &SourceMap) -> Option<Range> {
    let (Place { file, line, column }, end) = places(span, sources)?;
    Some(Range { file, line, column, end_line: end.line, end_column: end.column })
}

fn json<'a>(d: &'a Diagnostic, sources: &SourceMap) -> Json<'a> {
    let edits = |fix: &'a osl_syntax::diagnostic::Fix| {
        fix.edits.iter().map(|e| Edit { at: range(e.span, sources), text: &e.text }).collect()
    };
    Json {
        code: d.code.id,
        name: d.code.name,
        severity: if d.is_error() { "error" } else { "warning" },
        message: &d.message,
        at: range(d.span, sources),
        label: &d.label,
        related: d.labels.iter().map(|(s, m)| Related { at: range(*s, sources), message: m }).collect(),
        notes: &d.notes,
        help: d.help.as_deref(),
        fixes: d.fixes.iter().map(|f| Fix { title: &f.title, edits: edits(f) }).collect(),
    }
}
