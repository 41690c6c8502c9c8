//! The typed IR: structured control flow, values in SSA form, every instruction with its span.
//!
//! A [`Body`] holds values, blocks and slots in arenas. Blocks nest in [`Op::If`] and [`Op::Loop`]; there is
//! no goto, no call (functions are inlined) and no struct (structs are split into parts). Lowering writes
//! scalar variables as slots; the `ssa` pass turns those into values, so that later only arrays are slots.
//! The IR must not know lanes, masks or registers.
//!
//! Inactive lanes: an instruction without effect may compute anything for a point that does not execute it,
//! because the result is not read there. Only `Store…`, and the choice between the sides of an `If` or the
//! iterations of a `Loop`, depend on which points are active.

mod build;
mod kernel;
mod lane;
mod message;
mod print;
mod text_fn;
pub mod validate;

pub use build::Builder;
pub(crate) use build::Excess;
pub use kernel::{
    GaborOption, Kernel, MessageForm, NoiseField, Note, Shape, Sink, TextureOption, UNSET_TEXT,
};
pub use lane::{Continuity, Cost, Derivative, LaneOp, LaneShape, MAX_ARGS, Precision};
pub(crate) use message::{First, Message};
pub use print::print;
pub use text_fn::TextFn;

use crate::global::Global;
use crate::numeric::Arithmetic;
use osl_syntax::span::Span;
use smallvec::SmallVec;
use std::sync::Arc;

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident = $letter:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub u32);
        impl std::fmt::Debug for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, concat!($letter, "{}"), self.0)
            }
        }
        impl $name {
            /// The index as a `usize`.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

ids! {
    /// A value of a [`Body`]; prints as `v7`.
    ValueId = "v";
    /// A block of a [`Body`]; prints as `b2`.
    BlockId = "b";
    /// A slot of a [`Body`]; prints as `s3`.
    SlotId = "s";
}

/// The kind of a value, for storage and arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// 32-bit integer; truth values are 0 and 1.
    Int,
    /// Number of the arithmetic in use.
    Float,
    /// Three floats.
    Triple,
    /// Sixteen floats, row by row.
    Matrix,
    /// String.
    Str,
    /// Closure.
    Closure,
}

impl Kind {
    /// 32-bit words of a value.
    pub fn words(self) -> u32 {
        match self {
            Kind::Int | Kind::Float | Kind::Str | Kind::Closure => 1,
            Kind::Triple => 3,
            Kind::Matrix => 16,
        }
    }
}

/// Whether the points of a batch share a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Rate {
    /// One value for the whole batch.
    Uniform,
    /// One value for all points in the same cell of the group's pattern, see [`Op::Share`].
    Shared(u16),
    /// A separate value for each point.
    Varying,
}

/// A value: defined once, by an instruction or as a loop's parameter.
#[derive(Clone, Debug)]
pub struct Value {
    /// Its kind.
    pub kind: Kind,
    /// Set by the `rate` pass; varying until then.
    pub rate: Rate,
    /// The source location that it comes from.
    pub span: Span,
}

/// The values of an instruction, in order. Most instructions have one to four, which need no allocation.
pub type Values = SmallVec<[ValueId; 4]>;

/// A constant.
#[derive(Clone, Debug, PartialEq)]
pub enum Const {
    /// An int.
    Int(i32),
    /// A float.
    Float(f32),
    /// Three floats.
    Triple([f32; 3]),
    /// Sixteen floats, row by row.
    Matrix(Box<[f32; 16]>),
    /// A string.
    Str(Arc<str>),
    /// The null closure.
    Null,
}

impl Const {
    /// Its kind.
    pub fn kind(&self) -> Kind {
        match self {
            Const::Int(_) => Kind::Int,
            Const::Float(_) => Kind::Float,
            Const::Triple(_) => Kind::Triple,
            Const::Matrix(_) => Kind::Matrix,
            Const::Str(_) => Kind::Str,
            Const::Null => Kind::Closure,
        }
    }

    /// Zero, empty or null, by kind.
    pub fn zero(kind: Kind) -> Const {
        match kind {
            Kind::Int => Const::Int(0),
            Kind::Float => Const::Float(0.0),
            Kind::Triple => Const::Triple([0.0; 3]),
            Kind::Matrix => Const::Matrix(Box::new([0.0; 16])),
            Kind::Str => Const::Str("".into()),
            Kind::Closure => Const::Null,
        }
    }

    /// Whether the bits are equal: −0 and 0 differ, and a NaN equals itself.
    pub fn same_bits(&self, other: &Const) -> bool {
        let eq = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        match (self, other) {
            (Const::Float(a), Const::Float(b)) => a.to_bits() == b.to_bits(),
            (Const::Triple(a), Const::Triple(b)) => eq(a, b),
            (Const::Matrix(a), Const::Matrix(b)) => eq(&a[..], &b[..]),
            _ => self == other,
        }
    }
}

