//! Finds the lines: the pieces of each, its indentation, and the role of each piece.
//!
//! A line here is a logical line: a statement, the header of a block, a `}` with the text that follows it, or
//! a comment or directive on its own. Statements are recognised by `;`, braces and control-flow keywords,
//! without a grammar. Each branch of a conditional is read from the state at its `#if`, and the state after
//! the first branch counts for the text that follows.
//!
//! [`nesting`] holds what is open, [`statement`] reads outside brackets, [`bracket`] inside.

mod bracket;
mod nesting;
mod statement;

use super::pieces::{Directive, Kind, Piece};
use super::role::{self, Role};
use crate::diagnostic::Diagnostic;
use crate::span::Span;
use crate::token::Token;
use nesting::{Frame, Node, State};
use std::ops::Range;

/// A logical line.
#[derive(Clone, Debug)]
pub(super) struct Line {
    /// Its pieces.
    pub(super) pieces: Range<usize>,
    /// Its level.
    pub(super) indent: u32,
    /// Whether it continues a statement that another branch of a conditional has already ended.
    pub(super) continued: bool,
    /// The `(` of the parameters that it declares.
    pub(super) params: Option<usize>,
}

/// The classification of a piece.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fact {
    /// Its role.
    pub(super) role: Role,
    /// The innermost bracket around it in its statement.
    pub(super) outer: Option<usize>,
    /// Number of brackets around it in its statement.
    pub(super) depth: u32,
    /// For a closing bracket, its opening bracket.
    pub(super) opener: Option<usize>,
}

/// The lines of a file and the classification of its pieces.
pub(super) struct Structure {
    pub(super) lines: Vec<Line>,
    pub(super) facts: Vec<Fact>,
    /// For each piece, the next piece of code.
    pub(super) next_code: Vec<Option<usize>>,
}

/// Finds the lines. `nesting` is the permitted nesting of constructs that compile.
///
/// # Errors
/// Brackets are unbalanced, or nested too deeply.
pub(super) fn structure(pieces: &[Piece<'_>], end: u32, nesting: u64) -> Result<Structure, Box<Diagnostic>> {
    let mut b = Builder {
        pieces,
        nesting,
        facts: vec![Fact::default(); pieces.len()],
        lines: Vec::new(),
        at: 0,
        next_code: next(pieces, |p| p.is_code()),
        next_solid: next(pieces, |p| !p.is_comment()),
        nodes: Vec::new(),
        state: State { fresh: true, ..State::default() },
        open: None,
        branches: Vec::new(),
    };
    while b.at < pieces.len() {
        b.step()?;
    }
    b.finish(pieces.len());
    while let Some(node) = b.top() {
        if !matches!(node.frame, Frame::Header { .. }) {
            return Err(b.unclosed(node, Span::new(end, end), "end of file"));
        }
        b.state.top = node.parent;
    }
    Ok(Structure { lines: b.lines, facts: b.facts, next_code: b.next_code })
}

/// For each piece, the next one that satisfies a condition.
fn next(pieces: &[Piece<'_>], wanted: impl Fn(&Piece<'_>) -> bool) -> Vec<Option<usize>> {
    let mut next = vec![None; pieces.len()];
    let mut found = None;
    for (at, piece) in pieces.iter().enumerate().rev() {
        if let Some(slot) = next.get_mut(at) {
            *slot = found;
        }
        if wanted(piece) {
            found = Some(at);
        }
    }
    next
}

struct Builder<'p, 'a> {
    pieces: &'p [Piece<'a>],
    nesting: u64,
    facts: Vec<Fact>,
    lines: Vec<Line>,
    at: usize,
    next_code: Vec<Option<usize>>,
    /// The next piece that is not a comment.
    next_solid: Vec<Option<usize>>,
    nodes: Vec<Node>,
    state: State,
    /// The current line, which has no end yet.
    open: Option<Line>,
    /// For each open conditional, the state at its `#if` and the state at the end of its first branch.
    branches: Vec<(State, Option<State>)>,
}

