//! The text of a syntax error: the token found, the tokens that would fit, and the likely slip.

use super::words::{describe, words};
use super::{Failure, Stream, foreign, recover};
use crate::ast::TypeName;
use crate::brackets::Brackets;
use crate::diagnostic::Diagnostic;
use crate::errors;
use crate::source::SourceMap;
use crate::span::Span;
use crate::token::Token;

/// The message for a failure. `sources` tells which tokens are on one line.
pub(crate) fn message(stream: &Stream, failure: &Failure, sources: &SourceMap) -> Diagnostic {
    let at = failure.at;
    let span = stream.spans.get(at).copied().unwrap_or(stream.end);
    let found = stream.tokens.get(at).map_or("the end of the file".into(), describe);
    if let Some(d) = unclosed(stream, at, span, &found) {
        return d;
    }
    if let (None, Some(Token::RParen | Token::RBracket | Token::RBrace)) =
        (Brackets::of(&stream.tokens).parent(at), stream.tokens.get(at))
    {
        return errors::stray_closer(span, found.trim_matches('`'));
    }
    if let Some(slip) = foreign::find(stream, failure, sources) {
        return slip.diagnostic;
    }
    if let Some(before) = lacks_semicolon(stream, failure, sources) {
        return errors::missing(Span::new(before.end, before.end), span, &found, ";");
    }
    let d = hint(stream, at, errors::syntax(span, &found, &words(&failure.expected)));
    let expanded =
        stream.tokens.get(at).is_some_and(|t| has_fixed_spelling(t) && fixed_at(sources, span) != found);
    if expanded { d.note("the token comes from the expansion of a macro") } else { d }
}

/// Whether a token cannot continue a statement that could end before it: it closes a block, or begins a
/// statement of its own.
fn begins_statement(stream: &Stream, at: usize) -> bool {
    let before = at.checked_sub(1).and_then(|n| stream.tokens.get(n));
    let is_operand = matches!(
        before,
        Some(
            Token::Ident(_)
                | Token::Int(_)
                | Token::Float(_)
                | Token::Str(_)
                | Token::RParen
                | Token::RBracket
                | Token::Step(_)
        )
    );
    is_operand
        && match stream.tokens.get(at) {
            Some(
                Token::RBrace
                | Token::If
                | Token::For
                | Token::While
                | Token::Do
                | Token::Return
                | Token::Break
                | Token::Continue,
            ) => true,
            Some(Token::Type(_)) => matches!(stream.tokens.get(at + 1), Some(Token::Ident(_))),
            _ => false,
        }
}

/// Whether a `;` seems to be missing at the end of a line, or before a token that begins or ends something;
/// the location of the token before it.
pub(super) fn lacks_semicolon(stream: &Stream, failure: &Failure, sources: &SourceMap) -> Option<Span> {
    let expects = |t: &str| failure.expected.iter().any(|e| e == t);
    let last = failure.at.checked_sub(1)?;
    // Another `;` would fail at the same token again.
    if stream.tokens.get(last) == Some(&Token::Semi) {
        return None;
    }
    let before = *stream.spans.get(last)?;
    let here = stream.spans.get(failure.at).copied().unwrap_or(stream.end);
    let ends = !same_line(sources, before, here) || begins_statement(stream, failure.at);
    let lacks = expects("\";\"") && !expects("\"while\"") && ends;
    lacks.then_some(before)
}

/// Whether the token has only one spelling, so that different text at its location means that a macro made
/// it.
fn has_fixed_spelling(token: &Token) -> bool {
    let words = matches!(token, Token::AndAnd | Token::OrOr | Token::Prefix(_) | Token::Unused);
    !words
        && !matches!(
            token,
            Token::Int(_) | Token::Float(_) | Token::Str(_) | Token::Stray | Token::Bad | Token::BadExpr
        )
}

fn fixed_at(sources: &SourceMap, span: Span) -> String {
    format!("`{}`", sources.text(span))
}

