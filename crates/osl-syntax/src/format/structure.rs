//! Which pieces make a line, how deep it stands, and what each piece is to its neighbours.
//!
//! A line here is a logical one: a statement, the header of a block, a `}` with what follows it, a comment or a
//! directive of its own. Statements are told by `;`, braces and the keywords of control flow, without a grammar.
//! Where conditionals have several branches, each is read from where its `#if` stood, and the first one counts for
//! what follows. The stack of open brackets is a linked one, so that going back to an `#if` costs nothing. It must
//! not know columns.

use super::pieces::{Directive, Kind, Piece};
use super::role::{self, Role};
use crate::diagnostic::Diagnostic;
use crate::errors;
use crate::span::Span;
use crate::token::Token;
use std::ops::Range;

/// A logical line.
#[derive(Clone, Debug)]
pub(super) struct Line {
    /// Its pieces.
    pub(super) pieces: Range<usize>,
    /// Its level.
    pub(super) indent: u32,
    /// Whether it goes on with a statement that another branch of a conditional has ended already.
    pub(super) continued: bool,
    /// The `(` of the parameters that it declares.
    pub(super) params: Option<usize>,
}

/// What is known of a piece.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fact {
    /// What it is to its neighbours.
    pub(super) role: Role,
    /// The innermost bracket around it in its statement.
    pub(super) outer: Option<usize>,
    /// Brackets around it in its statement.
    pub(super) depth: u32,
    /// Of a closer, its opener.
    pub(super) opener: Option<usize>,
}

/// The lines of a file and what is known of its pieces.
pub(super) struct Structure {
    pub(super) lines: Vec<Line>,
    pub(super) facts: Vec<Fact>,
    /// For each piece the next one that is code.
    pub(super) next_code: Vec<Option<usize>>,
}

/// Finds the lines.
///
/// # Errors
/// Brackets out of balance.
pub(super) fn structure(pieces: &[Piece<'_>], end: u32) -> Result<Structure, Diagnostic> {
    let mut b = Builder {
        pieces,
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

/// For each piece the next one behind it that fulfils a condition.
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

/// What is open.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Frame {
    Paren,
    Bracket,
    /// `[[`, before the first `]`.
    Meta,
    /// `[[`, behind the first `]`.
    MetaEnd,
    /// The braces of an initialiser.
    List,
    /// The braces of a block.
    Block,
    /// `if (…)` and the like, whose body is to come or, when `done`, has come.
    Header {
        word: Word,
        done: bool,
    },
}

/// Words that a body follows.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Word {
    If,
    Else,
    Loop,
    Do,
}

/// An entry of the stack of what is open.
#[derive(Clone, Copy, Debug)]
struct Node {
    frame: Frame,
    parent: Option<usize>,
    /// The piece that opened it.
    opener: usize,
    /// The level of the line that opened it.
    indent: u32,
    /// Brackets within a statement, this one included.
    depth: u32,
}

/// Where reading stands; a copy can be returned to.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    top: Option<usize>,
    /// The level of the statement that is being read.
    indent: Option<u32>,
    /// Whether nothing of the statement has been read yet.
    fresh: bool,
    /// A header whose condition is being read.
    head: Option<Word>,
    /// The first `(` of the statement.
    params: Option<usize>,
    /// The last piece of code of the statement.
    prev: Option<usize>,
}

struct Builder<'p, 'a> {
    pieces: &'p [Piece<'a>],
    facts: Vec<Fact>,
    lines: Vec<Line>,
    at: usize,
    next_code: Vec<Option<usize>>,
    /// The next piece that is no comment.
    next_solid: Vec<Option<usize>>,
    nodes: Vec<Node>,
    state: State,
    /// The line that is being read; it has no end yet.
    open: Option<Line>,
    /// For each open conditional where reading stood at its `#if`, and at the end of its first branch.
    branches: Vec<(State, Option<State>)>,
}

