//! Statements and blocks: recognised by `;`, braces and control-flow keywords, without a grammar.

use super::super::pieces::{Kind, Piece};
use super::super::role::{self, Role};
use super::Builder;
use super::nesting::{Frame, Node, State, Word};
use crate::diagnostic::Diagnostic;
use crate::token::Token;

impl Builder<'_, '_> {
    /// The first piece of a statement.
    pub(super) fn begin(&mut self, at: usize) -> Result<(), Box<Diagnostic>> {
        self.settle(Some(at));
        let token = self.piece(at).and_then(|p| match &p.kind {
            Kind::Fixed(t) => Some(t.clone()),
            _ => None,
        });
        match token {
            Some(Token::RBrace) => return self.close_block(at),
            Some(Token::LBrace) => {
                let under = self.top().filter(|n| matches!(n.frame, Frame::Header { .. }));
                self.open_line(at, under.map_or(self.level(), |n| n.indent));
                self.open_block(at);
            }
            Some(Token::If) => self.head(at, Word::If),
            Some(Token::For) => self.head(at, Word::Loop),
            Some(Token::While) if self.header(Word::Do, true) => {
                self.open_line(at, self.level());
                self.pop();
                self.place(at, Role::Keyword);
                self.state.fresh = false;
            }
            Some(Token::While) => self.head(at, Word::Loop),
            Some(Token::Else) => {
                self.open_line(at, self.level());
                if self.header(Word::If, true) {
                    self.pop();
                }
                let is_if = self.piece(at + 1).is_some_and(|p| p.is(&Token::If));
                self.body(at, Word::Else, is_if);
            }
            Some(Token::Do) => {
                self.open_line(at, self.level());
                self.body(at, Word::Do, false);
            }
            _ => {
                self.open_line(at, self.level());
                self.state.fresh = false;
                self.go_on(at)?;
                if self.is_lone_macro(at) {
                    self.finish(at + 1);
                    self.statement_done();
                }
            }
        }
        Ok(())
    }

    /// `if`, `for` or `while`: its condition comes first.
    fn head(&mut self, at: usize, word: Word) {
        self.open_line(at, self.level());
        // Whatever ends this `if` also ends the `else` before it.
        if word == Word::If && self.header(Word::Else, false) {
            self.pop();
        }
        self.place(at, Role::Keyword);
        self.state.head = Some(word);
        self.state.fresh = false;
    }

    /// A header is complete: the body follows, on the same line if it is a block or `stays`.
    pub(super) fn body(&mut self, at: usize, word: Word, stays: bool) {
        if matches!(word, Word::Else | Word::Do) {
            self.place(at, Role::Keyword);
        }
        let indent = self.state.indent.unwrap_or(0);
        self.push(Frame::Header { word, done: false }, at, indent);
        self.state = State { top: self.state.top, fresh: true, ..State::default() };
        if stays || self.solid_after(at).is_some_and(|p| p.is(&Token::LBrace)) {
            self.state.indent = Some(indent);
        } else {
            self.finish(at + 1);
        }
    }

    /// A macro alone on its line, followed by the start of a new statement.
    fn is_lone_macro(&self, at: usize) -> bool {
        let Some(piece) = self.piece(at) else { return false };
        let next = self.solid_after(at);
        let broken = self.piece(at + 1).is_none_or(|n| n.breaks > 0) || next.is_none_or(|n| n.breaks > 0);
        piece.kind == Kind::Macro && broken && next.is_none_or(role::begins_statement)
    }

    /// A piece of a statement outside of brackets.
    pub(super) fn go_on(&mut self, at: usize) -> Result<(), Box<Diagnostic>> {
        self.open_line(at, 0);
        match self.piece(at).map(|p| &p.kind) {
            Some(Kind::Fixed(Token::Semi)) => {
                self.place(at, Role::Semi);
                self.finish(at + 1);
                self.statement_done();
            }
            Some(Kind::Fixed(Token::RBrace)) => {
                self.finish(at);
                self.statement_done();
                self.settle(Some(at));
                self.close_block(at)?;
            }
            Some(Kind::Fixed(Token::LBrace)) if !self.role_of(self.state.prev).wants_list() => {
                self.open_block(at);
            }
            Some(Kind::Fixed(Token::LParen)) => {
                self.state.params = self.state.params.or(Some(at));
                self.inside(at)?;
            }
            _ => self.inside(at)?,
        }
        Ok(())
    }

    /// The `{` of a block ends its line, unless the block is empty.
    fn open_block(&mut self, at: usize) {
        let indent = self.state.indent.unwrap_or(0);
        self.place(at, Role::BlockOpen);
        if let Some(line) = &mut self.open {
            line.params = self.state.params;
        }
        self.push(Frame::Block, at, indent);
        self.state = State { top: self.state.top, fresh: true, ..State::default() };
        if self.is_brace(at + 1) {
            self.state.indent = Some(indent);
        } else {
            self.finish(at + 1);
        }
    }

    /// The `}` of a block, and the text that belongs on its line.
    fn close_block(&mut self, at: usize) -> Result<(), Box<Diagnostic>> {
        while let Some(Node { frame: Frame::Header { .. }, .. }) = self.top() {
            self.pop();
        }
        let indent = match self.top() {
            Some(node) => node.indent,
            None if self.before_shader(at) => 0,
            None => return Err(self.stray(at)),
        };
        self.pop();
        self.open_line(at, indent);
        self.place(at, Role::BlockClose);
        self.statement_done();
        let next = self.piece(at + 1);
        let is_next = |token: &Token| next.is_some_and(|p| p.is(token));
        if is_next(&Token::Semi) {
            self.place(at + 1, Role::Semi);
            self.finish(at + 2);
        } else if (is_next(&Token::Else) && self.header(Word::If, true))
            || (is_next(&Token::While) && self.header(Word::Do, true))
        {
            self.state.indent = Some(indent);
        } else {
            self.finish(at + 1);
        }
        self.state.prev = None;
        Ok(())
    }

    /// The compiler ignores a `}` that closes nothing directly before the shader.
    fn before_shader(&self, at: usize) -> bool {
        let is_kind = |p: &Piece<'_>| matches!(p.text, "shader" | "surface" | "displacement" | "volume");
        at > 0 && self.next_code.get(at).copied().flatten().and_then(|n| self.piece(n)).is_some_and(is_kind)
    }
}
