//! Statements without effect, functions that can end without a value, outputs that are never written, and
//! constants that make a call or a color something else than it seems.
//!
//! All of it is read from the resolved tree. Whether a call has an effect is known for the functions of the
//! language; calls of the file's own functions count as having one.

use super::constants::Constants;
use super::walk::{Event, Walk, bodies, each_stmt};
use super::{Findings, codes_of_slips as codes, flow};
use crate::builtins::{Emit, Tail};
use crate::hir::{BuiltinCall, Expr, ExprKind, Function, Init, Stmt, StmtKind, VarKind};
use osl_ir::types::{Base, Type};
use osl_syntax::ast::BinaryOp;
use osl_syntax::span::Span;
use rustc_hash::FxHashSet;

/// A part of a color from which on three whole numbers look like bytes.
const BYTE: f32 = 32.0;

/// Reports the findings described above.
pub(super) fn run(walk: &Walk<'_>, found: &mut Findings<'_>) {
    let constants = Constants::of(walk, found);
    for function in &walk.program.functions {
        missing_return(walk, &constants, function, found);
    }
    for body in bodies(walk.program) {
        each_stmt(body, &mut |stmt| {
            if let StmtKind::Expr(e) = &stmt.kind {
                // The argument of a macro is followed by more than a `;`.
                let alone = found.text(stmt.span).strip_suffix(';').map(str::trim_end);
                if alone == Some(found.text(e.span)) {
                    no_effect(walk, e, found);
                    if let ExprKind::Comma(parts) = &e.kind {
                        comma(walk, parts, found);
                    }
                }
            }
        });
    }
    outputs(walk, found);
    // Colors that are scaled, as in `color(255, 128, 0) / 255`. A whole comes before its parts.
    let mut scaled: FxHashSet<Span> = FxHashSet::default();
    walk.everything(&mut |event| {
        if let Event::Expr(e) = event {
            match &e.kind {
                ExprKind::Binary(BinaryOp::Div | BinaryOp::Mul, a, b) => scaled.extend([a.span, b.span]),
                ExprKind::Triple(_) if scaled.contains(&e.span) => {}
                ExprKind::Builtin(call) => edges(&constants, call, e.span, found),
                ExprKind::Triple(parts) if e.ty == Type::COLOR => byte_color(parts, e.span, found),
                _ => {}
            }
        }
    });
}

fn missing_return(walk: &Walk<'_>, constants: &Constants, function: &Function, found: &mut Findings<'_>) {
    let no_value = matches!(function.ret.base, Base::Void | Base::Error);
    if no_value || !found.is_written(function.span, &function.name) || !ends(constants, &function.body) {
        return;
    }
    let ty = walk.program.structs.show(function.ret);
    let article = if ty.starts_with("int") { "an" } else { "a" };
    found.report(codes::missing_return(function.span, &function.name, &format!("{article} {ty}")));
}

/// Whether the end of the list can be reached.
fn ends(constants: &Constants, list: &[Stmt]) -> bool {
    list.iter().all(|stmt| match &stmt.kind {
        StmtKind::Return(_) | StmtKind::Break | StmtKind::Continue => false,
        StmtKind::Expr(e) => !flow::is_exit(e),
        StmtKind::Declare(..) => true,
        StmtKind::Block(inner) => ends(constants, inner),
        StmtKind::If(cond, then, otherwise) => {
            let always = constants.holds(cond);
            ends(constants, then) || (!always && ends(constants, otherwise))
        }
        StmtKind::Loop { cond, test_first, body, .. } => {
            let forever = cond.as_ref().is_none_or(|cond| constants.holds(cond));
            let once = *test_first || ends(constants, body);
            super::jumps::breaks(body) || (!forever && once)
        }
    })
}

/// Parts of a statement that are computed in vain, as in `r = 2,5 * u`.
fn comma(walk: &Walk<'_>, parts: &[Expr], found: &mut Findings<'_>) {
    for pair in parts.windows(2) {
        let [before, part] = pair else { continue };
        let comma = Span::new(before.span.end, part.span.start);
        let digit = |span: Span, last: bool| {
            let text = found.text(span);
            let digit = if last { text.chars().next_back() } else { text.chars().next() };
            digit.is_some_and(|c| c.is_ascii_digit())
        };
        let decimal = found.text(comma) == "," && digit(before.span, true) && digit(part.span, false);
        if decimal && is_pure(walk, part, found) {
            found.report(codes::decimal_comma(part.span, comma));
        } else {
            no_effect(walk, part, found);
        }
    }
}

/// What a statement computes in vain.
fn no_effect(walk: &Walk<'_>, e: &Expr, found: &mut Findings<'_>) {
    if !is_pure(walk, e, found) {
        return;
    }
    let (what, help) = match &e.kind {
        ExprKind::Binary(BinaryOp::Eq, ..) => ("compares, and drops the result", "`=` assigns"),
        ExprKind::Builtin(_) if e.ty == Type::CLOSURE => {
            ("makes a closure that nothing uses", "assign it to `Ci`, or remove it")
        }
        ExprKind::Builtin(_) => {
            ("calls a function, and drops its value", "assign the value, or remove the statement")
        }
        ExprKind::Read(_) | ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Str(_) => {
            ("a value that nothing uses", "assign it, or remove the statement")
        }
        _ => ("computes a value that nothing uses", "assign the value, or remove the statement"),
    };
    found.report(codes::no_effect(e.span, what, help));
}