impl<'a> Builder<'_, 'a> {
    fn piece(&self, at: usize) -> Option<&Piece<'a>> {
        self.pieces.get(at)
    }

    /// The next piece behind `at` but for comments.
    fn solid_after(&self, at: usize) -> Option<&Piece<'a>> {
        self.next_solid.get(at).copied().flatten().and_then(|n| self.piece(n))
    }

    fn top(&self) -> Option<Node> {
        self.state.top.and_then(|n| self.nodes.get(n)).copied()
    }

    fn push(&mut self, frame: Frame, opener: usize, indent: u32) {
        let bracket = !matches!(frame, Frame::Block | Frame::Header { .. });
        let depth = if bracket { self.top().map_or(0, |n| n.depth) + 1 } else { 0 };
        self.nodes.push(Node { frame, parent: self.state.top, opener, indent, depth });
        self.state.top = Some(self.nodes.len() - 1);
    }

    fn pop(&mut self) {
        self.state.top = self.top().and_then(|n| n.parent);
    }

    fn step(&mut self) -> Result<(), Diagnostic> {
        let at = self.at;
        self.at += 1;
        let Some(piece) = self.piece(at) else { return Ok(()) };
        match piece.kind {
            Kind::Lines(directive) => self.lines(at, directive),
            Kind::LineComment | Kind::BlockComment => self.comment(at),
            _ => self.code(at)?,
        }
        Ok(())
    }

    /// Takes whole lines: in the middle of a statement they are part of its line.
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

    /// Takes a comment: between statements it is a line of its own, unless code follows on its line.
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

    fn code(&mut self, at: usize) -> Result<(), Diagnostic> {
        match self.top().map(|n| n.frame) {
            None | Some(Frame::Block | Frame::Header { .. }) if self.state.fresh => self.begin(at),
            None | Some(Frame::Block | Frame::Header { .. }) => self.go_on(at),
            Some(_) => self.inside(at),
        }
    }

    /// Writes down what is known of a piece.
    fn place(&mut self, at: usize, role: Role) {
        let top = self.top().filter(|n| n.depth > 0);
        if let Some(fact) = self.facts.get_mut(at) {
            *fact = Fact {
                role,
                outer: top.map(|n| n.opener),
                depth: top.map_or(0, |n| n.depth),
                opener: None,
            };
        }
        if role != Role::None {
            self.state.prev = Some(at);
        }
    }

    fn role_of(&self, at: Option<usize>) -> Role {
        at.and_then(|n| self.facts.get(n)).map_or(Role::None, |f| f.role)
    }

    /// What a piece is to its neighbours, but for brackets.
    fn role(&self, at: usize) -> Role {
        self.piece(at).map_or(Role::None, |p| role::of(p, self.role_of(self.state.prev)))
    }

    /// The first piece of a statement.
    fn begin(&mut self, at: usize) -> Result<(), Diagnostic> {
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
        // What ends with this `if` ends the `else` before it.
        if word == Word::If && self.header(Word::Else, false) {
            self.pop();
        }
        self.place(at, Role::Keyword);
        self.state.head = Some(word);
        self.state.fresh = false;
    }

    /// A header is complete: the body comes next, on the same line if it is a block or `stays`.
    fn body(&mut self, at: usize, word: Word, stays: bool) {
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

    /// Whether a header of that kind is on top.
    fn header(&self, word: Word, done: bool) -> bool {
        self.top().is_some_and(|n| n.frame == Frame::Header { word, done })
    }

    /// A macro that stands alone on its line and is followed by the begin of something.
    fn is_lone_macro(&self, at: usize) -> bool {
        let Some(piece) = self.piece(at) else { return false };
        let next = self.solid_after(at);
        let broken = self.piece(at + 1).is_none_or(|n| n.breaks > 0) || next.is_none_or(|n| n.breaks > 0);
        piece.kind == Kind::Macro && broken && next.is_none_or(role::begins_statement)
    }

    /// A piece of a statement outside of brackets.
    fn go_on(&mut self, at: usize) -> Result<(), Diagnostic> {
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

    /// A piece within brackets, or one that opens or closes some.
    fn inside(&mut self, at: usize) -> Result<(), Diagnostic> {
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
    fn close(&mut self, at: usize, closer: &Token) -> Result<(), Diagnostic> {
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
        if node.depth == 1 && *closer == Token::RParen && let Some(word) = self.state.head {
            self.body(at, word, false);
        }
        Ok(())
    }

    /// Whether the `)` that comes now makes a cast of what stands since the `(`.
    fn is_cast(&self, opener: usize) -> bool {
        self.role_of(Some(opener)) == Role::Group
            && self.next_code.get(opener).copied().flatten() == self.state.prev
            && self.role_of(self.state.prev) == Role::Type
    }

    /// The `{` of a block ends its line, unless nothing is in it.
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

    /// The `}` of a block, and what belongs on its line.
    fn close_block(&mut self, at: usize) -> Result<(), Diagnostic> {
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

    /// A `}` that closes nothing is passed over by the compiler right before the shader.
    fn before_shader(&self, at: usize) -> bool {
        let is_kind = |p: &Piece<'_>| matches!(p.text, "shader" | "surface" | "displacement" | "volume");
        at > 0 && self.next_code.get(at).copied().flatten().and_then(|n| self.piece(n)).is_some_and(is_kind)
    }

    /// The statement is complete, and so is the header whose body it is.
    fn statement_done(&mut self) {
        self.state = State { top: self.state.top, fresh: true, ..State::default() };
        if let Some(node) = self.top()
            && let Frame::Header { word, done: false } = node.frame
        {
            self.pop();
            self.push(Frame::Header { word, done: true }, node.opener, node.indent);
        }
    }

    /// Leaves the headers that are complete, given the next piece of code: `else` and `while` may go on with one.
    fn settle(&mut self, next: Option<usize>) {
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

    /// The level of a statement that begins here.
    fn level(&self) -> u32 {
        match self.top() {
            None => 0,
            Some(Node { frame: Frame::Header { done: true, .. }, indent, .. }) => indent,
            Some(node) => node.indent + 1,
        }
    }

    /// Begins a line with the piece at `at`, unless one is open. A statement that is being read keeps its level.
    fn open_line(&mut self, at: usize, indent: u32) {
        if self.open.is_none() {
            let continued = self.state.indent.is_some() && !self.state.fresh;
            let indent = *self.state.indent.get_or_insert(indent);
            self.open = Some(Line { pieces: at..at, indent, continued, params: None });
        }
    }

    /// Ends the open line before piece `end`, or behind the comments that follow on the same line.
    fn finish(&mut self, mut end: usize) {
        let Some(mut line) = self.open.take() else { return };
        let pieces = self.pieces.get(line.pieces.start..end).unwrap_or_default();
        // A quote behind a broken string on its last line would change how that is read.
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

    fn stray(&self, at: usize) -> Diagnostic {
        let (span, text) = self.piece(at).map_or((Span::default(), ""), |p| (p.span(), p.text));
        errors::stray_closer(span, text)
    }

    fn unclosed(&self, node: Node, span: Span, found: &str) -> Diagnostic {
        let (opener, text) = self.piece(node.opener).map_or((Span::default(), ""), |p| (p.span(), p.text));
        errors::unclosed(span, found, opener, text)
    }
}
