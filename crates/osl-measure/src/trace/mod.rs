//! What happens at one point: every executed instruction with its arguments and results, in strict arithmetic
//! and in double precision side by side.
//!
//! A follower walks the lowered IR. Both arithmetics take the same path through the program until a condition
//! or an index differs. From there each takes its own path; where the paths join, their values stand side by
//! side again. Operations use the same bodies as a run. Calls that need more than a lane's arithmetic go to
//! the interpreter, as a batch of one point.

mod exact;
mod follow;
mod kernel;
mod point;
mod random;

pub use exact::{Exact, eval};
pub use follow::{follow, follow_doubled, follow_rounded};
pub use kernel::noise;
pub(crate) use kernel::{NoiseCall, run_call};
pub use point::OnePoint;

use osl_ir::Span;
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Body, Const, Kernel, LaneOp, ValueId};
use osl_ir::types::Type;
use osl_limits::Limits;
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// Number of a node of a [`Trace`].
pub type NodeId = u32;

/// What a node is.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// A constant of the program.
    Const,
    /// A global of the point.
    Global(Global),
    /// The change of a global to the next pixel.
    GlobalDeriv(Global, Axis),
    /// A lane operation.
    Lane(LaneOp),
    /// One result of a kernel, by its number.
    Kernel(Arc<Kernel>, usize),
    /// An element of an array: the index, then the element's value.
    Element,
    /// The join of two paths, one for each arithmetic: the condition that separated them if there was one,
    /// the strict value, the exact value.
    Meet,
    /// A note, or a check of an index. Its value is 1 in the arithmetics that come by, and absent in the
    /// other one.
    Note(Arc<Kernel>),
}

/// An instruction that ran.
#[derive(Clone, Debug)]
pub struct Node {
    /// What it is.
    pub what: What,
    /// The source that it comes from.
    pub span: Span,
    /// The first result of the instruction in the followed body. Values that `prepare` added, such as
    /// derivatives, have higher numbers than those of the source.
    pub result: Option<ValueId>,
    /// The nodes whose values it takes.
    pub args: Vec<NodeId>,
    /// Its value in strict arithmetic; none if only the exact one reached it.
    pub strict: Option<Const>,
    /// Its value in double precision; none if only the strict one reached it.
    pub exact: Option<Exact>,
}

/// What happened at a point.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// The executed instructions in order: each after its arguments.
    pub nodes: Vec<Node>,
    /// The outputs: name, type, and the nodes of the values (one, or one for each element of an array).
    pub outputs: Vec<(Arc<str>, Type, Vec<NodeId>)>,
    /// The results of calls that reported an error or warning in strict arithmetic.
    pub reporting: FxHashSet<NodeId>,
    /// Whether the trace was cut off because it became too long.
    pub cut: bool,
}

impl Trace {
    /// A node; every id in a trace refers to one of its nodes.
    pub fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id as usize]
    }
}

/// The body that a trace follows: derivatives written out, everything else as lowered.
pub fn prepare(mut body: Body, varying: &[Global], derivs: &[Global], limits: &Limits) -> Body {
    use osl_ir::passes::{Options, Pass, run};
    let without = Pass::ALL.into_iter().filter(|p| !matches!(p, Pass::Ssa | Pass::Derive | Pass::Rate));
    let options = Options {
        outputs: None,
        varying: varying.to_vec(),
        derivs: derivs.to_vec(),
        without: without.collect(),
        limits: limits.clone(),
        ..Options::default()
    };
    run(&mut body, &options);
    body
}
