//! Lines and texts of the source to which spans belong.

use osl_ir::Span;
use osl_syntax::source::SourceMap;

/// A line: the start of its file and its number.
pub(super) type At = (u32, u32);

/// The line of a span; none for code that no line holds.
pub(super) fn line_at(span: Span, sources: &SourceMap) -> Option<At> {
    if span == Span::default() {
        return None;
    }
    sources.line(span).map(|(file, line)| (file.base, line))
}

/// The name of the file of a line, and its text.
pub(super) fn text_of((base, number): At, sources: &SourceMap) -> Option<(String, String)> {
    let file = sources.file_at(base)?;
    let text = file.line(number)?;
    Some((file.name.clone(), text.trim().chars().take(200).collect()))
}

/// The longest text of a condition.
const MAX_CONDITION: usize = 80;

/// The source text of a span, on one line.
pub(super) fn snippet(span: Span, sources: &SourceMap) -> String {
    let text = sources.file_at(span.start).and_then(|file| {
        file.text.get((span.start - file.base) as usize..(span.end.saturating_sub(file.base)) as usize)
    });
    let text = text.unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ");
    match text.char_indices().nth(MAX_CONDITION) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}
