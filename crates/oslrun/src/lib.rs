//! The `oslrun` command as a library: everything but the process itself.
//!
//! [`pipeline`], of the crate `osl`, joins the crates from text to program; [`cli`] is the command line over it;
//! [`lessons`] are what it tells about each diagnostic, [`mod@reference`] about each built-in function; [`nodes`] are the
//! shaders that it brings along.

pub mod cli;
pub mod lessons;
pub mod nodes;
pub mod reference;

pub use osl::pipeline;
