//! The command line: `oslrun FILE -o OUT`, `oslrun check FILE…`, `oslrun ir FILE`, `oslrun fmt FILE…`,
//! `oslrun compile FILE`, `oslrun info FILE`, `oslrun explain-error CODE`, `oslrun doc NAME`,
//! `oslrun tradeoff FILE`, `oslrun compare A B`, `oslrun picture-book FILE -o BOOK`,
//! `oslrun studio FILE`.
//!
//! `commands` lists the commands; each has a module, which declares its options. `args` holds those that
//! several share, and `session` sets up a run. Exit codes: 0 success, 1 an error in
//! the input or in its result, 2 an error in the command line. A command that fails has written no output
//! file, except a picture that misses its `--max-error`.

mod args;
mod book;
mod check;
mod clock;
mod closures;
mod commands;
mod compare;
mod compat;
mod compile;
mod console;
mod data;
mod data_url;
mod diff;
mod doc;
mod explain;
mod explain_error;
mod figures;
mod fix;
mod fmt;
mod frames;
mod group_text;
mod histogram;
mod idle;
mod info;
mod input;
mod ir;
mod json;
mod json_lines;
mod load;
mod lod;
mod map;
mod misspelt;
mod on;
mod output;
mod pages;
mod picture;
mod prefilter;
mod preview;
mod profile;
mod prove;
mod ranges;
mod reads;
mod render;
mod repair;
mod report;
mod roles;
mod rows;
mod run;
mod said;
mod sampling;
mod sanitize;
mod session;
mod shading;
mod sight;
mod software;
mod stability;
mod stdout;
mod streams;
mod studio;
mod summary;
mod surface;
mod sweep;
mod tradeoff;
mod version;
mod watch;
mod within;
mod words;

use clap::FromArgMatches;
use commands::{Cli, Command, Running};
use osl_syntax::escape::shown;
use std::ffi::OsString;
use std::io::Write;

/// Why a command failed.
#[derive(Debug)]
struct Failure {
    /// The error message for the user; empty if it was printed already.
    text: String,
    /// The exit code.
    code: u8,
    /// Whether the command wrote its output all the same.
    wrote: bool,
}

impl Failure {
    /// A failure with a message of one line.
    fn new(text: impl std::fmt::Display) -> Failure {
        Failure { text: text.to_string(), code: 1, wrote: false }
    }

    /// A failure because of the command line alone: options that exclude each other, or a value out of range.
    fn usage(text: impl std::fmt::Display) -> Failure {
        Failure { text: text.to_string(), code: 2, wrote: false }
    }

    /// A failure whose message was printed already.
    fn said() -> Failure {
        Failure { text: String::new(), code: 1, wrote: false }
    }

    /// A picture that was written, but misses its error bound, as a warning has said.
    fn missed() -> Failure {
        Failure { text: String::new(), code: 1, wrote: true }
    }
}

/// Runs the command and returns its exit code.
pub fn main(args: impl IntoIterator<Item = OsString>, out: &mut dyn Write, err: &mut dyn Write) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    match json_lines::requested(&args) {
        true => checked(args, out, &mut json_lines::JsonLines::new(err)),
        false => checked(args, out, err),
    }
}

/// Runs the command, and checks that nothing of the standard output is lost.
fn checked(args: Vec<OsString>, out: &mut dyn Write, err: &mut dyn Write) -> u8 {
    let mut out = console::Checked::new(out);
    let code = command(args, &mut out, err);
    match out.finish() {
        Ok(()) => code,
        Err(error) => {
            let _ = writeln!(err, "error: cannot write to the standard output: {error}");
            code.max(1)
        }
    }
}

/// Fails if part of the standard output was lost, so that no file is replaced. The loss is reported at the
/// end.
fn flushed(out: &mut dyn Write) -> Result<(), Failure> {
    out.flush().map_err(|_| Failure::said())
}

