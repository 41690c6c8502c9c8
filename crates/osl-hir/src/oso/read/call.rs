//! Operations that are library functions: found in the one table by name and by the types of their arguments
//! and results.

use super::{Builder, Result, parts};
use crate::builtins::{self, Builtin, Compiled, Param, ParamType, Signature};
use crate::hir::{BuiltinCall, Expr, ExprKind, Lvalue, OperationCall};
use crate::oso::errors;
use crate::resolve::convert_to;
use osl_ir::types::{Base, Extent, StructTable, Type};
use osl_syntax::ast::BinaryOp;
use osl_syntax::span::Span;

impl Builder<'_, '_> {
    /// The call of the function `name`. Its result, if any, is stored in the first argument.
    pub(super) fn library(&mut self, at: usize, name: &str, values: Vec<Expr>, span: Span) -> Result<Expr> {
        let file = self.file;
        let Some(op) = file.ops.get(at) else { return Err(errors::jump(Span::default(), "no operation")) };
        if name == "closure" {
            return self.closure(at, values, op.span, span);
        }
        let row = self.row(name, op.span)?;
        let yields = row.signatures().iter().any(|s| s.ret != Type::VOID);
        let to = if yields { Some(self.target(at, span)?) } else { None };
        let args = values.into_iter().skip(usize::from(yields)).collect::<Vec<Expr>>();
        let result = to.as_ref().map(|to| to.ty);
        let call = self.chosen(row, name, result, &args, span).or_else(|| {
            // Some functions of triples are missing in the language.
            let ty = result.filter(|ty| ty.is_triple())?;
            let float = |parts: Vec<Expr>| self.chosen(row, name, Some(Type::FLOAT), &parts, span);
            parts::each(ty, &args, span, float)
        });
        let call = call.ok_or_else(|| self.no_form(row.name, &args, op.span))?;
        match to {
            Some(to) => self.store(to, call, op.span),
            None => Ok(call),
        }
    }

    /// The call of the signature that matches best.
    fn chosen(
        &self,
        row: &'static Builtin,
        operation: &str,
        result: Option<Type>,
        args: &[Expr],
        span: Span,
    ) -> Option<Expr> {
        let named = |s: &Signature| match row.facts.compiled {
            // The name of the operation decides, not the kinds of its triples.
            Compiled::ByResult(names) => {
                let name = names.iter().find(|(ty, _)| *ty == s.ret).map_or(row.name, |(_, name)| name);
                name == operation
            }
            _ => true,
        };
        let forms = row.signatures().iter().enumerate().filter(|(_, s)| named(s));
        let scored = forms.filter_map(|(index, s)| Some((score(&self.structs, s, result, args)?, index, s)));
        // Of several equal candidates, the first one counts, as everywhere.
        let (_, overload, signature) = scored.min_by_key(|(score, ..)| std::cmp::Reverse(*score))?;
        let call = self.bound(row, overload, signature, args.to_vec());
        Some(Expr { ty: signature.ret, kind: ExprKind::Builtin(call), span })
    }

    fn no_form(&self, name: &str, args: &[Expr], op: Span) -> errors::Wrong {
        let types: Vec<String> = args.iter().map(|e| self.structs.show(e.ty)).collect();
        errors::operation(op, format!("no `{name}` takes ({})", types.join(", ")))
    }

