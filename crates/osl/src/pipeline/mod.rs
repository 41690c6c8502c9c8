//! From source text to a runnable program: the one place where the crates are joined.
//!
//! This module must not know arguments, terminals or the location of files: a provider supplies includes.

mod group;

pub use group::{CheckedGroup, Library, ShaderFiles, check_group, link, moved};

use osl_exec::Program;
use osl_ir::hir;
use osl_ir::ir::Body;
use osl_ir::lint;
use osl_ir::lower::{self, Last, Requests};
use osl_ir::oso::{self, Read};
use osl_ir::params::{self, ParamValues};
use osl_ir::passes::{self, Report};
use osl_limits::Limits;
use osl_syntax::ast::{Ast, Item};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::{SourceMap, SourceProvider};
use osl_syntax::span::Span;
use osl_syntax::{Options, Parsed, Reports};

/// A file that was read and resolved, with or without errors.
pub struct Checked {
    /// The files to which the diagnostics refer.
    pub sources: SourceMap,
    /// The diagnostics, in order.
    pub diagnostics: Vec<Diagnostic>,
    /// The resolved program, if there is no error.
    pub program: Option<hir::Program>,
    /// The syntax tree.
    pub ast: Ast,
    /// Lines on which the file suppresses warnings.
    pub nowarn: Vec<Span>,
    /// Whether the file is a compiled shader: it has no syntax tree, and lints do not apply.
    pub compiled: bool,
}

/// Whether a file with this name is a compiled shader rather than a source.
pub fn is_compiled(name: &str) -> bool {
    name.rsplit_once('.').is_some_and(|(_, extension)| extension.eq_ignore_ascii_case("oso"))
}

/// Reads and resolves a file: a source, or a compiled shader if its name ends in `.oso`.
pub fn check(name: &str, text: &str, provider: &dyn SourceProvider, options: &Options) -> Checked {
    if is_compiled(name) {
        let Read { sources, program, diagnostics } = oso::read(name, text, &options.limits);
        return Checked {
            sources,
            diagnostics,
            program,
            ast: Ast::default(),
            nowarn: Vec::new(),
            compiled: true,
        };
    }
    let parsed = osl_syntax::parse(name, text, provider, options);
    let (program, more) = resolve(&parsed, options.reports, &options.limits);
    let Parsed { sources, mut diagnostics, ast, nowarn, .. } = parsed;
    let ordered = diagnostics.iter().any(Diagnostic::is_error) && !more.is_empty();
    diagnostics.extend(more);
    if ordered {
        diagnostics.sort_by_key(|d| d.span.start);
    }
    let failed = diagnostics.iter().any(Diagnostic::is_error);
    Checked { sources, diagnostics, program: program.filter(|_| !failed), ast, nowarn, compiled: false }
}

/// Resolves the sound parts of the parsed file. A syntax error does not hide type errors.
fn resolve(parsed: &Parsed, reports: Reports, limits: &Limits) -> (Option<hir::Program>, Vec<Diagnostic>) {
    let Some((ast, mut whole)) = parsed.sound() else { return (None, Vec::new()) };
    let stop = match reports {
        Reports::AsReference => parsed.diagnostics.iter().find(|d| osl_syntax::errors::is_of_syntax(d)),
        Reports::Once => None,
    };
    let holds = |item: &Item| {
        stop.is_some_and(|d| item.span().start <= d.span.start && d.span.start < item.span().end)
    };
    let resolved = match ast.items.iter().position(holds) {
        Some(n) => {
            whole = false;
            let mut before = ast.clone();
            before.items.truncate(n);
            osl_ir::resolve::resolve_with(&before, reports, limits)
        }
        None => osl_ir::resolve::resolve_with(ast, reports, limits),
    };
    let said = |d: &Diagnostic| {
        let at = |e: &&Diagnostic| e.is_error() && e.span.start < d.span.end && d.span.start < e.span.end;
        parsed.diagnostics.iter().any(|e| at(&e)) || (!whole && d.code == osl_ir::resolve::errors::NO_SHADER)
    };
    let more = resolved.diagnostics.into_iter().filter(|d| !parsed.is_silenced(d) && !said(d));
    (resolved.program, more.collect())
}

/// All findings of the lints in a file without errors, whatever their level; nothing for a file with errors.
pub fn lint(checked: &Checked, options: &lint::Options) -> Vec<Diagnostic> {
    let Some(program) = checked.program.as_ref().filter(|_| !checked.compiled) else { return Vec::new() };
    let options = lint::Options { silenced: checked.nowarn.clone(), ..options.clone() };
    lint::run(&checked.ast, program, &checked.sources, &options)
}

/// A program with the steps to it.
pub struct Compiled {
    /// The IR after the passes.
    pub body: Body,
    /// The report of each pass.
    pub reports: Vec<Report>,
    /// The program.
    pub program: Program,
}

/// Why a resolved program did not compile.
#[derive(Debug)]
pub enum CompileError {
    /// A parameter value is invalid.
    Param(params::ParamError),
    /// The program itself is invalid.
    Program(Vec<Diagnostic>),
}

/// Lowers a program with parameter values given as name and text, without requirements of a renderer.
///
/// # Errors
/// A value does not fit its parameter, or the program cannot be lowered.
pub fn lower(program: &hir::Program, values: &[(String, String)]) -> Result<Body, CompileError> {
    lower_for(program, values, &Requests { last: Last::None, ..Requests::default() })
}

/// Like [`lower`], with the requirements of a renderer.
///
/// # Errors
/// Those of [`lower`].
pub fn lower_for(
    program: &hir::Program,
    values: &[(String, String)],
    requests: &Requests,
) -> Result<Body, CompileError> {
    lower::lower_for(program, &given(program, values)?, requests).map_err(CompileError::Program)
}

/// Like [`lower`], with notes about what the source does.
///
/// # Errors
/// Those of [`lower`].
pub fn lower_noted(program: &hir::Program, values: &[(String, String)]) -> Result<Body, CompileError> {
    lower_for(program, values, &Requests { last: Last::None, notes: true, ..Requests::default() })
}

fn given(program: &hir::Program, values: &[(String, String)]) -> Result<ParamValues, CompileError> {
    let mut given = ParamValues::default();
    for (name, text) in values {
        params::set(program, &mut given, name, text).map_err(CompileError::Param)?;
    }
    Ok(given)
}

/// Runs the passes and builds the program.
pub fn finish(mut body: Body, options: &passes::Options) -> Compiled {
    let reports = passes::run(&mut body, options);
    let program = Program::new(&body);
    Compiled { body, reports, program }
}
