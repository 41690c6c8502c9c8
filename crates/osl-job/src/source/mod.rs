//! From files to a lowered shader: reads, checks and lowers shaders and groups.

pub mod data;
pub mod dialect;
pub mod diff;
pub mod folders;
pub mod input;
pub mod levels;
pub mod load;
pub mod nodes;
pub mod portability;
pub mod reads;
pub mod repair;
pub mod scene;
