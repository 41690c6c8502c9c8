//! Repair of files that lost brackets or semicolons: the fewest insertions that make a file parse.
//!
//! A best-first search (A*) over insertions. A state is the stream with some tokens inserted; the parser tells where
//! it fails and what it expects there, and each bracket or `;` that it expects is a step, inserted where it fails. A
//! `}` may also go before an earlier declaration at the left margin, where a lost brace has swallowed a function. The
//! brackets still without a partner are what a state costs at least. All budgets count tokens, not seconds, so that
//! the answer is the same on every machine.

mod place;

use crate::Options;
use crate::ast::Ast;
use crate::brackets::{Brackets, closer};
use crate::diagnostic::{Diagnostic, Edit, Fix};
use crate::parser::{Failure, Stream, parse_once};
use crate::source::{SourceMap, SourceProvider};
use crate::span::Span;
use crate::token::Token;
use rustc_hash::FxHashSet;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Tokens that a search may read when repair was asked for: some tenths of a second.
const WORK: usize = 1 << 21;

/// Tokens that a search may read for the sake of a better message.
const WORK_FOR_MESSAGE: usize = 1 << 19;

/// Insertions, at most.
const MAX_INSERTIONS: usize = 24;

/// Cost of an insertion.
const INSERTION: u32 = 8;

/// Added for an insertion in the middle of a line.
const MID_LINE: u32 = 3;

/// Taken off for a `}` before a declaration at the left margin.
const AT_MARGIN: u32 = 1;

/// A repaired file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Repair {
    /// The insertions, in order of position; spans are those of the file as it was.
    pub edits: Vec<Edit>,
    /// The text with the insertions made.
    pub text: String,
}

/// Finds the fewest insertions of `)` `]` `}` `{` `;` that make a file parse. `None` when it parses as it is, when
/// something else is wrong with it, or when the search exceeds its budget.
pub fn repair(name: &str, text: &str, provider: &dyn SourceProvider, options: &Options) -> Option<Repair> {
    let mut pre = crate::preprocess::preprocess(name, text, provider, options);
    let (tokens, spans) = crate::token::convert(&pre.tokens, &pre.names, &mut pre.diagnostics);
    if pre.diagnostics.iter().any(Diagnostic::is_error) {
        return None;
    }
    let end = text.len() as u32;
    let stream = Stream { tokens, spans, end: Span::new(end, end) };
    let found = search(&stream, text, options, WORK)?;
    let edits = place::edits(&stream, text, &found.insertions);
    let text = apply(text, &edits)?;
    let parsed = crate::parse(name, &text, provider, options);
    (!parsed.has_errors()).then_some(Repair { edits, text })
}

/// Makes edits, which must lie in the text in order of position.
pub fn apply(text: &str, edits: &[Edit]) -> Option<String> {
    let mut out = String::with_capacity(text.len());
    let mut at = 0;
    for edit in edits {
        out.push_str(text.get(at..edit.span.start as usize)?);
        out.push_str(&edit.text);
        at = edit.span.end as usize;
    }
    out.push_str(text.get(at..)?);
    Some(out)
}

/// One insertion: before which token of the stream as it was, and what.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Insertion {
    before: usize,
    token: Token,
}

/// A state of the search.
struct State {
    stream: Stream,
    /// For each token of `stream` its index in the stream as it was.
    origin: Vec<usize>,
    insertions: Vec<Insertion>,
    cost: u32,
}

/// A stream that parses after insertions.
struct Found {
    insertions: Vec<Insertion>,
    ast: Ast,
    diagnostics: Vec<Diagnostic>,
}

/// Explains a stream that does not parse by what was lost: one error for each place where something is missing, the
/// first with the fix. `None` when no insertions make it parse.
pub(crate) fn explain(
    stream: &Stream,
    text: &str,
    options: &Options,
    sources: &SourceMap,
) -> Option<(Ast, Vec<Diagnostic>)> {
    let Found { insertions, ast, mut diagnostics } = search(stream, text, options, WORK_FOR_MESSAGE)?;
    let mut sorted: Vec<&Insertion> = insertions.iter().collect();
    sorted.sort_by_key(|i| i.before);
    let mut stream_so_far = stream.clone();
    let mut errors = Vec::new();
    for site in sorted.chunk_by(|a, b| a.before == b.before) {
        if let Err((failure, _)) = parse_once(&stream_so_far, options.strict, options.max_nesting) {
            errors.push(crate::parser::message(&stream_so_far, &failure, sources));
        }
        for insertion in site {
            let shift = stream_so_far.tokens.len() - stream.tokens.len();
            let at = insertion.before + shift;
            let place = stream_so_far.spans.get(at).copied().unwrap_or(stream.end);
            stream_so_far.tokens.insert(at, insertion.token.clone());
            stream_so_far.spans.insert(at, Span::new(place.start, place.start));
        }
    }
    errors.dedup();
    let edits = place::edits(stream, text, &insertions);
    if let Some(first) = errors.first_mut() {
        // A guess, so it is offered and not made.
        first.fixes = vec![Fix { title: "insert what is missing".to_owned(), edits }];
        errors.iter_mut().skip(1).for_each(|e| e.fixes.clear());
    }
    diagnostics.extend(errors);
    Some((ast, diagnostics))
}

