//! The `oslrun` command.

mod signals;
mod terminal;

use std::process::ExitCode;

fn main() -> ExitCode {
    oslrun::memory::keep_freed();
    osl_files::protect_inputs();
    signals::watch();
    let code = oslrun::cli::main(std::env::args_os(), &mut *terminal::stdout(), &mut *terminal::stderr());
    ExitCode::from(code)
}
