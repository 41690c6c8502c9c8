//! Prints diagnostics and run-time messages for the user.

use super::Failure;
use super::args::levels::LintArgs;
use super::args::{MessageFormat, ReadArgs};
use osl_syntax::diagnostic::{Code, Diagnostic};
use osl_syntax::escape::shown;
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::source::SourceMap;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;

/// Prints diagnostics; fails if one is an error.
pub(super) fn diagnostics(
    list: &[Diagnostic],
    sources: &SourceMap,
    args: &ReadArgs,
    err: &mut dyn Write,
) -> Result<(), Failure> {
    let mut list = list.to_vec();
    osl::stages::hide(&mut list, sources);
    match args.message_format {
        MessageFormat::Human => {
            let list = with_lessons(&list);
            let _ = write!(err, "{}", render(&list, sources, RenderStyle { color: true }));
        }
        MessageFormat::Json => {
            for diagnostic in osl::stages::describe(&list, sources) {
                let line = serde_json::to_string(&json(&diagnostic)).unwrap_or_default();
                let _ = writeln!(err, "{line}");
            }
        }
    }
    if list.iter().any(Diagnostic::is_error) { Err(Failure::said()) } else { Ok(()) }
}

/// Maximum number of warnings of one kind in a file that are printed in full.
const MOST_OF_A_KIND: usize = 5;

/// Prints diagnostics of a file. Warnings in other files, such as included ones, and many warnings of one
/// kind are counted only, unless the command line asks for them by name. Fails if one is an error.
pub(super) fn folded(
    list: &[Diagnostic],
    sources: &SourceMap,
    (read, lints): (&ReadArgs, &LintArgs),
    err: &mut dyn Write,
) -> Result<(), Failure> {
    if read.message_format == MessageFormat::Json {
        return diagnostics(list, sources, read, err);
    }
    let main = sources.files().first().map_or("", |file| &*file.name).to_owned();
    let mut elsewhere: BTreeMap<String, Vec<Code>> = BTreeMap::new();
    let mut kinds: BTreeMap<Code, usize> = BTreeMap::new();
    let keeps = |d: &&Diagnostic| {
        if d.is_error() || lints.asks_for(d.code) {
            return true;
        }
        match sources.place(d.span).filter(|place| place.file != main) {
            Some(place) => {
                elsewhere.entry(place.file).or_default().push(d.code);
                false
            }
            None => {
                let n = kinds.entry(d.code).or_default();
                *n += 1;
                *n <= MOST_OF_A_KIND
            }
        }
    };
    let kept: Vec<Diagnostic> = list.iter().filter(keeps).cloned().collect();
    let result = diagnostics(&kept, sources, read, err);
    for (file, codes) in elsewhere {
        let text = format!("{} in {file} ({}); `-W all` shows them", warnings(codes.len()), names(codes));
        let _ = writeln!(err, "note: {}", shown(&text));
    }
    for (code, n) in kinds.into_iter().filter(|(_, n)| *n > MOST_OF_A_KIND) {
        let (more, name) = (n - MOST_OF_A_KIND, code.name);
        let _ = writeln!(err, "note: {more} more of {name}; `-W {name}` shows them");
    }
    result
}

fn warnings(n: usize) -> String {
    if n == 1 { "1 warning".to_string() } else { format!("{n} warnings") }
}

/// The names of codes, each once.
fn names(mut codes: Vec<Code>) -> String {
    codes.sort_unstable();
    codes.dedup();
    codes.iter().map(|code| code.name).collect::<Vec<_>>().join(", ")
}

/// Prints a warning about an option that has no effect.
pub(super) fn warning(text: &str, args: &ReadArgs, err: &mut dyn Write) {
    let _ = match args.message_format {
        MessageFormat::Human => writeln!(err, "warning: {}", shown(text)),
        MessageFormat::Json => {
            let object =
                serde_json::json!({ "code": "", "name": "option", "severity": "warning", "message": text });
            writeln!(err, "{object}")
        }
    };
}

/// Prints the diagnostics of a shader that is about to run: errors, and warnings that the command line asks
/// for; of all others only their number, since a run is repeated and `check` shows them. Fails if one is an
/// error.
pub(super) fn before_run(
    list: &[Diagnostic],
    sources: &SourceMap,
    (read, lints): (&ReadArgs, &LintArgs),
    err: &mut dyn Write,
) -> Result<(), Failure> {
    if read.message_format == MessageFormat::Json {
        return diagnostics(list, sources, read, err);
    }
    let (shown, counted): (Vec<Diagnostic>, Vec<Diagnostic>) =
        list.iter().cloned().partition(|d| d.is_error() || lints.asks_for(d.code));
    let result = diagnostics(&shown, sources, read, err);
    if !counted.is_empty() {
        let names = names(counted.iter().map(|d| d.code).collect());
        let _ = writeln!(err, "note: {} ({names}); `oslrun check` shows the text", warnings(counted.len()));
    }
    result
}

/// The diagnostics; the first of each code names its lesson, and how to silence it.
fn with_lessons(list: &[Diagnostic]) -> Vec<Diagnostic> {
    let mut named: Vec<Code> = Vec::new();
    let with_lesson = |d: &Diagnostic| {
        if named.contains(&d.code) {
            return d.clone();
        }
        named.push(d.code);
        let Code { id, name } = d.code;
        let silence = if id.starts_with('W') { format!("; `-A {name}` silences it") } else { String::new() };
        d.clone().note(format!("for more: `oslrun explain-error {id}`{silence}"))
    };
    list.iter().map(with_lesson).collect()
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

fn json<'a>(d: &'a osl::Diagnostic) -> Json<'a> {
    let edits = |fix: &'a osl::Fix| {
        fix.edits.iter().map(|e| Edit { at: Some(range(&e.range)), text: &e.text }).collect()
    };
    let related =
        |label: &'a osl::Label| Related { at: label.range.as_ref().map(range), message: &label.text };
    Json {
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
