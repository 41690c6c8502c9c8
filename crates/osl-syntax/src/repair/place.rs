//! Where insertions go in the text, and how they are formatted.

use super::Insertion;
use crate::brackets::Brackets;
use crate::diagnostic::Edit;
use crate::parser::Stream;
use crate::span::Span;
use crate::token::Token;

/// Whether text can be inserted before token `at`: both neighbours are in the main file, in order, and not in
/// the same macro expansion.
pub(super) fn is_plain(stream: &Stream, at: usize, text: &str) -> bool {
    let next = stream.spans.get(at).copied().unwrap_or(stream.end);
    match at.checked_sub(1).and_then(|n| stream.spans.get(n)) {
        Some(before) => before.end <= next.start && next.start as usize <= text.len(),
        None => false,
    }
}

/// The text between the token before `at` and `at` itself.
fn gap<'t>(stream: &Stream, at: usize, text: &'t str) -> &'t str {
    let from = at.checked_sub(1).and_then(|n| stream.spans.get(n)).map_or(0, |s| s.end);
    let to = stream.spans.get(at).copied().unwrap_or(stream.end).start;
    text.get(from as usize..to as usize).unwrap_or("")
}

/// Whether the token before `at` is the last of its line.
pub(super) fn ends_line(stream: &Stream, at: usize, text: &str) -> bool {
    at == stream.tokens.len() || gap(stream, at, text).contains('\n')
}

/// The first token after `from` and up to `to` that begins a declaration at the left margin.
pub(super) fn next_at_margin(stream: &Stream, from: usize, to: usize, text: &str) -> Option<usize> {
    (from + 1..to).find(|at| {
        let declares = match (stream.tokens.get(*at), stream.tokens.get(*at + 1)) {
            (Some(Token::ShaderKind(_) | Token::Struct), _) => true,
            (Some(Token::Type(_) | Token::Ident(_)), Some(Token::Ident(_))) => {
                stream.tokens.get(*at + 2) == Some(&Token::LParen)
            }
            _ => false,
        };
        let behind_statement = matches!(stream.tokens.get(*at - 1), Some(Token::Semi | Token::RBrace));
        declares && behind_statement && gap(stream, *at, text).ends_with('\n')
    })
}

/// The insertions as edits of the text; those at one position are joined.
pub(super) fn edits(stream: &Stream, text: &str, insertions: &[Insertion]) -> Vec<Edit> {
    let mut sorted: Vec<&Insertion> = insertions.iter().collect();
    sorted.sort_by_key(|i| i.before);
    let mut indents = Indents::new(stream, text, &sorted);
    let mut edits: Vec<Edit> = Vec::new();
    for insertion in sorted {
        let behind = insertion.before.checked_sub(1).and_then(|n| stream.spans.get(n)).map_or(0, |s| s.end);
        let (at, piece) = match insertion.token {
            Token::RBrace if ends_line(stream, insertion.before, text) => {
                (end_of_line(text, behind), format!("\n{}}}", indents.next_brace()))
            }
            Token::RBrace => {
                indents.next_brace();
                (behind, " }".to_owned())
            }
            Token::LBrace => (behind, " {".to_owned()),
            _ => (behind, spelling(&insertion.token).to_owned()),
        };
        match edits.last_mut() {
            Some(last) if last.span.start == at => last.text.push_str(&piece),
            _ => edits.push(Edit { span: Span::new(at, at), text: piece }),
        }
    }
    edits.sort_by_key(|e| e.span.start);
    edits
}

/// The end of the line after `at`, if it contains only white space and a line comment.
fn end_of_line(text: &str, at: u32) -> u32 {
    let rest = text.get(at as usize..).unwrap_or("");
    let line = rest.split('\n').next().unwrap_or("").trim_end();
    let code = line.trim_start();
    if code.is_empty() || code.starts_with("//") { at + line.len() as u32 } else { at }
}

fn spelling(token: &Token) -> &'static str {
    match token {
        Token::RParen => ")",
        Token::RBracket => "]",
        Token::RBrace => "}",
        Token::LBrace => "{",
        _ => ";",
    }
}

/// The indentation of the lines whose braces the inserted ones close, in order of insertion.
struct Indents(std::vec::IntoIter<String>);

impl Indents {
    fn new(stream: &Stream, text: &str, insertions: &[&Insertion]) -> Self {
        // The repaired stream: the partner of an inserted brace determines its indentation.
        let mut tokens = Vec::new();
        let mut spans = Vec::new();
        let mut inserted = Vec::new();
        let mut rest = insertions.iter().peekable();
        for at in 0..=stream.tokens.len() {
            while let Some(i) = rest.next_if(|i| i.before == at) {
                inserted.push(tokens.len());
                tokens.push(i.token.clone());
                let behind = at.checked_sub(1).and_then(|n| stream.spans.get(n)).copied();
                spans.push(behind.unwrap_or_default());
            }
            tokens.extend(stream.tokens.get(at).cloned());
            spans.extend(stream.spans.get(at).copied());
        }
        let brackets = Brackets::of(&tokens);
        let indent = |at: &usize| {
            let opener = brackets.parent(*at).filter(|o| !inserted.contains(o))?;
            let start = spans.get(opener)?.start as usize;
            let line = text.get(..start)?.rfind('\n').map_or(0, |n| n + 1);
            let line = text.get(line..)?;
            Some(line[..line.len() - line.trim_start_matches([' ', '\t']).len()].to_owned())
        };
        let braces = inserted.iter().filter(|at| tokens.get(**at) == Some(&Token::RBrace));
        Self(braces.map(|at| indent(at).unwrap_or_default()).collect::<Vec<_>>().into_iter())
    }

    fn next_brace(&mut self) -> String {
        self.0.next().unwrap_or_default()
    }
}
