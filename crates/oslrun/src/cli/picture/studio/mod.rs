//! `oslrun studio FILE`: a live page about a shader.
//!
//! The crate osl-studio has the server and the page; [`subject`] answers its questions with the functions
//! that also make the pictures and explanations of the other commands, [`picture`] those about a picture and
//! [`line`] those about a line; [`save`] writes the file. This module reads the command line, starts the
//! server and opens the browser.

mod cost;
mod difference;
mod export;
mod line;
mod outside;
mod picture;
mod rounding;
mod samples;
mod save;
mod subject;
mod told;

use super::words::Left;
use crate::cli::options::picture::DisplayArgs;
use crate::cli::options::points::{DataArgs, GridArgs, OnArgs, SceneArgs};
use crate::cli::options::running::{ArithmeticArgs, RunningArgs};
use crate::cli::options::samples::SampleArgs;
use crate::cli::options::shader::{NetworkArgs, OutputsArgs, ShaderArgs};
use crate::cli::print::Console;
use clap::{Arg, Args};
use osl_job::request::{Output, Points, Running};
use osl_job::{Failure, Image, Sink};
use osl_studio::{Options, Server, Token};
use std::ffi::OsString;
use std::io::IsTerminal;
use std::path::Path;
use std::process::Stdio;
use subject::Studio;

/// The name of the command.
const NAME: &str = "studio";

/// What to show, and where.
#[derive(Debug, Args)]
#[command(
    mut_arg("file", |arg| described(arg, "The shader: a source, a compiled shader (.oso), or the text of a group")),
    mut_arg("outputs", |arg| described(arg, "The output to show first")),
    mut_arg("params", |arg| described(arg, "Value of a parameter at the start; may be repeated")),
)]
pub(in crate::cli) struct StudioArgs {
    /// The port of the page on this machine (default: any that is free).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    port: Option<u16>,
    /// The secret in the page's address (default: a random one). With a fixed port and a fixed secret, an
    /// open page connects again after the command was started again.
    #[arg(long, value_name = "TEXT", value_parser = token, env = "OSLRUN_STUDIO_TOKEN", hide_env_values = true)]
    token: Option<Token>,
    /// Do not open the browser: only print the address.
    #[arg(long)]
    no_open: bool,
    #[command(flatten)]
    shader: ShaderArgs,
    #[command(flatten)]
    network: NetworkArgs,
    #[command(flatten)]
    outputs: OutputsArgs,
    #[command(flatten)]
    display: DisplayArgs,
    #[command(flatten)]
    grid: GridArgs,
    #[command(flatten)]
    on: OnArgs,
    #[command(flatten)]
    samples: SampleArgs,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    data: DataArgs,
    #[command(flatten)]
    arithmetic: ArithmeticArgs,
    #[command(flatten)]
    running: RunningArgs,
}

impl StudioArgs {
    fn image(&self) -> Image {
        let mut shader = self.shader.shader(Some(&self.network));
        shader.outputs = self.outputs.names();
        let running = self.running.running();
        Image {
            shader,
            points: Points { surface: self.on.surface(), ..self.grid.points() },
            provided: self.scene.provided(Some(&self.data)),
            sampling: self.samples.sampling(None),
            running: Running { arithmetic: self.arithmetic.chosen(), ..running },
            output: Output { display: self.display.display(), ..Output::default() },
            ..Image::default()
        }
    }
}

/// An option with another description than in a run.
fn described(arg: Arg, help: &'static str) -> Arg {
    arg.help(help).long_help(help)
}

fn token(text: &str) -> Result<Token, String> {
    Token::chosen(text)
}

/// Shows the page until the command is ended.
pub(in crate::cli) fn studio(
    args: &StudioArgs,
    words: &[OsString],
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let Some(file) = args.shader.file() else {
        return Err(Failure::usage("name the shader to show: oslrun studio FILE.osl"));
    };
    if !file.is_file() {
        return Err(Failure::new(format!("cannot read {}: there is no such file", file.display())));
    }
    let words = picture_words(words, file);
    let server = Server::new(Options { port: args.port, token: args.token.clone() }).map_err(Failure::new)?;
    let url = server.url();
    console
        .report(&format!("{url}\nThe page is open only to this machine and this address. Ctrl-C ends it.\n"));
    console.settle()?;
    if !args.no_open && std::io::stdout().is_terminal() && !open(&url) {
        console.report("No browser could be opened: copy the address.\n");
        console.settle()?;
    }
    let (image, limits) = (args.image(), args.shader.limits_until());
    server.run(move || Box::new(Studio::new(image.clone(), limits.clone(), words.clone())));
    Ok(())
}

/// Asks the system to open an address in the browser.
fn open(url: &str) -> bool {
    let (program, before): (_, &[&str]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("cmd", &["/C", "start", ""]),
        _ => ("xdg-open", &[]),
    };
    let mut command = std::process::Command::new(program);
    let command = command.args(before).arg(url).stdin(Stdio::null()).stdout(Stdio::null());
    command.stderr(Stdio::null()).spawn().is_ok()
}

/// Options that the page or the server has.
const OWN: Left = Left {
    valued: &["--port", "--token", "-p", "--param", "--outputs", "--on", "-o", "--output"],
    alone: &["--no-open"],
};

/// The words of the command line of a picture that the page does not set: the program, and the other options.
fn picture_words(words: &[OsString], file: &Path) -> Vec<String> {
    let words = words.iter().skip(1).map(|word| word.to_string_lossy().into_owned());
    let (mut command, mut file) = (Some(NAME.to_string()), Some(file.to_string_lossy().into_owned()));
    let is_kept = |word: &String| {
        let gone = if command.as_ref() == Some(word) { &mut command } else { &mut file };
        let is_gone = gone.as_ref() == Some(word);
        if is_gone {
            *gone = None;
        }
        !is_gone
    };
    let kept = OWN.removed(words).into_iter().filter(is_kept);
    std::iter::once("oslrun".to_string()).chain(kept).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_of_a_picture_are_those_that_the_page_does_not_set() {
        let kept = |line: &str| {
            let words: Vec<OsString> = line.split(' ').map(Into::into).collect();
            picture_words(&words, Path::new("a.osl")).join(" ")
        };
        assert_eq!(
            kept("x/oslrun studio a.osl -g 8x8 --port 80 -p a=1 -I studio"),
            "oslrun -g 8x8 -I studio"
        );
        assert_eq!(
            kept("oslrun studio -pb=2 --param=c=3 --port=80 a.osl --no-open --center"),
            "oslrun --center"
        );
        assert_eq!(
            kept("oslrun studio a.osl --on sphere --outputs f --texture-path t"),
            "oslrun --texture-path t"
        );
    }
}
