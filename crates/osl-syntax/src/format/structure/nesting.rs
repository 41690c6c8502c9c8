//! The open brackets, blocks, and headers without their body so far.
//!
//! The stack is a linked list, so that returning to the state at an `#if` costs nothing. This module must not
//! know how statements are recognised.

use super::super::pieces::Piece;
use super::Builder;
use crate::diagnostic::Diagnostic;
use crate::errors;
use crate::span::Span;
use crate::token::Token;

/// An open construct.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Frame {
    Paren,
    Bracket,
    /// `[[`, before the first `]`.
    Meta,
    /// `[[`, after the first `]`.
    MetaEnd,
    /// The braces of an initialiser.
    List,
    /// The braces of a block.
    Block,
    /// `if (…)` and the like, whose body follows or, if `done`, is complete.
    Header {
        word: Word,
        done: bool,
    },
}

/// Keywords followed by a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Word {
    If,
    Else,
    Loop,
    Do,
}

/// An entry of the stack.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) frame: Frame,
    pub(super) parent: Option<usize>,
    /// The piece that opened it.
    pub(super) opener: usize,
    /// The level of the line that opened it.
    pub(super) indent: u32,
    /// Brackets within a statement, this one included.
    pub(super) depth: u32,
    /// The entry below it.
    below: u32,
    /// For a header, the entry that replaces it once its body is complete. It is made once, however often
    /// reading returns to an `#if`.
    finished: Option<usize>,
}

/// The state of reading; returning to a copy is possible.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct State {
    pub(super) top: Option<usize>,
    /// The level of the current statement.
    pub(super) indent: Option<u32>,
    /// Whether nothing of the statement has been read so far.
    pub(super) fresh: bool,
    /// A header whose condition is being read.
    pub(super) head: Option<Word>,
    /// The first `(` of the statement.
    pub(super) params: Option<usize>,
    /// The last piece of code of the statement.
    pub(super) prev: Option<usize>,
}

impl Builder<'_, '_> {
    pub(super) fn top(&self) -> Option<Node> {
        self.state.top.and_then(|n| self.nodes.get(n)).copied()
    }

    pub(super) fn push(&mut self, frame: Frame, opener: usize, indent: u32) {
        let bracket = !matches!(frame, Frame::Block | Frame::Header { .. });
        let depth = if bracket { self.top().map_or(0, |n| n.depth) + 1 } else { 0 };
        let below = self.top().map_or(0, |n| n.below + 1);
        self.nodes.push(Node { frame, parent: self.state.top, opener, indent, depth, below, finished: None });
        self.state.top = Some(self.nodes.len() - 1);
    }

    /// Refuses code that is nested deeper than anything that compiles. Each path through a conditional may
    /// have to leave all of it, so the time would be quadratic in the length of the text.
    pub(super) fn check_nesting(&self) -> Result<(), Box<Diagnostic>> {
        let limit = self.nesting.saturating_mul(2);
        match self.top() {
            Some(node) if u64::from(node.below) >= limit => {
                let span = self.piece(node.opener).map(Piece::span).unwrap_or_default();
                Err(Box::new(errors::nesting(span, limit)))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn pop(&mut self) {
        self.state.top = self.top().and_then(|n| n.parent);
    }

    /// Whether a header of this kind is on top.
    pub(super) fn header(&self, word: Word, done: bool) -> bool {
        self.top().is_some_and(|n| n.frame == Frame::Header { word, done })
    }

    /// The level of a statement that begins here.
    pub(super) fn level(&self) -> u32 {
        match self.top() {
            None => 0,
            Some(Node { frame: Frame::Header { done: true, .. }, indent, .. }) => indent,
            Some(node) => node.indent + 1,
        }
    }

    /// Leaves the complete headers, given the next piece of code: `else` and `while` may continue one.
    pub(super) fn settle(&mut self, next: Option<usize>) {
        let next = next.and_then(|n| self.pieces.get(n));
        let is_next = |token: &Token| next.is_some_and(|p| p.is(token));
        while let Some(Frame::Header { word, done: true }) = self.top().map(|n| n.frame) {
            if (word == Word::If && is_next(&Token::Else)) || (word == Word::Do && is_next(&Token::While)) {
                return;
            }
            self.pop();
            let state = self.state;
            self.statement_done();
            self.state = State { top: self.state.top, ..state };
        }
    }

    /// Marks the statement as complete, and also the header whose body it is.
    pub(super) fn statement_done(&mut self) {
        self.state = State { top: self.state.top, fresh: true, ..State::default() };
        if let Some(node) = self.top()
            && let Frame::Header { word, done: false } = node.frame
        {
            let open = self.state.top;
            self.pop();
            if node.finished.is_some() {
                self.state.top = node.finished;
            } else {
                self.push(Frame::Header { word, done: true }, node.opener, node.indent);
                if let Some(open) = open.and_then(|n| self.nodes.get_mut(n)) {
                    open.finished = self.state.top;
                }
            }
        }
    }

    pub(super) fn stray(&self, at: usize) -> Box<Diagnostic> {
        let (span, text) = self.piece(at).map_or((Span::default(), ""), |p| (p.span(), p.text));
        Box::new(errors::stray_closer(span, text))
    }

    pub(super) fn unclosed(&self, node: Node, span: Span, found: &str) -> Box<Diagnostic> {
        let (opener, text) = self.piece(node.opener).map_or((Span::default(), ""), |p| (p.span(), p.text));
        Box::new(errors::unclosed(span, found, opener, text))
    }
}
