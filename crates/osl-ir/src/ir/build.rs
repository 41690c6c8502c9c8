//! Writes IR: the builder shared by lowering and the composed built-ins of the table.

use super::{
    Assumptions, Block, BlockId, Body, Const, Inst, Kernel, Kind, LaneOp, Op, Rate, Slot, SlotId, ValueId,
    Values,
};
use osl_limits::Compiling;
use osl_numeric::library_constants::LibraryConstant;
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;
use smallvec::smallvec;
use std::sync::Arc;

/// Appends instructions to the current block of a body.
#[derive(Debug)]
pub struct Builder {
    /// The body so far.
    pub body: Body,
    /// The block that receives the next instruction.
    pub current: BlockId,
    /// The source location of the next instruction.
    pub span: Span,
    /// Messages of the program, by name.
    pub messages: Vec<super::Message>,
    /// Whether messages are found by name at run time, since at least one name is not a literal.
    pub messages_by_name: bool,
    /// The index of each message in the list, since a program may have as many messages as statements.
    pub message_places: FxHashMap<Arc<str>, usize>,
    /// Whether to record what the source does.
    pub notes: bool,
    /// The number of notes so far.
    noted: u32,
    /// The limits on the size of the body.
    pub limits: Compiling,
    /// Words of the arrays so far.
    array_words: u64,
    /// Bytes of the names of variables so far.
    name_bytes: u64,
}

/// The limit that a body exceeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Excess {
    /// Values or variables.
    Size,
    /// Words of arrays.
    Arrays,
    /// Bytes of names.
    Names,
}

impl Builder {
    /// A builder of an empty body.
    pub fn new(name: Arc<str>) -> Builder {
        let body = Body {
            name,
            values: Vec::new(),
            blocks: vec![Block::default()],
            slots: Vec::new(),
            entry: BlockId(0),
            outputs: Vec::new(),
            layers: Vec::new(),
            inputs: Vec::new(),
            assumptions: Assumptions::default(),
        };
        Builder {
            body,
            current: BlockId(0),
            span: Span::default(),
            messages: Vec::new(),
            messages_by_name: false,
            message_places: FxHashMap::default(),
            notes: false,
            noted: 0,
            limits: Compiling::default(),
            array_words: 0,
            name_bytes: 0,
        }
    }

    /// The limit that the body exceeds, if any. Code that writes in proportion to a length of the input must
    /// check this now and then, and stop; lowering reports the error.
    pub fn excess(&self) -> Option<Excess> {
        let Compiling { values, variables, array_words, name_bytes, .. } = self.limits;
        if self.body.values.len() as u64 > values || self.body.slots.len() as u64 > variables {
            return Some(Excess::Size);
        }
        if self.array_words > array_words {
            return Some(Excess::Arrays);
        }
        (self.name_bytes > name_bytes).then_some(Excess::Names)
    }

    /// Number of values that the program may still have.
    pub fn values_left(&self) -> u64 {
        self.limits.values.saturating_sub(self.body.values.len() as u64)
    }

    /// A new value without a definition so far.
    pub fn fresh(&mut self, kind: Kind) -> ValueId {
        self.body.fresh(kind, self.span)
    }

    /// A new scalar slot, or an array.
    pub fn slot(&mut self, kind: Kind, len: Option<u32>, name: Arc<str>) -> SlotId {
        self.array_words += u64::from(len.unwrap_or(0)) * u64::from(kind.words());
        self.name_bytes += name.len() as u64;
        self.body.slots.push(Slot { kind, len, name, rate: Rate::Varying });
        SlotId(self.body.slots.len() as u32 - 1)
    }

    /// A new block that nothing refers to yet.
    pub fn block(&mut self) -> BlockId {
        self.body.blocks.push(Block::default());
        BlockId(self.body.blocks.len() as u32 - 1)
    }

    /// Appends an instruction.
    pub fn push(&mut self, op: Op, results: Values) {
        let span = self.span;
        if let Some(block) = self.body.blocks.get_mut(self.current.index()) {
            block.insts.push(Inst { op, results, span });
        }
    }

    /// The constant of a value, if it is among the last `recent` instructions of this block.
    pub fn known(&self, value: ValueId, recent: usize) -> Option<&Const> {
        let insts = &self.body.blocks.get(self.current.index())?.insts;
        match &insts.iter().rev().take(recent).find(|inst| inst.results.first() == Some(&value))?.op {
            Op::Const(known) => Some(known),
            _ => None,
        }
    }

    /// The int of a value, if it is a constant that was just written.
    pub fn known_int(&self, value: ValueId) -> Option<i32> {
        match self.known(value, 4)? {
            Const::Int(n) => Some(*n),
            _ => None,
        }
    }

    fn one(&mut self, kind: Kind, op: Op) -> ValueId {
        let result = self.fresh(kind);
        self.push(op, smallvec![result]);
        result
    }

