//! The chosen call: arguments are converted, outputs are bound to their places.

use super::errors;
use super::init::convert_to;
use super::overload::{CallArgument, Candidate};
use super::{FunctionSymbol, Resolver};
use crate::builtins::{self, Builtin, Param, ParamType, Signature};
use crate::hir::{Arg, BuiltinCall, Expr, ExprKind, Init, OperationCall, Step};
use osl_ir::types::{Extent, Type};
use osl_syntax::Reports;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::span::Span;

impl Resolver<'_> {
    pub(super) fn invoke(&mut self, candidate: Candidate, given: Vec<CallArgument>, span: Span) -> Expr {
        match candidate {
            Candidate::User(f) => self.invoke_user(&f, given, span),
            Candidate::Builtin { row, overload, signature } => {
                self.invoke_builtin(row, overload, signature, given, span)
            }
        }
    }

    fn invoke_user(&mut self, f: &FunctionSymbol, given: Vec<CallArgument>, span: Span) -> Expr {
        if f.operation {
            return self.invoke_operation(f, given, span);
        }
        let args: Vec<Arg> = given
            .into_iter()
            .zip(&f.formals)
            .map(|(g, formal)| match g {
                CallArgument::List(id, _) => {
                    Arg::Copy { value: self.argument_list(formal.0, id), back: None }
                }
                CallArgument::Value(v) => {
                    self.check_output_argument(*formal, &v);
                    self.argument(*formal, v)
                }
            })
            .collect();
        let error = Expr { ty: f.ret, kind: ExprKind::Error, span };
        let Some(id) = f.id else {
            let as_reference = self.reports == Reports::AsReference;
            if (f.ret.is_error() && !as_reference) || self.may_be_declared(&f.name) {
                return error;
            }
            if f.ret == Type::VOID {
                // Only the effects of its arguments remain.
                let values = args.into_iter().filter_map(argument_value).collect();
                return Expr { ty: Type::VOID, kind: ExprKind::Comma(values), span };
            }
            let d = Diagnostic::error(
                errors::NO_BODY,
                span,
                format!("`{}` is declared but has no body yet", f.name),
            )
            .also(f.span, "declared here");
            self.report(d);
            return error;
        };
        if f.never_returns {
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

    /// A call of a function that is marked as an operation of the renderer: a closure with any name, a
    /// library function, or an operation that only some renderers know.
    fn invoke_operation(&mut self, f: &FunctionSymbol, given: Vec<CallArgument>, span: Span) -> Expr {
        let signature = f.signature();
        let formals = f.formals.len();
        let mut args = self.arguments(&signature, given, span);
        for (index, (ty, output)) in f.formals.iter().enumerate() {
            let Some(value) = args.get_mut(index) else { continue };
            // The place of an output stays unchanged.
            if !(*output && matches!(value.kind, ExprKind::Read(_))) {
                let given = std::mem::replace(value, Expr { ty: *ty, kind: ExprKind::Error, span });
                *value = convert_to(*ty, given);
            }
        }
        if f.ret != Type::CLOSURE
            && let Some((row, overload)) = self.library_form(f)
            && let Some(signature) = row.signatures().get(overload)
        {
            let given = args.into_iter().map(CallArgument::Value).collect();
            return self.invoke_builtin(row, overload, signature, given, span);
        }
        let call = OperationCall { name: f.name.clone(), formals, args };
        Expr { ty: f.ret, kind: ExprKind::Operation(call), span }
    }

    /// The overload of the library function with this name that matches the formals best.
    fn library_form(&self, f: &FunctionSymbol) -> Option<(&'static Builtin, usize)> {
        let row = builtins::find(&f.name)?;
        let formal = |(ty, _): &(Type, bool)| {
            CallArgument::Value(Expr { ty: *ty, kind: ExprKind::Error, span: Span::default() })
        };
        let formals: Vec<CallArgument> = f.formals.iter().map(formal).collect();
        let forms = row.signatures().iter().enumerate().filter(|(_, s)| s.ret == f.ret);
        let scored = forms.filter_map(|(at, s)| Some((self.score_signature(s, &formals)?, at)));
        // Of several equal candidates, the first one counts, as everywhere.
        let best = scored.min_by_key(|(score, _)| std::cmp::Reverse(*score));
        best.map(|(_, at)| (row, at))
    }

    /// Output formals of user functions require an argument of an equivalent type, and not a literal.
    fn check_output_argument(&mut self, (ty, output): (Type, bool), value: &Expr) {
        if !output {
            return;
        }
        if matches!(value.kind, ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Str(_)) {
            let d = Diagnostic::error(errors::READ_ONLY, value.span, "a constant cannot receive an output")
                .help("pass a variable");
            self.report(d);
        } else if !self.structs.equivalent(ty, value.ty) {
            let (want, have) = (self.show_a(ty), self.show_a(value.ty));
            let d = Diagnostic::error(
                errors::OUTPUT_TYPE,
                value.span,
                format!("this output is {want}, the argument {have}"),
            )
            .help(format!("pass {want} variable"));
            self.report(d);
        } else if !matches!(value.kind, ExprKind::Read(_) | ExprKind::Error) {
            let d = Diagnostic::warning(errors::OUTPUT_LOST, value.span, "this output is lost")
                .label("not a variable")
                .help("pass a variable");
            self.report(d);
        } else if let ExprKind::Read(place) = &value.kind
            && place.is_only_copied_in()
        {
            let message = "this output is lost: an element that is a struct is only copied in";
            let d = Diagnostic::warning(errors::OUTPUT_LOST, value.span, message)
                .label("keeps its value")
                .help("copy the element into a variable, pass that, and store it back");
            self.report(d);
        }
    }

    fn invoke_builtin(
        &mut self,
        row: &'static Builtin,
        overload: usize,
        signature: &'static Signature,
        given: Vec<CallArgument>,
        span: Span,
    ) -> Expr {
        let given = self.arguments(signature, given, span);
        self.check_format(row, &given, span);
        self.check_options(row, &given, signature.params.len());
        let mut args = Vec::new();
        let mut outputs = Vec::new();
        let converted = signature.converted(given.iter().map(|value| value.ty));
        for (index, value) in given.into_iter().enumerate() {
            let param = signature.params.get(index);
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
                Some(Param { ty: ParamType::Of(ty), .. }) if ty.is_array() => as_array(value),
                Some(Param { ty: ParamType::Of(ty), .. }) => convert_to(*ty, value),
                _ => value,
            };
            args.push(value);
        }
        Expr {
            ty: signature.ret,
            kind: ExprKind::Builtin(BuiltinCall { row, overload, args, outputs, converted }),
            span,
        }
    }

    /// The arguments of a built-in as values; lists get the types of their formals.
    fn arguments(&mut self, signature: &Signature, given: Vec<CallArgument>, span: Span) -> Vec<Expr> {
        let list = |(index, g): (usize, CallArgument)| match (g, signature.params.get(index)) {
            (CallArgument::Value(v), _) => v,
            (CallArgument::List(id, _), Some(Param { ty: ParamType::Of(ty), .. })) => {
                match self.argument_list(*ty, id) {
                    Init::Value(v) => v,
                    Init::List(parts) => Expr { ty: *ty, kind: ExprKind::Struct(parts), span },
                }
            }
            (CallArgument::List(..), _) => Expr { ty: Type::ERROR, kind: ExprKind::Error, span },
        };
        given.into_iter().enumerate().map(list).collect()
    }

    fn output_place(&mut self, wanted: ParamType, value: &Expr) -> Option<crate::hir::Lvalue> {
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
                "this output is {}, the variable {}: nothing is stored",
                self.show_a(ty),
                self.show_a(place.ty)
            );
            self.report(Diagnostic::warning(errors::OUTPUT_LOST, value.span, message));
            return None;
        }
        self.check_writable(place.var, place.span, true);
        debug_assert!(place.path.iter().all(|s| !matches!(s, Step::Field(n) if *n == u32::MAX)));
        Some(place.clone())
    }
}

/// The value passed by an argument; `None` for a plain variable.
fn argument_value(arg: Arg) -> Option<Expr> {
    match arg {
        Arg::Copy { value: Init::Value(value), .. } => Some(value),
        Arg::Alias(_) | Arg::Copy { value: Init::List(_), .. } => None,
    }
}

/// A value in place of an array: an array with this single element.
fn as_array(value: Expr) -> Expr {
    if value.ty.is_array() || value.ty.is_error() {
        return value;
    }
    let ty = Type { extent: Extent::Array(1), ..value.ty };
    Expr { ty, span: value.span, kind: ExprKind::Struct(vec![Init::Value(value)]) }
}
