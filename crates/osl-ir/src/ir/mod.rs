//! The typed IR: structured control flow, values in SSA form, every instruction with its span.
//!
//! A [`Body`] holds values, blocks and slots in arenas. Blocks nest in [`Op::If`] and [`Op::Loop`]; there is
//! no goto, no call (functions are inlined) and no struct (structs are split into parts). Lowering writes
//! scalar variables as slots; the `ssa` pass turns those into values, so that later only arrays are slots.
//!
//! Inactive lanes: an instruction without effect may compute anything for a point that does not execute it,
//! because the result is not read there. Only `Store…`, and the choice between the sides of an `If` or the
//! iterations of a `Loop`, depend on which points are active.

mod build;
mod kernel;
mod message;
mod print;
pub mod read;
mod text_fn;
pub mod validate;

pub use build::Builder;
pub use build::Excess;
pub use kernel::{
    GaborOption, Kernel, MessageForm, NoiseField, Note, Shape, Sink, Test, TextureOption, UNSET_TEXT,
    USER_DATA, note_names, note_text,
};
pub use message::{First, Message, MessageMade, other_type, set_late, set_twice};
pub use osl_numeric::{
    Const, Continuity, Cost, Derivative, Domain, Kind, LaneOp, LaneShape, MAX_ARGS, Precision,
};
pub use print::print;
pub use text_fn::TextFn;

use crate::global::Global;
use osl_numeric::Arithmetic;
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

/// Whether the points of a batch share a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Rate {
    /// One value for the whole batch.
    Uniform,
    /// One value for all points in the same cell of the group's pattern, see [`Op::Share`].
    PerCell(u16),
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
    /// A live parameter, by its index in [`Body::inputs`]: uniform, and known only when the program runs. One
    /// result of its kind. No effect.
    Input(u32),
    /// The derivative of a shader global: its change from a pixel to its neighbour along an axis. One result
    /// of the global's kind. No effect.
    GlobalDeriv(Global, Axis),
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

/// A live parameter, or one element of one: its value is set before a run instead of being compiled in.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// `LAYER.PARAMETER`, or `LAYER.PARAMETER.FIELD`.
    pub name: Arc<str>,
    /// The element, if it is an array.
    pub element: Option<u32>,
    /// The value until another one is set; also determines the kind.
    pub value: Const,
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
    /// The live parameters.
    pub inputs: Vec<Input>,
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
    pub derivs: Vec<Global>,
    /// Whether rays may be traced. Otherwise no ray hits anything.
    pub traces: bool,
    /// The spaces whose matrices to and from common space are affine.
    pub affine: Vec<Arc<str>>,
    /// The arithmetic.
    pub arithmetic: Arithmetic,
}

impl Default for Assumptions {
    /// No assumptions about the points, and the strict arithmetic.
    fn default() -> Assumptions {
        Assumptions {
            varying: Global::ALL.to_vec(),
            derivs: Global::ALL.to_vec(),
            traces: true,
            affine: Vec::new(),
            arithmetic: Arithmetic::Strict,
        }
    }
}

impl Body {
    /// The layer of a source location, and its names.
    pub fn names(&self, span: Span) -> Option<(usize, &Names)> {
        names_at(&self.layers, span)
    }

    /// The values that are constants.
    pub fn constants(&self) -> impl Iterator<Item = (ValueId, &Const)> {
        self.insts().filter_map(|inst| match (&inst.op, inst.results.first()) {
            (Op::Const(value), Some(result)) => Some((*result, value)),
            _ => None,
        })
    }

    /// A new value without a definition so far.
    pub fn fresh(&mut self, kind: Kind, span: Span) -> ValueId {
        self.values.push(Value { kind, rate: Rate::Varying, span });
        ValueId(self.values.len() as u32 - 1)
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
        self.insts().any(cheaper)
    }

    /// Whether there is an operation of which the fast arithmetic may give other bits. Otherwise the program
    /// is the same in both.
    pub fn differs_in_fast(&self) -> bool {
        let differs =
            |inst: &Inst| matches!(&inst.op, Op::Lane(op, _) if op.precision() != Precision::Strict);
        self.insts().any(differs)
    }

    /// The instructions of all blocks, also of those that are not reachable.
    pub fn insts(&self) -> impl Iterator<Item = &Inst> {
        self.blocks.iter().flat_map(|block| &block.insts)
    }

    /// The reachable instructions of a block in the order of the program, each before those of its blocks.
    pub fn insts_from(&self, block: BlockId) -> impl Iterator<Item = &Inst> {
        let mut open = vec![self.block(block).insts.iter()];
        std::iter::from_fn(move || {
            loop {
                let Some(inst) = open.last_mut()?.next() else {
                    open.pop();
                    continue;
                };
                let nested: Vec<BlockId> = inst.op.blocks().collect();
                open.extend(nested.into_iter().rev().map(|id| self.block(id).insts.iter()));
                return Some(inst);
            }
        })
    }

    /// Number of reachable instructions, including nested ones.
    pub fn count(&self) -> usize {
        self.insts_from(self.entry).count()
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
    /// The blocks of a branch or a loop, in the order of the program.
    pub fn blocks(&self) -> impl Iterator<Item = BlockId> + use<> {
        let blocks = match self {
            Op::If { then, otherwise, .. } => [Some(*then), Some(*otherwise)],
            Op::Loop { body, .. } => [Some(*body), None],
            _ => [None; 2],
        };
        blocks.into_iter().flatten()
    }

    /// Calls `visit` for each value that the operation reads, including the yields of its blocks.
    pub fn for_each_use(&self, mut visit: impl FnMut(ValueId)) {
        match self {
            Op::Const(_) | Op::Global(_) | Op::Input(_) | Op::GlobalDeriv(..) | Op::Load(_) => {}
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
            Op::Const(_) | Op::Global(_) | Op::Input(_) | Op::GlobalDeriv(..) | Op::Load(_) => {}
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
