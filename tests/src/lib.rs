//! Shared by the end-to-end tests: reference data, and the path from a shader's text to its values.

pub mod agree;
mod dice;
pub mod doors;
pub mod enclosed;
pub mod fuzz;
pub mod generate;
pub mod golden;
pub mod host;
pub mod instrument;
pub mod laws;
pub mod points;
pub mod run;
pub mod scenes;
pub mod textures;
pub mod ways;
