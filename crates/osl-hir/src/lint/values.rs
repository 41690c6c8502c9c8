//! Finds values that are hardly intended: the assignment of a variable to itself, an exact comparison of
//! computed floats, an int division that loses its fraction.
//!
//! Equality of floats is exact, which is fine if one side is a number that arithmetic reaches exactly: a
//! literal with few binary digits such as 0 or 0.5, an int, or the result of `floor` and the like. `0.1` is
//! not such a number, since no float equals it. Comparisons between variables or literals are not reported
//! either, since values that were only copied are equal or not. A comparison of a variable with itself is a
//! test for NaN, and the functions that define `==` and `!=` for structs are about exact equality by nature.

use super::walk::{Event, Walk, bodies, each_stmt};
use super::{Findings, codes, codes_of_slips as slips, removal};
use crate::builtins::Emit;
use crate::hir::{Expr, ExprKind, Init, Lvalue, Step, Stmt, StmtKind};
use osl_ir::ir::Continuity;
use osl_ir::types::Type;
use osl_syntax::ast::{BinaryOp, UnaryOp};
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;

/// Maximum number of bytes between two operands, including a comment.
const MAX_BETWEEN: u32 = 1000;

/// The functions behind `==` and `!=` of structs.
const EQUALITIES: &[&str] = &["__operator__eq__", "__operator__neq__"];

/// Reports the findings described above.
pub(super) fn run(walk: &Walk<'_>, found: &mut Findings<'_>) {
    walk.everything(&mut |event| {
        if let Event::Expr(e) = event {
            division(e, found);
        }
    });
    let mut equalities = |event: Event<'_>| {
        if let Event::Expr(e) = event {
            equality(e, found);
        }
    };
    walk.params(&mut equalities);
    walk.all(&walk.program.shader.body, &mut equalities);
    for function in walk.program.functions.iter().filter(|f| !EQUALITIES.contains(&&*f.name)) {
        walk.all(&function.body, &mut equalities);
    }
    for body in bodies(walk.program) {
        each_stmt(body, &mut |stmt| {
            walk.own(stmt, &mut |event| {
                if let Event::Expr(e) = event {
                    self_assignment(e, stmt, found);
                }
            });
        });
    }
}

fn self_assignment(e: &Expr, stmt: &Stmt, found: &mut Findings<'_>) {
    let ExprKind::Assign(place, value) = &e.kind else { return };
    let Init::Value(value) = &**value else { return };
    let ExprKind::Read(source) = &value.kind else { return };
    if place.var != source.var || !same_path(place, source) {
        return;
    }
    let text = found.text(place.span).to_owned();
    // Both sides come from one macro: the user sees no assignment.
    if place.span == source.span {
        return;
    }
    let mut d = codes::self_assignment(e.span, &text);
    let whole = matches!(&stmt.kind, StmtKind::Expr(own) if own.span == e.span);
    let alone = found.text(stmt.span).strip_suffix(';').map(str::trim_end) == Some(found.text(e.span));
    if whole && alone && !text.is_empty() {
        d = d.fix("remove the statement", vec![removal_or_empty(found, stmt.span)]);
    }
    found.report(d);
}

/// Removing a whole line is safe inside a block; if the statement is the lone body of an `if`, a statement
/// must remain.
fn removal_or_empty(found: &Findings<'_>, span: Span) -> Edit {
    let edit = removal(found.sources, span);
    let before = found.sources.file_at(span.start).and_then(|f| f.text.get(..(span.start - f.base) as usize));
    let last = before.and_then(|t| t.chars().rev().take(MAX_BETWEEN as usize).find(|c| !c.is_whitespace()));
    let in_block = matches!(last, Some(';' | '{' | '}'));
    if in_block { edit } else { Edit { span, text: "{ }".to_owned() } }
}

fn same_path(a: &Lvalue, b: &Lvalue) -> bool {
    let same = |x: &Step, y: &Step| match (x, y) {
        (Step::Field(x), Step::Field(y)) => x == y,
        (Step::Element(x), Step::Element(y)) | (Step::Component(x), Step::Component(y)) => same_index(x, y),
        (Step::Cell(r, c), Step::Cell(s, d)) => same_index(r, s) && same_index(c, d),
        _ => false,
    };
    a.path.len() == b.path.len() && a.path.iter().zip(&b.path).all(|(x, y)| same(x, y))
}

/// Whether two indices are certainly equal: the same constant or plain variable.
fn same_index(a: &Expr, b: &Expr) -> bool {
    match (&a.kind, &b.kind) {
        (ExprKind::Int(a), ExprKind::Int(b)) => a == b,
        (ExprKind::Read(a), ExprKind::Read(b)) => a.var == b.var && a.path.is_empty() && b.path.is_empty(),
        _ => false,
    }
}

