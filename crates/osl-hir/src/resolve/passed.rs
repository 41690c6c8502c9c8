//! Arguments that a called function changes although they must not change: inputs of the shader and literals.
//!
//! A function may assign to a formal that is no output; then the caller's variable changes. The reference
//! inlines the calls and refuses what assigns to an input or a constant, so only functions that the shader
//! reaches count, and whatever passes the argument on.

use super::errors;
use crate::hir::{Arg, ExprKind, FunctionId, Init, Program, Stmt, StmtKind, VarId, VarKind};
use crate::lint::walk::{Event, Walk};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::span::Span;
use rustc_hash::FxHashSet;

/// The errors of all calls that the shader reaches.
pub(super) fn check(program: &Program) -> Vec<Diagnostic> {
    if program.functions.is_empty() {
        return Vec::new();
    }
    let walk = Walk::new(program);
    let mut calls: Vec<(FunctionId, &[Arg])> = Vec::new();
    let mut reached = FxHashSet::default();
    walk.params(&mut |event| collect_call(event, &mut calls));
    walk.all(&program.shader.body, &mut |event| collect_call(event, &mut calls));
    let mut found = Vec::new();
    while let Some((id, args)) = calls.pop() {
        let Some(function) = program.functions.get(id.0 as usize) else { continue };
        if reached.insert(id) {
            walk.all(&function.body, &mut |event| collect_call(event, &mut calls));
        }
        for (formal, arg) in function.formals.iter().zip(args) {
            let Some(var) = walk.var(*formal) else { continue };
            if var.kind != (VarKind::Formal { output: false }) || !walk.is_written(*formal) {
                continue;
            }
            if let Some((span, what)) = fixed(&walk, arg) {
                let d = errors::written_argument(span, &what, &var.name, var.span);
                found.push(match tested(&function.body, *formal) {
                    Some(condition) => d
                        .also(condition, "an assignment")
                        .help("`=` assigns in this condition: `==` compares"),
                    None => d,
                });
            }
        }
    }
    found
}

fn collect_call<'p>(event: Event<'p>, calls: &mut Vec<(FunctionId, &'p [Arg])>) {
    if let Event::Expr(e) = event
        && let ExprKind::Call(id, args) = &e.kind
    {
        calls.push((*id, args));
    }
}

/// A condition that is an assignment to a variable.
fn tested(body: &[Stmt], var: VarId) -> Option<Span> {
    let mut open = vec![body];
    while let Some(body) = open.pop() {
        for stmt in body {
            let cond = match &stmt.kind {
                StmtKind::If(cond, then, otherwise) => {
                    open.extend([&otherwise[..], &then[..]]);
                    Some(cond)
                }
                StmtKind::Loop { cond, body, .. } => {
                    open.push(body);
                    cond.as_ref()
                }
                StmtKind::Block(body) => {
                    open.push(body);
                    None
                }
                _ => None,
            };
            if let Some(cond) = cond
                && let ExprKind::Assign(place, _) = &cond.kind
                && place.var == var
            {
                return Some(cond.span);
            }
        }
    }
    None
}

/// The place and description of an argument that must not change.
fn fixed(walk: &Walk<'_>, arg: &Arg) -> Option<(Span, String)> {
    match arg {
        Arg::Alias(place) => {
            let var = walk.var(place.var)?;
            let input = matches!(var.kind, VarKind::Param { output: false, .. });
            input.then(|| (place.span, format!("`{}` is an input parameter and", var.name)))
        }
        Arg::Copy { value: Init::Value(e), back: None } => {
            let literal = matches!(e.kind, ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Str(_));
            literal.then(|| (e.span, "a constant".to_string()))
        }
        Arg::Copy { .. } => None,
    }
}
