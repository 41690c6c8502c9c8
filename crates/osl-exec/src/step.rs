//! The parts of a program: locations of values, steps, and outputs.

use crate::arithmetic::ArithmeticImpl;
use osl_ir::Span;
use osl_ir::ir::{Const, Kernel, Kind, LaneOp, MAX_ARGS};
use osl_ir::types::Type;
use osl_lanes::Word;
use std::sync::Arc;

/// The location of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Location {
    /// A lane register, from this component on; and the words of its cells, if it has a value for each cell.
    Lanes { reg: u32, component: u32, cells: Option<CellLocation> },
    /// Words of the uniform file, from this one on.
    Words(u32),
}

/// The location of a value's words for each cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct CellLocation {
    /// The group of cells.
    pub(crate) group: u16,
    /// The register with a word for each cell. If points read it, it is not reused for another value.
    pub(crate) reg: u32,
}

/// A value: its location, its number of words (per lane), and their kind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Operand {
    pub(crate) location: Location,
    pub(crate) words: u32,
    pub(crate) kind: Kind,
}

/// Storage of an array.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Array {
    pub(crate) words: u32,
    pub(crate) len: u32,
    pub(crate) varying: bool,
}

/// Steps in order, with the mark of each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Steps {
    pub(crate) list: Vec<Step>,
    /// Index into the marks of the program.
    pub(crate) marks: Vec<u32>,
    /// Their cost against the budget of a batch, without nested steps.
    pub(crate) weight: u64,
}

/// The origin of a step, for profiles.
#[derive(Clone, Debug)]
pub(crate) struct Mark {
    pub(crate) name: String,
    pub(crate) span: Span,
    /// The mark of the step around it.
    pub(crate) around: Option<u32>,
}

/// One step of the interpreter. Branches and loops have a number each, their region.
#[derive(Clone, Debug)]
pub(crate) enum Step {
    Lane(LaneStep),
    Kernel(Box<KernelStep>),
    Load(LoadStep),
    Store(StoreStep),
    If {
        region: u32,
        cond: Operand,
        then: Steps,
        otherwise: Steps,
        results: Vec<[Operand; 3]>,
        /// As in [`LaneStep`], if everything in it lasts too.
        lasting: u32,
    },
    Loop {
        region: u32,
        params: Vec<LoopParam>,
        body: Steps,
        cond: Operand,
        span: Span,
    },
    /// Finds the cells of a group: points at which all of `roots` are equal. Points read the outs numbered in
    /// `exports`.
    FindCells {
        group: u16,
        roots: Vec<Operand>,
        outs: Vec<Operand>,
        exports: Vec<usize>,
    },
    /// Runs steps once for each cell of a group, if it has few. Points read the values in `exports`.
    PerCell {
        group: u16,
        steps: Steps,
        exports: Vec<Export>,
        /// What the values depend on, if they are the same in the next batch unless that changes.
        inputs: Option<CellInputs>,
    },
}

/// A step that runs a lane operation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LaneStep {
    pub(crate) op: LaneOp,
    /// Its arguments: the first `count` of these.
    args: [Operand; MAX_ARGS],
    count: u8,
    /// Number of executions: one, or one for each component of a triple.
    pub(crate) parts: u8,
    pub(crate) out: Operand,
    /// The position of its instruction in the program, and the last position at which its result is read.
    pub(crate) life: (u32, u32),
    /// Its number among the steps whose result is the same in every batch; `NEVER` if it is another.
    pub(crate) lasting: u32,
}

/// The number of a step whose result differs from batch to batch.
pub(crate) const NEVER: u32 = u32::MAX;

/// A step that reads an element of an array.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoadStep {
    pub(crate) array: u32,
    pub(crate) index: Operand,
    pub(crate) out: Operand,
    /// As in [`LaneStep`].
    pub(crate) life: (u32, u32),
}

