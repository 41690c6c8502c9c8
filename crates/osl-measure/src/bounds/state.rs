//! The state of a walk: what is known of each value, of the arrays and of the path so far; and the definitions
//! of the program's values. `walk` drives, and `assume` and `paths` narrow values.

use super::calls::Calls;
use super::domain::Tile;
use super::paths::Paths;
use super::sites::Sites;
use osl_exec::PointSource;
use osl_ir::ir::{Body, Const, LaneOp, Op, ValueId};
use osl_numeric::interval::Enclosure;

/// What a walk needs to know.
#[derive(Clone, Copy)]
pub(super) struct Program<'a> {
    pub(super) body: &'a Body,
    pub(super) defs: &'a Defs,
    pub(super) points: &'a dyn PointSource,
    pub(super) calls: &'a Calls<'a>,
}

/// The arrays of a program, element by element.
pub(super) type Arrays = Vec<Vec<Enclosure>>;

/// One walk.
pub(super) struct Walk<'a> {
    pub(super) program: Program<'a>,
    pub(super) tile: &'a Tile,
    pub(super) values: Vec<Option<Enclosure>>,
    pub(super) arrays: Arrays,
    pub(super) sites: &'a mut Sites,
    pub(super) paths: &'a mut Paths,
    /// The number of loops and of branches with joined sides around the instruction.
    pub(super) joined: usize,
    /// Whether no point takes this path, or the walk has to stop.
    pub(super) is_dead: bool,
    /// The number of instructions that may still be walked.
    pub(super) steps: usize,
}

/// The values before they were narrowed, the last one first to be restored.
#[derive(Default)]
pub(super) struct Undo(Vec<(ValueId, Option<Enclosure>)>);

impl Walk<'_> {
    /// The enclosure of a value; every value of its kind if its definition was not walked.
    pub(super) fn of(&self, value: ValueId) -> Enclosure {
        let known = self.values.get(value.index()).and_then(Option::as_ref);
        known.cloned().unwrap_or_else(|| Enclosure::any(self.program.body.kind(value)))
    }

    pub(super) fn set(&mut self, value: ValueId, enclosure: Enclosure) {
        if let Some(place) = self.values.get_mut(value.index()) {
            *place = Some(enclosure);
        }
    }

    pub(super) fn set_all(&mut self, values: &[ValueId], enclosures: &[Enclosure]) {
        for (value, enclosure) in values.iter().zip(enclosures) {
            self.set(*value, enclosure.clone());
        }
    }

    pub(super) fn all(&self, values: &[ValueId]) -> Vec<Enclosure> {
        values.iter().map(|value| self.of(*value)).collect()
    }

    /// Replaces a value by a part of it.
    pub(super) fn narrow(&mut self, value: ValueId, to: Enclosure, undo: &mut Undo) {
        if let Some(place) = self.values.get_mut(value.index()) {
            undo.0.push((value, place.replace(to)));
        }
    }

    /// Takes back what was narrowed.
    pub(super) fn restore(&mut self, undo: Undo) {
        for (value, before) in undo.0.into_iter().rev() {
            if let Some(place) = self.values.get_mut(value.index()) {
                *place = before;
            }
        }
    }
}

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
