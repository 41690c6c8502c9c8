//! Other values of the parameters, at which a repair must not make points wrong that were right.
//!
//! A repair is found at the given values, where a root may never be near the number that it is added to, or
//! a divisor never 0. The truth is again the original source in double precision. A point counts as wrong from
//! the error on for which lines are blamed. This module must not know how a change was found.

use super::super::examine::{Knob, NOTABLE};
use super::super::subject::Subject;
use super::super::sweep::{SAFE, Setting, range};
use super::judge::{around, harms, worst_of};
use super::{Build, Changed};
use osl_scene::Grid;
use std::cell::OnceCell;

/// The share of the points that a change may harm at the value 0. Single points often divide by 0 there, and
/// have no meaning before and after the change.
const AT_ZERO: f64 = 0.05;

/// A value next to 0. Where the original jumps on the way from it to 0, it divides by 0, and its result there
/// has no meaning.
const NEXT_TO_ZERO: &str = "1e-6";

/// The original at one value of a parameter.
struct Variant {
    name: String,
    value: String,
    /// Its outputs in double precision; `None` for those that are the same everywhere. Such a value says
    /// little, for instance a frequency of 0.
    truth: Vec<Option<Vec<f64>>>,
    ranges: Vec<f64>,
    /// For each point the largest error near it.
    near: Vec<f64>,
    /// The share of the points that a change may harm.
    allowed: f64,
}

impl Variant {
    /// The error of each point in its worst output, as a share of the range.
    fn errors(&self, strict: &[Vec<f64>]) -> Vec<f64> {
        let planes = strict.iter().zip(&self.truth).zip(&self.ranges);
        let varying = planes.filter_map(|((own, truth), range)| Some((own, truth.as_ref()?, *range)));
        let empty = strict.first().map_or(0, Vec::len);
        worst_of(varying, empty)
    }
}

/// Whether more points than a change may harm at 0 differ by more than a tenth of the range.
fn jumps(at: &[Vec<f64>], next: &[Vec<f64>]) -> bool {
    let planes = next.iter().zip(at).map(|(next, at)| (next, at, range(next)));
    let apart = worst_of(planes, at.first().map_or(0, Vec::len));
    apart.iter().filter(|apart| **apart > 0.1).count() as f64 > AT_ZERO * apart.len() as f64
}

/// The original at other values of its parameters. They are run when the first change is tested.
pub(super) struct Variants<'a> {
    subject: &'a Subject<'a>,
    grid: &'a Grid,
    knobs: &'a [Knob],
    /// The text of the original.
    text: &'a str,
    found: OnceCell<Vec<Variant>>,
}

impl<'a> Variants<'a> {
    /// The variants of the original with this text.
    pub(super) fn new(
        (subject, grid): (&'a Subject<'a>, &'a Grid),
        knobs: &'a [Knob],
        text: &'a str,
    ) -> Variants<'a> {
        Variants { subject, grid, knobs, text, found: OnceCell::new() }
    }

    /// The first parameter with a value at which the changed text makes points wrong that were right.
    pub(super) fn harmed_by(&self, text: &str, build: &Build<'_>) -> Option<(String, String)> {
        let found = self.found.get_or_init(|| self.of_original(build));
        let harms = |variant: &&Variant| {
            let Some(strict) = self.run(text, &variant.name, &variant.value, build, false) else {
                return true;
            };
            let now = variant.errors(&strict);
            harms(&now, &variant.near, NOTABLE, variant.allowed)
        };
        let bad = found.iter().filter(|_| !self.subject.is_over()).find(harms)?;
        Some((bad.name.clone(), bad.value.clone()))
    }

    fn of_original(&self, build: &Build<'_>) -> Vec<Variant> {
        let mut out = Vec::new();
        for knob in self.knobs {
            for value in &knob.near {
                if self.subject.is_over() {
                    break;
                }
                let run = |value: &str, exact| self.run(self.text, &knob.name, value, build, exact);
                let (Some(strict), Some(truth)) = (run(value, false), run(value, true)) else { continue };
                let is_zero = value.parse::<f64>().is_ok_and(|x| x == 0.0);
                if is_zero && run(NEXT_TO_ZERO, true).is_none_or(|next| jumps(&truth, &next)) {
                    continue;
                }
                let ranges: Vec<f64> = truth.iter().map(|plane| range(plane)).collect();
                let varies = |plane: &Vec<f64>| plane.iter().any(|x| Some(x) != plane.first());
                let allowed = if is_zero { AT_ZERO } else { SAFE };
                let mut variant = Variant {
                    name: knob.name.clone(),
                    value: value.clone(),
                    truth: truth.into_iter().map(|plane| Some(plane).filter(varies)).collect(),
                    ranges,
                    near: Vec::new(),
                    allowed,
                };
                variant.near = around(&variant.errors(&strict), self.grid.width, self.grid.height);
                out.push(variant);
            }
        }
        out
    }

    /// The values of a source with another value of a parameter, in strict arithmetic or double precision;
    /// `None` if the run stops.
    fn run(
        &self,
        text: &str,
        name: &str,
        value: &str,
        build: &Build<'_>,
        exact: bool,
    ) -> Option<Vec<Vec<f64>>> {
        let built = build(&Changed { text, notes: false, param: Some((name, value)) })?;
        let programs = self.subject.base.programs_of(built.plain, self.subject.limits);
        let program = if exact { &programs.exact } else { &programs.strict };
        let points = Setting::AsGiven.points(self.grid);
        Some(self.subject.values(program, &points, true).ok()?.1)
    }
}
