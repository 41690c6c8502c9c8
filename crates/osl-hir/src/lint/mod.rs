//! Lints: code that compiles but probably does not do what was intended.
//!
//! They examine a program without errors: the [resolved tree](crate::hir) for meaning, the syntax tree for
//! scopes and fixes, and the sources to distinguish the user's text from the results of macros. Every lint is
//! a warning with a code `W03xx` and a [`Level`] that says when it is shown by default. Included files and
//! macro expansions are not examined.
//!
//! Some similar warnings come from resolution, because published compilers give them too: writing a read-only
//! argument (W0203), a parameter that hides a function (W0206). They are not repeated here.

mod codes;
mod codes_of_slips;
mod constants;
mod effects;
mod flow;
mod jumps;
mod loops;
mod names;
mod queries;
mod scopes;
mod spaces;
mod state;
mod usage;
mod values;
pub(crate) mod walk;
mod written;
pub use walk::{Walk, bodies, count_writes, each_stmt, walk_expressions};

pub use codes::*;

use crate::hir::Program;
use osl_limits::Limits;
use osl_syntax::Silenced;
use osl_syntax::ast::Ast;
use osl_syntax::diagnostic::{Code, Diagnostic, Edit};
use osl_syntax::source::SourceMap;
use osl_syntax::span::Span;
use rustc_hash::FxHashSet;

/// When a lint is shown by default.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// When a file is checked: correct programs may have it too, but their text is redundant or incomplete.
    Check,
    /// Always, also when the shader only runs: the result is hardly the intended one.
    Always,
}

/// A lint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lint {
    /// Its code and name.
    pub code: Code,
    /// When it is shown.
    pub level: Level,
}

/// Options of the lints.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Spaces of points or colors that the renderer defines besides the usual ones.
    pub known_spaces: Vec<String>,
    /// Lines on which the file suppresses warnings.
    pub silenced: Silenced,
    /// The limits of their findings.
    pub limits: Limits,
}

/// Maximum number of bytes before a statement that count as its indentation.
const MAX_INDENT: usize = 1000;

/// The lint with a code; `None` for codes of other stages.
pub fn find(code: Code) -> Option<&'static Lint> {
    LINTS.iter().find(|lint| lint.code == code)
}

/// Warnings that are given once per name, since a repetition adds nothing.
const ONCE: &[&str] = &["W0203", "W0313", "W0314", "W0315"];

/// Keeps the first of several equal warnings about one name.
#[derive(Clone, Debug, Default)]
pub struct OnceAName {
    seen: FxHashSet<(&'static str, String)>,
}

impl OnceAName {
    /// Whether to keep the next diagnostic of a list.
    pub fn keeps(&mut self, d: &Diagnostic) -> bool {
        let name = d.message.split(['`', '"']).nth(1).unwrap_or(&d.message);
        d.is_error() || !ONCE.contains(&d.code.id) || self.seen.insert((d.code.id, name.to_owned()))
    }
}

/// All findings of the lints in a program without errors, in source order, whatever their level.
pub fn run(ast: &Ast, program: &Program, sources: &SourceMap, options: &Options) -> Vec<Diagnostic> {
    let mut found = Findings {
        sources,
        silenced: &options.silenced,
        list: Vec::new(),
        most: usize::try_from(options.limits.compiling.findings).unwrap_or(usize::MAX),
    };
    let walk = walk::Walk::new(program);
    usage::run(ast, &walk, &mut found);
    flow::run(&walk, options.limits.compiling.watched, &mut found);
    jumps::run(&walk, &mut found);
    values::run(&walk, &mut found);
    scopes::run(ast, &mut found);
    spaces::run(&walk, options, &mut found);
    queries::run(&walk, &mut found);
    effects::run(&walk, &mut found);
    names::run(&walk, &mut found);
    written::run(ast, &mut found);
    found.without_consequences();
    found.keep_first();
    found.list
}

/// Collects the findings.
struct Findings<'a> {
    sources: &'a SourceMap,
    silenced: &'a Silenced,
    list: Vec<Diagnostic>,
    /// How many are kept.
    most: usize,
}

impl Findings<'_> {
    /// Keeps a finding of the main file.
    fn report(&mut self, diagnostic: Diagnostic) {
        if self.in_main_file(diagnostic.span) && !self.is_silenced(diagnostic.span) {
            self.list.push(diagnostic);
            // There may be one for each statement of a file.
            if self.list.len() > self.most.saturating_mul(16) {
                self.keep_first();
            }
        }
    }

    /// Drops what only follows from another finding: that a statement which is never reached has no effect,
    /// and that nothing reads a variable which a condition assigns where it should compare.
    fn without_consequences(&mut self) {
        let of = |code: &'static str| self.list.iter().filter(move |d| d.code.id == code);
        let unreachable: FxHashSet<u32> = of("W0306").map(|d| d.span.start).collect();
        let assigned: FxHashSet<&str> = of("W0309")
            .filter_map(|d| self.sources.text(d.span).split('=').next())
            .map(|target| target.trim_matches(|c: char| c == '(' || c.is_whitespace()))
            .collect();
        let sources = self.sources;
        let keep: Vec<bool> = self
            .list
            .iter()
            .map(|d| match d.code.id {
                "W0318" => !unreachable.contains(&d.span.start),
                "W0301" => !assigned.contains(sources.text(d.span)),
                _ => true,
            })
            .collect();
        let mut keep = keep.into_iter();
        self.list.retain(|_| keep.next().unwrap_or(true));
    }

    /// Keeps the findings that come first in the text.
    fn keep_first(&mut self) {
        self.list.sort_by_key(|d| (d.span.start, d.span.end, d.code));
        self.list.truncate(self.most);
    }

    /// Whether the file suppresses warnings there.
    fn is_silenced(&self, span: Span) -> bool {
        self.silenced.holds(span)
    }

    fn in_main_file(&self, span: Span) -> bool {
        let end = self.sources.files().first().map_or(0, |file| file.text.len());
        (span.start as usize) < end && span.end as usize <= end
    }

    /// The source text of a span.
    fn text(&self, span: Span) -> &str {
        self.sources.text(span)
    }

    /// Whether the user wrote this name here, as opposed to a macro.
    fn is_written(&self, span: Span, name: &str) -> bool {
        self.in_main_file(span) && self.text(span) == name
    }
}

/// An edit that removes a statement, with its line if there is nothing else on it.
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
