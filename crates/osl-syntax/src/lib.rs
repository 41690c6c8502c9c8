//! Open Shading Language, from text to syntax tree.
//!
//! The way of the data: [`source`] holds the text, the preprocessor turns it into tokens, the grammar
//! turns those into an [`ast`], and whatever is wrong becomes a [`diagnostic`]. This crate must not know
//! types, lanes, or the disk.

pub mod ast;
mod brackets;
mod builder;
pub mod diagnostic;
pub mod errors;
mod lexer;
mod parser;
mod preprocess;
pub mod print;
pub mod render;
pub mod repair;
pub mod source;
pub mod span;
pub mod token;

use ast::Ast;
use diagnostic::Diagnostic;
use parser::Stream;
use source::{SourceMap, SourceProvider};
use span::Span;
use token::Token;

/// How to read a file, and how much of it.
#[derive(Clone, Debug)]
pub struct Options {
    /// Accept exactly what `oslc` accepts: quirks are errors.
    pub strict: bool,
    /// Macros to define first, as `-Dname=value` does.
    pub defines: Vec<(String, String)>,
    /// Files within files, at most.
    pub max_include_depth: usize,
    /// Inclusions in all, at most.
    pub max_includes: usize,
    /// Tokens that macros may make in all.
    pub max_expansion: usize,
    /// Tokens of the file after preprocessing, at most.
    pub max_tokens: usize,
    /// Constructs within constructs, at most: what visits the tree may recurse.
    pub max_nesting: u32,
    /// Diagnostics, at most.
    pub max_diagnostics: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            strict: false,
            defines: Vec::new(),
            max_include_depth: 64,
            max_includes: 4096,
            max_expansion: 1 << 20,
            max_tokens: 1 << 22,
            max_nesting: 256,
            max_diagnostics: 64,
        }
    }
}

/// What became of a file. With an error among the diagnostics the tree may have holes.
#[derive(Debug)]
pub struct Parsed {
    /// The tree.
    pub ast: Ast,
    /// The files that were read; the first is the main file.
    pub sources: SourceMap,
    /// The tokens that the grammar saw, with their places.
    pub tokens: Vec<(Token, Span)>,
    /// What is wrong, in order of position.
    pub diagnostics: Vec<Diagnostic>,
    /// Lines on which `#pragma osl nowarn` drops warnings, also those of later stages.
    pub nowarn: Vec<Span>,
}

impl Parsed {
    /// Whether a diagnostic is a warning that `#pragma osl nowarn` drops.
    pub fn is_silenced(&self, d: &Diagnostic) -> bool {
        !d.is_error() && self.nowarn.iter().any(|s| s.start <= d.span.start && d.span.start < s.end)
    }

    /// Whether an error was found.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(Diagnostic::is_error)
    }
}

/// Reads a file into a tree. Never fails: whatever is wrong is among the diagnostics.
///
/// `name` is what diagnostics and `__FILE__` call the file, and what the provider sees as the including file.
pub fn parse(name: &str, text: &str, provider: &dyn SourceProvider, options: &Options) -> Parsed {
    let mut pre = preprocess::preprocess(name, text, provider, options);
    let (tokens, spans) = token::convert(&pre.tokens, &pre.names, &mut pre.diagnostics);
    let end = text.len() as u32;
    let stream = Stream { tokens, spans, end: Span::new(end, end) };
    let listing = stream.tokens.iter().cloned().zip(stream.spans.iter().copied()).collect();
    let whole = !pre.diagnostics.iter().any(Diagnostic::is_error);
    let lost = whole.then(|| repair::explain(&stream, text, options, &pre.sources)).flatten();
    let (ast, diagnostics) = lost.unwrap_or_else(|| parser::parse(stream, options, &pre.sources));
    let fresh =
        diagnostics.into_iter().filter(|d| !pre.stopped && !is_echo(d, &pre.diagnostics, &pre.sources));
    let fresh: Vec<_> = fresh.collect();
    pre.diagnostics.extend(fresh);
    let mut parsed =
        Parsed { ast, sources: pre.sources, tokens: listing, diagnostics: Vec::new(), nowarn: pre.nowarn };
    pre.diagnostics.retain(|d| !parsed.is_silenced(d));
    pre.diagnostics.sort_by_key(|d| d.span.start);
    pre.diagnostics.truncate(options.max_diagnostics + 1);
    parsed.diagnostics = pre.diagnostics;
    parsed
}

/// Whether a syntax error only repeats what was said before parsing: on the same line, or where an open comment or
/// the open arguments of a macro have swallowed the text.
fn is_echo(d: &Diagnostic, earlier: &[Diagnostic], sources: &SourceMap) -> bool {
    let line = |span| sources.place(span).map(|p| (p.file, p.line));
    let syntax = d.code == errors::SYNTAX || d.code == errors::UNCLOSED || d.code == errors::STRAY_CLOSER;
    syntax
        && earlier.iter().filter(|e| e.is_error()).any(|e| {
            let open = [errors::UNTERMINATED_COMMENT, errors::UNTERMINATED_INVOCATION].contains(&e.code);
            let swallowed = open && e.span.start <= d.span.start;
            swallowed || line(e.span) == line(d.span)
        })
}

/// A provider that finds no file: for text that includes none but the standard header.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl SourceProvider for NoFiles {
    fn include(&self, _: &str, _: bool, _: &str) -> Result<(String, std::sync::Arc<str>), String> {
        Err("no such file".to_owned())
    }
}
