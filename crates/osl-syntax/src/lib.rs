//! Reads Open Shading Language source and returns its syntax tree.
//!
//! This is the first step from a shader to pixels. [`source`] holds the text, the preprocessor turns it into
//! tokens, the grammar turns tokens into an [`ast`], and every mistake becomes a [`diagnostic`]. `parse`
//! never fails: even a broken file gives a tree of its sound parts. This crate must not know types, lanes, or
//! the disk.

pub mod ast;
mod brackets;
mod builder;
pub mod diagnostic;
pub mod encoding;
pub mod errors;
pub mod escape;
pub mod format;
pub mod gaps;
pub mod hidden;
mod layout;
mod lexer;
mod parser;
mod preprocess;
pub mod print;
pub mod render;
pub mod repair;
mod silenced;
pub mod source;
pub mod span;
pub mod spelling;
pub mod token;
mod words;

pub use silenced::Silenced;

use ast::Ast;
use diagnostic::Diagnostic;
use osl_limits::Limits;
use parser::Stream;
use source::{SourceMap, SourceProvider};
use span::Span;
use token::Token;

/// How often a mistake is reported.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reports {
    /// Every mistake once.
    #[default]
    Once,
    /// As often as the reference reports it, for scripts that count its lines: nothing after the first syntax
    /// error, one error for each format, an expression with an error once more where it is assigned, returned
    /// or passed, and errors of types in the shader only if there are no others.
    AsReference,
}

/// A version of the language. What differs is in `stdosl.h`, which asks for [`Version::numbers`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Version {
    /// 1.13, up to 1.15.1.
    #[default]
    V1_13,
    /// 1.15.2 and later.
    V1_15,
}

impl Version {
    /// The version with a short name, `1.13` or `1.15`.
    pub fn named(name: &str) -> Option<Version> {
        match name {
            "1.13" => Some(Version::V1_13),
            "1.15" => Some(Version::V1_15),
            _ => None,
        }
    }

    /// Major, minor and patch number: the values of the macros `OSL_VERSION_MAJOR` and so on.
    pub fn numbers(self) -> [u32; 3] {
        match self {
            Version::V1_13 => [1, 13, 12],
            Version::V1_15 => [1, 15, 2],
        }
    }

    /// The value of the macro `OSL_VERSION`.
    pub fn number(self) -> u32 {
        let [major, minor, patch] = self.numbers();
        10_000 * major + 100 * minor + patch
    }
}

/// How to read a file, and how much of it.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Accept exactly what `oslc` accepts: quirks are errors.
    pub strict: bool,
    /// The version of the language.
    pub version: Version,
    /// How often a mistake is reported.
    pub reports: Reports,
    /// Macros to define first, as `-Dname=value` does.
    pub defines: Vec<(String, String)>,
    /// Whether a quotient of two literals whose divisor is 0 is infinite instead of 0.
    pub infinite_quotients: bool,
    /// Whether to return [`Parsed::tokens`].
    pub keep_tokens: bool,
    /// Budgets for reading. They count work, not time, so the result is the same on every machine.
    pub limits: Limits,
}

/// The result of reading a file. If there is an error among the diagnostics, the tree may have gaps.
#[derive(Debug)]
pub struct Parsed {
    /// The tree.
    pub ast: Ast,
    /// The files that were read; the first is the main file.
    pub sources: SourceMap,
    /// The tokens that the grammar saw, with their locations, if [`Options::keep_tokens`] is set.
    pub tokens: Vec<(Token, Span)>,
    /// All diagnostics, in order of position.
    pub diagnostics: Vec<Diagnostic>,
    /// Lines on which `#pragma osl nowarn` suppresses warnings, also those of later stages.
    pub silenced: Silenced,
}

impl Parsed {
    /// Whether there is an error.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(Diagnostic::is_error)
    }
}

