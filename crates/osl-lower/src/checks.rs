//! Checks of a debugging run: infinite or NaN values, and reads of uninitialised variables.
//!
//! Uninitialised variables get a special value, as in the reference: NaN, the lowest int, a special string. A
//! read that finds the special value reports it and replaces it by zero. Operations are counted as the
//! reference's compiler would write them, without those that it folds. Without checks this module writes
//! nothing.

use super::{Lowerer, Storage};
use crate::group::Checks;
use osl_hir::hir::{Expr, ExprKind, Lvalue, Program, StmtKind, VarId, VarKind};
use osl_hir::lint::Walk;
use osl_ir::ir::{Const, Kernel, Kind, SlotId, UNSET_TEXT, ValueId};
use osl_ir::types::Type;
use osl_syntax::ast::{BinaryOp, UnaryOp};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// The state of lowering for its checks.
#[derive(Debug, Default)]
pub(super) struct Checking {
    pub(super) on: Checks,
    /// The variable that the next operation writes.
    target: Option<Arc<str>>,
    /// The next operation that reads variables, and the number of the argument.
    reader: (Arc<str>, usize),
    /// Number of operations and of temporary variables so far.
    n_ops: u32,
    n_temporaries: u32,
    /// Local variables that are assigned once, with a constant: reads see the constant.
    constants: Vec<VarId>,
}

/// The name of a binary operation.
pub(super) fn binary_name(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Add => "add",
        BinaryOp::Sub => "sub",
        BinaryOp::Mul => "mul",
        BinaryOp::Div => "div",
        BinaryOp::Mod => "mod",
        BinaryOp::Lt => "lt",
        BinaryOp::Le => "le",
        BinaryOp::Gt => "gt",
        BinaryOp::Ge => "ge",
        BinaryOp::Eq => "eq",
        BinaryOp::Ne => "neq",
        BinaryOp::And => "and",
        BinaryOp::Or => "or",
        BinaryOp::BitAnd => "bitand",
        BinaryOp::BitOr => "bitor",
        BinaryOp::BitXor => "xor",
        BinaryOp::Shl => "shl",
        BinaryOp::Shr => "shr",
    }
}

/// The variables of a program that are assigned once, as a whole, with a literal.
fn constants(program: &Program) -> Vec<VarId> {
    let mut writes: FxHashMap<VarId, (u32, u32)> = FxHashMap::default();
    let walk = Walk::new(program);
    for list in osl_hir::lint::bodies(program) {
        walk.all(list, &mut |event| osl_hir::lint::count_writes(event, &mut writes));
    }
    for param in &program.shader.params {
        writes.entry(param.var).or_default().0 += 2;
    }
    writes.into_iter().filter(|(_, count)| *count == (1, 1)).map(|(var, _)| var).collect()
}

