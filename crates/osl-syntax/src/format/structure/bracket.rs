//! Brackets within a statement: parentheses, indices, metadata, initialisers.

use super::super::pieces::{Kind, Piece};
use super::super::role::Role;
use super::Builder;
use super::nesting::Frame;
use crate::diagnostic::Diagnostic;
use crate::token::Token;

impl Builder<'_, '_> {
    /// A piece inside brackets, or a bracket itself.
    pub(super) fn inside(&mut self, at: usize) -> Result<(), Box<Diagnostic>> {
        self.open_line(at, 0);
        let before = self.role_of(self.state.prev);
        let (frame, role) = match self.piece(at).map(|p| &p.kind) {
            Some(Kind::Fixed(Token::LParen)) => {
                (Frame::Paren, if before.is_callee() { Role::Call } else { Role::Group })
            }
            Some(Kind::Fixed(Token::LBracket)) => (Frame::Bracket, Role::Call),
            Some(Kind::Fixed(Token::LMeta)) => (Frame::Meta, Role::MetaOpen),
            Some(Kind::Fixed(Token::LBrace)) => (Frame::List, Role::ListOpen),
            Some(Kind::Fixed(closer @ (Token::RParen | Token::RBracket | Token::RBrace))) => {
                let closer = closer.clone();
                return self.close(at, &closer);
            }
            _ => {
                let role = self.role(at);
                self.place(at, role);
                return Ok(());
            }
        };
        self.place(at, role);
        self.push(frame, at, self.state.indent.unwrap_or(0));
        Ok(())
    }

    /// A closing bracket within a statement.
    fn close(&mut self, at: usize, closer: &Token) -> Result<(), Box<Diagnostic>> {
        let Some(node) = self.top().filter(|n| n.depth > 0) else {
            return Err(self.stray(at));
        };
        let role = match (node.frame, closer) {
            (Frame::Meta, Token::RBracket) => {
                self.place(at, Role::MetaMid);
                self.pop();
                self.push(Frame::MetaEnd, node.opener, node.indent);
                return Ok(());
            }
            (Frame::Paren, Token::RParen) if self.is_cast(node.opener) => Role::CastClose,
            (Frame::Paren, Token::RParen) | (Frame::Bracket, Token::RBracket) => Role::Close,
            (Frame::MetaEnd, Token::RBracket) => Role::MetaClose,
            (Frame::List, Token::RBrace) => Role::ListClose,
            _ => {
                let piece = self.piece(at);
                let found = piece.map_or(String::new(), |p| format!("`{}`", p.text));
                return Err(self.unclosed(node, piece.map(Piece::span).unwrap_or_default(), &found));
            }
        };
        self.pop();
        self.place(at, role);
        if let Some(fact) = self.facts.get_mut(at) {
            fact.opener = Some(node.opener);
        }
        if node.depth == 1
            && *closer == Token::RParen
            && let Some(word) = self.state.head
        {
            self.body(at, word, false);
        }
        Ok(())
    }

    /// Whether the current `)` makes a cast of the text since the `(`.
    fn is_cast(&self, opener: usize) -> bool {
        self.role_of(Some(opener)) == Role::Group
            && self.next_code.get(opener).copied().flatten() == self.state.prev
            && self.role_of(self.state.prev) == Role::Type
    }
}
