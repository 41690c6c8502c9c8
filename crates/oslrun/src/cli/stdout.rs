//! The standard output of a run: text, the object of `--json`, or the picture of `-o -`. This module must not
//! know how a shader runs.

use super::args::RunArgs;
use super::args::values::STDOUT;
use super::preview::PreviewArgs;
use super::reads::Reads;
use super::streams::Streams;
use super::summary::About;
use super::{Failure, console, sweep};
use std::io::Write;

/// Runs a shader. With `json`, the standard output gets one object; if it gets the picture, text goes to the
/// standard error.
pub(super) fn run(
    args: &RunArgs,
    lit: &PreviewArgs,
    json: bool,
    reads: Option<&mut Reads>,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<(), Failure> {
    args.display.check(args.output.as_deref())?;
    let piped = args.output.as_deref().is_some_and(|path| path.as_os_str() == STDOUT);
    if piped && json {
        return Err(Failure::usage("--json and the picture of `-o -` do not fit on one standard output"));
    }
    if piped && console::is_terminal() {
        return Err(Failure::usage(
            "`-o -` writes the bytes of a picture, which a terminal cannot show: pipe it, or name a file",
        ));
    }
    let (mut text, mut picture) = (Vec::new(), Vec::new());
    let mut about = About::default();
    if !piped && !json {
        return sweep::run(
            args,
            lit,
            None,
            &mut Streams { out, err, picture: &mut picture, kept: None, first: None, reads, more_taps: None },
        );
    }
    let streams = &mut Streams {
        out: &mut text,
        err: &mut *err,
        picture: &mut picture,
        kept: None,
        first: None,
        reads,
        more_taps: None,
    };
    let result = sweep::run(args, lit, json.then_some(&mut about), streams);
    if json {
        about.printed = String::from_utf8_lossy(&text).into_owned();
        if let Err(failure) = &result
            && !failure.wrote
        {
            return result;
        }
        let _ = writeln!(out, "{}", serde_json::to_string_pretty(&about).map_err(Failure::new)?);
        return result;
    }
    let _ = err.write_all(&text);
    let _ = out.write_all(&picture);
    result
}
