//! Calls: candidates, scores, and the choice by argument types and expected result.

use super::errors;
use super::unknown::Wanted;
use super::vocabulary;
use super::{FunctionSymbol, Resolver, Symbol};
use crate::builtins::{self, Builtin, Param, ParamType, Signature, Tail};
use crate::hir::{Choice, Expr, ExprKind};
use osl_ir::types::{Base, Type};
use osl_syntax::Reports;
use osl_syntax::ast::{self, ExprId};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::span::Span;
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// Maximum number of argument types in a message.
const MOST_ARGUMENTS: usize = 20;
/// Maximum number of candidates in a message.
const MOST_CANDIDATES: usize = 4;

/// An argument, for the choice of an overload.
#[derive(Clone, Debug)]
pub(super) enum CallArgument {
    Value(Expr),
    /// `{…}`: becomes a value once the formal is known.
    List(ExprId, usize),
}

/// Something that can be called.
#[derive(Clone, Debug)]
pub(super) enum Candidate {
    User(Arc<FunctionSymbol>),
    Builtin { row: &'static Builtin, overload: usize, signature: &'static Signature },
}

impl Candidate {
    pub(super) fn ret(&self) -> Type {
        match self {
            Candidate::User(f) => f.ret,
            Candidate::Builtin { signature, .. } => signature.ret,
        }
    }

    /// Types of the fixed parameters; `None` for one of any type.
    pub(super) fn formals(&self) -> Vec<Option<Type>> {
        match self {
            Candidate::User(f) => f.formals.iter().map(|(ty, _)| Some(*ty)).collect(),
            Candidate::Builtin { signature, .. } => signature.params.iter().map(type_of).collect(),
        }
    }

    /// Whether no call can distinguish the two. A function of the file replaces a closure with the same
    /// parameters, with or without keywords.
    fn same_as(&self, other: &Candidate) -> bool {
        let tails = (self.tail(), other.tail());
        self.ret() == other.ret()
            && self.formals() == other.formals()
            && (tails.0 == tails.1 || tails == (Tail::None, Tail::Keywords))
    }

    pub(super) fn tail(&self) -> Tail {
        match self {
            Candidate::User(f) => f.tail(),
            Candidate::Builtin { signature, .. } => signature.tail,
        }
    }

    fn signature(&self, r: &Resolver<'_>, name: &str) -> String {
        match self {
            Candidate::User(f) => {
                let shown = |((ty, out), name): (&(Type, bool), &Arc<str>)| {
                    let (output, ty) = (if *out { "output " } else { "" }, r.show(*ty));
                    match ty.split_once('[') {
                        Some((element, length)) => format!("{output}{element} {name}[{length}"),
                        None => format!("{output}{ty} {name}"),
                    }
                };
                let formals: Vec<String> = f.formals.iter().zip(&f.names).map(shown).collect();
                format!("{} {name}({})", r.show(f.ret), formals.join(", "))
            }
            Candidate::Builtin { signature, .. } => signature.show(name),
        }
    }
}

fn type_of(param: &Param) -> Option<Type> {
    match param.ty {
        ParamType::Of(ty) => Some(ty),
        ParamType::Any { .. } => None,
    }
}

