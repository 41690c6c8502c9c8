//! `-W`, `-A`, `--deny`: which warnings are shown, and which of them are errors.
//!
//! A name or code on the command line takes precedence over `all` and `warnings`; if several options apply,
//! the most severe one counts. Errors cannot be silenced.

use crate::lessons;
use crate::pipeline::{self, Checked};
use clap::Args;
use osl_ir::lint::{self, Level};
use osl_limits::Limits;
use osl_syntax::diagnostic::{Code, Diagnostic, Severity};

/// The options for warnings.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct LintArgs {
    /// Show a warning that is not shown by default; by name or code, or `all`. May be repeated. `-Werror` is
    /// `--deny warnings`.
    #[arg(short = 'W', long = "warn", value_name = "NAME", value_parser = warning_or_error)]
    warn: Vec<String>,
    /// Silence a warning; by name or code, or `all`. May be repeated.
    #[arg(short = 'A', long = "allow", value_name = "NAME", value_parser = warning)]
    allow: Vec<String>,
    /// Turn a warning into an error; by name or code, `warnings` for all that are shown, or `all`. May be
    /// repeated. `errors`: if a shader reports an error while it runs, the run fails and no image is written.
    #[arg(long, value_name = "NAME", value_parser = denied)]
    deny: Vec<String>,
    /// A coordinate or color space that the renderer knows. May be repeated.
    #[arg(long, value_name = "NAME")]
    known_space: Vec<String>,
}

impl LintArgs {
    /// Whether errors of a running shader fail the run.
    pub(super) fn denies_errors(&self) -> bool {
        self.deny.iter().any(|name| name == "errors")
    }
}

/// The diagnostics of a checked file and its lints of at least this level, filtered by the command line and
/// bounded by the limits.
pub(super) fn judge(checked: &Checked, level: Level, args: &LintArgs, limits: &Limits) -> Vec<Diagnostic> {
    let options = lint::Options {
        known_spaces: args.known_space.clone(),
        limits: limits.clone(),
        ..lint::Options::default()
    };
    let mut list = sift(checked.diagnostics.clone(), args);
    let mut explained: Vec<Code> = Vec::new();
    for found in pipeline::lint(checked, &options) {
        let shown = lint::find(found.code).is_some_and(|l| l.level >= level);
        let Some(mut found) = verdict(found, shown, args) else { continue };
        if !explained.contains(&found.code) {
            explained.push(found.code);
            let Code { id, name } = found.code;
            found = found.note(format!("`oslrun explain-error {id}` tells more, `-A {name}` silences it"));
        }
        list.push(found);
    }
    lint::once_a_name(&mut list);
    list
}

/// Filters diagnostics as the command line requests.
pub(super) fn sift(list: Vec<Diagnostic>, args: &LintArgs) -> Vec<Diagnostic> {
    list.into_iter().filter_map(|d| verdict(d, true, args)).collect()
}

/// The diagnostic in the form to show, or `None` if it is silenced.
fn verdict(mut d: Diagnostic, by_default: bool, args: &LintArgs) -> Option<Diagnostic> {
    if d.is_error() {
        return Some(d);
    }
    let named = |list: &[String]| {
        list.iter().any(|n| n.eq_ignore_ascii_case(d.code.id) || n.eq_ignore_ascii_case(d.code.name))
    };
    let has = |list: &[String], word: &str| list.iter().any(|n| n == word);
    let denied_by = if named(&args.deny) {
        Some(d.code.name)
    } else if named(&args.warn) {
        None
    } else if named(&args.allow) || has(&args.allow, "all") || has(&args.allow, "warnings") {
        return None;
    } else if has(&args.deny, "all") {
        Some("all")
    } else if !by_default && !has(&args.warn, "all") {
        return None;
    } else {
        (has(&args.deny, "warnings") || has(&args.warn, "error")).then_some("warnings")
    };
    if let Some(by) = denied_by {
        d.severity = Severity::Error;
        d = d.note(format!("an error because of `--deny {by}`"));
    }
    Some(d)
}

fn denied(text: &str) -> Result<String, String> {
    if text == "errors" { Ok(text.to_string()) } else { warning(text) }
}

fn warning_or_error(text: &str) -> Result<String, String> {
    if text == "error" { Ok(text.to_string()) } else { warning(text) }
}

fn warning(text: &str) -> Result<String, String> {
    let general = ["all", "warnings"];
    if general.contains(&text) {
        return Ok(text.to_string());
    }
    let codes = || lessons::codes().into_iter();
    let fits = |code: &Code| text.eq_ignore_ascii_case(code.id) || text.eq_ignore_ascii_case(code.name);
    if codes().any(|code| code.id.starts_with('W') && fits(&code)) {
        return Ok(text.to_string());
    }
    if codes().any(|code| fits(&code)) {
        return Err("that is an error, and stays one".to_string());
    }
    match lessons::closest(text).first().filter(|code| code.id.starts_with('W')) {
        Some(close) => Err(format!("no such warning; there is one named `{}`", close.name)),
        None => Err("no such warning; `oslrun explain-error --list` lists them".to_string()),
    }
}
