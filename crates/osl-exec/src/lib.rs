//! Runs the IR of a shader over batches of hundreds of shading points, one instruction for the whole batch at
//! a time.
//!
//! `program` turns a body of IR into steps over registers, which hold one value per point. `lanes` runs
//! sequences of lane operations by the loops of the crate `osl-lanes`, and `native` replaces sequences that
//! recur by machine code. A `machine` runs the steps over one batch; where points take different branches, a
//! mask tells which lanes are active. [`run`] divides all points into tiles and drives machines on all cores;
//! the values of the outputs become the pixels of an image. This crate must not know the syntax tree, command
//! lines or the disk.

mod arithmetic;
#[cfg(test)]
mod bounds;
mod closures;
mod dictionary;
mod error;
mod fields;
pub mod frame;
mod lanes;
mod machine;
pub mod message;
mod native;
mod options;
mod order;
mod profile;
mod program;
mod register;
mod run;
mod services;
pub mod source;
mod step;

pub use closures::{ClosureKind, Closures, Component, Param, Row, show as show_closure};
pub use error::RunError;
pub use frame::{Frame, Plane, Words};
pub use machine::noise_kind;
pub use message::{Event, Keeping, Message, Printed, Said, Severity, StandFor, unite};
pub use native::Native;
pub use options::RunOptions;
pub use order::Blocks;
pub use osl_numeric::Arithmetic;
pub use osl_simd::Isa;
pub use profile::ProfileEntry;
pub use program::Program;
pub use run::{Look, Run, STEPS, run};
pub use services::{FindSpace, Services, Spaces, Unknown};
pub use source::{Answer, Datum, DatumColumn, PointSource, Ray, left_handed};
