//! Substitution of definitions: variables, fields and elements that are set once, calls of functions that
//! only return an expression, and components of triples are replaced by their values.

use super::source::{Definition, Source, holds, words};
use super::term::Place;
use super::term::{COMPONENTS, Head, Term, product, sum};
use osl_hir::hir::{Arg, Expr, ExprKind, Init, StmtKind, VarId};
use osl_ir::types::Type;
use osl_syntax::span::Span;

/// Maximum number of variables that are opened in one expression.
const OPENED: usize = 48;

impl<'p> Source<'p> {
    /// Whether a term calls functions of the source.
    pub(super) fn calls(&self, term: &Term) -> bool {
        let mut calls = false;
        term.each(&mut |part| calls |= part.call.is_some());
        calls
    }

    /// The variables of a term that have a value which still holds there.
    pub(super) fn known(&self, term: &Term) -> Vec<Place> {
        let mut out = Vec::new();
        term.each(&mut |part| {
            if let Some((var, at)) = part.var
                && self.definition(var, at).is_some()
                && !out.contains(&var)
            {
                out.push(var);
            }
        });
        out
    }

    /// The value of a place where it is read: that of its declaration, if nothing else writes it, or that of
    /// the only assignment, if this is always made before.
    fn definition(&self, place: Place, at: Span) -> Option<&'p Expr> {
        let writes = self.writes(place).count();
        let holds_here = |found: &&Definition<'_>| match found.scope {
            None => writes == 0,
            Some(scope) => writes == 1 && holds(scope, at) && found.value.span.end <= at.start,
        };
        let value = self.definitions.get(&place)?.iter().find(holds_here)?.value;
        self.lasts(value, at).then_some(value)
    }

    /// The term with the values of all variables except one in their place, to this depth. Their texts remain
    /// the names.
    pub(super) fn opened(&self, term: &Term, except: Option<Place>, depth: usize) -> Term {
        self.left.set(OPENED);
        self.open(term, except, depth)
    }

    fn open(&self, term: &Term, except: Option<Place>, depth: usize) -> Term {
        if depth == 0 {
            return term.clone();
        }
        if let Some((var, at)) = term.var {
            let chosen = except != Some(var) && self.left.get() > 0;
            let value = self.definition(var, at).filter(|_| chosen).and_then(|value| self.reader.term(value));
            if let Some(value) = value {
                self.left.set(self.left.get().saturating_sub(1));
                let value = self.open(&value, except, depth - 1);
                let covers = value.covers.iter().chain(&term.covers).copied().collect();
                let ty = term.ty;
                // The variable itself may be opened elsewhere, but not twice here.
                return Term { text: term.text.clone(), binds: term.binds, covers, ty, var: None, ..value };
            }
        }
        if let Some(call) = term.call
            && self.left.get() > 0
            && let Some(value) = self.calls.get(&(call.start, call.end)).and_then(|call| self.inlined(call))
        {
            self.left.set(self.left.get().saturating_sub(1));
            let value = self.open(&value, except, depth - 1);
            let covers = value.covers.iter().chain(&term.covers).copied().collect();
            return Term { text: value.text.clone(), covers, ty: term.ty, call: None, ..value };
        }
        let parts: Vec<Term> = term.parts.iter().map(|part| self.open(part, except, depth)).collect();
        let again = |made: Term| Term {
            text: term.text.clone(),
            binds: term.binds,
            covers: made.covers.iter().chain(&term.covers).copied().collect(),
            ty: term.ty,
            ..made
        };
        match &term.head {
            Head::Sum(flags) => again(sum(flags.iter().copied().zip(parts).collect())),
            Head::Product(flags) => again(product(flags.iter().copied().zip(parts).collect())),
            Head::Call(name) => {
                let index = COMPONENTS.iter().position(|own| own == &&**name);
                let known = index.and_then(|index| component(index, parts.first()?));
                // The component of a variable without a known value is itself.
                match known.filter(|known| !matches!(known.head, Head::Call(ref own) if own == name)) {
                    Some(known) => again(known),
                    None => Term { parts, ..term.clone() },
                }
            }
            _ => Term { parts, ..term.clone() },
        }
    }

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
                    self.reader.variable(place.var.into(), Some(place.ty), call.span, name)
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
        if known.iter().any(|(var, _)| self.writes(*var).next().is_some()) {
            return None;
        }
        self.substituted(&self.reader.term(value)?, &known)
    }

    /// The term with other terms for some variables; `None` if these are read in a part without structure.
    fn substituted(&self, term: &Term, known: &[(VarId, Term)]) -> Option<Term> {
        let covers = |found: &Term| term.covers.iter().chain(&found.covers).copied().collect();
        if let Some((_, found)) =
            term.var.and_then(|(var, _)| known.iter().find(|(own, _)| Place::from(*own) == var))
        {
            return Some(Term { covers: covers(found), ..found.clone() });
        }
        let reads = |text: &str| {
            let names = known.iter().filter_map(|(var, _)| self.program.vars.get(var.0 as usize));
            let mut names = names.map(|var| &*var.name);
            names.any(|name| words(text).any(|word| word == name))
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

/// A component of a triple, if the triple is a constructor, a variable, or a sum or product of such.
pub(super) fn component(index: usize, whole: &Term) -> Option<Term> {
    let inner = match &whole.head {
        Head::Call(name) if ["color", "point", "vector", "normal"].contains(&&**name) => {
            whole.parts.get(index).cloned()
        }
        Head::Sum(flags) => {
            let parts = whole.parts.iter().map(|part| component(index, part)).collect::<Option<Vec<Term>>>();
            parts.map(|parts| sum(flags.iter().copied().zip(parts).collect()))
        }
        Head::Product(flags) => {
            let of_part = |part: &Term| match part.ty {
                Some(ty) if ty.is_triple() => component(index, part),
                _ => Some(part.clone()),
            };
            let parts = whole.parts.iter().map(of_part).collect::<Option<Vec<Term>>>();
            parts.map(|parts| product(flags.iter().copied().zip(parts).collect()))
        }
        _ => None,
    };
    inner.or_else(|| named(index, whole))
}

/// A component of a variable, or of a field or an element, by its name.
pub(super) fn named(index: usize, whole: &Term) -> Option<Term> {
    let name = whole.text.as_ref().filter(|text| is_name(text))?;
    let text = format!("{name}[{index}]");
    let head = Head::Call((*COMPONENTS.get(index)?).into());
    Some(Term {
        text: Some(text.as_str().into()),
        ty: Some(Type::FLOAT),
        covers: whole.covers.clone(),
        ..Term::new(head, vec![whole.clone()])
    })
}

/// Whether a text names a variable or a part of one.
pub(super) fn is_name(text: &str) -> bool {
    text.chars().all(|c| c.is_alphanumeric() || "_.[]".contains(c))
}
