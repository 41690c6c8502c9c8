//! Tokens of the grammar, and their conversion from preprocessing tokens: keywords, reserved words, the
//! values of literals, joined strings.

use crate::diagnostic::Sink;
use crate::errors;
use crate::lexer::{Interner, PpToken, Raw, Sym};
use crate::span::Span;
use crate::words::{BinaryOp, ShaderKind, TypeName, UnaryOp};
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::Arc;

/// A token of the grammar.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "each variant is the token of its name")]
pub enum Token {
    Ident(Arc<str>),
    Int(i32),
    Float(f32),
    Str(Arc<str>),
    Type(TypeName),
    /// `shader`, `surface`, `displacement` or `volume` where a shader begins.
    ShaderKind(ShaderKind),
    Break,
    Closure,
    Continue,
    Do,
    Else,
    For,
    If,
    Output,
    Return,
    Struct,
    While,
    /// `public`, `illuminate`, `illuminance`: words that the grammar does not use.
    Unused,
    LParen,
    RParen,
    LBracket,
    RBracket,
    /// `[[`
    LMeta,
    LBrace,
    RBrace,
    Comma,
    Semi,
    Dot,
    Question,
    Colon,
    Assign,
    OpAssign(BinaryOp),
    /// `++` (true) and `--`.
    Step(bool),
    Plus,
    Minus,
    /// `!` and `~`.
    Prefix(UnaryOp),
    MulOp(BinaryOp),
    ShiftOp(BinaryOp),
    RelOp(BinaryOp),
    EqOp(BinaryOp),
    Amp,
    Caret,
    Pipe,
    AndAnd,
    OrOr,
    /// An invalid token, which was reported already.
    Stray,
    /// A statement, declaration, formal or metadatum that recovery has removed.
    Bad,
    /// An expression that recovery has removed.
    BadExpr,
}

/// The keyword or operator for a preprocessing token; `None` for names, literals and invalid tokens.
pub(crate) fn fixed(kind: Raw, text: &str) -> Option<Token> {
    match kind {
        Raw::Ident => match word(text) {
            Word::Token(token) => Some(token),
            Word::Reserved { .. } | Word::Name => None,
        },
        kind => operator(kind),
    }
}

/// Whether a word is no name: a keyword or a reserved word.
pub fn is_keyword(text: &str) -> bool {
    !matches!(word(text), Word::Name)
}

/// Converts preprocessing tokens to tokens of the grammar, one for one, except for joined strings and dropped
/// modifiers.
pub(crate) fn convert(tokens: &[PpToken], names: &Interner, out: &mut Sink) -> (Vec<Token>, Vec<Span>) {
    let mut c = Converter {
        names,
        out,
        tokens: Vec::with_capacity(tokens.len()),
        spans: Vec::with_capacity(tokens.len()),
        strings: FxHashMap::default(),
        depth: 0,
    };
    let mut rest = tokens;
    while let Some((t, tail)) = rest.split_first() {
        rest = tail;
        if t.kind == Raw::Str {
            let more = tail.iter().take_while(|t| t.kind == Raw::Str).count();
            let (strings, tail) = tail.split_at(more);
            rest = tail;
            c.strings(*t, strings);
        } else if let Some((digits, tail)) = c.hex_color(*t, tail) {
            rest = tail;
            let span = t.span.to(digits.span);
            c.out.push(errors::hex_color(span, c.names.str(digits.sym)));
            c.tokens.push(Token::BadExpr);
            c.spans.push(span);
        } else {
            c.push(*t, tail.first());
        }
    }
    mark_shaders(&mut c.tokens);
    (c.tokens, c.spans)
}

struct Converter<'a> {
    names: &'a Interner,
    out: &'a mut Sink,
    tokens: Vec<Token>,
    spans: Vec<Span>,
    /// The values of the string literals so far; each is kept once, however often macros repeat it.
    strings: FxHashMap<Sym, Arc<str>>,
    /// Number of open braces and parentheses.
    depth: i64,
}