/// A step that writes an element of an array.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StoreStep {
    pub(crate) array: u32,
    pub(crate) index: Operand,
    pub(crate) value: Operand,
    /// The position of its instruction in the program.
    pub(crate) at: u32,
}

/// What some values of cells depend on, in addition to the roots of the group.
#[derive(Clone, Debug)]
pub(crate) struct CellInputs {
    /// The number of the step.
    pub(crate) number: u32,
    /// Words of the uniform file that are not constants.
    pub(crate) words: Vec<u32>,
}

/// A value of cells that points read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Export {
    pub(crate) value: Operand,
    /// The last position at which it is read.
    pub(crate) last: u32,
}

impl LaneStep {
    pub(crate) fn new(op: LaneOp, list: &[Operand], out: Operand, life: (u32, u32)) -> LaneStep {
        let mut args = [out; MAX_ARGS];
        args.iter_mut().zip(list).for_each(|(to, from)| *to = *from);
        let parts = out.words / op.shape().result.words().max(1);
        LaneStep {
            op,
            args,
            count: list.len().min(MAX_ARGS) as u8,
            parts: parts as u8,
            out,
            life,
            lasting: NEVER,
        }
    }

    /// The same, with its number among the steps whose result is the same in every batch.
    pub(crate) fn lasting(self, lasting: u32) -> LaneStep {
        LaneStep { lasting, ..self }
    }

    /// Its arguments.
    pub(crate) fn args(&self) -> &[Operand] {
        &self.args[..usize::from(self.count)]
    }
}

/// A step that runs a kernel.
#[derive(Clone, Debug)]
pub(crate) struct KernelStep {
    pub(crate) kernel: Kernel,
    pub(crate) args: Vec<Operand>,
    /// Kinds of the arguments.
    pub(crate) kinds: Vec<Kind>,
    pub(crate) outs: Vec<Operand>,
    pub(crate) span: Span,
    /// As in [`LaneStep`].
    pub(crate) lasting: u32,
}

/// A value that a loop carries.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoopParam {
    pub(crate) init: Operand,
    pub(crate) param: Operand,
    pub(crate) next: Operand,
    pub(crate) result: Operand,
    /// Whether anything after the loop reads the result.
    pub(crate) is_read: bool,
}

/// An output of the program.
#[derive(Clone, Debug)]
pub(crate) struct OutputPlan {
    pub(crate) name: Arc<str>,
    pub(crate) ty: Type,
    pub(crate) kind: Kind,
    pub(crate) source: OutputSource,
    /// The names of the components that it may have, if it is a closure; and the index of the name of each
    /// kind of component.
    pub(crate) names: Vec<Arc<str>>,
    pub(crate) name_of: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum OutputSource {
    Value(Operand),
    Array(u32),
}

/// A word of the uniform file before a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Seed {
    /// An int, or the number of a string.
    Bits(u32),
    /// A float.
    Float(f32),
    /// 0, until a step writes it.
    Computed,
}

impl Seed {
    /// The words of a constant. `number` gives a string its number.
    pub(crate) fn of(value: &Const, number: impl FnOnce(&Arc<str>) -> u32) -> Vec<Seed> {
        match value {
            Const::Int(n) => vec![Seed::Bits(*n as u32)],
            Const::Float(x) => vec![Seed::Float(*x)],
            Const::Triple(t) => t.iter().map(|x| Seed::Float(*x)).collect(),
            Const::Matrix(m) => m.iter().map(|x| Seed::Float(*x)).collect(),
            Const::Str(s) => vec![Seed::Bits(number(s))],
            Const::Null => vec![Seed::Bits(0)],
        }
    }

    /// The word in an arithmetic.
    pub(crate) fn word<A: ArithmeticImpl>(self) -> A::Word {
        match self {
            Seed::Bits(bits) => A::Word::of(bits),
            Seed::Float(x) => A::of(x),
            Seed::Computed => A::Word::of(0),
        }
    }
}
