//! `oslrun check FILE…`.

use super::args::ReadArgs;
use super::levels::LintArgs;
use super::{Failure, input, levels, report};
use clap::Args;
use osl::stages;
use osl_hir::lint::Level;
use osl_syntax::escape::shown;
use std::io::Write;
use std::path::PathBuf;

/// Which files to check.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// Shader files.
    #[arg(required = true, value_name = "FILE.osl")]
    pub(super) files: Vec<PathBuf>,
    /// The warnings to report.
    #[command(flatten)]
    pub(super) lints: LintArgs,
    /// The options for reading the files.
    #[command(flatten)]
    pub(super) read: ReadArgs,
}

/// Reports the errors and warnings of each file; fails if there is an error.
pub(super) fn check(args: &CheckArgs, err: &mut dyn Write) -> Result<(), Failure> {
    let mut result = Ok(());
    for path in &args.files {
        let one = input::read(path, &args.read).and_then(|input| {
            let checked = stages::check(&input.name, &input.text, &input.files, &input.options);
            let list = levels::judge(&checked, Level::Check, &args.lints, args.read.limits.limits());
            report::diagnostics(&list, &checked.sources, &args.read, err)
        });
        if let Err(Failure(text)) = one {
            if !text.is_empty() {
                let _ = writeln!(err, "error: {}", shown(&text));
            }
            result = Err(Failure::said());
        }
    }
    result
}
