//! Signs: what in the text of a file shows that it is written for a renderer.
//!
//! Only tokens are looked at, before any preprocessing, so that a plain file costs one walk over its text.

use crate::{Dialect, Dialects};
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

/// The kind of a sign; the strongest comes last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sign {
    /// An output with a name and a type.
    Output,
    /// A name of metadata.
    Metadata,
    /// A name in `getattribute`.
    Attribute,
    /// A macro or another word.
    Word,
    /// A called function.
    Call,
    /// An included header.
    Include,
}

/// Why a dialect was chosen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reason {
    /// The kind of sign.
    pub sign: Sign,
    /// The name.
    pub name: String,
    /// Its line, from 1.
    pub line: u32,
}

impl std::fmt::Display for Reason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Reason { sign, name, line } = self;
        match sign {
            Sign::Include => write!(f, "line {line} includes {name}"),
            Sign::Call => write!(f, "line {line} calls {name}"),
            Sign::Word => write!(f, "line {line} names {name}"),
            Sign::Attribute => write!(f, "line {line} asks for the attribute \"{name}\""),
            Sign::Metadata => write!(f, "line {line} has the metadata {name}"),
            Sign::Output => write!(f, "line {line} has the output {name}"),
        }
    }
}

/// A token as far as signs need it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Token<'a> {
    Word(&'a str),
    Text(&'a str),
    Include(&'a str),
    Other(u8),
}

/// Words that are signs: the place of the dialect in the list, the kind, and the first token of the first
/// argument of a call, if it matters.
pub(crate) type Words = HashMap<String, Vec<(usize, Sign, Option<String>)>>;

/// The words of some dialects.
pub(crate) fn words(list: &[Arc<Dialect>]) -> Words {
    let mut words = Words::new();
    for (at, dialect) in list.iter().enumerate() {
        let signs = &dialect.names.signs;
        let calls = signs.calls.iter().map(|call| match call.split_once('(') {
            Some((name, first)) => (name, Sign::Call, Some(first.to_string())),
            None => (call.as_str(), Sign::Call, None),
        });
        let others = signs.words.iter().map(|word| (word.as_str(), Sign::Word, None));
        for (name, sign, first) in calls.chain(others) {
            words.entry(name.to_string()).or_default().push((at, sign, first));
        }
    }
    words
}

/// The signs of a dialect that were found: the strongest, its name and offset, and the number of all.
struct Found {
    sign: Sign,
    name: String,
    offset: usize,
    count: usize,
}

impl Dialects {
    /// The dialect of a text, if it shows one, and the strongest sign. Among dialects with equally strong
    /// signs, the one with the most is chosen, then the first in the list.
    pub fn detect(&self, text: &str) -> Option<(Arc<Dialect>, Reason)> {
        let (tokens, offsets): (Vec<_>, Vec<_>) = Tokens { text, at: 0, line_start: true }.unzip();
        let mut found: Vec<Option<Found>> = self.list().iter().map(|_| None).collect();
        for (at, offset) in offsets.iter().enumerate() {
            self.signs_at(&tokens, at, &mut |dialect, sign, name| {
                let Some(slot) = found.get_mut(dialect) else { return };
                let count = slot.as_ref().map_or(0, |known| known.count) + 1;
                match slot {
                    Some(known) if known.sign >= sign => known.count = count,
                    _ => *slot = Some(Found { sign, name: name.to_string(), offset: *offset, count }),
                }
            });
        }
        let mut best: Option<(&Arc<Dialect>, Found)> = None;
        for (dialect, signs) in self.list().iter().zip(found) {
            let Some(signs) = signs else { continue };
            if best.as_ref().is_none_or(|(_, b)| (signs.sign, signs.count) > (b.sign, b.count)) {
                best = Some((dialect, signs));
            }
        }
        let (dialect, Found { sign, name, offset, .. }) = best?;
        let line = text.get(..offset).map_or(1, |before| before.matches('\n').count() as u32 + 1);
        Some((dialect.clone(), Reason { sign, name, line }))
    }

    /// Passes on the signs at a token.
    fn signs_at(&self, tokens: &[Token<'_>], at: usize, found: &mut dyn FnMut(usize, Sign, &str)) {
        let token = |n: usize| tokens.get(n).copied().unwrap_or(Token::Other(0));
        let before = |n: usize| at.checked_sub(n).map_or(Token::Other(0), token);
        let mut listed = |names: &dyn Fn(&Dialect) -> &[String], sign, name: &str| {
            for (dialect, known) in self.list().iter().enumerate() {
                if names(known).iter().any(|pattern| fits(pattern, name)) {
                    found(dialect, sign, name);
                }
            }
        };
        match token(at) {
            Token::Include(name) => listed(&|d| &d.names.signs.includes, Sign::Include, name),
            Token::Word(name) => {
                if name == "getattribute" {
                    let inside = tokens.iter().skip(at + 1).take_while(|t| **t != Token::Other(b')'));
                    for token in inside.take(MOST_ARGUMENTS) {
                        if let Token::Text(name) = token {
                            listed(&|d| &d.names.signs.attributes, Sign::Attribute, name);
                        }
                    }
                }
                match (before(1), before(2)) {
                    (Token::Word(ty), Token::Word("output")) if tokens.contains(&Token::Word("Ci")) => {
                        listed(&|d| &d.names.signs.outputs, Sign::Output, &format!("{ty} {name}"));
                    }
                    (Token::Word("int" | "float" | "string"), _) if token(at + 1) == Token::Other(b'=') => {
                        listed(&|d| &d.names.signs.metadata, Sign::Metadata, name);
                    }
                    _ => {}
                }
                for (dialect, sign, first) in self.words().get(name).into_iter().flatten() {
                    let first_is = |first: &String| match token(at + 2) {
                        Token::Word(word) => word == first,
                        Token::Text(text) => first.strip_prefix('"') == Some(text),
                        _ => false,
                    };
                    let called = || token(at + 1) == Token::Other(b'(') && !is_defined(tokens, name);
                    if *sign != Sign::Call || (called() && first.as_ref().is_none_or(first_is)) {
                        let quote =
                            first.as_ref().map_or("", |first| if first.starts_with('"') { "\"" } else { "" });
                        let first =
                            first.as_ref().map_or(String::new(), |first| format!("({first}{quote}…)"));
                        found(*dialect, *sign, &format!("{name}{first}"));
                    }
                }
            }
            _ => {}
        }
    }
}

/// The functions and macros that a text defines or declares.
pub fn declared(text: &str) -> BTreeSet<&str> {
    let tokens: Vec<_> = Tokens { text, at: 0, line_start: true }.map(|(token, _)| token).collect();
    tokens.windows(3).filter_map(definition).collect()
}

/// The words of a text, with their lines from 1.
pub fn words_of(text: &str) -> impl Iterator<Item = (u32, &str)> {
    let (mut line, mut from) = (1, 0);
    Tokens { text, at: 0, line_start: true }.filter_map(move |(token, at)| {
        line += text.get(from..at)?.matches('\n').count() as u32;
        from = at;
        if let Token::Word(word) = token { Some((line, word)) } else { None }
    })
}

/// The words and strings of a text.
pub(crate) fn names(text: &str) -> impl Iterator<Item = &str> {
    Tokens { text, at: 0, line_start: true }.filter_map(|(token, _)| match token {
        Token::Word(name) | Token::Text(name) => Some(name),
        Token::Include(_) | Token::Other(_) => None,
    })
}

/// Tokens of a call of `getattribute` that are looked at.
const MOST_ARGUMENTS: usize = 6;

/// Whether a name is that of a pattern, which may have a `*` for any characters.
fn fits(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        Some((start, end)) => name.strip_prefix(start).is_some_and(|rest| rest.ends_with(end)),
        None => pattern == name,
    }
}

/// Whether a file defines the function or macro itself: a type before its name and its parameters.
fn is_defined(tokens: &[Token<'_>], name: &str) -> bool {
    tokens.windows(3).any(|window| definition(window) == Some(name))
}

/// The name of the function or macro that begins here.
fn definition<'a>(window: &[Token<'a>]) -> Option<&'a str> {
    match window {
        [Token::Word("define"), Token::Word(name), _] => Some(name),
        [Token::Word("return" | "else"), ..] => None,
        [Token::Word(_), Token::Word(name), Token::Other(b'(')] => Some(name),
        _ => None,
    }
}

