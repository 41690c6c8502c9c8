//! Writing: from the resolved tree to the text of a compiled shader.
//!
//! Functions are inlined and structs become their fields, as in lowering and in the same order, so that the
//! text computes the same bits. The operations are those that the run times of renderers know, by their
//! [table](super::operations): `library` has the bodies of all other functions, and ints are converted
//! where an operation takes floats only. Nothing depends on the values of parameters. `table` holds symbols
//! and operations, `stmt`, `expr`, `place` and `call` write operations, `params` writes the defaults, `usage`
//! finds which operations read and write a symbol, and `print` formats the text.

mod call;
mod constant;
mod expr;
mod library;
mod params;
mod place;
mod print;
mod stmt;
mod usage;

mod table;

use super::operations::{self, Operand, Usage};
use super::{errors, text};
use crate::hir::{Program, VarId};
use osl_ir::types::Type;
use osl_limits::{Compiling, Limits};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use osl_syntax::span::Span;
use std::borrow::Cow;
use table::{Op, Sym, Table};

/// Writes a program. `sources` contains its files and lines.
///
/// # Errors
/// The program is too large after its functions are inlined, or has arrays within arrays, for which the form
/// has no words.
pub fn write(program: &Program, sources: &SourceMap, limits: &Limits) -> Result<String, Vec<Diagnostic>> {
    if let Some(span) = program.nested_arrays() {
        return Err(vec![*errors::nested_arrays(span)]);
    }
    let mut writer = Writer {
        program,
        limits: limits.compiling,
        table: Table::new(),
        ops: Vec::new(),
        vars: library::globals(program),
        returns: Vec::new(),
        sections: Vec::new(),
        span: Span::default(),
        fixed: None,
        quiet: false,
        loops: 0,
        full: None,
    };
    writer.params();
    writer.sections.push((text::MAIN.to_string(), writer.ops.len()));
    writer.body(&program.shader.body);
    if let Some(span) = writer.full {
        let message = "the program is too large once its functions are put in place";
        return Err(vec![*errors::too_large(span, message)]);
    }
    writer.emit("end", &[]);
    usage::derivatives(&mut writer.table, &writer.ops);
    Ok(print::print(&writer, sources))
}

/// What holds a part that is not a struct.
#[derive(Clone, Copy, Debug)]
enum Leaf {
    /// A global that no operation has used so far.
    Global(usize),
    Symbol(Sym),
}

/// The storage of a variable.
type Storage = crate::storage::Storage<Leaf>;

/// The value of an expression.
#[derive(Clone, Debug)]
enum Val {
    /// A scalar, triple, matrix, string or closure.
    One(Sym),
    /// A struct or array, in its storage; `Some` is the index of an element, applied to each part.
    Stored(Storage, Option<Sym>),
    /// No value.
    Void,
}

struct Writer<'a> {
    program: &'a Program,
    limits: Compiling,
    table: Table,
    ops: Vec<Op>,
    vars: Vec<Option<Storage>>,
    /// The destinations of the return values of the surrounding functions.
    returns: Vec<Option<(Storage, Type)>>,
    /// Names of the sections and the start of each.
    sections: Vec<(String, usize)>,
    span: Span,
    /// The call of a library function, to whose line all operations belong.
    fixed: Option<Span>,
    /// Whether what is written was written before, so that it must not print again.
    quiet: bool,
    /// Number of surrounding loops, in all functions.
    loops: u32,
    /// Where the limit was exceeded.
    full: Option<Span>,
}

impl Writer<'_> {
    /// Adds an operation; the table says how it uses its arguments.
    fn emit(&mut self, name: &'static str, args: &[Sym]) -> usize {
        let usage = self.usage(name, args);
        self.push(name, args, usage)
    }

    /// How an operation uses its arguments. One that the table does not have writes its first argument.
    fn usage(&self, name: &str, args: &[Sym]) -> Usage {
        let operands: Vec<Operand<'_>> = args.iter().map(|sym| self.table.operand(*sym)).collect();
        operations::usage(name, &operands).unwrap_or_else(|_| Usage::of_result(args.len()))
    }

    fn push(&mut self, name: impl Into<Cow<'static, str>>, args: &[Sym], usage: Usage) -> usize {
        if self.ops.len() as u64 >= self.limits.written_operations {
            self.full.get_or_insert(self.span);
        }
        if !self.has_room() {
            return self.ops.len().saturating_sub(1);
        }
        self.ops.push(Op {
            name: name.into(),
            args: args.to_vec(),
            usage,
            jumps: Vec::new(),
            span: self.fixed.unwrap_or(self.span),
        });
        self.ops.len() - 1
    }

    /// A result and arguments that are only read.
    fn emit_value(&mut self, name: &'static str, ty: Type, args: &[Sym]) -> Sym {
        let to = self.table.temp(ty);
        self.emit_to(name, to, args);
        to
    }

    fn emit_to(&mut self, name: &'static str, to: Sym, args: &[Sym]) {
        let mut all = vec![to];
        all.extend_from_slice(args);
        self.emit(name, &all);
    }

    fn assign(&mut self, to: Sym, from: Sym) {
        self.emit_to("assign", to, &[from]);
    }

    /// Records that the next part of an operation starts, or the last one ends, here.
    fn part_ends(&mut self, op: usize) {
        let here = self.ops.len();
        if let Some(op) = self.ops.get_mut(op) {
            op.jumps.push(here);
        }
    }

    fn is_full(&self) -> bool {
        self.full.is_some()
    }

    /// Whether there is room for another symbol.
    fn has_room(&mut self) -> bool {
        let Compiling { written_symbols, name_bytes, .. } = self.limits;
        if self.table.symbols.len() as u64 >= written_symbols || self.table.name_bytes > name_bytes {
            self.full.get_or_insert(self.span);
        }
        !self.is_full()
    }

    fn bind(&mut self, var: VarId, storage: Storage) {
        if let Some(place) = self.vars.get_mut(var.0 as usize) {
            *place = Some(storage);
        }
    }

    /// The symbol of a part that is not a struct.
    fn leaf(&mut self, storage: &Storage) -> Option<Sym> {
        match storage {
            Storage::Leaf(Leaf::Symbol(sym)) => Some(*sym),
            Storage::Leaf(Leaf::Global(index)) => Some(self.table.global(*index)),
            Storage::Struct(_) => None,
        }
    }
}
