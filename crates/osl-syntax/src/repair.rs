//! Repairs files with missing brackets or semicolons: finds the fewest insertions that make a file parse.
//!
//! It is a best-first search (A*) over insertions. A state is the stream with some tokens inserted. The
//! parser tells where it fails and which tokens it expects there; each expected bracket or `;` is a step,
//! inserted where the parser fails. A `}` may also be inserted before an earlier declaration at the left
//! margin, because a missing brace can swallow a function. The number of unmatched brackets is a lower bound
//! on the remaining cost. All budgets count tokens, not seconds, so that the result is the same on every
//! machine.

mod place;

use crate::Options;
use crate::ast::Ast;
use crate::brackets::{Brackets, closer};
use crate::diagnostic::{Diagnostic, Edit, Fix};
use crate::errors;
use crate::parser::{Failure, Stream, parse_once};
use crate::source::{SourceMap, SourceProvider};
use crate::span::Span;
use crate::token::Token;
use rustc_hash::FxHashSet;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A search that only improves a message may use the budget divided by this.
const MESSAGE_PART: u64 = 4;

/// Maximum number of insertions.
const MAX_INSERTIONS: usize = 24;

/// Cost of an insertion.
const INSERTION: u32 = 8;

/// Additional cost of an insertion in the middle of a line.
const MID_LINE: u32 = 3;

/// Subtracted for a `}` before a declaration at the left margin.
const AT_MARGIN: u32 = 1;

/// Subtracted for a `}` where the indentation ends its block.
const BY_INDENTATION: u32 = 2;

/// A repaired file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Repair {
    /// The insertions, in order of position; spans refer to the original file.
    pub edits: Vec<Edit>,
    /// The text with the insertions.
    pub text: String,
    /// What each insertion that ends the statement of a condition or loop makes of it: the position in the
    /// original file of the condition or loop, and a sentence.
    pub changes: Vec<(Span, String)>,
}

/// Finds the fewest insertions of `)` `]` `}` `{` `;` that make a file parse. `None` if it parses already, if
/// it has other errors, or if the search exceeds its budget.
pub fn repair(name: &str, text: &str, provider: &dyn SourceProvider, options: &Options) -> Option<Repair> {
    let text = &*crate::source::with_line_ends(text);
    let mut pre = crate::preprocess::preprocess(name, text, provider, options);
    let (tokens, spans) = crate::token::convert(&pre.tokens, &pre.names, &mut pre.diagnostics);
    if pre.diagnostics.list.iter().any(Diagnostic::is_error) {
        return None;
    }
    let end = text.len() as u32;
    let stream = Stream { tokens, spans, end: Span::new(end, end) };
    let found = search(&stream, text, options, options.limits.reading.repair)?;
    let edits = place::edits(&stream, text, &found.insertions);
    let changes = place::changes(&stream, text, &found.insertions);
    let text = apply(text, &edits)?;
    let parsed = crate::parse(name, &text, provider, options);
    (!parsed.has_errors()).then_some(Repair { edits, text, changes })
}

/// Applies edits, which must be in the text and in order of position.
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

/// One insertion: the token, and the index of the original token before which it goes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Insertion {
    before: usize,
    token: Token,
}

/// A state of the search: the insertions so far, and their cost.
struct State {
    insertions: Vec<Insertion>,
    cost: u32,
}

/// A stream with its insertions; those at one position keep their order.
struct Patched {
    stream: Stream,
    /// For each token, and for the end, its index in the original stream.
    origin: Vec<usize>,
}

impl Patched {
    fn new(stream: &Stream, insertions: &[Insertion]) -> Self {
        let mut sorted: Vec<&Insertion> = insertions.iter().collect();
        sorted.sort_by_key(|i| i.before);
        let mut patched = Self {
            stream: Stream { tokens: Vec::new(), spans: Vec::new(), end: stream.end },
            origin: Vec::new(),
        };
        let mut from = 0;
        for insertion in sorted {
            patched.copy(stream, from, insertion.before);
            from = insertion.before;
            let place = stream.spans.get(from).copied().unwrap_or(stream.end);
            patched.stream.tokens.push(insertion.token.clone());
            patched.stream.spans.push(Span::new(place.start, place.start));
            patched.origin.push(from);
        }
        patched.copy(stream, from, stream.tokens.len());
        patched.origin.push(stream.tokens.len());
        patched
    }