/// Storage for a variable: scalars until the `ssa` pass, arrays permanently.
#[derive(Clone, Debug)]
pub struct Slot {
    /// Kind of the value or of each element.
    pub kind: Kind,
    /// Number of elements; `None` for a scalar.
    pub len: Option<u32>,
    /// The variable's name, for printing.
    pub name: Arc<str>,
    /// Set by the `rate` pass; varying until then.
    pub rate: Rate,
}

/// An instruction.
#[derive(Clone, Debug)]
pub struct Inst {
    /// The operation.
    pub op: Op,
    /// The values that it defines.
    pub results: Values,
    /// The source location that it comes from.
    pub span: Span,
}

/// The operation of an instruction.
#[derive(Clone, Debug)]
pub enum Op {
    /// A constant. One result of its kind. No effect.
    Const(Const),
    /// A shader global of the point. One result. No effect.
    Global(Global),
    /// The derivative of a shader global: its change from a pixel to its neighbour along an axis. One result
    /// of the global's kind. No effect.
    Slope(Global, Axis),
    /// The derivative of a value: its change from a pixel to its neighbour along an axis. One result of the
    /// value's kind. The `derive` pass replaces it. No effect.
    Derivative(ValueId, Axis),
    /// A function of one lane, see [`LaneOp`]. One result. No effect.
    Lane(LaneOp, Values),
    /// A function that needs more than the arithmetic of one lane, see [`Kernel`]. Effects: the kernel's.
    Kernel(Kernel, Values),
    /// Values that points share. Points at which all of the values are equal, bit by bit, are in the same
    /// cell of this group. One result for each value. No effect.
    Share(u16, Values),
    /// Reads a scalar slot.
    Load(SlotId),
    /// Writes a scalar slot at the active points.
    Store(SlotId, ValueId),
    /// Reads an array element. The index is an int within the array: lowering clamps it.
    LoadElement(SlotId, ValueId),
    /// Writes an array element at the active points.
    StoreElement(SlotId, ValueId, ValueId),
    /// Each point takes its results from the side that it executes; a side without active points is skipped.
    /// `cond` is an int; 0 is false.
    If {
        /// The condition.
        cond: ValueId,
        /// Executed where it is true.
        then: BlockId,
        /// Executed where it is false.
        otherwise: BlockId,
        /// The results' values from `then`.
        then_yields: Values,
        /// The results' values from `otherwise`.
        else_yields: Values,
    },
    /// Executes the body at least once; a point stops after the iteration in which `cond` was 0. The results
    /// are its `next` values of that iteration.
    Loop {
        /// Values of the parameters in the first iteration.
        init: Values,
        /// Parameters: values defined by the loop for its body.
        params: Values,
        /// The body.
        body: BlockId,
        /// Whether to continue, computed in the body.
        cond: ValueId,
        /// Values of the parameters in the next iteration.
        next: Values,
    },
}

/// Directions on the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Axis {
    /// To the next pixel in the row.
    X,
    /// To the next row.
    Y,
}

impl Axis {
    /// Both axes.
    pub const BOTH: [Axis; 2] = [Axis::X, Axis::Y];
}

/// A block: instructions in order.
#[derive(Clone, Debug, Default)]
pub struct Block {
    /// The instructions.
    pub insts: Vec<Inst>,
}

/// Where the final value of an output is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A value.
    Value(ValueId),
    /// A slot: a scalar until the `ssa` pass, or an array.
    Slot(SlotId),
}

/// An output of the program: one scalar or array part of an output parameter.
#[derive(Clone, Debug)]
pub struct Output {
    /// `result`, or `s.a` for a field.
    pub name: Arc<str>,
    /// Its type in the language, for naming channels.
    pub ty: crate::types::Type,
    /// Where its value is.
    pub source: Source,
}

/// The names of a shader in the run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Names {
    /// The shader's own.
    pub shader: Arc<str>,
    /// That of its layer.
    pub layer: Arc<str>,
    /// That of the group.
    pub group: Arc<str>,
}

/// A program.
#[derive(Clone, Debug)]
pub struct Body {
    /// Name of the shader.
    pub name: Arc<str>,
    /// Values.
    pub values: Vec<Value>,
    /// Blocks.
    pub blocks: Vec<Block>,
    /// Slots.
    pub slots: Vec<Slot>,
    /// The first block.
    pub entry: BlockId,
    /// The outputs.
    pub outputs: Vec<Output>,
    /// The layers from which it was made, each with the start of its source: see [`Body::names`].
    pub layers: Vec<(u32, Names)>,
    /// The assumptions of the passes.
    pub assumptions: Assumptions,
}

/// What a body was compiled for: the assumptions of the passes about the points, and about the arithmetic of
/// a run. If they do not hold, the values are wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assumptions {
    /// The globals that may differ from point to point. The others are uniform.
    pub varying: Vec<Global>,
    /// The globals whose derivatives may differ from point to point.
    pub slopes: Vec<Global>,
    /// Whether rays may be traced. Otherwise no ray hits anything.
    pub traces: bool,
    /// The arithmetic.
    pub arithmetic: Arithmetic,
}

