//! Diagnostics as text for people: excerpts of the source with labels, notes, help, and fixes as patches.
//!
//! Drawing is annotate-snippets' business. Only the caller knows whether its reader sees color.

use crate::diagnostic::{Diagnostic, Edit, Severity};
use crate::source::{Place, SourceFile, SourceMap};
use crate::span::Span;
use annotate_snippets::renderer::{DecorStyle, Renderer};
use annotate_snippets::{AnnotationKind, Group, Level, Patch, Snippet};
use std::ops::Range;

/// How to draw.
#[derive(Clone, Copy, Debug, Default)]
pub struct RenderStyle {
    /// Whether to use terminal colors.
    pub color: bool,
}

/// Diagnostics as text, in their order, one blank line between them.
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

/// Where a diagnostic begins and ends; `None` for a span outside of the files.
pub fn places(span: Span, sources: &SourceMap) -> Option<(Place, Place)> {
    Some((sources.place(span)?, sources.place(Span::new(span.end, span.end))?))
}

fn report<'a>(d: &'a Diagnostic, sources: &'a SourceMap) -> Vec<Group<'a>> {
    let level = match d.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let mut main = Group::with_title(level.primary_title(&d.message).id(d.code.id));
    for file in files_of(d, sources) {
        let mut snippet = Snippet::source(&*file.text).path(&file.name).fold(true);
        if let Some(range) = range_in(file, d.span) {
            snippet = snippet.annotation(AnnotationKind::Primary.span(range).label(label(&d.label)));
        }
        for (span, text) in &d.labels {
            if let Some(range) = range_in(file, *span) {
                snippet = snippet.annotation(AnnotationKind::Context.span(range).label(label(text)));
            }
        }
        main = main.element(snippet);
    }
    for note in &d.notes {
        main = main.element(Level::NOTE.message(note));
    }
    if let Some(help) = &d.help {
        main = main.element(Level::HELP.message(help));
    }
    let mut groups = vec![main];
    for fix in &d.fixes {
        let Some(file) = fix.edits.first().and_then(|e| sources.file_at(e.span.start)) else { continue };
        let patches: Vec<_> = fix.edits.iter().filter_map(|e| patch(file, e)).collect();
        let snippet = Snippet::source(&*file.text).path(&file.name).fold(true).patches(patches);
        groups.push(Group::with_title(Level::HELP.secondary_title(&fix.title)).element(snippet));
    }
    groups
}

fn label(text: &str) -> Option<&str> {
    (!text.is_empty()).then_some(text)
}

fn patch<'a>(file: &SourceFile, edit: &'a Edit) -> Option<Patch<'a>> {
    Some(Patch::new(range_in(file, edit.span)?, edit.text.as_str()))
}

/// The files that a diagnostic speaks of, that of its main place first.
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

/// A span as bytes of a file, cut to it and to whole characters.
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
