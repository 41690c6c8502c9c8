//! Facts about the shader around a rewrite: the expressions with their statements, the definitions and writes
//! of variables and of their parts, and where a declaration can be inserted.

use super::term::{Place, Reader};
use osl_hir::hir::{
    Arg, Expr, ExprKind, FunctionId, Init, Lvalue, Program, Stmt, StmtKind, Var, VarId, VarKind,
};
use osl_hir::lint::{bodies, each_stmt};
use osl_syntax::ast::BinaryOp;
use osl_syntax::span::Span;
use std::cell::Cell;
use std::collections::BTreeMap;

/// An expression of the shader with its surroundings.
pub(crate) struct Site<'p> {
    pub(crate) expr: &'p Expr,
    /// Where a declaration can be inserted, so that it is computed just before the expression.
    pub(crate) before: Option<usize>,
    /// Whether it is the whole value of a statement or an argument, so that it needs no parentheses.
    pub(crate) is_whole: bool,
    /// The target of `target op= value`, whose text is that of the whole expression.
    pub(crate) target: Option<Span>,
}

/// A shader and the facts about its variables.
pub(crate) struct Source<'p> {
    pub(crate) program: &'p Program,
    pub(crate) reader: Reader<'p>,
    /// The text without comments, strings and lines of the preprocessor, which are blank.
    bare: String,
    /// What locals and their parts are declared with, or assigned in a statement of its own.
    pub(super) definitions: BTreeMap<Place, Vec<Definition<'p>>>,
    /// The calls of functions of the source.
    pub(super) calls: BTreeMap<(u32, u32), &'p Expr>,
    /// Where each variable is written after its declaration.
    writes: BTreeMap<VarId, Vec<(Place, Span)>>,
    /// The loops.
    loops: Vec<Span>,
    /// The offsets at which the lines begin.
    starts: Vec<usize>,
    /// How many more variables may be opened in the current expression.
    pub(super) left: Cell<usize>,
}

/// What a place is set to.
#[derive(Clone, Copy)]
pub(super) struct Definition<'p> {
    pub(super) value: &'p Expr,
    /// For an assignment the statements among which it is; `None` for a declaration.
    pub(super) scope: Option<Span>,
}

