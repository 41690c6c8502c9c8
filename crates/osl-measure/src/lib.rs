//! Measures shaders: images from samples with a stated error, the trade of speed for accuracy, numerical
//! stability, numeric events, proven bounds, levels of detail, and what a shader does at one point.
//!
//! The crate runs compiled programs through `osl-exec` and analyses the results. It must not know the
//! terminal or the command line: its results are values with text, JSON and HTML forms.

pub mod bounds;
mod cost;
pub mod explain;
pub mod lod;
pub mod page;
pub mod quote;
pub mod range;
pub mod sample;
pub mod sanitize;
pub mod stability;
pub mod trace;
pub mod tradeoff;
mod words;
