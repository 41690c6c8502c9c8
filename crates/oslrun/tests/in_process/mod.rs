//! Runs command lines in the process of the test.

#![allow(dead_code, reason = "each test uses what it needs")]

use std::ffi::OsString;
use std::path::Path;

/// Exit code, standard output and standard error of these arguments.
pub(crate) fn oslrun(args: &[&str]) -> (u8, String, String) {
    run(args.iter().map(Into::into).collect())
}

/// Exit code, standard output and standard error of a command line whose words are separated by spaces; `@`
/// is the folder, in both directions.
pub(crate) fn oslrun_at(folder: &Path, line: &str) -> (u8, String, String) {
    let folder = folder.to_str().unwrap();
    let args = line.split_whitespace().map(|word| word.replace('@', folder).into()).collect();
    let (code, out, err) = run(args);
    (code, out.replace(folder, "@"), err.replace(folder, "@"))
}

fn run(args: Vec<OsString>) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let all = std::iter::once("oslrun".into()).chain(args);
    let code = oslrun::cli::main(all, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}
