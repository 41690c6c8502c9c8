//! `--version`: the version, the commit that was built, and the instruction sets that a run may use.

use osl_exec::Isa;
use std::ffi::OsString;
use std::sync::LazyLock;

/// The commit, from the build script; `None` if the sources were built outside of a repository.
const COMMIT: Option<&str> = option_env!("OSLRUN_COMMIT");

static SHORT: LazyLock<String> = LazyLock::new(|| {
    let version = env!("CARGO_PKG_VERSION");
    COMMIT.map_or_else(|| version.to_string(), |commit| format!("{version} ({commit})"))
});

static LONG: LazyLock<String> = LazyLock::new(|| {
    let names: Vec<&str> = Isa::all().into_iter().map(Isa::name).collect();
    let used = Isa::detect().name();
    format!("{}\ninstruction sets of this machine: {}; runs use {used}", *SHORT, names.join(", "))
});

/// The version and the commit.
pub(in crate::cli) fn short() -> &'static str {
    &SHORT
}

/// The same, and the instruction sets.
pub(in crate::cli) fn long() -> &'static str {
    &LONG
}

/// The answer to a command line that asks for the version alone. Describing the options of all commands would
/// take longer than anything else that a program does to find the version.
pub(in crate::cli) fn asked(args: &[OsString]) -> Option<String> {
    let [_, only] = args else { return None };
    match only.to_str()? {
        "--version" => Some(format!("oslrun {}", long())),
        "-V" => Some(format!("oslrun {}", short())),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::commands::Cli;
    use clap::CommandFactory;

    #[test]
    fn the_answer_is_that_of_the_whole_command_line() {
        for option in ["--version", "-V"] {
            let line = ["oslrun", option].map(OsString::from);
            let found = Cli::command().try_get_matches_from(&line).unwrap_err().to_string();
            assert_eq!(asked(&line).unwrap() + "\n", found);
        }
        assert_eq!(asked(&["oslrun", "check", "--version"].map(OsString::from)), None);
    }
}