/// The fewest insertions that make a stream parse; `None` when it does as it is, or when none are found.
fn search(stream: &Stream, text: &str, options: &Options, budget: usize) -> Option<Found> {
    let origin = (0..=stream.tokens.len()).collect();
    let mut states = vec![Some(State { stream: stream.clone(), origin, insertions: Vec::new(), cost: 0 })];
    let mut queue = BinaryHeap::from([(Reverse(0), 0, Reverse(0))]);
    let mut seen = FxHashSet::default();
    let mut work = 0;
    while let Some((_, _, Reverse(id))) = queue.pop() {
        let Some(state) = states.get_mut(id).and_then(Option::take) else { continue };
        work += state.stream.tokens.len() + 1;
        let failure = match parse_once(&state.stream, options.strict, options.max_nesting) {
            Ok((ast, diagnostics))
                if !diagnostics.iter().any(Diagnostic::is_error) && !state.insertions.is_empty() =>
            {
                return Some(Found { insertions: state.insertions, ast, diagnostics });
            }
            Ok(_) => continue,
            Err((failure, _)) => failure,
        };
        let brackets = Brackets::of(&state.stream.tokens);
        if state.insertions.is_empty() && !worth_a_search(&state, &failure, &brackets, text) {
            return None;
        }
        let around: Vec<usize> = brackets.around(failure.at).collect();
        let key = (state.origin.get(failure.at).copied(), around.len(), failure.expected.clone());
        if !seen.insert(key) || state.insertions.len() >= MAX_INSERTIONS || work > budget {
            continue;
        }
        for (at, token, cost) in steps(&state, &failure, &around, text) {
            let Some(next) = insert(&state, at, token, cost) else { continue };
            let least = Brackets::of(&next.stream.tokens).n_lonely as u32 * INSERTION;
            queue.push((Reverse(next.cost + least), failure.at, Reverse(states.len())));
            states.push(Some(next));
        }
    }
    None
}

/// Whether something seems to be lost at all: a bracket has no partner, or a line ends where a `;` would fit.
fn worth_a_search(state: &State, failure: &Failure, brackets: &Brackets, text: &str) -> bool {
    let semicolon = failure.expected.iter().any(|e| e == "\";\"");
    brackets.n_lonely > 0 || (semicolon && place::ends_line(&state.stream, failure.at, text))
}

/// The insertions worth trying: place in the stream, token, cost.
fn steps(state: &State, failure: &Failure, around: &[usize], text: &str) -> Vec<(usize, Token, u32)> {
    let kinds = [
        ("\")\"", Token::RParen),
        ("\"]\"", Token::RBracket),
        ("\"}\"", Token::RBrace),
        ("\"{\"", Token::LBrace),
        ("\";\"", Token::Semi),
    ];
    let at = failure.at;
    let mut steps = Vec::new();
    for (name, token) in kinds {
        // A closer must have something to close.
        let useless = match token {
            Token::LBrace | Token::Semi => false,
            _ => around.is_empty(),
        };
        if failure.expected.iter().any(|e| e == name) && !useless && place::is_plain(&state.stream, at, text)
        {
            let mid = if place::ends_line(&state.stream, at, text) { 0 } else { MID_LINE };
            steps.push((at, token, INSERTION + mid));
        }
    }
    // What fits nothing may be a token late: in `a[2 = {` the parser has taken the `=` for an assignment.
    if let Some(token) = around.first().and_then(|o| state.stream.tokens.get(*o)).and_then(closer)
        && let Some(before) = at.checked_sub(1)
        && around.first() < Some(&before)
        && place::is_plain(&state.stream, before, text)
    {
        steps.push((before, token, INSERTION + 2 * MID_LINE));
    }
    if let Some(outermost) = around.last()
        && let Some(margin) = place::next_at_margin(&state.stream, *outermost, at, text)
        && margin < at
    {
        steps.push((margin, Token::RBrace, INSERTION - AT_MARGIN));
    }
    steps
}

fn insert(state: &State, at: usize, token: Token, cost: u32) -> Option<State> {
    let before = *state.origin.get(at)?;
    let mut stream = state.stream.clone();
    let place = stream.spans.get(at).copied().unwrap_or(stream.end);
    let mut origin = state.origin.clone();
    stream.tokens.insert(at, token.clone());
    stream.spans.insert(at, Span::new(place.start, place.start));
    origin.insert(at, before);
    let mut insertions = state.insertions.clone();
    insertions.push(Insertion { before, token });
    Some(State { stream, origin, insertions, cost: state.cost + cost })
}
