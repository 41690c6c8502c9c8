//! `oslrun check FILE…`: reports errors and warnings, and applies safe edits on request.

use super::{fix, many};
use crate::cli::options::heading;
use crate::cli::options::reading::{FormatArgs, LintArgs, ReadArgs};
use crate::cli::print::Console;
use clap::Args;
use osl::stages;
use osl_hir::lint::Level;
use osl_job::Failure;
use osl_job::request::Lints;
use osl_job::request::Reading;
use osl_job::source::input::{self, Input};
use osl_job::source::{diff, levels};
use osl_syntax::diagnostic::Diagnostic;
use std::path::{Path, PathBuf};

/// The code of brackets that are not closed.
const UNCLOSED: &str = "E0111";

/// Which files to check.
#[derive(Debug, Args)]
pub(in crate::cli) struct CheckArgs {
    /// Shader files. A folder stands for the .osl files in it and in the folders below it.
    #[arg(required = true, value_name = "FILE.osl")]
    files: Vec<PathBuf>,
    /// Apply the safe edits to the files, and report what remains. An edit is safe if it is the only reading
    /// of an error, or keeps what the shader computes; other suggestions are only shown.
    #[arg(long)]
    fix: bool,
    /// Show the safe edits as a diff, and write nothing.
    #[arg(long)]
    diff: bool,
    /// Let the shader include any file, not only those of its project.
    #[arg(long, help_heading = heading::FILES)]
    allow_files: bool,
    #[command(flatten)]
    lints: LintArgs,
    #[command(flatten)]
    read: ReadArgs,
    #[command(flatten)]
    format: FormatArgs,
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

/// What is asked of each file.
struct Wanted<'a> {
    args: &'a CheckArgs,
    reading: Reading,
    lints: Lints,
}

/// Reports the errors and warnings of each file; fails if there is an error.
pub(in crate::cli) fn check(args: &CheckArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let mut result = Ok(());
    let mut counts = Counts::default();
    let wanted = Wanted { args, reading: args.read.reading(), lints: args.lints.lints() };
    let files = many::files(&args.files)?;
    for path in &files {
        if let Err(Failure { text, .. }) = one(path, &wanted, &mut counts, console) {
            if !text.is_empty() {
                console.error(&text);
                counts.errors += 1;
            }
            result = Err(Failure::said());
        }
    }
    let Counts { errors, warnings, fixed, fixable, unclosed } = counts;
    if console.is_for_people() && errors + warnings + fixed > 0 {
        let fixes =
            if fixed > 0 { format!("{} applied; ", count(fixed, "fix", "fixes")) } else { String::new() };
        let (errors, warnings) = (count(errors, "error", "errors"), count(warnings, "warning", "warnings"));
        console.text(&format!("{fixes}{errors}, {warnings} in {}", count(files.len(), "file", "files")));
        if fixable > 0 && !args.fix && !args.diff {
            let edits = count(fixable, "safe edit", "safe edits");
            console.text(&format!("`--fix` applies {edits}, `--diff` shows them"));
        }
        if unclosed > 0 {
            console.text("`oslrun FILE --repair` inserts the missing brackets for a run");
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
    wanted: &Wanted<'_>,
    counts: &mut Counts,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let Wanted { args, reading, lints } = wanted;
    let mut input = input::read(path, reading)?;
    input.files = input.files.or_anywhere(args.allow_files);
    let judge = |checked: &stages::Checked| -> Vec<Diagnostic> {
        levels::judge(checked, Level::Check, lints, &reading.limits)
    };
    if args.diff || args.fix {
        let check = |text: &str| stages::check(&input.name, text, &input.files, &input.options);
        let fixed = fix::fix(&input.text, check, judge);
        if args.diff {
            show(&input, &fixed.text, console);
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
    console.folded(&list, &checked.sources, lints)
}

/// Prints the difference between a file and its fixed text.
fn show(input: &Input, fixed: &str, console: &mut Console<'_>) {
    console.escaped(&diff::unified(&input.name, (&input.text, fixed), "fixed"));
}