    fn copy(&mut self, stream: &Stream, from: usize, to: usize) {
        self.stream.tokens.extend_from_slice(stream.tokens.get(from..to).unwrap_or_default());
        self.stream.spans.extend_from_slice(stream.spans.get(from..to).unwrap_or_default());
        self.origin.extend(from..to);
    }
}

/// A stream that parses after insertions.
struct Repaired {
    insertions: Vec<Insertion>,
    ast: Ast,
    diagnostics: Vec<Diagnostic>,
}

/// Explains a stream that does not parse by missing tokens: one error for each position, the first with the
/// fix. `None` if no insertions make it parse.
pub(crate) fn explain(
    stream: &Stream,
    text: &str,
    options: &Options,
    sources: &SourceMap,
) -> Option<(Ast, Vec<Diagnostic>)> {
    let Repaired { insertions, ast, mut diagnostics } =
        search(stream, text, options, options.limits.reading.repair / MESSAGE_PART)?;
    let mut sorted = insertions.clone();
    sorted.sort_by_key(|i| i.before);
    let unclosed = place::unclosed_blocks(stream, text);
    let mut errors = Vec::new();
    let mut made = 0;
    for site in sorted.chunk_by(|a, b| a.before == b.before) {
        let so_far = Patched::new(stream, sorted.get(..made).unwrap_or_default()).stream;
        if let Err((failure, _)) = parse_once(&so_far, options) {
            if crate::parser::beyond_insertion(&so_far, &failure, sources).is_some() {
                // No insertion is the reason.
                return None;
            }
            let ends = site.iter().filter(|i| i.token == Token::RBrace);
            let ended = ends.filter_map(|i| unclosed.iter().find(|(_, before)| *before == i.before)).next();
            let place = |at: &usize| stream.spans.get(*at).copied().unwrap_or(stream.end);
            errors.push(match ended {
                Some((opener, before)) => errors::unclosed_block(place(opener), place(before)),
                None => crate::parser::message(&so_far, &failure, sources),
            });
        }
        made += site.len();
    }
    errors.dedup();
    let edits = place::edits(stream, text, &insertions);
    let only_semicolons = insertions.iter().all(|i| i.token == Token::Semi)
        && errors.iter().all(|error| error.fixes.len() == 1);
    if let Some(first) = errors.first_mut().filter(|_| !only_semicolons) {
        // It is a guess, so it is offered but not applied.
        first.fixes = vec![Fix { title: "insert what is missing".to_owned(), edits, safe: false }];
        for error in errors.iter_mut().skip(1) {
            error.fixes.clear();
            error.help.get_or_insert_with(|| "the edit above repairs this too".into());
        }
    }
    diagnostics.extend(errors);
    let mut ast = ast;
    guessed(stream, text, &insertions).into_iter().for_each(|gap| ast.gaps.add(gap));
    Some((ast, diagnostics))
}

/// The parts of the file about which insertions are a guess: the statement around a parenthesis, the tokens
/// beside a `;` in the middle of a line, and the position of any other token.
fn guessed(stream: &Stream, text: &str, insertions: &[Insertion]) -> Vec<Span> {
    let ends = |token: &Token| matches!(token, Token::Semi | Token::LBrace | Token::RBrace);
    let span = |at: usize| stream.spans.get(at).copied();
    let around = |insertion: &Insertion| {
        let at = insertion.before;
        let here = span(at).unwrap_or(stream.end).start;
        let here = span(at.wrapping_sub(1)).map_or(here, |before| before.end.min(here));
        let point = Span::new(here, here);
        match insertion.token {
            Token::RParen | Token::RBracket => {
                let before = stream.tokens.get(..at).unwrap_or_default();
                let first = before.iter().rposition(ends).map_or(0, |n| n + 1);
                let after = stream.tokens.get(at..).unwrap_or_default();
                let last = at + after.iter().position(ends).unwrap_or(after.len());
                let edges = [span(first), last.checked_sub(1).and_then(span)];
                edges.into_iter().flatten().fold(point, Span::to)
            }
            Token::Semi if !place::ends_line(stream, at, text) => {
                let edges = [at.checked_sub(1).and_then(span), span(at)];
                edges.into_iter().flatten().fold(point, Span::to)
            }
            _ => point,
        }
    };
    insertions.iter().map(around).collect()
}

