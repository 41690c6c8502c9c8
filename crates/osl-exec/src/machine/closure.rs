//! Closures at run time: a tree for each value, in an arena that lasts as long as the batch.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::step::KernelStep;
use osl_ir::ir::{Const, Kind, Shape};
use osl_ir::text::{self, Flavour, Value};
use smallvec::SmallVec;
use std::sync::Arc;

/// A component of a closure: a way to scatter or emit light, with its weight.
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// Red, green and blue factors.
    pub weight: [f32; 3],
    /// Name of the closure.
    pub name: Arc<str>,
    /// Its parameters in order. Copies of a component share them.
    pub params: Arc<[Param]>,
}

/// A parameter of a component.
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    /// The name of a keyword argument.
    pub key: Option<Arc<str>>,
    /// One value, or the elements of an array.
    pub values: SmallVec<[Const; 1]>,
    /// The components, if it is a closure.
    pub closure: Vec<Component>,
}

#[derive(Debug)]
enum Form {
    Component(Component),
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
}

/// Bytes charged for a node or a component, besides the contents of its parameters.
const NODE_BYTES: u64 = 512;
/// Bytes charged for a parameter, and for a value of it.
const PARAM_BYTES: u64 = 64;
/// Bytes of a closure that are processed in one step.
const BYTES_A_STEP: u64 = 16;

impl Component {
    /// Its approximate size in bytes, including the contents of its parameters: the same on every machine.
    fn bytes(&self) -> u64 {
        let of_param = |param: &Param| {
            let values = param.values.len() as u64 * PARAM_BYTES;
            PARAM_BYTES + values + param.closure.iter().map(Component::bytes).sum::<u64>()
        };
        NODE_BYTES + self.params.iter().map(of_param).sum::<u64>()
    }
}

impl Closures {
    pub(super) fn clear(&mut self) {
        self.nodes.clear();
    }

    fn node(&self, closure: u32) -> Option<&Node> {
        self.nodes.get(closure.checked_sub(1)? as usize)
    }

    fn written(&self, closure: u32) -> u64 {
        self.node(closure).map_or(0, |node| node.written)
    }

    /// The components in the order of the sums, with weights multiplied out.
    fn components(&self, closure: u32) -> Vec<Component> {
        let mut found = Vec::new();
        let mut open: SmallVec<[(u32, [f32; 3]); 8]> = SmallVec::new();
        open.push((closure, [1.0; 3]));
        while let Some((closure, weight)) = open.pop() {
            let Some(node) = self.node(closure) else { continue };
            match &node.form {
                Form::Component(component) => found.push(Component { weight, ..component.clone() }),
                Form::Sum(a, b) => open.extend([(*b, weight), (*a, weight)]),
                Form::Scale(of, by) => open.push((*of, std::array::from_fn(|c| weight[c] * by[c]))),
            }
        }
        found
    }
}

