//! From what the lines of a source do to the pictures beside them.
//!
//! This module must not know how shaders are run or how a page is written.

use super::page::{Figure, Line};
use super::show::{self, Shown, Values};
use super::word;
use crate::cli::data_url;
use osl_exec::{Frame, Plane};
use osl_ir::ir::Kind;
use osl_ir::types::{StructTable, Type};
use osl_lower::taps::{Doings, Set, Tap, Wanted};
use osl_measure::stability::digits_lost;
use std::collections::{BTreeMap, HashMap};

/// The share of the points of a line that may have lost more digits than its margin says.
const WORST: f64 = 0.01;

/// The results of a run, by the names of outputs.
pub(super) struct Results<'f>(HashMap<&'f str, Vec<&'f Plane>>);

impl<'f> Results<'f> {
    pub(super) fn of(frame: &'f Frame) -> Results<'f> {
        let mut planes: HashMap<&str, Vec<&Plane>> = HashMap::new();
        for plane in &frame.planes {
            planes.entry(&*plane.output).or_default().push(plane);
        }
        Results(planes)
    }

    fn planes(&self, name: &str) -> &[&'f Plane] {
        self.0.get(name).map_or(&[], Vec::as_slice)
    }

    fn floats(&self, name: &str) -> Vec<Vec<f32>> {
        self.planes(name).iter().map(|plane| plane.floats()).collect()
    }

    /// The values of a tap, if it was lowered.
    fn values(&self, tap: &Tap) -> Option<Values> {
        let planes = self.floats(&tap.name);
        let reached = self.floats(&tap.mask).into_iter().next();
        (!planes.is_empty()).then_some(Values { planes, reached })
    }

    /// How often each point got to a tap.
    fn visits(&self, tap: &Tap) -> Vec<f32> {
        self.floats(&tap.name).into_iter().next().unwrap_or_default()
    }
}

/// All taps.
pub(super) fn taps(doings: &Doings) -> Vec<Tap> {
    let sets = doings.sets.iter().flat_map(|set| std::iter::once(&set.tap).chain(&set.rounds));
    let branches = doings.branches.iter().flat_map(|branch| [&branch.is_true, &branch.is_false]);
    sets.chain(branches).chain(doings.loops.iter().map(|rounds| &rounds.tap)).cloned().collect()
}

/// Makes the pictures.
pub(super) struct Pictures<'a> {
    /// The results in the usual arithmetic, and in double precision.
    pub(super) single: &'a Results<'a>,
    pub(super) double: &'a Results<'a>,
    pub(super) size: (usize, usize),
    /// The start of the command that makes a picture.
    pub(super) command: String,
}

impl Pictures<'_> {
    /// What the page says about each line.
    pub(super) fn lines(&self, doings: &Doings) -> BTreeMap<u32, Line> {
        let mut lines: BTreeMap<u32, Line> = BTreeMap::new();
        for rounds in &doings.loops {
            let values = Values { planes: vec![self.single.visits(&rounds.tap)], reached: None };
            let figure = self.figure("rounds".to_string(), Type::FLOAT, show::show(Type::FLOAT, &[values]));
            lines.entry(rounds.line).or_default().figures.push(Figure { ty: String::new(), ..figure });
        }
        for branch in &doings.branches {
            let (is_true, is_false) =
                (self.single.visits(&branch.is_true), self.single.visits(&branch.is_false));
            let figure = self.figure("if".to_string(), Type::INT, show::condition(&is_true, &is_false));
            lines.entry(branch.line).or_default().figures.push(Figure { ty: String::new(), ..figure });
        }
        for set in &doings.sets {
            let Some(figure) = self.set(set) else { continue };
            let line = lines.entry(set.wanted.line).or_default();
            line.lost = line.lost.max(self.lost(&set.tap));
            line.figures.push(figure);
        }
        lines
    }

    /// The pictures of a variable at a line.
    fn set(&self, set: &Set) -> Option<Figure> {
        let mut times = vec![self.single.values(&set.tap)?];
        let rounds = set.rounds.iter().map_while(|tap| self.single.values(tap));
        times.extend(rounds.take_while(Values::has_points));
        let shown = show::show(set.tap.ty, &times);
        let range = shown.range.map_or_else(String::new, |(low, high)| format!(" --range {low},{high}"));
        let command = format!("{} --tap {}{range} -o picture.png", self.command, word(&typed(&set.wanted)));
        Some(Figure { command, ..self.figure(variable(&set.wanted), set.tap.ty, shown) })
    }

    /// The outputs of the shader itself: all but those of taps.
    pub(super) fn outputs(&self, frame: &Frame, taps: &[Tap]) -> Vec<Figure> {
        let tapped: HashMap<&str, ()> = taps.iter().flat_map(|t| [(&*t.name, ()), (&*t.mask, ())]).collect();
        let firsts = frame.planes.iter().filter(|p| p.component == 0 && !tapped.contains_key(&*p.output));
        firsts
            .filter(|plane| !matches!(plane.kind, Kind::Str | Kind::Closure))
            .filter_map(|plane| {
                let values = Values { planes: self.single.floats(&plane.output), reached: None };
                let has_colors = matches!(values.planes.len(), 1 | 3);
                let shown = has_colors.then(|| show::show(plane.ty, &[values]))?;
                Some(self.figure(plane.output.to_string(), plane.ty, shown))
            })
            .collect()
    }

    fn figure(&self, name: String, ty: Type, shown: Shown) -> Figure {
        let Shown { pictures, transfer, words, range: _ } = shown;
        let mut urls = pictures.iter().filter_map(|planes| data_url::png(self.size, planes, transfer));
        let url = urls.next();
        let rounds = urls.collect();
        Figure { name, ty: StructTable::default().show(ty), url, words, rounds, command: String::new() }
    }

    /// The digits that a variable loses in single precision, of its largest value: all but a hundredth of the
    /// points lose less.
    fn lost(&self, tap: &Tap) -> f64 {
        let mask = self.single.floats(&tap.mask).into_iter().next();
        let counts = |at: usize| mask.as_ref().is_none_or(|mask| mask.get(at).is_some_and(|x| *x > 0.0));
        let mut errors: Vec<f64> = Vec::new();
        let mut size = 0.0_f64;
        for (single, double) in self.single.planes(&tap.name).iter().zip(self.double.planes(&tap.name)) {
            let pairs = single.doubles().into_iter().zip(double.doubles()).enumerate();
            for (_, (a, b)) in pairs.filter(|(at, (a, b))| counts(*at) && a.is_finite() && b.is_finite()) {
                errors.push((a - b).abs());
                size = size.max(b.abs());
            }
        }
        errors.sort_by(f64::total_cmp);
        let at = (errors.len() as f64 * (1.0 - WORST)) as usize;
        let error = errors.get(at.min(errors.len().saturating_sub(1))).copied().unwrap_or(0.0);
        digits_lost(size + error, size)
    }
}

/// A tap as it is typed.
fn typed(wanted: &Wanted) -> String {
    format!("{}:{}", wanted.line, variable(wanted))
}

/// A variable with its path, as in the source.
fn variable(wanted: &Wanted) -> String {
    let mut text = wanted.variable.clone();
    wanted.path.iter().for_each(|part| text += &part.to_string());
    text
}
