//! Diagnostics as data: what is wrong, where, and which edits repair it.
//!
//! Positions are given in all units that editors use, so that a client needs no line index of its own.

use osl_syntax::diagnostic::{self as inner, Severity as InnerSeverity};
use osl_syntax::source::{SourceFile, SourceMap};
use osl_syntax::span::Span;

/// The severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The text compiles, but probably does not do what was intended.
    Warning,
    /// The text does not compile.
    Error,
}

/// A position in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Position {
    /// Byte in the text of the file, from 0.
    pub offset: usize,
    /// Line, from 1.
    pub line: u32,
    /// Column in characters (Unicode scalar values), from 1.
    pub column: u32,
    /// Column in UTF-16 code units, from 0, as the language server protocol counts.
    pub utf16: u32,
}

/// A part of a file.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Range {
    /// The file, by the name given to the compiler.
    pub file: String,
    /// The first position.
    pub start: Position,
    /// The position after the last one.
    pub end: Position,
}

/// A further location that belongs to a diagnostic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The location; `None` if it is in no file.
    pub range: Option<Range>,
    /// A few words about it.
    pub text: String,
}

/// One replacement of text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edit {
    /// The replaced text; empty for an insertion.
    pub range: Range,
    /// The new text.
    pub text: String,
}

/// A change that repairs the text. All of its edits belong together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fix {
    /// Its title, in the imperative: `remove the stray brace`.
    pub title: String,
    /// The edits, in order of position; they do not overlap.
    pub edits: Vec<Edit>,
    /// Whether a program can apply it without asking: it is the only reading of an error, or it keeps what
    /// the shader computes. Other changes are suggestions.
    pub safe: bool,
}

/// An error or warning about a location in a source text.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Diagnostic {
    /// Its stable code, such as `E0201`; [`lessons`](crate::lessons) explain it.
    pub code: &'static str,
    /// Its name, such as `unknown-name`.
    pub name: &'static str,
    /// Error or warning.
    pub severity: Severity,
    /// Its message: one line, lower case, without a full stop.
    pub message: String,
    /// The offending text; `None` if it is in no file.
    pub range: Option<Range>,
    /// A few words about the offending text; may be empty.
    pub label: String,
    /// Further locations.
    pub labels: Vec<Label>,
    /// Facts that explain the message.
    pub notes: Vec<String>,
    /// The next step for the user.
    pub help: Option<String>,
    /// Changes that repair the text.
    pub fixes: Vec<Fix>,
}

impl Diagnostic {
    /// Whether it is an error.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }

    /// Line and column of the start of the offending text, both from 1; (0, 0) if it is in no file.
    pub fn line_column(&self) -> (u32, u32) {
        self.range.as_ref().map_or((0, 0), |range| (range.start.line, range.start.column))
    }
}

impl Fix {
    /// The text of a file after the change. `None` if an edit does not fit the text.
    ///
    /// ```
    /// use osl::{Analysis, Levels, ReadOptions};
    ///
    /// let text = "shader a(output float o = 0) { float unused = 1; o = u; }";
    /// let found = Analysis::of("a.osl", text, &osl::NoFiles, &ReadOptions::default());
    /// let lints = found.diagnostics(&Levels::default());
    /// let fix = &lints[0].fixes[0];
    /// assert_eq!(fix.apply("a.osl", text).as_deref(), Some("shader a(output float o = 0) {  o = u; }"));
    /// ```
    pub fn apply(&self, file: &str, text: &str) -> Option<String> {
        let mut out = String::with_capacity(text.len());
        let mut at = 0;
        for edit in self.edits.iter().filter(|edit| edit.range.file == file) {
            out.push_str(text.get(at..edit.range.start.offset)?);
            out.push_str(&edit.text);
            at = edit.range.end.offset;
        }
        out.push_str(text.get(at..)?);
        Some(out)
    }
}

/// Converts diagnostics of the stages.
pub(crate) fn diagnostics(list: &[inner::Diagnostic], sources: &SourceMap) -> Vec<Diagnostic> {
    list.iter().map(|d| diagnostic(d, sources)).collect()
}

/// Converts a diagnostic of the stages.
pub(crate) fn diagnostic(d: &inner::Diagnostic, sources: &SourceMap) -> Diagnostic {
    let label = |(span, text): &(Span, String)| Label { range: range(*span, sources), text: text.clone() };
    let edit = |edit: &inner::Edit| Some(Edit { range: range(edit.span, sources)?, text: edit.text.clone() });
    // A fix without one of its edits would be another change.
    let fix = |fix: &inner::Fix| {
        let edits = fix.edits.iter().map(edit).collect::<Option<Vec<Edit>>>()?;
        Some(Fix { title: fix.title.clone(), edits, safe: fix.safe })
    };
    Diagnostic {
        code: d.code.id,
        name: d.code.name,
        severity: match d.severity {
            InnerSeverity::Warning => Severity::Warning,
            InnerSeverity::Error => Severity::Error,
        },
        message: d.message.clone(),
        range: range(d.span, sources),
        label: d.label.clone(),
        labels: d.labels.iter().map(label).collect(),
        notes: d.notes.clone(),
        help: d.help.clone(),
        fixes: d.fixes.iter().filter_map(fix).collect(),
    }
}

/// The part of a file that a span covers; `None` for a span outside the files.
pub(crate) fn range(span: Span, sources: &SourceMap) -> Option<Range> {
    let file = sources.file_at(span.start)?;
    let start = position(file, span.start)?;
    let end = position(file, span.end.max(span.start)).unwrap_or(start);
    Some(Range { file: file.name.clone(), start, end })
}

fn position(file: &SourceFile, at: u32) -> Option<Position> {
    let offset = at.checked_sub(file.base)? as usize;
    if offset > file.text.len() {
        return None;
    }
    let line = file.line_at(offset);
    let before = file.text.get(file.line_start(line)?..offset)?;
    let utf16 = before.chars().map(|c| c.len_utf16() as u32).sum();
    Some(Position { offset, line, column: before.chars().count() as u32 + 1, utf16 })
}
