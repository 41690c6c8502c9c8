//! Command lines that clap would read as something else: a misspelt command is a file name to it, and several
//! shaders are a command that does not fit.

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Error};
use osl_syntax::spelling::closest;
use std::ffi::OsString;
use std::path::Path;

/// The message for a first word that is neither a command nor a file, but looks like a command.
pub(in crate::cli) fn command(args: &[OsString], line: fn() -> Command) -> Option<String> {
    let word = args.get(1)?.to_str()?;
    let is_word = !word.is_empty() && word.chars().all(|c| c.is_ascii_lowercase() || c == '-' || c == '_');
    if !is_word || word.starts_with('-') || Path::new(word).exists() {
        return None;
    }
    let all = line();
    let names: Vec<&str> = all.get_subcommands().map(clap::Command::get_name).chain(["help"]).collect();
    if names.contains(&word) {
        return None;
    }
    let word = word.replace('_', "-");
    if let Some(same) = names.iter().find(|name| **name == word) {
        return Some(format!("there is no command `{}`; did you mean `{same}`?", args.get(1)?.to_str()?));
    }
    if args.get(2).is_some_and(is_shader)
        && let Some(option) = all.get_arguments().filter_map(clap::Arg::get_long).find(|long| *long == word)
    {
        let file = args.get(2)?.to_string_lossy();
        return Some(format!("there is no command `{word}`, but an option: `oslrun {file} --{option}`"));
    }
    let close = closest(&word, names.iter().copied())?;
    Some(format!("there is no file and no command `{word}`; did you mean `{close}`?"))
}

fn is_shader(word: &OsString) -> bool {
    Path::new(word).extension().is_some_and(|ending| ending == "osl" || ending == "oso")
}

/// The message for `-p NAME VALUE`, without the `=`.
fn split_value(args: &[OsString]) -> Option<String> {
    args.windows(3).find_map(|words| {
        let [option, name, value] = words else { return None };
        let (name, value) = (name.to_str()?, value.to_str()?);
        let is_param = option == "-p" || option == "--param";
        (is_param && !name.contains('=') && !value.starts_with('-'))
            .then(|| format!("a parameter and its value are one word: `-p {name}={value}`"))
    })
}

/// The message for an option of a run in another command.
fn of_a_run(args: &[OsString], error: &Error, all: &Command) -> Option<String> {
    if error.kind() != ErrorKind::UnknownArgument {
        return None;
    }
    let Some(ContextValue::String(given)) = error.get(ContextKind::InvalidArg) else { return None };
    let name = given.split(['=', ' ']).next()?;
    let command =
        all.get_subcommands().find(|command| args.get(1).is_some_and(|word| word == command.get_name()))?;
    let is_own = |arg: &&clap::Arg| {
        let long = arg.get_long().map(|long| format!("--{long}"));
        let short = arg.get_short().map(|short| format!("-{short}"));
        long.as_deref() == Some(name) || short.as_deref() == Some(name)
    };
    let long = all.get_arguments().find(is_own)?.get_long()?;
    Some(format!("--{long} has no effect in `{}`: it is an option of a run", command.get_name()))
}

/// The message for a run of several shaders.
pub(in crate::cli) fn usage(args: &[OsString], error: &Error, line: &Command) -> Option<String> {
    let is_unexpected = matches!(
        error.kind(),
        ErrorKind::UnknownArgument | ErrorKind::ArgumentConflict | ErrorKind::InvalidSubcommand
    );
    if let Some(text) = split_value(args).filter(|_| is_unexpected) {
        return Some(text);
    }
    if let Some(text) = of_a_run(args, error, line) {
        return Some(text);
    }
    // Only words before the first option can be files without doubt.
    let files = args.iter().skip(1).take_while(|word| is_shader(word)).count();
    (is_unexpected && files > 1).then(|| {
        format!(
            "a run takes one shader, and here are {files}: `oslrun check` takes several, and `--layer` joins several into a group"
        )
    })
}
