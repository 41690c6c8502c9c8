//! Common subexpression elimination: an instruction that equals an earlier one on the same path takes its
//! result.

use super::Renaming;
use crate::ir::{BlockId, Body, Const, Kernel, Kind, LaneOp, Op, ValueId, Values};
use rustc_hash::FxHashMap;
use smallvec::{SmallVec, smallvec};

/// Runs the pass.
pub(super) fn run(body: &mut Body) {
    let renaming = Renaming::default();
    let mut cse = Cse { renaming, known: FxHashMap::default(), log: Vec::new(), nested: false };
    cse.known.reserve(body.block(body.entry).insts.len());
    cse.block(body, body.entry);
    super::fold::rename_outputs(body, &cse.renaming);
}

/// The key by which two instructions are equal. It is small, since there is one for each instruction.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Key {
    /// The bits of a constant that is not a string.
    Bits(Kind, SmallVec<[u32; 4]>),
    Text(std::sync::Arc<str>),
    Global(crate::global::Global),
    Input(u32),
    GlobalDeriv(crate::global::Global, crate::ir::Axis),
    Lane(LaneOp, Values),
    Kernel(Box<Kernel>, Values),
    Derivative(ValueId, crate::ir::Axis),
}

struct Cse {
    renaming: Renaming,
    known: FxHashMap<Key, Values>,
    /// Keys added in nested blocks, which are forgotten when the path that computed them ends.
    log: Vec<Key>,
    /// Whether the current block is nested.
    nested: bool,
}

impl Cse {
    fn block(&mut self, body: &mut Body, id: BlockId) {
        let mark = self.log.len();
        let outer = std::mem::replace(&mut self.nested, id != body.entry);
        let mut insts = std::mem::take(&mut body.blocks[id.index()].insts);
        insts.retain_mut(|inst| {
            inst.op.replace_uses(|v| self.renaming.get(v));
            match &mut inst.op {
                Op::If { then, otherwise, then_yields, else_yields, .. } => {
                    self.block(body, *then);
                    then_yields.iter_mut().for_each(|v| *v = self.renaming.get(*v));
                    self.block(body, *otherwise);
                    else_yields.iter_mut().for_each(|v| *v = self.renaming.get(*v));
                }
                Op::Loop { body: inner, cond, next, .. } => {
                    self.block(body, *inner);
                    *cond = self.renaming.get(*cond);
                    next.iter_mut().for_each(|v| *v = self.renaming.get(*v));
                }
                // It only suppressed derivatives.
                Op::Lane(LaneOp::Still, args) if args.len() == inst.results.len() => {
                    self.renaming.set(inst.results[0], args[0]);
                    return false;
                }
                op => {
                    if let Some(key) = key(op) {
                        if let Some(earlier) = self.known.get(&key).filter(|e| e.len() == inst.results.len())
                        {
                            for (result, earlier) in inst.results.iter().zip(earlier) {
                                self.renaming.set(*result, *earlier);
                            }
                            return false;
                        }
                        if self.nested {
                            self.log.push(key.clone());
                        }
                        self.known.insert(key, inst.results.clone());
                    }
                }
            }
            true
        });
        body.blocks[id.index()].insts = insts;
        self.nested = outer;
        for key in self.log.split_off(mark) {
            self.known.remove(&key);
        }
    }
}

fn key(op: &Op) -> Option<Key> {
    Some(match op {
        Op::Const(Const::Str(s)) => Key::Text(s.clone()),
        Op::Const(constant) => Key::Bits(constant.kind(), bits(constant)),
        Op::Global(global) => Key::Global(*global),
        Op::Input(index) => Key::Input(*index),
        Op::GlobalDeriv(global, axis) => Key::GlobalDeriv(*global, *axis),
        Op::Lane(op, args) => Key::Lane(*op, args.clone()),
        Op::Kernel(kernel, _)
            if kernel.has_effect() || kernel.reads().is_some() || kernel.writes().is_some() =>
        {
            return None;
        }
        Op::Kernel(kernel, args) => Key::Kernel(Box::new(kernel.clone()), args.clone()),
        Op::Derivative(v, axis) => Key::Derivative(*v, *axis),
        // Memory may change between two loads.
        Op::Load(_) | Op::Store(..) | Op::LoadElement(..) | Op::StoreElement(..) => return None,
        Op::If { .. } | Op::Loop { .. } | Op::Share(..) => return None,
    })
}

fn bits(constant: &Const) -> SmallVec<[u32; 4]> {
    let words = |n: &[f32]| n.iter().map(|x| x.to_bits()).collect();
    match constant {
        Const::Int(n) => smallvec![*n as u32],
        Const::Float(x) => words(&[*x]),
        Const::Triple(t) => words(t),
        Const::Matrix(m) => words(&m[..]),
        Const::Str(_) | Const::Null => SmallVec::new(),
    }
}
