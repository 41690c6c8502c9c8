//! Events and reports as JSON. The types are mirrors of those of the session, so that the form of the objects
//! can stay when the session changes.

use osl_job::{Failure, Message, Place, Severity};
use osl_scene::scene;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use serde::Serialize;
use std::io::Write;

/// A report as the text of one object, with a line break at the end.
///
/// # Errors
/// The value has no such form.
pub(in crate::cli) fn pretty(value: &impl Serialize) -> Result<String, Failure> {
    Ok(serde_json::to_string_pretty(value).map_err(Failure::new)? + "\n")
}

/// Prints an object on a line of its own.
pub(super) fn print(value: &impl Serialize, out: &mut dyn Write) {
    let _ = writeln!(out, "{}", serde_json::to_string(value).unwrap_or_default());
}

/// A line about a request.
#[derive(Serialize)]
pub(in crate::cli) struct Line<'a> {
    code: &'a str,
    name: &'a str,
    severity: &'a str,
    message: &'a str,
}

/// A line about a request.
pub(in crate::cli) fn line(severity: Severity, message: &str) -> Line<'_> {
    Line { code: "", name: "", severity: severity.word(), message }
}

/// An option that has no effect, or a doubtful value.
pub(in crate::cli) fn doubt(message: &str) -> Line<'_> {
    Line { code: "", name: "option", severity: "warning", message }
}

/// A message of a running shader.
#[derive(Serialize)]
pub(in crate::cli) struct Raised<'a> {
    code: &'static str,
    name: &'static str,
    severity: &'static str,
    message: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    help: Option<&'a str>,
    #[serde(flatten)]
    at: Option<&'a Place>,
    /// The number of points with this message, if they were counted, and the number of all.
    points: Option<u64>,
    of: u64,
    /// Column and row of the first.
    pixel: Option<[usize; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    texture: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    parameter: Option<&'a str>,
}

/// A message of a running shader.
pub(in crate::cli) fn message(message: &Message) -> Raised<'_> {
    Raised {
        code: "",
        name: "while-shading",
        severity: message.severity.word(),
        message: &message.message,
        help: message.help.as_deref(),
        at: message.at.as_ref(),
        points: message.points,
        of: message.of.0,
        pixel: message.pixel,
        texture: message.texture.as_deref(),
        parameter: message.parameter.as_deref(),
    }
}

/// A message about a line of a scene.
#[derive(Serialize)]
pub(in crate::cli) struct OfScene<'a> {
    code: &'static str,
    name: &'static str,
    severity: &'static str,
    message: &'a str,
    file: &'a str,
    line: u32,
}

/// A message about a line of a scene.
pub(in crate::cli) fn scene(message: &scene::Message) -> OfScene<'_> {
    OfScene {
        code: "",
        name: "scene",
        severity: if message.error { "error" } else { "warning" },
        message: &message.text,
        file: &message.place.file,
        line: message.place.line,
    }
}

/// Gives `take` each of these diagnostics.
pub(in crate::cli) fn diagnostics(
    list: &[Diagnostic],
    sources: &SourceMap,
    mut take: impl FnMut(&Diagnosed<'_>),
) {
    let mut list = list.to_vec();
    osl::stages::hide(&mut list, sources);
    osl::stages::describe(&list, sources).iter().for_each(|d| take(&diagnosed(d)));
}

/// A diagnostic of a source.
#[derive(Serialize)]
pub(in crate::cli) struct Diagnosed<'a> {
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
    safe: bool,
}

#[derive(Serialize)]
struct Edit<'a> {
    #[serde(flatten)]
    at: Option<Range>,
    text: &'a str,
}

fn range(range: &osl::Range) -> Range {
    let osl::Range { file, start, end } = range.clone();
    Range { file, line: start.line, column: start.column, end_line: end.line, end_column: end.column }
}

fn diagnosed<'a>(d: &'a osl::Diagnostic) -> Diagnosed<'a> {
    let edits = |fix: &'a osl::Fix| {
        fix.edits.iter().map(|e| Edit { at: Some(range(&e.range)), text: &e.text }).collect()
    };
    let related =
        |label: &'a osl::Label| Related { at: label.range.as_ref().map(range), message: &label.text };
    Diagnosed {
        code: d.code,
        name: d.name,
        severity: if d.is_error() { "error" } else { "warning" },
        message: &d.message,
        at: d.range.as_ref().map(range),
        label: &d.label,
        related: d.labels.iter().map(related).collect(),
        notes: &d.notes,
        help: d.help.as_deref(),
        fixes: d.fixes.iter().map(|f| Fix { title: &f.title, edits: edits(f), safe: f.safe }).collect(),
    }
}
