//! Calls: candidates, scores, and the choice by argument types and expected result.

use super::errors;
use super::{FunctionSymbol, Resolver, Symbol};
use crate::builtins::{self, Builtin, Param, ParamType, Signature, Tail};
use crate::hir::{Arg, BuiltinCall, Expr, ExprKind, FunctionId, Init, Step};
use crate::types::{Base, Extent, Type};
use osl_syntax::ast::{self, ExprId};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::span::Span;

/// An argument as the choice sees it.
#[derive(Clone, Debug)]
enum Given {
    Value(Expr),
    /// `{…}`: becomes a value once the formal is known.
    List(ExprId, usize),
}

/// Something that can be called.
#[derive(Clone, Debug)]
enum Candidate {
    User(FunctionSymbol),
    Builtin { row: &'static Builtin, overload: usize, signature: &'static Signature },
}

impl Candidate {
    fn ret(&self) -> Type {
        match self {
            Candidate::User(f) => f.ret,
            Candidate::Builtin { signature, .. } => signature.ret,
        }
    }

    fn signature(&self, r: &Resolver<'_>, name: &str) -> String {
        match self {
            Candidate::User(f) => {
                let formals: Vec<String> = f
                    .formals
                    .iter()
                    .map(|(ty, out)| format!("{}{}", if *out { "output " } else { "" }, r.show(*ty)))
                    .collect();
                format!("{} {name}({})", r.show(f.ret), formals.join(", "))
            }
            Candidate::Builtin { signature, .. } => signature.show(name),
        }
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
            return self.struct_value(Type::one(Base::Struct(id)), args, span);
        }
        let candidates = self.candidates(&name.text, symbol.as_ref());
        let given = self.given(args, expected);
        if let Some(Symbol::Var(var)) = symbol
            && candidates.is_empty()
        {
            let declared = self.var(var).span;
            let d = Diagnostic::error(
                errors::WRONG_KIND_OF_NAME,
                name.span,
                format!("`{}` is a variable, not a function", name.text),
            )
            .also(declared, "declared here");
            self.report(d);
            return error;
        }
        if candidates.is_empty() {
            self.unknown(name.span, "function", &name.text);
            return error;
        }
        if given.iter().any(|g| matches!(g, Given::Value(v) if v.ty.is_error())) {
            return error;
        }
        match self.choose(&name.text, name.span, candidates, &given, expected) {
            Some(chosen) => self.invoke(chosen, given, span),
            None => error,
        }
    }

    /// Candidates newest first: the innermost scope's functions; at file level the built-ins behind them.
    fn candidates(&self, name: &str, symbol: Option<&Symbol>) -> Vec<Candidate> {
        let mut list = Vec::new();
        let depth = self.lookup(name).map_or(0, |(depth, _)| depth);
        if let Some(Symbol::Functions(functions)) = symbol {
            list.extend(functions.iter().rev().cloned().map(Candidate::User));
        }
        // A parameter that has the name of a built-in does not hide it.
        let shadowed = matches!(symbol, Some(Symbol::Var(id)) if depth > 0 || !matches!(self.var(*id).kind, crate::hir::VarKind::Param { .. }));
        if depth == 0
            && !shadowed
            && let Some(row) = builtins::find(name)
        {
            let signatures = row.signatures();
            list.extend(signatures.iter().enumerate().map(|(overload, signature)| Candidate::Builtin {
                row,
                overload,
                signature,
            }));
        }
        list
    }

    fn given(&mut self, args: &[ExprId], expected: Option<Type>) -> Vec<Given> {
        let ast = self.ast;
        args.iter()
            .map(|id| match &ast[*id].kind {
                ast::ExprKind::InitList(items) => Given::List(*id, items.len()),
                _ => Given::Value(self.value(*id, expected)),
            })
            .collect()
    }

    fn struct_value(&mut self, ty: Type, args: &[ExprId], span: Span) -> Expr {
        let fields: Vec<Type> = match ty.as_struct() {
            Some(id) => self.structs.get(id).fields.iter().map(|f| f.ty).collect(),
            None => Vec::new(),
        };
        if fields.len() != args.len() {
            let message = format!("a {} has {} fields, not {}", self.show(ty), fields.len(), args.len());
            self.report(Diagnostic::error(errors::BAD_CONSTRUCTOR, span, message));
            return Expr { ty, kind: ExprKind::Error, span };
        }
        let parts = fields.iter().zip(args).map(|(ty, e)| self.field_init(*ty, *e)).collect();
        Expr { ty, kind: ExprKind::Struct(parts), span }
    }

    /// A call of the function that overloads an operator, if one fits.
    pub(super) fn operator_call(
        &mut self,
        name: &str,
        operands: &[&Expr],
        expected: Option<Type>,
        span: Span,
    ) -> Option<Expr> {
        let Some((_, Symbol::Functions(functions))) = self.lookup(name) else { return None };
        let fits = |f: &FunctionSymbol| {
            f.formals.len() == operands.len()
                && f.formals
                    .iter()
                    .zip(operands)
                    .all(|((formal, _), e)| self.structs.assignable(*formal, e.ty))
        };
        let fitting: Vec<FunctionSymbol> = functions.iter().rev().filter(|f| fits(f)).cloned().collect();
        let _ = expected;
        let chosen = fitting.into_iter().next()?;
        let given = operands.iter().map(|e| Given::Value((*e).clone())).collect();
        Some(self.invoke(Candidate::User(chosen), given, span))
    }

    fn choose(
        &mut self,
        name: &str,
        span: Span,
        candidates: Vec<Candidate>,
        given: &[Given],
        expected: Option<Type>,
    ) -> Option<Candidate> {
        let scored: Vec<(u32, &Candidate)> =
            candidates.iter().filter_map(|c| self.score(c, given).map(|s| (s, c))).collect();
        let Some(best) = scored.iter().map(|(s, _)| *s).max() else {
            let d = self.no_overload(name, span, &candidates, given);
            self.report(d);
            return None;
        };
        let mut tied: Vec<&Candidate> = scored.iter().filter(|(s, _)| *s == best).map(|(_, c)| *c).collect();
        if tied.len() > 1
            && let Some(expected) = expected
        {
            let score = |c: &Candidate| self.score_type(expected, c.ret()).unwrap_or(0);
            let top = tied.iter().map(|c| score(c)).max().unwrap_or(0);
            tied.retain(|c| score(c) == top);
        }
        if tied.len() > 1 {
            let rank = |c: &Candidate| return_rank(c.ret());
            let top = tied.iter().map(|c| rank(c)).min().unwrap_or(0);
            let struct_tie = tied.iter().any(|c| c.ret() != tied[0].ret() && c.ret().as_struct().is_some());
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
            let differ = tied.iter().any(|c| c.ret() != tied[0].ret());
            tied.retain(|c| rank(c) == top);
            if differ || tied.len() > 1 {
                self.warn_ambiguous(name, span, tied.first().copied());
            }
        }
        tied.first().map(|c| (*c).clone())
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

    fn no_overload(&self, name: &str, span: Span, candidates: &[Candidate], given: &[Given]) -> Diagnostic {
        let types: Vec<String> = given
            .iter()
            .map(|g| match g {
                Given::Value(v) => self.show(v.ty),
                Given::List(..) => "{…}".to_string(),
            })
            .collect();
        let mut d =
            Diagnostic::error(errors::NO_OVERLOAD, span, format!("no `{name}` takes ({})", types.join(", ")))
                .label("no overload fits these arguments");
        for candidate in candidates.iter().take(6) {
            d = d.note(format!("there is {}", candidate.signature(self, name)));
        }
        if candidates.len() > 6 {
            d = d.note(format!("and {} more", candidates.len() - 6));
        }
        d
    }

    fn score(&self, candidate: &Candidate, given: &[Given]) -> Option<u32> {
        match candidate {
            Candidate::User(f) => {
                if f.formals.len() != given.len() {
                    return None;
                }
                f.formals.iter().zip(given).map(|((ty, _), g)| self.score_given(*ty, g)).sum()
            }
            Candidate::Builtin { signature, .. } => self.score_signature(signature, given),
        }
    }

    fn score_signature(&self, signature: &Signature, given: &[Given]) -> Option<u32> {
        if given.len() < signature.params.len() {
            return None;
        }
        let (fixed, rest) = given.split_at(signature.params.len());
        let mut total = 0;
        for (param, g) in signature.params.iter().zip(fixed) {
            total += match param.ty {
                ParamType::Of(ty) => self.score_given(ty, g)?,
                ParamType::Any { array } => {
                    let Given::Value(v) = g else { return None };
                    if v.ty.is_array() != array {
                        return None;
                    }
                    1
                }
            };
        }
        let rest_fits = match signature.tail {
            Tail::None => rest.is_empty(),
            Tail::Any => true,
            Tail::KeyValue => {
                rest.len().is_multiple_of(2)
                    && rest.iter().step_by(2).all(|g| matches!(g, Given::Value(v) if v.ty == Type::STRING))
            }
        };
        rest_fits.then_some(total + rest.len() as u32)
    }

    fn score_given(&self, formal: Type, given: &Given) -> Option<u32> {
        match given {
            Given::Value(v) => self.score_type(formal, v.ty),
            Given::List(_, len) => {
                let fits = match (formal.extent, formal.base) {
                    (Extent::Array(n), _) => n as usize == *len,
                    (Extent::Unsized, _) => *len > 0,
                    (Extent::One, Base::Struct(id)) => self.structs.get(id).fields.len() == *len,
                    (Extent::One, Base::Matrix) => *len == 16 || *len == 1,
                    (Extent::One, base) => base.is_triple() && (*len == 3 || *len == 1),
                };
                fits.then_some(100)
            }
        }
    }

    /// How well an argument of type `have` suits a formal of type `want`; `None` if not at all.
    fn score_type(&self, want: Type, have: Type) -> Option<u32> {
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

    fn invoke(&mut self, candidate: Candidate, given: Vec<Given>, span: Span) -> Expr {
        match candidate {
            Candidate::User(f) => self.invoke_user(&f, given, span),
            Candidate::Builtin { row, overload, signature } => {
                self.invoke_builtin(row, overload, signature, given, span)
            }
        }
    }

    fn invoke_user(&mut self, f: &FunctionSymbol, given: Vec<Given>, span: Span) -> Expr {
        let args: Vec<Arg> = given
            .into_iter()
            .zip(&f.formals)
            .map(|(g, formal)| match g {
                Given::List(id, _) => Arg::Copy { value: self.argument_list(formal.0, id), back: None },
                Given::Value(v) => {
                    self.check_output_argument(*formal, &v);
                    self.argument(*formal, v)
                }
            })
            .collect();
        let error = Expr { ty: f.ret, kind: ExprKind::Error, span };
        let Some(id) = f.id else {
            let d = Diagnostic::error(
                errors::NO_BODY,
                span,
                format!("`{}` is declared but has no body yet", f.name),
            )
            .also(f.span, "declared here");
            self.report(d);
            return error;
        };
        if f.ret != Type::VOID && self.never_returns(id) {
            let d = Diagnostic::error(
                errors::NEVER_RETURNS,
                span,
                format!("`{}` has no `return` statement", f.name),
            )
            .also(f.span, "defined here");
            self.report(d);
            return error;
        }
        Expr { ty: f.ret, kind: ExprKind::Call(id, args), span }
    }

    fn never_returns(&self, id: FunctionId) -> bool {
        self.functions.get(id.0 as usize).is_some_and(|f| f.ret.is_error())
    }

    /// Output formals of user functions want an argument of an equivalent type, and no literal.
    fn check_output_argument(&mut self, (ty, output): (Type, bool), value: &Expr) {
        if !output {
            return;
        }
        if matches!(value.kind, ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Str(_)) {
            let d = Diagnostic::error(errors::READ_ONLY, value.span, "a constant cannot receive an output")
                .help("pass a variable");
            self.report(d);
        } else if !self.structs.equivalent(ty, value.ty) {
            let (want, have) = (self.show(ty), self.show(value.ty));
            let d = Diagnostic::error(
                errors::OUTPUT_TYPE,
                value.span,
                format!("this output is a {want}, the argument a {have}"),
            )
            .help(format!("pass a {want} variable"));
            self.report(d);
        }
    }

    fn invoke_builtin(
        &mut self,
        row: &'static Builtin,
        overload: usize,
        signature: &'static Signature,
        given: Vec<Given>,
        span: Span,
    ) -> Expr {
        let mut args = Vec::new();
        let mut outputs = Vec::new();
        for (index, g) in given.into_iter().enumerate() {
            let param = signature.params.get(index);
            let value = match (g, param) {
                (Given::Value(v), _) => v,
                (Given::List(id, _), Some(Param { ty: ParamType::Of(ty), .. })) => {
                    match self.argument_list(*ty, id) {
                        Init::Value(v) => v,
                        Init::List(parts) => Expr { ty: *ty, kind: ExprKind::Struct(parts), span },
                    }
                }
                (Given::List(..), _) => Expr { ty: Type::ERROR, kind: ExprKind::Error, span },
            };
            outputs.push(match param {
                Some(param) if param.output => self.output_place(param.ty, &value),
                None if index > 0 => {
                    let option = args.get(index - 1).and_then(|before: &Expr| match &before.kind {
                        ExprKind::Str(name) => row.output_option(name),
                        _ => None,
                    });
                    option.and_then(|ty| self.output_place(ParamType::Of(ty), &value))
                }
                _ => None,
            });
            let value = match param {
                Some(Param { ty: ParamType::Of(ty), .. }) => convert_argument(*ty, value),
                _ => value,
            };
            args.push(value);
        }
        Expr {
            ty: signature.ret,
            kind: ExprKind::Builtin(BuiltinCall { row, overload, args, outputs }),
            span,
        }
    }

    fn output_place(&mut self, wanted: ParamType, value: &Expr) -> Option<crate::hir::Place> {
        let ExprKind::Read(place) = &value.kind else {
            let d = Diagnostic::warning(errors::OUTPUT_LOST, value.span, "this output is lost")
                .help("pass a variable");
            self.report(d);
            return None;
        };
        if let ParamType::Of(ty) = wanted
            && !self.structs.equivalent(ty, place.ty)
        {
            let message = format!(
                "this output is a {}, the variable a {}: nothing is stored",
                self.show(ty),
                self.show(place.ty)
            );
            self.report(Diagnostic::warning(errors::OUTPUT_LOST, value.span, message));
            return None;
        }
        self.check_writable(place.var, place.span, true);
        debug_assert!(place.path.iter().all(|s| !matches!(s, Step::Field(n) if *n == u32::MAX)));
        Some(place.clone())
    }
}

fn convert_argument(ty: Type, value: Expr) -> Expr {
    super::init::convert_to(ty, value)
}

/// The order in which return types win a tie that nothing else decides.
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