impl Converter<'_> {
    /// `#ff8800`: the digits behind a `#`, and the tokens after them.
    fn hex_color<'t>(&self, hash: PpToken, tail: &'t [PpToken]) -> Option<(PpToken, &'t [PpToken])> {
        let (digits, tail) = tail.split_first()?;
        let text = self.names.str(digits.sym);
        let hex = matches!(text.len(), 3 | 6) && text.bytes().all(|b| b.is_ascii_hexdigit());
        (hash.kind == Raw::Hash && hash.span.end == digits.span.start && hex).then_some((*digits, tail))
    }

    /// Adds a token; `next` is the token after it.
    fn push(&mut self, t: PpToken, next: Option<&PpToken>) {
        let text = self.names.str(t.sym);
        let token = match t.kind {
            Raw::Ident => match word(text) {
                Word::Token(token) => token,
                Word::Reserved { modifier } => {
                    // The space behind a word goes with it.
                    let behind = next.map(|next| next.span.start).filter(|at| *at == t.span.end + 1);
                    let inside = (self.depth > 0).then_some(behind);
                    self.out.push(errors::reserved_word(t.span, text, inside));
                    if modifier {
                        return;
                    }
                    Token::Ident(self.names.text(t.sym))
                }
                Word::Name => Token::Ident(self.names.text(t.sym)),
            },
            Raw::Number => self.number(t, text),
            Raw::Char | Raw::OpenChar => {
                self.out.push(errors::char_literal(t.span, text));
                Token::Stray
            }
            kind => match operator(kind) {
                Some(token) => token,
                None => {
                    let named = next.filter(|n| n.kind == Raw::Ident && n.span.start == t.span.end);
                    let apart = self.spans.last().is_none_or(|last| last.end != t.span.start);
                    if text == "@" && apart && named.is_some() {
                        self.out.push(errors::bound_name(t.span));
                        return;
                    }
                    self.out.push(errors::stray_character(t.span, text));
                    Token::Stray
                }
            },
        };
        self.depth += match token {
            Token::LBrace | Token::LParen => 1,
            Token::RBrace | Token::RParen => -1,
            _ => 0,
        };
        self.tokens.push(token);
        self.spans.push(t.span);
    }

    /// Joins a string literal with those that follow it.
    fn strings(&mut self, first: PpToken, more: &[PpToken]) {
        let mut value = self.string(first);
        let mut span = first.span;
        if !more.is_empty() {
            let mut joined = value.to_string();
            for t in more {
                joined.push_str(&self.string(*t));
                span = span.to(t.span);
            }
            value = joined.into();
        }
        self.tokens.push(Token::Str(value));
        self.spans.push(span);
    }

    /// The value of one string literal.
    fn string(&mut self, t: PpToken) -> Arc<str> {
        let names = self.names;
        self.strings.entry(t.sym).or_insert_with(|| unescape(names.str(t.sym)).into()).clone()
    }

    fn number(&mut self, t: PpToken, text: &str) -> Token {
        let (end, token) = number(text);
        let (digits, suffix) = text.split_at(end);
        if !suffix.is_empty() {
            // The position of the suffix is known only if the number occurs in the text itself.
            let literal = (t.span.end - t.span.start) as usize == text.len();
            let at = if literal { Span::new(t.span.start + end as u32, t.span.end) } else { t.span };
            self.out.push(errors::number_suffix(t.span, at, digits, suffix));
        }
        token.unwrap_or_else(|| {
            self.out.push(errors::int_too_large(t.span, digits));
            Token::Int(0)
        })
    }
}