/// The tokens of a text, with their offsets: words, strings, names of included files, and other characters.
/// Comments and numbers are left out.
struct Tokens<'a> {
    text: &'a str,
    at: usize,
    /// Whether only blanks are before `at` on its line.
    line_start: bool,
}

impl<'a> Tokens<'a> {
    /// Takes the characters from here on for which a test holds.
    fn take(&mut self, holds: impl Fn(u8) -> bool) -> &'a str {
        let rest = self.text.as_bytes().get(self.at..).unwrap_or_default();
        let end = self.at + rest.iter().position(|b| !holds(*b)).unwrap_or(rest.len());
        let taken = self.text.get(self.at..end).unwrap_or("");
        self.at = end;
        taken
    }

    /// Takes the rest of a string, up to its quote or the end of the line.
    fn string(&mut self) -> &'a str {
        let start = self.at;
        loop {
            self.take(|b| b != b'"' && b != b'\\' && b != b'\n');
            if self.text.as_bytes().get(self.at) != Some(&b'\\') {
                break;
            }
            self.at = (self.at + 2).min(self.text.len());
        }
        let text = self.text.get(start..self.at).unwrap_or("");
        self.at += usize::from(self.text.as_bytes().get(self.at) == Some(&b'"'));
        text
    }

    /// The name after `#include`; `None` if the directive is another one.
    fn included(&mut self) -> Option<&'a str> {
        let blank = |b: u8| b == b' ' || b == b'\t';
        let back = self.at;
        self.take(blank);
        if self.take(|b| b.is_ascii_alphabetic()) == "include" {
            self.take(blank);
            let open = self.text.as_bytes().get(self.at).copied();
            self.at += usize::from(matches!(open, Some(b'"' | b'<')));
            return match open {
                Some(b'"') => Some(self.string()),
                Some(b'<') => Some(self.take(|b| b != b'>' && b != b'\n')),
                _ => None,
            };
        }
        self.at = back;
        None
    }
}