    /// A constant.
    pub fn constant(&mut self, value: Const) -> ValueId {
        self.one(value.kind(), Op::Const(value))
    }

    /// An int constant.
    pub fn int(&mut self, value: i32) -> ValueId {
        self.constant(Const::Int(value))
    }

    /// A float constant.
    pub fn float(&mut self, value: f32) -> ValueId {
        self.constant(Const::Float(value))
    }

    /// A constant of the library.
    pub fn library_constant(&mut self, constant: LibraryConstant) -> ValueId {
        let number = self.int(constant as i32);
        self.lane(LaneOp::LibraryConstant, &[number])
    }

    /// A shader global.
    pub fn global(&mut self, global: crate::global::Global, kind: Kind) -> ValueId {
        self.one(kind, Op::Global(global))
    }

    /// A live parameter, or one element of one.
    pub fn input(&mut self, input: super::Input) -> ValueId {
        let (index, kind) = (self.body.inputs.len() as u32, input.value.kind());
        self.body.inputs.push(input);
        self.one(kind, Op::Input(index))
    }

    /// A lane operation; the kind of its result follows from its shape and arguments.
    pub fn lane(&mut self, op: LaneOp, args: &[ValueId]) -> ValueId {
        let kind = op.result_kind(args.iter().map(|a| self.body.kind(*a)));
        self.one(kind, Op::Lane(op, args.into()))
    }

    /// The derivative of a value along an axis.
    pub fn derivative(&mut self, of: ValueId, axis: super::Axis) -> ValueId {
        let kind = self.body.kind(of);
        self.one(kind, Op::Derivative(of, axis))
    }

    /// A kernel with results of the given kinds.
    pub fn kernel_of(&mut self, kernel: Kernel, args: &[ValueId], results: &[Kind]) -> Values {
        let results: Values = results.iter().map(|kind| self.fresh(*kind)).collect();
        self.push(Op::Kernel(kernel, args.into()), results.clone());
        results
    }

    /// A kernel with one result.
    pub fn kernel(&mut self, kernel: Kernel, args: &[ValueId], result: Kind) -> ValueId {
        self.one(result, Op::Kernel(kernel, args.into()))
    }

    /// Records what the source does, if notes are enabled.
    pub fn note(&mut self, args: &[ValueId], note: impl FnOnce(&Body) -> super::Note) {
        if self.notes {
            let (site, note) = (self.noted, note(&self.body));
            self.noted += 1;
            self.push(Op::Kernel(Kernel::Note { site, note }, args.into()), Values::new());
        }
    }

    /// Reads a scalar slot.
    pub fn load(&mut self, slot: SlotId) -> ValueId {
        let kind = self.body.slot(slot).kind;
        self.one(kind, Op::Load(slot))
    }

    /// Writes a scalar slot.
    pub fn store(&mut self, slot: SlotId, value: ValueId) {
        self.push(Op::Store(slot, value), Values::new());
    }

    /// Reads an array element; the index is clamped into the array.
    pub fn load_element(&mut self, slot: SlotId, index: ValueId) -> ValueId {
        let index = self.clamped(slot, index);
        let kind = self.body.slot(slot).kind;
        self.one(kind, Op::LoadElement(slot, index))
    }

    /// Writes an array element; the index is clamped into the array.
    pub fn store_element(&mut self, slot: SlotId, index: ValueId, value: ValueId) {
        let index = self.clamped(slot, index);
        self.push(Op::StoreElement(slot, index, value), Values::new());
    }

    fn clamped(&mut self, slot: SlotId, index: ValueId) -> ValueId {
        let last = self.body.slot(slot).len.unwrap_or(1).saturating_sub(1) as i32;
        self.clamp_int(index, last)
    }

    /// The int clamped to `0..=last`.
    pub fn clamp_int(&mut self, index: ValueId, last: i32) -> ValueId {
        let (low, high) = (self.int(0), self.int(last));
        let index = self.lane(LaneOp::IMin, &[index, high]);
        self.lane(LaneOp::IMax, &[index, low])
    }

    /// `a` if the condition, an int, is not 0, else `b`.
    pub fn choose(&mut self, cond: ValueId, a: ValueId, b: ValueId) -> ValueId {
        self.lane(super::choose_op(self.body.kind(a)), &[cond, a, b])
    }

    /// Runs one of two sides.
    pub fn if_else(
        &mut self,
        cond: ValueId,
        then: impl FnOnce(&mut Self),
        otherwise: impl FnOnce(&mut Self),
    ) {
        let (then, ()) = self.in_block(then);
        let (otherwise, ()) = self.in_block(otherwise);
        let op = Op::If { cond, then, otherwise, then_yields: Values::new(), else_yields: Values::new() };
        self.push(op, Values::new());
    }

    /// Runs `work` with a new block as the current one.
    pub fn in_block<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> (BlockId, T) {
        let block = self.block();
        let outer = std::mem::replace(&mut self.current, block);
        let result = work(self);
        self.current = outer;
        (block, result)
    }
}
