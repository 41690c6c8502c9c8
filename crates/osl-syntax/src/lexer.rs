//! Preprocessing tokens: the units of the text before macros and keywords have a meaning.
//!
//! [`Raw`] is the alphabet (a logos automaton), [`Interner`] holds the spelling of names and literals, and a
//! [`PpToken`] is one occurrence with its location.

use crate::span::Span;
use logos::Logos;
use rustc_hash::FxHashMap;
use std::borrow::Cow;
use std::sync::Arc;

/// Kinds of preprocessing tokens, white space included.
#[derive(Logos, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Raw {
    #[regex(r"[ \t\x0b\x0c\r]+")]
    #[regex(r"\\[ \t]*\r?\n")]
    Space,
    #[token("\n")]
    Newline,
    // A backslash before the line break continues the comment.
    #[regex(r"//([^\\\n]|\\[^\r\n]|\\\r?\n)*\\?", allow_greedy = true)]
    LineComment,
    /// `/*` up to `*/`, or to the end of the text.
    #[token("/*", block_comment)]
    BlockComment,
    #[regex(r"[A-Za-z_][A-Za-z0-9_]*")]
    Ident,
    /// A number with the letters attached to it; `token` splits them.
    #[regex(r"0[xX][0-9a-fA-F]+[A-Za-z0-9_]*")]
    #[regex(r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?([A-Za-z_][A-Za-z0-9_]*)?")]
    Number,
    #[regex(r#""([^"\\\n]|\\\r?\n|\\[^\n])*""#)]
    Str,
    /// A `"` without a closing one on its line.
    #[regex(r#""([^"\\\n]|\\\r?\n|\\[^\n])*\\?"#)]
    OpenStr,
    /// Text between two `'`, which is valid only in preprocessor conditions.
    #[token("'", character)]
    Char,
    /// A `'` without a partner nearby.
    OpenChar,
    #[token("#")]
    Hash,
    #[token("##")]
    HashHash,
    #[token("...")]
    Ellipsis,
    #[token("+")]
    Plus,
    #[token("-")]
    Minus,
    #[token("*")]
    Star,
    #[token("/")]
    Slash,
    #[token("%")]
    Percent,
    #[token("++")]
    PlusPlus,
    #[token("--")]
    MinusMinus,
    #[token("=")]
    Eq,
    #[token("+=")]
    PlusEq,
    #[token("-=")]
    MinusEq,
    #[token("*=")]
    StarEq,
    #[token("/=")]
    SlashEq,
    #[token("&=")]
    AmpEq,
    #[token("|=")]
    PipeEq,
    #[token("^=")]
    CaretEq,
    #[token("<<=")]
    ShlEq,
    #[token(">>=")]
    ShrEq,
    #[token("==")]
    EqEq,
    #[token("!=")]
    NotEq,
    #[token("<")]
    Lt,
    #[token(">")]
    Gt,
    #[token("<=")]
    Le,
    #[token(">=")]
    Ge,
    #[token("&&")]
    AmpAmp,
    #[token("||")]
    PipePipe,
    #[token("!")]
    Bang,
    #[token("&")]
    Amp,
    #[token("|")]
    Pipe,
    #[token("^")]
    Caret,
    #[token("~")]
    Tilde,
    #[token("<<")]
    Shl,
    #[token(">>")]
    Shr,
    #[token("?")]
    Question,
    #[token(":")]
    Colon,
    #[token(",")]
    Comma,
    #[token(";")]
    Semi,
    #[token(".")]
    Dot,
    #[token("(")]
    LParen,
    #[token(")")]
    RParen,
    #[token("[")]
    LBracket,
    #[token("]")]
    RBracket,
    #[token("[[")]
    LMeta,
    #[token("{")]
    LBrace,
    #[token("}")]
    RBrace,
    /// A character that is not part of any token.
    Other,
    /// Stands for an empty macro argument next to `##`.
    Placemarker,
}

fn block_comment(lexer: &mut logos::Lexer<Raw>) {
    let rest = lexer.remainder();
    lexer.bump(rest.find("*/").map_or(rest.len(), |n| n + 2));
}

/// Maximum number of bytes between two `'`. A search to the end of the line, repeated after each `'`, would
/// take quadratic time.
const MAX_CHARACTER: usize = 128;

/// Accepts the text after a `'` up to its partner on the line; false if there is none or the text is empty.
fn character(lexer: &mut logos::Lexer<Raw>) -> bool {
    let rest = lexer.remainder().as_bytes();
    let mut at = 0;
    while at < MAX_CHARACTER {
        match rest.get(at) {
            Some(b'\'') if at > 0 => {
                lexer.bump(at + 1);
                return true;
            }
            Some(b'\\') if rest.get(at + 1).is_some_and(|b| *b != b'\n') => at += 2,
            None | Some(b'\'' | b'\\' | b'\n') => return false,
            Some(_) => at += 1,
        }
    }
    false
}

/// Maximum number of line breaks within one token.
const MAX_SPLICES: usize = 64;
/// Maximum number of bytes that are read at a time to continue a token after a line break.
const MAX_CONTINUED: usize = 256;

