//! Acceptance test on more points and with other values of the parameters: a repair must not make points
//! wrong that were right.
//!
//! A repair is found at the given values, where a root may never be near the number that it is added to, or a
//! divisor never 0. The truth is again the original source in double precision.

use super::super::examine::Knob;
use super::super::subject::{Programs, Subject, Swept};
use super::super::sweep::NOTABLE;
use super::super::trial::Setting;
use super::reference::{Harm, ROUNDING, Reference, SAME};
use super::{Build, Changed};
use crate::sanitize::{Kind, events_at};
use crate::trace::{Node, Trace};
use osl_ir::Span;
use osl_ir::ir::{Const, Kind as Type};
use osl_scene::Grid;
use std::cell::OnceCell;
use std::collections::BTreeSet;

/// Harmed points at which the original is followed.
const FOLLOWED: usize = 8;

/// Grids on which each hundredth of a coordinate has points: by columns, and by rows. The second one is for
/// points that take long.
const FINE: [[usize; 2]; 2] = [[256, 16], [128, 4]];

/// The largest number of columns and rows with other values of the parameters.
const COARSE: [usize; 2] = [16, 8];

/// A run of the original.
struct Run {
    /// The value of the parameter.
    value: String,
    reference: Reference,
}

/// The original on other points, or with other values of a parameter.
struct Variant {
    /// The parameter.
    name: Option<String>,
    points: Swept,
    runs: Vec<Run>,
}

/// The original on more points and at other values of its parameters. They are run when the first change is
/// tested.
pub(super) struct Variants<'a> {
    subject: &'a Subject<'a>,
    grid: &'a Grid,
    knobs: &'a [Knob],
    /// The text of the original.
    text: &'a str,
    found: OnceCell<Vec<Variant>>,
}

/// The components of the outputs with their values.
type Values = Vec<Vec<f64>>;

impl<'a> Variants<'a> {
    /// The variants of the original with this text.
    pub(super) fn new(
        (subject, grid): (&'a Subject<'a>, &'a Grid),
        knobs: &'a [Knob],
        text: &'a str,
    ) -> Variants<'a> {
        Variants { subject, grid, knobs, text, found: OnceCell::new() }
    }

    /// The first option of the command line, or parameter with a value, with which the changed text makes
    /// points wrong that were right. The end of the time is such a reason too: nothing is known then.
    pub(super) fn harmed_by(&self, text: &str, build: &Build<'_>) -> Option<String> {
        let found = self.found.get_or_init(|| self.of_original(build));
        for variant in found {
            let mut programs = self.programs(text, variant, build);
            for run in &variant.runs {
                let values =
                    programs.as_mut().and_then(|programs| self.values(programs, variant, &run.value));
                if self.subject.is_over() {
                    break;
                }
                let harm = match &values {
                    Some((strict, exact)) => {
                        run.reference.harm(strict).or_else(|| run.reference.differs(exact))
                    }
                    None => Some(Harm::NotFinite),
                };
                match harm {
                    None => {}
                    Some(Harm::Worse(points)) if self.have_no_meaning(variant, run, &points, build) => {}
                    Some(_) => {
                        let name = variant.name.as_deref().map(|name| format!("{name} = {}", run.value));
                        return Some(name.unwrap_or_else(|| format!("--points {}", run.value)));
                    }
                }
            }
        }
        self.subject.is_over().then(|| "--budget".to_string())
    }

