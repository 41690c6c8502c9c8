//! Diagnostics as text for people.

use osl_job::request::Lints;
use osl_syntax::diagnostic::{Code, Diagnostic};
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::source::SourceMap;
use std::collections::BTreeMap;

/// Diagnostics with excerpts of the source. With the warnings that the user asks for, all others are only
/// counted, in a note: a run is repeated, and `check` shows them.
pub(super) fn text(
    list: &[Diagnostic],
    sources: &SourceMap,
    asked: Option<&Lints>,
) -> (String, Option<String>) {
    let is_shown = |d: &&Diagnostic| asked.is_none_or(|lints| d.is_error() || lints.asks_for(d.code));
    let (shown, counted): (Vec<&Diagnostic>, Vec<&Diagnostic>) = list.iter().partition(is_shown);
    let mut shown: Vec<Diagnostic> = shown.into_iter().cloned().collect();
    osl::stages::hide(&mut shown, sources);
    let text = render(&with_lessons(&shown), sources, RenderStyle { color: true });
    let note = (!counted.is_empty()).then(|| {
        let names = names(counted.iter().map(|d| d.code).collect());
        format!("{} ({names}); `oslrun check` shows the text", warnings(counted.len()))
    });
    (text, note)
}

/// Maximum number of warnings of one kind in a file that are printed in full.
const MOST_OF_A_KIND: usize = 5;

/// The diagnostics of a file that are shown, and notes on the others: warnings in other files, such as
/// included ones, and many warnings of one kind, unless the user asks for them by name.
pub(super) fn folded(
    list: &[Diagnostic],
    sources: &SourceMap,
    lints: &Lints,
) -> (Vec<Diagnostic>, Vec<String>) {
    let main = sources.files().first().map_or("", |file| &*file.name).to_owned();
    let mut elsewhere: BTreeMap<String, Vec<Code>> = BTreeMap::new();
    let mut kinds: BTreeMap<Code, usize> = BTreeMap::new();
    let keeps = |d: &&Diagnostic| {
        if d.is_error() || lints.asks_for(d.code) {
            return true;
        }
        match sources.place(d.span).filter(|place| place.file != main) {
            Some(place) => {
                elsewhere.entry(place.file).or_default().push(d.code);
                false
            }
            None => {
                let n = kinds.entry(d.code).or_default();
                *n += 1;
                *n <= MOST_OF_A_KIND
            }
        }
    };
    let kept: Vec<Diagnostic> = list.iter().filter(keeps).cloned().collect();
    let elsewhere = elsewhere.into_iter().map(|(file, codes)| {
        format!("{} in {file} ({}); `-W all` shows them", warnings(codes.len()), names(codes))
    });
    let many = kinds.into_iter().filter(|(_, n)| *n > MOST_OF_A_KIND).map(|(code, n)| {
        let (more, name) = (n - MOST_OF_A_KIND, code.name);
        format!("{more} more of {name}; `-W {name}` shows them")
    });
    let notes = elsewhere.chain(many).collect();
    (kept, notes)
}

fn warnings(n: usize) -> String {
    if n == 1 { "1 warning".to_string() } else { format!("{n} warnings") }
}

/// The names of codes, each once.
fn names(mut codes: Vec<Code>) -> String {
    codes.sort_unstable();
    codes.dedup();
    codes.iter().map(|code| code.name).collect::<Vec<_>>().join(", ")
}

/// The diagnostics; the first of each code names its lesson, and how to silence it.
fn with_lessons(list: &[Diagnostic]) -> Vec<Diagnostic> {
    let mut named: Vec<Code> = Vec::new();
    let with_lesson = |d: &Diagnostic| {
        if named.contains(&d.code) {
            return d.clone();
        }
        named.push(d.code);
        let Code { id, name } = d.code;
        let silence = if id.starts_with('W') { format!("; `-A {name}` silences it") } else { String::new() };
        d.clone().note(format!("for more: `oslrun explain-error {id}`{silence}"))
    };
    list.iter().map(with_lesson).collect()
}
