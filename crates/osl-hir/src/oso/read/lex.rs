//! The words, strings and hints of one line.

use crate::oso::errors::{self, Wrong};
use osl_syntax::span::Span;

/// A part of a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Token<'a> {
    pub(super) kind: Kind<'a>,
    pub(super) span: Span,
}

/// The kind of a part, with its text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind<'a> {
    /// Anything without blanks.
    Word(&'a str),
    /// The contents of a string literal, with escapes as written.
    Text(&'a str),
    /// `%name{inside}`, or `%name` where the inside is `None`.
    Hint(&'a str, Option<&'a str>),
    /// A comma between the values of a hint.
    Comma,
}

impl<'a> Token<'a> {
    /// The word, if it is one.
    pub(super) fn word(&self) -> Option<&'a str> {
        match self.kind {
            Kind::Word(word) => Some(word),
            _ => None,
        }
    }

    /// The word or the string, as written.
    pub(super) fn text(&self) -> Option<&'a str> {
        match self.kind {
            Kind::Word(text) | Kind::Text(text) => Some(text),
            _ => None,
        }
    }
}

/// Splits a line, or the inside of a hint, whose first byte is at `base`. In hints, a comma ends a word.
pub(super) fn tokens<'a>(line: &'a str, base: u32, in_hint: bool) -> Result<Vec<Token<'a>>, Wrong> {
    let mut list = Vec::new();
    let mut at = 0;
    while let Some(rest) = line.get(at..).filter(|rest| !rest.is_empty()) {
        let first = rest.chars().next().unwrap_or(' ');
        if first.is_ascii_whitespace() {
            at += 1;
            continue;
        }
        let span = |length: usize| Span::new(base + at as u32, base + (at + length) as u32);
        let (kind, length) = match first {
            '"' => {
                let inside = closing(rest, 1, b'"')
                    .ok_or_else(|| errors::syntax(span(rest.len()), "a string without its closing quote"))?;
                (Kind::Text(rest.get(1..inside).unwrap_or_default()), inside + 1)
            }
            '%' if !in_hint => hint(rest)
                .ok_or_else(|| errors::syntax(span(rest.len()), "a hint without its closing brace"))?,
            ',' if in_hint => (Kind::Comma, 1),
            _ => {
                let ends = |c: char| c.is_ascii_whitespace() || c == '"' || (in_hint && c == ',');
                let length = rest.find(ends).unwrap_or(rest.len());
                (Kind::Word(rest.get(..length).unwrap_or_default()), length)
            }
        };
        list.push(Token { kind, span: span(length) });
        at += length;
    }
    Ok(list)
}

/// The hint at the start of the text, and its length.
fn hint(text: &str) -> Option<(Kind<'_>, usize)> {
    let name_end = text.find(|c: char| c.is_ascii_whitespace() || c == '{').unwrap_or(text.len());
    let name = text.get(1..name_end)?;
    if text.as_bytes().get(name_end) != Some(&b'{') {
        return Some((Kind::Hint(name, None), name_end));
    }
    let end = closing(text, name_end + 1, b'}')?;
    Some((Kind::Hint(name, text.get(name_end + 1..end)), end + 1))
}

/// The position of the closing byte, skipping strings.
fn closing(text: &str, from: usize, close: u8) -> Option<usize> {
    let mut quoted = false;
    let mut escaped = false;
    for (at, byte) in text.bytes().enumerate().skip(from) {
        if escaped {
            escaped = false;
        } else if byte == close && !quoted {
            return Some(at);
        } else if byte == b'\\' && (quoted || close == b'"') {
            escaped = true;
        } else if byte == b'"' {
            quoted = !quoted;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(line: &str, in_hint: bool) -> Vec<Kind<'_>> {
        tokens(line, 0, in_hint)
            .map_or_else(|_| Vec::new(), |list| list.into_iter().map(|t| t.kind).collect())
    }

    #[test]
    fn a_line_of_each_kind() {
        assert_eq!(
            kinds("param\tstring s \"a \\\"}\" %meta{string,help,\"}\"} %derivs", false),
            [
                Kind::Word("param"),
                Kind::Word("string"),
                Kind::Word("s"),
                Kind::Text("a \\\"}"),
                Kind::Hint("meta", Some("string,help,\"}\"")),
                Kind::Hint("derivs", None),
            ]
        );
        assert_eq!(
            kinds("float[2],x,\",\"", true),
            [Kind::Word("float[2]"), Kind::Comma, Kind::Word("x"), Kind::Comma, Kind::Text(",")]
        );
    }

    #[test]
    fn what_has_no_end() {
        assert!(tokens("a \"b", 0, false).is_err());
        assert!(tokens("a %b{c", 0, false).is_err());
        assert!(tokens("a %b{\"}", 0, false).is_err());
    }
}
