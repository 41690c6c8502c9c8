//! Diagnostics of files whose text messages must not show.
//!
//! A shader from anywhere may include files outside of its own folder. What is wrong there is told with its
//! code and place, in words that quote nothing of the file: the included file may be no shader at all.

use crate::diagnostic::{Diagnostic, Edit};
use crate::errors::NOT_UTF8;
use crate::source::SourceMap;
use crate::span::Span;
use rustc_hash::FxHashSet;

/// Takes the text of hidden files out of diagnostics. `is_known` tells the words of the language, which may
/// be quoted wherever they occur.
pub fn hide(diagnostics: &mut [Diagnostic], sources: &SourceMap, is_known: &dyn Fn(&str) -> bool) {
    if diagnostics.is_empty() || !sources.files().iter().any(|file| file.about.hidden) {
        return;
    }
    let is_hidden = |span: Span| sources.file_at(span.start).is_some_and(|file| file.about.hidden);
    let files = |hidden: bool| sources.files().iter().filter(move |file| file.about.hidden == hidden);
    // No message quotes a comment.
    let code = files(true).flat_map(|file| without_comments(&file.text));
    let mut secret: FxHashSet<&str> = code.flat_map(words).filter(|word| word.len() > 1).collect();
    files(false).flat_map(|file| words(&file.text)).for_each(|word| {
        secret.remove(word);
    });
    let is_secret = |word: &str| secret.contains(word) && !is_known(word);
    let tells = |text: &str| quoted(text).any(is_secret);
    for d in diagnostics {
        if is_hidden(d.span) && d.code != NOT_UTF8 {
            d.message = "an included file is wrong here".to_string();
            d.label.clear();
            d.labels.clear();
            d.fixes.clear();
            d.notes = vec![
                "the text is not shown: the file is neither below the folder of the shader nor below one of -I"
                    .to_string(),
            ];
            d.help = Some("-I DIR with the folder of the file shows it".to_string());
            continue;
        }
        if tells(&d.message) {
            d.message = "this does not fit an included file whose text is not shown".to_string();
        }
        if tells(&d.label) {
            d.label.clear();
        }
        d.labels.retain(|(span, text)| !is_hidden(*span) && !tells(text));
        // Notes show declarations without quotes.
        d.notes.retain(|note| !words(note).any(is_secret));
        d.help.take_if(|help| tells(help));
        d.fixes.retain(|fix| {
            let shows = |edit: &Edit| is_hidden(edit.span) || words(&edit.text).any(is_secret);
            !tells(&fix.title) && !fix.edits.iter().any(shows)
        });
    }
}

/// The parts of a text between its comments.
fn without_comments(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let text = rest.take()?;
        let begins = |at: &usize| matches!(text.as_bytes().get(at + 1), Some(b'/' | b'*'));
        let Some(at) = text.match_indices('/').map(|(at, _)| at).find(begins) else { return Some(text) };
        let (before, comment) = text.split_at(at);
        let end = if comment.starts_with("//") { "\n" } else { "*/" };
        rest = comment.get(2..).and_then(|inner| inner.split_once(end)).map(|(_, after)| after);
        Some(before)
    })
}

/// The words of a text: names and numbers.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}

/// The words of the quoted parts of a message.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split(['`', '"']).skip(1).step_by(2).flat_map(words)
}
