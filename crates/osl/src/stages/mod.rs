//! The stages of the compiler, one function each, from source text to a runnable program.
//!
//! | stage | function | result |
//! | --- | --- | --- |
//! | read a text and find its mistakes | [`check`], [`check_group`] | [`Checked`], [`CheckedGroup`] |
//! | find suspicious code | [`lint()`], [`judge`] | diagnostics |
//! | turn the tree into IR, with values for the parameters | [`lower`], [`lower_for`] | [`Body`] |
//! | optimise the IR, assign registers | [`finish`] | [`Compiled`] with a [`Program`] |
//! | run the program over points | `osl_exec::run` | `osl_exec::Frame` |
//!
//! ```
//! use osl::stages::{self, NoFiles, Options, PassOptions};
//!
//! let text = "shader half(float x = 1, output float o = 0) { o = x * u / 2; }";
//! let checked = stages::check("half.osl", text, &NoFiles, &Options::default());
//! assert!(checked.diagnostics.is_empty());
//! let program = checked.program.ok_or("the text has errors")?;
//! let body = stages::lower(&program, &[("x".to_string(), "3".to_string())]).map_err(|e| format!("{e:?}"))?;
//! let compiled = stages::finish(body, &PassOptions::default());
//! assert_eq!(compiled.body.outputs.len(), 1);
//! # Ok::<(), String>(())
//! ```
//!
//! Most programs need only [`Shader`](crate::Shader) and [`Group`](crate::Group). This module is for tools
//! that look into the compiler: the command line, the measuring tools and the tests of this project. Its
//! types are those of the compiler's crates, re-exported here by name, and they change whenever the compiler
//! does.
//!
//! This module is the one place where the crates are joined.

mod group;

pub use group::{CheckedGroup, Library, ShaderFiles, check_group, link, moved};

#[doc(no_inline)]
pub use osl_exec::Program;
#[doc(no_inline)]
pub use osl_hir::hir::{Broken, Program as ResolvedProgram};
#[doc(no_inline)]
pub use osl_hir::lint::Options as LintOptions;
#[doc(no_inline)]
pub use osl_ir::ir::Body;
#[doc(no_inline)]
pub use osl_ir::passes::{Options as PassOptions, Report};
#[doc(no_inline)]
pub use osl_lower::group::Group as LayerGroup;
#[doc(no_inline)]
pub use osl_lower::params::{ParamError, ParamValues};
#[doc(no_inline)]
pub use osl_lower::{Last, Requests};
#[doc(no_inline)]
pub use osl_syntax::ast::Ast;
#[doc(no_inline)]
pub use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::with_line_ends;
#[doc(no_inline)]
pub use osl_syntax::source::{SourceMap, SourceProvider};
#[doc(no_inline)]
pub use osl_syntax::span::Span;
#[doc(no_inline)]
pub use osl_syntax::{NoFiles, Options};

use crate::{Levels, Verdict};
use osl_hir::oso::{self, Read};
use osl_hir::resolve::{self, Resolved};
use osl_hir::symbols::Symbols;
use osl_hir::{hir, lint};
use osl_ir::passes;
use osl_limits::Limits;
use osl_lower::params;
use osl_syntax::diagnostic::Severity;
use osl_syntax::{Parsed, Silenced};

/// A file that was read and resolved, with or without errors.
pub struct Checked {
    /// The files to which the diagnostics refer.
    pub sources: SourceMap,
    /// The diagnostics, in order.
    pub diagnostics: Vec<Diagnostic>,
    /// The resolved program, if there is no error.
    pub program: Option<ResolvedProgram>,
    /// What was resolved of a source with errors, for tools that show sources: nothing lowers or runs it.
    pub broken: Option<Broken>,
    /// The syntax tree.
    pub ast: Ast,
    /// Lines on which the file suppresses warnings.
    pub silenced: Silenced,
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
        let text = with_line_ends(text);
        let Read { mut sources, program, mut diagnostics } = oso::read(name, &text, &options.limits);
        sources.tell(provider.about(name));
        diagnostics.extend(sources.files().first().and_then(osl_syntax::errors::not_utf8));
        return Checked {
            sources,
            diagnostics,
            program,
            broken: None,
            ast: Ast::default(),
            silenced: Silenced::default(),
            compiled: true,
        };
    }
    let parsed = osl_syntax::parse(name, text, provider, options);
    let Resolved { program, diagnostics: more } =
        resolve::resolve_parsed(&parsed, options.reports, &options.limits);
    let Parsed { sources, mut diagnostics, ast, silenced, .. } = parsed;
    let ordered = diagnostics.iter().any(Diagnostic::is_error) && !more.is_empty();
    diagnostics.extend(more);
    if ordered {
        diagnostics.sort_by_key(|d| d.span.start);
    }
    hide(&mut diagnostics, &sources);
    let (program, broken) = match program {
        Ok(program) => (Some(program), None),
        Err(broken) => (None, Some(broken)),
    };
    Checked { sources, diagnostics, program, broken, ast, silenced, compiled: false }
}

