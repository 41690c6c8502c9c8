//! Slips of beginners that leave one reading: a comma or semicolon between parts that is missing or is the
//! other one, a misspelt keyword, a condition without parentheses, an operator of another language.
//!
//! A slip has its own message, with the edit, and a remedy: the tokens that recovery reads instead, so that
//! the rest of the statement is still checked. Larger constructs of other languages are in `foreign`.

use super::recover::{is_init_list, stand_in};
use super::words::{describe, words};
use super::{Failure, Stream};
use crate::ast::BinaryOp;
use crate::brackets::Brackets;
use crate::diagnostic::{Diagnostic, Edit};
use crate::errors;
use crate::source::SourceMap;
use crate::span::Span;
use crate::spelling::closest;
use crate::token::Token;
use std::ops::Range;

/// A slip: its message, and what to read instead.
pub(crate) struct Slip {
    pub(super) diagnostic: Diagnostic,
    pub(super) remedy: Remedy,
    /// The part of the file about which the remedy is a guess, if that is more than its own place.
    pub(super) guess: Option<Span>,
}

/// Replacements of tokens, in order.
pub(super) type Remedy = Vec<(Range<usize>, Vec<(Token, Span)>)>;

/// The words that begin a statement, with their tokens.
const STATEMENTS: [(&str, Token); 8] = [
    ("if", Token::If),
    ("else", Token::Else),
    ("for", Token::For),
    ("while", Token::While),
    ("do", Token::Do),
    ("return", Token::Return),
    ("break", Token::Break),
    ("continue", Token::Continue),
];

/// Maximum number of tokens of a condition.
const MAX_CONDITION: usize = 200;

/// The slip behind a failure, if there is one.
pub(crate) fn find(stream: &Stream, failure: &Failure, sources: &SourceMap) -> Option<Slip> {
    let slips = Slips::new(stream, failure, sources);
    slips
        .keyword()
        .or_else(|| slips.operator())
        .or_else(|| slips.decimal_comma())
        .or_else(|| slips.condition())
        .or_else(|| slips.head_of_for())
        .or_else(|| slips.space())
        .or_else(|| slips.comma())
}

/// The misspelt keyword behind a failure, if there is one: no missing token explains it.
pub(crate) fn misspelt(stream: &Stream, failure: &Failure, sources: &SourceMap) -> Option<Slip> {
    Slips::new(stream, failure, sources).keyword()
}

/// Replaces the tokens of a slip by those that were meant. Returns the places of the replacements.
pub(super) fn mend(stream: &mut Stream, slip: Slip) -> Vec<Span> {
    let mut places: Vec<Span> = slip.guess.into_iter().collect();
    for (range, tokens) in slip.remedy.into_iter().rev() {
        places.extend(tokens.first().map(|(_, span)| *span));
        let spans: Vec<Span> = tokens.iter().map(|(_, span)| *span).collect();
        stream.tokens.splice(range.clone(), tokens.into_iter().map(|(token, _)| token));
        stream.spans.splice(range, spans);
    }
    places
}

impl Slip {
    /// Whether it tells what to read instead.
    pub(super) fn has_remedy(&self) -> bool {
        !self.remedy.is_empty()
    }
}

pub(super) struct Slips<'a> {
    pub(super) stream: &'a Stream,
    pub(super) failure: &'a Failure,
    pub(super) sources: &'a SourceMap,
    pub(super) at: usize,
}

impl<'a> Slips<'a> {
    pub(super) fn new(stream: &'a Stream, failure: &'a Failure, sources: &'a SourceMap) -> Self {
        Self { stream, failure, sources, at: failure.at }
    }
}