impl<A: ArithmeticImpl> Machine<'_, A> {
    fn new_node(&mut self, form: Form) -> u32 {
        let (written, kept) = match &form {
            Form::Component(component) => (component.bytes(), component.bytes()),
            Form::Sum(a, b) => (self.closures.written(*a).saturating_add(self.closures.written(*b)), 0),
            Form::Scale(of, _) => (self.closures.written(*of), 0),
        };
        let written = written.saturating_add(NODE_BYTES);
        self.work.pay(kept / BYTES_A_STEP);
        // The closure must also fit when it is written out.
        if !self.work.keep(kept + NODE_BYTES) || !self.work.holds(written) {
            return 0;
        }
        self.closures.nodes.push(Node { form, written });
        self.closures.nodes.len() as u32
    }

    /// The components of a closure value, for the caller of the run, and their size in bytes.
    pub(crate) fn components(&self, closure: u32) -> (Vec<Component>, u64) {
        let found = self.closures.components(closure);
        let bytes = found.iter().map(Component::bytes).sum();
        (found, bytes)
    }

    /// Charges for writing out a closure. Returns whether the point can afford it.
    fn pay_closure(&mut self, closure: u32) -> bool {
        self.work.pay(self.closures.written(closure) / BYTES_A_STEP);
        self.work.affords(0)
    }

    pub(super) fn component_of(&mut self, name: &Arc<str>, shapes: &[Shape], step: &KernelStep, mask: &Mask) {
        let [out] = &step.outs[..] else { return };
        for lane in self.lanes(&step.outs, mask) {
            for arg in step.args.iter().filter(|arg| arg.kind == Kind::Closure) {
                if !self.pay_closure(self.bits(*arg, lane)) {
                    return;
                }
            }
            let mut args = &step.args[..];
            let param = |shape: &Shape| {
                let (own, rest) = args.split_at(args.len().min(shape.count as usize));
                args = rest;
                let (values, closures) =
                    if shape.kind == Kind::Closure { (&[][..], own) } else { (own, &[][..]) };
                Param {
                    key: shape.key.clone(),
                    values: values.iter().map(|a| self.value(*a, shape.kind, lane)).collect(),
                    closure: closures
                        .iter()
                        .flat_map(|a| self.closures.components(self.bits(*a, lane)))
                        .collect(),
                }
            };
            let params = shapes.iter().map(param).collect();
            let form = Form::Component(Component { weight: [1.0; 3], name: name.clone(), params });
            let number = self.new_node(form);
            self.set_bits(*out, lane, number);
            if !self.work.close() {
                return;
            }
        }
    }

    pub(super) fn closure_sum(&mut self, step: &KernelStep, mask: &Mask) {
        let ([a, b], [out]) = (&step.args[..], &step.outs[..]) else { return };
        for lane in self.lanes(&step.outs, mask) {
            let number = match (self.bits(*a, lane), self.bits(*b, lane)) {
                (0, other) | (other, 0) => other,
                (a, b) => self.new_node(Form::Sum(a, b)),
            };
            self.set_bits(*out, lane, number);
            if !self.work.goes_on() {
                return;
            }
        }
    }

    pub(super) fn closure_scale(&mut self, step: &KernelStep, mask: &Mask) {
        let ([of, by], [out]) = (&step.args[..], &step.outs[..]) else { return };
        for lane in self.lanes(&step.outs, mask) {
            let by: [f32; 3] = std::array::from_fn(|c| {
                let c = if by.words == 1 { 0 } else { c };
                self.single(self.part(*by, c), lane)
            });
            let number = match self.bits(*of, lane) {
                _ if by == [0.0; 3] => 0,
                0 => 0,
                of if by == [1.0; 3] => of,
                of => self.new_node(Form::Scale(of, by)),
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
        self.closures.components(closure).iter().map(show).collect::<Vec<_>>().join("\n\t+ ")
    }
}

/// `(r, g, b) * name (parameters)`.
pub fn show(component: &Component) -> String {
    let [r, g, b] = component.weight.map(number);
    let mut parts: Vec<String> = Vec::new();
    for param in component.params.iter() {
        parts.extend(param.key.iter().map(|key| format!("\"{key}\"")));
        let values: Vec<String> = param.values.iter().map(constant).collect();
        match &values[..] {
            [] | [_] => parts.extend(values),
            several => parts.push(format!("[{}]", several.join(", "))),
        }
        if !param.closure.is_empty() {
            parts.push(param.closure.iter().map(show).collect::<Vec<_>>().join(" + "));
        }
    }
    format!("({r}, {g}, {b}) * {} ({})", component.name, parts.join(", "))
}

fn number(x: f32) -> String {
    text::format("%g", &[Value::Consts(vec![Const::Float(x)])], Flavour::Print, 64)
}

fn constant(value: &Const) -> String {
    let list = |all: &[f32]| format!("({})", all.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", "));
    match value {
        Const::Int(n) => n.to_string(),
        Const::Float(x) => number(*x),
        Const::Triple(t) => list(t),
        Const::Matrix(m) => list(&m[..]),
        Const::Str(s) => format!("\"{s}\""),
        Const::Null => String::new(),
    }
}
