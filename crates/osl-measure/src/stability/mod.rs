//! Numerical stability: where a shader's results become wrong, and which line is to blame.
//!
//! `sweep` runs the shader in strict arithmetic and in double precision over extreme settings (scale and
//! offset of the coordinates, footprint of the derivatives, each parameter) and compares the results. `blame`
//! follows the error of single points back to the instructions that made it; `lines` sums this up by source
//! line. This module must not know the command line; [`text`] and [`html`] format a [`Report`].

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

/// The result of a stability examination.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The shader.
    pub shader: String,
    /// A point counts as wrong if its error exceeds this share of the output's range.
    pub tolerance: f64,
    /// The tried settings with their outcomes.
    pub trials: Vec<Trial>,
    /// How far each sweep is safe, in words.
    pub findings: Vec<Finding>,
    /// The lines to blame, the worst first.
    pub culprits: Vec<Culprit>,
}
