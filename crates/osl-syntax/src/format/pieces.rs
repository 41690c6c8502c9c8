//! Splits a file before preprocessing into tokens, comments, and text that is kept unchanged.
//!
//! Kept unchanged are directives with their continuation lines, the text after `#if 0`, and macro calls with
//! their arguments, because an argument may be turned into a string. A name counts as a macro after its
//! `#define`, and also, in a file that includes others, if it is a call in capitals. Anything else that is
//! not a token of the language is an error.

use crate::diagnostic::{Diagnostic, Sink};
use crate::errors;
use crate::lexer::{Raw, joined, scan};
use crate::preprocess::broken_string;
use crate::span::Span;
use crate::token::{Token, fixed};
use rustc_hash::FxHashSet;

/// The kind of a piece.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Kind {
    /// A keyword or an operator.
    Fixed(Token),
    /// A name that is not a macro of the file.
    Name,
    /// A number.
    Number,
    /// A string literal; it may contain line breaks.
    Str,
    /// A macro of the file, with its arguments if it has any; they may contain line breaks.
    Macro,
    /// `//`, without the white space after it.
    LineComment,
    /// `/* */`
    BlockComment,
    /// Whole lines, the last line break included unless the text ends there.
    Lines(Directive),
}

/// The meaning of whole lines for the code around them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Directive {
    /// `#if`, `#ifdef`, `#ifndef`
    If,
    /// `#elif`, `#else`
    Else,
    /// `#endif`
    Endif,
    /// Any other directive, or the text after `#if 0`.
    Other,
}

/// A piece of the text.
#[derive(Clone, Debug)]
pub(super) struct Piece<'a> {
    /// Its kind.
    pub(super) kind: Kind,
    /// As written.
    pub(super) text: &'a str,
    /// Where it begins, in bytes.
    pub(super) start: usize,
    /// Line breaks before it; the start of the text counts as one.
    pub(super) breaks: u32,
    /// For a comment: whether no code follows on its line.
    pub(super) ends_line: bool,
    /// For a comment: whether code precedes it on its line and none follows.
    pub(super) trails: bool,
}

impl<'a> Piece<'a> {
    /// A piece that has not been classified as a comment yet.
    fn new(kind: Kind, text: &'a str, start: usize, breaks: u32) -> Piece<'a> {
        Piece { kind, text, start, breaks, ends_line: false, trails: false }
    }

    /// Whether it is a comment.
    pub(super) fn is_comment(&self) -> bool {
        matches!(self.kind, Kind::LineComment | Kind::BlockComment)
    }

    /// Whether it is neither a comment nor whole lines.
    pub(super) fn is_code(&self) -> bool {
        !self.is_comment() && !matches!(self.kind, Kind::Lines(_))
    }

    /// Whether it is that keyword or operator.
    pub(super) fn is(&self, token: &Token) -> bool {
        matches!(&self.kind, Kind::Fixed(t) if t == token)
    }

    /// Whether it is, or contains, a string literal and spans several lines.
    pub(super) fn is_broken_string(&self) -> bool {
        matches!(self.kind, Kind::Str | Kind::Macro) && self.text.contains('\n') && self.text.contains('"')
    }

    /// Its location.
    pub(super) fn span(&self) -> Span {
        Span::new(self.start as u32, (self.start + self.text.len()) as u32)
    }
}

/// Splits a text. `errors` bounds the reported errors.
///
/// # Errors
/// Invalid tokens, unterminated comments or macro arguments, unbalanced conditionals.
pub(super) fn split(text: &str, errors: u64) -> Result<Vec<Piece<'_>>, Vec<Diagnostic>> {
    let mut s = Splitter {
        text,
        at: if text.starts_with('\u{feff}') { 3 } else { 0 },
        line: 0,
        line_start: true,
        breaks: 1,
        macros: FxHashSet::default(),
        includes: false,
        conditionals: Vec::new(),
        found: Sink::new(errors),
        pieces: Vec::new(),
    };
    s.line = s.at;
    while let Some((kind, end)) = scan(text, s.at) {
        s.step(kind, end);
    }
    let end = Span::new(text.len() as u32, text.len() as u32);
    for open in std::mem::take(&mut s.conditionals) {
        s.found.push(errors::unterminated_conditional(open.opened, end));
    }
    mark_comments(&mut s.pieces);
    if s.found.list.is_empty() { Ok(s.pieces) } else { Err(s.found.list) }
}

