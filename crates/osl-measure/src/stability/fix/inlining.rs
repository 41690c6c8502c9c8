//! Functions of the source as terms: the value that a call returns, with the arguments in place of the
//! formals.
//!
//! This module must not know rows or edits.

use super::components::component;
use super::source::Source;
use super::term::{COMPONENTS, Head, Term, product, sum};
use osl_hir::hir::{Arg, Expr, ExprKind, Init, StmtKind, VarId};

impl Source<'_> {
    /// The value of a call of a function that declares locals and returns an expression; `None` for any other
    /// function.
    pub(super) fn inlined(&self, call: &Expr) -> Option<Term> {
        let ExprKind::Call(id, args) = &call.kind else { return None };
        let function = self.program.functions.get(id.0 as usize)?;
        let (last, before) = function.body.split_last()?;
        let StmtKind::Return(Some(Init::Value(value))) = &last.kind else { return None };
        let mut known: Vec<(VarId, Term)> = Vec::new();
        for (formal, arg) in function.formals.iter().zip(args) {
            let term = match arg {
                Arg::Copy { value: Init::Value(value), back: None } => self.reader.term(value)?,
                Arg::Alias(place) if place.path.is_empty() => {
                    let name = &self.program.vars.get(place.var.0 as usize)?.name;
                    self.reader.variable(place.var, Some(place.ty), call.span, name)
                }
                _ => return None,
            };
            known.push((*formal, term));
        }
        for stmt in before {
            let StmtKind::Declare(var, Some(Init::Value(value))) = &stmt.kind else { return None };
            let term = self.substituted(&self.reader.term(value)?, &known)?;
            known.push((*var, term));
        }
        if known.iter().any(|(var, _)| !self.writes(*var).is_empty()) {
            return None;
        }
        self.substituted(&self.reader.term(value)?, &known)
    }

    /// The term with other terms for some variables; `None` if these are read in a part without structure.
    fn substituted(&self, term: &Term, known: &[(VarId, Term)]) -> Option<Term> {
        let covers = |found: &Term| term.covers.iter().chain(&found.covers).copied().collect();
        if let Some((_, found)) = term.var.and_then(|(var, _)| known.iter().find(|(own, _)| *own == var)) {
            return Some(Term { covers: covers(found), ..found.clone() });
        }
        let reads = |text: &str| {
            let names = known.iter().filter_map(|(var, _)| self.program.vars.get(var.0 as usize));
            let mut names = names.map(|var| &*var.name);
            names.any(|name| text.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == name))
        };
        if !term.text.as_ref().is_none_or(|text| reads(text)) {
            return Some(term.clone());
        }
        if term.parts.is_empty() && term.text.is_some() {
            return None;
        }
        let parts: Vec<Term> =
            term.parts.iter().map(|part| self.substituted(part, known)).collect::<Option<_>>()?;
        let made = match &term.head {
            Head::Sum(flags) => sum(flags.iter().copied().zip(parts).collect()),
            Head::Product(flags) => product(flags.iter().copied().zip(parts).collect()),
            Head::Call(name) => match COMPONENTS.iter().position(|own| own == &&**name) {
                Some(index) => component(index, parts.first()?)?,
                None => Term::new(term.head.clone(), parts),
            },
            _ => return None,
        };
        Some(Term { covers: covers(&made), ty: term.ty, text: None, ..made })
    }
}
