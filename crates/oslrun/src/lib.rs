//! The `oslrun` command as a library: turns a command line into images, text and an exit code.
//!
//! [`cli`] reads the command line, asks `osl_job` for what the user wants, and prints what comes back.
//! [`mod@reference`] formats the description of each built-in function, and [`nodes`] are the built-in
//! shaders. [`memory`] is about the allocator. [`run`] is the process as a whole.

pub mod cli;
pub mod memory;
mod process;
mod signals;
mod terminal;

pub use cli::reference;
pub use osl_job::source::nodes;

use std::ffi::OsString;

/// Runs the command on the standard streams, and returns its exit code. From then on, signals end the process
/// in the way of the command, so only a process that is the command calls this.
pub fn run(args: Vec<OsString>) -> u8 {
    process::on_a_stack(|| {
        memory::keep_freed();
        osl_files::protect_inputs();
        signals::watch();
        cli::main(args, &mut *terminal::stdout(), &mut *terminal::stderr())
    })
}
