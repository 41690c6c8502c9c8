//! Checks whether the run time of a renderer runs a compiled shader as intended.
//!
//! Such a run time refuses few files when it reads them. Most mistakes make it abort or compute other values
//! later, often only with other parameters. So each rule here stands for a mistake that the reference's run
//! time does not report well. `symbols` checks declarations and sections, `ops` single operations by the
//! [table](crate::oso::operations), and `flow` blocks and jumps.

mod flow;
mod ops;
mod symbols;

use super::file::{self, File, Op, Section};
use crate::oso::operations::Usage;
use osl_limits::Limits;
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;

/// The subject of a rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// The lines and their order.
    File,
    /// Declarations of symbols.
    Symbol,
    /// Operations and their operands.
    Operand,
    /// The hints that say which operands an operation reads, writes and differentiates.
    Hint,
    /// Numbers of operations at which blocks end.
    Jump,
    /// Where `return`, `break` and `continue` may stand, and conditions of loops.
    Flow,
    /// Operands that must be constant, and format strings.
    Constant,
    /// Sections that initialise parameters.
    Section,
    /// Symbols that may not be written.
    Write,
    /// Values of symbols.
    Literal,
}

impl Rule {
    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Rule::File => "file",
            Rule::Symbol => "symbol",
            Rule::Operand => "operand",
            Rule::Hint => "hint",
            Rule::Jump => "jump",
            Rule::Flow => "flow",
            Rule::Constant => "constant",
            Rule::Section => "section",
            Rule::Write => "write",
            Rule::Literal => "literal",
        }
    }
}

/// A place where a compiled shader breaks a rule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Violation {
    /// The line, from 1.
    pub line: u32,
    /// The operation, or the symbol or section; empty for a line of another kind.
    pub subject: String,
    /// The rule.
    pub rule: Rule,
    /// What is wrong.
    pub message: String,
}

/// Checks a compiled shader, given as text. The list has at most as many entries as a file may have
/// diagnostics.
pub fn check(text: &str, limits: &Limits) -> Vec<Violation> {
    let mut diagnostics = Vec::new();
    let file = file::parse(text, limits, &mut diagnostics);
    let mut checker = Checker {
        file: &file,
        lines: std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at as u32 + 1)).collect(),
        symbols: file.symbols.iter().enumerate().map(|(index, symbol)| (symbol.name, index)).collect(),
        usages: Vec::new(),
        writers: FxHashMap::default(),
        violations: Vec::new(),
        most: limits.reading.diagnostics as usize,
    };
    for diagnostic in diagnostics {
        checker.report(Rule::File, diagnostic.span, "", diagnostic.message);
    }
    if checker.violations.is_empty() {
        checker.symbols();
        checker.sections();
        checker.operations();
        for section in &file.sections {
            checker.flow(section);
        }
    }
    checker.violations.sort_by_key(|v| v.line);
    checker.violations
}

struct Checker<'f, 'a> {
    file: &'f File<'a>,
    /// The offset of each line.
    lines: Vec<u32>,
    /// Indices of the symbols by name; of several, the last one counts.
    symbols: FxHashMap<&'a str, usize>,
    /// How each operation uses its operands, as far as it is valid.
    usages: Vec<Option<Usage>>,
    /// The operations that write a symbol, in order.
    writers: FxHashMap<&'a str, Vec<usize>>,
    violations: Vec<Violation>,
    most: usize,
}

impl<'f, 'a> Checker<'f, 'a> {
    fn report(&mut self, rule: Rule, span: Span, subject: &str, message: impl Into<String>) {
        if self.violations.len() < self.most {
            let line = self.lines.partition_point(|start| *start <= span.start) as u32;
            self.violations.push(Violation { line, subject: subject.into(), rule, message: message.into() });
        }
    }

    fn symbol(&self, name: &str) -> Option<&'f file::Symbol<'a>> {
        self.file.symbols.get(*self.symbols.get(name)?)
    }

    /// The operations of a section, with their numbers.
    fn ops(&self, section: &Section<'a>) -> impl Iterator<Item = (usize, &'f Op<'a>)> + use<'f, 'a> {
        let file = self.file;
        (section.start..section.end).filter_map(|at| Some((at, file.ops.get(at)?)))
    }

    /// The names that an operation writes.
    fn written(&self, at: usize) -> impl Iterator<Item = &'a str> {
        let (op, usage) = (self.file.ops.get(at), self.usages.get(at));
        let usage = usage.and_then(Option::as_ref);
        let args = op.zip(usage).into_iter().flat_map(|(op, usage)| op.args.iter().zip(&usage.access));
        args.filter(|(_, access)| **access == b'w').map(|((name, _), _)| *name)
    }
}
