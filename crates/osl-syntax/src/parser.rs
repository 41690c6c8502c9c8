//! From tokens to the tree: runs the generated parser, explains errors, cuts out the smallest construct
//! around an error and continues after it.

mod expected;
mod foreign;
mod recover;
mod slips;
mod words;

pub(crate) use expected::message;
pub(crate) use foreign::beyond_insertion;

use crate::Options;
use crate::ast::Ast;
use crate::builder::Builder;
use crate::diagnostic::{Diagnostic, Sink};
use crate::errors;
use crate::gaps::Gaps;
use crate::source::SourceMap;
use crate::span::Span;
use crate::token::Token;
use lalrpop_util::ParseError;

#[expect(
    unreachable_pub,
    clippy::panic,
    clippy::unwrap_used,
    reason = "lalrpop's output is not ours to shape"
)]
mod grammar {
    lalrpop_util::lalrpop_mod!(generated, "/grammar.rs");
    pub(crate) use generated::UnitParser;
}

/// Tokens with their locations; the last location is the end of the text.
#[derive(Clone, Debug)]
pub(crate) struct Stream {
    pub(crate) tokens: Vec<Token>,
    pub(crate) spans: Vec<Span>,
    /// The end of the text.
    pub(crate) end: Span,
}

/// Why a parse ended early.
#[derive(Clone, Debug)]
pub(crate) struct Failure {
    /// The token that does not fit; at the end of the text, the number of tokens.
    pub(crate) at: usize,
    /// Terminals of the grammar that would fit.
    pub(crate) expected: Vec<String>,
}

/// One run of the parser, without recovery.
pub(crate) fn parse_once(stream: &Stream, options: &Options) -> Result<(Ast, Sink), (Failure, Sink)> {
    match run(stream, options) {
        (ast, found, None) => Ok((ast, found)),
        (_, found, Some(failure)) => Err((failure, found)),
    }
}

/// The declarations before the first failure, as the reference reads them; all of them if there is none.
pub(crate) fn before_failure(stream: &Stream, options: &Options) -> Ast {
    let (mut before, _, failure) = run(stream, options);
    if let Some(failure) = failure {
        let at = stream.spans.get(failure.at).copied().unwrap_or(stream.end);
        before.gaps.add(Span::new(at.start, stream.end.end.max(at.start)));
    }
    before
}

/// One run of the parser. If it fails, the tree contains the declarations before the failure.
fn run(stream: &Stream, options: &Options) -> (Ast, Sink, Option<Failure>) {
    let mut builder = Builder::new(&stream.tokens, &stream.spans, options);
    let tokens = stream.tokens.iter().enumerate().map(|(n, t)| (n as u32, t.clone(), n as u32 + 1));
    let failure = grammar::UnitParser::new().parse(&mut builder, tokens).err().map(|e| {
        let (at, expected) = match e {
            ParseError::UnrecognizedToken { token, expected } => (token.0 as usize, expected),
            ParseError::UnrecognizedEof { expected, .. } => (stream.tokens.len(), expected),
            ParseError::ExtraToken { token } => (token.0 as usize, Vec::new()),
            ParseError::InvalidToken { location } => (location as usize, Vec::new()),
            ParseError::User { .. } => (stream.tokens.len(), Vec::new()),
        };
        Failure { at, expected }
    });
    (builder.ast, builder.diagnostics, failure)
}

/// Parses with recovery: every error is reported, and the tree contains the sound parts and lists its gaps.
pub(crate) fn parse(mut stream: Stream, options: &Options, sources: &SourceMap) -> (Ast, Vec<Diagnostic>) {
    let mut reported = Vec::new();
    let mut gaps = Gaps::default();
    let mut furthest = None;
    let mut work: u64 = 0;
    loop {
        let (ast, found, failure) = run(&stream, options);
        let Some(failure) = failure else {
            reported.extend(found.list);
            reported.extend(
                found.dropped.map(|at| errors::too_many_errors(at, options.limits.reading.diagnostics)),
            );
            return (Ast { gaps, ..ast }, reported);
        };
        // A stand-in that does not fit repeats the previous error; the text after it was not read yet.
        let stand_in =
            matches!(stream.tokens.get(failure.at), Some(Token::Stray | Token::Bad | Token::BadExpr));
        let place = stream.spans.get(failure.at).copied().unwrap_or(stream.end);
        let told = stand_in
            || recover::is_echo(&stream, failure.at)
            || expected::unclosed_bracket(&stream, failure.at)
                .is_some_and(|opener| recover::may_be_closed(&stream, opener, failure.at));
        if !told && furthest.is_none_or(|f| f < place.start) {
            reported.push(expected::message(&stream, &failure, sources));
        }
        furthest = furthest.max(Some(place.start));
        work += stream.tokens.len() as u64;
        if reported.len() as u64 >= options.limits.reading.diagnostics {
            reported.push(errors::too_many_errors(place, options.limits.reading.diagnostics));
        } else if work < options.limits.reading.recovery {
            if !told
                && let Some(slip) = foreign::find(&stream, &failure, sources).filter(slips::Slip::has_remedy)
            {
                slips::mend(&mut stream, slip).into_iter().for_each(|place| gaps.add(place));
                continue;
            }
            if !told && let Some(before) = expected::lacks_semicolon(&stream, &failure, sources) {
                recover::insert_semicolon(&mut stream, failure.at, before, &mut gaps);
                continue;
            }
            if recover::cut(&mut stream, failure.at, &mut gaps) {
                continue;
            }
        }
        reported.extend(found.list);
        // Given up: the declarations before the failure are the tree, and the rest is a gap.
        let read = ast.items.last().map_or(0, |item| item.span().end);
        gaps.add_lost(Span::new(read, stream.end.end.max(read)), &stream.tokens);
        return (Ast { gaps, ..ast }, reported);
    }
}
