//! Lints on the syntax tree alone: variables that hide others, `=` as a condition, and names of metadata.
//!
//! Scopes are those of the language: blocks, functions, and the head of a `for`. Formals of functions at file
//! level may have the names of globals, as in published libraries: such a function is meant to be
//! self-contained.

use super::codes_of_slips::misspelt_metadata;
use super::{Findings, codes};
use crate::hir::GLOBALS;
use osl_syntax::ast::{self, Ast, ExprId, ExprKind, Formal, StmtId, StmtKind};
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;
use osl_syntax::spelling::closest;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Reports shadowing and assignments in conditions.
pub(super) fn run(ast: &Ast, found: &mut Findings<'_>) {
    for item in &ast.items {
        let mut scopes = Scopes { ast, found: &mut *found, open: Vec::new() };
        match item {
            ast::Item::Shader(shader) => {
                scopes.open.push(FxHashMap::default());
                scopes.formals(&shader.formals);
                scopes.list(&shader.body.stmts);
                metadata(&shader.formals, found);
            }
            ast::Item::Function(f) => scopes.function(f),
            ast::Item::Struct(_) => {}
        }
    }
    conditions(ast, found);
}

/// The metadata of parameters that programs read.
const METADATA: &[&str] = &[
    "label",
    "widget",
    "help",
    "page",
    "options",
    "mapper",
    "units",
    "digits",
    "min",
    "max",
    "sensitivity",
    "slidermin",
    "slidermax",
    "slidercenter",
    "sliderexponent",
    "lockgeom",
    "interpolated",
    "connectable",
    "allowconnect",
    "interactive",
    "description",
];

/// Further names of metadata that resemble these.
const OTHER_METADATA: &[&str] = &["unit", "pages", "labels", "option", "mix", "mid"];

/// Longer names of metadata may differ in a letter; of shorter ones, letters may be exchanged.
const LONG: usize = 5;

/// Names of metadata that are almost those that programs read.
fn metadata(formals: &[Formal], found: &mut Findings<'_>) {
    for datum in formals.iter().flat_map(|formal| &formal.metadata) {
        let name = &*datum.name.text;
        if METADATA.contains(&name) || OTHER_METADATA.contains(&name) {
            continue;
        }
        let letters = |name: &str| {
            let mut letters: Vec<char> = name.chars().collect();
            letters.sort_unstable();
            letters
        };
        let close = closest(name, METADATA.iter().copied())
            .filter(|close| name.len() >= LONG || letters(name) == letters(close));
        if let Some(close) = close.filter(|_| found.is_written(datum.name.span, name)) {
            found.report(misspelt_metadata(datum.name.span, name, close));
        }
    }
}

struct Scopes<'a, 'f, 's> {
    ast: &'a Ast,
    found: &'f mut Findings<'s>,
    /// Names with the locations of their declarations; the innermost scope comes last.
    open: Vec<FxHashMap<Arc<str>, Span>>,
}

impl Scopes<'_, '_, '_> {
    fn within(&mut self, work: impl FnOnce(&mut Self)) {
        self.open.push(FxHashMap::default());
        work(self);
        self.open.pop();
    }

    fn function(&mut self, f: &ast::FunctionDecl) {
        let Some(body) = &f.body else { return };
        self.within(|s| {
            s.formals(&f.formals);
            s.list(&body.stmts);
        });
    }

    fn formals(&mut self, formals: &[Formal]) {
        for formal in formals {
            self.declare(&formal.name, false);
        }
    }

    fn declare(&mut self, name: &ast::Name, local: bool) {
        let outer = self.open.iter().rev().find_map(|scope| scope.get(&name.text)).copied();
        // Locals `u` and `v` for other coordinates are idiomatic.
        let idiom = matches!(&*name.text, "u" | "v");
        let global = local && !idiom && GLOBALS.iter().any(|(_, global, ..)| *global == &*name.text);
        if (outer.is_some() || global) && self.found.is_written(name.span, &name.text) {
            self.found.report(codes::shadowing(name.span, &name.text, outer));
        }
        if let Some(scope) = self.open.last_mut() {
            scope.insert(name.text.clone(), name.span);
        }
    }

    fn list(&mut self, list: &[StmtId]) {
        list.iter().for_each(|id| self.stmt(*id));
    }

    fn stmt(&mut self, mut id: StmtId) {
        // A chain of `else if` may be long.
        while let StmtKind::If { then, otherwise, .. } = &self.ast[id].kind {
            self.stmt(*then);
            let Some(next) = otherwise else { return };
            id = *next;
        }
        match &self.ast[id].kind {
            StmtKind::Declare { vars, .. } => vars.iter().for_each(|v| self.declare(&v.name, true)),
            StmtKind::Block(list) => self.within(|s| s.list(list)),
            StmtKind::While { body, .. } | StmtKind::DoWhile { body, .. } => self.stmt(*body),
            StmtKind::For { init, body, .. } => self.within(|s| {
                init.iter().for_each(|id| s.stmt(*id));
                s.stmt(*body);
            }),
            StmtKind::Function(f) => self.function(f),
            StmtKind::Empty
            | StmtKind::Expr(_)
            | StmtKind::Break
            | StmtKind::Continue
            | StmtKind::Return(_)
            | StmtKind::If { .. }
            | StmtKind::Error => {}
        }
    }
}

/// Conditions that are assignments. An assignment in extra parentheses is intended.
fn conditions(ast: &Ast, found: &mut Findings<'_>) {
    let of_stmt = |kind: &StmtKind| match kind {
        StmtKind::If { cond, .. } | StmtKind::While { cond, .. } | StmtKind::DoWhile { cond, .. } => {
            Some(*cond)
        }
        StmtKind::For { cond, .. } => *cond,
        _ => None,
    };
    let of_expr = |kind: &ExprKind| match kind {
        ExprKind::Ternary(cond, ..) => Some(*cond),
        _ => None,
    };
    let stmts = ast.stmts.iter().filter_map(|s| of_stmt(&s.kind));
    for cond in stmts.chain(ast.exprs.iter().filter_map(|e| of_expr(&e.kind))) {
        assignment(ast, cond, found);
    }
}

fn assignment(ast: &Ast, cond: ExprId, found: &mut Findings<'_>) {
    let ExprKind::Assign { op: None, target, value } = &ast[cond].kind else { return };
    let between = Span::new(ast[*target].span.end, ast[*value].span.start);
    let mut d = codes::assignment_in_condition(ast[cond].span);
    // If a macro made them, the two may be far apart.
    let text = if between.end.saturating_sub(between.start) < 1000 { found.text(between) } else { "" };
    if text.trim() == "="
        && let Some(at) = text.find('=')
    {
        let start = between.start + at as u32;
        d = d.suggest(
            "compare instead",
            vec![Edit { span: Span::new(start, start + 1), text: "==".to_owned() }],
        );
    }
    found.report(d);
}
