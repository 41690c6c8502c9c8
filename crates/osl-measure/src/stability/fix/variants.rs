//! Other values of the parameters, at which a repair must not make points wrong that were right.
//!
//! A repair is found at the given values, where a root may never be near the number that it is added to, or a
//! divisor never 0. The truth is again the original source in double precision. A point counts as wrong from
//! the error on for which lines are blamed. This module must not know how a change was found.

use super::super::examine::Knob;
use super::super::subject::Subject;
use super::super::sweep::{NOTABLE, range};
use super::super::trial::{SAFE, Setting};
use super::judge::{around, harmed, worst_of};
use super::{Build, Changed};
use crate::sanitize::{Kind, events_at};
use crate::trace::Trace;
use osl_exec::PointSource;
use osl_ir::Span;
use osl_scene::Grid;
use std::cell::OnceCell;
use std::collections::BTreeSet;

/// The error of a wrong point, as a share of the range: the default of the command. Where the original has
/// wrong points, smaller errors are no harm.
const WRONG: f64 = 0.01;

/// Harmed points at which the original is followed.
const FOLLOWED: usize = 8;

/// The original at one value of a parameter.
struct Variant {
    name: String,
    value: String,
    /// Its outputs in double precision. An output that is the same at all points is `None`: it shows little
    /// of a change, as with a frequency of 0.
    truth: Vec<Option<Vec<f64>>>,
    ranges: Vec<f64>,
    /// For each point the largest error near it.
    near: Vec<f64>,
    /// The error from which on a point counts as harmed.
    least: f64,
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
            let Some(strict) = self.run(text, (&variant.name, &variant.value), build, false) else {
                return true;
            };
            let harmed = harmed(&variant.errors(&strict), &variant.near, variant.least);
            harmed.len() as f64 > SAFE * self.grid.count() as f64
                && !self.have_no_meaning(variant, &harmed, build)
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
                let run = |exact| self.run(self.text, (&knob.name, value), build, exact);
                let (Some(strict), Some(truth)) = (run(false), run(true)) else { continue };
                let ranges: Vec<f64> = truth.iter().map(|plane| range(plane)).collect();
                let varies = |plane: &Vec<f64>| plane.iter().any(|x| Some(x) != plane.first());
                let mut variant = Variant {
                    name: knob.name.clone(),
                    value: value.clone(),
                    truth: truth.into_iter().map(|plane| Some(plane).filter(varies)).collect(),
                    ranges,
                    near: Vec::new(),
                    least: NOTABLE,
                };
                let errors = variant.errors(&strict);
                let wrong = errors.iter().filter(|error| **error > WRONG).count();
                if wrong as f64 > SAFE * errors.len() as f64 {
                    variant.least = WRONG;
                }
                variant.near = around(&errors, self.grid.width, self.grid.height);
                out.push(variant);
            }
        }
        out
    }

    /// Whether the original divides by 0 or leaves the domain of a function at most of the harmed points, and
    /// does not do so there as given: its result is then arbitrary.
    fn have_no_meaning(&self, variant: &Variant, harmed: &[usize], build: &Build<'_>) -> bool {
        let events = |param| {
            let built = build(&Changed { text: self.text, notes: true, param })?;
            let base = self.subject.base.again(built.plain, built.noted?, self.subject.limits);
            let points = Setting::AsGiven.points(self.grid);
            let some = harmed.iter().step_by(harmed.len().div_ceil(FOLLOWED).max(1));
            let width = self.grid.width.max(1);
            let traces = some.map(|at| self.subject.follow(&base, &points, at % width, at / width));
            let all = |trace: Option<Trace>| {
                let found = events_at(&trace?, base.written, &built.sources).into_iter();
                Some(found.filter(|(_, kind)| matches!(kind, Kind::Domain | Kind::ZeroDivision)).collect())
            };
            traces.map(all).collect::<Option<Vec<BTreeSet<(Span, Kind)>>>>()
        };
        let (Some(here), Some(given)) = (events(Some((&*variant.name, &*variant.value))), events(None))
        else {
            return false;
        };
        let arbitrary =
            here.iter().zip(&given).filter(|(here, given)| here.difference(given).next().is_some());
        4 * arbitrary.count() >= 3 * here.len()
    }

    /// The values of a source with another value of a parameter, in strict arithmetic or double precision;
    /// `None` if the run stops.
    fn run(&self, text: &str, param: (&str, &str), build: &Build<'_>, exact: bool) -> Option<Vec<Vec<f64>>> {
        let built = build(&Changed { text, notes: false, param: Some(param) })?;
        let programs = self.subject.base.programs_of(built.plain, self.subject.limits);
        let program = if exact { &programs.exact } else { &programs.strict };
        let points = Setting::AsGiven.points(self.grid);
        Some(self.subject.values(program, &points, true).ok()?.1)
    }
}
