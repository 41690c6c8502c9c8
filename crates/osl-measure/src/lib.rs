//! What an answer costs and what it is worth: images from samples to a stated error, the trade of speed for accuracy,
//! numerical stability, and what happened at one point.
//!
//! It runs programs through `osl-exec` and reads what comes out. It must not know the terminal or the command line: its
//! results are values, with text, JSON and HTML forms.

pub mod explain;
mod markup;
pub mod sample;
pub mod stability;
pub mod trace;
pub mod tradeoff;
