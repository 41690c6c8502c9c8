//! `-W`, `-A`, `--deny`: which warnings are shown, and which of them are errors.
//!
//! A name or code on the command line takes precedence over `all` and `warnings`; if several options apply,
//! the most severe one counts. Errors cannot be silenced.

use crate::request::Lints;
use osl::Verdict;
use osl::stages::{self, Checked};
use osl_hir::lint::Level;
use osl_limits::Limits;
use osl_syntax::diagnostic::Diagnostic;

/// The diagnostics of a checked file and its lints of at least this level, filtered by the command line and
/// bounded by the limits.
pub fn judge(checked: &Checked, level: Level, image: &Lints, limits: &Limits) -> Vec<Diagnostic> {
    let judged = stages::judge(checked, &image.levels(), |lint| lint.level >= level, limits);
    judged.into_iter().map(|(found, verdict)| denied_by(found, verdict)).collect()
}

/// Filters diagnostics as the command line requests.
pub fn sift(list: Vec<Diagnostic>, image: &Lints) -> Vec<Diagnostic> {
    stages::sift(list, &image.levels()).into_iter().map(|(d, verdict)| denied_by(d, verdict)).collect()
}

/// The diagnostic, with a note about the option that makes it an error.
fn denied_by(d: Diagnostic, verdict: Verdict) -> Diagnostic {
    match verdict {
        Verdict::Deny(by) => d.note(format!("an error because of `--deny {by}`")),
        Verdict::Show | Verdict::Hide => d,
    }
}