impl Slips<'_> {
    pub(super) fn token(&self, at: usize) -> Option<&Token> {
        self.stream.tokens.get(at)
    }

    /// The token this many places before the failure.
    pub(super) fn before(&self, n: usize) -> Option<&Token> {
        self.token(self.at.checked_sub(n)?)
    }

    pub(super) fn span(&self, at: usize) -> Span {
        self.stream.spans.get(at).copied().unwrap_or(self.stream.end)
    }

    pub(super) fn here(&self) -> Span {
        self.span(self.at)
    }

    fn expects(&self, terminal: &str) -> bool {
        self.failure.expected.iter().any(|e| e.trim_matches('"') == terminal)
    }

    pub(super) fn found(&self) -> String {
        self.token(self.at).map_or("the end of the file".into(), describe)
    }

    /// The text between two tokens in the same file, if they were written there in this order.
    pub(super) fn between(&self, first: usize, second: usize) -> Option<&str> {
        let (a, b) = (self.span(first), self.span(second));
        let file = self.sources.file_at(a.start)?;
        if a.end > b.start {
            return None;
        }
        file.text.get((a.end - file.base) as usize..b.start.checked_sub(file.base)? as usize)
    }

    /// Whether two tokens stand side by side without a space.
    fn adjacent(&self, first: usize, second: usize) -> bool {
        self.between(first, second) == Some("")
    }

    /// The end of the token before the failure, if text can be inserted there.
    fn end_before(&self) -> Option<Span> {
        let last = self.at.checked_sub(1)?;
        self.between(last, self.at)?;
        let end = self.span(last).end;
        Some(Span::new(end, end))
    }

    /// `retrun x * 2;`, `whlie (…) {`: the statement begins with a name that resembles a keyword.
    fn keyword(&self) -> Option<Slip> {
        let brackets = Brackets::of(&self.stream.tokens);
        brackets.block(self.at)?;
        let before = self.stream.tokens.get(..self.at)?;
        let ends = |token: &Token| {
            matches!(token, Token::Semi | Token::LBrace | Token::RBrace | Token::RParen | Token::Else)
        };
        let start = match before.last() {
            // `whlie (x < 1) {`: the word stands before the parenthesis.
            Some(Token::RParen) => {
                let opener = (0..self.at).rev().find(|n| brackets.partner(*n) == Some(self.at - 1))?;
                let word = opener.checked_sub(1)?;
                word.checked_sub(1).and_then(|n| self.token(n)).filter(|token| ends(token))?;
                word
            }
            _ => {
                let head = brackets.parent(self.at).filter(|n| self.token(*n) == Some(&Token::LParen));
                match head {
                    // `fro (int i`: the failure is within the parenthesis.
                    Some(opener) => opener.checked_sub(1)?,
                    None => before.iter().rposition(ends).map_or(0, |n| n + 1),
                }
            }
        };
        let follows = self.token(start + 1)?;
        let in_head = before.last() != Some(&Token::RParen) && *follows == Token::LParen;
        if matches!(
            follows,
            Token::Assign | Token::OpAssign(_) | Token::Dot | Token::LBracket | Token::Step(_)
        ) {
            return None;
        }
        let Some(Token::Ident(name)) = self.token(start) else { return None };
        let span = self.span(start);
        let else_if = ["elif", "elsif", "elseif", "elseIf", "Elif"].contains(&&**name);
        let (word, tokens) = if else_if {
            ("else if", vec![(Token::Else, span), (Token::If, span)])
        } else {
            let word = closest(name, STATEMENTS.iter().map(|(word, _)| *word))?;
            if in_head && word != "for" {
                return None;
            }
            let token =
                STATEMENTS.iter().find(|(known, _)| *known == word).map(|(_, token)| token.clone())?;
            (word, vec![(token, span)])
        };
        let d = errors::misspelt_keyword(span, name, word, self.is_written(start, name));
        Some(Slip { diagnostic: d, remedy: vec![(start..start + 1, tokens)], guess: None })
    }

    fn is_written(&self, at: usize, text: &str) -> bool {
        self.sources.text(self.span(at)) == text
    }

    /// `=>`, `=<`, `<>`, `->` and `**`.
    fn operator(&self) -> Option<Slip> {
        let last = self.at.checked_sub(1)?;
        if !self.adjacent(last, self.at) {
            return None;
        }
        let (token, written) = match (self.token(last)?, self.token(self.at)?) {
            (Token::Assign, Token::RelOp(BinaryOp::Gt)) => (Token::RelOp(BinaryOp::Ge), ">="),
            (Token::Assign, Token::RelOp(BinaryOp::Lt)) => (Token::RelOp(BinaryOp::Le), "<="),
            (Token::RelOp(BinaryOp::Lt), Token::RelOp(BinaryOp::Gt)) => (Token::EqOp(BinaryOp::Ne), "!="),
            (Token::Minus, Token::RelOp(BinaryOp::Gt)) => (Token::Dot, "."),
            (Token::MulOp(BinaryOp::Mul), Token::MulOp(BinaryOp::Mul)) => {
                let d = errors::syntax(self.here(), &self.found(), "an operand")
                    .help("OSL has no operator for powers: write `pow(a, b)`");
                return Some(Slip { diagnostic: d, remedy: Vec::new(), guess: None });
            }
            _ => return None,
        };
        let span = self.span(last).to(self.here());
        let d = errors::foreign_operator(span, self.sources.text(span), written);
        Some(Slip { diagnostic: d, remedy: vec![(last..self.at + 1, vec![(token, span)])], guess: None })
    }

    /// `float x = 2,5;`
    fn decimal_comma(&self) -> Option<Slip> {
        let (comma, whole) = (self.at.checked_sub(1)?, self.at.checked_sub(2)?);
        let digits = |at| matches!(self.token(at), Some(Token::Int(_)));
        // `1,2,3}` is a list that lacks its brace.
        let in_list = self.token(self.at + 1) == Some(&Token::Comma)
            || whole.checked_sub(1).and_then(|n| self.token(n)) == Some(&Token::Comma);
        let tight = self.adjacent(whole, comma) && self.adjacent(comma, self.at) && !in_list;
        if !digits(whole) || !digits(self.at) || self.token(comma) != Some(&Token::Comma) || !tight {
            return None;
        }
        let span = self.span(whole).to(self.here());
        let d = errors::decimal_comma(span, self.span(comma));
        Some(Slip {
            diagnostic: d,
            remedy: vec![(whole..self.at + 1, vec![(Token::Float(0.5), span)])],
            guess: None,
        })
    }

    /// `point "shader" (0, 0, 0)`, as in the RenderMan Shading Language.
    fn space(&self) -> Option<Slip> {
        let Some(Token::Type(_)) = self.before(1) else { return None };
        let (name @ Token::Str(_), Token::LParen) = (self.token(self.at)?, self.token(self.at + 1)?) else {
            return None;
        };
        let (here, open) = (self.here(), self.span(self.at + 1));
        self.between(self.at, self.at + 1)?;
        let both = self.end_before()?.to(open);
        let d = errors::space_before_values(both, here, self.sources.text(here));
        let tokens = vec![(Token::LParen, open), (name.clone(), here), (Token::Comma, here)];
        Some(Slip { diagnostic: d, remedy: vec![(self.at..self.at + 2, tokens)], guess: None })
    }

    /// `if x > 0 {`, `while x > 0 {`, and `if (x > 0 {`.
    fn condition(&self) -> Option<Slip> {
        let word = |token: Option<&Token>| match token {
            Some(Token::If) => Some("if"),
            Some(Token::While) => Some("while"),
            _ => None,
        };
        if let Some(word) = word(self.before(1)).filter(|_| self.expects("(")) {
            let brackets = Brackets::of(&self.stream.tokens);
            let block = brackets.block(self.at);
            let end = (self.at..self.at.saturating_add(MAX_CONDITION)).find(|n| {
                matches!(self.token(*n), None | Some(Token::LBrace | Token::Semi | Token::RBrace))
            })?;
            let whole = self.token(end) == Some(&Token::LBrace) && brackets.block(end) == block;
            let d = errors::syntax(self.here(), &self.found(), "`(`")
                .help(format!("the condition stands in parentheses: `{word} (x > 0) {{ … }}`"));
            if !whole || end == self.at || self.between(self.at, end - 1).is_none() && end - 1 != self.at {
                return Some(Slip { diagnostic: d, remedy: Vec::new(), guess: None });
            }
            let (open, close) = (self.here().start, self.span(end - 1).end);
            let (open, close) = (Span::new(open, open), Span::new(close, close));
            let edits = vec![insertion(open, "("), insertion(close, ")")];
            let remedy = vec![
                (self.at..self.at, vec![(Token::LParen, open)]),
                (end..end, vec![(Token::RParen, close)]),
            ];
            return Some(Slip { diagnostic: d.fix("add the parentheses", edits), remedy, guess: None });
        }
        if self.token(self.at) != Some(&Token::LBrace) || !self.expects(")") {
            return None;
        }
        let opener = Brackets::of(&self.stream.tokens).parent(self.at)?;
        let word = word(opener.checked_sub(1).and_then(|n| self.token(n)))?;
        if self.token(opener) != Some(&Token::LParen) {
            return None;
        }
        let end = self.end_before()?;
        let d = errors::missing(end, self.here(), &self.found(), ")")
            .also(self.span(opener), format!("the condition of this `{word}` begins here"));
        Some(Slip {
            diagnostic: d,
            remedy: vec![(self.at..self.at, vec![(Token::RParen, end)])],
            guess: None,
        })
    }

    /// `for (int i = 0, i < 3, i++)`
    fn head_of_for(&self) -> Option<Slip> {
        let brackets = Brackets::of(&self.stream.tokens);
        let opener = brackets.parent(self.at)?;
        if opener.checked_sub(1).and_then(|n| self.token(n)) != Some(&Token::For) {
            return None;
        }
        let end = brackets.partner(opener)?;
        let own = |token: Token| {
            let own = |n: &usize| self.token(*n) == Some(&token) && brackets.parent(*n) == Some(opener);
            (opener + 1..end).filter(own).collect::<Vec<usize>>()
        };
        let (commas, semicolons) = (own(Token::Comma), own(Token::Semi));
        let [first, second] = commas[..] else { return None };
        if !semicolons.is_empty() {
            return None;
        }
        let d = errors::commas_in_for(self.span(first), self.span(second));
        let as_semicolon = |at: usize| (at..at + 1, vec![(Token::Semi, self.span(at))]);
        Some(Slip { diagnostic: d, remedy: vec![as_semicolon(first), as_semicolon(second)], guess: None })
    }

    /// A comma that is missing between parameters, arguments or elements, or is a semicolon.
    fn comma(&self) -> Option<Slip> {
        if !self.expects(",") || self.before(1) == Some(&Token::Comma) {
            return None;
        }
        let brackets = Brackets::of(&self.stream.tokens);
        let opener = brackets.parent(self.at)?;
        // In a list that never ends, more than a comma is missing.
        brackets.partner(opener)?;
        let tokens = &self.stream.tokens;
        let is_for = opener.checked_sub(1).and_then(|n| self.token(n)) == Some(&Token::For);
        let is_list = match self.token(opener)? {
            Token::LParen => {
                let name = opener.checked_sub(1).and_then(|n| self.token(n));
                !is_for && matches!(name, Some(Token::Ident(_) | Token::Type(_)))
            }
            Token::LMeta => true,
            Token::LBrace => is_init_list(tokens, opener, &mut None),
            _ => false,
        };
        if !is_list {
            return None;
        }
        let declares = stand_in(tokens, opener) == Token::Bad;
        let next = self.token(self.at)?;
        if *next == Token::Semi && declares {
            return self.semicolon_for_comma();
        }
        let begins = match declares {
            true => self.begins_parameter(self.at),
            false => matches!(
                next,
                Token::Ident(_) | Token::Int(_) | Token::Float(_) | Token::Str(_) | Token::Type(_)
            ),
        };
        if !begins {
            return None;
        }
        // A bracket without a partner is the more likely reason.
        if !declares && brackets.n_lonely > 0 {
            return None;
        }
        let end = self.end_before()?;
        let number = matches!(self.before(1), Some(Token::Int(_) | Token::Float(_)));
        let factor = !declares && number && matches!(next, Token::Ident(_) | Token::Type(_));
        let (d, token) = match factor {
            true => (errors::missing_operator(end, self.here()), Token::MulOp(BinaryOp::Mul)),
            false => (errors::missing(end, self.here(), &self.found(), ","), Token::Comma),
        };
        // The arguments may be others, so the call is not judged.
        let close = brackets.partner(opener).map(|n| self.span(n));
        let call = self.span(opener.saturating_sub(1)).to(close.unwrap_or(end));
        let remedy = vec![(self.at..self.at, vec![(token, end)])];
        Some(Slip { diagnostic: d, remedy, guess: (!declares).then_some(call) })
    }

    /// Whether a parameter or an entry of metadata begins at a token.
    fn begins_parameter(&self, at: usize) -> bool {
        match self.token(at) {
            Some(Token::Output | Token::Closure) => true,
            Some(Token::Type(_) | Token::Ident(_)) => matches!(self.token(at + 1), Some(Token::Ident(_))),
            _ => false,
        }
    }

    fn semicolon_for_comma(&self) -> Option<Slip> {
        if !self.begins_parameter(self.at + 1) {
            return None;
        }
        let here = self.here();
        let d = errors::syntax(here, &self.found(), &words(&self.failure.expected))
            .help("parameters are separated by commas")
            .fix("write a comma", vec![Edit { span: here, text: ",".to_owned() }]);
        Some(Slip {
            diagnostic: d,
            remedy: vec![(self.at..self.at + 1, vec![(Token::Comma, here)])],
            guess: None,
        })
    }
}

pub(super) fn insertion(at: Span, text: &str) -> Edit {
    Edit { span: at, text: text.to_owned() }
}