/// Marks the comments that end lines.
fn mark_comments(pieces: &mut [Piece<'_>]) {
    let mut code_follows = false;
    for piece in pieces.iter_mut().rev() {
        piece.ends_line = piece.kind == Kind::LineComment || !code_follows;
        code_follows = piece.breaks == 0 && (piece.is_code() || (piece.is_comment() && !piece.ends_line));
    }
    let mut code_before = false;
    for piece in pieces {
        piece.trails = piece.is_comment() && piece.ends_line && piece.breaks == 0 && code_before;
        code_before = piece.is_code() || piece.trails;
    }
}

struct Splitter<'a> {
    text: &'a str,
    at: usize,
    /// Where the line begins.
    line: usize,
    /// Whether the line so far contains only white space and comments.
    line_start: bool,
    breaks: u32,
    macros: FxHashSet<&'a str>,
    /// Whether there are includes, whose macros are unknown here.
    includes: bool,
    conditionals: Vec<Conditional>,
    found: Sink,
    pieces: Vec<Piece<'a>>,
}

/// An `#if` without its `#endif` so far.
struct Conditional {
    opened: Span,
    /// The `#else`, once seen.
    other: Option<Span>,
}

impl<'a> Splitter<'a> {
    /// Handles the piece that was just scanned.
    fn step(&mut self, kind: Raw, end: usize) {
        let from = self.at;
        let span = Span::new(from as u32, end as u32);
        let text = self.text.get(from..end).unwrap_or("");
        match kind {
            Raw::Space => self.at = end,
            Raw::Newline => {
                self.breaks = self.breaks.saturating_add(1);
                self.at = end;
                self.line = end;
                self.line_start = true;
            }
            Raw::LineComment => self.push(Kind::LineComment, end),
            Raw::BlockComment => {
                if text.len() < 4 || !text.ends_with("*/") {
                    let open = Span::new(from as u32, from as u32 + 2);
                    self.found.push(errors::unterminated_comment(open, Span::new(span.end, span.end)));
                }
                self.push(Kind::BlockComment, end);
            }
            Raw::Hash if self.line_start => self.directive(),
            Raw::Ident => self.word(text, end),
            Raw::Number => self.push(Kind::Number, end),
            Raw::Str => self.push(Kind::Str, end),
            Raw::OpenStr => {
                let close = broken_string(self.text, from);
                if close.is_none() {
                    self.found.push(errors::unterminated_string(span));
                }
                self.push(Kind::Str, close.unwrap_or(end));
            }
            Raw::Char | Raw::OpenChar => {
                self.found.push(errors::char_literal(span, text));
                self.at = end;
            }
            kind => match fixed(kind, &joined(text)) {
                Some(token) => self.push(Kind::Fixed(token), end),
                None => {
                    self.found.push(errors::stray_character(span, text));
                    self.at = end;
                }
            },
        }
    }

    fn push(&mut self, kind: Kind, end: usize) {
        let mut text = self.text.get(self.at..end).unwrap_or("");
        if kind == Kind::LineComment {
            text = line_comment(text, end == self.text.len());
        } else if kind != Kind::BlockComment {
            self.line_start = false;
        }
        self.pieces.push(Piece::new(kind, text, self.at, self.breaks));
        self.breaks = 0;
        self.at = end;
    }

    /// Keeps whole lines unchanged.
    fn push_lines(&mut self, kind: Directive, start: usize, end: usize) {
        let mut text = self.text.get(start..end).unwrap_or("");
        if end == self.text.len() {
            // A backslash before the last line break continues the line with nothing.
            let trimmed = text.strip_suffix('\n').map(|t| t.strip_suffix('\r').unwrap_or(t));
            text = trimmed.filter(|t| t.ends_with('\\')).unwrap_or(text);
        }
        self.pieces.push(Piece::new(Kind::Lines(kind), text, start, self.breaks));
        self.breaks = 1;
        self.at = end;
        self.line = end;
        self.line_start = true;
    }

    fn word(&mut self, text: &'a str, end: usize) {
        let joined = joined(text);
        if let Some(token) = fixed(Raw::Ident, &joined) {
            return self.push(Kind::Fixed(token), end);
        }
        let defined = self.macros.contains(&*joined);
        let called = defined || (self.includes && is_capitals(text));
        if !called {
            return self.push(Kind::Name, end);
        }
        let name = Span::new(self.at as u32, end as u32);
        match self.arguments(end) {
            Arguments::None => self.push(if defined { Kind::Macro } else { Kind::Name }, end),
            Arguments::Until(end) => self.push(Kind::Macro, end),
            Arguments::Endless => {
                self.found.push(errors::unterminated_invocation(name, text));
                // The rest was already read to the end; once is enough.
                self.at = self.text.len();
            }
        }
    }

