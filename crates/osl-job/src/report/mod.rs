//! What is said about a run: messages of shaders, ranges, distributions, times and samples.

pub mod closures;
pub mod histogram;
pub mod messages;
pub mod profile;
pub mod ranges;
pub mod rays;
pub mod samples;
pub mod stats;
