//! Numerical stability: where a shader's results become wrong, and which line is to blame.
//!
//! `sweep` runs the shader in strict arithmetic and in double precision over extreme settings (scale and
//! offset of the coordinates, footprint of the derivatives, each parameter) and compares the results;
//! `safe_range` says how far they stay right. `attribution` propagates the error of single points back to the
//! instructions that made it; `replay` and `sensitivity` measure what each rounding does to the outputs.
//! `pairs` finds the instruction that magnifies a rounding, `loop_growth` a loop that adds it up, `overflow`
//! results that leave the range of floats, `range_reduction` functions whose arguments must be small, and
//! `oracle` tests whether double precision may be the truth. `lines` ranks the source lines, and `wording`
//! explains each. `fix` rewrites the lines to blame and measures what that is worth. [`text`] and [`html`]
//! format a [`Report`].

mod attribution;
mod discontinuities;
mod examine;
pub mod fix;
pub mod html;
mod lines;
mod loop_growth;
mod oracle;
mod pairs;
mod replay;
mod rerun;
mod safe_range;
mod sensitivity;
mod statistics;
mod subject;
mod sweep;
pub mod text;
mod trial;
mod wording;

pub use examine::{Examined, Knob, examine, examine_given};
pub use lines::{BlamedLines, Culprit, culprits};
pub use oracle::NotEnough;
pub use pairs::Partner;
pub use rerun::Broken;
pub use statistics::{Blame, InstSite};
pub use subject::{Base, Planes, Subject, Swept, digits_lost};
pub use sweep::{Finding, measure};
pub use trial::{Outcome, Setting, Trial};

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
    /// The lines to blame for the error at the given setting, in the order in which to look at them. Empty if
    /// there is nothing to blame: the largest error is below 1e-4 of the range. If the error is larger and no
    /// line loses digits, these are lines with numeric events.
    pub culprits: Vec<Culprit>,
    /// Lines with numeric events, such as arguments outside of a domain, and derivatives of what jumps, at
    /// the given setting.
    pub noticed: Vec<Culprit>,
    /// The lines that fail first beyond the ranges in which the points are right.
    pub beyond: Vec<Culprit>,
    /// What shows that double precision is not the truth as given, if it is not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_enough: Option<NotEnough>,
    /// What was not looked at, because the time was over. Which parts these are depends on the machine.
    pub not_examined: Vec<String>,
    /// What is never examined, in words: strings, for instance.
    pub left_out: Vec<String>,
    /// What was found to repair these lines, if that was requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repair: Option<fix::Repair>,
}

/// A list of lines with its heading.
struct List<'a> {
    title: &'static str,
    lines: &'a [Culprit],
    /// Whether scores are errors, as shares of the range; otherwise they are shares of the points.
    are_errors: bool,
}

impl Report {
    /// The lists of lines that are not empty.
    fn lists(&self) -> Vec<List<'_>> {
        let lists = [
            match self.culprits.first().is_some_and(|first| first.is_event) {
                true => List {
                    title: "No line loses digits. What to look at: numeric events",
                    lines: &self.culprits,
                    are_errors: false,
                },
                false => List {
                    title: "Lines to blame, in the order in which to look at them",
                    lines: &self.culprits,
                    are_errors: true,
                },
            },
            List {
                title: "Numeric events, such as arguments outside of a domain",
                lines: &self.noticed,
                are_errors: false,
            },
            List { title: "What fails first beyond these ranges", lines: &self.beyond, are_errors: true },
        ];
        lists.into_iter().filter(|list| !list.lines.is_empty()).collect()
    }
}
