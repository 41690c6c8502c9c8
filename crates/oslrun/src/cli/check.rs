//! `oslrun check FILE…`.

use super::args::CheckArgs;
use super::{Failure, input, levels, report};
use crate::pipeline;
use osl_ir::lint::Level;
use osl_syntax::escape::shown;
use std::io::Write;

/// Reports the errors and warnings of each file; fails if there is an error.
pub(super) fn check(args: &CheckArgs, err: &mut dyn Write) -> Result<(), Failure> {
    let mut result = Ok(());
    for path in &args.files {
        let one = input::read(path, &args.read).and_then(|input| {
            let checked = pipeline::check(&input.name, &input.text, &input.files, &input.options);
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
