//! Finds variables that only a query sets, without a check whether the query succeeded: if it fails, they
//! have no value.
//!
//! Reported is a local variable without an initialiser that is read and whose only writers are such calls,
//! each a statement by itself.

use super::walk::{Event, Purpose, Walk, bodies, each_stmt};
use super::{Findings, codes};
use crate::hir::{ExprKind, StmtKind, VarId, VarKind};
use osl_syntax::span::Span;
use rustc_hash::{FxHashMap, FxHashSet};

/// The calls that write a variable.
#[derive(Default)]
struct Writers {
    all: usize,
    /// Queries whose result is ignored.
    queries: usize,
    first: Option<(Span, &'static str)>,
}

/// Reports such variables, at the first call.
pub(super) fn run(walk: &Walk<'_>, found: &mut Findings<'_>) {
    let mut writers: FxHashMap<VarId, Writers> = FxHashMap::default();
    let mut bare: FxHashSet<VarId> = FxHashSet::default();
    let mut read: FxHashSet<VarId> = FxHashSet::default();
    for body in bodies(walk.program) {
        each_stmt(body, &mut |stmt| {
            if let StmtKind::Declare(var, None) = &stmt.kind {
                bare.insert(*var);
            }
            if let StmtKind::Expr(e) = &stmt.kind
                && let ExprKind::Builtin(call) = &e.kind
                && call.row.facts.query
            {
                for place in call.outputs.iter().flatten() {
                    let writers = writers.entry(place.var).or_default();
                    writers.queries += 1;
                    writers.first.get_or_insert((e.span, call.row.name));
                }
            }
        });
    }
    walk.everything(&mut |event| match event {
        Event::Write { var, .. } | Event::Output { var } => writers.entry(var).or_default().all += 1,
        Event::Read { var, purpose: Purpose::Value, .. } => {
            read.insert(var);
        }
        _ => {}
    });
    let mut list: Vec<_> =
        writers.into_iter().filter(|(var, w)| w.all == w.queries && bare.contains(var)).collect();
    list.sort_by_key(|(var, _)| *var);
    for (id, writers) in list {
        let (Some(var), Some((span, query))) = (walk.var(id), writers.first) else { continue };
        if var.kind == VarKind::Local && read.contains(&id) && found.is_written(var.span, &var.name) {
            found.report(codes::unchecked_query(span, &var.name, query, var.span));
        }
    }
}
