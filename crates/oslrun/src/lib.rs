//! The `oslrun` command as a library: turns a command line into images, text and an exit code.
//!
//! [`cli`] reads the command line, asks `osl_job` for what the user wants, and prints what comes back.
//! [`mod@reference`] formats the description of each built-in function, and [`nodes`] are the built-in
//! shaders. [`memory`] is about the allocator. The process itself is in `main.rs`.

pub mod cli;
pub mod memory;

pub use cli::reference;
pub use osl_job::source::nodes;
