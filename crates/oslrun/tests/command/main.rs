//! Command lines and what they print and write, by command or option. They are one program because a program
//! of their own for each takes longer to link than to run. `in_process` runs a command in the process of the
//! test; where the process itself matters, a module starts the binary.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::unwrap_used,
    missing_docs,
    reason = "a test says what must hold"
)]

#[path = "../in_process/mod.rs"]
mod in_process;
#[path = "../studio_client/mod.rs"]
mod studio_client;

mod answers;
mod bad_input;
mod bake;
mod book;
mod bounds;
mod camera_rays;
mod cameras;
mod check;
mod closure_layers;
mod closures;
mod closures_testshade;
mod colors;
mod compare;
mod compiled;
mod crop;
mod data;
mod dialects;
mod doc;
mod effects;
mod encodings;
mod explain;
mod farm;
mod film;
mod fmt;
mod geometry;
mod includes;
mod json;
mod levels;
mod lod;
mod manners;
mod networks;
mod on;
mod preview;
mod readme;
mod render;
mod sampling;
mod sanitize;
mod scripts;
mod shading;
mod shown;
mod software;
mod studio;
mod sweeps;
mod tap;
mod testrender;
mod testshade;
mod told;
mod tools;
mod versions;
