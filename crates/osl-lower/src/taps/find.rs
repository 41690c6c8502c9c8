//! Finds the statement and the variable of a tap in the resolved tree.
//!
//! The statement is the last one that begins on the line and is not inside of another one that does: so the
//! line of a loop's head means the state after the loop. With a round, it is the innermost statement, or the
//! rounds of the loop.

use super::{Site, Tap, TapPart, TapPath, Tapped};
use crate::flow;
use osl_hir::hir::{Program, Stmt, StmtKind, Var, VarId, VarKind};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::source::SourceMap;
use osl_syntax::span::Span;
use osl_syntax::spelling::closest;

/// Why a tap cannot be found.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TapError {
    /// No file has this name.
    #[error("there is no file `{0}` among the sources")]
    File(String),
    /// No statement is on the line; also the nearest lines with one.
    #[error("there is no statement on line {line}{near}")]
    Line {
        /// The line.
        line: u32,
        /// The nearest lines, in words.
        near: String,
    },
    /// The line knows no such variable; also the closest name, or the known names.
    #[error("line {line} knows no variable `{name}`{hint}")]
    Variable {
        /// The line.
        line: u32,
        /// The name.
        name: String,
        /// A suggestion, in words.
        hint: String,
    },
    /// The variable has no such part.
    #[error("`{0}` has no part {1}")]
    Part(String, String),
    /// No pixels for such a value.
    #[error("`{0}` is {1}; a tap shows one value: name an element")]
    Kind(String, &'static str),
    /// A call is not on its line.
    #[error("there is no line {0} for a call")]
    Call(u32),
}

/// A statement on the wanted line.
struct FoundStmt<'p> {
    stmt: &'p Stmt,
    site: Site,
    /// The variables that are visible after it, the innermost last.
    scope: Vec<VarId>,
    /// Whether some points may not get there.
    conditional: bool,
}

struct Walk<'p> {
    lines: Vec<(u32, u32)>,
    innermost: bool,
    scope: Vec<VarId>,
    found: Option<FoundStmt<'p>>,
}

impl<'p> Walk<'p> {
    fn is_on(&self, span: Span) -> bool {
        self.lines.iter().any(|(start, end)| (*start..*end).contains(&span.start))
    }

    fn list(&mut self, list: &'p [Stmt], mut conditional: bool, inside: bool) {
        let depth = self.scope.len();
        for stmt in list {
            self.stmt(stmt, conditional, inside);
            conditional |= flow::of(stmt).may_leave();
        }
        self.scope.truncate(depth);
    }

    fn stmt(&mut self, stmt: &'p Stmt, conditional: bool, inside: bool) {
        let here = self.is_on(stmt.span);
        let within = inside || here;
        let before = self.found.take();
        match &stmt.kind {
            StmtKind::Declare(var, _) => self.scope.push(*var),
            StmtKind::Block(list) => self.list(list, conditional, within),
            StmtKind::If(_, then, otherwise) => {
                self.list(then, true, within);
                self.list(otherwise, true, within);
            }
            StmtKind::Loop { body, .. } => self.list(body, true, within),
            _ => {}
        }
        let inner = self.found.take();
        let has_inner = inner.is_some();
        self.found = inner.or(before);
        let takes = if self.innermost {
            here && !matches!(stmt.kind, StmtKind::Block(_) | StmtKind::If(..))
        } else {
            here && !inside
        };
        if !takes {
            return;
        }
        let span = stmt.span;
        let site = match stmt.kind {
            // A statement of the body on the same line comes first.
            StmtKind::Loop { .. } if self.innermost && has_inner => return,
            StmtKind::Loop { .. } if self.innermost => Site::Round(span.start, span.end),
            _ => Site::After(span.start, span.end),
        };
        // The variables that it declares itself are known on its line too.
        let mut scope = self.scope.clone();
        declared(stmt, &self.lines, &mut scope);
        let conditional = conditional || flow::of(stmt).may_leave() || matches!(site, Site::Round(..));
        self.found = Some(FoundStmt { stmt, site, scope, conditional });
    }
}

/// Adds the variables that a statement declares on some lines.
fn declared(stmt: &Stmt, lines: &[(u32, u32)], out: &mut Vec<VarId>) {
    let is_on = |span: Span| lines.iter().any(|(start, end)| (*start..*end).contains(&span.start));
    let all = |list: &[Stmt], out: &mut Vec<VarId>| list.iter().for_each(|inner| declared(inner, lines, out));
    match &stmt.kind {
        StmtKind::Declare(var, _) if is_on(stmt.span) && !out.contains(var) => out.push(*var),
        StmtKind::Block(list) => all(list, out),
        StmtKind::If(_, then, otherwise) => {
            all(then, out);
            all(otherwise, out);
        }
        StmtKind::Loop { body, .. } => all(body, out),
        _ => {}
    }
}

