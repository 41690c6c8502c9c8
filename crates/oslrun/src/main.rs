//! The `oslrun` command.

mod process;
mod signals;
mod terminal;

use std::process::ExitCode;

fn main() -> ExitCode {
    let code = process::on_a_stack(|| {
        oslrun::memory::keep_freed();
        osl_files::protect_inputs();
        signals::watch();
        oslrun::cli::main(std::env::args_os(), &mut *terminal::stdout(), &mut *terminal::stderr())
    });
    ExitCode::from(code)
}
