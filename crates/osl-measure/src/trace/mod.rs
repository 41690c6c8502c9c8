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
mod random;

pub use exact::{Exact, eval};
pub use follow::{Alone, follow, follow_alone};
pub use kernel::noise;
pub(crate) use kernel::{NoiseCall, run_call};

use osl_exec::{Datum, PointSource};
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

impl Node {
    /// The numbers of its value in strict arithmetic.
    pub fn numbers(&self) -> Vec<f64> {
        self.strict.as_ref().map_or_else(Vec::new, |value| Exact::widen(value).numbers())
    }
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

/// One point of a source of points.
#[derive(Clone, Copy)]
pub struct OnePoint<'a> {
    /// All points.
    pub source: &'a dyn PointSource,
    /// The index of the point, in the order in which the source fills.
    pub point: usize,
}

impl OnePoint<'_> {
    /// The index of the point at a column and row of an image of `width` by `height`; `None` if it is
    /// outside.
    pub fn at_pixel(
        source: &dyn PointSource,
        width: usize,
        height: usize,
        x: usize,
        y: usize,
    ) -> Option<usize> {
        if x >= width || y >= height {
            return None;
        }
        match source.blocks() {
            Some(blocks) => (0..source.count()).find(|point| blocks.pixel(*point) == (x, y)),
            None => Some(y * width + x),
        }
    }

    /// The value of a global; a scalar is in the first element.
    pub fn global(&self, global: Global) -> [f32; 3] {
        if !self.source.varying().contains(&global) {
            return self.source.uniform(global);
        }
        self.filled(global, |lanes| self.source.fill(global, self.point, 1, lanes))
    }

    /// How a global changes along an axis.
    pub fn deriv_of(&self, global: Global, axis: Axis) -> [f32; 3] {
        if !self.source.varying_derivs().contains(&global) {
            return self.source.deriv(global, axis);
        }
        self.filled(global, |lanes| self.source.fill_deriv(global, axis, self.point, 1, lanes))
    }

    fn filled(&self, global: Global, fill: impl FnOnce(&mut [f32])) -> [f32; 3] {
        let mut value = [0.0; 3];
        let scalar = matches!(
            global,
            Global::U
                | Global::V
                | Global::Time
                | Global::Dtime
                | Global::SurfaceArea
                | Global::Backfacing
                | Global::LeftHanded
        );
        fill(&mut value[..if scalar { 1 } else { 3 }]);
        value
    }
}

impl PointSource for OnePoint<'_> {
    fn count(&self) -> usize {
        1
    }

    fn varying(&self) -> &[Global] {
        &[]
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        self.global(global)
    }

    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        self.deriv_of(global, axis)
    }

    fn fill(&self, global: Global, _: usize, width: usize, lanes: &mut [f32]) {
        let value = self.global(global);
        lanes.chunks_mut(width.max(1)).zip(value).for_each(|(lanes, x)| lanes.fill(x));
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, _: usize) -> Option<Datum> {
        self.source.attribute(object, name, element, self.point)
    }
}
