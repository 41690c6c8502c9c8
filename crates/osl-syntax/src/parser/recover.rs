//! Recovery: replaces the smallest construct around an error by a stand-in that the grammar knows, so that
//! the rest of the file is read as if the construct had not been there.

use super::Stream;
use crate::brackets::{Brackets, closer};
use crate::gaps::Gaps;
use crate::span::Span;
use crate::token::Token;
use std::ops::{Range, RangeInclusive};

/// Replaces the smallest construct around token `at` by a stand-in, and records the gap. Returns false if
/// nothing is left to cut.
pub(super) fn cut(stream: &mut Stream, at: usize, gaps: &mut Gaps) -> bool {
    let brackets = Brackets::of(&stream.tokens);
    if matches!(stream.tokens.get(at), None | Some(Token::ShaderKind(_))) && brackets.parent(at).is_some() {
        return close_all(stream, &brackets, at, gaps);
    }
    let mut lists = None;
    for opener in brackets.around(at) {
        let Some(token) = stream.tokens.get(opener) else { return false };
        let is_list = *token != Token::LBrace || is_init_list(&stream.tokens, opener, &mut lists);
        match brackets.partner(opener) {
            Some(end) if is_list => {
                // Metadata ends at the first of its two brackets.
                let two = *token == Token::LMeta && stream.tokens.get(end - 1) == Some(&Token::RBracket);
                let end = if two { end - 1 } else { end };
                if replace_in_list(stream, &brackets, opener, end, at, gaps) {
                    return true;
                }
            }
            // Parameters that are never closed: declarations cannot be told apart until the next shader.
            None if is_list && brackets.parent(opener).is_none() => {
                return replace_rest(stream, opener, gaps);
            }
            // A parenthesis that is never closed: its statement ends at the next semicolon.
            None if is_list => {}
            end => return replace_statement(stream, &brackets, Some(opener), end, at, gaps),
        }
    }
    replace_statement(stream, &brackets, None, None, at, gaps)
}

/// Inserts a `;` before token `at`, after the token at `before`.
pub(super) fn insert_semicolon(stream: &mut Stream, at: usize, before: Span, gaps: &mut Gaps) {
    let here = Span::new(before.end, before.end);
    stream.tokens.insert(at, Token::Semi);
    stream.spans.insert(at, here);
    gaps.add(here);
}

/// Whether an error at token `at` only continues the one before: recovery has cut what precedes it in the
/// file, in the block or in the list, and nothing like a declaration begins in between.
pub(super) fn is_echo(stream: &Stream, at: usize) -> bool {
    let tokens = &stream.tokens;
    let brackets = Brackets::of(tokens);
    let opener = brackets.parent(at);
    let in_block = opener.is_none_or(|opener| {
        tokens.get(opener) == Some(&Token::LBrace) && !is_init_list(tokens, opener, &mut None)
    });
    let begins = |n: &usize| {
        let begins = match tokens.get(*n) {
            Some(Token::Bad) => true,
            Some(Token::Semi) => in_block,
            Some(Token::Comma) => !in_block,
            Some(Token::RBrace) => in_block && closes_block(stream, &brackets, opener, *n),
            _ => false,
        };
        // A closing bracket has its own opening one as its parent.
        begins && (tokens.get(*n) == Some(&Token::RBrace) || brackets.parent(*n) == opener)
    };
    let Some(before) = (0..at).rev().find(begins) else { return false };
    let first = before + 1;
    let is_cut = |n: usize| tokens.get(n).is_some_and(is_stand_in);
    match opener {
        None => is_cut(before) && !begins_declaration(tokens, first),
        Some(_) if in_block => {
            let ends = [Token::RParen, Token::RBracket, Token::Comma, Token::Colon, Token::Else];
            is_cut(before) && tokens.get(at).is_some_and(|token| ends.contains(token))
        }
        Some(opener) => {
            let head = matches!(tokens.get(first), Some(Token::Type(_) | Token::Output | Token::Closure));
            let declares = stand_in(tokens, opener) == Token::Bad;
            before.checked_sub(1).is_some_and(is_cut) && !(declares && head)
        }
    }
}

