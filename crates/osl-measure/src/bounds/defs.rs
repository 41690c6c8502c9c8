//! The definitions of the values of a program.

use osl_ir::ir::{Body, Const, LaneOp, Op, ValueId};

/// The instruction that defines a value.
#[derive(Clone, Debug)]
pub(super) enum Def {
    Const(Const),
    Lane(LaneOp, [Option<ValueId>; 2]),
    /// A result of a branch: the condition, the value from each side, and the number of the branch.
    If(ValueId, [ValueId; 2], usize),
}

/// The definitions of the values of a body.
#[derive(Debug, Default)]
pub(super) struct Defs {
    values: Vec<Option<Def>>,
    /// The results of each branch, with the value from each side.
    pub(super) branches: Vec<Vec<(ValueId, [ValueId; 2])>>,
}

impl Defs {
    pub(super) fn of(body: &Body) -> Defs {
        let mut defs = Defs { values: vec![None; body.values.len()], branches: Vec::new() };
        for inst in body.insts() {
            match &inst.op {
                Op::Const(value) => defs.put(inst.results.first(), Def::Const(value.clone())),
                Op::Lane(op, args) => {
                    let args = [args.first().copied(), args.get(1).copied()];
                    defs.put(inst.results.first(), Def::Lane(*op, args));
                }
                Op::If { cond, then_yields, else_yields, .. } => {
                    let mut branch = Vec::new();
                    for (result, sides) in inst.results.iter().zip(then_yields.iter().zip(else_yields)) {
                        let sides = [*sides.0, *sides.1];
                        defs.put(Some(result), Def::If(*cond, sides, defs.branches.len()));
                        branch.push((*result, sides));
                    }
                    defs.branches.push(branch);
                }
                _ => {}
            }
        }
        defs
    }

    fn put(&mut self, value: Option<&ValueId>, def: Def) {
        if let Some(place) = value.and_then(|value| self.values.get_mut(value.index())) {
            *place = Some(def);
        }
    }

    pub(super) fn get(&self, value: ValueId) -> Option<&Def> {
        self.values.get(value.index())?.as_ref()
    }

    /// The constant of the program that a value is.
    pub(super) fn constant(&self, value: ValueId) -> Option<&Const> {
        match self.get(value) {
            Some(Def::Const(constant)) => Some(constant),
            _ => None,
        }
    }

    /// Whether a value is the floor of another one.
    pub(super) fn is_floor_of(&self, whole: ValueId, x: ValueId) -> bool {
        matches!(self.get(whole), Some(Def::Lane(LaneOp::Floor, [Some(of), _])) if *of == x)
    }
}
