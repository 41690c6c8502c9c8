//! What the compiler adds to a text: conversions that nobody wrote, and the overloads that it chose.

use crate::diagnostic::{Range, range};
use crate::stages::Checked;
use osl_hir::hir::{Expr, ExprKind};
use osl_hir::lint::walk_expressions;
use osl_syntax::span::Span;

/// Something that the compiler adds to a text.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Implied {
    /// An expression, other than a literal, is converted.
    Conversion {
        /// The expression.
        range: Range,
        /// The type after the conversion, as written in the language.
        to: String,
    },
    /// Several functions take the arguments of a call equally well. The type that is expected of the result
    /// decided.
    Result {
        /// The start of the name of the called function.
        range: Range,
        /// The type of the chosen result.
        ty: String,
    },
}

/// What was added to a text without errors, in order of position; nothing for other texts.
pub(crate) fn of(checked: &Checked) -> Vec<Implied> {
    let Some(program) = checked.program.as_ref().filter(|_| !checked.compiled) else { return Vec::new() };
    let mut found: Vec<(Span, bool, String)> = Vec::new();
    walk_expressions(program, &mut |e: &Expr| {
        if let ExprKind::Convert(inner) = &e.kind
            && inner.span == e.span
            && !matches!(inner.kind, ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Convert(_))
        {
            found.push((e.span, false, program.structs.show(e.ty)));
        }
    });
    let chosen = program.choices.iter().filter_map(|(at, choice)| Some((*at, choice.by_result.as_ref()?.1)));
    found.extend(chosen.map(|(at, ty)| (Span::new(at, at), true, program.structs.show(ty))));
    found.sort_unstable();
    found.dedup();
    let implied = |(span, is_result, ty): (Span, bool, String)| {
        let range = range(span, &checked.sources)?;
        Some(if is_result { Implied::Result { range, ty } } else { Implied::Conversion { range, to: ty } })
    };
    found.into_iter().filter_map(implied).collect()
}