impl Resolver<'_> {
    /// `callee(args)`: a struct constructor or a function call.
    pub(super) fn call(
        &mut self,
        name: &ast::Name,
        args: &[ExprId],
        expected: Option<Type>,
        span: Span,
    ) -> Expr {
        let error = Expr { ty: Type::ERROR, kind: ExprKind::Error, span };
        let symbol = self.lookup(&name.text).map(|(_, s)| s.clone());
        if symbol.is_none()
            && let Some(id) = self.structs.find(&name.text)
        {
            if let Some(recorder) = &mut self.recorder {
                recorder.use_struct(id, name.span);
            }
            return self.struct_value(Type::one(Base::Struct(id)), args, span);
        }
        let candidates = self.candidates(&name.text, symbol.as_ref());
        if let [only @ Candidate::User(_)] = &candidates[..]
            && self.reports != Reports::AsReference
        {
            let floats = only.formals().into_iter().zip(args).filter(|(ty, _)| *ty == Some(Type::FLOAT));
            floats.for_each(|(_, arg)| self.needs_no_choice(*arg));
        }
        let given = self.given(args, expected);
        if let Some(Symbol::Var(var)) = symbol
            && candidates.is_empty()
        {
            if self.may_be_declared(&name.text) {
                return error;
            }
            let declared = self.var(var).span;
            let d = Diagnostic::error(
                errors::WRONG_KIND_OF_NAME,
                name.span,
                format!("`{}` is a variable, not a function", name.text),
            )
            .help("a product is written with `*`, an element or a component with `[ ]`");
            // The language's own functions have no location.
            self.report(if declared == Span::default() { d } else { d.also(declared, "declared here") });
            return error;
        }
        if candidates.is_empty() {
            let arguments_end = (!args.is_empty()).then(|| span.end.saturating_sub(1));
            let wanted = Wanted::Call { arguments_end, closure: expected == Some(Type::CLOSURE) };
            self.unknown(name.span, "function", &name.text, wanted);
            return error;
        }
        let failed = given.iter().find_map(|g| match g {
            CallArgument::Value(v) if v.ty.is_error() => Some(v.span),
            _ => None,
        });
        if let Some(failed) = failed {
            self.report_again(failed, "an argument");
            return error;
        }
        match self.choose(&name.text, name.span, candidates, &given, expected) {
            Some(chosen) => {
                if let Some(recorder) = &mut self.recorder {
                    match &chosen {
                        Candidate::User(f) => recorder.use_function(f.span, name.span),
                        Candidate::Builtin { row, signature, .. } => {
                            recorder.use_builtin(row.name, signature, name.span);
                        }
                    }
                }
                self.invoke(chosen, given, span)
            }
            None => error,
        }
    }

    /// Candidates, newest first: the functions of the innermost scope; at file level followed by the
    /// built-ins.
    fn candidates(&self, name: &str, symbol: Option<&Symbol>) -> Vec<Candidate> {
        let mut list = Vec::new();
        let depth = self.lookup(name).map_or(0, |(depth, _)| depth);
        if let Some(Symbol::Functions(functions)) = symbol {
            list.extend(functions.iter().rev().cloned().map(Candidate::User));
        }
        // A parameter with the name of a built-in does not hide it.
        let shadowed = matches!(symbol, Some(Symbol::Var(id)) if depth > 0 || !matches!(self.var(*id).kind, crate::hir::VarKind::Param { .. }));
        if depth == 0
            && !shadowed
            && let Some(row) = builtins::find(name)
        {
            let signatures = row.signatures();
            let builtin = |(overload, signature)| Candidate::Builtin { row, overload, signature };
            // A function of the file with the same signature replaces the built-in.
            let kept =
                signatures.iter().enumerate().map(builtin).filter(|b| !list.iter().any(|c| c.same_as(b)));
            let kept: Vec<Candidate> = kept.collect();
            list.extend(kept);
        }
        list
    }

    fn given(&mut self, args: &[ExprId], expected: Option<Type>) -> Vec<CallArgument> {
        let ast = self.ast;
        args.iter()
            .map(|id| match &ast[*id].kind {
                ast::ExprKind::InitList(items) => CallArgument::List(*id, items.len()),
                _ => CallArgument::Value(self.value(*id, expected)),
            })
            .collect()
    }

    fn struct_value(&mut self, ty: Type, args: &[ExprId], span: Span) -> Expr {
        let fields: Vec<Type> = match ty.as_struct() {
            Some(id) => self.structs.get(id).fields.iter().map(|f| f.ty).collect(),
            None => Vec::new(),
        };
        if fields.len() != args.len() && ty.as_struct().is_some_and(|id| self.is_open_struct(id.0)) {
            args.iter().for_each(|e| drop(self.expr(*e, None)));
            return Expr { ty, kind: ExprKind::Error, span };
        }
        if fields.len() != args.len() {
            let message = format!(
                "{} has {}, not {}",
                self.show_a(ty),
                errors::count(fields.len(), "field"),
                args.len()
            );
            self.report(Diagnostic::error(errors::BAD_CONSTRUCTOR, span, message));
            if args.len() > fields.len() {
                self.report_again(span, "assigned or returned");
            }
            return Expr { ty, kind: ExprKind::Error, span };
        }
        let parts = fields.iter().zip(args).map(|(ty, e)| self.field_init(*ty, *e)).collect();
        Expr { ty, kind: ExprKind::Struct(parts), span }
    }

    /// A call of the function that overloads an operator, if one matches.
    pub(super) fn operator_call(&mut self, name: &str, operands: &[&Expr], span: Span) -> Option<Expr> {
        let Some((_, Symbol::Functions(functions))) = self.lookup(name) else { return None };
        let fits = |f: &FunctionSymbol| {
            f.formals.len() == operands.len()
                && f.formals
                    .iter()
                    .zip(operands)
                    .all(|((formal, _), e)| self.structs.assignable(*formal, e.ty))
        };
        let chosen = functions.iter().rev().find(|f| fits(f)).cloned()?;
        let given = operands.iter().map(|e| CallArgument::Value((*e).clone())).collect();
        Some(self.invoke(Candidate::User(chosen), given, span))
    }

    fn choose(
        &mut self,
        name: &str,
        span: Span,
        candidates: Vec<Candidate>,
        given: &[CallArgument],
        expected: Option<Type>,
    ) -> Option<Candidate> {
        let scored: Vec<(u32, &Candidate)> =
            candidates.iter().filter_map(|c| self.score(c, given).map(|s| (s, c))).collect();
        let Some(best) = scored.iter().map(|(s, _)| *s).max() else {
            let open = |c: &Candidate| matches!(c, Candidate::User(f) if f.open);
            if !candidates.iter().any(open) && !self.may_have_overloads(name) {
                let d = self.no_overload(name, span, &candidates, given, expected);
                self.report(d);
            }
            return None;
        };
        let mut tied: Vec<&Candidate> = scored.iter().filter(|(s, _)| *s == best).map(|(_, c)| *c).collect();
        let equal = tied.len();
        if tied.len() > 1
            && let Some(expected) = expected
        {
            let score = |c: &Candidate| self.score_type(expected, c.ret()).unwrap_or(0);
            let top = tied.iter().map(|c| score(c)).max().unwrap_or(0);
            tied.retain(|c| score(c) == top);
        }
        let by_result = expected.filter(|_| tied.len() < equal).map(|ty| (equal, ty));
        if tied.len() > 1 {
            let rank = |c: &Candidate| return_rank(c.ret());
            let top = tied.iter().map(|c| rank(c)).min().unwrap_or(0);
            // A single struct among other types has its place in the order; several have none.
            let mut structs = tied.iter().filter_map(|c| c.ret().as_struct());
            let struct_tie = structs.next().is_some_and(|first| structs.any(|other| other != first));
            if struct_tie {
                let d = Diagnostic::error(
                    errors::AMBIGUOUS_STRUCTS,
                    span,
                    format!("`{name}` could return different structs here"),
                )
                .help("assign the result to a variable of the type that is meant");
                self.report(d);
                return None;
            }
            if let Some(d) = self.ambiguous_list(name, span, &tied, given) {
                self.report(d);
                return None;
            }
            let differ = tied.iter().any(|c| c.ret() != tied[0].ret());
            // Only the form that returns a float can become an int or a truth value, or be compared by size.
            let is_builtin = |c: &&Candidate| matches!(c, Candidate::Builtin { .. });
            let clear = (expected == Some(Type::INT) || self.unambiguous.contains(&span.start))
                && tied.iter().all(is_builtin);
            tied.retain(|c| rank(c) == top);
            if !clear && (differ || tied.len() > 1) {
                self.warn_ambiguous(name, span, tied.first().copied());
            }
        }
        let chosen = tied.first().map(|c| (*c).clone())?;
        let is_own = |c: &Candidate| matches!(c, Candidate::User(_));
        let others = if candidates.len() > 1 && candidates.iter().any(is_own) {
            self.others(name, &candidates, &chosen, given, by_result)
        } else {
            Vec::new()
        };
        if by_result.is_some() || !others.is_empty() {
            self.choices.insert(span.start, Choice { by_result, others });
        }
        Some(chosen)
    }

    /// The candidates that are not taken, with the reason.
    fn others(
        &self,
        name: &str,
        candidates: &[Candidate],
        chosen: &Candidate,
        given: &[CallArgument],
        by_result: Option<(usize, Type)>,
    ) -> Vec<(String, String)> {
        let best = self.score(chosen, given);
        let others = candidates.iter().filter(|c| !c.same_as(chosen)).take(MOST_CANDIDATES);
        let why = |c: &Candidate| match self.score(c, given) {
            None => self.why_not(c, given),
            score if score == best => match by_result {
                Some((_, ty)) => {
                    format!("it returns {}, and {} is expected", self.show_a(c.ret()), self.show_a(ty))
                }
                None => format!("it fits as well, but returns {}", self.show_a(c.ret())),
            },
            Some(_) => self.converted(c, chosen, given),
        };
        others.map(|c| (c.signature(self, name), why(c))).collect()
    }

    /// The first argument that the chosen candidate converts less than this one.
    fn converted(&self, candidate: &Candidate, chosen: &Candidate, given: &[CallArgument]) -> String {
        let (formals, better) = (candidate.formals(), chosen.formals());
        let pairs = (1..).zip(formals.iter().zip(better.iter().zip(given)));
        let worse = pairs.filter_map(|(number, (formal, (better, given)))| match (formal, better, given) {
            (Some(ty), Some(better), CallArgument::Value(v))
                if self.score_type(*ty, v.ty) < self.score_type(*better, v.ty) =>
            {
                Some((number, v.ty, *ty, *better))
            }
            _ => None,
        });
        let Some((number, from, to, better)) = worse.into_iter().next() else {
            return "it fits less well".to_string();
        };
        let text =
            format!("it would convert argument {number} from {} to {}", self.show(from), self.show(to));
        match better == from {
            true => text,
            false => format!("{text}, which is further than to {}", self.show(better)),
        }
    }

    /// The error for candidates that would give one list different types.
    fn ambiguous_list(
        &self,
        name: &str,
        span: Span,
        tied: &[&Candidate],
        given: &[CallArgument],
    ) -> Option<Diagnostic> {
        let formals: Vec<Vec<Option<Type>>> = tied.iter().map(|c| c.formals()).collect();
        for (index, g) in given.iter().enumerate() {
            let CallArgument::List(list, _) = g else { continue };
            let mut wanted = formals.iter().filter_map(|f| f.get(index).copied().flatten());
            let first = wanted.next()?;
            if let Some(other) = wanted.find(|ty| *ty != first) {
                let (a, b) = (self.show_a(first), self.show_a(other));
                return Some(errors::ambiguous_list(span, self.ast[*list].span, name, &a, &b));
            }
        }
        None
    }

    /// Notes that of the forms of a call only one that returns a number fits.
    pub(super) fn needs_no_choice(&mut self, id: ExprId) {
        match &self.ast[id].kind {
            ast::ExprKind::Paren(inner) => self.needs_no_choice(*inner),
            ast::ExprKind::Call(name, _) => drop(self.unambiguous.insert(name.span.start)),
            _ => {}
        }
    }

    fn warn_ambiguous(&mut self, name: &str, span: Span, chosen: Option<&Candidate>) {
        let d = Diagnostic::warning(
            errors::AMBIGUOUS,
            span,
            format!("several functions `{name}` fit equally well"),
        );
        let d = match chosen {
            Some(c) => d.note(format!("taken: {}", c.signature(self, name))),
            None => d,
        };
        self.report(d.help("cast the result, as in `(color)noise(p)`, to say which is meant"));
    }

    fn no_overload(
        &self,
        name: &str,
        span: Span,
        candidates: &[Candidate],
        given: &[CallArgument],
        expected: Option<Type>,
    ) -> Diagnostic {
        let mut types: Vec<String> = given
            .iter()
            .take(MOST_ARGUMENTS)
            .map(|g| match g {
                CallArgument::Value(v) => self.show(v.ty),
                CallArgument::List(..) => "{…}".to_string(),
            })
            .collect();
        if given.len() > MOST_ARGUMENTS {
            types.push(format!("and {} more", given.len() - MOST_ARGUMENTS));
        }
        let mut d =
            Diagnostic::error(errors::NO_OVERLOAD, span, format!("no `{name}` takes ({})", types.join(", ")))
                .label("no overload fits these arguments");
        // The best candidate comes first; forms that differ only in their result count once.
        let mut ranked: Vec<&Candidate> = candidates.iter().collect();
        ranked.sort_by_key(|c| (self.misfit_cost(c, given), expected.is_some_and(|ty| ty != c.ret())));
        let mut seen: FxHashSet<String> = FxHashSet::default();
        ranked.retain(|c| {
            let form = c.signature(self, name);
            seen.insert(form.split_once('(').map_or(String::new(), |(_, params)| params.to_string()))
        });
        for candidate in ranked.iter().take(MOST_CANDIDATES) {
            let why = self.why_not(candidate, given);
            d = d.note(format!("{}: {why}", candidate.signature(self, name)));
        }
        if ranked.len() > MOST_CANDIDATES {
            let more = ranked.len() - MOST_CANDIDATES;
            let builtin = ranked.iter().any(|c| matches!(c, Candidate::Builtin { .. }));
            d = d.note(match builtin {
                true => format!("and {more} more, which `oslrun doc {name}` lists"),
                false => format!("and {more} more"),
            });
        }
        let is_builtin = candidates.iter().all(|c| matches!(c, Candidate::Builtin { .. }));
        let knots = given.last().map(|argument| match argument {
            CallArgument::Value(v) if !v.ty.is_array() => self.show(v.ty),
            _ => "float".to_string(),
        });
        match vocabulary::other_form(name, given.len(), knots.as_deref()).filter(|_| is_builtin) {
            Some(advice) => d.help(advice),
            None => d,
        }
    }
}

/// The precedence of return types if nothing else decides a tie.
fn return_rank(ty: Type) -> u32 {
    match ty.base {
        Base::Float => 0,
        Base::Int => 1,
        Base::Color => 2,
        Base::Vector => 3,
        Base::Point => 4,
        Base::Normal => 5,
        Base::Matrix => 6,
        Base::String => 7,
        Base::Closure => 8,
        Base::Struct(_) => 9,
        Base::Void | Base::Error => 10,
    }
}
