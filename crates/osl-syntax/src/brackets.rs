//! Which bracket belongs to which, in a stream where some may be missing.
//!
//! A `}` closes the nearest `{` and whatever is open inside it; a `)` or `]` closes only what was opened since the
//! last `{`. What finds no partner is left alone.

use crate::token::Token;

/// The brackets of a stream of tokens.
#[derive(Debug)]
pub(crate) struct Brackets {
    /// For each token and for the end: the innermost opener around it.
    parent: Vec<Option<u32>>,
    /// For each opener its closer.
    partner: Vec<Option<u32>>,
    /// Brackets without a partner.
    pub(crate) n_lonely: usize,
}

impl Brackets {
    pub(crate) fn of(tokens: &[Token]) -> Self {
        let mut parent = Vec::with_capacity(tokens.len() + 1);
        let mut partner = vec![None; tokens.len()];
        let mut open: Vec<u32> = Vec::new();
        let mut n_lonely = 0;
        for (at, token) in tokens.iter().enumerate() {
            parent.push(open.last().copied());
            let at = at as u32;
            match token {
                Token::LParen | Token::LBracket | Token::LBrace => open.push(at),
                // It takes two closers.
                Token::LMeta => open.extend([at, at]),
                Token::RParen | Token::RBracket | Token::RBrace => {
                    match open.iter().rposition(|o| closes(&tokens[*o as usize], token)) {
                        Some(n) if *token == Token::RBrace || !passes_brace(tokens, &open[n..]) => {
                            n_lonely += open.len() - n - 1;
                            let opener = open[n] as usize;
                            open.truncate(n);
                            partner[opener] = Some(at);
                        }
                        _ => n_lonely += 1,
                    }
                }
                _ => {}
            }
        }
        parent.push(open.last().copied());
        Self { parent, partner, n_lonely: n_lonely + open.len() }
    }

    /// The innermost opener around token `at`.
    pub(crate) fn parent(&self, at: usize) -> Option<usize> {
        self.parent.get(at).copied().flatten().map(|p| p as usize)
    }

    /// The closer of an opener.
    pub(crate) fn partner(&self, opener: usize) -> Option<usize> {
        self.partner.get(opener).copied().flatten().map(|p| p as usize)
    }

    /// The openers around token `at`, innermost first.
    pub(crate) fn around(&self, at: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(self.parent(at), |o| self.parent(*o))
    }
}

fn passes_brace(tokens: &[Token], open: &[u32]) -> bool {
    open.iter().skip(1).any(|o| tokens.get(*o as usize) == Some(&Token::LBrace))
}

fn closes(opener: &Token, closer: &Token) -> bool {
    matches!(
        (opener, closer),
        (Token::LParen, Token::RParen)
            | (Token::LBracket | Token::LMeta, Token::RBracket)
            | (Token::LBrace, Token::RBrace)
    )
}

/// The closer that an opener asks for.
pub(crate) fn closer(opener: &Token) -> Option<Token> {
    match opener {
        Token::LParen => Some(Token::RParen),
        Token::LBracket | Token::LMeta => Some(Token::RBracket),
        Token::LBrace => Some(Token::RBrace),
        _ => None,
    }
}