    /// The arguments of a macro whose name ends at `at`.
    fn arguments(&self, mut at: usize) -> Arguments {
        let (mut depth, mut line_start) = (0usize, false);
        while let Some((kind, end)) = scan(self.text, at) {
            let mut next = end;
            match kind {
                Raw::Space | Raw::LineComment | Raw::BlockComment => {}
                Raw::Newline => line_start = true,
                Raw::Hash if line_start && depth > 0 => next = directive_end(self.text, at),
                Raw::LParen => depth += 1,
                _ if depth == 0 => return Arguments::None,
                Raw::RParen if depth == 1 => return Arguments::Until(end),
                Raw::RParen => depth -= 1,
                Raw::OpenStr => next = broken_string(self.text, at).unwrap_or(end),
                _ => {}
            }
            line_start &= matches!(kind, Raw::Space | Raw::BlockComment | Raw::Newline);
            line_start |= kind == Raw::Hash && next > end;
            at = next;
        }
        if depth == 0 { Arguments::None } else { Arguments::Endless }
    }

    /// Handles the directive whose `#` is at `at`.
    fn directive(&mut self) {
        let hash = self.at;
        let end = directive_end(self.text, hash);
        let words = words(self.text, hash, end);
        let span = Span::new(hash as u32, self.text.get(..end).map_or(hash, |t| t.trim_end().len()) as u32);
        let mut kind = Directive::Other;
        match words.first().copied().unwrap_or("") {
            "define" => self.macros.extend(words.get(1)),
            "include" => {
                let line = self.text.get(hash..end).unwrap_or("");
                self.includes |= !line.contains("stdosl.h");
            }
            "if" | "ifdef" | "ifndef" => {
                kind = Directive::If;
                self.conditionals.push(Conditional { opened: span, other: None });
            }
            word @ ("elif" | "else" | "endif") => {
                kind = if word == "endif" { Directive::Endif } else { Directive::Else };
                self.check_open(word, span);
            }
            _ => {}
        }
        // White space before the `#` is part of the directive; a comment before it is not.
        let before = self.text.get(self.line..hash).unwrap_or("");
        let start = if before.contains("*/") { hash } else { self.line };
        self.push_lines(kind, start, end);
        if words == ["if", "0"] {
            self.skip();
        }
    }

    fn check_open(&mut self, word: &str, span: Span) {
        match self.conditionals.last_mut() {
            Some(_) if word == "endif" => {
                self.conditionals.pop();
            }
            Some(Conditional { other: other @ None, .. }) => *other = (word == "else").then_some(span),
            open => {
                let other = open.and_then(|o| o.other);
                self.found.push(errors::unbalanced_conditional(span, word, other));
            }
        }
    }

    /// Keeps the text after `#if 0` up to the directive that ends it.
    fn skip(&mut self) {
        let from = self.at;
        let (mut at, mut line, mut line_start, mut inner) = (from, from, true, 0usize);
        while let Some((kind, end)) = scan(self.text, at) {
            match kind {
                Raw::Newline => (line, line_start) = (end, true),
                Raw::Space | Raw::BlockComment => {}
                Raw::Hash if line_start => {
                    line_start = false;
                    match words(self.text, at, self.text.len()).first().copied().unwrap_or("") {
                        "if" | "ifdef" | "ifndef" => inner += 1,
                        "endif" | "else" | "elif" if inner == 0 => break,
                        "endif" => inner -= 1,
                        _ => {}
                    }
                }
                _ => line_start = false,
            }
            at = end;
        }
        if line > from {
            self.push_lines(Directive::Other, from, line);
        }
    }
}

enum Arguments {
    /// No `(` follows.
    None,
    /// The end of the `)`.
    Until(usize),
    /// The text ends before them.
    Endless,
}

/// The end of the directive whose `#` is at `at`, including its line break.
fn directive_end(text: &str, mut at: usize) -> usize {
    while let Some((kind, end)) = scan(text, at) {
        at = match kind {
            Raw::Newline => return end,
            Raw::OpenStr => broken_string(text, at).unwrap_or(end),
            _ => end,
        };
    }
    text.len()
}

/// The first words of a directive after its `#`, at most three.
fn words(text: &str, hash: usize, end: usize) -> Vec<&str> {
    let mut words = Vec::new();
    let mut at = hash + 1;
    while at < end && words.len() < 3 {
        let Some((kind, next)) = scan(text, at) else { break };
        match kind {
            Raw::Newline => break,
            Raw::Space | Raw::LineComment | Raw::BlockComment => {}
            _ => words.extend(text.get(at..next)),
        }
        at = next;
    }
    words
}

/// A line comment without trailing white space, unless removing it would change the comment's meaning.
fn line_comment(text: &str, is_last: bool) -> &str {
    let text = if is_last { text.trim_end_matches(['\n', '\r']) } else { text.trim_end_matches('\r') };
    let trimmed = text.trim_end();
    if trimmed.ends_with('\\') { text } else { trimmed }
}

/// Whether a name is written like a macro: at least two capitals, digits and underscores.
fn is_capitals(name: &str) -> bool {
    name.len() > 1
        && name.bytes().any(|b| b.is_ascii_uppercase())
        && !name.bytes().any(|b| b.is_ascii_lowercase())
}
