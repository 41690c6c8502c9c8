//! What happens at one point: every instruction that runs, with the values that it takes and yields, in the strict
//! arithmetic and in double precision side by side.
//!
//! A follower walks the IR as it was lowered. Both arithmetics go the same way through the program until a condition
//! or an index differs; from there each goes its own way, and where the ways meet again their values stand side by side
//! as before. The bodies of operations are those of a run; what needs more than a lane's arithmetic is handed to the
//! interpreter, a batch of one point. This module must not know what is made of a trace.

mod exact;
mod follow;
mod kernel;
mod point;

pub use exact::{Exact, eval};
pub use follow::follow;
pub use kernel::noise;
pub use point::OnePoint;

use osl_ir::Span;
use osl_ir::hir::Global;
use osl_ir::ir::{Axis, Body, Const, Kernel, LaneOp};
use osl_ir::types::Type;
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
    /// How a global changes to the next pixel.
    Slope(Global, Axis),
    /// A lane operation.
    Lane(LaneOp),
    /// One result of a kernel, by its number.
    Kernel(Arc<Kernel>, usize),
    /// An element of an array: the index, then the element's value.
    Element,
    /// Where two ways meet, on each of which one of the arithmetics came: the condition that parted them if there was
    /// one, the strict value, the exact one.
    Meet,
    /// A note; it has no value.
    Note(Arc<Kernel>),
}

/// An instruction that ran.
#[derive(Clone, Debug)]
pub struct Node {
    /// What it is.
    pub what: What,
    /// The source that it comes from.
    pub span: Span,
    /// The nodes whose values it takes.
    pub args: Vec<NodeId>,
    /// Its value in the strict arithmetic; none where only the exact one came by.
    pub strict: Option<Const>,
    /// Its value in double precision; none where only the strict one came by.
    pub exact: Option<Exact>,
}

/// What happened at a point.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// What ran, in order: each behind what it takes.
    pub nodes: Vec<Node>,
    /// The outputs: name, type, and the nodes of the values (one, or one for each element of an array).
    pub outputs: Vec<(Arc<str>, Type, Vec<NodeId>)>,
    /// Whether it was cut off because it became too long.
    pub cut: bool,
}

impl Trace {
    /// A node; every number that a trace holds is one of its nodes.
    pub fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id as usize]
    }
}

/// The body that a trace follows: derivatives written out, all else as lowered.
pub fn prepare(mut body: Body, varying: &[Global], slopes: &[Global]) -> Body {
    use osl_ir::passes::{Options, Pass, run};
    let without = Pass::ALL.into_iter().filter(|p| !matches!(p, Pass::Ssa | Pass::Derive | Pass::Rate));
    let options = Options {
        outputs: None,
        varying: varying.to_vec(),
        slopes: slopes.to_vec(),
        without: without.collect(),
        ..Options::default()
    };
    run(&mut body, &options);
    body
}