/// Takes the text of files that messages must not show out of diagnostics.
pub fn hide(diagnostics: &mut [Diagnostic], sources: &SourceMap) {
    let is_known =
        |word: &str| osl_hir::builtins::find(word).is_some() || osl_syntax::token::is_keyword(word);
    osl_syntax::hidden::hide(diagnostics, sources, &is_known);
}

/// The symbols of a checked source and the types of its expressions, for editors; also of a source with
/// errors. A compiled shader has none.
pub fn symbols(checked: &Checked, limits: &Limits) -> Symbols {
    resolve::symbols(&checked.ast, limits)
}

/// All findings of the lints in a file without errors, whatever their level; nothing for a file with errors.
pub fn lint(checked: &Checked, options: &lint::Options) -> Vec<Diagnostic> {
    let Some(program) = checked.program.as_ref().filter(|_| !checked.compiled) else { return Vec::new() };
    let options = lint::Options { silenced: checked.silenced.clone(), ..options.clone() };
    lint::run(&checked.ast, program, &checked.sources, &options)
}

/// The diagnostics of a checked file and its lints, as `levels` decide: without hidden ones, and with the
/// severity of denied ones. `severe` tells which lints are shown by default.
pub fn judge(
    checked: &Checked,
    levels: &Levels,
    severe: impl Fn(&lint::Lint) -> bool,
    limits: &Limits,
) -> Vec<(Diagnostic, Verdict)> {
    let options = lint::Options {
        known_spaces: levels.known_spaces.clone(),
        limits: limits.clone(),
        ..lint::Options::default()
    };
    let mut list = sift(checked.diagnostics.clone(), levels);
    let lints = lint(checked, &options).into_iter().map(|d| (lint::find(d.code).is_some_and(&severe), d));
    list.extend(lints.filter_map(|(shown, d)| verdict(d, shown, levels)));
    list.sort_by_key(|(d, _)| d.span.start);
    let mut once = lint::OnceAName::default();
    list.retain(|(d, _)| once.keeps(d));
    list
}

/// Diagnostics that are not lints, as `levels` decide.
pub fn sift(list: Vec<Diagnostic>, levels: &Levels) -> Vec<(Diagnostic, Verdict)> {
    list.into_iter().filter_map(|d| verdict(d, true, levels)).collect()
}

/// The diagnostic with its severity, or `None` if it is hidden.
fn verdict(mut d: Diagnostic, by_default: bool, levels: &Levels) -> Option<(Diagnostic, Verdict)> {
    if d.is_error() {
        return Some((d, Verdict::Show));
    }
    let verdict = levels.verdict(d.code, by_default);
    if let Verdict::Deny(_) = verdict {
        d.severity = Severity::Error;
    }
    (verdict != Verdict::Hide).then_some((d, verdict))
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
    osl_lower::lower_for(program, &given(program, values)?, requests).map_err(CompileError::Program)
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

/// The parameters of a resolved program, as data.
pub fn params(program: &hir::Program) -> Vec<crate::Param> {
    crate::param::params(program)
}

/// The metadata of the shader of a resolved program, as data.
pub fn metadata(program: &hir::Program) -> Vec<crate::Metadata> {
    crate::param::metadata(&program.shader.metadata)
}

/// Diagnostics of the stages, as data for a client.
pub fn describe(list: &[Diagnostic], sources: &SourceMap) -> Vec<crate::Diagnostic> {
    crate::diagnostic::diagnostics(list, sources)
}