/// Reads a file into a tree. Never fails: every problem becomes a diagnostic.
///
/// `name` is the file's name in diagnostics and `__FILE__`, and the including file for the provider.
pub fn parse(name: &str, text: &str, provider: &dyn SourceProvider, options: &Options) -> Parsed {
    let text = &*source::with_line_ends(text);
    let mut pre = preprocess::preprocess(name, text, provider, options);
    // A file that is too large gives an empty tree.
    let raw = if pre.stopped { Vec::new() } else { std::mem::take(&mut pre.tokens) };
    let (tokens, spans) = token::convert(&raw, &pre.names, &mut pre.diagnostics);
    drop(raw);
    let end = text.len() as u32;
    let stream = Stream { tokens, spans, end: Span::new(end, end) };
    let listed = if options.keep_tokens { stream.tokens.len() } else { 0 };
    let listing = stream.tokens.iter().cloned().zip(stream.spans.iter().copied()).take(listed).collect();
    let whole = !pre.diagnostics.list.iter().any(Diagnostic::is_error);
    let lost = whole.then(|| repair::explain(&stream, text, options, &pre.sources)).flatten();
    let as_reference = options.reports == Reports::AsReference;
    let before = (as_reference && whole).then(|| parser::before_failure(&stream, options));
    let (mut ast, mut diagnostics) = match lost {
        Some((ast, diagnostics)) => (ast, diagnostics),
        None => parser::parse(stream, options, &pre.sources),
    };
    if as_reference {
        ast = before.unwrap_or_default();
        stop_at_first(&mut ast, &mut diagnostics, end);
    }
    if pre.stopped || pre.diagnostics.list.iter().any(errors::loses_text) || (as_reference && !whole) {
        ast.gaps.any_name = true;
    }
    let mut found = pre.diagnostics;
    pre.sources.files().iter().filter_map(errors::not_utf8).for_each(|d| found.push(d));
    if !pre.stopped {
        let told = lines_with_errors(&found.list, &pre.sources);
        diagnostics.into_iter().filter(|d| !is_echo(d, &told, &pre.sources)).for_each(|d| found.push(d));
    }
    let silenced = Silenced::new(pre.nowarn);
    let mut parsed = Parsed { ast, sources: pre.sources, tokens: listing, diagnostics: Vec::new(), silenced };
    if !found.list.iter().any(|d| d.code == errors::TOO_MANY_ERRORS) {
        found.list.extend(
            found.dropped.map(|span| errors::too_many_errors(span, options.limits.reading.diagnostics)),
        );
    }
    found.list.retain(|d| !parsed.silenced.hides(d));
    found.list.sort_by_key(|d| d.span.start);
    parsed.diagnostics = found.list;
    parsed
}

/// Keeps what the reference reads: the declarations and diagnostics before the first syntax error, and it.
fn stop_at_first(ast: &mut Ast, diagnostics: &mut Vec<Diagnostic>, end: u32) {
    let of_syntax = diagnostics.iter().filter(|d| errors::is_of_syntax(d));
    let Some(stop) = of_syntax.map(|d| d.span.start).min() else { return };
    let mut first = true;
    diagnostics.retain(|d| {
        d.span.start < stop || (errors::is_of_syntax(d) && d.span.start == stop && std::mem::take(&mut first))
    });
    let holds = |item: &ast::Item| item.span().start <= stop && stop < item.span().end;
    if let Some(n) = ast.items.iter().position(holds) {
        ast.items.truncate(n);
        ast.gaps.add(Span::new(stop, end.max(stop)));
    }
}

/// The names of the headers that come with the compiler.
pub fn header_names() -> impl Iterator<Item = &'static str> {
    preprocess::header_names()
}

/// The text of a file after preprocessing, with macros and includes expanded, line by line.
pub fn preprocessed(name: &str, text: &str, provider: &dyn SourceProvider, options: &Options) -> String {
    let pre = preprocess::preprocess(name, text, provider, options);
    let mut out = String::new();
    for token in &pre.tokens {
        match (out.is_empty(), token.line_start, token.space) {
            (false, true, _) => out.push('\n'),
            (false, false, true) => out.push(' '),
            _ => {}
        }
        out.push_str(pre.names.str(token.sym));
    }
    out.push('\n');
    out
}

/// Errors reported before parsing: the lines with an error, and the position from which an open comment or
/// the open arguments of a macro swallowed text.
struct EarlierErrors {
    lines: Vec<(String, u32)>,
    swallowed_from: u32,
}

fn lines_with_errors(found: &[Diagnostic], sources: &SourceMap) -> EarlierErrors {
    let open = [errors::UNTERMINATED_COMMENT, errors::UNTERMINATED_INVOCATION];
    let errors = || found.iter().filter(|d| d.is_error());
    EarlierErrors {
        lines: errors().filter_map(|d| sources.place(d.span)).map(|p| (p.file, p.line)).collect(),
        swallowed_from: errors()
            .filter(|d| open.contains(&d.code))
            .map(|d| d.span.start)
            .min()
            .unwrap_or(u32::MAX),
    }
}

/// Whether a syntax error only repeats an earlier error.
fn is_echo(d: &Diagnostic, told: &EarlierErrors, sources: &SourceMap) -> bool {
    let syntax = [errors::SYNTAX, errors::UNCLOSED, errors::STRAY_CLOSER].contains(&d.code);
    let line = sources.place(d.span).map(|p| (p.file, p.line));
    syntax && (d.span.start >= told.swallowed_from || line.is_some_and(|l| told.lines.contains(&l)))
}

/// A provider without files, for text that includes only the standard header.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl SourceProvider for NoFiles {
    fn include(&self, _: &str, _: bool, _: &str) -> Result<(String, std::sync::Arc<str>), String> {
        Err("no such file".to_owned())
    }
}
