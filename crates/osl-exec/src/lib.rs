//! The batch interpreter: runs IR over some hundreds of shading points an instruction.
//!
//! The way of the data: `program` turns a body of IR into steps over registers; `lanes` stamps the lane
//! operations into loops, which `native` replaces by machine code where they recur; a `machine` runs the steps over one batch under lane masks; [`run`] drives
//! machines over all points on all cores. This crate must not know the syntax tree, command lines or the disk.

mod arithmetic;
#[cfg(test)]
mod bounds;
mod dictionary;
mod error;
mod fields;
pub mod frame;
mod lanes;
mod machine;
pub mod message;
mod native;
mod order;
mod profile;
mod program;
mod register;
mod run;
mod services;
pub mod source;

pub use error::RunError;
pub use frame::{Closures, Frame, Plane, RunOptions};
pub use machine::{Component, Param, show_closure};
pub use message::{Event, Keeping, Message, Printed, Said, StandFor, unite};
pub use native::Native;
pub use order::Blocks;
pub use osl_ir::numeric::Arithmetic;
pub use osl_noise::Isa;
pub use profile::ProfileEntry;
pub use program::Program;
pub use run::{Run, run};
pub use services::{FindSpace, Services, Spaces, Unknown};
pub use source::{Answer, Datum, PointSource};
