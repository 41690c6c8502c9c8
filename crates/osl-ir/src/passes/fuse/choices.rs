//! Writes one distance to a chosen point in place of a choice between distances.
//!
//! A side of a branch that is computed for all points often ends in a distance, which few of them need. If
//! choices within one another keep one of several distances from the same point, then the points are chosen,
//! and only one distance is computed. One of the alternatives may be another number. The bits are the same:
//! each lane computes what it kept before. Values of cells stay as they are, since they are computed once for
//! many points.

use crate::ir::{Body, Inst, Kind, LaneOp, Op, Rate, Source, ValueId};
use crate::passes::rewrite::{Code, Rewrite};
use rustc_hash::FxHashMap;
use smallvec::smallvec;

/// Choices within one another that are looked at.
const DEPTH: usize = 32;

/// Runs the rewriting. Returns whether anything changed.
pub(super) fn run(body: &mut Body) -> bool {
    let tree = Tree::of(body);
    let roots: FxHashMap<ValueId, Leaves> = tree
        .nodes
        .iter()
        .filter(|(v, node)| matches!(node.form, Form::Choice(..)) && !tree.is_inner(**v, node.block))
        .filter_map(|(v, node)| Some((*v, tree.leaves(*v, node.block).filter(Leaves::is_worth_it)?)))
        .collect();
    if roots.is_empty() {
        return false;
    }
    let blocks = (0..body.blocks.len()).map(|block| crate::ir::BlockId(block as u32));
    let mut choices = Choices { code: Code::with_rates(body), tree, roots };
    blocks.for_each(|id| choices.block(id));
    true
}

/// The distances and the choices of a body that differ from point to point.
struct Tree {
    nodes: FxHashMap<ValueId, Node>,
    /// For each value, how often it is an alternative of a choice, and how often it is used otherwise.
    uses: Vec<(u32, u32)>,
}

#[derive(Clone, Copy)]
struct Node {
    form: Form,
    /// The block that contains it.
    block: usize,
}

#[derive(Clone, Copy)]
enum Form {
    /// From a point to another.
    Distance(ValueId, ValueId),
    /// The condition and the alternatives.
    Choice(ValueId, [ValueId; 2]),
}

/// What the choices below a root keep.
#[derive(Default)]
struct Leaves {
    /// The point from which the distances are, and those to which they are.
    from: Option<ValueId>,
    to: Vec<ValueId>,
    /// Another number.
    other: Option<ValueId>,
}

impl Leaves {
    /// Whether choosing points costs less: three choices for each distance, and the choice of the other
    /// number.
    fn is_worth_it(&self) -> bool {
        self.to.len() >= if self.other.is_some() { 3 } else { 2 }
    }
}

impl Tree {
    fn of(body: &Body) -> Tree {
        let mut tree = Tree { nodes: FxHashMap::default(), uses: vec![(0, 0); body.values.len()] };
        for (block, insts) in body.blocks.iter().map(|block| &block.insts).enumerate() {
            for inst in insts {
                match form(body, inst) {
                    Some((result, form)) => {
                        tree.nodes.insert(result, Node { form, block });
                        match form {
                            Form::Choice(condition, alternatives) => {
                                tree.uses[condition.index()].1 += 1;
                                alternatives.iter().for_each(|v| tree.uses[v.index()].0 += 1);
                            }
                            Form::Distance(from, to) => {
                                [from, to].iter().for_each(|v| tree.uses[v.index()].1 += 1);
                            }
                        }
                    }
                    None => inst.op.for_each_use(|v| tree.uses[v.index()].1 += 1),
                }
            }
        }
        for output in &body.outputs {
            if let Source::Value(v) = output.source {
                tree.uses[v.index()].1 += 1;
            }
        }
        tree
    }

    /// Whether a value is nothing but an alternative of choices: of one, if it is a choice itself.
    fn is_inner(&self, v: ValueId, block: usize) -> bool {
        let Some(node) = self.nodes.get(&v).filter(|node| node.block == block) else { return false };
        match self.uses.get(v.index()) {
            Some((1, 0)) => true,
            Some((1.., 0)) => matches!(node.form, Form::Distance(..)),
            _ => false,
        }
    }

    /// The form of a value that is computed only for a choice in a block.
    fn inner(&self, v: ValueId, block: usize, depth: usize) -> Option<Form> {
        let form = self.nodes.get(&v)?.form;
        let is_near = depth < DEPTH || matches!(form, Form::Distance(..));
        (is_near && self.is_inner(v, block)).then_some(form)
    }