impl<'a> Iterator for Tokens<'a> {
    type Item = (Token<'a>, usize);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let bytes = self.text.as_bytes();
            let (at, first) = (self.at, *bytes.get(self.at)?);
            let line_start = std::mem::take(&mut self.line_start);
            let is_word = |b: u8| b.is_ascii_alphanumeric() || b == b'_';
            let token = match (first, bytes.get(at + 1)) {
                (b'/', Some(b'/')) => {
                    self.take(|b| b != b'\n');
                    continue;
                }
                (b'/', Some(b'*')) => {
                    let rest = self.text.get(at + 2..).unwrap_or("");
                    self.at = rest.find("*/").map_or(self.text.len(), |end| at + 2 + end + 2);
                    continue;
                }
                (b'"', _) => {
                    self.at += 1;
                    Token::Text(self.string())
                }
                (b'#', _) if line_start => {
                    self.at += 1;
                    match self.included() {
                        Some(name) => Token::Include(name),
                        None => Token::Other(b'#'),
                    }
                }
                (b'a'..=b'z' | b'A'..=b'Z' | b'_', _) => Token::Word(self.take(is_word)),
                (b'0'..=b'9', _) => {
                    self.take(|b| is_word(b) || b == b'.');
                    continue;
                }
                (b, _) => {
                    self.at += 1;
                    if b.is_ascii_whitespace() {
                        self.line_start = line_start || b == b'\n';
                        continue;
                    }
                    Token::Other(b)
                }
            };
            return Some((token, at));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str) -> Option<(String, String)> {
        let (dialect, reason) = Dialects::built_in().detect(text)?;
        Some((dialect.name.clone(), reason.to_string()))
    }

    #[test]
    fn a_text_shows_its_dialect_outside_of_comments_and_strings() {
        let cycles = |why: &str| Some(("cycles".to_string(), why.to_string()));
        assert_eq!(
            found("// hi\n # include \"stdcycles.h\"\nshader a() {}"),
            cycles("line 2 includes stdcycles.h")
        );
        assert_eq!(found("#include <node_color.h>"), cycles("line 1 includes node_color.h"));
        assert_eq!(
            found("x = getattribute(\"geom:uv\", c);"),
            cycles("line 1 asks for the attribute \"geom:uv\"")
        );
        assert_eq!(found("Ci = diffuse_toon(N, 1, 1);"), cycles("line 1 calls diffuse_toon"));
        let plain = [
            "// #include \"stdcycles.h\"",
            "/* diffuse_toon(N, 1, 1) */",
            "string s = \"diffuse_toon(\\\"\"; string t = \"geom:uv\";",
            "float diffuse_toon(float x) { return x; } float y = diffuse_toon(2);",
            "#define diffuse_toon(x) x\ny = diffuse_toon(2);",
            "getattribute(name, \"",
            "#include",
            "/*",
            "",
        ];
        for text in plain {
            assert_eq!(found(text), None, "{text}");
        }
    }
}
