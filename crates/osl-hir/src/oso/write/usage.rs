//! Which operations read and write a symbol, and which symbols need derivatives.

use super::table::{Op, Sym, Table};
use crate::oso::text;
use std::ops::RangeInclusive;

/// The first and last operation that reads a symbol, and the first and last that writes it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Usage {
    pub(super) read: (i64, i64),
    pub(super) written: (i64, i64),
}

impl Usage {
    const NONE: Usage = Usage { read: text::NEVER, written: text::NEVER };
}

fn widen(range: &mut (i64, i64), by: (usize, usize)) {
    range.0 = range.0.min(by.0 as i64);
    range.1 = range.1.max(by.1 as i64);
}

/// The usage of all symbols. A write or read in a loop counts for all of its iterations.
pub(super) fn usages(table: &Table, ops: &[Op]) -> Vec<Usage> {
    let mut all = vec![Usage::NONE; table.symbols.len()];
    let mut around: Option<RangeInclusive<usize>> = None;
    for (at, op) in ops.iter().enumerate() {
        around = around.filter(|range| range.contains(&at) || at < *range.start());
        let rounds = around.clone().filter(|range| range.contains(&at));
        let range = rounds.map_or((at, at), |range| (*range.start(), *range.end()));
        for (sym, access) in op.args.iter().zip(&op.usage.access) {
            let Some(usage) = all.get_mut(sym.0 as usize) else { continue };
            if *access == b'w' {
                widen(&mut usage.written, range);
            }
            if *access == b'r' {
                let changes = usage.written.1 >= 0;
                widen(&mut usage.read, if changes { range } else { (at, at) });
            }
        }
        if let ("for" | "while" | "dowhile", [test, .., end]) = (&*op.name, op.jumps.as_slice()) {
            let last = end.saturating_sub(1);
            let outer = around.get_or_insert(*test..=last);
            let inside = outer.contains(&at);
            if let Some(usage) =
                op.args.first().and_then(|sym| all.get_mut(sym.0 as usize)).filter(|_| !inside)
            {
                widen(&mut usage.read, (at, last));
                widen(&mut usage.written, (at + 1, last));
            }
        }
    }
    all
}

/// Marks the symbols whose derivatives are needed: differentiated symbols, and everything from which they are
/// computed.
pub(super) fn derivatives(table: &mut Table, ops: &[Op]) {
    let mut writers: Vec<Vec<u32>> = vec![Vec::new(); table.symbols.len()];
    for (at, op) in ops.iter().enumerate() {
        for (sym, access) in op.args.iter().zip(&op.usage.access) {
            if let (b'w', Some(list)) = (access, writers.get_mut(sym.0 as usize)) {
                list.push(at as u32);
            }
        }
    }
    let mut open: Vec<Sym> = Vec::new();
    for op in ops {
        open.extend(op.usage.derivatives.iter().filter_map(|at| op.args.get(*at).copied()));
    }
    while let Some(sym) = open.pop() {
        let Some(symbol) = table.get_mut(sym).filter(|s| !s.derivs) else { continue };
        let carries =
            symbol.class != super::table::Class::Const && symbol.ty.base != osl_ir::types::Base::String;
        if !carries {
            continue;
        }
        symbol.derivs = true;
        for op in writers.get(sym.0 as usize).into_iter().flatten().filter_map(|at| ops.get(*at as usize)) {
            let read = op.args.iter().zip(&op.usage.access).filter(|(_, access)| **access == b'r');
            open.extend(read.map(|(sym, _)| *sym));
        }
    }
}
