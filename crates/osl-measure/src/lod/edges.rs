//! Candidates: edges of the shader's body that become softer where a pixel is wide, as a filter over the
//! pixel would make them: `smoothstep`, `step`, and a choice by a comparison.
//!
//! The edge is widened by a multiple of the width of a pixel, which stands for the slope of what is compared.
//! At footprint 1 nothing is added.

use super::write::Frame;
use crate::stability::fix::source::Source;
use crate::stability::fix::term::binds;
use osl_hir::builtins::Emit;
use osl_hir::hir::{Expr, ExprKind};
use osl_ir::ir::LaneOp;
use osl_ir::types::Type;
use osl_syntax::ast::BinaryOp;
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;

/// An edge that can become softer.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    span: Span,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    /// `smoothstep`: the ends of its first two arguments.
    Smooth([u32; 2]),
    /// The texts of the edge and of the value, and of the results below and above, if they are not 0 and 1.
    Sharp { edge: String, value: String, results: Option<[String; 2]> },
}

/// Maximum number of edges.
const MOST: usize = 12;
/// The multiples of the width of a pixel that are tried.
pub(super) const SLOPES: [&str; 9] = ["0.25", "0.5", "1", "2", "4", "8", "16", "32", "64"];

/// The edges in the shader's body.
pub(super) fn edges(source: &Source<'_>, frame: &Frame) -> Vec<Edge> {
    let mut out: Vec<Edge> = Vec::new();
    for site in source.sites() {
        let (from, to) = (site.expr.span.start as usize, site.expr.span.end as usize);
        if from < frame.open || to > frame.close {
            continue;
        }
        let found = edge(source, site.expr);
        let is_new = |own: &Edge| !out.iter().any(|other| other.span == own.span);
        if let Some(own) = found.filter(is_new) {
            out.push(own);
        }
    }
    out.truncate(MOST);
    out
}

fn edge(source: &Source<'_>, e: &Expr) -> Option<Edge> {
    let is_float = |e: &Expr| e.ty == Type::FLOAT;
    let text = |e: &Expr| {
        let (text, own) = source.reader.source(e)?;
        Some(if own < binds::PRODUCT { format!("({text})") } else { text })
    };
    let kind = match &e.kind {
        ExprKind::Builtin(call) if call.args.iter().all(is_float) => match (call.row.emit, &call.args[..]) {
            (Emit::Lane(LaneOp::Smoothstep), [low, high, _]) => {
                // Something is added after each edge.
                for edge in [low, high] {
                    let (_, own) = source.reader.source(edge)?;
                    let written = source.reader.text.get(edge.span.start as usize..edge.span.end as usize)?;
                    if own < binds::SUM && !written.starts_with('(') {
                        return None;
                    }
                }
                Kind::Smooth([low.span.end, high.span.end])
            }
            (Emit::Lane(LaneOp::Step), [edge, value]) => {
                Kind::Sharp { edge: plain(source, edge)?, value: plain(source, value)?, results: None }
            }
            _ => return None,
        },
        ExprKind::Ternary(test, yes, no) if is_float(e) => {
            let ExprKind::Binary(op, a, b) = &test.kind else { return None };
            if !is_float(a) || !is_float(b) {
                return None;
            }
            let (yes, no) = (text(yes)?, text(no)?);
            // The edge is what is simpler to read: the right side, unless that is a call.
            let (edge, value, results) = match op {
                BinaryOp::Lt | BinaryOp::Le => (plain(source, b)?, plain(source, a)?, [yes, no]),
                BinaryOp::Gt | BinaryOp::Ge => (plain(source, b)?, plain(source, a)?, [no, yes]),
                _ => return None,
            };
            let results = (results != ["0", "1"]).then_some(results);
            Kind::Sharp { edge, value, results }
        }
        _ => return None,
    };
    Some(Edge { span: e.span, kind })
}

/// The text of an operand of a sum.
fn plain(source: &Source<'_>, e: &Expr) -> Option<String> {
    let (text, own) = source.reader.source(e)?;
    Some(if own < binds::SUM { format!("({text})") } else { text })
}

/// The edits that soften an edge by a multiple of a variable. Edits within the edge are in their text.
pub(super) fn soften(own: &Edge, slope: &str, soft: &str) -> Vec<Edit> {
    let by = if slope == "1" { soft.to_string() } else { format!("{slope} * {soft}") };
    match &own.kind {
        Kind::Smooth(ends) => {
            let edit =
                |(at, sign): (u32, &str)| Edit { span: Span::new(at, at), text: format!(" {sign} {by}") };
            [(ends[0], "-"), (ends[1], "+")].map(edit).into()
        }
        Kind::Sharp { edge, value, results } => {
            let smooth = format!("smoothstep({edge} - {by}, {edge} + {by}, {value})");
            let text = match results {
                None => smooth,
                Some([one, zero]) if one == "1" && zero == "0" => format!("1 - {smooth}"),
                Some([below, above]) => format!("mix({below}, {above}, {smooth})"),
            };
            vec![Edit { span: own.span, text }]
        }
    }
}

/// Whether an edge and an edit exclude each other.
pub(super) fn excludes(own: &Edge, edit: &Edit) -> bool {
    let inside = own.span.start <= edit.span.start && edit.span.end <= own.span.end;
    let around = edit.span.start < own.span.start && own.span.end < edit.span.end;
    (inside && matches!(own.kind, Kind::Sharp { .. })) || around
}
