//! Diagnostics as text for people: excerpts of the source with labels, notes, help, and fixes as patches.
//!
//! The crate annotate-snippets draws the excerpts. Only the caller knows whether the reader sees color.

use crate::diagnostic::{Diagnostic, Edit, Severity};
use crate::escape::{same_places, shown};
use crate::source::{Position, SourceFile, SourceMap};
use crate::span::Span;
use annotate_snippets::renderer::{DecorStyle, Renderer};
use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Origin, Patch, Snippet};
use std::borrow::Cow;
use std::ops::Range;

/// Maximum length of a displayed line in bytes; of a longer one, a part is displayed.
const MAX_LINE: usize = 1000;
/// Maximum length of what is marked in a part of a line, in bytes.
const MAX_MARKED: usize = 60;
/// Maximum length of what is displayed on each side of it, in bytes.
const MAX_BESIDE: usize = 40;
/// Maximum length of a displayed message in bytes.
const MAX_MESSAGE: usize = 600;

/// How to draw.
#[derive(Clone, Copy, Debug, Default)]
pub struct RenderStyle {
    /// Whether to use terminal colors.
    pub color: bool,
}

/// Diagnostics as text, in their order, separated by blank lines.
pub fn render(diagnostics: &[Diagnostic], sources: &SourceMap, style: RenderStyle) -> String {
    let renderer = if style.color { Renderer::styled() } else { Renderer::plain() };
    let renderer = renderer.decor_style(DecorStyle::Ascii);
    let mut out = String::new();
    for d in diagnostics {
        out.push_str(&renderer.render(&report(d, sources)));
        out.push_str("\n\n");
    }
    out
}

/// Where a diagnostic begins and ends; `None` for a span outside the files.
pub fn places(span: Span, sources: &SourceMap) -> Option<(Position, Position)> {
    Some((sources.place(span)?, sources.place(Span::new(span.end, span.end))?))
}

fn report<'a>(d: &'a Diagnostic, sources: &'a SourceMap) -> Vec<Group<'a>> {
    let level = match d.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let mut main = Group::with_title(level.primary_title(clipped(&d.message)).id(d.code.id));
    for file in files_of(d, sources) {
        let primary = range_in(file, d.span);
        let labelled = || d.labels.iter().filter_map(|(s, text)| Some((range_in(file, *s)?, text)));
        let ranges: Vec<Range<usize>> = primary.iter().cloned().chain(labelled().map(|(r, _)| r)).collect();
        let Some(window) = Window::around(file, &ranges).filter(|_| !file.about.hidden) else {
            let at = primary.clone().or_else(|| ranges.first().cloned()).unwrap_or_default().start as u32
                + file.base;
            if let Some(place) = sources.place(Span::new(at, at)) {
                let origin = Origin::path(shown(&file.name)).line(place.line as usize);
                main = main.element(origin.char_column(place.column as usize));
                let at = (at - file.base) as usize;
                let end = primary.as_ref().map_or(at, |r| r.end);
                if !file.about.hidden {
                    main = main.element(part_of_line(file, at..end, place.line as usize, &d.label));
                }
            }
            continue;
        };
        let mut snippet = window.snippet(file);
        if let Some(range) = primary {
            let span = window.within(range);
            snippet = snippet.annotation(AnnotationKind::Primary.span(span).label(label(&d.label)));
        }
        for (range, text) in labelled() {
            let span = window.within(range);
            snippet = snippet.annotation(AnnotationKind::Context.span(span).label(label(text)));
        }
        main = main.element(snippet);
    }
    for note in &d.notes {
        main = main.element(Level::NOTE.message(clipped(note)));
    }
    if let Some(help) = &d.help {
        main = main.element(Level::HELP.message(clipped(help)));
    }
    let mut groups = vec![main];
    for fix in &d.fixes {
        let file = fix.edits.first().and_then(|e| sources.file_at(e.span.start));
        let Some(file) = file.filter(|file| !file.about.hidden) else { continue };
        let ranges: Vec<Range<usize>> = fix.edits.iter().filter_map(|e| range_in(file, e.span)).collect();
        let Some(window) = Window::around(file, &ranges) else { continue };
        let patches: Vec<_> = fix.edits.iter().filter_map(|e| patch(file, &window, e)).collect();
        let snippet = window.snippet(file).patches(patches);
        groups.push(Group::with_title(Level::HELP.secondary_title(clipped(&fix.title))).element(snippet));
    }
    groups
}

/// The lines of a file that an excerpt needs, so that the cost of drawing does not depend on the size of the
/// file.
struct Window {
    range: Range<usize>,
    first_line: usize,
}