fn command(args: Vec<OsString>, out: &mut dyn Write, err: &mut dyn Write) -> u8 {
    if let Some(code) = compat::run(&args, out, err) {
        return code;
    }
    if let Some(text) = misspelt::command(&args) {
        let _ = writeln!(err, "error: {}", shown(&text));
        return 2;
    }
    if let Some(text) = version::asked(&args) {
        let _ = writeln!(out, "{text}");
        return 0;
    }
    if let Some(running) = Running::alone(&args) {
        return exit_code(run_shader(running, &args, out, err), err);
    }
    let parsed = idle::command_line().try_get_matches_from(&args);
    if let Some(text) = parsed.as_ref().ok().and_then(idle::refused) {
        let _ = writeln!(err, "error: {}", shown(&text));
        return 2;
    }
    let cli = match parsed.and_then(|found| Cli::from_arg_matches(&found)) {
        Ok(cli) => cli,
        Err(usage) => {
            if let Some(text) = misspelt::usage(&args, &usage) {
                let _ = writeln!(err, "error: {}", shown(&text));
                return 2;
            }
            let text = usage.render();
            // Help and version are answers, not errors.
            if usage.use_stderr() {
                let _ = write!(err, "{}", shown(&text.to_string()));
                return 2;
            }
            let _ = write!(out, "{text}");
            return 0;
        }
    };
    let result = match (cli.command, cli.run) {
        (Some(Command::Check(args)), _) => check::check(&args, out, err),
        (Some(Command::Ir(args)), _) => ir::ir(&args, out, err),
        (Some(Command::ExplainError(args)), _) => explain_error::explain(&args, out),
        (Some(Command::Explain(args)), _) => explain::explain(&args, out, err),
        (Some(Command::Stability(args)), _) => stability::stability(&args, out, err),
        (Some(Command::Sanitize(args)), _) => sanitize::sanitize(&args, out, err),
        (Some(Command::Bounds(args)), _) => prove::bounds(&args, out, err),
        (Some(Command::Compile(args)), _) => compile::compile(&args, out, err),
        (Some(Command::Info(args)), _) => info::info(&args, out, err),
        (Some(Command::Fmt(args)), _) => fmt::fmt(&args, out, err),
        (Some(Command::Doc(args)), _) => doc::doc(&args, out),
        (Some(Command::Tradeoff(args)), _) => tradeoff::tradeoff(&args, out, err),
        (Some(Command::Lod(args)), _) => lod::lod(&args, out, err),
        (Some(Command::Compare(compared)), _) => {
            let reading = compare::Reading { line: idle::command_line, refused: idle::refused };
            compare::compare(*compared, (&args, reading), out, err)
        }
        (Some(Command::PictureBook(found)), _) => book::book(&found, &args, out, err),
        (Some(Command::Studio(live)), _) => studio::studio(&live, &args, out),
        (Some(Command::Render(mut found)), _) => {
            found.command = words::text(&args, Some(&found.file));
            render::render(&found, out, err)
        }
        (Some(Command::Completions(args)), _) => pages::completions(&args, idle::command_line(), out),
        (Some(Command::Man(args)), _) => pages::man(&args, idle::command_line(), out),
        (None, running) => run_shader(running, &args, out, err),
    };
    exit_code(result, err)
}

/// Runs a shader.
fn run_shader(
    running: Running,
    args: &[OsString],
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<(), Failure> {
    let Running { mut run, frames, watch, preview, json } = running;
    run.command = words::text(args, run.file.as_deref());
    watch::run(&run, &watch, (&frames, &preview, json), out, err)
}

/// The exit code for a result, whose error is reported.
fn exit_code(result: Result<(), Failure>, err: &mut dyn Write) -> u8 {
    match result {
        Ok(()) => 0,
        Err(Failure { text, code, .. }) => {
            if !text.is_empty() {
                let _ = writeln!(err, "error: {}", shown(&text));
            }
            code
        }
    }
}
