//! The `oslrun` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    let code = oslrun::cli::main(std::env::args_os(), &mut anstream::stdout(), &mut anstream::stderr());
    ExitCode::from(code)
}
