//! Matches brackets in a stream in which some may be missing.
//!
//! A `}` closes the nearest `{` and everything open inside it; a `)` or `]` closes only brackets opened since
//! the last `{`. Brackets without a partner are ignored.

use crate::token::Token;

/// The brackets of a stream of tokens.
#[derive(Debug)]
pub(crate) struct Brackets {
    /// For each token and for the end: the innermost opening bracket around it.
    parent: Vec<Option<u32>>,
    /// For each opening bracket, its closing bracket.
    partner: Vec<Option<u32>>,
    /// For each token, the innermost `{` around it, stored because the path through many open parentheses
    /// would be long.
    block: Vec<Option<u32>>,
    /// Number of brackets without a partner.
    pub(crate) n_lonely: usize,
}

/// Opening brackets that are not closed yet, also listed by kind, so that a closing bracket finds its partner
/// without a search.
#[derive(Default)]
struct Open {
    /// Token indices, outermost first.
    all: Vec<u32>,
    /// Indices into `all`, in ascending order, by [`kind`].
    by_kind: [Vec<usize>; 3],
}

impl Open {
    fn push(&mut self, at: u32, kind: usize) {
        if let Some(of_kind) = self.by_kind.get_mut(kind) {
            of_kind.push(self.all.len());
        }
        self.all.push(at);
    }

    /// The innermost `{`.
    fn block(&self) -> Option<u32> {
        let [.., braces] = &self.by_kind;
        self.all.get(*braces.last()?).copied()
    }

    /// Closes the opening bracket for a closing bracket of this kind, with everything open inside it. Returns
    /// that bracket, and the number of brackets inside it that stay without a partner.
    fn close(&mut self, kind: usize) -> Option<(u32, usize)> {
        let nearest = self.by_kind.get(kind)?.last().copied()?;
        let [.., braces] = &self.by_kind;
        if kind != BRACE && braces.last().is_some_and(|brace| *brace > nearest) {
            return None;
        }
        let opener = self.all.get(nearest).copied()?;
        let n_inside = self.all.len() - nearest - 1;
        self.all.truncate(nearest);
        for of_kind in &mut self.by_kind {
            while of_kind.last().is_some_and(|index| *index >= nearest) {
                of_kind.pop();
            }
        }
        Some((opener, n_inside))
    }
}

impl Brackets {
    pub(crate) fn of(tokens: &[Token]) -> Self {
        let mut parent = Vec::with_capacity(tokens.len() + 1);
        let mut partner = vec![None; tokens.len()];
        let mut block = Vec::with_capacity(tokens.len());
        let mut open = Open::default();
        let mut n_lonely = 0;
        for (at, token) in tokens.iter().enumerate() {
            parent.push(open.all.last().copied());
            block.push(open.block());
            let at = at as u32;
            let Some((kind, is_opener)) = kind(token) else { continue };
            if is_opener {
                open.push(at, kind);
                if *token == Token::LMeta {
                    // It takes two closing brackets.
                    open.push(at, kind);
                }
            } else if let Some((opener, n_inside)) = open.close(kind) {
                n_lonely += n_inside;
                if let Some(partner) = partner.get_mut(opener as usize) {
                    *partner = Some(at);
                }
            } else {
                n_lonely += 1;
            }
        }
        parent.push(open.all.last().copied());
        Self { parent, partner, block, n_lonely: n_lonely + open.all.len() }
    }

    /// The innermost opening bracket around token `at`.
    pub(crate) fn parent(&self, at: usize) -> Option<usize> {
        self.parent.get(at).copied().flatten().map(|p| p as usize)
    }

    /// The closing bracket of an opening one.
    pub(crate) fn partner(&self, opener: usize) -> Option<usize> {
        self.partner.get(opener).copied().flatten().map(|p| p as usize)
    }

    /// The innermost `{` around token `at`.
    pub(crate) fn block(&self, at: usize) -> Option<usize> {
        self.block.get(at).copied().flatten().map(|p| p as usize)
    }

    /// The opening brackets around token `at`, innermost first.
    pub(crate) fn around(&self, at: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(self.parent(at), |o| self.parent(*o))
    }
}

/// The kind of `{` and `}`.
const BRACE: usize = 2;

/// The kind of a bracket, and whether it opens; `None` for other tokens.
fn kind(token: &Token) -> Option<(usize, bool)> {
    match token {
        Token::LParen => Some((0, true)),
        Token::RParen => Some((0, false)),
        Token::LBracket | Token::LMeta => Some((1, true)),
        Token::RBracket => Some((1, false)),
        Token::LBrace => Some((BRACE, true)),
        Token::RBrace => Some((BRACE, false)),
        _ => None,
    }
}

/// The closing bracket that an opening one requires.
pub(crate) fn closer(opener: &Token) -> Option<Token> {
    match opener {
        Token::LParen => Some(Token::RParen),
        Token::LBracket | Token::LMeta => Some(Token::RBracket),
        Token::LBrace => Some(Token::RBrace),
        _ => None,
    }
}
