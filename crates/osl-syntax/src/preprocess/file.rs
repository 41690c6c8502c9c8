//! Reads one file: removes white space and comments, checks strings, and counts lines.

use super::{Conditional, Preprocessor};
use crate::errors;
use crate::lexer::{PpToken, Raw, Sym, joined, scan};
use crate::span::Span;
use std::sync::Arc;

/// Maximum number of lines of a broken string literal; a longer one counts as never closed.
const MAX_STRING_LINES: usize = 16;

/// The position in a file.
pub(super) struct FileCursor {
    pub(super) name: String,
    pub(super) text: Arc<str>,
    pub(super) base: u32,
    pub(super) at: usize,
    /// Whether the next token is the first of its line.
    line_start: bool,
    pub(super) conditionals: Vec<Conditional>,
    /// The shift of line numbers from `#line`.
    pub(super) line_shift: i64,
    /// The file name from `#line`.
    pub(super) line_file: Option<Arc<str>>,
}

impl FileCursor {
    pub(super) fn new(name: &str, text: Arc<str>, base: u32) -> Self {
        // A byte order mark is not part of the text.
        let at = if text.starts_with('\u{feff}') { 3 } else { 0 };
        Self {
            name: name.to_owned(),
            text,
            base,
            at,
            line_start: true,
            conditionals: Vec::new(),
            line_shift: 0,
            line_file: None,
        }
    }

    /// The empty span at the current position.
    pub(super) fn here(&self) -> Span {
        self.span(self.at, self.at)
    }

    pub(super) fn span(&self, from: usize, to: usize) -> Span {
        Span::new(self.base + from as u32, self.base + to as u32)
    }

    /// Skips consecutive line breaks: a file may contain millions of them.
    fn skip_empty_lines(&mut self) {
        let rest = self.text.as_bytes().get(self.at..).unwrap_or_default();
        self.at += rest.iter().take_while(|b| **b == b'\n').count();
    }
}

impl Preprocessor<'_> {
    /// The next token of the innermost file, across lines.
    pub(super) fn next_of_file(&mut self) -> Option<PpToken> {
        loop {
            match self.piece(true)? {
                Piece::Token(t) => return Some(t),
                Piece::LineEnd => self.files.last_mut()?.skip_empty_lines(),
            }
        }
    }

    /// The rest of the innermost file's current line, including its end.
    pub(super) fn rest_of_line(&mut self) -> Vec<PpToken> {
        let mut line = Vec::new();
        while let Some(Piece::Token(t)) = self.piece(true) {
            line.push(t);
        }
        line
    }

    /// The first tokens of the next directive line, with its `#`; `None` at the end of the file. Skipped text
    /// is not checked for errors.
    pub(super) fn skip_to_directive(&mut self) -> Option<PpToken> {
        loop {
            match self.piece(false)? {
                Piece::Token(t) if t.kind == Raw::Hash && t.line_start => return Some(t),
                _ => {}
            }
        }
    }

    /// The next token or line end of the innermost file. `live` text is checked for errors, skipped text is
    /// not.
    fn piece(&mut self, live: bool) -> Option<Piece> {
        let strict = self.options.strict;
        let file = self.files.last_mut()?;
        let mut space = false;
        loop {
            let from = file.at;
            let (kind, mut to) = scan(&file.text, from)?;
            file.at = to;
            match kind {
                Raw::Space | Raw::LineComment => space = true,
                Raw::BlockComment => {
                    space = true;
                    if live {
                        let span = file.span(from, to);
                        let body = file.text.get(from + 2..to).unwrap_or("");
                        if !body.ends_with("*/") {
                            self.diagnostics
                                .push(errors::unterminated_comment(file.span(from, from + 2), file.here()));
                        } else if let Some(n) = body.find("/*") {
                            let at = span.start + 2 + n as u32;
                            self.diagnostics.push(errors::nested_comment(strict, Span::new(at, at + 2)));
                        }
                    }
                }
                Raw::Newline => {
                    file.line_start = true;
                    return Some(Piece::LineEnd);
                }
                _ => {
                    let mut spelling = std::borrow::Cow::Borrowed(file.text.get(from..to).unwrap_or(""));
                    let mut kind = kind;
                    if !matches!(kind, Raw::Str | Raw::OpenStr) && spelling.contains('\n') {
                        spelling = joined(file.text.get(from..to).unwrap_or(""));
                    }
                    if kind == Raw::OpenStr && live {
                        (kind, spelling, to) = match broken_string(&file.text, from).filter(|_| !strict) {
                            Some(end) => {
                                let joined = join_lines(file.text.get(from..end).unwrap_or(""));
                                let span = file.span(from, end);
                                self.diagnostics.push(errors::broken_string(strict, span, joined.clone()));
                                (Raw::Str, joined.into(), end)
                            }
                            None => {
                                self.diagnostics.push(errors::unterminated_string(file.span(from, to)));
                                (Raw::Str, spelling, to)
                            }
                        };
                        file.at = to;
                    }
                    let line_start = std::mem::replace(&mut file.line_start, false);
                    let sym = if live { self.names.intern(&spelling) } else { Sym::EMPTY };
                    let span = file.span(from, to);
                    return Some(Piece::Token(PpToken {
                        kind,
                        sym,
                        span,
                        space,
                        line_start,
                        painted: false,
                    }));
                }
            }
        }
    }
}

enum Piece {
    Token(PpToken),
    LineEnd,
}

/// The end of a string literal that begins at `from` and continues over line breaks, if it looks like one: it
/// closes within a few lines, and the quotes after it on its last line are paired. An odd number of them
/// suggests that the literal was meant to end earlier.
pub(crate) fn broken_string(text: &str, from: usize) -> Option<usize> {
    let bytes = text.as_bytes();
    let mut lines = 0;
    let mut at = from + 1;
    let end = loop {
        match bytes.get(at)? {
            b'"' => break at + 1,
            b'\\' => at += 1,
            b'\n' => lines += 1,
            _ => {}
        }
        if lines > MAX_STRING_LINES {
            return None;
        }
        at += 1;
    };
    let rest = text.get(end..)?.lines().next().unwrap_or("");
    let code = rest.split("//").next().unwrap_or("").replace("\\\"", "");
    (code.matches('"').count() % 2 == 0).then_some(end)
}

/// A broken literal on one line: each line break becomes one space.
fn join_lines(literal: &str) -> String {
    literal.replace("\r\n", " ").replace('\n', " ")
}