impl<'a> Builder<'_, 'a> {
    fn piece(&self, at: usize) -> Option<&Piece<'a>> {
        self.pieces.get(at)
    }

    /// The next piece after `at` that is not a comment.
    fn solid_after(&self, at: usize) -> Option<&Piece<'a>> {
        self.next_solid.get(at).copied().flatten().and_then(|n| self.piece(n))
    }

    fn step(&mut self) -> Result<(), Box<Diagnostic>> {
        let at = self.at;
        self.at += 1;
        let Some(piece) = self.piece(at) else { return Ok(()) };
        match piece.kind {
            Kind::Lines(directive) => self.lines(at, directive),
            Kind::LineComment | Kind::BlockComment => self.comment(at),
            _ => self.code(at)?,
        }
        self.check_nesting()
    }

    /// Handles whole lines: in the middle of a statement they are part of its line.
    fn lines(&mut self, at: usize, directive: Directive) {
        self.place(at, Role::None);
        match directive {
            Directive::If => self.branches.push((self.state, None)),
            Directive::Else => {
                if let Some((start, first)) = self.branches.last_mut() {
                    first.get_or_insert(self.state);
                    self.state = *start;
                }
            }
            Directive::Endif => {
                if let Some((_, Some(first))) = self.branches.pop() {
                    self.state = first;
                }
            }
            Directive::Other => {}
        }
        if self.open.is_some() && self.state.fresh {
            self.finish(at);
        }
        if self.open.is_none() {
            self.lines.push(Line { pieces: at..at + 1, indent: 0, continued: false, params: None });
        }
    }

    /// Handles a comment: between statements it is its own line, unless code follows on its line.
    fn comment(&mut self, at: usize) {
        self.place(at, Role::None);
        if !self.state.fresh {
            return self.open_line(at, 0);
        }
        let next = self.next_code.get(at).copied().flatten();
        self.settle(next);
        self.open_line(at, self.level());
        if self.piece(at).is_some_and(|p| p.ends_line) || self.is_brace(at + 1) {
            self.finish(at + 1);
        }
    }

    fn is_brace(&self, at: usize) -> bool {
        self.piece(at).is_some_and(|p| p.is(&Token::RBrace))
    }

    fn code(&mut self, at: usize) -> Result<(), Box<Diagnostic>> {
        match self.top().map(|n| n.frame) {
            None | Some(Frame::Block | Frame::Header { .. }) if self.state.fresh => self.begin(at),
            None | Some(Frame::Block | Frame::Header { .. }) => self.go_on(at),
            Some(_) => self.inside(at),
        }
    }

    /// Records the classification of a piece.
    fn place(&mut self, at: usize, role: Role) {
        let top = self.top().filter(|n| n.depth > 0);
        if let Some(fact) = self.facts.get_mut(at) {
            *fact =
                Fact { role, outer: top.map(|n| n.opener), depth: top.map_or(0, |n| n.depth), opener: None };
        }
        if role != Role::None {
            self.state.prev = Some(at);
        }
    }

    fn role_of(&self, at: Option<usize>) -> Role {
        at.and_then(|n| self.facts.get(n)).map_or(Role::None, |f| f.role)
    }

    /// The role of a piece that is not a bracket.
    fn role(&self, at: usize) -> Role {
        self.piece(at).map_or(Role::None, |p| role::of(p, self.role_of(self.state.prev)))
    }

    /// Begins a line with the piece at `at`, unless one is open. A statement in progress keeps its level.
    fn open_line(&mut self, at: usize, indent: u32) {
        if self.open.is_none() {
            let continued = self.state.indent.is_some() && !self.state.fresh;
            let indent = *self.state.indent.get_or_insert(indent);
            self.open = Some(Line { pieces: at..at, indent, continued, params: None });
        }
    }

    /// Ends the open line before piece `end`, or after the comments that follow on the same line.
    fn finish(&mut self, mut end: usize) {
        let Some(mut line) = self.open.take() else { return };
        let pieces = self.pieces.get(line.pieces.start..end).unwrap_or_default();
        // A quote after a broken string on its last line would change how the string is read.
        let broken = pieces.iter().any(Piece::is_broken_string);
        while let Some(p) = self.piece(end)
            && p.is_comment()
            && (p.trails || (p.breaks == 0 && self.is_brace(end + 1)))
            && !(broken && p.text.contains('"'))
        {
            end += 1;
        }
        line.pieces.end = end;
        self.lines.push(line);
        self.at = self.at.max(end);
        if self.state.fresh {
            self.state.indent = None;
        }
    }
}
