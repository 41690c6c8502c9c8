//! Blocks: where they end, and the operations that leave them.

use super::super::file::{Op, Section};
use super::{Checker, Rule};
use crate::oso::operations;

/// A block that contains the operation at hand.
#[derive(Clone, Copy)]
struct Block {
    end: usize,
    /// Whether it is in the body of a loop, and in a function's.
    in_loop: bool,
    in_call: bool,
}

impl Checker<'_, '_> {
    /// Checks the jumps of a section.
    pub(super) fn flow(&mut self, section: &Section<'_>) {
        let whole = Block { end: section.end, in_loop: false, in_call: false };
        let mut around = vec![whole];
        for (at, op) in self.ops(section) {
            while around.last().is_some_and(|block| block.end <= at) && around.len() > 1 {
                around.pop();
            }
            let block = around.last().copied().unwrap_or(whole);
            if operations::jumps(op.name).is_some_and(|count| count != op.jumps.len()) {
                let count = operations::jumps(op.name).unwrap_or(0);
                let message = format!("it has {} jumps in place of {count}", op.jumps.len());
                self.report(Rule::Jump, op.span, op.name, message);
                continue;
            }
            let misplaced = match op.name {
                "return" if !block.in_call => "it is not in a function: write `exit`",
                "break" | "continue" if !block.in_loop => "it is not in the body of a loop",
                _ => "",
            };
            if !misplaced.is_empty() {
                self.report(Rule::Flow, op.span, op.name, misplaced);
            }
            if !op.jumps.is_empty() {
                self.blocks(at, op, block, &mut around);
            }
        }
    }

    /// Enters the blocks of an operation.
    fn blocks(&mut self, at: usize, op: &Op<'_>, block: Block, around: &mut Vec<Block>) {
        let jumps: Vec<usize> = op.jumps.iter().map(|target| *target as usize).collect();
        let (mut low, mut valid) = (at + 1, true);
        for target in &jumps {
            valid &= (low..=block.end).contains(target);
            low = *target;
        }
        if !valid {
            let message = format!("{jumps:?} do not ascend from {} to at most {}", at + 1, block.end);
            return self.report(Rule::Jump, op.span, op.name, message);
        }
        let plain = |end| Block { end, in_loop: false, ..block };
        match (op.name, jumps.as_slice()) {
            ("if", [then, end]) => around.extend([*end, *then].map(|end| Block { end, ..block })),
            ("functioncall" | "functioncall_nr", [end]) => {
                around.push(Block { in_call: true, ..plain(*end) });
            }
            (_, [init, cond, body, step]) => {
                around.push(plain(*step));
                around.push(Block { end: *body, in_loop: true, ..block });
                around.extend([plain(*cond), plain(*init)]);
                self.condition(op, *init..*cond);
            }
            _ => {}
        }
    }

    /// A loop ends only if its condition is computed again before each iteration.
    fn condition(&mut self, op: &Op<'_>, block: std::ops::Range<usize>) {
        let Some((name, _)) = op.args.first() else { return };
        let writers = self.writers.get(name).map_or(&[][..], Vec::as_slice);
        let first = writers.partition_point(|at| *at < block.start);
        if writers.get(first).is_none_or(|at| *at >= block.end) {
            let message = format!("no operation of the condition writes `{name}`");
            self.report(Rule::Flow, op.span, op.name, message);
        }
    }
}