/// The ranges of positions of a line in the files that match, relative to a program whose spans begin at
/// `base`.
fn ranges(sources: &SourceMap, base: u32, file: &str, line: u32) -> Vec<(u32, u32)> {
    let files = sources.files().iter().filter(|f| f.name == file && f.base >= base);
    files
        .filter_map(|f| {
            let start = f.line_start(line)? as u32;
            let end = f.line_start(line + 1).map_or(f.text.len() as u32 + 1, |end| end as u32);
            Some((f.base - base + start, f.base - base + end))
        })
        .collect()
}

/// The lines of a file on which a statement begins, in order.
pub fn lines(program: &Program, sources: &SourceMap, base: u32, file: &str) -> Vec<u32> {
    fn collect(list: &[Stmt], out: &mut Vec<Span>) {
        for stmt in list {
            match &stmt.kind {
                StmtKind::Block(list) | StmtKind::Loop { body: list, .. } => collect(list, out),
                StmtKind::If(_, then, otherwise) => {
                    collect(then, out);
                    collect(otherwise, out);
                }
                _ => {}
            }
            if !matches!(stmt.kind, StmtKind::Block(_)) {
                out.push(stmt.span);
            }
        }
    }
    let mut spans = Vec::new();
    program.functions.iter().for_each(|function| collect(&function.body, &mut spans));
    collect(&program.shader.body, &mut spans);
    let place = |span: Span| sources.line(span.moved(base)).filter(|(f, _)| f.name == file);
    let mut lines: Vec<u32> = spans.into_iter().filter_map(place).map(|(_, line)| line).collect();
    lines.sort_unstable();
    lines.dedup();
    lines
}

/// Finds a tap in layers, each a program and the start of its files in `sources`: without a file in the last
/// layer, else in the last one that has the file.
///
/// # Errors
/// There is no such file, line, variable or part.
pub fn find_in(wanted: &TapPath, layers: &[(&Program, u32)], sources: &SourceMap) -> Result<Tap, TapError> {
    let mut found = Err(TapError::File(wanted.file.clone().unwrap_or_default()));
    for (layer, (program, base)) in layers.iter().enumerate().rev() {
        found = find(wanted, program, (sources, *base), layer);
        if wanted.file.is_none() || !matches!(found, Err(TapError::File(_))) {
            break;
        }
    }
    found
}

/// Finds a tap in a program whose files are in `sources` from `base` on.
///
/// # Errors
/// There is no such line, variable or part.
pub fn find(
    wanted: &TapPath,
    program: &Program,
    (sources, base): (&SourceMap, u32),
    layer: usize,
) -> Result<Tap, TapError> {
    let main = sources.file_at(base).map(|file| file.name.clone());
    let file = match &wanted.file {
        None => main.unwrap_or_default(),
        Some(end) => {
            let is = |name: &str| {
                name == end || name.strip_suffix(end.as_str()).is_some_and(|rest| rest.ends_with(['/', '\\']))
            };
            let found = sources.files().iter().filter(|f| f.base >= base).find(|f| is(&f.name));
            found.map(|f| f.name.clone()).ok_or_else(|| TapError::File(end.clone()))?
        }
    };
    let found = statement(wanted, program, ranges(sources, base, &file, wanted.line));
    let Some(found) = found else { return Err(no_line(wanted, &lines(program, sources, base, &file))) };
    let mut calls = Vec::new();
    for line in &wanted.calls {
        calls.push(ranges(sources, base, &file, *line).first().copied().ok_or(TapError::Call(*line))?);
    }
    let (var, ty) = variable(wanted, program, &found)?;
    let mut tap = Tap {
        name: wanted.output().into(),
        mask: wanted.mask().into(),
        conditional: found.conditional || wanted.round.is_some() || !calls.is_empty(),
        layer,
        ty,
        site: found.site,
        var,
        fields: Vec::new(),
        elements: Vec::new(),
        component: None,
        round: wanted.round,
        calls,
    };
    follow(wanted, program, &mut tap)?;
    Ok(tap)
}

