//! Scores: how well arguments match a candidate, and why one does not match.

use super::errors::count;
use super::overload::{CallArgument, Candidate};
use super::{Resolver, Symbol};
use crate::builtins::{ParamType, Signature, Tail};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::ast::{self, ExprId};
use std::cmp::Reverse;

impl Resolver<'_> {
    pub(super) fn score(&self, candidate: &Candidate, given: &[CallArgument]) -> Option<u32> {
        match candidate {
            Candidate::User(f) => {
                let (fixed, rest) = given.split_at_checked(f.formals.len())?;
                let fixed = f.formals.iter().zip(fixed).map(|((ty, _), g)| self.score_given(*ty, g));
                Some(fixed.sum::<Option<u32>>()? + tail(candidate.tail(), rest)?)
            }
            Candidate::Builtin { signature, .. } => self.score_signature(signature, given),
        }
    }

    pub(super) fn score_signature(&self, signature: &Signature, given: &[CallArgument]) -> Option<u32> {
        if given.len() < signature.params.len() {
            return None;
        }
        let (fixed, rest) = given.split_at(signature.params.len());
        let mut total = 0;
        for (param, g) in signature.params.iter().zip(fixed) {
            total += match param.ty {
                ParamType::Of(ty) if stands_for_array(ty, g) => 23,
                ParamType::Of(ty) => self.score_given(ty, g)?,
                ParamType::Any { array } => {
                    let CallArgument::Value(v) = g else { return None };
                    if v.ty.is_array() != array {
                        return None;
                    }
                    1
                }
            };
        }
        Some(total + tail(signature.tail, rest)?)
    }

    fn score_given(&self, formal: Type, given: &CallArgument) -> Option<u32> {
        match given {
            CallArgument::Value(v) => self.score_type(formal, v.ty),
            CallArgument::List(id, _) => self.completes(formal, *id).then_some(100),
        }
    }

    /// Whether the list has exactly the elements of the type, as far as its form tells. The elements are not
    /// resolved here, but later, for their final type.
    fn completes(&self, ty: Type, id: ExprId) -> bool {
        let ast::ExprKind::InitList(items) = &self.ast[id].kind else { return self.may_become(ty, id) };
        let all = |element: Type| items.iter().all(|item| self.completes(element, *item));
        match (ty.extent, ty.base) {
            (Extent::Array(n), _) => n as usize == items.len() && all(ty.element()),
            (Extent::Unsized, _) => !items.is_empty() && all(ty.element()),
            (Extent::One, Base::Struct(id)) => {
                let fields = &self.structs.get(id).fields;
                fields.len() == items.len()
                    && fields.iter().zip(items).all(|(f, item)| self.completes(f.ty, *item))
            }
            (Extent::One, Base::Matrix) => matches!(items.len(), 1 | 16) && all(Type::FLOAT),
            (Extent::One, base) if base.is_triple() => match items[..] {
                [one] => self.may_become(ty, one),
                _ => items.len() == 3 && all(Type::FLOAT),
            },
            _ => false,
        }
    }

    /// Whether an element may have the type; an element of unclear form may.
    fn may_become(&self, ty: Type, id: ExprId) -> bool {
        let have = match &self.ast[id].kind {
            ast::ExprKind::Int(_) => Type::INT,
            ast::ExprKind::Float(_) => Type::FLOAT,
            ast::ExprKind::Str(_) => Type::STRING,
            ast::ExprKind::Name(name) => match self.lookup(name) {
                Some((_, Symbol::Var(var))) => self.var(*var).ty,
                _ => return true,
            },
            _ => return true,
        };
        self.structs.assignable(ty, have) || (ty == Type::CLOSURE && have.is_number())
    }

    /// How well an argument of type `have` matches a formal of type `want`; `None` if it does not.
    pub(super) fn score_type(&self, want: Type, have: Type) -> Option<u32> {
        if want == have {
            return Some(100);
        }
        if want == Type::FLOAT && have == Type::INT {
            return Some(77);
        }
        if want.is_array() || have.is_array() {
            return match (want.extent, have.extent) {
                (Extent::Unsized, Extent::Array(_)) if want.base == have.base => Some(44),
                _ if self.structs.equivalent(want, have) => Some(23),
                _ => None,
            };
        }
        if want.is_triple() && have.is_triple() {
            return Some(if want == Type::COLOR || have == Type::COLOR { 27 } else { 32 });
        }
        if want == Type::INT && have == Type::FLOAT {
            return None;
        }
        self.structs.assignable(want, have).then_some(23)
    }
}

