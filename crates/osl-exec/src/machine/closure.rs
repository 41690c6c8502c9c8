//! Closures while a batch runs: a tree for each value, in an arena that lasts as long as the batch.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::closures::{ClosureKind, Columns, List, show};
use crate::step::{KernelStep, Operand};
use osl_ir::ir::{Kind, Shape};
use osl_lanes::{Arg, Word};
use smallvec::SmallVec;
use std::sync::Arc;

#[derive(Clone, Copy, Debug)]
enum Form {
    /// The index of its kind, and the first word of its parameters.
    Component(u32, u32),
    Sum(u32, u32),
    Scale(u32, [f32; 3]),
}

#[derive(Debug)]
struct Node {
    form: Form,
    /// Its approximate size in bytes when written out: nodes that are shared count each time.
    written: u64,
}

/// The closures of a batch. Number 0 is the null closure; the others are the index of their node plus one.
#[derive(Debug, Default)]
pub(super) struct Closures {
    nodes: Vec<Node>,
    /// The parameters of components: floats by their bits, strings and closures by their numbers.
    words: Vec<u32>,
}

/// Bytes charged for a node or a component that is written out, besides the contents of its parameters.
const NODE_BYTES: u64 = 512;
/// Bytes charged for a parameter that is written out, and for a value of it.
const PARAM_BYTES: u64 = 64;
/// Bytes of a closure that are processed in one step.
const BYTES_A_STEP: u64 = 16;

impl Closures {
    pub(super) fn clear(&mut self) {
        self.nodes.clear();
        self.words.clear();
    }

    fn node(&self, closure: u32) -> Option<&Node> {
        self.nodes.get(closure.checked_sub(1)? as usize)
    }

    fn written(&self, closure: u32) -> u64 {
        self.node(closure).map_or(0, |node| node.written)
    }

