//! Small pictures of what the lines of a source do: from taps and their values to pictures with words.
//!
//! A picture book writes them on its page, and the live page shows those of one line. `show` chooses how
//! values are shown.

mod show;

use osl_exec::{Frame, Plane};
use osl_ir::ir::Kind;
use osl_ir::types::{StructTable, Type};
use osl_job::file::data_url;
use osl_lower::taps::{Doings, Set, Tap};
pub(super) use show::Typed;
use show::{Shown, Values};
use std::collections::{BTreeMap, HashMap};

/// Visits of a line in a loop that are shown besides the last.
pub(super) const ROUNDS: u32 = 3;

/// A picture with its words.
pub(super) struct Figure {
    /// The name of the variable, or of the branch.
    pub(super) name: String,
    /// The type; empty for what is not a variable.
    pub(super) ty: String,
    /// The picture as a data URL; `None` if all values are the same.
    pub(super) url: Option<String>,
    /// How to read it.
    pub(super) words: String,
    /// The first rounds of the loop, as data URLs.
    pub(super) rounds: Vec<String>,
    /// The tap that makes the picture, as it is typed; empty if there is none.
    pub(super) tap: String,
    /// Black and white, if these are not 0 and 1.
    pub(super) range: Option<(f32, f32)>,
    /// How the command line shows the values of the tap.
    pub(super) typed: Typed,
}

/// The results of a run, by the names of outputs.
pub(super) struct Results<'f> {
    planes: HashMap<&'f str, Vec<&'f Plane>>,
    /// 0 at pixels that show nothing.
    covered: Option<Vec<f32>>,
}

impl<'f> Results<'f> {
    /// The results of all pixels; of those that show something, if `covered` is 0 at the others.
    pub(super) fn of(frame: &'f Frame, covered: Option<&Plane>) -> Results<'f> {
        let mut planes: HashMap<&str, Vec<&Plane>> = HashMap::new();
        for plane in &frame.planes {
            planes.entry(&*plane.output).or_default().push(plane);
        }
        Results { planes, covered: covered.map(Plane::floats) }
    }

    /// The planes of an output.
    pub(super) fn planes(&self, name: &str) -> &[&'f Plane] {
        self.planes.get(name).map_or(&[], Vec::as_slice)
    }

    fn floats(&self, name: &str) -> Vec<Vec<f32>> {
        self.planes(name).iter().map(|plane| plane.floats()).collect()
    }

    /// 0 at points that a tap does not get to; none if it gets to all.
    pub(super) fn reached(&self, tap: &Tap) -> Option<Vec<f32>> {
        let mask = self.floats(&tap.mask).into_iter().next();
        match (mask, &self.covered) {
            (Some(mask), Some(covered)) => Some(mask.iter().zip(covered).map(|(a, b)| a * b).collect()),
            (mask, covered) => mask.or_else(|| covered.clone()),
        }
    }

    /// The values of a tap, if it was lowered.
    fn values(&self, tap: &Tap) -> Option<Values> {
        let planes = self.floats(&tap.name);
        (!planes.is_empty()).then(|| Values { planes, reached: self.reached(tap) })
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
    pub(super) results: &'a Results<'a>,
    pub(super) size: (usize, usize),
}

impl Pictures<'_> {
    /// The pictures beside each line.
    pub(super) fn lines(&self, doings: &Doings) -> BTreeMap<u32, Vec<Figure>> {
        let mut lines: BTreeMap<u32, Vec<Figure>> = BTreeMap::new();
        for rounds in &doings.loops {
            let planes = vec![self.results.visits(&rounds.tap)];
            let values = Values { planes, reached: self.results.covered.clone() };
            let figure = self.figure("rounds".to_string(), Type::FLOAT, show::show(Type::FLOAT, &[values]));
            lines.entry(rounds.line).or_default().push(Figure { ty: String::new(), ..figure });
        }
        for branch in &doings.branches {
            let (is_true, is_false) =
                (self.results.visits(&branch.is_true), self.results.visits(&branch.is_false));
            let figure = self.figure("if".to_string(), Type::INT, show::condition(&is_true, &is_false));
            lines.entry(branch.line).or_default().push(Figure { ty: String::new(), ..figure });
        }
        for set in &doings.sets {
            if let Some(figure) = self.set(set) {
                lines.entry(set.wanted.line).or_default().push(figure);
            }
        }
        lines
    }

    /// The pictures of a variable at a line.
    fn set(&self, set: &Set) -> Option<Figure> {
        let mut times = vec![self.results.values(&set.tap)?];
        let rounds = set.rounds.iter().map_while(|tap| self.results.values(tap));
        times.extend(rounds.take_while(Values::has_points));
        let mut shown = show::show(set.tap.ty, &times);
        shown.typed.has_mask = !self.results.planes(&set.tap.mask).is_empty();
        let tap = set.wanted.to_string();
        Some(Figure { tap, ..self.figure(set.wanted.variable_path(), set.tap.ty, shown) })
    }

    /// The outputs of the shader itself: all but those of taps.
    pub(super) fn outputs(&self, frame: &Frame, taps: &[Tap]) -> Vec<Figure> {
        let tapped: HashMap<&str, ()> = taps.iter().flat_map(|t| [(&*t.name, ()), (&*t.mask, ())]).collect();
        let firsts = frame.planes.iter().filter(|p| p.component == 0 && !tapped.contains_key(&*p.output));
        firsts
            .map(|plane| {
                let planes = self.results.planes(&plane.output).len();
                let has_colors = !matches!(plane.kind, Kind::Str | Kind::Closure) && matches!(planes, 1 | 3);
                let shown = match has_colors {
                    true => {
                        let planes = self.results.floats(&plane.output);
                        show::show(plane.ty, &[Values { planes, reached: None }])
                    }
                    false => {
                        Shown::text(format!("a {} has no picture", StructTable::default().show(plane.ty)))
                    }
                };
                self.figure(plane.output.to_string(), plane.ty, shown)
            })
            .collect()
    }

    fn figure(&self, name: String, ty: Type, shown: Shown) -> Figure {
        let Shown { pictures, transfer, words, range, typed } = shown;
        let mut urls = pictures.iter().filter_map(|planes| data_url::png(self.size, planes, transfer));
        let url = urls.next();
        let rounds = urls.collect();
        let (ty, tap) = (StructTable::default().show(ty), String::new());
        Figure { name, ty, url, words, rounds, tap, range, typed }
    }
}