/// A bracket that is still open at the end of the file or statement, or before the shader.
fn unclosed(stream: &Stream, at: usize, span: Span, found: &str) -> Option<Diagnostic> {
    let opener = unclosed_bracket(stream, at)?;
    let opener_span = stream.spans.get(opener).copied()?;
    let bracket = describe(stream.tokens.get(opener)?);
    Some(errors::unclosed(span, found, opener_span, bracket.trim_matches('`')))
}

/// The index of that bracket.
pub(super) fn unclosed_bracket(stream: &Stream, at: usize) -> Option<usize> {
    let brackets = Brackets::of(&stream.tokens);
    let opener = brackets.around(at).find(|o| brackets.partner(*o).is_none_or(|p| p >= at))?;
    let token = stream.tokens.get(opener)?;
    let ends = match stream.tokens.get(at) {
        None | Some(Token::ShaderKind(_)) => true,
        Some(Token::Semi | Token::RBrace) => *token != Token::LBrace && brackets.partner(opener).is_none(),
        Some(_) => false,
    };
    ends.then_some(opener)
}

fn same_line(sources: &SourceMap, a: Span, b: Span) -> bool {
    sources.place(a).map(|p| (p.file, p.line)) == sources.place(b).map(|p| (p.file, p.line))
}

/// Adds a hint about the likely slip.
fn hint(stream: &Stream, at: usize, d: Diagnostic) -> Diagnostic {
    let token = stream.tokens.get(at);
    let before = |n: usize| at.checked_sub(n).and_then(|n| stream.tokens.get(n));
    let top = Brackets::of(&stream.tokens).parent(at).is_none();
    match (before(1), token) {
        (Some(Token::Ident(_)), Some(Token::Assign | Token::Semi | Token::LBracket)) if top => {
            d.help("OSL has no global variables: make it a parameter of the shader, or a macro")
        }
        (_, Some(Token::Else)) => {
            d.help("an `else` needs an `if` with one statement, or a block, right before it")
        }
        (_, Some(Token::LBrace)) if matches!(before(1), Some(Token::Assign)) => {
            d.help("a list in braces may only initialise a declaration, be returned or be an argument")
        }
        (Some(Token::RBracket), Some(Token::LBracket)) => {
            d.help("arrays have one dimension: multiply the lengths, and index `a[i * columns + j]`")
        }
        (Some(Token::Type(_)), Some(Token::LBracket)) => {
            d.help("the length of an array stands after its name: `float a[3]`")
        }
        (Some(Token::Ident(_)), Some(Token::RParen | Token::Comma)) if in_formals(stream, at) => {
            d.help("each parameter has a type before its name: `float x`")
        }
        (Some(Token::Type(TypeName::Void)), Some(Token::RParen)) => d.help("write `()` for no parameters"),
        (Some(Token::Type(_)), Some(_)) if is_keyword(token) => d.help("keywords cannot be names"),
        (Some(Token::ShaderKind(_) | Token::Type(_)), Some(Token::LBrace)) => d,
        (Some(Token::Ident(_)), Some(Token::LBrace)) if top => {
            d.help("a parameter list `( )` stands before the body")
        }
        // `illuminance` and `illuminate`.
        (_, Some(Token::Unused)) => {
            d.help("OSL has no lights in shaders: a surface assigns closures to `Ci`")
        }
        _ => d,
    }
}

/// Whether a token is directly within the parameters of a function or shader.
fn in_formals(stream: &Stream, at: usize) -> bool {
    let opener = Brackets::of(&stream.tokens).parent(at);
    opener.is_some_and(|opener| recover::stand_in(&stream.tokens, opener) == Token::Bad)
}

fn is_keyword(token: Option<&Token>) -> bool {
    token.is_some_and(|t| {
        matches!(
            t,
            Token::Type(_)
                | Token::Break
                | Token::Closure
                | Token::Continue
                | Token::Do
                | Token::Else
                | Token::For
                | Token::If
                | Token::Output
                | Token::Return
                | Token::Struct
                | Token::While
        )
    })
}