fn equality(e: &Expr, found: &mut Findings<'_>) {
    let ExprKind::Binary(op @ (BinaryOp::Eq | BinaryOp::Ne), a, b) = &e.kind else { return };
    let real = |t: Type| t == Type::FLOAT || t.is_triple();
    if !real(a.ty) || !real(b.ty) || exact(a) || exact(b) || !(computed(a) || computed(b)) {
        return;
    }
    let symbol = if *op == BinaryOp::Eq { "==" } else { "!=" };
    let triple = a.ty.is_triple() || b.ty.is_triple();
    let literal = [a, b].into_iter().find(|e| matches!(e.kind, ExprKind::Float(_))).map(|e| e.span);
    let between = Span::new(a.span.end, b.span.start.max(a.span.end));
    // If a macro made them, the operands may be far apart.
    let near = (between.end - between.start < MAX_BETWEEN).then_some(between);
    let token = near.and_then(|between| found.text(between).find(symbol)).map(|at| between.start + at as u32);
    let span = token.map_or(e.span, |start| Span::new(start, start + 2));
    found.report(codes::float_equality(span, symbol, literal, triple));
}

/// Whether the value is the direct result of arithmetic or of a function.
fn computed(e: &Expr) -> bool {
    match &e.kind {
        ExprKind::Binary(..) | ExprKind::Builtin(_) | ExprKind::Call(..) => true,
        ExprKind::Convert(inner) | ExprKind::Unary(_, inner) => computed(inner),
        ExprKind::Triple(parts) => parts.iter().any(computed),
        ExprKind::Ternary(_, a, b) => computed(a) || computed(b),
        ExprKind::Comma(list) => list.last().is_some_and(computed),
        _ => false,
    }
}

/// Whether arithmetic reaches the value exactly.
fn exact(e: &Expr) -> bool {
    match &e.kind {
        ExprKind::Float(x) => x.to_bits().trailing_zeros() >= 8,
        ExprKind::Int(_) => true,
        ExprKind::Convert(inner) => inner.ty == Type::INT || exact(inner),
        ExprKind::Unary(UnaryOp::Neg, inner) => exact(inner),
        ExprKind::Triple(parts) => parts.iter().all(exact),
        ExprKind::Ternary(_, a, b) => exact(a) && exact(b),
        ExprKind::Builtin(call) => match call.row.emit {
            Emit::Lane(op) => op.continuity() == Continuity::Step,
            _ => false,
        },
        _ => false,
    }
}

fn division(e: &Expr, found: &mut Findings<'_>) {
    let ExprKind::Convert(value) = &e.kind else { return };
    if value.ty == Type::INT && e.ty != Type::INT {
        divisions_in(value, found);
        // A cast says that it is intended.
        if e.span == value.span {
            truncated_in(value, found);
        }
    }
}

/// Reports the lossy divisions of literals in int arithmetic.
fn divisions_in(e: &Expr, found: &mut Findings<'_>) {
    match &e.kind {
        ExprKind::Unary(UnaryOp::Neg, inner) => divisions_in(inner, found),
        ExprKind::Binary(op, a, b) => {
            if let (BinaryOp::Div, ExprKind::Int(x), ExprKind::Int(y)) = (op, &a.kind, &b.kind) {
                if x.checked_rem(*y).is_some_and(|rest| rest != 0) {
                    lossy(e, (a, *x), *y, found);
                }
            } else if matches!(op, BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul | BinaryOp::Div) {
                divisions_in(a, found);
                divisions_in(b, found);
            }
        }
        _ => {}
    }
}

/// Reports the division of ints, not both literals, that is the value or a factor or term of it.
fn truncated_in(e: &Expr, found: &mut Findings<'_>) {
    let ExprKind::Binary(op, a, b) = &e.kind else { return };
    match op {
        BinaryOp::Div if !matches!((&a.kind, &b.kind), (ExprKind::Int(_), ExprKind::Int(_))) => {
            let plain =
                matches!(a.kind, ExprKind::Read(_) | ExprKind::Int(_)) && !found.text(a.span).is_empty();
            found.report(slips::truncated_division(e.span, a.span, plain));
        }
        BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul => {
            truncated_in(a, found);
            truncated_in(b, found);
        }
        _ => {}
    }
}

fn lossy(e: &Expr, (numerator, x): (&Expr, i32), y: i32, found: &mut Findings<'_>) {
    let mut d = codes::integer_division(e.span, x, y);
    let digits = found.text(numerator.span).trim_start_matches('-').trim_start();
    if !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()) {
        let end = numerator.span.end;
        d = d.suggest(
            "make it a float division",
            vec![Edit { span: Span::new(end, end), text: ".0".to_owned() }],
        );
    }
    found.report(d);
}
