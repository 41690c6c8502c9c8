//! From values to files: pictures of outputs and of light, and their display.

pub mod data_url;
pub mod display;
pub mod light;
pub mod map;
pub mod output;
pub mod rows;
pub mod software;
