//! Writing instructions in place of others: what the passes share that replace an instruction by several.
//!
//! A pass implements [`Rewrite::inst`] for one instruction, and writes with the other methods.

use super::Renaming;
use crate::ir::{BlockId, Body, Const, Inst, Kind, LaneOp, Op, Rate, ValueId};
use osl_numeric::library_constants::LibraryConstant;
use osl_syntax::span::Span;
use smallvec::smallvec;

/// The body, and the block that is being written.
pub(super) struct Code<'a> {
    pub(super) body: &'a mut Body,
    /// Values that have a replacement.
    pub(super) renaming: Renaming,
    /// The instructions of the block so far.
    pub(super) out: Vec<Inst>,
    /// The source location of the instruction that is being replaced.
    pub(super) span: Span,
    /// Whether the rates are found already. Before that, every value is varying.
    has_rates: bool,
}

impl<'a> Code<'a> {
    pub(super) fn new(body: &'a mut Body) -> Code<'a> {
        Code { body, renaming: Renaming::default(), out: Vec::new(), span: Span::default(), has_rates: false }
    }

    /// For a pass that runs after the rates are found.
    pub(super) fn with_rates(body: &'a mut Body) -> Code<'a> {
        Code { has_rates: true, ..Code::new(body) }
    }

    fn set_uniform(&mut self, value: ValueId) {
        if self.has_rates {
            self.body.values[value.index()].rate = Rate::Uniform;
        }
    }

    /// Ends the rewriting: the outputs take the replacements.
    pub(super) fn finish(self) {
        super::fold::rename_outputs(self.body, &self.renaming);
    }
}

/// A pass that writes each block again, instruction by instruction.
pub(super) trait Rewrite<'a> {
    /// The body and the current block.
    fn code(&mut self) -> &mut Code<'a>;

    /// Writes an instruction, or what replaces it. An instruction with blocks writes them too, where the pass
    /// asks for it.
    fn inst(&mut self, inst: Inst);

    /// Writes a block.
    fn block(&mut self, id: BlockId) {
        let insts = std::mem::take(&mut self.code().body.blocks[id.index()].insts);
        let outer = std::mem::replace(&mut self.code().out, Vec::with_capacity(insts.len()));
        for inst in insts {
            self.code().span = inst.span;
            self.inst(inst);
        }
        let code = self.code();
        code.body.blocks[id.index()].insts = std::mem::replace(&mut code.out, outer);
    }

    /// Keeps an instruction as it is.
    fn keep(&mut self, inst: Inst) {
        self.code().out.push(inst);
    }

    /// A new value without a definition so far.
    fn fresh(&mut self, kind: Kind) -> ValueId {
        let code = self.code();
        code.body.fresh(kind, code.span)
    }

    /// Writes an operation with one result.
    fn push(&mut self, op: Op, kind: Kind) -> ValueId {
        let result = self.fresh(kind);
        let code = self.code();
        code.out.push(Inst { op, results: smallvec![result], span: code.span });
        result
    }

    /// Writes a lane operation. Its result is uniform if all arguments are.
    fn lane(&mut self, op: LaneOp, args: &[ValueId]) -> ValueId {
        let body = &self.code().body;
        let kind = op.result_kind(args.iter().map(|a| body.kind(*a)));
        let is_uniform = args.iter().all(|a| body.value(*a).rate == Rate::Uniform);
        let result = self.push(Op::Lane(op, args.into()), kind);
        if is_uniform {
            self.code().set_uniform(result);
        }
        result
    }

    fn constant(&mut self, value: Const) -> ValueId {
        let kind = value.kind();
        let result = self.push(Op::Const(value), kind);
        self.code().set_uniform(result);
        result
    }

    fn float(&mut self, x: f32) -> ValueId {
        self.constant(Const::Float(x))
    }

    fn int(&mut self, n: i32) -> ValueId {
        self.constant(Const::Int(n))
    }

    fn library_constant(&mut self, constant: LibraryConstant) -> ValueId {
        let number = self.int(constant as i32);
        self.lane(LaneOp::LibraryConstant, &[number])
    }
}
