//! Numerical stability: where a shader's results become wrong, and which line is to blame.
//!
//! `sweep` runs the shader in strict arithmetic and in double precision over extreme settings (scale and
//! offset of the coordinates, footprint of the derivatives, each parameter) and compares the results; `reach`
//! says how far they stay right. `blame` follows the error of single points back to the instructions that
//! made it, `replay` and `roundings` measure what each rounding does to the outputs, `pairs` finds the
//! instruction that magnifies it on the way, and `repeats` a loop that adds it up; `broken` finds results
//! that leave the range of floats, and `reduce` knows the functions whose arguments must be small. `oracle`
//! tests whether double precision may be the truth. `lines`
//! sums this up by source line, and `charge` says it. `fix` rewrites the lines to blame and proves what that
//! is worth. This module must not know the command line; [`text`] and [`html`] format a [`Report`].

mod again;
mod blame;
mod broken;
mod charge;
mod examine;
pub mod fix;
pub mod html;
mod instruction;
mod jumps;
mod lines;
mod oracle;
mod pairs;
mod reach;
mod reduce;
mod repeats;
mod replay;
mod roundings;
mod subject;
mod sweep;
pub mod text;
mod trial;

pub use broken::Broken;
pub use examine::{Examined, Knob, examine, examine_given};
pub use instruction::{Blame, InstSite};
pub use lines::{BlamedLines, Culprit, culprits};
pub use oracle::NotEnough;
pub use pairs::Partner;
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
