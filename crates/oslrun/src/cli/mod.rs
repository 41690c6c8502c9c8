//! The command line: `oslrun FILE -o OUT`, `oslrun check FILE…`, `oslrun ir FILE`, `oslrun fmt FILE…`,
//! `oslrun compile FILE`, `oslrun info FILE`, `oslrun explain-error CODE`, `oslrun doc NAME`,
//! `oslrun tradeoff FILE`, `oslrun compare A B`, `oslrun picture-book FILE -o BOOK`,
//! `oslrun studio FILE`.
//!
//! `commands` lists the commands. Each has a module in a room of its family: `source`, `editor`, `picture`,
//! `measure` and `help`; `compat` has the command lines of the reference's tools. A module declares the
//! options of its command from the groups in `options`, turns them into a request of `osl_job`, and prints
//! the result with `print`. Exit codes: 0 success, 1 an error in the input or in its result, 2 an error in
//! the command line. A command that fails has written no output file, except a picture that misses its
//! `--max-error`.

mod commands;
mod compat;
mod editor;
mod help;
mod measure;
mod options;
mod picture;
mod print;
mod source;

pub use help::reference;
pub use print::{plain, rejected};

use clap::{CommandFactory, FromArgMatches};
use commands::{Cli, Command};
use help::{doc, explain_error, misspelt, pages, version};
use measure::{bounds, explain, lod, sanitize, stability, tradeoff};
use options::reading;
use osl_job::Failure;
use picture::{bake, book, compare, render, run, studio};
use print::{Console, Manner, checked, manner};
use source::{check, compile, deps, dialects, fmt, info, ir, portability};
use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;

/// Runs the command and returns its exit code. Nothing of the standard output is lost in silence.
pub fn main(args: impl IntoIterator<Item = OsString>, out: &mut dyn Write, err: &mut dyn Write) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let manner = manner(&args);
    let mut out = checked::Checked::new(out);
    let code = command(&args, &mut out, err, manner);
    match out.finish() {
        Ok(()) => code,
        Err(error) => {
            let why = format!("cannot write to the standard output: {error}");
            Console::new(&mut std::io::sink(), err, manner).error(&why);
            code.max(1)
        }
    }
}

fn command(args: &[OsString], out: &mut dyn Write, err: &mut dyn Write, manner: Manner) -> u8 {
    if let Some(code) = compat::run(args, out, err) {
        return code;
    }
    let console = &mut Console::new(out, err, manner);
    if let Some(text) = misspelt::command(args, Cli::command) {
        console.error(&text);
        return 2;
    }
    if let Some(text) = version::asked(args) {
        console.report(&format!("{text}\n"));
        return 0;
    }
    if let Some((own, deps)) = commands::run_alone(args) {
        let result = run::run(&own, args, console).and_then(|()| deps::write(deps));
        return exit_code(result, console);
    }
    match parsed(args) {
        Ok((cli, deps)) => {
            let result = answered(&cli, args, console).and_then(|()| deps::write(deps));
            exit_code(result, console)
        }
        Err(Unread::Wrong(text)) => {
            console.error(&text);
            2
        }
        Err(Unread::Usage(text)) => {
            console.usage(&text);
            2
        }
        Err(Unread::Help(text)) => {
            console.report(&text);
            0
        }
    }
}

/// Why a command line is not that of a command to run.
enum Unread {
    /// A message of this program.
    Wrong(String),
    /// A message of the option parser.
    Usage(String),
    /// Help or a version was asked for.
    Help(String),
}

/// Reads the command line. The second value is the file of `--deps`.
fn parsed(args: &[OsString]) -> Result<(Cli, Option<PathBuf>), Unread> {
    let line = Cli::command();
    let found = line.clone().try_get_matches_from(args);
    if let Some((compare::NAME, options)) = found.as_ref().ok().and_then(clap::ArgMatches::subcommand)
        && let Some(text) = compare::refused(options, &line)
    {
        return Err(Unread::Wrong(text));
    }
    let read = |found| Ok((Cli::from_arg_matches(&found)?, reading::deps(&found)));
    found.and_then(read).map_err(|usage| {
        if let Some(text) = misspelt::usage(args, &usage, &line) {
            return Unread::Wrong(text);
        }
        let text = usage.render().to_string();
        if usage.use_stderr() { Unread::Usage(text) } else { Unread::Help(text) }
    })
}

/// Runs a command.
fn answered(cli: &Cli, args: &[OsString], console: &mut Console<'_>) -> Result<(), Failure> {
    match &cli.command {
        Some(Command::Check(own)) => check::check(own, console),
        Some(Command::Ir(own)) => ir::ir(own, console),
        Some(Command::ExplainError(own)) => explain_error::explain(own, console.out),
        Some(Command::Explain(own)) => explain::explain(own, console),
        Some(Command::Stability(own)) => stability::stability(own, console),
        Some(Command::Sanitize(own)) => sanitize::sanitize(own, console),
        Some(Command::Bounds(own)) => bounds::bounds(own, console),
        Some(Command::Compile(own)) => compile::compile(own, console),
        Some(Command::Info(own)) => info::info(own, console),
        Some(Command::Dialects(own)) => dialects::dialects(own, console),
        Some(Command::Portability(own)) => portability::portability(own, console),
        Some(Command::Fmt(own)) => fmt::fmt(own, console),
        Some(Command::Lsp(own)) => editor::lsp(own),
        Some(Command::Doc(own)) => doc::doc(own, console.out),
        Some(Command::Tradeoff(own)) => tradeoff::tradeoff(own, console),
        Some(Command::Lod(own)) => lod::lod(own, console),
        Some(Command::Compare(own)) => compare::compare(own, args, Cli::command, console),
        Some(Command::Bake(own)) => bake::bake(own, args, console),
        Some(Command::PictureBook(own)) => book::book(own, args, console),
        Some(Command::Studio(own)) => studio::studio(own, args, console),
        Some(Command::Render(own)) => render::render(own, args, console),
        Some(Command::Completions(own)) => pages::completions(own, Cli::command(), console.out),
        Some(Command::Man(own)) => pages::man(own, Cli::command(), console.out),
        None => run::run(&cli.run, args, console),
    }
}

/// The exit code for a result, whose error is reported.
fn exit_code(result: Result<(), Failure>, console: &mut Console<'_>) -> u8 {
    match result {
        Ok(()) => 0,
        Err(Failure { text, code, .. }) => {
            if !text.is_empty() {
                console.error(&text);
            }
            code
        }
    }
}
