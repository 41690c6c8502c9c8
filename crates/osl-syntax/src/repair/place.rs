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
    let head = |end: usize| {
        let before = match all.tokens.get(end) {
            Some(Token::RBrace) => brackets.parent(end)?.checked_sub(1)?,
            // A `;` that is the whole statement.
            Some(Token::Semi) => end.checked_sub(1)?,
            _ => return None,
        };
        let head = match all.tokens.get(before)? {
            Token::RParen => brackets.parent(before)?.checked_sub(1)?,
            Token::Else | Token::Do => before,
            _ => return None,
        };
        let word = match all.tokens.get(head)? {
            Token::If => "if",
            Token::For => "for",
            Token::While => "while",
            Token::Else => "else",
            Token::Do => "do",
            _ => return None,
        };
        Some((*all.spans.get(head)?, word))
    };
    let mut changes = Vec::new();
    for at in &all.inserted {
        // A brace that ends a declaration leaves the one before it to the last condition or loop.
        let inside = || brackets.parent(*at).map_or(0..0, |opener| opener + 1..*at);
        let end = match head(*at) {
            Some(_) => Some(*at),
            None if all.tokens.get(*at) == Some(&Token::RBrace) => {
                inside().rev().find(|n| all.tokens.get(*n) == Some(&Token::RBrace) && head(*n).is_some())
            }
            None => None,
        };
        let Some((end, (span, word))) = end.and_then(|end| Some((end, head(end)?))) else { continue };
        let last = all.spans.get(end).copied().unwrap_or(stream.end);
        let last = Span::new(last.end.saturating_sub(1), last.end);
        changes.push((span, format!("the `{word}` of line {} ends in line {}", line(span), line(last))));
    }
    changes
}

/// A block that is open.
struct OpenBlock<'t> {
    opener: usize,
    /// The indentation of the line that opens it, if the block can be judged by it.
    outer: Option<&'t str>,
    /// The indentation of its first line.
    inner: Option<&'t str>,
}

/// Blocks that the indentation ends, but no `}`: the opening brace, and the token before which the block
/// ends. Lines count whose first token is in the main file. A block counts if its first line is indented
/// deeper than the line that opens it. Nothing is found if a later statement is indented deeper than its
/// block, since then the indentation says nothing.
pub(super) fn unclosed_blocks(stream: &Stream, text: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut open: Vec<OpenBlock<'_>> = Vec::new();
    for (at, (token, span)) in stream.tokens.iter().zip(&stream.spans).enumerate() {
        let indent = || layout::indent(text, span.start as usize);
        if is_plain(stream, at, text) && gap(stream, at, text).contains('\n') {
            let own = indent();
            if let Some(block) = open.last_mut().filter(|block| block.opener + 1 == at) {
                block.outer = block.outer.filter(|outer| *token == Token::RBrace || is_deeper(own, outer));
                block.inner = Some(own);
            }
            while let Some(OpenBlock { opener, outer: Some(outer), .. }) = open.last()
                && !is_deeper(own, outer)
                && !(own == *outer && matches!(token, Token::RBrace | Token::LBrace))
            {
                found.push((*opener, at));
                open.pop();
            }
            let begins = matches!(stream.tokens.get(at.wrapping_sub(1)), Some(Token::Semi | Token::RBrace));
            let inner = open.last().map_or(Some(""), |block| block.inner);
            if begins && !found.is_empty() && inner.is_some_and(|inner| is_deeper(own, inner)) {
                return Vec::new();
            }
        }
        match token {
            Token::LBrace => {
                // A block that begins in the middle of its line is not judged.
                let ends = gap(stream, at + 1, text).contains('\n');
                open.push(OpenBlock { opener: at, outer: ends.then(indent), inner: None });
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