impl<'p> Source<'p> {
    /// Reads the facts of a shader with this text.
    pub(crate) fn new(program: &'p Program, text: &'p str) -> Source<'p> {
        let mut source = Source {
            program,
            reader: Reader { text },
            bare: bare(text),
            definitions: BTreeMap::new(),
            calls: BTreeMap::new(),
            writes: BTreeMap::new(),
            loops: Vec::new(),
            starts: std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect(),
            left: Cell::new(0),
        };
        for body in bodies(program) {
            source.define(body);
            each_stmt(body, &mut |stmt| source.note(stmt));
        }
        source
    }

    /// Collects the definitions in a list of statements.
    fn define(&mut self, stmts: &'p [Stmt]) {
        let (Some(first), Some(last)) = (stmts.first(), stmts.last()) else { return };
        let scope = Span::new(first.span.start, last.span.end);
        for stmt in stmts {
            match &stmt.kind {
                StmtKind::Declare(var, Some(value)) => self.define_as((*var).into(), value, None),
                StmtKind::Expr(Expr { kind: ExprKind::Assign(place, value), .. }) => {
                    let is_local = |var: &Var| var.kind == VarKind::Local;
                    let (to, is_exact) = Place::around(place.var, &place.path);
                    if is_exact && self.program.vars.get(place.var.0 as usize).is_some_and(is_local) {
                        self.define_as(to, value, Some(scope));
                    }
                }
                StmtKind::Block(inner) | StmtKind::Loop { body: inner, .. } => self.define(inner),
                StmtKind::If(_, then, otherwise) => {
                    self.define(then);
                    self.define(otherwise);
                }
                _ => {}
            }
        }
    }

    fn define_as(&mut self, place: Place, init: &'p Init, scope: Option<Span>) {
        match init {
            Init::Value(value) => {
                self.definitions.entry(place).or_default().push(Definition { value, scope });
            }
            Init::List(items) => {
                for (index, item) in items.iter().enumerate() {
                    if let Some(part) = place.part(index as u32) {
                        self.define_as(part, item, scope);
                    }
                }
            }
        }
    }

    fn note(&mut self, stmt: &'p Stmt) {
        if let StmtKind::Loop { .. } = &stmt.kind {
            self.loops.push(stmt.span);
        }
        let mut written: Vec<(Place, Span)> = Vec::new();
        let mut write =
            |place: &Lvalue, span: Span| written.push((Place::around(place.var, &place.path).0, span));
        for e in stmt.exprs() {
            e.each(&mut |e| match &e.kind {
                ExprKind::Assign(place, _) | ExprKind::Step { place, .. } => write(place, e.span),
                ExprKind::Builtin(call) => {
                    call.outputs.iter().flatten().for_each(|place| write(place, e.span));
                }
                ExprKind::Call(id, args) => {
                    self.calls.insert((e.span.start, e.span.end), e);
                    for (index, arg) in args.iter().enumerate() {
                        match arg {
                            Arg::Alias(place) if self.is_output(*id, index) => write(place, e.span),
                            Arg::Copy { back: Some(place), .. } => write(place, e.span),
                            _ => {}
                        }
                    }
                }
                _ => {}
            });
        }
        for (place, span) in written {
            self.writes.entry(place.var).or_default().push((place, span));
        }
    }

    /// Whether the function may write this argument.
    pub(crate) fn is_output(&self, id: FunctionId, index: usize) -> bool {
        let formals = self.program.functions.get(id.0 as usize).map(|f| &f.formals);
        let var =
            formals.and_then(|list| list.get(index)).and_then(|id| self.program.vars.get(id.0 as usize));
        var.is_none_or(|var| var.kind == VarKind::Formal { output: true })
    }

    /// The text without comments, strings and lines of the preprocessor.
    pub(crate) fn bare(&self) -> &str {
        &self.bare
    }

    /// Where a variable or a part of it is written after its declaration.
    pub(crate) fn writes(&self, place: impl Into<Place>) -> impl Iterator<Item = Span> {
        let place = place.into();
        let all = self.writes.get(&place.var).into_iter().flatten();
        all.filter(move |(written, _)| written.overlaps(place)).map(|(_, span)| *span)
    }

    /// The value with which a local is declared.
    pub(crate) fn value(&self, var: VarId) -> Option<&'p Expr> {
        self.definitions.get(&var.into())?.iter().find(|found| found.scope.is_none()).map(|found| found.value)
    }

    /// All expressions of the main file.
    pub(crate) fn sites(&self) -> Vec<Site<'p>> {
        let mut out = Vec::new();
        for body in bodies(self.program) {
            each_stmt(body, &mut |stmt| {
                let before = self.start(stmt);
                stmt.exprs().into_iter().for_each(|e| self.site(e, before, (true, None), &mut out));
            });
        }
        out
    }

    fn site(
        &self,
        e: &'p Expr,
        before: Option<usize>,
        (is_whole, target): (bool, Option<Span>),
        out: &mut Vec<Site<'p>>,
    ) {
        if e.span.end as usize <= self.reader.text.len() && e.span.start < e.span.end {
            out.push(Site { expr: e, before, is_whole, target });
        }
        for (index, part) in e.parts().into_iter().enumerate() {
            // What depends on a condition is not computed before the statement.
            let conditional = match &e.kind {
                ExprKind::Ternary(..) => index > 0,
                ExprKind::Binary(BinaryOp::And | BinaryOp::Or, ..) => index > 0,
                _ => false,
            };
            let whole = match &e.kind {
                ExprKind::Assign(..) | ExprKind::Call(..) | ExprKind::Builtin(_) | ExprKind::Triple(_) => {
                    true
                }
                ExprKind::Convert(_) => is_whole,
                _ => false,
            };
            let target = match &e.kind {
                ExprKind::Assign(place, _) if part.span == e.span => Some(place.span),
                ExprKind::Convert(_) => target,
                _ => None,
            };
            self.site(part, before.filter(|_| !conditional), (whole, target), out);
        }
    }

    /// Where the statement begins, if another statement may be put there.
    pub(crate) fn start(&self, stmt: &Stmt) -> Option<usize> {
        if !matches!(
            stmt.kind,
            StmtKind::Expr(_)
                | StmtKind::Declare(..)
                | StmtKind::Return(_)
                | StmtKind::If(..)
                | StmtKind::Loop { .. }
        ) {
            return None;
        }
        let from = stmt.span.start as usize;
        let before = self.bare.get(..from)?;
        let mut depth = 0_i32;
        let mut start = None;
        for (at, c) in before.char_indices().rev() {
            match c {
                ')' | ']' => depth += 1,
                '(' | '[' => depth -= 1,
                ';' | '{' | '}' if depth == 0 => {
                    start = Some(at + 1);
                    break;
                }
                _ => {}
            }
            if depth < 0 {
                return None;
            }
        }
        let start = start?;
        let rest = self.bare.get(start..)?;
        let start = start + (rest.len() - rest.trim_start().len());
        let word: String =
            self.bare.get(start..)?.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        let fits = match word.as_str() {
            "if" => matches!(stmt.kind, StmtKind::If(..)) && start == from,
            "for" | "while" => matches!(stmt.kind, StmtKind::Loop { .. }) && start == from,
            "else" | "do" => false,
            _ => start <= from,
        };
        fits.then_some(start)
    }

    /// The blanks before the first character of the line of a position.
    pub(crate) fn indent(&self, at: usize) -> &str {
        let line = self.reader.text.get(..at).map_or(0, |before| before.rfind('\n').map_or(0, |n| n + 1));
        let rest = self.reader.text.get(line..).unwrap_or_default();
        let end = rest.len() - rest.trim_start_matches([' ', '\t']).len();
        rest.get(..end).unwrap_or_default()
    }

    /// Whether only blanks precede a position in its line.
    pub(crate) fn is_first(&self, at: usize) -> bool {
        let before = self.reader.text.get(..at).unwrap_or_default();
        before.chars().rev().take_while(|c| *c != '\n').all(char::is_whitespace)
    }

    /// A name that the shader does not use yet.
    pub(crate) fn unused(&self, base: &str) -> String {
        self.unused_but(base, &[])
    }

    /// A name that neither the shader nor these declarations use.
    pub(crate) fn unused_but(&self, base: &str, taken: &[&str]) -> String {
        let words: std::collections::BTreeSet<&str> = words(self.reader.text).collect();
        let mut names = std::iter::once(base.to_string()).chain((2..).map(|n| format!("{base}{n}")));
        names
            .find(|name| !words.contains(name.as_str()) && !taken.contains(&name.as_str()))
            .unwrap_or_default()
    }

    /// Whether an expression at an earlier place has the same value at a later one: nothing that it reads is
    /// written in between, and its names mean the same.
    pub(crate) fn lasts(&self, e: &Expr, at: Span) -> bool {
        // A loop around the later place, but not around the earlier one, comes back.
        let around = self.loops.iter().filter(|l| holds(**l, at) && !holds(**l, e.span));
        let end = around.map(|l| l.end).fold(at.start, u32::max);
        let mut fits = true;
        e.each(&mut |part| {
            let ExprKind::Read(place) = &part.kind else { return };
            let name = self.program.vars.get(place.var.0 as usize).map(|v| &v.name);
            let hidden = self.program.vars.iter().any(|other| {
                Some(&other.name) == name && other.span.start > e.span.end && other.span.start < at.start
            });
            let (place, _) = Place::around(place.var, &place.path);
            let changes = self.writes(place).any(|w| w.end > e.span.start && w.start < end);
            fits &= !hidden && !changes;
        });
        fits
    }

    /// The line, from 1, in which a span of the main file begins.
    pub(crate) fn line(&self, span: Span) -> Option<u32> {
        let at = span.start as usize;
        (at <= self.reader.text.len()).then(|| self.starts.partition_point(|start| *start <= at) as u32)
    }
}