/// Splits a number from the letters after it; the token is `None` for an int beyond 32 bits.
fn number(text: &str) -> (usize, Option<Token>) {
    let bytes = text.as_bytes();
    let run = |from: usize, ok: fn(&u8) -> bool| from + bytes.iter().skip(from).take_while(|b| ok(b)).count();
    if text.starts_with("0x") || text.starts_with("0X") {
        let end = run(2, u8::is_ascii_hexdigit);
        let value = text.get(2..end).and_then(|d| u32::from_str_radix(d, 16).ok());
        return (end, value.map(|v| Token::Int(v as i32)));
    }
    let whole = run(0, u8::is_ascii_digit);
    let mut end = whole;
    if bytes.get(end) == Some(&b'.') {
        end = run(end + 1, u8::is_ascii_digit);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = end + 1 + usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = run(sign, u8::is_ascii_digit);
        if exponent > sign {
            end = exponent;
        }
    }
    let digits = text.get(..end).unwrap_or(text);
    if end == whole {
        let value = digits.parse::<u64>().ok().filter(|v| *v <= 1 << 31);
        return (end, value.map(|v| Token::Int(v as u32 as i32)));
    }
    (end, Some(Token::Float(digits.parse().unwrap_or(0.0))))
}

/// The value of a string literal with its quotes. Unknown escapes keep their backslash; `\0` ends the string.
pub(crate) fn unescape(literal: &str) -> String {
    let inner = literal.strip_prefix('"').unwrap_or(literal);
    let inner = inner.strip_suffix('"').unwrap_or(inner).as_bytes();
    let mut bytes = Vec::with_capacity(inner.len());
    let mut at = 0;
    while let Some(b) = inner.get(at) {
        at += 1;
        if *b != b'\\' {
            bytes.push(*b);
            continue;
        }
        let escape = inner.get(at).copied();
        at += 1;
        match escape {
            Some(b'n') => bytes.push(b'\n'),
            Some(b't') => bytes.push(b'\t'),
            Some(b'v') => bytes.push(0x0b),
            Some(b'b') => bytes.push(0x08),
            Some(b'r') => bytes.push(b'\r'),
            Some(b'f') => bytes.push(0x0c),
            Some(b'a') => bytes.push(0x07),
            Some(c @ (b'\\' | b'"')) => bytes.push(c),
            Some(b'\n') => {}
            Some(b'\r') if inner.get(at) == Some(&b'\n') => at += 1,
            Some(first @ b'0'..=b'7') => {
                let more = inner.iter().skip(at).take(2).take_while(|b| matches!(b, b'0'..=b'7')).count();
                let digits = inner.get(at..at + more).unwrap_or_default();
                let value = digits.iter().fold(u32::from(first - b'0'), |v, d| v * 8 + u32::from(d - b'0'));
                at += more;
                bytes.push(value as u8);
                if value == 0 {
                    bytes.pop();
                    break;
                }
            }
            Some(c) => bytes.extend([b'\\', c]),
            None => bytes.push(b'\\'),
        }
    }
    String::from_utf8(bytes).unwrap_or_else(|e| String::from_utf8_lossy(e.as_bytes()).into_owned())
}

enum Word {
    Token(Token),
    /// `modifier`: it may precede a type, and the rest is valid without it.
    Reserved {
        modifier: bool,
    },
    Name,
}

fn word(text: &str) -> Word {
    Word::Token(match text {
        "break" => Token::Break,
        "closure" => Token::Closure,
        "color" => Token::Type(TypeName::Color),
        "continue" => Token::Continue,
        "do" => Token::Do,
        "else" => Token::Else,
        "float" => Token::Type(TypeName::Float),
        "for" => Token::For,
        "if" => Token::If,
        "illuminance" | "illuminate" => Token::Unused,
        "int" => Token::Type(TypeName::Int),
        "matrix" => Token::Type(TypeName::Matrix),
        "normal" => Token::Type(TypeName::Normal),
        "output" => Token::Output,
        "point" => Token::Type(TypeName::Point),
        "return" => Token::Return,
        "string" => Token::Type(TypeName::String),
        "struct" => Token::Struct,
        "vector" => Token::Type(TypeName::Vector),
        "void" => Token::Type(TypeName::Void),
        "while" => Token::While,
        "and" => Token::AndAnd,
        "or" => Token::OrOr,
        "not" => Token::Prefix(UnaryOp::Not),
        "const" | "extern" | "friend" | "inline" | "private" | "protected" | "public" | "static"
        | "uniform" | "varying" | "virtual" | "unsigned" | "signed" | "long" | "short" => {
            return Word::Reserved { modifier: true };
        }
        "bool" | "case" | "char" | "class" | "default" | "double" | "enum" | "false" | "sizeof"
        | "switch" | "template" | "this" | "true" | "typedef" | "union" => {
            return Word::Reserved { modifier: false };
        }
        _ => return Word::Name,
    })
}

