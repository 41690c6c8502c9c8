//! Numerical stability: where a shader stops being right, and which line is to blame.
//!
//! `sweep` runs the shader in the strict arithmetic and in double precision over settings that go to the extremes
//! (scale and offset of the coordinates, footprint of the derivatives, each parameter) and compares what comes out; `blame`
//! goes back from the error of single points to the instructions that made it; `lines` sums that up by lines of the
//! source. This module must not know the command line; [`text`] and [`html`] lay a [`Report`] out.

mod blame;
mod examine;
pub mod html;
mod jumps;
mod lines;
mod subject;
mod sweep;
pub mod text;

pub use blame::{Blame, Place};
pub use examine::{Examined, Knob, examine};
pub use lines::{Culprit, culprits};
pub use subject::{Base, Planes, Subject, Swept, digits_lost};
pub use sweep::{Finding, Outcome, Setting, Trial, measure};

use serde::Serialize;

/// What is known of a shader's stability.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The shader.
    pub shader: String,
    /// The error from which on a point counts as wrong, as a share of the output's range.
    pub tolerance: f64,
    /// The settings that were tried, with what came out.
    pub trials: Vec<Trial>,
    /// In words: up to where each sweep is safe.
    pub findings: Vec<Finding>,
    /// The lines to blame, the worst first.
    pub culprits: Vec<Culprit>,
}
