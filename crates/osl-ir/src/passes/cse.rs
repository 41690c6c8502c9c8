//! Each value is computed once: an instruction whose equal ran before on the same path takes its result.

use super::Renaming;
use crate::ir::{BlockId, Body, Const, Kernel, LaneOp, Op, ValueId};
use rustc_hash::FxHashMap;

/// Runs the pass.
pub(super) fn run(body: &mut Body) {
    let mut cse = Cse { renaming: Renaming::default(), known: FxHashMap::default(), log: Vec::new() };
    cse.block(body, body.entry);
    super::fold::rename_outputs(body, &cse.renaming);
}

/// What makes two instructions equal. Constants compare by their bits.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Key {
    Bits(&'static str, Vec<u32>),
    Text(std::sync::Arc<str>),
    Global(crate::hir::Global),
    Slope(crate::hir::Global, crate::ir::Axis),
    Lane(LaneOp, Vec<ValueId>),
    Kernel(String, Vec<ValueId>),
    Derivative(ValueId, crate::ir::Axis),
}

struct Cse {
    renaming: Renaming,
    known: FxHashMap<Key, Vec<ValueId>>,
    /// Keys added, to forget where the path that computed them ends.
    log: Vec<Key>,
}

impl Cse {
    fn block(&mut self, body: &mut Body, id: BlockId) {
        let mark = self.log.len();
        let insts = std::mem::take(&mut body.blocks[id.index()].insts);
        let mut kept = Vec::with_capacity(insts.len());
        for mut inst in insts {
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
                // It only held tangents back.
                Op::Lane(LaneOp::Still, args) if args.len() == inst.results.len() => {
                    self.renaming.set(inst.results[0], args[0]);
                    continue;
                }
                op => {
                    if let Some(key) = key(op) {
                        if let Some(earlier) = self.known.get(&key).filter(|e| e.len() == inst.results.len())
                        {
                            for (result, earlier) in inst.results.iter().zip(earlier) {
                                self.renaming.set(*result, *earlier);
                            }
                            continue;
                        }
                        self.known.insert(key.clone(), inst.results.clone());
                        self.log.push(key);
                    }
                }
            }
            kept.push(inst);
        }
        body.blocks[id.index()].insts = kept;
        for key in self.log.split_off(mark) {
            self.known.remove(&key);
        }
    }
}

fn key(op: &Op) -> Option<Key> {
    let bits = |n: &[f32]| n.iter().map(|x| x.to_bits()).collect();
    Some(match op {
        Op::Const(Const::Int(n)) => Key::Bits("int", vec![*n as u32]),
        Op::Const(Const::Float(x)) => Key::Bits("float", bits(&[*x])),
        Op::Const(Const::Triple(t)) => Key::Bits("triple", bits(t)),
        Op::Const(Const::Matrix(m)) => Key::Bits("matrix", bits(&m[..])),
        Op::Const(Const::Str(s)) => Key::Text(s.clone()),
        Op::Const(Const::Null) => Key::Bits("null", Vec::new()),
        Op::Global(global) => Key::Global(*global),
        Op::Slope(global, axis) => Key::Slope(*global, *axis),
        Op::Lane(op, args) => Key::Lane(*op, args.clone()),
        Op::Kernel(kernel, _)
            if kernel.has_effect() || kernel.reads().is_some() || kernel.writes().is_some() =>
        {
            return None;
        }
        Op::Kernel(kernel, args) => Key::Kernel(kernel_key(kernel), args.clone()),
        Op::Derivative(v, axis) => Key::Derivative(*v, *axis),
        // Memory may change between two loads.
        Op::Load(_) | Op::Store(..) | Op::LoadElement(..) | Op::StoreElement(..) => return None,
        Op::If { .. } | Op::Loop { .. } | Op::Share(..) => return None,
    })
}

fn kernel_key(kernel: &Kernel) -> String {
    format!("{kernel:?}")
}
