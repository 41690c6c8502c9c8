//! Expressions.
//!
//! Operands are evaluated left to right, but a plain variable is named, not copied: a change by a later
//! operand is visible, as everywhere in the language.

use super::constant::{self, constant};
use super::place::{Spot, is_pure};
use super::table::Sym;
use super::{Leaf, Storage, Val, Writer};
use crate::hir::{Expr, ExprKind, Init, Lvalue};
use crate::oso::text;
use osl_ir::types::{Base, Type};
use osl_syntax::ast::{BinaryOp, UnaryOp};

impl Writer<'_> {
    /// Evaluates an expression of any type.
    pub(super) fn eval(&mut self, e: &Expr) -> Val {
        if self.is_full() {
            return Val::Void;
        }
        self.span = e.span;
        match &e.kind {
            ExprKind::Read(place) => match self.spot(place, false) {
                Some(spot) => self.read(&spot),
                None => Val::Void,
            },
            ExprKind::Call(id, args) => self.call(*id, args),
            ExprKind::Builtin(call) => self.builtin(call, e.ty, None),
            ExprKind::Operation(call) => self.renderers(call, e.ty, None),
            ExprKind::Assign(place, init) => self.assigned(place, init),
            ExprKind::Struct(parts) => {
                let storage = self.allocate_temp(e.ty);
                self.store_init(&storage, e.ty, &Init::List(parts.clone()));
                Val::Stored(storage, None)
            }
            ExprKind::Comma(list) => {
                let mut last = Val::Void;
                for item in list {
                    last = self.eval(item);
                }
                last
            }
            _ => Val::One(self.scalar(e, None)),
        }
    }

    /// Evaluates an expression that has one value. The result may be a variable, so the next operation must
    /// use it at once.
    pub(super) fn value(&mut self, e: &Expr) -> Sym {
        let val = self.eval(e);
        self.one(val)
    }

    /// The only value of an expression that has one; otherwise a constant.
    pub(super) fn one(&mut self, val: Val) -> Sym {
        match val {
            Val::One(sym) => sym,
            Val::Stored(storage, element) => match (self.leaf(&storage), element) {
                (Some(leaf), None) => leaf,
                (Some(leaf), Some(index)) => {
                    let ty = self.table.ty(leaf).element();
                    self.emit_value("aref", ty, &[leaf, index])
                }
                (None, _) => self.table.int(0),
            },
            Val::Void => self.table.int(0),
        }
    }

    /// An operand among others: a variable stays a variable only where the language refers to it.
    pub(super) fn operand(&mut self, e: &Expr) -> Sym {
        let refers = match &e.kind {
            ExprKind::Read(place)
            | ExprKind::Step { prefix: true, place, .. }
            | ExprKind::Assign(place, _) => place.is_plain(),
            _ => false,
        };
        let value = self.value(e);
        if refers { value } else { self.settled(value) }
    }

    /// Evaluates an expression into a symbol of its type.
    pub(super) fn value_into(&mut self, e: &Expr, to: Sym) {
        self.span = e.span;
        // An operation that evaluates further operands after it has begun to write must not write what they
        // read.
        let direct = self.table.ty(to) == e.ty
            && constant(e).is_none()
            && match &e.kind {
                ExprKind::Binary(op, ..) => !matches!(op, BinaryOp::And | BinaryOp::Or),
                ExprKind::Unary(..) | ExprKind::Convert(_) | ExprKind::Triple(_) => true,
                ExprKind::Ternary(..) => true,
                _ => false,
            };
        match &e.kind {
            _ if direct => {
                self.scalar(e, Some(to));
            }
            ExprKind::Builtin(_) | ExprKind::Operation(_) if self.table.ty(to) == e.ty => {
                let made = match &e.kind {
                    ExprKind::Builtin(call) => self.builtin(call, e.ty, Some(to)),
                    ExprKind::Operation(call) => self.renderers(call, e.ty, Some(to)),
                    _ => Val::Void,
                };
                if let Val::One(made) = made
                    && made != to
                {
                    self.assign(to, made);
                }
            }
            _ => {
                let val = self.eval(e);
                self.write(&Spot::whole(Storage::Leaf(Leaf::Symbol(to))), val);
            }
        }
    }

    fn into(&mut self, to: Option<Sym>, ty: Type) -> Sym {
        to.unwrap_or_else(|| self.table.temp(ty))
    }

    fn scalar(&mut self, e: &Expr, to: Option<Sym>) -> Sym {
        if let (Some(values), None) = (constant(e), to) {
            return self.table.constant(e.ty, values);
        }
        match &e.kind {
            ExprKind::NullClosure => {
                let zero = self.table.int(0);
                self.emit_value("assign", e.ty, &[zero])
            }
            ExprKind::Convert(inner) => {
                let value = self.value(inner);
                let to = self.into(to, e.ty);
                self.assign(to, value);
                to
            }
            ExprKind::Unary(op, inner) => self.unary(*op, inner, e.ty, to),
            ExprKind::Binary(op @ (BinaryOp::And | BinaryOp::Or), a, b) => self.short_circuit(*op, a, b),
            ExprKind::Binary(op, a, b) => {
                let (a, b) = (self.operand(a), self.operand(b));
                self.span = e.span;
                let name = text::OPERATORS.iter().find(|(_, o)| o == op).map_or("nop", |(name, _)| *name);
                let to = self.into(to, e.ty);
                self.emit_to(name, to, &[a, b]);
                to
            }
            ExprKind::Ternary(cond, a, b) => self.ternary(cond, a, b, e.ty, to),
            ExprKind::Step { prefix, increment, place } => self.step(*prefix, *increment, place),
            ExprKind::Triple(parts) => {
                let parts: Vec<Sym> = parts.iter().map(|p| self.operand(p)).collect();
                let name = match e.ty.base {
                    Base::Color => "color",
                    Base::Point => "point",
                    Base::Vector => "vector",
                    _ => "normal",
                };
                let to = self.into(to, e.ty);
                self.emit_to(name, to, &parts);
                to
            }
            // The format has no literal for NaN.
            ExprKind::Float(x) if x.is_nan() => {
                let text = self.table.text("nan".into());
                let to = self.into(to, e.ty);
                self.emit_to("stof", to, &[text]);
                to
            }
            ExprKind::Matrix(cells) => {
                let cells = self.cells(cells);
                self.emit_value("matrix", Type::MATRIX, &cells)
            }
            _ => self.table.constant(e.ty, constant::zero(e.ty.base)),
        }
    }

    /// Cells of a matrix.
    pub(super) fn cells(&mut self, cells: &[Expr]) -> Vec<Sym> {
        cells.iter().map(|cell| self.operand(cell)).collect()
    }

    fn unary(&mut self, op: UnaryOp, inner: &Expr, ty: Type, to: Option<Sym>) -> Sym {
        let value = self.value(inner);
        let to = self.into(to, ty);
        match op {
            // A closure has no operation for it.
            UnaryOp::Neg if ty == Type::CLOSURE => {
                let minus = self.table.float(-1.0);
                self.emit_to("mul", to, &[value, minus]);
            }
            UnaryOp::Neg => self.emit_to("neg", to, &[value]),
            UnaryOp::Compl => self.emit_to("compl", to, &[value]),
            UnaryOp::Not => {
                let zero = self.zero_beside(value);
                self.emit_to("eq", to, &[value, zero]);
            }
        }
        to
    }

    /// The value that is compared with another for its truth.
    pub(super) fn zero_beside(&mut self, value: Sym) -> Sym {
        match self.table.ty(value).base {
            Base::String => self.table.text("".into()),
            Base::Int | Base::Closure => self.table.int(0),
            _ => self.table.float(0.0),
        }
    }

    /// The truth of an expression as an int, 0 where false.
    pub(super) fn truth(&mut self, e: &Expr) -> Sym {
        let value = self.value(e);
        if self.table.ty(value) == Type::INT { value } else { self.truth_of(value) }
    }

    fn truth_of(&mut self, value: Sym) -> Sym {
        let zero = self.zero_beside(value);
        self.emit_value("neq", Type::INT, &[value, zero])
    }

    fn short_circuit(&mut self, op: BinaryOp, a: &Expr, b: &Expr) -> Sym {
        let left = self.value(a);
        let result = self.truth_of(left);
        let branch = self.emit("if", &[result]);
        if op == BinaryOp::Or {
            self.part_ends(branch);
        }
        let right = self.value(b);
        let right = self.truth_of(right);
        self.assign(result, right);
        self.part_ends(branch);
        if op == BinaryOp::And {
            self.part_ends(branch);
        }
        result
    }

    fn ternary(&mut self, cond: &Expr, a: &Expr, b: &Expr, ty: Type, to: Option<Sym>) -> Sym {
        let cond = self.truth(cond);
        let to = self.into(to, ty);
        let branch = self.emit("if", &[cond]);
        for side in [a, b] {
            self.value_into(side, to);
            self.part_ends(branch);
        }
        to
    }

    fn assigned(&mut self, place: &Lvalue, init: &Init) -> Val {
        let Init::Value(e) = init else { return Val::Void };
        if place.is_plain()
            && let Some(spot) = self.spot(place, false)
            && let Some(leaf) = self.leaf(&spot.storage)
            && !self.table.ty(leaf).is_array()
        {
            self.value_into(e, leaf);
            return Val::One(leaf);
        }
        let mut value = self.eval(e);
        let pure = place.path.iter().all(|step| match step {
            crate::hir::Step::Element(i) | crate::hir::Step::Component(i) => is_pure(i),
            crate::hir::Step::Cell(r, c) => is_pure(r) && is_pure(c),
            crate::hir::Step::Field(_) => true,
        });
        if !pure {
            // A variable is referenced, so that the indices may still change it.
            value = match value {
                Val::Stored(from, Some(element)) => {
                    let kept = self.allocate_temp(e.ty);
                    self.copy(&kept, None, &from, Some(element));
                    Val::Stored(kept, None)
                }
                value => value,
            };
        }
        self.span = place.span;
        if let Some(spot) = self.spot(place, false) {
            self.write(&spot, value.clone());
        }
        value
    }

    fn step(&mut self, prefix: bool, increment: bool, place: &Lvalue) -> Sym {
        let Some(spot) = self.spot(place, false) else { return self.table.int(0) };
        let old = self.read(&spot);
        let old = self.one(old);
        let before = if prefix { old } else { self.settled(old) };
        let plain = spot.is_plain() && place.ty != Type::MATRIX;
        let new = self.next(old, increment, plain.then_some(old));
        if !plain {
            self.write(&spot, Val::One(new));
        }
        if prefix { new } else { before }
    }

    /// A value incremented or decremented by one: each component, or each of all sixteen cells.
    fn next(&mut self, old: Sym, increment: bool, to: Option<Sym>) -> Sym {
        let ty = self.table.ty(old);
        let name = if increment { "add" } else { "sub" };
        let one = if ty == Type::INT { self.table.int(1) } else { self.table.float(1.0) };
        if ty != Type::MATRIX {
            let to = self.into(to, ty);
            self.emit_to(name, to, &[old, one]);
            return to;
        }
        let matrix = self.emit_value("assign", ty, &[old]);
        for cell in 0..16 {
            let (row, column) = (self.table.int(cell / 4), self.table.int(cell % 4));
            let value = self.emit_value("mxcompref", Type::FLOAT, &[matrix, row, column]);
            let value = self.emit_value(name, Type::FLOAT, &[value, one]);
            self.emit_to("mxcompassign", matrix, &[row, column, value]);
        }
        matrix
    }
}
