//! The `oslrun` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(oslrun::run(std::env::args_os().collect()))
}