/// The fewest insertions that make a stream parse; `None` if it parses already, or if none are found.
fn search(stream: &Stream, text: &str, options: &Options, budget: u64) -> Option<Repaired> {
    let mut states = vec![Some(State { insertions: Vec::new(), cost: 0 })];
    let mut queue = BinaryHeap::from([(Reverse(0), 0, Reverse(0))]);
    let mut seen = FxHashSet::default();
    let mut work: u64 = 0;
    while let Some((_, _, Reverse(id))) = queue.pop() {
        let Some(state) = states.get_mut(id).and_then(Option::take) else { continue };
        let patched = Patched::new(stream, &state.insertions);
        let failure = match parse_once(&patched.stream, options) {
            Ok((ast, found))
                if !found.list.iter().any(Diagnostic::is_error) && !state.insertions.is_empty() =>
            {
                return Some(Repaired { insertions: state.insertions, ast, diagnostics: found.list });
            }
            Ok(_) => continue,
            Err((failure, _)) => failure,
        };
        let brackets = Brackets::of(&patched.stream.tokens);
        if state.insertions.is_empty() && !worth_a_search(&patched.stream, &failure, &brackets, text) {
            return None;
        }
        let around: Vec<usize> = brackets.around(failure.at).collect();
        let key = (patched.origin.get(failure.at).copied(), around.len(), failure.expected.clone());
        if !seen.insert(key) || state.insertions.len() >= MAX_INSERTIONS {
            continue;
        }
        if state.insertions.is_empty() {
            let ends = place::unclosed_blocks(stream, text).into_iter();
            let insertions: Vec<Insertion> =
                ends.map(|(_, before)| Insertion { before, token: Token::RBrace }).collect();
            let rest = Brackets::of(&Patched::new(stream, &insertions).stream.tokens).n_lonely;
            // They must be what is missing.
            if (1..=MAX_INSERTIONS).contains(&insertions.len())
                && rest + insertions.len() == brackets.n_lonely
            {
                let cost = insertions.len() as u32 * (INSERTION - BY_INDENTATION);
                queue.push((Reverse(cost + rest as u32 * INSERTION), failure.at, Reverse(states.len())));
                states.push(Some(State { insertions, cost }));
            }
        }
        for (at, token, cost) in steps(&patched.stream, &failure, &around, text) {
            work += stream.tokens.len() as u64 + 1;
            let Some(before) = patched.origin.get(at).copied().filter(|_| work <= budget) else { continue };
            let mut next = State { insertions: state.insertions.clone(), cost: state.cost + cost };
            next.insertions.push(Insertion { before, token });
            let brackets = Brackets::of(&Patched::new(stream, &next.insertions).stream.tokens);
            let least = brackets.n_lonely as u32 * INSERTION;
            queue.push((Reverse(next.cost + least), failure.at, Reverse(states.len())));
            states.push(Some(next));
        }
    }
    None
}

/// Whether anything seems to be missing: a bracket has no partner, or a line ends where a `;` would fit.
fn worth_a_search(stream: &Stream, failure: &Failure, brackets: &Brackets, text: &str) -> bool {
    let semicolon = failure.expected.iter().any(|e| e == "\";\"");
    brackets.n_lonely > 0 || (semicolon && place::ends_line(stream, failure.at, text))
}

/// The insertions to try: position in the stream, token, cost.
fn steps(stream: &Stream, failure: &Failure, around: &[usize], text: &str) -> Vec<(usize, Token, u32)> {
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
        // A closing bracket must close something.
        let useless = match token {
            Token::LBrace | Token::Semi => false,
            _ => around.is_empty(),
        };
        if failure.expected.iter().any(|e| e == name) && !useless && place::is_plain(stream, at, text) {
            let mid = if place::ends_line(stream, at, text) { 0 } else { MID_LINE };
            steps.push((at, token, INSERTION + mid));
        }
    }
    // The error may be detected one token late: in `a[2 = {` the parser has taken the `=` for an assignment.
    if let Some(token) = around.first().and_then(|o| stream.tokens.get(*o)).and_then(closer)
        && let Some(before) = at.checked_sub(1)
        && around.first() < Some(&before)
        && place::is_plain(stream, before, text)
    {
        steps.push((before, token, INSERTION + 2 * MID_LINE));
    }
    if let Some(outermost) = around.last()
        && let Some(margin) = place::next_at_margin(stream, *outermost, at, text)
        && margin < at
    {
        steps.push((margin, Token::RBrace, INSERTION - AT_MARGIN));
    }
    steps
}