    /// What a root keeps; `None` if that is too varied.
    fn leaves(&self, root: ValueId, block: usize) -> Option<Leaves> {
        let Form::Choice(_, alternatives) = self.nodes.get(&root)?.form else { return None };
        let mut leaves = Leaves::default();
        let mut work: Vec<(ValueId, usize)> = alternatives.iter().map(|v| (*v, 1)).collect();
        while let Some((v, depth)) = work.pop() {
            match self.inner(v, block, depth) {
                Some(Form::Choice(_, alternatives)) => {
                    work.extend(alternatives.iter().map(|v| (*v, depth + 1)));
                }
                Some(Form::Distance(from, to)) => {
                    if *leaves.from.get_or_insert(from) != from {
                        return None;
                    }
                    if !leaves.to.contains(&to) {
                        leaves.to.push(to);
                    }
                }
                None if *leaves.other.get_or_insert(v) == v => {}
                None => return None,
            }
        }
        Some(leaves)
    }
}

/// The form of an instruction that may be part of a tree.
fn form(body: &Body, inst: &Inst) -> Option<(ValueId, Form)> {
    let (Op::Lane(op, args), [result]) = (&inst.op, &inst.results[..]) else { return None };
    if body.kind(*result) != Kind::Float || body.value(*result).rate != Rate::Varying {
        return None;
    }
    match (*op, &args[..]) {
        (LaneOp::Distance, [from, to]) => Some((*result, Form::Distance(*from, *to))),
        (LaneOp::Choose, [condition, a, b]) => Some((*result, Form::Choice(*condition, [*a, *b]))),
        _ => None,
    }
}

struct Choices<'a> {
    code: Code<'a>,
    tree: Tree,
    roots: FxHashMap<ValueId, Leaves>,
}

/// A rewritten alternative.
#[derive(Clone, Copy)]
struct Chosen {
    /// The point, if the alternative keeps a distance at all.
    to: Option<ValueId>,
    is_other: IsOther,
}

/// Whether an alternative is the other number.
#[derive(Clone, Copy, PartialEq)]
enum IsOther {
    Known(bool),
    Where(ValueId),
}

impl Choices<'_> {
    fn chosen(&mut self, v: ValueId, block: usize, depth: usize) -> Chosen {
        match self.tree.inner(v, block, depth) {
            Some(Form::Choice(condition, alternatives)) => self.choice(condition, alternatives, block, depth),
            Some(Form::Distance(_, to)) => Chosen { to: Some(to), is_other: IsOther::Known(false) },
            None => Chosen { to: None, is_other: IsOther::Known(true) },
        }
    }

    fn choice(&mut self, condition: ValueId, sides: [ValueId; 2], block: usize, depth: usize) -> Chosen {
        let [a, b] = sides.map(|v| self.chosen(v, block, depth + 1));
        let to = match (a.to, b.to) {
            (Some(x), Some(y)) if x != y => Some(self.lane(LaneOp::Choose, &[condition, x, y])),
            (x, y) => x.or(y),
        };
        let is_other = match (a.is_other, b.is_other) {
            (IsOther::Known(x), IsOther::Known(y)) if x == y => IsOther::Known(x),
            (x, y) => {
                let [x, y] = [x, y].map(|side| match side {
                    IsOther::Known(known) => self.int(known.into()),
                    IsOther::Where(v) => v,
                });
                IsOther::Where(self.lane(LaneOp::IChoose, &[condition, x, y]))
            }
        };
        Chosen { to, is_other }
    }

    /// The operation in place of that of a root.
    fn rewritten(&mut self, root: ValueId) -> Option<Op> {
        let leaves = self.roots.remove(&root)?;
        let Node { form: Form::Choice(condition, sides), block } = *self.tree.nodes.get(&root)? else {
            return None;
        };
        let chosen = self.choice(condition, sides, block, 0);
        let points = [leaves.from?, chosen.to?];
        Some(match (chosen.is_other, leaves.other) {
            (IsOther::Where(is_other), Some(other)) => {
                let distance = self.lane(LaneOp::Distance, &points);
                Op::Lane(LaneOp::Choose, smallvec![is_other, other, distance])
            }
            _ => Op::Lane(LaneOp::Distance, points.into_iter().collect()),
        })
    }
}

impl<'a> Rewrite<'a> for Choices<'a> {
    fn code(&mut self) -> &mut Code<'a> {
        &mut self.code
    }

    fn inst(&mut self, mut inst: Inst) {
        if let [root] = inst.results[..]
            && let Some(op) = self.rewritten(root)
        {
            inst.op = op;
        }
        self.keep(inst);
    }
}
