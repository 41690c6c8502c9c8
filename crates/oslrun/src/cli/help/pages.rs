//! `oslrun completions SHELL` and `oslrun man [COMMAND]`: what a package installs beside the command.
//!
//! Both are made from the declared options.

use clap::{Args, Command};
use clap_complete::Shell;
use osl_job::Failure;
use osl_syntax::spelling::closest;
use std::io::Write;

/// The shell.
#[derive(Debug, Args)]
pub(in crate::cli) struct CompletionArgs {
    /// The shell: bash, zsh, fish, elvish or powershell. Bash loads the text with
    /// `source <(oslrun completions bash)`.
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

/// The manual page.
#[derive(Debug, Args)]
pub(in crate::cli) struct ManArgs {
    /// A command, such as check (default: oslrun itself). `oslrun man check | man -l -` displays its page.
    #[arg(value_name = "COMMAND")]
    command: Option<String>,
}

/// Prints the completions of a shell for the command line.
pub(in crate::cli) fn completions(
    args: &CompletionArgs,
    mut line: Command,
    out: &mut dyn Write,
) -> Result<(), Failure> {
    // The generator panics if it cannot write, so it writes to memory.
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut line, "oslrun", &mut text);
    let _ = out.write_all(&text);
    Ok(())
}

/// Prints a manual page of the command line.
pub(in crate::cli) fn man(args: &ManArgs, mut line: Command, out: &mut dyn Write) -> Result<(), Failure> {
    line.build();
    let page = match &args.command {
        None => line,
        Some(name) => match line.get_subcommands().find(|command| command.get_name() == name) {
            Some(found) => found.clone(),
            None => {
                let names = line.get_subcommands().map(Command::get_name);
                let close =
                    closest(name, names).map_or_else(String::new, |c| format!("; did you mean `{c}`?"));
                return Err(Failure::new(format!("there is no command `{name}`{close}")));
            }
        },
    };
    let mut text = Vec::new();
    clap_mangen::Man::new(page).render(&mut text).map_err(Failure::new)?;
    let _ = out.write_all(&text);
    Ok(())
}
