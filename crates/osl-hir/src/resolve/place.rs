//! Places: expressions that may be assigned, stepped, or bound to an output.

use super::Resolver;
use super::errors;
use super::init::is_operand;
use super::unknown::Wanted;
use super::vocabulary;
use crate::hir::{Expr, ExprKind, GLOBALS, Lvalue, Step, VarId, VarKind};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::Reports;
use osl_syntax::ast::{self, ExprId};
use osl_syntax::diagnostic::{Code, Diagnostic, Edit};
use osl_syntax::span::Span;
use osl_syntax::spelling::closest;

impl Resolver<'_> {
    /// The place of an expression, or `None` if it is not one. Reports errors inside it.
    pub(super) fn place(&mut self, id: ExprId) -> Option<Lvalue> {
        let ast = self.ast;
        let span = ast[id].span;
        match &ast[id].kind {
            ast::ExprKind::Name(name) => {
                let var = self.variable(name, span)?;
                Some(Lvalue { var, path: Vec::new(), ty: self.var(var).ty, span })
            }
            ast::ExprKind::Field(base, field) => {
                if let ast::ExprKind::Name(module) = &ast[*base].kind
                    && self.lookup(module).is_none()
                    && !self.may_be_declared(module)
                    && let Some(word) = vocabulary::of_module(module, &field.text)
                {
                    let name = format!("{module}.{}", field.text);
                    self.report(errors::foreign_name(span, "variable", &name, word, None));
                    return None;
                }
                let base = self.place(*base)?;
                Some(self.member(base, field))
            }
            ast::ExprKind::Index(base, index) => {
                // m[r][c] is one step.
                if let ast::ExprKind::Index(inner, row) = &ast[*base].kind {
                    let outer = self.place(*inner)?;
                    let row = self.index(*row);
                    if outer.ty == Type::MATRIX {
                        let column = self.index(*index);
                        self.check_range(&row, 4);
                        self.check_range(&column, 4);
                        let cell = Step::Cell(Box::new(row), Box::new(column));
                        return Some(extend(outer, cell, Type::FLOAT, span));
                    }
                    let element = self.element(outer, row, ast[*base].span);
                    let index = self.index(*index);
                    return Some(self.element(element, index, span));
                }
                let base = self.place(*base)?;
                let index = self.index(*index);
                Some(self.element(base, index, span))
            }
            _ => None,
        }
    }

    /// The variable with a name; reports unknown names and functions.
    pub(super) fn variable(&mut self, name: &str, span: Span) -> Option<VarId> {
        match self.lookup(name) {
            Some((_, super::Symbol::Var(id))) => {
                let id = *id;
                if let Some(recorder) = &mut self.recorder {
                    recorder.use_variable(id, span);
                }
                return Some(id);
            }
            _ if self.may_be_declared(name) => {}
            Some((_, super::Symbol::Functions(_))) => {
                let message = format!("`{name}` is a function, not a variable");
                self.report(
                    Diagnostic::error(errors::WRONG_KIND_OF_NAME, span, message)
                        .help("call it: add `( )` and arguments"),
                );
            }
            None if crate::builtins::find(name).is_some() => {
                let message = format!("`{name}` is a function, not a variable");
                self.report(
                    Diagnostic::error(errors::WRONG_KIND_OF_NAME, span, message)
                        .help("call it: add `( )` and arguments"),
                );
            }
            None => self.unknown(span, "variable", name, Wanted::Value),
        }
        None
    }

    fn index(&mut self, id: ExprId) -> Expr {
        // `op=` and outputs evaluate an index twice, including everything within it.
        let deepest = self.limits.compiling.index_depth;
        if self.index_depth >= deepest {
            let message = format!("indices within indices, more than {deepest} deep");
            let span = self.ast[id].span;
            self.report(
                Diagnostic::error(errors::BAD_INDEX, span, message)
                    .help("store an inner element in a variable"),
            );
            return Expr { ty: Type::INT, span, kind: ExprKind::Error };
        }
        self.index_depth += 1;
        let index = self.expr(id, None);
        self.index_depth -= 1;
        if index.ty.is_error() {
            self.report_again(index.span, "an index");
        } else if index.ty != Type::INT {
            let message = format!("an index is an int, not {}", self.show_a(index.ty));
            let d = Diagnostic::error(errors::BAD_INDEX, index.span, message);
            self.report(match index.ty {
                Type::FLOAT => d
                    .help("write `(int)` before it")
                    .suggest("cast it", errors::cast_to_int(index.span, is_operand(&index))),
                _ => d,
            });
            return Expr { ty: Type::INT, span: index.span, kind: ExprKind::Error };
        }
        index
    }

    /// Warns about a constant index that none of `n` elements has.
    fn check_range(&mut self, index: &Expr, n: u32) {
        if let ExprKind::Int(at) = index.kind
            && !u32::try_from(at).is_ok_and(|at| at < n)
        {
            self.report(errors::out_of_range(index.span, n));
        }
    }

    fn element(&mut self, base: Lvalue, index: Expr, span: Span) -> Lvalue {
        match base.ty.extent {
            Extent::Array(n) => self.check_range(&index, n),
            Extent::One if base.ty.is_triple() => self.check_range(&index, 3),
            _ => {}
        }
        let index = Box::new(index);
        if base.ty.is_array() {
            let ty = base.ty.element();
            return extend(base, Step::Element(index), ty, span);
        }
        if base.ty.is_triple() {
            return extend(base, Step::Component(index), Type::FLOAT, span);
        }
        if !base.ty.is_error() {
            let what = self.show_a(base.ty);
            let d = Diagnostic::error(errors::BAD_INDEX, span, format!("{what} has no elements"));
            let d = if base.ty == Type::MATRIX {
                d.help("a matrix takes two indices, `m[row][column]`")
            } else {
                d
            };
            self.report_when(d, true);
        }
        extend(base, Step::Element(index), Type::ERROR, span)
    }

    fn member(&mut self, base: Lvalue, field: &ast::Name) -> Lvalue {
        let span = base.span.to(field.span);
        if let Some(id) = base.ty.as_struct()
            && let Some((index, f)) = self.structs.field(id, &field.text)
        {
            let ty = f.ty;
            if let Some(recorder) = &mut self.recorder {
                recorder.use_field(id, index, field.span);
            }
            return extend(base, Step::Field(index as u32), ty, span);
        }
        let component = match (base.ty, &*field.text) {
            (Type::COLOR, "r") | (Type::POINT | Type::VECTOR | Type::NORMAL, "x") => Some(0),
            (Type::COLOR, "g") | (Type::POINT | Type::VECTOR | Type::NORMAL, "y") => Some(1),
            (Type::COLOR, "b") | (Type::POINT | Type::VECTOR | Type::NORMAL, "z") => Some(2),
            _ => None,
        };
        if let Some(component) = component {
            let index = Expr { ty: Type::INT, kind: ExprKind::Int(component), span: field.span };
            return extend(base, Step::Component(Box::new(index)), Type::FLOAT, span);
        }
        let open = base.ty.as_struct().is_some_and(|id| self.is_open_struct(id.0));
        if !base.ty.is_error() && !open {
            let message = format!("{} has no member `{}`", self.show_a(base.ty), field.text);
            let d = Diagnostic::error(errors::UNKNOWN_MEMBER, field.span, message);
            let d = match base.ty.base {
                Base::Color => d.help("a color has `.r`, `.g` and `.b`"),
                base if base.is_triple() => d.help("it has `.x`, `.y` and `.z`"),
                Base::Struct(id) => {
                    let fields = self.structs.get(id).fields.iter().map(|f| &*f.name);
                    match closest(&field.text, fields) {
                        Some(close) => d.help(format!("it has a field `{close}`")).suggest(
                            format!("write `{close}`"),
                            vec![Edit { span: field.span, text: close.to_string() }],
                        ),
                        None => d,
                    }
                }
                _ => d,
            };
            let swizzle = base.ty.base.is_triple()
                && (2..=4).contains(&field.text.len())
                && field.text.bytes().all(|c| b"xyzwrgbastpq".contains(&c));
            let whole = matches!(
                (base.ty, &*field.text),
                (Type::COLOR, "rgb") | (Type::POINT | Type::VECTOR | Type::NORMAL, "xyz")
            );
            let d = match swizzle {
                true if whole => {
                    let edit = Edit { span: Span::new(base.span.end, field.span.end), text: String::new() };
                    d.note("it has these three components itself").fix("leave the swizzle out", vec![edit])
                }
                true => d.note("OSL takes one component at a time: `vector(v.y, v.x, v.z)`"),
                false => d,
            };
            self.report(d);
        }
        extend(base, Step::Field(0), Type::ERROR, span)
    }

    /// A place that is to be written; reports places that must not be written.
    pub(super) fn target(&mut self, id: ExprId, what: &str) -> Option<Lvalue> {
        if !self.is_lvalue(id) {
            let d =
                Diagnostic::error(errors::NOT_AN_LVALUE, self.ast[id].span, format!("cannot {what} this"))
                    .label("not a variable or a part of one");
            self.report(d);
            return None;
        }
        let place = self.place(id)?;
        self.check_writable(place.var, place.span, false);
        Some(place)
    }

    /// Whether the expression has the form of a variable or a part of one.
    pub(super) fn is_lvalue(&self, id: ExprId) -> bool {
        match &self.ast[id].kind {
            ast::ExprKind::Name(_) => true,
            ast::ExprKind::Index(base, _) | ast::ExprKind::Field(base, _) => self.is_lvalue(*base),
            _ => false,
        }
    }

    /// Reports a write to a read-only variable: an error for shader parameters, a warning for all others.
    pub(super) fn check_writable(&mut self, var: VarId, span: Span, as_output: bool) {
        let v = self.var(var);
        let (name, declared) = (v.name.clone(), v.span);
        let how = if as_output { "passed as an output" } else { "assigned" };
        let code: Code = match v.kind {
            VarKind::Param { output: false, .. } => {
                if self.reports != Reports::AsReference && !self.told.insert(format!("input {name}")) {
                    return;
                }
                let d = Diagnostic::error(
                    errors::READ_ONLY,
                    span,
                    format!("`{name}` is an input parameter and cannot be {how}"),
                )
                .also(declared, "declared here")
                .help("copy it into a local variable, or declare it `output`");
                return self.report(d);
            }
            VarKind::Global(global)
                if GLOBALS.iter().any(|(g, _, _, writable)| *g == global && !*writable) =>
            {
                errors::WRITES_READ_ONLY
            }
            // The reference does not report arrays.
            VarKind::Formal { output: false } if v.ty.is_array() && self.reports == Reports::AsReference => {
                return;
            }
            VarKind::Formal { output: false } => errors::WRITES_READ_ONLY,
            _ => return,
        };
        let d = Diagnostic::warning(code, span, format!("`{name}` is read-only by rule, yet {how} here"));
        let d = if matches!(self.var(var).kind, VarKind::Formal { .. }) {
            d.note("arguments are passed by reference: the caller's variable changes too")
        } else {
            d
        };
        self.report(d);
    }
}

fn extend(mut base: Lvalue, step: Step, ty: Type, span: Span) -> Lvalue {
    base.path.push(step);
    Lvalue { ty, span, ..base }
}
