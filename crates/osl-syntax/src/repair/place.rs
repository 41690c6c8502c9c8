//! Where insertions go in the text, and how they are formatted.

use super::Insertion;
use crate::brackets::Brackets;
use crate::diagnostic::Edit;
use crate::layout;
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

/// A stream with its insertions: tokens, locations, and which tokens are inserted.
struct Inserted {
    tokens: Vec<Token>,
    spans: Vec<Span>,
    inserted: Vec<usize>,
}

impl Inserted {
    fn new(stream: &Stream, insertions: &[&Insertion]) -> Self {
        let mut all = Self { tokens: Vec::new(), spans: Vec::new(), inserted: Vec::new() };
        let mut rest = insertions.iter().peekable();
        for at in 0..=stream.tokens.len() {
            while let Some(i) = rest.next_if(|i| i.before == at) {
                all.inserted.push(all.tokens.len());
                all.tokens.push(i.token.clone());
                let behind = at.checked_sub(1).and_then(|n| stream.spans.get(n)).copied();
                all.spans.push(behind.unwrap_or_default());
            }
            all.tokens.extend(stream.tokens.get(at).cloned());
            all.spans.extend(stream.spans.get(at).copied());
        }
        all
    }
}

/// What insertions make of the conditions and loops whose statements they end.
pub(super) fn changes(stream: &Stream, text: &str, insertions: &[Insertion]) -> Vec<(Span, String)> {
    let mut sorted: Vec<&Insertion> = insertions.iter().collect();
    sorted.sort_by_key(|i| i.before);
    let all = Inserted::new(stream, &sorted);
    let brackets = Brackets::of(&all.tokens);
    let line = |span: Span| text.get(..span.start as usize).unwrap_or("").matches('\n').count() + 1;
    let mut changes = Vec::new();
    for at in &all.inserted {
        // What the statement ends with: its block, or the `;` that is all of it.
        let ends = match all.tokens.get(*at) {
            Some(Token::RBrace) => brackets.parent(*at),
            Some(Token::Semi) => Some(*at),
            _ => None,
        };
        let before = ends.and_then(|n| n.checked_sub(1));
        let head = match before.and_then(|n| Some((n, all.tokens.get(n)?))) {
            Some((n, Token::RParen)) => brackets.parent(n).and_then(|n| n.checked_sub(1)),
            Some((n, Token::Else | Token::Do)) => Some(n),
            _ => None,
        };
        let word = match head.and_then(|n| all.tokens.get(n)) {
            Some(Token::If) => "if",
            Some(Token::For) => "for",
            Some(Token::While) => "while",
            Some(Token::Else) => "else",
            Some(Token::Do) => "do",
            _ => continue,
        };
        let Some(span) = head.and_then(|n| all.spans.get(n)).copied() else { continue };
        let last = all.spans.get(*at).copied().unwrap_or(stream.end);
        let end = Span::new(last.end.saturating_sub(1), last.end);
        changes.push((span, format!("the `{word}` of line {} ends in line {}", line(span), line(end))));
    }
    changes
}

/// Blocks that the indentation ends, but no `}`: the opening brace, and the token before which the block ends.
/// Lines count whose first token is in the main file. A block counts if its first line is indented deeper than
/// the line that opens it.
pub(super) fn unclosed_blocks(stream: &Stream, text: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    // The opening brace, and the indentation of its line.
    let mut open: Vec<(usize, Option<&str>)> = Vec::new();
    for (at, (token, span)) in stream.tokens.iter().zip(&stream.spans).enumerate() {
        let indent = || layout::indent(text, span.start as usize);
        if is_plain(stream, at, text) && gap(stream, at, text).contains('\n') {
            let own = indent();
            if let Some((opener, outer)) = open.last_mut()
                && *opener + 1 == at
                && !outer.is_some_and(|outer| is_deeper(own, outer))
                && *token != Token::RBrace
            {
                *outer = None;
            }
            while let Some((opener, Some(outer))) = open.last()
                && !is_deeper(own, outer)
                && !(own == *outer && matches!(token, Token::RBrace | Token::LBrace))
            {
                found.push((*opener, at));
                open.pop();
            }
        }
        match token {
            Token::LBrace => {
                // The values of a list are not judged, nor is a block that begins in the middle of its line.
                let ends = gap(stream, at + 1, text).contains('\n');
                open.push((at, ends.then(indent)));
            }
            Token::RBrace => {
                open.pop();
            }
            _ => {}
        }
    }
    found
}

/// Whether an indentation begins with another and is longer.
fn is_deeper(inner: &str, outer: &str) -> bool {
    inner.len() > outer.len() && inner.starts_with(outer)
}

/// The indentation of the lines whose braces the inserted ones close, in order of insertion.
struct Indents(std::vec::IntoIter<String>);

impl Indents {
    fn new(stream: &Stream, text: &str, insertions: &[&Insertion]) -> Self {
        // The repaired stream: the partner of an inserted brace determines its indentation.
        let Inserted { tokens, spans, inserted } = Inserted::new(stream, insertions);
        let brackets = Brackets::of(&tokens);
        let indent = |at: &usize| {
            let opener = brackets.parent(*at).filter(|o| !inserted.contains(o))?;
            Some(layout::indent(text, spans.get(opener)?.start as usize).to_owned())
        };
        let braces = inserted.iter().filter(|at| tokens.get(**at) == Some(&Token::RBrace));
        Self(braces.map(|at| indent(at).unwrap_or_default()).collect::<Vec<_>>().into_iter())
    }

    fn next_brace(&mut self) -> String {
        self.0.next().unwrap_or_default()
    }
}
