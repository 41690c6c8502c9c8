//! Writes logical lines as text: which brackets put their content on separate lines, where a line is broken,
//! and how far it is indented.
//!
//! Every decision depends only on the pieces and on the few line breaks that the output keeps, so that
//! formatting the output again changes nothing.

use super::WIDTH;
use super::pieces::{Kind, Piece};
use super::role::{Role, space};
use super::structure::{Fact, Line, Structure};
use std::ops::Range;

/// Columns per level.
const LEVEL: usize = 4;

/// Maximum number of displayed levels: deeper code is not indented further.
const MAX_LEVELS: u32 = 32;

/// Additional levels for the continuation of a broken line.
const CONTINUED: u32 = 2;

/// The cost of a line break inside a bracket, in columns left empty.
const BRACKET_COST: usize = 40;

/// The cost of a step in binding strength.
const BINDING_COST: usize = 2;

/// The text of all lines.
pub(super) fn layout(text: &str, pieces: &[Piece<'_>], structure: &Structure) -> String {
    let mut w = Writer {
        pieces,
        facts: &structure.facts,
        next_code: &structure.next_code,
        prev_code: prev_code(pieces),
        brackets: vec![Bracket::default(); pieces.len()],
        line: 0..0,
        broken_string: None,
        indent: 0,
        eol: line_end(text, pieces),
        out: String::with_capacity(text.len() + text.len() / 4),
    };
    if text.starts_with('\u{feff}') {
        w.out.push('\u{feff}');
    }
    let mut after_open = true;
    for line in &structure.lines {
        let Some(first) = pieces.get(line.pieces.start) else { continue };
        let closes = w.fact(line.pieces.start).role == Role::BlockClose;
        if first.breaks > 1 && !after_open && !closes {
            w.out.push_str(w.eol);
        }
        w.line(line);
        let last = line.pieces.clone().rev().map(|n| w.fact(n).role).find(|r| *r != Role::None);
        after_open = last == Some(Role::BlockOpen);
    }
    w.out
}

/// The line break of the file: the first one between pieces, because those within pieces may differ and stay;
/// if there is none, the first one of all.
fn line_end(text: &str, pieces: &[Piece<'_>]) -> &'static str {
    let ends = pieces.iter().map(|p| p.start + p.text.len());
    let starts = pieces.iter().map(|p| p.start).chain([text.len()]);
    let between = std::iter::once(0).chain(ends).zip(starts).filter_map(|(a, b)| text.get(a..b));
    let first = between.chain([text]).find_map(|gap| gap.split_once('\n'));
    if first.is_some_and(|(before, _)| before.ends_with('\r')) { "\r\n" } else { "\n" }
}

/// For each piece the last piece of code before it.
fn prev_code(pieces: &[Piece<'_>]) -> Vec<Option<usize>> {
    let mut last = None;
    let step = |(at, piece): (usize, &Piece<'_>)| {
        let before = last;
        if piece.is_code() {
            last = Some(at);
        }
        before
    };
    pieces.iter().enumerate().map(step).collect()
}

/// The layout of a bracket's content, at the index of the opening bracket.
#[derive(Clone, Copy, Debug, Default)]
struct Bracket {
    /// How the content is divided into lines.
    rows: Rows,
    /// The level of its content.
    level: u32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Rows {
    /// Not divided.
    #[default]
    None,
    /// As in the input.
    Kept,
    /// One line per element.
    Each,
}

struct Writer<'p, 'a> {
    pieces: &'p [Piece<'a>],
    facts: &'p [Fact],
    next_code: &'p [Option<usize>],
    prev_code: Vec<Option<usize>>,
    brackets: Vec<Bracket>,
    /// The pieces of the current line.
    line: Range<usize>,
    /// The first string of the line that is broken over lines.
    broken_string: Option<usize>,
    indent: u32,
    eol: &'static str,
    out: String,
}

impl<'a> Writer<'_, 'a> {
    fn piece(&self, at: usize) -> Option<&Piece<'a>> {
        self.pieces.get(at)
    }

    fn fact(&self, at: usize) -> Fact {
        self.facts.get(at).copied().unwrap_or_default()
    }

    fn bracket(&self, opener: Option<usize>) -> Bracket {
        let outside = Bracket { rows: Rows::None, level: self.indent };
        opener.and_then(|n| self.brackets.get(n)).copied().unwrap_or(outside)
    }

    fn line(&mut self, line: &Line) {
        self.line = line.pieces.clone();
        let pieces = self.pieces.get(self.line.clone()).unwrap_or_default();
        self.broken_string = pieces.iter().position(Piece::is_broken_string).map(|n| self.line.start + n);
        self.indent = line.indent;
        for at in self.line.clone() {
            let fact = self.fact(at);
            if fact.role.opens() {
                let rows = self.rows(at, line.params == Some(at));
                let level = self.bracket(fact.outer).level + u32::from(rows != Rows::None);
                if let Some(slot) = self.brackets.get_mut(at) {
                    *slot = Bracket { rows, level };
                }
            }
        }
        let mut at = self.line.start;
        while at < self.line.end {
            if at > self.line.start && self.blank_before(at) {
                self.out.push_str(self.eol);
            }
            at = match self.pieces.get(at) {
                Some(Piece { kind: Kind::Lines(_), text, .. }) => {
                    self.out.push_str(text);
                    if !text.ends_with('\n') {
                        self.out.push_str(self.eol);
                    }
                    at + 1
                }
                _ => {
                    let columns = LEVEL * self.level(at, line.continued).min(MAX_LEVELS) as usize;
                    let end = self.fit(at, columns);
                    self.write(at..end, columns);
                    end
                }
            };
        }
    }

    fn write(&mut self, pieces: Range<usize>, columns: usize) {
        self.out.extend(std::iter::repeat_n(' ', columns));
        for at in pieces.clone() {
            if at > pieces.start && self.space(at) {
                self.out.push(' ');
            }
            self.out.push_str(self.piece(at).map_or("", |p| p.text));
        }
        self.out.push_str(self.eol);
    }

    /// Whether a space precedes a piece that does not begin a line.
    fn space(&self, at: usize) -> bool {
        match (self.piece(at - 1), self.piece(at)) {
            (Some(a), Some(b)) => space(a, self.fact(at - 1).role, b, self.fact(at).role),
            _ => false,
        }
    }

    /// How the content of a bracket is divided.
    fn rows(&self, opener: usize, declares: bool) -> Rows {
        let role = self.fact(opener).role;
        let empty = self.piece(opener + 1).is_none() || self.fact(opener + 1).opener == Some(opener);
        if empty || !(declares || role == Role::ListOpen) {
            return Rows::None;
        }
        let mut first = opener + 1;
        while self.piece(first).is_some_and(|p| p.trails) {
            first += 1;
        }
        let broken = self.piece(first).is_none_or(|p| p.breaks > 0 || self.is_parted(opener, p));
        match (declares, broken) {
            (false, true) => Rows::Kept,
            (true, broken) if broken || !self.is_plain(opener) => Rows::Each,
            _ => Rows::None,
        }
    }

    /// Whether a line must end before a piece because it has a quote, and a string in front of the bracket is
    /// broken over lines.
    fn is_parted(&self, opener: usize, piece: &Piece<'_>) -> bool {
        self.broken_string.is_some_and(|at| at < opener) && piece.text.contains('"')
    }

    /// Whether parameters fit on one line and nothing in them requires several.
    fn is_plain(&self, opener: usize) -> bool {
        let mut width = LEVEL * self.indent.min(MAX_LEVELS) as usize;
        let mut inside = false;
        for at in self.line.clone() {
            let Some(piece) = self.piece(at) else { break };
            let fact = self.fact(at);
            inside &= fact.opener != Some(opener);
            let lone = piece.is_comment() && (piece.breaks > 0 || piece.kind == Kind::LineComment);
            let lines = matches!(piece.kind, Kind::Lines(_)) || piece.text.contains('\n');
            if inside && (lone || lines || fact.role == Role::MetaOpen) {
                return false;
            }
            inside |= at == opener;
            width += piece.text.chars().count() + usize::from(at > self.line.start && self.space(at));
            // A trailing part may be too long.
            if fact.role == Role::BlockOpen {
                break;
            }
        }
        !inside && width <= WIDTH
    }

    /// The level at which a line begins with a piece.
    fn level(&self, at: usize, continued: bool) -> u32 {
        let fact = self.fact(at);
        let around = self.bracket(fact.outer);
        let next = self.next_code.get(at).copied().flatten().map(|n| self.fact(n).opener);
        let closes_rows = |opener: Option<usize>| opener.is_some() && self.bracket(opener).rows != Rows::None;
        if fact.role == Role::BlockOpen {
            return self.indent;
        }
        if closes_rows(fact.opener) {
            return around.level;
        }
        let prev = self.prev_code.get(at).copied().flatten();
        let prev_here = prev.filter(|n| self.line.contains(n));
        let begins = if prev_here.is_some() || continued { self.begins_row(prev) } else { true };
        let before_close = self.piece(at).is_some_and(Piece::is_comment) && next.is_some_and(closes_rows);
        if begins || before_close { around.level } else { around.level + CONTINUED }
    }

    /// Whether a blank line precedes a piece that begins a line other than the first: only between rows.
    fn blank_before(&self, at: usize) -> bool {
        let prev = self.prev_code.get(at).copied().flatten();
        let opens = prev.is_some_and(|n| self.fact(n).role.opens());
        let after_open = opens && prev == at.checked_sub(1);
        let between = self.begins_row(prev) && self.fact(at).opener.is_none() && !after_open;
        between && self.piece(at).is_some_and(|p| p.breaks > 1)
    }

    /// Whether a row begins after this piece of code.
    fn begins_row(&self, prev: Option<usize>) -> bool {
        let Some(prev) = prev else { return false };
        let fact = self.fact(prev);
        match fact.role {
            Role::Comma => fact.outer.is_some() && self.bracket(fact.outer).rows != Rows::None,
            role => role.opens() && self.bracket(Some(prev)).rows != Rows::None,
        }
    }

    /// The end of the line that begins with piece `start` at a column.
    fn fit(&self, start: usize, columns: usize) -> usize {
        let mut column = columns;
        let mut broken = false;
        let mut best: Option<(usize, usize)> = None;
        for at in start..self.line.end {
            let Some(piece) = self.piece(at) else { break };
            if at > start {
                if self.must_break(at) {
                    return at;
                }
                // A quote on the last line of a broken string would change how that string is read.
                if broken && piece.text.contains('"') {
                    return best.map_or(at, |(_, best)| best);
                }
                if let Some(cost) = self.break_cost(at) {
                    if column > WIDTH {
                        return best.map_or(at, |(_, best)| best);
                    }
                    let cost = if self.is_metadata(at) { 0 } else { cost + WIDTH - column };
                    if best.is_none_or(|(least, _)| cost <= least) {
                        best = Some((cost, at));
                    }
                }
                column += usize::from(self.space(at));
            }
            broken |= piece.is_broken_string();
            let (first, last) = match (piece.text.find('\n'), piece.text.rsplit('\n').next()) {
                (Some(n), Some(last)) => (piece.text.get(..n).unwrap_or(""), Some(last)),
                _ => (piece.text, None),
            };
            column += first.chars().count();
            // A comment at the end of a line may be too long, since breaking the code would not shorten it.
            if column > WIDTH
                && piece.kind != Kind::LineComment
                && let Some((_, best)) = best
            {
                return best;
            }
            if let Some(last) = last {
                column = last.chars().count();
                best = None;
            }
        }
        self.line.end
    }

    /// Whether metadata begins here: if it does not fit, it goes to its own line, however short the first
    /// line is. Only texts with syntax errors have `[[` among the values of an initialiser: a line there is
    /// broken after a comma if one fits, because that break is kept as the end of a row, and the row may fit
    /// without another.
    fn is_metadata(&self, at: usize) -> bool {
        let fact = self.fact(at);
        let among_values = fact.depth > 1 || self.bracket(fact.outer).rows == Rows::Kept;
        fact.role == Role::MetaOpen && !among_values
    }

    /// Whether a line must end before a piece other than its first.
    fn must_break(&self, at: usize) -> bool {
        let (Some(before), Some(piece)) = (self.piece(at - 1), self.piece(at)) else { return true };
        let lines = |p: &Piece<'_>| matches!(p.kind, Kind::Lines(_));
        if lines(before) || lines(piece) || before.kind == Kind::LineComment {
            return true;
        }
        if piece.is_comment() && piece.breaks > 0 {
            return true;
        }
        if before.kind == Kind::BlockComment && before.breaks > 0 && piece.breaks > 0 {
            return true;
        }
        let opener = self.fact(at).opener;
        if opener.is_some() && self.bracket(opener).rows != Rows::None {
            return true;
        }
        !piece.trails && (before.is_code() || before.trails) && self.row_break(at)
    }

    /// Whether a row ends before a piece that is the first of its line, apart from trailing comments.
    fn row_break(&self, at: usize) -> bool {
        let Some(prev) = self.prev_code.get(at).copied().flatten().filter(|n| self.line.contains(n)) else {
            return false;
        };
        let fact = self.fact(prev);
        let outer = self.bracket(fact.outer).rows;
        let kept = self.piece(at).is_some_and(|p| p.breaks > 0);
        match fact.role {
            Role::Comma => outer == Rows::Each || (outer == Rows::Kept && kept),
            role => role.opens() && self.bracket(Some(prev)).rows != Rows::None,
        }
    }

    /// The cost of a line break before a piece; `None` where no break is permitted.
    fn break_cost(&self, at: usize) -> Option<usize> {
        let piece = self.piece(at).filter(|p| p.is_code())?;
        let fact = self.fact(at);
        let prev = self.prev_code.get(at).copied().flatten()?;
        let before = self.fact(prev);
        // After an opening bracket a break would be kept as the start of rows. Only texts with syntax errors
        // have an operator there.
        if before.role.opens() {
            return None;
        }
        let strings = piece.kind == Kind::Str && self.piece(prev).is_some_and(|p| p.kind == Kind::Str);
        let binding = match fact.role {
            Role::Binary(binding) => binding,
            Role::MetaOpen => 0,
            Role::Comma | Role::Semi | Role::MetaMid => return None,
            _ if fact.opener.is_some() => return None,
            _ if strings || matches!(before.role, Role::Comma | Role::Semi) => 0,
            _ => return None,
        };
        Some(BRACKET_COST * fact.depth as usize + BINDING_COST * usize::from(binding))
    }
}
