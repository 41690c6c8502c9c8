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
pub mod escape;
pub mod format;
mod lexer;
mod parser;
mod preprocess;
pub mod print;
pub mod render;
pub mod repair;
pub mod source;
pub mod span;
pub mod spelling;
pub mod token;

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
    /// Every mistake, once.
    #[default]
    Once,
    /// As often as the reference reports it, for scripts that count its lines: nothing after the first syntax error, one
    /// error for each format, and an expression with an error once more where it is assigned, returned or passed.
    AsReference,
}

/// How to read a file, and how much of it.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Accept exactly what `oslc` accepts: quirks are errors.
    pub strict: bool,
    /// How often a mistake is reported.
    pub reports: Reports,
    /// Macros to define first, as `-Dname=value` does.
    pub defines: Vec<(String, String)>,
    /// Whether [`Parsed::tokens`] is wanted.
    pub keep_tokens: bool,
    /// What reading may cost. All of it is counted, not timed: the answer is the same on every machine.
    pub limits: Limits,
}

/// What became of a file. With an error among the diagnostics the tree may have holes.
#[derive(Debug)]
pub struct Parsed {
    /// The tree.
    pub ast: Ast,
    /// The files that were read; the first is the main file.
    pub sources: SourceMap,
    /// The tokens that the grammar saw, with their places, if [`Options::keep_tokens`] asks for them.
    pub tokens: Vec<(Token, Span)>,
    /// What is wrong, in order of position.
    pub diagnostics: Vec<Diagnostic>,
    /// Lines on which `#pragma osl nowarn` drops warnings, also those of later stages.
    pub nowarn: Vec<Span>,
    /// What stands before the first syntax error.
    before_error: Option<Ast>,
    /// Whether preprocessing met no error.
    preprocessed: bool,
}

impl Parsed {
    /// Whether a diagnostic is a warning that `#pragma osl nowarn` drops.
    pub fn is_silenced(&self, d: &Diagnostic) -> bool {
        !d.is_error() && self.nowarn.iter().any(|s| s.start <= d.span.start && d.span.start < s.end)
    }

    /// The declarations that can be resolved in spite of errors: all, or those before the first syntax error, with
    /// whether they are all. `None` where preprocessing failed: names would be missing that nobody forgot.
    pub fn sound(&self) -> Option<(&Ast, bool)> {
        match (&self.before_error, self.preprocessed) {
            (_, false) => None,
            (Some(before), true) => Some((before, false)),
            (None, true) => Some((&self.ast, true)),
        }
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
    // Nothing is made of a file that is too large.
    let raw = if pre.stopped { Vec::new() } else { std::mem::take(&mut pre.tokens) };
    let (tokens, spans) = token::convert(&raw, &pre.names, &mut pre.diagnostics);
    drop(raw);
    let end = text.len() as u32;
    let stream = Stream { tokens, spans, end: Span::new(end, end) };
    let listed = if options.keep_tokens { stream.tokens.len() } else { 0 };
    let listing = stream.tokens.iter().cloned().zip(stream.spans.iter().copied()).take(listed).collect();
    let whole = !pre.diagnostics.list.iter().any(Diagnostic::is_error);
    let lost = whole.then(|| repair::explain(&stream, text, options, &pre.sources)).flatten();
    let (ast, before_error, mut diagnostics) = match lost {
        Some((ast, diagnostics)) => (ast, parser::before_failure(&stream, options), diagnostics),
        None => parser::parse(stream, options, &pre.sources),
    };
    let stop = diagnostics.iter().filter(|d| errors::is_of_syntax(d)).map(|d| d.span.start).min();
    if let Some(stop) = stop.filter(|_| options.reports == Reports::AsReference) {
        let mut first = true;
        diagnostics.retain(|d| {
            d.span.start < stop
                || (errors::is_of_syntax(d) && d.span.start == stop && std::mem::take(&mut first))
        });
    }
    let preprocessed = !pre.stopped && !pre.diagnostics.list.iter().any(Diagnostic::is_error);
    let mut found = pre.diagnostics;
    if !pre.stopped {
        let told = lines_with_errors(&found.list, &pre.sources);
        diagnostics.into_iter().filter(|d| !is_echo(d, &told, &pre.sources)).for_each(|d| found.push(d));
    }
    let mut parsed = Parsed {
        ast,
        sources: pre.sources,
        tokens: listing,
        diagnostics: Vec::new(),
        nowarn: pre.nowarn,
        before_error,
        preprocessed,
    };
    if !found.list.iter().any(|d| d.code == errors::TOO_MANY_ERRORS) {
        found.list.extend(
            found.dropped.map(|span| errors::too_many_errors(span, options.limits.reading.diagnostics)),
        );
    }
    found.list.retain(|d| !parsed.is_silenced(d));
    found.list.sort_by_key(|d| d.span.start);
    parsed.diagnostics = found.list;
    parsed
}

/// The text of a file after preprocessing: what macros and includes make of it, line by line.
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

/// What was said before parsing: lines with an error, and from where on text was swallowed by an open comment or the
/// open arguments of a macro.
struct Told {
    lines: Vec<(String, u32)>,
    swallowed_from: u32,
}

fn lines_with_errors(found: &[Diagnostic], sources: &SourceMap) -> Told {
    let open = [errors::UNTERMINATED_COMMENT, errors::UNTERMINATED_INVOCATION];
    let errors = || found.iter().filter(|d| d.is_error());
    Told {
        lines: errors().filter_map(|d| sources.place(d.span)).map(|p| (p.file, p.line)).collect(),
        swallowed_from: errors()
            .filter(|d| open.contains(&d.code))
            .map(|d| d.span.start)
            .min()
            .unwrap_or(u32::MAX),
    }
}

/// Whether a syntax error only repeats what was said before parsing.
fn is_echo(d: &Diagnostic, told: &Told, sources: &SourceMap) -> bool {
    let syntax = [errors::SYNTAX, errors::UNCLOSED, errors::STRAY_CLOSER].contains(&d.code);
    let line = sources.place(d.span).map(|p| (p.file, p.line));
    syntax && (d.span.start >= told.swallowed_from || line.is_some_and(|l| told.lines.contains(&l)))
}

/// A provider that finds no file: for text that includes none but the standard header.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl SourceProvider for NoFiles {
    fn include(&self, _: &str, _: bool, _: &str) -> Result<(String, std::sync::Arc<str>), String> {
        Err("no such file".to_owned())
    }
}
