//! The `oslrun` command as a library: turns a command line into images, text and an exit code.
//!
//! [`cli`] reads the command line and opens the files. [`osl::stages`] compiles a shader in steps: source
//! text, syntax tree, typed program, IR, optimised IR. The program then runs on all points of a grid, a
//! surface or a scene, and the values of its outputs are written as the pixels of an image.
//! [`mod@reference`] formats the description of each built-in function, and [`nodes`] are the built-in
//! shaders. [`memory`] is about the allocator. The process itself is in `main.rs`.

pub mod cli;
pub mod memory;
pub mod nodes;
pub mod reference;
