//! Places in the source: the line of a span, its text, and quotes of a line with carets under a part of it.

use osl_ir::Span;
use osl_syntax::source::SourceMap;
use serde::Serialize;
use std::fmt::Write;

/// Characters of a line that are kept.
const LINE: usize = 200;
/// Characters of the marked part that are kept.
const CODE: usize = 80;

/// A part of a source line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quote {
    /// The file.
    pub file: String,
    /// The line, from 1.
    pub line: u32,
    /// The column of the part, from 1.
    pub column: u32,
    /// The text of the line.
    pub text: String,
    /// The text of the part, with single spaces.
    pub code: String,
}

impl Quote {
    /// The source at a span; `None` if it is in no file.
    pub fn of(span: Span, sources: &SourceMap) -> Option<Quote> {
        let at = sources.place(span)?;
        let file = sources.file_at(span.start)?;
        let text = file.text.lines().nth(at.line.checked_sub(1)? as usize)?;
        let code = sources.text(span).split_whitespace().collect::<Vec<_>>().join(" ");
        Some(Quote {
            file: at.file,
            line: at.line,
            column: at.column,
            text: text.chars().take(LINE).collect(),
            code: code.chars().take(CODE).collect(),
        })
    }

    /// Writes the line without its indentation, and carets below the part.
    pub fn write(&self, out: &mut String) {
        let text = self.text.trim_start();
        let indent = self.text.chars().count() - text.chars().count();
        let before = (self.column as usize).saturating_sub(1).saturating_sub(indent);
        let room = text.chars().count().saturating_sub(before).max(1);
        let carets = "^".repeat(self.code.chars().count().clamp(1, room));
        let margin = " ".repeat(self.line.to_string().len());
        let _ = writeln!(out, "  {} | {text}", self.line);
        let _ = writeln!(out, "  {margin} | {}{carets}", " ".repeat(before));
    }
}

/// A line: the start of its file and its number.
pub(crate) type At = (u32, u32);

/// The line of a span; none for code that no line holds.
pub(crate) fn line_at(span: Span, sources: &SourceMap) -> Option<At> {
    if span == Span::default() {
        return None;
    }
    sources.line(span).map(|(file, line)| (file.base, line))
}

/// The name of the file of a line, and its text.
pub(crate) fn text_of((base, number): At, sources: &SourceMap) -> Option<(String, String)> {
    let file = sources.file_at(base)?;
    let text = file.line(number)?;
    Some((file.name.clone(), text.trim().chars().take(200).collect()))
}

/// The longest text of a condition.
const MAX_CONDITION: usize = 80;

/// The source text of a span, on one line.
pub(crate) fn snippet(span: Span, sources: &SourceMap) -> String {
    let text = sources.text(span).split_whitespace().collect::<Vec<_>>().join(" ");
    match text.char_indices().nth(MAX_CONDITION) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}