/// The words of a text.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_')
}

pub(super) fn holds(outer: Span, inner: Span) -> bool {
    outer.start <= inner.start && inner.end <= outer.end
}

/// The text with comments, strings and lines of the preprocessor blanked, byte for byte.
fn bare(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    let blank = |part: &str, out: &mut String| {
        out.extend(part.bytes().map(|b| if b == b'\n' { '\n' } else { ' ' }));
    };
    while let Some(c) = rest.chars().next() {
        let starts_line = out.rsplit('\n').next().is_some_and(|line| line.trim().is_empty());
        let length = if rest.starts_with("//") || (c == '#' && starts_line) {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |n| n + 2)
        } else if c == '"' {
            let mut escaped = false;
            let end = rest.char_indices().skip(1).find(|(_, c)| {
                let ends = *c == '"' && !escaped;
                escaped = *c == '\\' && !escaped;
                ends
            });
            end.map_or(rest.len(), |(at, _)| at + 1)
        } else {
            if c.is_ascii() {
                out.push(c);
            } else {
                blank(rest.get(..c.len_utf8()).unwrap_or_default(), &mut out);
            }
            rest = rest.get(c.len_utf8()..).unwrap_or_default();
            continue;
        };
        // A line of the preprocessor separates statements like a semicolon; an include never holds a part.
        let (part, after) = rest.split_at_checked(length).unwrap_or((rest, ""));
        blank(part, &mut out);
        rest = after;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_strings_are_blank() {
        let text = "a; // b;\n/* c; */ d(\"e;\\\"\"); #x\n#define f;\n";
        let bare = bare(text);
        assert_eq!(bare.len(), text.len());
        assert_eq!(bare.matches(';').count(), 2);
    }
}