    fn of_original(&self, build: &Build<'_>) -> Vec<Variant> {
        let mut out = Vec::new();
        let given = Setting::AsGiven.points(self.grid);
        self.subject.follow(&self.subject.base, &given, self.grid.width / 2, self.grid.height / 2);
        let effort = usize::from(self.subject.is_long());
        let [more, fewer] = FINE[effort];
        for [width, height] in [[more, fewer], [fewer, more]] {
            let points = Setting::AsGiven.points(&Grid { width, height, ..self.grid.clone() });
            out.push((Variant { name: None, points, runs: Vec::new() }, vec![format!("{width}x{height}")]));
        }
        let [width, height] = [self.grid.width, self.grid.height].map(|n| n.min(COARSE[effort]));
        let points = Setting::AsGiven.points(&Grid { width, height, ..self.grid.clone() });
        for knob in self.knobs {
            let (name, points) = (Some(knob.name.clone()), points.clone());
            out.push((Variant { name, points, runs: Vec::new() }, knob.near.clone()));
        }
        let run = |(mut variant, values): (Variant, Vec<String>)| {
            let mut programs = self.programs(self.text, &variant, build)?;
            let limits = if variant.name.is_some() { (NOTABLE, NOTABLE) } else { (ROUNDING, SAME[1]) };
            for value in values.into_iter().take_while(|_| !self.subject.is_over()) {
                let Some((strict, exact)) = self.values(&mut programs, &variant, &value) else { continue };
                let size = (variant.points.grid.width, variant.points.grid.height);
                let reference = Reference::new(&strict, exact, size, limits);
                let reference = if variant.name.is_some() { reference.lenient() } else { reference };
                variant.runs.push(Run { value, reference });
            }
            Some(variant)
        };
        out.into_iter().filter_map(run).collect()
    }

    /// Whether the original divides by 0, leaves the domain of a function or the range of doubles at
    /// most of the harmed points, and does not do so there as given: its result is then arbitrary.
    fn have_no_meaning(&self, variant: &Variant, run: &Run, harmed: &[usize], build: &Build<'_>) -> bool {
        let Some(name) = &variant.name else { return false };
        let events = |param| {
            let built = build(&Changed { text: self.text, notes: true, param })?;
            let base = self.subject.base.again(built.plain, built.noted?, self.subject.limits);
            let some = harmed.iter().step_by(harmed.len().div_ceil(FOLLOWED).max(1));
            let width = variant.points.grid.width.max(1);
            let traces = some.map(|at| self.subject.follow(&base, &variant.points, at % width, at / width));
            let all = |trace: Option<Trace>| {
                let trace = trace?;
                let found = events_at(&trace, base.written, &built.sources).into_iter();
                let found = found.filter(|(_, kind)| matches!(kind, Kind::Domain | Kind::ZeroDivision));
                // Double precision is no truth where its numbers end: powers are limited near there.
                let ends = |x: &f64| x.abs() >= 0.01 * f64::MAX;
                let leaves = |node: &&Node| node.exact.as_ref().is_some_and(|x| x.numbers().iter().any(ends));
                let beyond = trace.nodes.iter().filter(leaves).map(|node| (node.span, Kind::Infinity));
                Some(found.chain(beyond).collect())
            };
            traces.map(all).collect::<Option<Vec<BTreeSet<(Span, Kind)>>>>()
        };
        let (Some(here), Some(given)) = (events(Some((&**name, &*run.value))), events(None)) else {
            return false;
        };
        let arbitrary =
            here.iter().zip(&given).filter(|(here, given)| here.difference(given).next().is_some());
        4 * arbitrary.count() >= 3 * here.len()
    }

    /// A source whose parameter can take other values.
    fn programs(&self, text: &str, variant: &Variant, build: &Build<'_>) -> Option<Programs> {
        let param = variant.name.as_deref().map(|name| (name, "0"));
        let built = build(&Changed { text, notes: false, param })?;
        Some(self.subject.base.programs_of(built.plain, self.subject.limits))
    }

    /// The results with a value of the parameter, in strict arithmetic and in double precision; `None` if a
    /// run stops.
    fn values(&self, programs: &mut Programs, variant: &Variant, value: &str) -> Option<(Values, Values)> {
        let run = |program: &mut osl_exec::Program| {
            if variant.name.is_some() {
                let value = constant(program.inputs().first()?.value.kind(), value.parse().ok()?)?;
                program.set_input(0, value).then_some(())?;
            }
            Some(self.subject.values(program, &variant.points, true).ok()?.1)
        };
        Some((run(&mut programs.strict)?, run(&mut programs.exact)?))
    }
}

/// A number as the value of a parameter.
fn constant(of: Type, number: f64) -> Option<Const> {
    match of {
        Type::Int => Some(Const::Int(number as i32)),
        Type::Float => Some(Const::Float(number as f32)),
        Type::Triple => Some(Const::Triple([number as f32; 3])),
        _ => None,
    }
}