impl Window {
    /// The lines around the ranges; `None` if one of them is too long to display.
    fn around(file: &SourceFile, ranges: &[Range<usize>]) -> Option<Window> {
        let text = file.text.as_bytes();
        let start = ranges.iter().map(|r| r.start).min()?;
        let end = ranges.iter().map(|r| r.end).max()?;
        let line_start = |at: usize| text[..at].iter().rposition(|b| *b == b'\n').map_or(0, |n| n + 1);
        let line_end = |at: usize| text[at..].iter().position(|b| *b == b'\n').map_or(text.len(), |n| at + n);
        let long = |at: usize| line_end(at) - line_start(at) > MAX_LINE;
        if ranges.iter().any(|r| long(r.start) || long(r.end)) {
            return None;
        }
        let range = line_start(start)..line_end(end);
        let first_line = 1 + text[..range.start].iter().filter(|b| **b == b'\n').count();
        Some(Window { range, first_line })
    }

    fn snippet<'a, T: Clone>(&self, file: &'a SourceFile) -> Snippet<'a, T> {
        let text = file.text.get(self.range.clone()).unwrap_or_default();
        // A carriage return at the end of a line becomes a blank.
        let text = same_places(text);
        Snippet::source(text).path(shown(&file.name)).line_start(self.first_line).fold(true)
    }

    fn within(&self, range: Range<usize>) -> Range<usize> {
        range.start - self.range.start..range.end - self.range.start
    }
}

/// The part of a long line around the begin of a range.
fn part_of_line<'a>(
    file: &'a SourceFile,
    marked: Range<usize>,
    line: usize,
    text: &'a str,
) -> Snippet<'a, Annotation<'a>> {
    let whole = &file.text;
    let boundary =
        |at: usize| (0..=at.min(whole.len())).rev().find(|n| whole.is_char_boundary(*n)).unwrap_or(0);
    let line_start = whole[..marked.start].rfind('\n').map_or(0, |n| n + 1);
    let line_end = whole[marked.start..].find('\n').map_or(whole.len(), |n| marked.start + n);
    let marked_end = boundary(marked.end.min(marked.start + MAX_MARKED).min(line_end)).max(marked.start);
    let start = boundary(marked.start.saturating_sub(MAX_BESIDE)).max(line_start);
    let end = boundary((marked_end + MAX_BESIDE).min(line_end)).max(marked_end);
    let dots = |cut: bool| if cut { "..." } else { "" };
    let before = dots(start > line_start);
    let excerpt = format!("{before}{}{}", same_places(&whole[start..end]), dots(end < line_end));
    let at = before.len() + marked.start - start;
    let span = at..at + marked_end - marked.start;
    Snippet::source(excerpt)
        .line_start(line)
        .annotation(AnnotationKind::Primary.span(span).label(label(text)))
}

/// The text for display, cut if it is too long.
fn clipped(text: &str) -> Cow<'_, str> {
    let text = match shown(text) {
        Cow::Borrowed(text) if text.len() <= MAX_MESSAGE => return text.into(),
        text => text,
    };
    if text.len() <= MAX_MESSAGE {
        return text;
    }
    let mut end = MAX_MESSAGE;
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    format!("{}…", &text[..end]).into()
}

fn label(text: &str) -> Option<Cow<'_, str>> {
    (!text.is_empty()).then(|| clipped(text))
}

fn patch<'a>(file: &SourceFile, window: &Window, edit: &'a Edit) -> Option<Patch<'a>> {
    Some(Patch::new(window.within(range_in(file, edit.span)?), shown(&edit.text)))
}

/// The files of a diagnostic; that of its main location comes first.
fn files_of<'a>(d: &Diagnostic, sources: &'a SourceMap) -> Vec<&'a SourceFile> {
    let mut files: Vec<&SourceFile> = Vec::new();
    for span in std::iter::once(&d.span).chain(d.labels.iter().map(|(s, _)| s)) {
        if let Some(file) = sources.file_at(span.start)
            && !files.iter().any(|f| f.base == file.base)
        {
            files.push(file);
        }
    }
    files
}

/// A span as a byte range of a file, clipped to the file and to whole characters.
fn range_in(file: &SourceFile, span: Span) -> Option<Range<usize>> {
    let len = file.text.len();
    let start = span.start.checked_sub(file.base)? as usize;
    if start > len {
        return None;
    }
    let end = (span.end.saturating_sub(file.base) as usize).clamp(start, len);
    let down = |mut at: usize| {
        while !file.text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    Some(down(start)..down(end))
}