impl Lowerer<'_> {
    /// Begins a layer.
    pub(super) fn begin_checks(&mut self) {
        let on = self.rules.checks;
        self.checking = Checking { on, reader: ("assign".into(), 1), ..Checking::default() };
        if on.set {
            self.checking.constants = constants(self.program);
        }
    }

    /// Counts an operation.
    pub(super) fn count_op(&mut self) {
        self.checking.n_ops += 1;
    }

    /// The number of operations so far.
    pub(super) fn ops_so_far(&self) -> u32 {
        self.checking.n_ops
    }

    /// Uncounts operations that the reference omits.
    pub(super) fn forget_ops(&mut self, so_far: u32) {
        self.checking.n_ops = so_far;
    }

    /// Sets the operation that reads variables next.
    pub(super) fn reads_for(&mut self, op: &str, arg: usize) {
        if self.checking.on.set {
            self.checking.reader = (op.into(), arg);
        }
    }

    /// Sets the variable that the next operation writes.
    pub(super) fn aim(&mut self, name: Option<&Arc<str>>) {
        if self.checking.on.any() {
            self.checking.target = name.cloned();
        }
    }

    /// Takes the variable of the next operation: operands have their own.
    pub(super) fn take_target(&mut self) -> Option<Arc<str>> {
        self.checking.target.take()
    }

    /// Whether an expression is a constant in the reference.
    pub(super) fn is_folded(&self, e: &Expr) -> bool {
        match &e.kind {
            ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Str(_) => true,
            ExprKind::Read(place) => place.path.is_empty() && self.checking.constants.contains(&place.var),
            ExprKind::Convert(inner) => self.is_folded(inner),
            ExprKind::Unary(UnaryOp::Neg, inner) => self.is_folded(inner),
            ExprKind::Binary(_, a, b) => self.is_folded(a) && self.is_folded(b),
            ExprKind::Triple(parts) => parts.iter().all(|part| self.is_folded(part)),
            _ => false,
        }
    }

    /// Whether values assigned to a whole place are checked.
    pub(super) fn checks_assigned(&self, place: &Lvalue) -> bool {
        self.checking.on.any() && place.path.is_empty() && !self.is_constant(place.var)
    }

    /// Marks the local variables of a layer that no statement declares, as in compiled shaders.
    pub(super) fn mark_undeclared(&mut self) {
        // Defaults of parameters are not operations.
        self.checking.n_ops = 0;
        if !self.checking.on.set {
            return;
        }
        let program = self.program;
        let mut declared = vec![false; program.vars.len()];
        for list in osl_hir::lint::bodies(program) {
            osl_hir::lint::each_stmt(list, &mut |stmt| {
                if let StmtKind::Declare(var, _) = &stmt.kind
                    && let Some(declared) = declared.get_mut(var.0 as usize)
                {
                    *declared = true;
                }
            });
        }
        for (at, var) in program.vars.iter().enumerate() {
            let id = VarId(at as u32);
            let free = self.vars.get(at).is_some_and(Option::is_none) && declared.get(at) == Some(&false);
            if free && matches!(var.kind, VarKind::Local) && !var.name.starts_with('$') {
                let storage = self.allocate(var.ty, &var.name);
                self.store_zero(&storage);
                self.mark_unset(id, &storage);
                self.bind(id, storage);
            }
        }
    }

    /// Whether the reference omits the assignment to a variable, since reads see a constant.
    pub(super) fn is_constant(&self, var: VarId) -> bool {
        self.checking.constants.contains(&var)
    }

    /// Checks and counts the result of an operation, for a variable or a temporary.
    pub(super) fn made(&mut self, target: Option<Arc<str>>, value: ValueId, op: &str) {
        if !self.checking.on.any() {
            return;
        }
        self.count_op();
        let name = target.unwrap_or_else(|| {
            self.checking.n_temporaries += 1;
            format!("$tmp{}", self.checking.n_temporaries).into()
        });
        self.check_finite(&name, value, op);
    }

    /// Checks a value that is assigned to a variable.
    pub(super) fn check_finite(&mut self, name: &Arc<str>, value: ValueId, op: &str) {
        let kind = self.b.body.kind(value);
        if self.checking.on.finite && matches!(kind, Kind::Float | Kind::Triple | Kind::Matrix) {
            let kernel = Kernel::CheckFinite { name: name.clone(), op: op.into() };
            self.b.kernel_of(kernel, &[value], &[]);
        }
    }

    /// Checks a variable of a type, or a part of it, that is read; returns its value, with zero if it had
    /// none.
    pub(super) fn check_set(
        &mut self,
        name: &Arc<str>,
        ty: Type,
        value: ValueId,
        op: Option<&str>,
    ) -> ValueId {
        let kind = self.b.body.kind(value);
        let (reader, arg) = match op {
            Some(op) => (op, 1),
            None => (&*self.checking.reader.0, self.checking.reader.1),
        };
        let what = format!("{} {name}", self.program.structs.show(ty));
        let reader = format!("op {} '{reader}', arg {arg}", self.checking.n_ops);
        let kernel = Kernel::CheckSet { what: what.into(), reader: reader.into() };
        self.b.kernel(kernel, &[value], kind)
    }

    /// Marks a new variable as uninitialised.
    pub(super) fn mark_unset(&mut self, var: VarId, storage: &Storage) {
        if !self.checking.on.set || self.is_constant(var) {
            return;
        }
        match storage {
            Storage::Struct(parts) => parts.iter().for_each(|part| self.mark_unset(var, part)),
            Storage::Leaf(slot) => self.mark_slot(*slot),
        }
    }

    fn mark_slot(&mut self, slot: SlotId) {
        let (kind, len) = {
            let slot = self.b.body.slot(slot);
            (slot.kind, slot.len)
        };
        let mark = match kind {
            Kind::Int => Const::Int(i32::MIN),
            Kind::Float => Const::Float(f32::NAN),
            Kind::Triple => Const::Triple([f32::NAN; 3]),
            Kind::Matrix => Const::Matrix(Box::new([f32::NAN; 16])),
            Kind::Str => Const::Str(UNSET_TEXT.into()),
            Kind::Closure => return,
        };
        let mark = self.b.constant(mark);
        match len {
            None => self.b.store(slot, mark),
            Some(n) => {
                let most = u32::try_from(self.b.limits.marked).unwrap_or(u32::MAX);
                for index in 0..n.min(most) {
                    let index = self.b.int(index as i32);
                    self.b.store_element(slot, index, mark);
                }
            }
        }
    }
}