impl Resolver<'_> {
    /// How far the candidate is from matching: arguments that do not fit weigh more than their number, and of
    /// equals the one whose other arguments fit better is smaller.
    pub(super) fn misfit_cost(&self, candidate: &Candidate, given: &[CallArgument]) -> (usize, Reverse<u32>) {
        let formals = candidate.formals();
        let missing = formals.len().saturating_sub(given.len());
        let extra = match candidate.tail() {
            Tail::None => given.len().saturating_sub(formals.len()),
            _ => 0,
        };
        let fits = |(formal, g): (&Option<Type>, &CallArgument)| {
            formal.map_or(Some(1), |ty| self.score_given(ty, g))
        };
        let scores: Vec<Option<u32>> = formals.iter().zip(given).map(fits).collect();
        let options = match candidate.tail() {
            Tail::None => &[],
            _ => given.get(formals.len()..).unwrap_or_default(),
        };
        let nameless = options.iter().step_by(2).filter(|g| !is_text(g)).count();
        let misfits = scores.iter().filter(|score| score.is_none()).count() + nameless;
        if misfits > 0 && self.takes_reordered(&formals, given) {
            return (1, Reverse(0));
        }
        (2 * (missing + extra) + 3 * misfits, Reverse(scores.into_iter().flatten().sum()))
    }

    /// Whether the parameters take these arguments in another order.
    fn takes_reordered(&self, formals: &[Option<Type>], given: &[CallArgument]) -> bool {
        fn place(fits: &[Vec<bool>], at: usize, taken: u32) -> bool {
            fits.get(at).is_none_or(|row| {
                let free = |(n, fits): (usize, &bool)| *fits && taken & (1 << n) == 0;
                row.iter().enumerate().any(|at_n| free(at_n) && place(fits, at + 1, taken | 1 << at_n.0))
            })
        }
        if formals.len() != given.len() || formals.len() > MOST_REORDERED {
            return false;
        }
        let fits = |g: &CallArgument| {
            formals.iter().map(|ty| ty.is_none_or(|ty| self.score_given(ty, g).is_some())).collect()
        };
        let rows: Vec<Vec<bool>> = given.iter().map(fits).collect();
        place(&rows, 0, 0)
    }

    /// Why the candidate does not match the arguments; only the first reason.
    pub(super) fn why_not(&self, candidate: &Candidate, given: &[CallArgument]) -> String {
        let formals = candidate.formals();
        let fits =
            formals.iter().zip(given).all(|(ty, g)| ty.is_none_or(|ty| self.score_given(ty, g).is_some()));
        if !fits && self.takes_reordered(&formals, given) {
            return "takes these arguments in another order".to_string();
        }
        match candidate {
            Candidate::User(f) => self.why_not_signature(&f.signature(), given),
            Candidate::Builtin { signature, .. } => self.why_not_signature(signature, given),
        }
    }

    fn why_not_signature(&self, signature: &Signature, given: &[CallArgument]) -> String {
        let wanted = signature.params.len();
        if given.len() < wanted || (given.len() > wanted && signature.tail == Tail::None) {
            let takes = if signature.tail == Tail::None { "takes" } else { "takes at least" };
            return wrong_count(takes, wanted, given.len());
        }
        for (index, (param, g)) in signature.params.iter().zip(given).enumerate() {
            match (param.ty, g) {
                (ParamType::Of(ty), _) if !stands_for_array(ty, g) && self.score_given(ty, g).is_none() => {
                    return self.misfit(index, ty, g);
                }
                (ParamType::Any { .. }, CallArgument::List(..)) => {
                    return format!("argument {} cannot be a list", index + 1);
                }
                (ParamType::Any { array }, CallArgument::Value(v)) if v.ty.is_array() != array => {
                    let what = if array { "is no array" } else { "is an array" };
                    return format!("argument {} {what}", index + 1);
                }
                _ => {}
            }
        }
        let options = given.get(wanted..).unwrap_or_default();
        let named = if signature.tail == Tail::Keywords { 1 } else { options.len() };
        for (index, g) in options.iter().enumerate().step_by(2).take(named) {
            if !is_text(g) {
                let what = self.given_type(g);
                return format!("argument {} is {what}, not the name of an option", wanted + index + 1);
            }
        }
        "the last option has no value".to_string()
    }

    fn misfit(&self, index: usize, ty: Type, given: &CallArgument) -> String {
        let (number, want) = (index + 1, self.show_a(ty));
        match given {
            CallArgument::Value(v) if v.ty == Type::FLOAT && ty == Type::INT => {
                format!("argument {number} is a float, and a call makes no int of it: write `(int)`")
            }
            CallArgument::Value(_) => {
                format!("argument {number} is {}, not {}", self.given_type(given), want)
            }
            CallArgument::List(_, n) => {
                let values = count(*n, "value");
                format!("argument {number} does not make {}: a list of {values}", want)
            }
        }
    }

    fn given_type(&self, given: &CallArgument) -> String {
        match given {
            CallArgument::Value(v) => self.show_a(v.ty),
            CallArgument::List(..) => "a list".to_string(),
        }
    }
}

/// The largest number of arguments of which other orders are tried.
const MOST_REORDERED: usize = 5;

fn is_text(given: &CallArgument) -> bool {
    matches!(given, CallArgument::Value(v) if v.ty == Type::STRING)
}

/// The contribution to the score of arguments after the parameters; `None` if they do not match.
fn tail(tail: Tail, rest: &[CallArgument]) -> Option<u32> {
    let ty = |g: &CallArgument| match g {
        CallArgument::Value(v) => v.ty,
        CallArgument::List(..) => Type::VOID,
    };
    let types: Vec<Type> = rest.iter().map(ty).collect();
    tail.takes(&types).then_some(rest.len() as u32)
}

/// Whether a single point, vector or normal is given where a built-in expects an array of them. The reference
/// accepts this, although the elements after the first are then undefined.
fn stands_for_array(wanted: Type, given: &CallArgument) -> bool {
    let is = |base: Base| matches!(base, Base::Point | Base::Vector | Base::Normal);
    wanted.extent == Extent::Unsized
        && is(wanted.base)
        && matches!(given, CallArgument::Value(v) if !v.ty.is_array() && is(v.ty.base))
}

fn wrong_count(takes: &str, wanted: usize, given: usize) -> String {
    match wanted {
        0 => format!("{takes} no argument, not {given}"),
        _ => format!("{takes} {}, not {given}", count(wanted, "argument")),
    }
}
