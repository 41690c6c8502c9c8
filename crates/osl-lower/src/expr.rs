//! Expressions.
//!
//! Operands are evaluated left to right, but a plain variable is referenced, not copied: a change by a later
//! operand is visible, as in published compilers (`i + i++`).

use super::place::Spot;
use super::{Lowerer, Storage, Val, checks, kind_of};
use osl_hir::hir::{Expr, ExprKind, Init, Lvalue, Step};
use osl_ir::ir::{Const, Kernel, Kind, LaneOp, Note, Test, ValueId};
use osl_ir::types::Type;
use osl_syntax::ast::{BinaryOp, UnaryOp};

/// An operand: its value, or the variable to read after all operands are evaluated.
pub(super) enum Operand {
    Now(ValueId),
    Later(Spot),
}

impl Lowerer<'_> {
    /// Evaluates an expression of any type.
    pub(super) fn eval(&mut self, e: &Expr) -> Val {
        self.at(e.span);
        match &e.kind {
            ExprKind::Read(place) => match self.spot(place) {
                Some(spot) => self.read(&spot),
                None => Val::Void,
            },
            ExprKind::Call(id, args) => self.call(*id, args, e.span),
            ExprKind::Builtin(call) => self.builtin(call, e.span),
            ExprKind::Operation(call) => self.operation(call, e.ty, e.span),
            ExprKind::Assign(place, init) => self.assign(place, init),
            ExprKind::Struct(parts) => {
                let storage = self.allocate(e.ty, "struct");
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
            _ => Val::One(self.scalar(e)),
        }
    }

    /// Evaluates the value for a whole variable.
    pub(super) fn eval_into(&mut self, storage: &Storage, e: &Expr) -> Val {
        let Storage::Leaf(slot) = storage else { return self.eval(e) };
        let name = self.b.body.slot(*slot).name.clone();
        self.aim(Some(&name));
        let value = self.eval(e);
        // No operation computed it, so it is copied.
        if self.take_target().is_some()
            && let Val::One(value) = value
        {
            self.made(Some(name), value, "assign");
        }
        value
    }

    /// Evaluates an expression that has one value.
    pub(super) fn value(&mut self, e: &Expr) -> ValueId {
        let val = self.eval(e);
        self.one(val)
    }

    fn scalar(&mut self, e: &Expr) -> ValueId {
        match &e.kind {
            ExprKind::Int(n) => self.b.int(*n),
            ExprKind::Float(x) => self.b.float(*x),
            ExprKind::Str(s) => self.b.constant(Const::Str(s.clone())),
            ExprKind::NullClosure => self.b.constant(Const::Null),
            ExprKind::Convert(inner) => {
                let value = self.value(inner);
                // The reference's compiler writes a conversion for ints only.
                if inner.ty == Type::INT && !self.is_folded(inner) {
                    self.count_op();
                }
                self.convert(value, inner.ty, e.ty)
            }
            ExprKind::Unary(op, inner) => self.unary(*op, inner),
            ExprKind::Binary(op @ (BinaryOp::And | BinaryOp::Or), a, b) => self.short_circuit(*op, a, b),
            ExprKind::Binary(op, a, b) => {
                let (folded, name) = (self.is_folded(e), checks::binary_name(*op));
                let target = if folded { None } else { self.take_target() };
                let operands = self.operands_of(name, [a, b]);
                self.at(e.span);
                let value = self.binary(*op, operands[0], operands[1]);
                // A difference of equal variables is folded, whatever their values.
                let vanishes = folded || (*op == BinaryOp::Sub && same_variable(a, b));
                if !vanishes {
                    self.made(target, value, name);
                }
                value
            }
            ExprKind::Ternary(cond, a, b) => self.ternary(cond, a, b, e.ty),
            ExprKind::Step { prefix, increment, place } => self.step(*prefix, *increment, place),
            ExprKind::Triple(parts) => {
                let [a, b, c] = &**parts;
                let v = self.operands_of("construct", [a, b, c]);
                self.b.lane(LaneOp::Triple, &v)
            }
            ExprKind::Matrix(cells) => {
                let cells: Vec<Operand> = cells.iter().map(|c| self.operand(c)).collect();
                let cells: Vec<ValueId> = cells.into_iter().map(|c| self.settle(c)).collect();
                let zero = self.b.float(0.0);
                let mut matrix = self.b.lane(LaneOp::MDiag, &[zero]);
                for (index, cell) in cells.into_iter().enumerate() {
                    let (row, column) = (self.b.int(index as i32 / 4), self.b.int(index as i32 % 4));
                    matrix = self.b.lane(LaneOp::MSet, &[matrix, row, column, cell]);
                }
                matrix
            }
            _ => self.b.constant(Const::zero(kind_of(e.ty.base))),
        }
    }

    fn operands_of<const N: usize>(&mut self, op: &str, list: [&Expr; N]) -> [ValueId; N] {
        let operands = list.map(|e| self.operand(e));
        let mut arg = 0;
        operands.map(|o| {
            arg += 1;
            self.reads_for(op, arg);
            self.settle(o)
        })
    }

    pub(super) fn operand(&mut self, e: &Expr) -> Operand {
        match self.referenced(e) {
            Some(spot) => Operand::Later(spot),
            None => Operand::Now(self.value(e)),
        }
    }

    /// Evaluates an expression that is a variable, and returns this variable; does nothing with any other
    /// expression.
    fn referenced(&mut self, e: &Expr) -> Option<Spot> {
        let place = match &e.kind {
            ExprKind::Read(place) if place.is_plain() => Some(place),
            // These return the variable itself.
            ExprKind::Step { prefix: true, place, .. } if place.is_plain() => {
                self.eval(e);
                Some(place)
            }
            ExprKind::Assign(place, _) if place.is_plain() => {
                self.eval(e);
                Some(place)
            }
            _ => None,
        };
        place.and_then(|place| self.spot(place))
    }

    pub(super) fn settle(&mut self, operand: Operand) -> ValueId {
        match operand {
            Operand::Now(value) => value,
            Operand::Later(spot) => {
                let val = self.read(&spot);
                self.one(val)
            }
        }
    }

    fn convert(&mut self, value: ValueId, from: Type, to: Type) -> ValueId {
        let value = match (from, to) {
            (Type::INT, Type::FLOAT) => return self.b.lane(LaneOp::ToFloat, &[value]),
            (Type::FLOAT, Type::INT) => return self.b.lane(LaneOp::ToInt, &[value]),
            (Type::INT, _) if to != Type::INT => self.b.lane(LaneOp::ToFloat, &[value]),
            _ => value,
        };
        if !from.is_number() {
            return value;
        }
        match kind_of(to.base) {
            Kind::Triple => self.b.lane(LaneOp::Splat, &[value]),
            Kind::Matrix => self.b.lane(LaneOp::MDiag, &[value]),
            _ => value,
        }
    }

    fn unary(&mut self, op: UnaryOp, inner: &Expr) -> ValueId {
        if op == UnaryOp::Not {
            let value = self.value(inner);
            let kind = self.b.body.kind(value);
            if kind == Kind::Closure {
                let some = self.b.lane(LaneOp::KSome, &[value]);
                let none = self.b.int(0);
                return self.b.lane(LaneOp::IEq, &[some, none]);
            }
            // Not the negation of its truth: NaN is equal to 0 as well as different from it.
            let zero = self.b.constant(Const::zero(kind));
            return self.equality(BinaryOp::Eq, value, zero);
        }
        let value = self.value(inner);
        match (op, self.b.body.kind(value)) {
            (UnaryOp::Compl, _) => self.b.lane(LaneOp::ICompl, &[value]),
            (_, Kind::Int) => self.b.lane(LaneOp::INeg, &[value]),
            (_, Kind::Matrix) => {
                let minus = self.b.float(-1.0);
                self.b.lane(LaneOp::MScale, &[value, minus])
            }
            (_, Kind::Closure) => {
                let minus = self.b.float(-1.0);
                self.b.kernel(Kernel::ClosureScale, &[value, minus], Kind::Closure)
            }
            _ => self.b.lane(LaneOp::FNeg, &[value]),
        }
    }

    fn binary(&mut self, op: BinaryOp, a: ValueId, b: ValueId) -> ValueId {
        use BinaryOp as B;
        let (ka, kb) = (self.b.body.kind(a), self.b.body.kind(b));
        match (op, ka, kb) {
            (B::Add, Kind::Closure, _) => return self.b.kernel(Kernel::ClosureSum, &[a, b], Kind::Closure),
            (B::Mul, Kind::Closure, _) => return self.scaled(a, b),
            (B::Mul, _, Kind::Closure) => return self.scaled(b, a),
            _ => {}
        }
        if matches!(op, B::Eq | B::Ne) {
            return self.equality(op, a, b);
        }
        if ka == Kind::Matrix || kb == Kind::Matrix {
            return self.matrix_product(op, a, b);
        }
        let ints = ka == Kind::Int && kb == Kind::Int;
        let lane = match (op, ints) {
            (B::Add, true) => LaneOp::IAdd,
            (B::Sub, true) => LaneOp::ISub,
            (B::Mul, true) => LaneOp::IMul,
            (B::Div, true) => LaneOp::IDiv,
            (B::Lt, true) => LaneOp::ILt,
            (B::Le, true) => LaneOp::ILe,
            (B::Gt, true) => LaneOp::IGt,
            (B::Ge, true) => LaneOp::IGe,
            (B::Mod, _) => LaneOp::IMod,
            (B::Shl, _) => LaneOp::IShl,
            (B::Shr, _) => LaneOp::IShr,
            (B::BitAnd, _) => LaneOp::IAnd,
            (B::BitXor, _) => LaneOp::IXor,
            (B::BitOr, _) => LaneOp::IOr,
            (B::Add, false) => LaneOp::FAdd,
            (B::Sub, false) => LaneOp::FSub,
            (B::Mul, false) => LaneOp::FMul,
            (B::Div, false) => LaneOp::FDiv,
            (B::Lt, false) => LaneOp::FLt,
            (B::Le, false) => LaneOp::FLe,
            (B::Gt, false) => LaneOp::FGt,
            (B::Ge, false) => LaneOp::FGe,
            (B::Eq | B::Ne | B::And | B::Or, _) => return a,
        };
        self.b.lane(lane, &[a, b])
    }

    /// A closure times a number or a color.
    fn scaled(&mut self, closure: ValueId, by: ValueId) -> ValueId {
        let by = if self.b.body.kind(by) == Kind::Int { self.b.lane(LaneOp::ToFloat, &[by]) } else { by };
        self.b.kernel(Kernel::ClosureScale, &[closure, by], Kind::Closure)
    }

    fn equality(&mut self, op: BinaryOp, a: ValueId, b: ValueId) -> ValueId {
        let eq = op == BinaryOp::Eq;
        let (ka, kb) = (self.b.body.kind(a), self.b.body.kind(b));
        let pick = |yes, no| if eq { yes } else { no };
        let (lane, lift) = match (ka, kb) {
            (Kind::Matrix, _) | (_, Kind::Matrix) => (pick(LaneOp::MEq, LaneOp::MNe), Some(LaneOp::MDiag)),
            (Kind::Triple, _) | (_, Kind::Triple) => (pick(LaneOp::TEq, LaneOp::TNe), Some(LaneOp::Splat)),
            (Kind::Str, _) => (pick(LaneOp::SEq, LaneOp::SNe), None),
            (Kind::Int, Kind::Int) => (pick(LaneOp::IEq, LaneOp::INe), None),
            _ => (pick(LaneOp::FEq, LaneOp::FNe), None),
        };
        let lifted = |l: &mut Self, v: ValueId| match lift {
            Some(op) if l.b.body.kind(v) == Kind::Float => l.b.lane(op, &[v]),
            _ => v,
        };
        let (a, b) = (lifted(self, a), lifted(self, b));
        self.b.lane(lane, &[a, b])
    }

    fn matrix_product(&mut self, op: BinaryOp, a: ValueId, b: ValueId) -> ValueId {
        let both = (self.b.body.kind(a), self.b.body.kind(b));
        match (op, both) {
            (BinaryOp::Mul, (Kind::Matrix, Kind::Matrix)) => self.b.lane(LaneOp::MMul, &[a, b]),
            (BinaryOp::Mul, (Kind::Matrix, _)) => self.b.lane(LaneOp::MScale, &[a, b]),
            (BinaryOp::Mul, _) => self.b.lane(LaneOp::MScale, &[b, a]),
            (_, (Kind::Matrix, Kind::Matrix)) => {
                let inverse = self.b.lane(LaneOp::MInverse, &[b]);
                self.b.lane(LaneOp::MMul, &[a, inverse])
            }
            (_, (Kind::Matrix, _)) => {
                let one = self.b.float(1.0);
                let reciprocal = self.b.lane(LaneOp::FDivBy, &[one, b]);
                self.b.lane(LaneOp::MScale, &[a, reciprocal])
            }
            _ => {
                let inverse = self.b.lane(LaneOp::MInverse, &[b]);
                self.b.lane(LaneOp::MScale, &[inverse, a])
            }
        }
    }

    /// The truth of an expression as an int, 0 where false.
    pub(super) fn truth(&mut self, e: &Expr) -> ValueId {
        let value = self.value(e);
        self.at(e.span);
        match self.b.body.kind(value) {
            Kind::Int => value,
            Kind::Closure => self.b.lane(LaneOp::KSome, &[value]),
            kind => {
                let zero = self.b.constant(Const::zero(kind));
                self.equality(BinaryOp::Ne, value, zero)
            }
        }
    }

    /// The truth as exactly 0 or 1.
    fn truth_bit(&mut self, e: &Expr) -> ValueId {
        let truth = self.truth(e);
        let zero = self.b.int(0);
        self.b.lane(LaneOp::INe, &[truth, zero])
    }

    fn short_circuit(&mut self, op: BinaryOp, a: &Expr, b: &Expr) -> ValueId {
        let slot = self.b.slot(Kind::Int, None, if op == BinaryOp::And { "and" } else { "or" }.into());
        let left = self.truth_bit(a);
        self.b.note(&[left], |_| Note::Branch(Test::Operand));
        self.b.store(slot, left);
        let more = |l: &mut Self| {
            let right = l.truth_bit(b);
            l.b.note(&[right], |_| Note::Branch(Test::Operand));
            l.b.store(slot, right);
        };
        if op == BinaryOp::And {
            self.if_else(left, more, |_| ());
        } else {
            self.if_else(left, |_| (), more);
        }
        self.b.load(slot)
    }

    fn ternary(&mut self, cond: &Expr, a: &Expr, b: &Expr, ty: Type) -> ValueId {
        let cond = self.truth(cond);
        self.b.note(&[cond], |_| Note::Branch(Test::Choice));
        let slot = self.b.slot(kind_of(ty.base), None, "choice".into());
        let side = |e: &Expr, l: &mut Self| {
            let value = l.value(e);
            l.b.store(slot, value);
        };
        self.if_else(cond, |l| side(a, l), |l| side(b, l));
        self.b.load(slot)
    }

    fn assign(&mut self, place: &Lvalue, init: &Init) -> Val {
        if let Init::Value(e) = init
            && place.path.iter().any(may_write)
            && let Some(later) = self.referenced(e)
        {
            // The variable is referenced, so the indices of the left side may still change it.
            let Some(spot) = self.spot(place) else { return Val::Void };
            let value = self.read(&later);
            self.write(&spot, value.clone());
            return value;
        }
        let value = match init {
            Init::Value(e) if self.checks_assigned(place) => match self.storage(place.var) {
                Some(storage) => self.eval_into(&storage, e),
                None => self.eval(e),
            },
            Init::Value(e) => {
                self.aim(None);
                self.eval(e)
            }
            Init::List(_) => return Val::Void,
        };
        let value = match value {
            // The right side is evaluated before the indices of the left side change anything.
            Val::Stored(from, Some(element)) if place.path.iter().any(may_write) => {
                Val::Stored(self.kept(&from, element), None)
            }
            value => value,
        };
        if let Some(spot) = self.spot(place) {
            self.write(&spot, value.clone());
        }
        value
    }

    fn step(&mut self, prefix: bool, increment: bool, place: &Lvalue) -> ValueId {
        let Some(spot) = self.spot(place) else { return self.b.int(0) };
        let old = self.read(&spot);
        let old = self.one(old);
        let new = self.next(old, increment);
        self.count_op();
        self.write(&spot, Val::One(new));
        if prefix { new } else { old }
    }

    /// A value incremented or decremented by one: each component, or each of all sixteen cells.
    fn next(&mut self, old: ValueId, increment: bool) -> ValueId {
        let (one, add, sub) = match self.b.body.kind(old) {
            Kind::Int => (self.b.int(1), LaneOp::IAdd, LaneOp::ISub),
            _ => (self.b.float(1.0), LaneOp::FAdd, LaneOp::FSub),
        };
        let op = if increment { add } else { sub };
        if self.b.body.kind(old) != Kind::Matrix {
            return self.b.lane(op, &[old, one]);
        }
        let mut matrix = old;
        for cell in 0..16 {
            let (row, column) = (self.b.int(cell / 4), self.b.int(cell % 4));
            let value = self.b.lane(LaneOp::MGet, &[matrix, row, column]);
            let value = self.b.lane(op, &[value, one]);
            matrix = self.b.lane(LaneOp::MSet, &[matrix, row, column, value]);
        }
        matrix
    }
}

/// Whether an index of this step may change a variable: it is more than a number or a variable.
fn may_write(step: &Step) -> bool {
    let simple = |index: &Expr| match &index.kind {
        ExprKind::Int(_) => true,
        ExprKind::Read(place) => place.is_plain(),
        _ => false,
    };
    match step {
        Step::Field(_) => false,
        Step::Element(index) | Step::Component(index) => !simple(index),
        Step::Cell(row, column) => !simple(row) || !simple(column),
    }
}

/// Whether both expressions read the same variable.
fn same_variable(a: &Expr, b: &Expr) -> bool {
    match (&a.kind, &b.kind) {
        (ExprKind::Read(a), ExprKind::Read(b)) => a.path.is_empty() && b.path.is_empty() && a.var == b.var,
        _ => false,
    }
}