/// Whether the tokens from `at` look like the beginning of a function, a struct or a shader.
fn begins_declaration(tokens: &[Token], at: usize) -> bool {
    let at = at + usize::from(tokens.get(at) == Some(&Token::Closure));
    matches!(
        tokens.get(at..).unwrap_or_default(),
        [Token::Struct | Token::ShaderKind(_), ..]
            | [Token::Type(_) | Token::Ident(_), Token::Ident(_), Token::LParen | Token::LMeta, ..]
    )
}

/// Whether a bracket that seems never to be closed only continues an earlier error: recovery has cut
/// something after it in the same declaration, and that may have held its end.
pub(super) fn may_be_closed(stream: &Stream, opener: usize, at: usize) -> bool {
    let mut inside = opener + 1..at;
    let decides =
        |n: &usize| stream.tokens.get(*n).is_some_and(is_stand_in) || begins_declaration(&stream.tokens, *n);
    inside.find(decides).is_some_and(|n| stream.tokens.get(n).is_some_and(is_stand_in))
}

/// Closes everything that is open before token `at`, which is the shader or the end of the text.
fn close_all(stream: &mut Stream, brackets: &Brackets, at: usize, gaps: &mut Gaps) -> bool {
    let here = stream.spans.get(at).copied().unwrap_or(stream.end);
    let here = Span::new(here.start, here.start);
    let mut closers: Vec<Token> = Vec::new();
    let mut parent = brackets.parent(at);
    while let Some(opener) = parent {
        closers.extend(stream.tokens.get(opener).and_then(closer));
        let outer = brackets.parent(opener);
        parent = outer;
    }
    if stream.tokens.get(at.wrapping_sub(1)) == Some(&Token::Bad) && closers.is_empty() {
        return false;
    }
    gaps.add(here);
    let spans = vec![here; closers.len()];
    stream.tokens.splice(at..at, closers);
    stream.spans.splice(at..at, spans);
    true
}

/// Whether a `{` opens an initialiser list rather than a block. The token before the first `{` of a sequence
/// decides for all of them; `known` caches the last examined sequence, from its first `{`, and the answer.
pub(super) fn is_init_list(
    tokens: &[Token],
    opener: usize,
    known: &mut Option<(RangeInclusive<usize>, bool)>,
) -> bool {
    if let Some((_, is_list)) = known.as_ref().filter(|(row, _)| row.contains(&opener)) {
        return *is_list;
    }
    let before = tokens.get(..opener).unwrap_or_default();
    let first = opener - before.iter().rev().take_while(|t| **t == Token::LBrace).count();
    let is_list = matches!(
        first.checked_sub(1).and_then(|n| tokens.get(n)),
        Some(Token::Assign | Token::Comma | Token::LParen | Token::Return)
    );
    *known = Some((first..=opener, is_list));
    is_list
}

fn is_stand_in(token: &Token) -> bool {
    matches!(token, Token::Bad | Token::BadExpr)
}

/// Replaces one element of a bracketed list, or the whole list; false if it is a stand-in already.
fn replace_in_list(
    stream: &mut Stream,
    brackets: &Brackets,
    opener: usize,
    end: usize,
    at: usize,
    gaps: &mut Gaps,
) -> bool {
    let all = opener + 1..end;
    let whole = opener.checked_sub(1).and_then(|n| stream.tokens.get(n)) == Some(&Token::For);
    let comma =
        |n: &usize| stream.tokens.get(*n) == Some(&Token::Comma) && brackets.parent(*n) == Some(opener);
    let from = (all.start..at).rev().find(comma).map_or(all.start, |n| n + 1);
    let to = (at..all.end).find(comma).unwrap_or(all.end);
    let part = if whole { all.clone() } else { from..to };
    let stand_in = stand_in(&stream.tokens, opener);
    for range in [part, all] {
        let done =
            stream.tokens.get(range.clone()).is_some_and(|t| t.len() == 1 && t.iter().all(is_stand_in));
        if !done && range.start <= range.end {
            replace(stream, range, stand_in, gaps);
            return true;
        }
    }
    false
}

/// The stand-in for an element of the list that `opener` opens: a declaration or an expression.
pub(super) fn stand_in(tokens: &[Token], opener: usize) -> Token {
    let before = |n: usize| opener.checked_sub(n).and_then(|n| tokens.get(n));
    let declares = match (tokens.get(opener), before(1)) {
        (Some(Token::LMeta), _) | (_, Some(Token::For | Token::RBracket)) => true,
        (Some(Token::LParen), Some(Token::Ident(_))) => {
            matches!(before(2), Some(Token::Ident(_) | Token::Type(_) | Token::ShaderKind(_)))
        }
        _ => false,
    };
    if declares { Token::Bad } else { Token::BadExpr }
}