fn statement<'p>(wanted: &TapPath, program: &'p Program, lines: Vec<(u32, u32)>) -> Option<FoundStmt<'p>> {
    let mut walk = Walk { lines, innermost: wanted.round.is_some(), scope: Vec::new(), found: None };
    for function in &program.functions {
        walk.scope.clone_from(&function.formals);
        walk.list(&function.body, true, false);
    }
    walk.scope.clear();
    walk.list(&program.shader.body, false, false);
    walk.found
}

fn no_line(wanted: &TapPath, lines: &[u32]) -> TapError {
    let line = wanted.line;
    let (before, after) = (lines.iter().rev().find(|l| **l < line), lines.iter().find(|l| **l > line));
    let near = match (before, after) {
        (Some(before), Some(after)) => format!("; the nearest are on lines {before} and {after}"),
        (Some(near), None) | (None, Some(near)) => format!("; the nearest is on line {near}"),
        (None, None) => String::new(),
    };
    TapError::Line { line, near }
}

fn variable(wanted: &TapPath, program: &Program, found: &FoundStmt<'_>) -> Result<(Tapped, Type), TapError> {
    let name = wanted.variable.as_str();
    if name == "return"
        && let StmtKind::Return(Some(_)) = &found.stmt.kind
        && let Some(function) = program.functions.iter().find(|f| holds(&f.body, found.stmt))
    {
        return Ok((Tapped::Returned, function.ret));
    }
    let var = |id: VarId| program.vars.get(id.0 as usize);
    let local = found.scope.iter().rev().find(|id| var(**id).is_some_and(|var| &*var.name == name)).copied();
    // Then parameters and globals.
    let is_wide = |var: &Var| matches!(var.kind, VarKind::Global(_) | VarKind::Param { .. });
    let wide = || {
        let ids = (0..program.vars.len() as u32).map(VarId);
        let mut named = ids.filter(|id| var(*id).is_some_and(|v| is_wide(v) && &*v.name == name));
        named.next_back()
    };
    if let Some(id) = local.or_else(wide)
        && let Some(var) = var(id)
    {
        return Ok((Tapped::Var(id), var.ty));
    }
    let locals = found.scope.iter().rev().filter_map(|id| var(*id));
    let all = locals.chain(program.vars.iter().filter(|v| is_wide(v)));
    let names: Vec<&str> = all.map(|v| &*v.name).collect();
    let hint = match closest(name, names.iter().copied()) {
        Some(close) => format!("; did you mean `{close}`?"),
        None => {
            let first: Vec<&str> = names.into_iter().take(8).collect();
            format!("; it knows {}", first.join(", "))
        }
    };
    Err(TapError::Variable { line: wanted.line, name: name.to_string(), hint })
}

/// Whether a list of statements contains one, at any depth.
fn holds(list: &[Stmt], wanted: &Stmt) -> bool {
    list.iter().any(|stmt| {
        std::ptr::eq(stmt, wanted)
            || match &stmt.kind {
                StmtKind::Block(list) | StmtKind::Loop { body: list, .. } => holds(list, wanted),
                StmtKind::If(_, then, otherwise) => holds(then, wanted) || holds(otherwise, wanted),
                _ => false,
            }
    })
}

/// Follows the path from the variable to its part.
fn follow(wanted: &TapPath, program: &Program, tap: &mut Tap) -> Result<(), TapError> {
    let name = &wanted.variable;
    for part in &wanted.path {
        match part {
            TapPart::Field(field) => {
                let none = || TapError::Part(name.clone(), format!("`{field}`"));
                let (at, found) =
                    tap.ty.as_struct().and_then(|id| program.structs.field(id, field)).ok_or_else(none)?;
                tap.fields.push(at);
                tap.ty = found.ty;
            }
            TapPart::Element(index) => {
                let none = || TapError::Part(name.clone(), format!("[{index}]"));
                let fits = |len: u32| *index < len;
                match tap.ty.extent {
                    Extent::Array(len) if fits(len) => tap.elements.push(*index),
                    Extent::Unsized => tap.elements.push(*index),
                    Extent::One if tap.ty.is_triple() && *index < 3 && tap.component.is_none() => {
                        tap.component = Some(*index);
                        tap.ty = Type::FLOAT;
                        continue;
                    }
                    _ => return Err(none()),
                }
                tap.ty = tap.ty.element();
            }
        }
    }
    match tap.ty {
        ty if ty.extent == Extent::Unsized => Err(TapError::Kind(name.clone(), "an array of any length")),
        ty if ty.base == Base::Void => Err(TapError::Kind(name.clone(), "nothing")),
        _ => Ok(()),
    }
}
