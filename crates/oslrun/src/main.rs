//! The `oslrun` command.

mod signals;

use std::process::ExitCode;

fn main() -> ExitCode {
    signals::watch();
    let code = oslrun::cli::main(std::env::args_os(), &mut anstream::stdout(), &mut anstream::stderr());
    ExitCode::from(code)
}