/// Whether the user wrote an expression here that certainly has no effect.
fn is_pure(walk: &Walk<'_>, e: &Expr, found: &Findings<'_>) -> bool {
    let all = |list: &[Expr]| list.iter().all(|part| is_pure(walk, part, found));
    let starts = |test: fn(char) -> bool| found.text(e.span).starts_with(test);
    match &e.kind {
        ExprKind::Int(_) | ExprKind::Float(_) => starts(|c| c.is_ascii_digit() || "+-.(".contains(c)),
        ExprKind::Str(_) => starts(|c| c == '"'),
        ExprKind::Read(place) => {
            place.path.is_empty()
                && walk.var(place.var).is_some_and(|var| found.is_written(e.span, &var.name))
        }
        ExprKind::Convert(inner) | ExprKind::Unary(_, inner) => is_pure(walk, inner, found),
        ExprKind::Binary(_, a, b) => is_pure(walk, a, found) && is_pure(walk, b, found),
        ExprKind::Triple(parts) => all(&parts[..]),
        ExprKind::Builtin(call) => {
            found.text(e.span).starts_with(call.row.name) && only_computes(call, e.ty) && all(&call.args)
        }
        _ => false,
    }
}

/// Whether a function of the language only computes its value.
fn only_computes(call: &BuiltinCall, ty: Type) -> bool {
    let facts = &call.row.facts;
    let outputs = call.outputs.iter().any(Option::is_some)
        || call
            .row
            .signatures()
            .get(call.overload)
            .is_none_or(|s| s.params.iter().any(|param| param.output) || s.tail == Tail::Any);
    let value = ty.is_triple() || matches!(ty.base, Base::Float | Base::Closure | Base::Matrix);
    let effects = outputs || facts.format.is_some() || facts.query || facts.lookup;
    !effects && (value || matches!(call.row.emit, Emit::Lane(_)))
}

/// Whether the program prints: then its outputs may be there only to make it run.
fn prints(walk: &Walk<'_>) -> bool {
    let mut prints = false;
    walk.everything(&mut |event| {
        if let Event::Expr(Expr { kind: ExprKind::Builtin(call), ty: Type::VOID, .. }) = event {
            prints |= call.row.facts.format.is_some();
        }
    });
    prints
}

/// Outputs of the shader that keep a constant default.
fn outputs(walk: &Walk<'_>, found: &mut Findings<'_>) {
    if walk.program.shader.body.is_empty() || prints(walk) {
        return;
    }
    let mut names: Vec<(Span, &str)> = Vec::new();
    for param in walk.program.shader.params.iter().filter(|param| param.output) {
        let Some(var) = walk.var(param.var) else { continue };
        let computed = match &param.init {
            Init::Value(_) => !param.init.is_constant(),
            Init::List(_) => false,
        };
        let kept = !walk.is_written(param.var) && !computed && !var.name.starts_with('_');
        let is_param = matches!(var.kind, VarKind::Param { .. });
        if kept && is_param && found.is_written(var.span, &var.name) && !found.is_silenced(var.span) {
            names.push((var.span, &var.name));
        }
    }
    if let Some((first, _)) = names.first() {
        let all: Vec<&str> = names.iter().map(|(_, name)| *name).collect();
        found.report(codes::unwritten_outputs(*first, &all));
    }
}

/// Edges and bounds in the wrong order.
fn edges(constants: &Constants, call: &BuiltinCall, span: Span, found: &mut Findings<'_>) {
    let (low, high) = match (call.row.name, &call.args[..]) {
        ("smoothstep" | "linearstep", [low, high, _]) | ("clamp", [_, low, high]) => (low, high),
        ("smooth_linearstep", [low, high, ..]) => (low, high),
        _ => return,
    };
    let number = |e: &Expr| constants.value(e).flatten();
    if let (Some(a), Some(b)) = (number(low), number(high))
        && a > b
        && found.text(span).starts_with(call.row.name)
    {
        found.report(codes::reversed_edges(span, call.row.name, low.span, high.span));
    }
}

/// `color(255, 128, 0)`
fn byte_color(parts: &[Expr; 3], span: Span, found: &mut Findings<'_>) {
    let values: Vec<f32> = parts
        .iter()
        .filter_map(|part| match part.kind {
            ExprKind::Float(x) if (0.0..=255.0).contains(&x) && x == x.trunc() => Some(x),
            _ => None,
        })
        .collect();
    let [r, g, b] = values[..] else { return };
    let grey = r == g && g == b && r != 255.0;
    if r.max(g).max(b) < BYTE || grey || !found.text(span).starts_with("color") {
        return;
    }
    let text = found.text(span);
    let one_piece = text.ends_with(')') && !text.contains("/*");
    found.report(codes::byte_color(span, one_piece.then(|| format!("{text} / 255"))));
}