/// The length of the backslash and line break at the begin of a text, of any number of them.
fn splices(text: &str) -> usize {
    let mut rest = text;
    while let Some(after) = rest.strip_prefix("\\\n").or_else(|| rest.strip_prefix("\\\r\n")) {
        rest = after;
    }
    text.len() - rest.len()
}

/// A token without the backslashes and line breaks within it.
pub(crate) fn joined(token: &str) -> Cow<'_, str> {
    if !token.contains('\\') {
        return token.into();
    }
    token.replace("\\\r\n", "").replace("\\\n", "").into()
}

/// The next piece of `text` at or after `at`, including white space and comments: its kind and its end. A
/// backslash before a line break does not end a token.
pub(crate) fn scan(text: &str, at: usize) -> Option<(Raw, usize)> {
    let (kind, end) = scan_line(text, at)?;
    let whole = [
        Raw::Space,
        Raw::Newline,
        Raw::LineComment,
        Raw::BlockComment,
        Raw::Str,
        Raw::OpenStr,
        Raw::Char,
        Raw::OpenChar,
        Raw::Other,
    ];
    let rest = text.get(end..).unwrap_or("");
    if !rest.starts_with('\\') || splices(rest) == 0 || whole.contains(&kind) {
        return Some((kind, end));
    }
    Some(continued(text, at, kind, end, &whole))
}

/// A token that is followed by a backslash and a line break, with what continues it. Tokens of the kinds
/// `whole` do not continue another.
fn continued(text: &str, at: usize, kind: Raw, end: usize, whole: &[Raw]) -> (Raw, usize) {
    let mut found = (kind, end);
    let mut token = text.get(at..end).unwrap_or("").to_owned();
    for _ in 0..MAX_SPLICES {
        let rest = text.get(found.1..).unwrap_or("");
        let skipped = splices(rest);
        let rest = rest.get(skipped..).unwrap_or("");
        if skipped == 0 {
            break;
        }
        let window =
            rest.bytes().take(MAX_CONTINUED).position(|b| matches!(b, b'\\' | b'\n') || !b.is_ascii());
        let line = rest.get(..window.unwrap_or(rest.len().min(MAX_CONTINUED))).unwrap_or("");
        let before = token.len();
        token.push_str(line);
        match scan_line(&token, 0) {
            Some((kind, len)) if len > before && !whole.contains(&kind) => {
                found = (kind, found.1 + skipped + len - before);
                token.truncate(len);
            }
            _ => break,
        }
    }
    found
}

/// The next piece at or after `at`, without regard to backslashes before line breaks.
fn scan_line(text: &str, at: usize) -> Option<(Raw, usize)> {
    let rest = text.get(at..)?;
    let mut lexer = Raw::lexer(rest);
    match lexer.next()? {
        Ok(raw) => Some((raw, at + lexer.span().end)),
        Err(()) if rest.starts_with('\'') => Some((Raw::OpenChar, at + 1)),
        // Nothing matched here: exactly one character is invalid.
        Err(()) => rest.chars().next().map(|c| (Raw::Other, at + c.len_utf8())),
    }
}

/// An interned spelling.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Sym(u32);

impl Sym {
    /// The empty spelling, which every [`Interner`] interns first.
    pub(crate) const EMPTY: Sym = Sym(0);
}

/// The spellings of one translation unit.
#[derive(Debug)]
pub(crate) struct Interner {
    ids: FxHashMap<Arc<str>, Sym>,
    texts: Vec<Arc<str>>,
}

impl Default for Interner {
    fn default() -> Self {
        let mut new = Self { ids: FxHashMap::default(), texts: Vec::new() };
        new.intern("");
        new
    }
}

impl Interner {
    /// The symbol of a spelling.
    pub(crate) fn intern(&mut self, text: &str) -> Sym {
        if let Some(id) = self.ids.get(text) {
            return *id;
        }
        let text: Arc<str> = text.into();
        let id = Sym(self.texts.len() as u32);
        self.texts.push(text.clone());
        self.ids.insert(text, id);
        id
    }

    /// The spelling of a symbol.
    pub(crate) fn text(&self, sym: Sym) -> Arc<str> {
        self.texts.get(sym.0 as usize).cloned().unwrap_or_default()
    }

    /// The spelling of a symbol, borrowed.
    pub(crate) fn str(&self, sym: Sym) -> &str {
        self.texts.get(sym.0 as usize).map_or("", |t| t)
    }
}

/// One preprocessing token.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PpToken {
    /// Its kind; never white space.
    pub(crate) kind: Raw,
    /// Its spelling.
    pub(crate) sym: Sym,
    /// Its location in the source text. Tokens of a macro's body get the location of the call.
    pub(crate) span: Span,
    /// Whether white space precedes it.
    pub(crate) space: bool,
    /// Whether it is the first of its line.
    pub(crate) line_start: bool,
    /// Whether it names a macro that was being expanded when the token was read; then it never expands.
    pub(crate) painted: bool,
}
