//! Reading: from the text of a compiled shader to the resolved tree.
//!
//! `lex` splits lines, `file` knows the kinds of lines, `symbols` makes variables from the table, `flow`
//! makes statements from structured operations, and `ops` and `call` make expressions from single ones, with
//! `parts` for operations that work component by component.
//! Variables keep their names. Functions that compilers have inlined become functions without formals, so
//! that their `return` leaves the right code. `check` compares a file with the rules of run times.

mod call;
mod check;
mod file;
mod flow;
mod lex;
mod ops;
mod parts;
mod sources;
mod symbols;

pub use check::{Rule, Violation, check};

use super::{errors, text};
use crate::hir::{self, Function, Program, Var};
use file::File;
use osl_ir::types::StructTable;
use osl_limits::{Limits, Reading};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use osl_syntax::span::Span;
use symbols::Symbols;

/// A compiled shader that was read, with or without errors.
#[derive(Debug)]
pub struct Read {
    /// The file itself, followed by the sources that it names, as far as it quotes them.
    pub sources: SourceMap,
    /// The program, if there is no error.
    pub program: Option<Program>,
    /// The diagnostics.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a compiled shader. `name` is the file name in diagnostics.
pub fn read(name: &str, text: &str, limits: &Limits) -> Read {
    let mut sources = SourceMap::default();
    let mut diagnostics = Vec::new();
    if sources.add(name, text.into()).is_none() {
        diagnostics.push(*errors::too_large(Span::default(), "a compiled shader may have 4 GiB"));
        return Read { sources, program: None, diagnostics };
    }
    let file = file::parse(text, limits, &mut diagnostics);
    let program = if diagnostics.is_empty() {
        let spans = sources::places(&file, &mut sources, limits.reading.oso_quoted);
        build(&file, &spans, limits).map_err(|error| diagnostics.push(*error)).ok()
    } else {
        None
    };
    Read { sources, program, diagnostics }
}

/// The state shared by the steps of reading.
struct Builder<'f, 'a> {
    file: &'f File<'a>,
    /// The location of each operation in its source.
    spans: &'f [Span],
    structs: StructTable,
    vars: Vec<Var>,
    functions: Vec<Function>,
    symbols: Symbols<'a>,
    limits: Reading,
}

type Result<T> = std::result::Result<T, errors::Wrong>;

/// Makes the program of a file. It ends at the first error, since later errors could be consequences of it.
fn build<'a>(file: &File<'a>, spans: &[Span], limits: &Limits) -> Result<Program> {
    let mut b = Builder {
        file,
        spans,
        structs: StructTable::default(),
        vars: symbols::globals(),
        functions: Vec::new(),
        symbols: Symbols::default(),
        limits: limits.reading,
    };
    let params = b.declare()?;
    let params = b.defaults(params)?;
    let main = file.sections.iter().find(|s| s.name == text::MAIN);
    let body = match main {
        Some(section) => b.section(section)?,
        None => Vec::new(),
    };
    let Some(line) = &file.shader else {
        return Err(errors::syntax(Span::default(), "no line names the shader"));
    };
    let shader = hir::Shader {
        name: line.name.into(),
        kind: line.kind,
        metadata: line.metadata.clone(),
        params,
        body,
    };
    Ok(Program {
        structs: b.structs,
        vars: b.vars,
        functions: b.functions,
        shader,
        choices: Default::default(),
        places: Default::default(),
    })
}
