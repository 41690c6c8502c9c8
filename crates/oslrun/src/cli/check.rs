//! `oslrun check FILE…`: reports errors and warnings, and applies safe edits on request.

use super::args::levels::{self, LintArgs};
use super::args::{MessageFormat, ReadArgs, heading};
use super::input::Input;
use super::{Failure, diff, fix, input, report};
use clap::Args;
use osl::stages;
use osl_hir::lint::Level;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::escape::shown;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The code of brackets that are not closed.
const UNCLOSED: &str = "E0111";

/// Which files to check.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// Shader files.
    #[arg(required = true, value_name = "FILE.osl")]
    pub(super) files: Vec<PathBuf>,
    /// Apply the safe edits to the files, and report what remains. An edit is safe if it is the only reading
    /// of an error, or keeps what the shader computes; other suggestions are only shown.
    #[arg(long)]
    pub(super) fix: bool,
    /// Show the safe edits as a diff, and write nothing.
    #[arg(long)]
    pub(super) diff: bool,
    /// Let the shader include any file, not only those of its project.
    #[arg(long, help_heading = heading::FILES)]
    pub(super) allow_files: bool,
    /// The warnings to report.
    #[command(flatten)]
    pub(super) lints: LintArgs,
    /// The options for reading the files.
    #[command(flatten)]
    pub(super) read: ReadArgs,
}

/// What was found in all files.
#[derive(Default)]
struct Counts {
    errors: usize,
    warnings: usize,
    fixed: usize,
    /// Safe edits that `--fix` would apply.
    fixable: usize,
    /// Files whose missing brackets `--repair` would insert.
    unclosed: usize,
}

/// Reports the errors and warnings of each file; fails if there is an error.
pub(super) fn check(args: &CheckArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let mut result = Ok(());
    let mut counts = Counts::default();
    for path in &args.files {
        if let Err(Failure { text, .. }) = one(path, args, &mut counts, (out, err)) {
            if !text.is_empty() {
                let _ = writeln!(err, "error: {}", shown(&text));
                counts.errors += 1;
            }
            result = Err(Failure::said());
        }
    }
    let n_files = args.files.len();
    let Counts { errors, warnings, fixed, fixable, unclosed } = counts;
    if args.read.message_format == MessageFormat::Human && errors + warnings + fixed > 0 {
        let fixes =
            if fixed > 0 { format!("{} applied; ", count(fixed, "fix", "fixes")) } else { String::new() };
        let (errors, warnings) = (count(errors, "error", "errors"), count(warnings, "warning", "warnings"));
        let _ = writeln!(err, "{fixes}{errors}, {warnings} in {}", count(n_files, "file", "files"));
        if fixable > 0 && !args.fix && !args.diff {
            let _ = writeln!(
                err,
                "`--fix` applies {}, `--diff` shows them",
                count(fixable, "safe edit", "safe edits")
            );
        }
        if unclosed > 0 {
            let _ = writeln!(err, "`oslrun FILE --repair` inserts the missing brackets for a run");
        }
    }
    result
}

fn count(n: usize, one: &str, many: &str) -> String {
    match n {
        0 => format!("no {many}"),
        1 => format!("1 {one}"),
        n => format!("{n} {many}"),
    }
}

/// Checks one file, and fixes it if requested.
fn one(
    path: &Path,
    args: &CheckArgs,
    counts: &mut Counts,
    (out, err): (&mut dyn Write, &mut dyn Write),
) -> Result<(), Failure> {
    let mut input = input::read(path, &args.read)?;
    input.files = input.files.or_anywhere(args.allow_files);
    let judge = |checked: &stages::Checked| -> Vec<Diagnostic> {
        levels::judge(checked, Level::Check, &args.lints, args.read.limits.limits())
    };
    if args.diff || args.fix {
        let fixed = fix::fix(&input, judge);
        if args.diff {
            show(&input, &fixed.text, out)?;
        } else if fixed.applied > 0 {
            osl_files::rewrite(path, &input.encoded(&fixed.text)?).map_err(Failure::new)?;
            counts.fixed += fixed.applied;
            input.text = fixed.text;
        }
    }
    let checked = stages::check(&input.name, &input.text, &input.files, &input.options);
    let list = judge(&checked);
    let safe = |d: &&Diagnostic| d.fixes.first().is_some_and(|fix| fix.safe);
    counts.fixable += list.iter().filter(safe).count();
    let is_unclosed = |d: &Diagnostic| d.code.id == UNCLOSED && !d.fixes.is_empty();
    counts.unclosed += usize::from(list.iter().any(is_unclosed));
    counts.errors += list.iter().filter(|d| d.is_error()).count();
    counts.warnings += list.iter().filter(|d| !d.is_error()).count();
    report::folded(&list, &checked.sources, (&args.read, &args.lints), err)
}

/// Prints the difference between a file and its fixed text.
fn show(input: &Input, fixed: &str, out: &mut dyn Write) -> Result<(), Failure> {
    let diff = diff::unified(&input.name, (&input.text, fixed), "fixed");
    write!(out, "{}", shown(&diff)).map_err(|e| Failure::new(format!("cannot write: {e}")))
}