impl Default for Assumptions {
    /// No assumptions about the points, and the strict arithmetic.
    fn default() -> Assumptions {
        Assumptions {
            varying: Global::ALL.to_vec(),
            slopes: Global::ALL.to_vec(),
            traces: true,
            arithmetic: Arithmetic::Strict,
        }
    }
}

impl Body {
    /// The layer of a source location, and its names.
    pub fn names(&self, span: Span) -> Option<(usize, &Names)> {
        names_at(&self.layers, span)
    }

    /// The value with an id of this body.
    pub fn value(&self, id: ValueId) -> &Value {
        &self.values[id.index()]
    }

    /// The kind of a value.
    pub fn kind(&self, id: ValueId) -> Kind {
        self.value(id).kind
    }

    /// The block with an id of this body.
    pub fn block(&self, id: BlockId) -> &Block {
        &self.blocks[id.index()]
    }

    /// The slot with an id of this body.
    pub fn slot(&self, id: SlotId) -> &Slot {
        &self.slots[id.index()]
    }

    /// Whether there is an operation that the fast arithmetic computes by a cheaper formula.
    pub fn is_cheaper_in_fast(&self) -> bool {
        let cheaper = |inst: &Inst| matches!(&inst.op, Op::Lane(op, _) if op.is_approximated());
        self.blocks.iter().any(|block| block.insts.iter().any(cheaper))
    }

    /// Number of reachable instructions, including nested ones.
    pub fn count(&self) -> usize {
        self.count_block(self.entry)
    }

    fn count_block(&self, id: BlockId) -> usize {
        let nested = |inst: &Inst| match &inst.op {
            Op::If { then, otherwise, .. } => self.count_block(*then) + self.count_block(*otherwise),
            Op::Loop { body, .. } => self.count_block(*body),
            _ => 0,
        };
        self.block(id).insts.iter().map(|inst| 1 + nested(inst)).sum()
    }
}

/// The layer of a source location, among `layers` in the order of their sources.
pub fn names_at(layers: &[(u32, Names)], span: Span) -> Option<(usize, &Names)> {
    let index = layers.partition_point(|(base, _)| *base <= span.start).checked_sub(1)?;
    layers.get(index).map(|(_, names)| (index, names))
}

/// The operation that chooses one of two values of a kind.
pub(crate) fn choose_op(kind: Kind) -> LaneOp {
    match kind {
        Kind::Float | Kind::Triple => LaneOp::Choose,
        Kind::Int => LaneOp::IChoose,
        Kind::Closure => LaneOp::KChoose,
        Kind::Matrix => LaneOp::MChoose,
        Kind::Str => LaneOp::SChoose,
    }
}

/// Whether an operation chooses one of two values.
pub(crate) fn is_choice(op: LaneOp) -> bool {
    use LaneOp::{Choose, IChoose, KChoose, MChoose, SChoose};
    matches!(op, Choose | IChoose | KChoose | MChoose | SChoose)
}

impl Op {
    /// Calls `visit` for each value that the operation reads, including the yields of its blocks.
    pub fn for_each_use(&self, mut visit: impl FnMut(ValueId)) {
        match self {
            Op::Const(_) | Op::Global(_) | Op::Slope(..) | Op::Load(_) => {}
            Op::Lane(_, args) | Op::Kernel(_, args) | Op::Share(_, args) => {
                args.iter().copied().for_each(visit)
            }
            Op::Store(_, v) | Op::LoadElement(_, v) | Op::Derivative(v, _) => visit(*v),
            Op::StoreElement(_, i, v) => {
                visit(*i);
                visit(*v);
            }
            Op::If { cond, then_yields, else_yields, .. } => {
                visit(*cond);
                then_yields.iter().chain(else_yields).copied().for_each(visit);
            }
            Op::Loop { init, cond, next, .. } => {
                init.iter().copied().for_each(&mut visit);
                visit(*cond);
                next.iter().copied().for_each(visit);
            }
        }
    }

    /// Replaces each value that the operation reads.
    pub fn replace_uses(&mut self, mut with: impl FnMut(ValueId) -> ValueId) {
        let mut all = |list: &mut Values| list.iter_mut().for_each(|v| *v = with(*v));
        match self {
            Op::Const(_) | Op::Global(_) | Op::Slope(..) | Op::Load(_) => {}
            Op::Lane(_, args) | Op::Kernel(_, args) | Op::Share(_, args) => all(args),
            Op::Store(_, v) | Op::LoadElement(_, v) | Op::Derivative(v, _) => *v = with(*v),
            Op::StoreElement(_, i, v) => {
                *i = with(*i);
                *v = with(*v);
            }
            Op::If { cond, then_yields, else_yields, .. } => {
                all(then_yields);
                all(else_yields);
                *cond = with(*cond);
            }
            Op::Loop { init, cond, next, .. } => {
                all(init);
                all(next);
                *cond = with(*cond);
            }
        }
    }
}