/// Replaces the statement or declaration around token `at` in the block that `opener` opens, or in the file.
fn replace_statement(
    stream: &mut Stream,
    brackets: &Brackets,
    opener: Option<usize>,
    end: Option<usize>,
    at: usize,
    gaps: &mut Gaps,
) -> bool {
    let block = opener.map_or(0, |o| o + 1)..end.unwrap_or(stream.tokens.len());
    let ends = |n: &usize| {
        brackets.parent(*n) == opener && stream.tokens.get(*n) == Some(&Token::Semi)
            || (closes_block(stream, brackets, opener, *n))
    };
    // The stand-in itself does not fit: the statement before it is replaced too.
    let again = stream.tokens.get(at).is_some_and(is_stand_in);
    let mut behind = (block.start..at).rev().filter(ends);
    let start = if again { behind.nth(1) } else { behind.next() }.map_or(block.start, |n| n + 1);
    // A `;` in parentheses counts too, since their end may be missing.
    let in_block = |n: usize| brackets.block(n) == opener;
    let stop = |n: &usize| match stream.tokens.get(*n) {
        Some(Token::Semi) => in_block(*n),
        Some(Token::ShaderKind(_)) => opener.is_none() && *n > at,
        _ => closes_block(stream, brackets, opener, *n),
    };
    let to = (at..block.end).find(stop).map_or(block.end, |n| match stream.tokens.get(n) {
        Some(Token::ShaderKind(_)) => n,
        // `float a[2] = {1, 2};` at file level
        Some(Token::RBrace) if opener.is_none() && stream.tokens.get(n + 1) == Some(&Token::Semi) => n + 2,
        _ => n + 1,
    });
    let range = start..to.max(start);
    let global = match stream.tokens.get(range.clone()) {
        Some([Token::Type(_), Token::Ident(name), Token::Assign | Token::LBracket | Token::Semi, ..])
            if opener.is_none() =>
        {
            Some(name.clone())
        }
        _ => None,
    };
    let done = stream.tokens.get(range.clone()).is_some_and(|t| t.len() == 1 && t.iter().all(is_stand_in));
    if done {
        return false;
    }
    replace(stream, range, Token::Bad, gaps);
    if let (Some(name), Some(gap)) = (global, gaps.list.last_mut()) {
        gap.declarations.insert(name);
    }
    true
}

/// Replaces everything from the declaration around `opener` up to the next shader.
fn replace_rest(stream: &mut Stream, opener: usize, gaps: &mut Gaps) -> bool {
    let ends = |n: &usize| matches!(stream.tokens.get(*n), Some(Token::Semi | Token::RBrace));
    let start = (0..opener).rev().find(ends).map_or(0, |n| n + 1);
    let shader = |n: &usize| matches!(stream.tokens.get(*n), Some(Token::ShaderKind(_)));
    let to = (opener..stream.tokens.len()).find(shader).unwrap_or(stream.tokens.len());
    replace(stream, start..to, Token::Bad, gaps);
    true
}

/// Whether token `at` closes a block directly inside the block of `opener`, with no `else` after it.
fn closes_block(stream: &Stream, brackets: &Brackets, opener: Option<usize>, at: usize) -> bool {
    if stream.tokens.get(at) != Some(&Token::RBrace) || stream.tokens.get(at + 1) == Some(&Token::Else) {
        return false;
    }
    match brackets.parent(at) {
        Some(own) => brackets.parent(own) == opener && brackets.partner(own) == Some(at),
        None => opener.is_none(),
    }
}

fn replace(stream: &mut Stream, range: Range<usize>, stand_in: Token, gaps: &mut Gaps) {
    let covered = stream.spans.get(range.clone()).unwrap_or_default();
    let here = stream.spans.get(range.start).copied().unwrap_or(stream.end);
    let span = covered.iter().fold(covered.first().copied().unwrap_or(here), |s, t| s.to(*t));
    gaps.add_lost(span, stream.tokens.get(range.clone()).unwrap_or_default());
    stream.tokens.splice(range.clone(), [stand_in]);
    stream.spans.splice(range, [span]);
}
