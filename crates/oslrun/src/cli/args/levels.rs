//! `-W`, `-A`, `--deny`: which warnings are shown, and which of them are errors.
//!
//! A name or code on the command line takes precedence over `all` and `warnings`; if several options apply,
//! the most severe one counts. Errors cannot be silenced.

use super::heading;
use clap::Args;
use osl::stages::{self, Checked};
use osl::{Levels, NoWarning, Verdict};
use osl_hir::lint::Level;
use osl_limits::Limits;
use osl_syntax::diagnostic::{Code, Diagnostic};

/// The options for warnings.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct LintArgs {
    /// Show a warning that is not shown by default; by name or code, or `all`. May be repeated. `-Werror` is
    /// `--deny warnings`.
    #[arg(short = 'W', long = "warn", value_name = "NAME", value_parser = warning_or_error, help_heading = heading::MESSAGES)]
    warn: Vec<String>,
    /// Silence a warning; by name or code, or `all`. May be repeated.
    #[arg(short = 'A', long = "allow", value_name = "NAME", value_parser = warning, help_heading = heading::MESSAGES)]
    allow: Vec<String>,
    /// Turn a warning into an error; by name or code, `warnings` for all that are shown, or `all`. May be
    /// repeated. `errors`: if a shader reports an error while it runs, the run fails and no image is written.
    #[arg(long, value_name = "NAME", value_parser = denied, help_heading = heading::MESSAGES)]
    deny: Vec<String>,
    /// A coordinate or color space that the renderer knows. May be repeated.
    #[arg(long, value_name = "NAME", help_heading = heading::MESSAGES)]
    known_space: Vec<String>,
}

impl LintArgs {
    /// Whether errors of a running shader fail the run.
    pub(in crate::cli) fn denies_errors(&self) -> bool {
        self.deny.iter().any(|name| name == "errors")
    }

    /// Whether the command line asks for this warning, by name, by code or with all others.
    pub(in crate::cli) fn asks_for(&self, code: Code) -> bool {
        let fits = |word: &String| {
            word == "all" || word.eq_ignore_ascii_case(code.id) || word.eq_ignore_ascii_case(code.name)
        };
        self.warn.iter().any(fits)
    }

    /// The levels that the command line sets.
    fn levels(&self) -> Levels {
        let mut levels = Levels::default();
        levels.warn.clone_from(&self.warn);
        levels.allow.clone_from(&self.allow);
        levels.deny.clone_from(&self.deny);
        levels.known_spaces.clone_from(&self.known_space);
        // `-Werror`.
        if self.warn.iter().any(|word| word == "error") {
            levels.deny.push("warnings".to_string());
        }
        levels
    }
}

/// The diagnostics of a checked file and its lints of at least this level, filtered by the command line and
/// bounded by the limits.
pub(in crate::cli) fn judge(
    checked: &Checked,
    level: Level,
    args: &LintArgs,
    limits: &Limits,
) -> Vec<Diagnostic> {
    let judged = stages::judge(checked, &args.levels(), |lint| lint.level >= level, limits);
    judged.into_iter().map(|(found, verdict)| denied_by(found, verdict)).collect()
}

/// Filters diagnostics as the command line requests.
pub(in crate::cli) fn sift(list: Vec<Diagnostic>, args: &LintArgs) -> Vec<Diagnostic> {
    stages::sift(list, &args.levels()).into_iter().map(|(d, verdict)| denied_by(d, verdict)).collect()
}

/// The diagnostic, with a note about the option that makes it an error.
fn denied_by(d: Diagnostic, verdict: Verdict) -> Diagnostic {
    match verdict {
        Verdict::Deny(by) => d.note(format!("an error because of `--deny {by}`")),
        Verdict::Show | Verdict::Hide => d,
    }
}

fn denied(text: &str) -> Result<String, String> {
    if text == "errors" { Ok(text.to_string()) } else { warning(text) }
}

fn warning_or_error(text: &str) -> Result<String, String> {
    if text == "error" { Ok(text.to_string()) } else { warning(text) }
}

fn warning(text: &str) -> Result<String, String> {
    match osl::check_warning(text) {
        Ok(()) => Ok(text.to_string()),
        Err(NoWarning::Unknown(None)) => {
            Err("no such warning; `oslrun explain-error --list` lists them".to_string())
        }
        Err(why) => Err(why.to_string()),
    }
}
