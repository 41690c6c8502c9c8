//! Lints: what compiles and is probably not what was meant.
//!
//! They look at a program without errors: at the [resolved tree](crate::hir) for meaning, at the syntax tree for
//! scopes and fixes, at the sources to tell what the user wrote from what a macro made. Every lint is a warning
//! with a code `W03xx` and a [`Level`] that says who gets to see it unless asked otherwise. Included files are not
//! judged, nor is what macros expand to. This module must not know the command line.
//!
//! Some warnings of the same nature come from resolution, since published compilers give them too: writing a
//! read-only argument (W0203), a parameter that hides a function (W0206). They are not repeated here.

mod codes;
mod constants;
mod flow;
mod jumps;
mod queries;
mod scopes;
mod spaces;
mod state;
mod usage;
mod values;
mod walk;
pub(crate) use walk::{Walk, bodies, count_writes, each_stmt};

pub use codes::*;

use crate::hir::Program;
use osl_limits::Limits;
use osl_syntax::ast::Ast;
use osl_syntax::diagnostic::{Code, Diagnostic, Edit};
use osl_syntax::source::SourceMap;
use osl_syntax::span::Span;
use rustc_hash::FxHashSet;

/// Who sees a lint unless the user says otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Who checks a file: correct programs earn it too, but the text says more or less than it does.
    Check,
    /// Everybody, also who only runs the shader: the result is hardly the one that was meant.
    Always,
}

/// A lint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lint {
    /// Its code and name.
    pub code: Code,
    /// Who sees it.
    pub level: Level,
}

/// What lints need to be told.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Spaces, of points or of colors, that the renderer will know besides the usual ones.
    pub known_spaces: Vec<String>,
    /// Lines on which the file silences warnings.
    pub silenced: Vec<Span>,
    /// How much they may report; a file that earns more will not be read to the end either.
    pub limits: Limits,
}

/// Bytes before a statement that may be its indent.
const MAX_INDENT: usize = 1000;

/// The lint of a code; `None` for codes of other stages.
pub fn find(code: Code) -> Option<&'static Lint> {
    LINTS.iter().find(|lint| lint.code == code)
}

/// Warnings of which one for a name is enough: the same name at another place says nothing new.
const ONCE: &[&str] = &["W0203", "W0313", "W0314", "W0315"];

/// Keeps the first of the warnings that say the same of one name.
pub fn once_a_name(list: &mut Vec<Diagnostic>) {
    let mut seen = FxHashSet::default();
    list.retain(|d| {
        let name = d.message.split(['`', '"']).nth(1).unwrap_or(&d.message).to_owned();
        d.is_error() || !ONCE.contains(&d.code.id) || seen.insert((d.code.id, name))
    });
}

/// Everything that the lints find in a program that has no errors, in source order, whatever its level.
pub fn run(ast: &Ast, program: &Program, sources: &SourceMap, options: &Options) -> Vec<Diagnostic> {
    let mut silenced = options.silenced.clone();
    silenced.sort_unstable_by_key(|line| line.start);
    let mut found = Findings {
        sources,
        silenced,
        list: Vec::new(),
        most: usize::try_from(options.limits.compiling.findings).unwrap_or(usize::MAX),
    };
    let walk = walk::Walk::new(program);
    usage::run(ast, &walk, &mut found);
    flow::run(&walk, &mut found);
    jumps::run(&walk, &mut found);
    values::run(&walk, &mut found);
    scopes::run(ast, &mut found);
    spaces::run(&walk, options, &mut found);
    queries::run(&walk, &mut found);
    found.keep_first();
    found.list
}

/// Where lints report to.
struct Findings<'a> {
    sources: &'a SourceMap,
    /// Whole lines, in the order of their files.
    silenced: Vec<Span>,
    list: Vec<Diagnostic>,
    /// How many are kept.
    most: usize,
}

impl Findings<'_> {
    /// Keeps a finding of the main file.
    fn report(&mut self, diagnostic: Diagnostic) {
        if self.in_main_file(diagnostic.span) && !self.is_silenced(diagnostic.span) {
            self.list.push(diagnostic);
            // A file may earn one for each of its statements.
            if self.list.len() > self.most.saturating_mul(16) {
                self.keep_first();
            }
        }
    }

    /// Keeps those that stand first in the text.
    fn keep_first(&mut self) {
        self.list.sort_by_key(|d| (d.span.start, d.span.end, d.code));
        self.list.truncate(self.most);
    }

    /// Whether the file silences warnings there.
    fn is_silenced(&self, span: Span) -> bool {
        let before = self.silenced.partition_point(|line| line.start <= span.start);
        let line = before.checked_sub(1).and_then(|at| self.silenced.get(at));
        line.is_some_and(|line| span.start < line.end)
    }

    fn in_main_file(&self, span: Span) -> bool {
        let end = self.sources.files().first().map_or(0, |file| file.text.len());
        (span.start as usize) < end && span.end as usize <= end
    }

    /// The text of a span as the user wrote it.
    fn text(&self, span: Span) -> &str {
        self.sources.text(span)
    }

    /// Whether the user wrote this name here, rather than a macro that made it.
    fn is_written(&self, span: Span, name: &str) -> bool {
        self.in_main_file(span) && self.text(span) == name
    }
}

/// An edit that removes a statement, with its line if nothing else stands there.
fn removal(sources: &SourceMap, span: Span) -> Edit {
    let whole = |file: &osl_syntax::source::SourceFile| {
        let (start, end) = ((span.start - file.base) as usize, (span.end - file.base) as usize);
        let line = file.line_start(file.line_at(start))?;
        let before = file.text.get(line..start)?;
        let blank = before.len() < MAX_INDENT && before.trim().is_empty();
        let newline = file.text.get(end..)?.starts_with('\n');
        (blank && newline).then(|| Span::new(file.base + line as u32, span.end + 1))
    };
    let span = sources.file_at(span.start).and_then(whole).unwrap_or(span);
    Edit { span, text: String::new() }
}