    /// Calls `visit` with each component in the order of the sums: the index of its kind, its weight
    /// multiplied out, and the first word of its parameters.
    fn each(&self, closure: u32, mut visit: impl FnMut(u32, [f32; 3], u32)) {
        let mut open: SmallVec<[(u32, [f32; 3]); 8]> = SmallVec::new();
        open.push((closure, [1.0; 3]));
        while let Some((closure, weight)) = open.pop() {
            let Some(node) = self.node(closure) else { continue };
            match node.form {
                Form::Component(kind, start) => visit(kind, weight, start),
                Form::Sum(a, b) => open.extend([(b, weight), (a, weight)]),
                Form::Scale(of, by) => open.push((of, std::array::from_fn(|c| weight[c] * by[c]))),
            }
        }
    }
}

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// Adds a node for which the batch keeps some bytes, and which takes `written` bytes when written out.
    fn new_node(&mut self, form: Form, kept: u64, written: u64) -> u32 {
        // The closure must also fit when it is written out.
        if !self.work.keep(kept + size_of::<Node>() as u64) || !self.work.holds(written) {
            return 0;
        }
        self.closures.nodes.push(Node { form, written });
        self.closures.nodes.len() as u32
    }

    /// Adds the components of a closure to columns that outlast the batch.
    fn write_out(&self, closure: u32, to: &mut Columns) -> List {
        let mut rows: SmallVec<[(u32, [f32; 3], u32); 8]> = SmallVec::new();
        self.closures.each(closure, |kind, weight, start| rows.push((kind, weight, start)));
        let mut words: SmallVec<[u32; 32]> = SmallVec::new();
        for (kind, _, start) in &mut rows {
            let Some(ClosureKind { shapes, .. }) = self.program.closures.get(*kind as usize) else {
                continue;
            };
            let mut own = self.closures.words.get(*start as usize..).unwrap_or_default();
            words.clear();
            for shape in shapes {
                let count = shape.count as usize * shape.kind.words() as usize;
                let (here, rest) = own.split_at(count.min(own.len()));
                own = rest;
                match shape.kind {
                    Kind::Str => words.extend(here.iter().map(|number| to.text(self.text(*number)))),
                    Kind::Closure => words
                        .extend(here.iter().flat_map(|number| <[u32; 2]>::from(self.write_out(*number, to)))),
                    _ => words.extend_from_slice(here),
                }
            }
            *start = to.params(&words);
        }
        to.list(&rows)
    }

    /// Adds a point with a closure to columns. Returns the bytes that it takes there.
    pub(crate) fn keep_closure(&self, closure: u32, to: &mut Columns) -> u64 {
        let before = to.bytes();
        let list = self.write_out(closure, to);
        to.point(list);
        to.bytes() - before
    }

    /// Writes the weights of a closure output at the first `count` lanes, summed by name: for each name three
    /// arrays of words; zeros if there are no names.
    pub(crate) fn weights(&self, (output, element): (usize, usize), count: usize, out: &mut Vec<u32>) {
        let Some(plan) = self.program.outputs.get(output) else { return };
        let names = plan.names.len().max(1);
        out.clear();
        out.resize(names * 3 * count, 0);
        let mut sums = vec![[0.0_f32; 3]; names];
        let lanes = self.output_lanes(plan.source, element, 0);
        for lane in 0..count {
            let closure = match lanes {
                Arg::Same(word) => word[0],
                Arg::Each(lanes) => lanes[lane],
            };
            if closure.bits() == 0 {
                continue;
            }
            sums.fill([0.0; 3]);
            self.closures.each(closure.bits(), |kind, weight, _| {
                let at = plan.name_of.get(kind as usize).and_then(|name| sums.get_mut(*name as usize));
                at.into_iter().flatten().zip(weight).for_each(|(sum, x)| *sum += x);
            });
            let planes = out.chunks_mut(count).filter_map(|plane| plane.get_mut(lane));
            for (to, x) in planes.zip(sums.iter().flatten()) {
                *to = if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
            }
        }
    }

    /// Charges for writing out a closure. Returns whether the point can afford it.
    fn pay_closure(&mut self, closure: u32) -> bool {
        self.work.pay(self.closures.written(closure) / BYTES_A_STEP);
        self.work.affords(0)
    }

    pub(super) fn component_of(&mut self, name: &Arc<str>, shapes: &[Shape], step: &KernelStep, mask: &Mask) {
        let [out] = &step.outs[..] else { return };
        let is_own = |kind: &ClosureKind| kind.name == *name && kind.shapes == shapes;
        let Some(kind) = self.program.closures.iter().position(is_own) else { return };
        let values: u64 = step.args.iter().filter(|arg| arg.kind != Kind::Closure).count() as u64;
        let lanes = self.lanes(&step.outs, mask);
        let each: usize = shapes.iter().map(|s| s.kind.words() as usize * s.count as usize).sum();
        let start = self.closures.words.len();
        let end = start.saturating_add(each.saturating_mul(lanes.len()));
        if u32::try_from(end).is_err() || !self.work.holds((end - start) as u64 * size_of::<u32>() as u64) {
            self.work.keep(u64::MAX);
            return;
        }
        self.push_words(&step.args, each, &lanes);
        for (at, lane) in lanes.into_iter().enumerate() {
            let mut nested = 0;
            for arg in step.args.iter().filter(|arg| arg.kind == Kind::Closure) {
                let closure = self.bits(*arg, lane);
                nested += self.closures.written(closure);
                if !self.pay_closure(closure) {
                    return;
                }
            }
            let own = (each * size_of::<u32>()) as u64;
            let component = NODE_BYTES + PARAM_BYTES * (shapes.len() as u64 + values) + nested;
            self.work.pay(component / BYTES_A_STEP);
            // What is nested is charged again at each level, which bounds the levels.
            let form = Form::Component(kind as u32, (start + each * at) as u32);
            let number =
                self.new_node(form, own.saturating_add(nested), component.saturating_add(NODE_BYTES));
            self.set_bits(*out, lane, number);
            if !self.work.close() {
                return;
            }
        }
    }

    /// Adds the words of some values to the parameters: `each` for every lane.
    fn push_words(&mut self, args: &[Operand], each: usize, lanes: &[usize]) {
        let mut words = std::mem::take(&mut self.closures.words);
        let start = words.len();
        words.resize(start + each * lanes.len(), 0);
        let components =
            |arg: &Operand| (0..arg.words as usize).map(|c| self.part(*arg, c)).collect::<Vec<_>>();
        for (at, part) in args.iter().flat_map(components).take(each).enumerate() {
            let bits = |word: A::Word| match part.kind {
                Kind::Float => A::single(word).to_bits(),
                _ => word.bits(),
            };
            let own = words[start + at..].iter_mut().step_by(each.max(1)).zip(lanes);
            match self.arg(part) {
                Arg::Same(word) => own.for_each(|(to, _)| *to = bits(word[0])),
                Arg::Each(from) => own.for_each(|(to, lane)| *to = bits(from[*lane])),
            }
        }
        self.closures.words = words;
    }

    pub(super) fn closure_sum(&mut self, step: &KernelStep, mask: &Mask) {
        let ([a, b], [out]) = (&step.args[..], &step.outs[..]) else { return };
        for lane in self.lanes(&step.outs, mask) {
            let number = match (self.bits(*a, lane), self.bits(*b, lane)) {
                (0, other) | (other, 0) => other,
                (a, b) => {
                    let written = self.closures.written(a).saturating_add(self.closures.written(b));
                    self.new_node(Form::Sum(a, b), 0, written.saturating_add(NODE_BYTES))
                }
            };
            self.set_bits(*out, lane, number);
            if !self.work.goes_on() {
                return;
            }
        }
    }

    pub(super) fn closure_scale(&mut self, step: &KernelStep, mask: &Mask) {
        let ([of, by], [out]) = (&step.args[..], &step.outs[..]) else { return };
        let lanes = self.lanes(&step.outs, mask);
        let factors: Vec<Vec<f32>> =
            (0..by.words as usize).map(|c| self.singles_at(self.part(*by, c), &lanes)).collect();
        for (at, lane) in lanes.into_iter().enumerate() {
            let factor = |c: usize| factors.get(c).or(factors.first()).and_then(|all| all.get(at)).copied();
            let by: [f32; 3] = std::array::from_fn(|c| factor(c).unwrap_or_default());
            let number = match self.bits(*of, lane) {
                _ if by == [0.0; 3] => 0,
                0 => 0,
                of if by == [1.0; 3] => of,
                of => {
                    let written = self.closures.written(of).saturating_add(NODE_BYTES);
                    self.new_node(Form::Scale(of, by), 0, written)
                }
            };
            self.set_bits(*out, lane, number);
            if !self.work.goes_on() {
                return;
            }
        }
    }

    /// A closure as text for `printf`.
    pub(super) fn closure_text(&mut self, closure: u32) -> String {
        // Converting numbers to text takes twice as long as copying them.
        if !self.pay_closure(closure) || !self.pay_closure(closure) {
            return String::new();
        }
        let mut columns = Columns::new(self.program.closures.clone());
        let list = self.write_out(closure, &mut columns);
        columns.components(list).iter().map(show).collect::<Vec<_>>().join("\n\t+ ")
    }
}