fn operator(kind: Raw) -> Option<Token> {
    Some(match kind {
        Raw::Plus => Token::Plus,
        Raw::Minus => Token::Minus,
        Raw::Star => Token::MulOp(BinaryOp::Mul),
        Raw::Slash => Token::MulOp(BinaryOp::Div),
        Raw::Percent => Token::MulOp(BinaryOp::Mod),
        Raw::PlusPlus => Token::Step(true),
        Raw::MinusMinus => Token::Step(false),
        Raw::Eq => Token::Assign,
        Raw::PlusEq => Token::OpAssign(BinaryOp::Add),
        Raw::MinusEq => Token::OpAssign(BinaryOp::Sub),
        Raw::StarEq => Token::OpAssign(BinaryOp::Mul),
        Raw::SlashEq => Token::OpAssign(BinaryOp::Div),
        Raw::AmpEq => Token::OpAssign(BinaryOp::BitAnd),
        Raw::PipeEq => Token::OpAssign(BinaryOp::BitOr),
        Raw::CaretEq => Token::OpAssign(BinaryOp::BitXor),
        Raw::ShlEq => Token::OpAssign(BinaryOp::Shl),
        Raw::ShrEq => Token::OpAssign(BinaryOp::Shr),
        Raw::EqEq => Token::EqOp(BinaryOp::Eq),
        Raw::NotEq => Token::EqOp(BinaryOp::Ne),
        Raw::Lt => Token::RelOp(BinaryOp::Lt),
        Raw::Gt => Token::RelOp(BinaryOp::Gt),
        Raw::Le => Token::RelOp(BinaryOp::Le),
        Raw::Ge => Token::RelOp(BinaryOp::Ge),
        Raw::AmpAmp => Token::AndAnd,
        Raw::PipePipe => Token::OrOr,
        Raw::Bang => Token::Prefix(UnaryOp::Not),
        Raw::Amp => Token::Amp,
        Raw::Pipe => Token::Pipe,
        Raw::Caret => Token::Caret,
        Raw::Tilde => Token::Prefix(UnaryOp::Compl),
        Raw::Shl => Token::ShiftOp(BinaryOp::Shl),
        Raw::Shr => Token::ShiftOp(BinaryOp::Shr),
        Raw::Question => Token::Question,
        Raw::Colon => Token::Colon,
        Raw::Comma => Token::Comma,
        Raw::Semi => Token::Semi,
        Raw::Dot => Token::Dot,
        Raw::LParen => Token::LParen,
        Raw::RParen => Token::RParen,
        Raw::LBracket => Token::LBracket,
        Raw::RBracket => Token::RBracket,
        Raw::LMeta => Token::LMeta,
        Raw::LBrace => Token::LBrace,
        Raw::RBrace => Token::RBrace,
        _ => return None,
    })
}

/// `shader` and the like begin a shader if an identifier and then `(` or metadata follow, unless a struct has
/// that name. This also applies inside brackets, so that a missing brace before the shader does not hide it.
fn mark_shaders(tokens: &mut [Token]) {
    let structs: FxHashSet<Arc<str>> = tokens
        .windows(2)
        .filter_map(|w| match w {
            [Token::Struct, Token::Ident(name)] => Some(name.clone()),
            _ => None,
        })
        .collect();
    for at in 0..tokens.len() {
        let [Token::Ident(kind), Token::Ident(_), Token::LParen | Token::LMeta | Token::LBrace, ..] =
            &tokens[at..]
        else {
            continue;
        };
        let mark = match &**kind {
            "shader" => ShaderKind::Generic,
            "surface" => ShaderKind::Surface,
            "displacement" => ShaderKind::Displacement,
            "volume" => ShaderKind::Volume,
            _ => continue,
        };
        if !structs.contains(kind) {
            tokens[at] = Token::ShaderKind(mark);
        }
    }
}
