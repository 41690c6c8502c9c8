//! Dead declarations: removes variables whose only readers a repair replaced.

use super::source::Source;
use super::term::{computes, is_pure};
use osl_hir::hir::{Arg, Expr, ExprKind, Init, StmtKind};
use osl_hir::lint::{bodies, each_stmt};
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;

/// The text of `after` without the declarations of variables that only `before` reads; `None` if there are
/// none.
pub(super) fn removed(before: &Source<'_>, after: &Source<'_>) -> Option<String> {
    let mut edits: Vec<Edit> = Vec::new();
    for body in bodies(after.program) {
        each_stmt(body, &mut |stmt| {
            let StmtKind::Declare(var, Some(Init::Value(value))) = &stmt.kind else { return };
            let Some(name) = after.program.vars.get(var.0 as usize).map(|var| &*var.name) else { return };
            let is_left = does_nothing(after, value)
                && count(after.bare(), name) == 1
                && count(before.bare(), name) != 1;
            if let Some(span) = after.start(stmt).filter(|_| is_left).and_then(|at| declaration(after, at)) {
                edits.push(Edit { span, text: String::new() });
            }
        });
    }
    if edits.is_empty() { None } else { osl_syntax::repair::apply(after.reader.text, &edits) }
}

/// Whether an expression does nothing but compute its value: its calls are of functions that only return an
/// expression.
fn does_nothing(source: &Source<'_>, e: &Expr) -> bool {
    match &e.kind {
        ExprKind::Call(_, args) => {
            let args = args.iter().all(|arg| match arg {
                Arg::Copy { value: Init::Value(value), back: None } => does_nothing(source, value),
                Arg::Copy { .. } => false,
                Arg::Alias(_) => true,
            });
            args && source.inlined(e).is_some_and(|value| value.is_pure)
        }
        _ => is_pure(e) || (computes(e) && e.parts().into_iter().all(|part| does_nothing(source, part))),
    }
}

/// How often a word occurs.
fn count(text: &str, word: &str) -> usize {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|own| *own == word).count()
}

/// The span of the declaration of a single variable that begins at a position, with its line if nothing else
/// is in it.
fn declaration(source: &Source<'_>, start: usize) -> Option<Span> {
    let bare = source.bare();
    let length = bare.get(start..)?.find(';')? + 1;
    let mut depth = 0_i32;
    let is_single = bare.get(start..start + length)?.chars().all(|c| {
        depth += i32::from(c == '(' || c == '{') - i32::from(c == ')' || c == '}');
        c != ',' || depth > 0
    });
    let text = source.reader.text;
    let (mut from, mut to) = (start, start + length);
    let line = text.get(..from)?.rfind('\n').map_or(0, |at| at + 1);
    let next = text.get(to..)?.find('\n').map(|at| to + at + 1)?;
    let is_blank = |part: Option<&str>| part.is_some_and(|part| part.trim().is_empty());
    if is_blank(text.get(line..from)) && is_blank(text.get(to..next)) {
        (from, to) = (line, next);
    }
    is_single.then(|| Span::new(from as u32, to as u32))
}