    /// A component of a closure with any name. The table tells which arguments of its closures are keywords;
    /// for other closures the file does not tell, so all arguments count as parameters.
    fn closure(&mut self, at: usize, values: Vec<Expr>, op: Span, span: Span) -> Result<Expr> {
        let mut values = values.into_iter().skip(1).peekable();
        let weight = values.next_if(|e| e.ty.is_number() || e.ty.is_triple());
        let Some(ExprKind::Str(name)) = values.next().map(|e| e.kind) else {
            return Err(errors::operation(op, "the name of a closure is a constant string"));
        };
        let args: Vec<Expr> = values.collect();
        if args.iter().any(|e| matches!(e.ty.base, Base::Struct(_) | Base::Void)) {
            return Err(self.no_form(&name, &args, op));
        }
        let forms = builtins::find(&name).map_or(&[][..], Builtin::signatures);
        let forms = forms.iter().filter(|s| s.ret == Type::CLOSURE);
        let scored = forms.filter_map(|s| Some((score(&self.structs, s, Some(Type::CLOSURE), &args)?, s)));
        let best = scored.min_by_key(|(score, _)| std::cmp::Reverse(*score)).map(|(_, s)| s);
        let params = best.map_or(&[][..], |s| &s.params);
        let formals = best.map_or(args.len(), |s| s.params.len());
        let convert = |(index, value)| match params.get(index) {
            Some(Param { ty: ParamType::Of(ty), .. }) => convert_to(*ty, value),
            _ => value,
        };
        let args = args.into_iter().enumerate().map(convert).collect();
        let call = OperationCall { name, formals, args };
        let component = Expr { ty: Type::CLOSURE, kind: ExprKind::Operation(call), span };
        let component = match weight {
            Some(weight) => parts::binary(BinaryOp::Mul, component, weight, span),
            None => Some(component),
        };
        let component = component.ok_or_else(|| errors::operation(op, "no weight of a closure"))?;
        let to = self.target(at, span)?;
        self.store(to, component, op)
    }

    /// The row with an operation's name.
    fn row(&self, name: &str, op: Span) -> Result<&'static Builtin> {
        builtins::of_operation(name)
            .ok_or_else(|| errors::operation(op, format!("there is no operation `{name}`")))
    }

    /// The converted arguments, and the outputs with their places.
    fn bound(
        &self,
        row: &'static Builtin,
        overload: usize,
        signature: &Signature,
        given: Vec<Expr>,
    ) -> BuiltinCall {
        let mut args: Vec<Expr> = Vec::new();
        let mut outputs = Vec::new();
        let converted = signature.converted(given.iter().map(|value| value.ty));
        for (index, value) in given.into_iter().enumerate() {
            let param = signature.params.get(index);
            let wanted = match param {
                Some(Param { ty, output, .. }) => output.then_some(*ty),
                None => {
                    let option = index.checked_sub(1).and_then(|before| args.get(before));
                    let name =
                        option.and_then(|e| if let ExprKind::Str(s) = &e.kind { Some(s) } else { None });
                    name.and_then(|name| row.output_option(name)).map(ParamType::Of)
                }
            };
            outputs.push(wanted.and_then(|wanted| self.output(wanted, &value)));
            args.push(match param {
                Some(Param { ty: ParamType::Of(ty), .. }) => convert_to(*ty, value),
                _ => value,
            });
        }
        BuiltinCall { row, overload, args, outputs, converted }
    }

    /// The place of an output; `None` if it is not a variable of the type.
    fn output(&self, wanted: ParamType, value: &Expr) -> Option<Lvalue> {
        let ExprKind::Read(place) = &value.kind else { return None };
        match wanted {
            ParamType::Of(ty) if !self.structs.equivalent(ty, place.ty) => None,
            _ => Some(place.clone()),
        }
    }
}

/// How well a signature matches a result and arguments; `None` if it does not.
fn score(structs: &StructTable, signature: &Signature, result: Option<Type>, args: &[Expr]) -> Option<u32> {
    let (fixed, rest) = args.split_at_checked(signature.params.len())?;
    let mut total = match result {
        Some(to) => suits(structs, to, signature.ret)?,
        None => 0,
    };
    for (param, e) in signature.params.iter().zip(fixed) {
        total += match param.ty {
            ParamType::Of(ty) => suits(structs, ty, e.ty)?,
            ParamType::Any { array } => u32::from(e.ty.is_array() == array).checked_sub(1)? + 1,
        };
    }
    let rest: Vec<Type> = rest.iter().map(|e| e.ty).collect();
    signature.tail.takes(&rest).then_some(total)
}

/// How well a value of type `have` matches one of type `want`.
fn suits(structs: &StructTable, want: Type, have: Type) -> Option<u32> {
    if want == have {
        return Some(100);
    }
    if want == Type::FLOAT && have == Type::INT {
        return Some(70);
    }
    if want.is_array() || have.is_array() {
        return match (want.extent, have.extent) {
            (Extent::Unsized, Extent::Array(_)) if want.base == have.base => Some(90),
            _ => structs.equivalent(want, have).then_some(20),
        };
    }
    if want.is_triple() && have.is_triple() {
        return Some(60);
    }
    structs.assignable(want, have).then_some(20)
}
