//! Ranking of source lines: sums the errors of instructions over the worst points, chooses one instruction
//! for each line, and puts the lines in the order in which to look at them.

pub use super::wording::Culprit;

use super::attribution::blame;
use super::discontinuities::jumps;
use super::pairs::{Pairs, Side};
use super::sensitivity::{LineKey, LineOf, Roundings};
use super::statistics::{Blame, INEXACT, InstSite};
use super::subject::{Planes, Subject, Swept};
use super::sweep::{NOTABLE, errors, percent, range};
use super::trial::Setting;
use super::wording::{Charge, Found, charge, does};
use crate::quote::line_at;
use crate::sanitize::{Kind, events_at};
use crate::trace::Trace;
use osl_ir::Span;
use osl_scene::Grid;
use osl_syntax::source::SourceMap;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Number of points with the largest errors that are followed.
pub(super) const WORST: usize = 24;
/// Arguments of functions that repeat are large from this size on: they have left the first period.
const LARGE: f64 = 8.0;
/// Points of a row and of a column at which derivatives are compared with differences.
const ALONG: usize = 64;

/// The lines that harm the points of a setting, the one to look at first before the others.
#[derive(Clone, Debug, Default)]
pub struct BlamedLines {
    /// Lines that make the error.
    pub blamed: Vec<Culprit>,
    /// Lines with numeric events, and derivatives of what jumps: they are no loss of digits.
    pub noticed: Vec<Culprit>,
    /// The number of points that were not followed, since the budget for following was used up.
    pub skipped: usize,
}

/// The lines that harm the points of a setting. `planes` is the result of the run at that setting. If its
/// errors are too small to blame anybody, `blames` is false, and the points with the largest errors are not
/// followed.
pub fn culprits(
    subject: &Subject<'_>,
    grid: &Grid,
    setting: &Setting,
    planes: &Planes,
    sources: &SourceMap,
    blames: bool,
) -> BlamedLines {
    let points = setting.points(grid);
    let worst = if blames { worst(planes, grid) } else { Vec::new() };
    let spread = spread(grid);
    let line_of = |span: Span| line_at(span, sources);
    let mut sums = Sums::new(subject.limits.running.traces / 2);
    let mut events: [Events; 2] = Default::default();
    let (mut followed, mut skipped, mut instructions) = ([0_u32, 0], 0, 0);
    for (which, list) in [worst, spread].iter().enumerate() {
        for (x, y) in list {
            let Some(trace) = subject.follow(&subject.base, &points, *x, *y) else {
                skipped += 1;
                continue;
            };
            if which == 1 {
                instructions += trace.nodes.len();
            } else {
                sums.point(&trace, &output_ranges(&trace, planes), &line_of);
            }
            for event in events_at(&trace, subject.base.written, sources) {
                *events[which].entry(event).or_default() += 1;
            }
            followed[which] += 1;
        }
    }
    let (found, mut noticed) = (sums.ended(), Lines::default());
    let blamed = blamed(&found, f64::from(followed[0].max(1)), sources);
    // Where an underflow does no harm, it is no event.
    let harms = |(span, kind): &(Span, Kind)| {
        let broken = |(place, blame): (&InstSite, &Blame)| place.span == *span && blame.left > 0.0;
        *kind != Kind::Denormal || found.places.iter().any(broken)
    };
    let [at_worst, mut at_spread] = events;
    if *setting == Setting::AsGiven
        && let Some((all, count)) =
            everywhere(subject, &points, (&at_spread, followed[1], instructions), sources)
    {
        (at_spread, followed[1]) = (all, count);
    }
    let is_everywhere = followed[1] as usize == grid.width * grid.height;
    for ((span, kind), count) in at_worst {
        let Some(does) = does(kind).filter(|_| harms(&(span, kind))) else { continue };
        if at_spread.contains_key(&(span, kind)) {
            continue;
        }
        // At this share of all points at least.
        let share = f64::from(count) / (grid.width * grid.height).max(1) as f64;
        let why = format!("{does} at some of the points with the largest errors");
        noticed.put(Charge::seen(span, kind.name(), share, why), sources);
    }
    for ((span, kind), count) in at_spread {
        let Some(does) = does(kind).filter(|_| harms(&(span, kind))) else { continue };
        let share = f64::from(count) / f64::from(followed[1].max(1));
        let why = match is_everywhere {
            true => format!("{does} at {} of the points", percent(share)),
            false => format!("{does} at {count} of {} points of a grid that were followed", followed[1]),
        };
        noticed.put(Charge::seen(span, kind.name(), share, why), sources);
    }
    if subject.base.differentiates {
        seen_jumps(subject, grid, setting).into_iter().for_each(|charge| noticed.put(charge, sources));
    }
    BlamedLines {
        blamed: blamed.culprits(setting, sources),
        noticed: noticed.culprits(setting, sources),
        skipped,
    }
}

/// The lines to blame for what was found at so many points.
fn blamed(found: &Found, points: f64, sources: &SourceMap) -> Lines {
    let mut blamed = Lines::default();
    let most = found.places.values().map(Blame::score).fold(0.0, f64::max);
    let adds = |place: &InstSite| found.repeats.all(Side::Magnifies, place) > 0.0;
    for (place, blame) in found.places.iter().filter(|(place, blame)| blame.score() > 0.0 || adds(place)) {
        let charge = charge(place, blame, points, found, sources);
        let is_most = blame.score() >= most;
        blamed.put(charge, sources);
        if is_most {
            blamed.most = line_at(place.span, sources);
        }
        if blame.reduced >= 0.5 * blame.amplified
            && let (Some(at), Some(forms)) = (sources.place(place.span), found.pairs.forms(place, sources))
            && let Some(blame) = found.places.get(&forms.place)
            && (blame.size >= LARGE || blame.roundings() >= INEXACT)
        {
            blamed.formed.insert(((at.file, at.line), (forms.file, forms.line)));
        }
    }
    blamed.errors = found.lines.iter().map(|(line, error)| (*line, error / points)).collect();
    blamed
}

/// How many points have each event.
type Events = BTreeMap<(Span, Kind), u32>;

/// All points are looked at for events unless they run more instructions than this.
const EVERYWHERE: usize = 1 << 20;

/// The events of all points, and their number, if some points have events and following all does not take too
/// long. `seen` are the events of some points, their number and their instructions.
fn everywhere(
    subject: &Subject<'_>,
    points: &Swept,
    (seen, count, instructions): (&Events, u32, usize),
    sources: &SourceMap,
) -> Option<(Events, u32)> {
    let (width, height) = (points.grid.width, points.grid.height);
    let needed = instructions.saturating_mul(width * height) / count.max(1) as usize;
    if seen.is_empty() || needed > EVERYWHERE || subject.is_over() {
        return None;
    }
    let row = |y: usize| {
        let mut events = Events::default();
        for x in 0..width {
            let trace = subject.watch(&subject.base, points, x, y)?;
            for event in events_at(&trace, subject.base.written, sources) {
                *events.entry(event).or_default() += 1;
            }
        }
        Some(events)
    };
    let rows: Vec<Events> = (0..height).into_par_iter().map(row).collect::<Option<_>>()?;
    let mut all = Events::default();
    for (event, count) in rows.into_iter().flatten() {
        *all.entry(event).or_default() += count;
    }
    (!subject.is_over()).then_some((all, (width * height) as u32))
}

/// The blame of instructions, summed over points.
struct Sums {
    places: BTreeMap<InstSite, Blame>,
    chains: Pairs,
    /// The roundings of all points by estimate, and those of the points at which they could be measured.
    estimated: Roundings,
    measured: Roundings,
    /// The number of all points, and of those.
    points: [u32; 2],
    /// The nodes that experiments may still run again.
    budget: u64,
}

impl Sums {
    fn new(budget: u64) -> Sums {
        let (estimated, measured) = (Roundings::default(), Roundings::default());
        Sums {
            places: BTreeMap::new(),
            chains: Pairs::default(),
            estimated,
            measured,
            points: [0, 0],
            budget,
        }
    }

    fn point(&mut self, trace: &Trace, ranges: &[f64], line: &LineOf<'_>) {
        let blames = blame(trace, ranges, line, &mut self.budget);
        for (place, blame) in blames.places {
            self.places.entry(place).or_default().add(&blame);
        }
        self.chains.merge(blames.chains);
        self.points[0] += 1;
        self.estimated.merge(blames.estimated);
        match blames.measured {
            Some(measured) => {
                self.measured.merge(measured);
                self.points[1] += 1;
            }
            // The budget is used up.
            None => self.budget = 0,
        }
    }

    /// What was found. Measured points stand for all of them; if there is none,
    /// the estimate counts.
    fn ended(mut self) -> Found {
        let [all, measured] = self.points.map(f64::from);
        let (roundings, factor) =
            if measured > 0.0 { (self.measured, all / measured) } else { (self.estimated, 1.0) };
        for (place, error) in roundings.errors {
            self.places.entry(place).or_default().rounded = error * factor;
        }
        let pairs = roundings.pairs.notable(&self.places).scaled(factor);
        let repeats = roundings.repeats.scaled(factor);
        let (mut together, mut lines) = (roundings.together, roundings.lines);
        together.values_mut().chain(lines.values_mut()).for_each(|error| *error *= factor);
        Found { places: self.places, pairs, chains: self.chains, repeats, together, lines }
    }
}

/// A file and a line.
type Line = (String, u32);

/// Charges by line.
#[derive(Default)]
struct Lines {
    charges: BTreeMap<LineKey, Vec<Charge>>,
    /// The error of all roundings of a line together.
    errors: BTreeMap<LineKey, f64>,
    /// The line of the instruction with the highest score.
    most: Option<LineKey>,
    /// Lines that reduce the range of what another line forms, with that line.
    formed: BTreeSet<(Line, Line)>,
}

impl Lines {
    fn put(&mut self, charge: Charge, sources: &SourceMap) {
        if let Some(line) = line_at(charge.place.span, sources) {
            self.charges.entry(line).or_default().push(charge);
        }
    }

    /// The instruction that stands for a line: the one with the highest score, or the one of the line that
    /// magnifies most of its error, unless that is a rounding that adds up in a loop.
    fn of_line(&self, line: LineKey, mut charges: Vec<Charge>) -> Option<Charge> {
        charges.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.place.span.start.cmp(&b.place.span.start)));
        let first = charges.first()?;
        let score = first.score;
        let by = first.magnified_by.as_ref().filter(|_| !first.sums).map(|by| &by.place);
        let by = charges.iter().position(|charge| Some(&charge.place) == by).filter(|by| charges[*by].loses);
        let mut chosen = charges.swap_remove(by.unwrap_or(0));
        chosen.score = score;
        // Several roundings of a line are told together.
        let all = self.errors.get(&line).copied().unwrap_or(0.0);
        if chosen.rounds && all > chosen.error {
            let more =
                charges.iter().filter(|other| other.rounds && other.error >= 0.1 * chosen.error).count();
            chosen.together_with(more, all);
        }
        Some(chosen)
    }

    /// The lines in the order of their scores, each with its worst instruction. The line that magnifies a
    /// rounding comes before the line that rounds, unless it reduces the range of what that line forms.
    fn culprits(mut self, setting: &Setting, sources: &SourceMap) -> Vec<Culprit> {
        let charges = std::mem::take(&mut self.charges).into_iter();
        let mut chosen: Vec<(LineKey, Charge)> =
            charges.filter_map(|(line, charges)| Some((line, self.of_line(line, charges)?))).collect();
        // Small errors are left out, if there are others.
        let is_notable = |charge: &Charge| !charge.is_error || charge.error >= NOTABLE;
        let any = chosen.iter().any(|(_, charge)| is_notable(charge));
        let most = self.most;
        chosen.retain(|(line, charge)| is_notable(charge) || (!any && Some(*line) == most));
        let mut list: Vec<Culprit> =
            chosen.into_iter().filter_map(|(_, charge)| charge.told(setting, sources)).collect();
        list.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.line.cmp(&b.line)));
        let line = |culprit: &Culprit| (culprit.file.clone(), culprit.line);
        // Each line that magnifies is moved at most once, so that lines in a loop end somewhere.
        for at in 0..list.len() {
            let Some(rounds) = list.get(at) else { continue };
            let Some(by) = rounds.magnified_by.as_ref().map(|by| (by.file.clone(), by.line)) else {
                continue;
            };
            let is_formed = self.formed.contains(&(by.clone(), line(rounds)));
            let later = list.iter().skip(at + 1).position(|c| line(c) == by).filter(|_| !is_formed);
            if let Some(from) = later.map(|later| at + 1 + later) {
                list[at..=from].rotate_right(1);
            }
        }
        for (reduces, forms) in &self.formed {
            let place = |of: &Line| list.iter().position(|c| line(c) == *of);
            if let (Some(at), Some(from)) = (place(reduces), place(forms))
                && at < from
            {
                list[at..=from].rotate_right(1);
            }
        }
        list
    }
}

/// The ranges of the outputs of a trace.
pub(super) fn output_ranges(trace: &Trace, planes: &Planes) -> Vec<f64> {
    let of = |name: &str| {
        let own = |plane: &String| {
            plane == name || plane.strip_prefix(name).is_some_and(|r| r.starts_with(['.', '[']))
        };
        let found = planes.names.iter().zip(&planes.exact).filter(|(plane, _)| own(plane));
        found.map(|(_, values)| range(values)).reduce(f64::max).unwrap_or(1.0)
    };
    trace.outputs.iter().map(|(name, ..)| of(name)).collect()
}

/// The points with the largest errors.
pub(super) fn worst(planes: &Planes, grid: &Grid) -> Vec<(usize, usize)> {
    let mut error = vec![0.0_f64; grid.width * grid.height];
    for plane in 0..planes.names.len() {
        for (sum, e) in error.iter_mut().zip(errors(planes, plane)) {
            *sum = sum.max(e);
        }
    }
    let mut order: Vec<usize> = (0..error.len()).filter(|i| error[*i] > 0.0).collect();
    order.sort_by(|a, b| error[*b].total_cmp(&error[*a]).then(a.cmp(b)));
    order.into_iter().take(WORST).map(|i| (i % grid.width, i / grid.width)).collect()
}

/// Points spread over the image.
pub(super) fn spread(grid: &Grid) -> Vec<(usize, usize)> {
    let steps = |n: usize| (0..6).map(move |i| (i * n + n / 2) / 6);
    steps(grid.height).flat_map(|y| steps(grid.width).map(move |x| (x, y))).collect()
}

/// Calls of derivatives across jumps.
fn seen_jumps(subject: &Subject<'_>, grid: &Grid, setting: &Setting) -> Vec<Charge> {
    let points = setting.points(grid);
    let mut count: BTreeMap<(Span, &'static str), u32> = BTreeMap::default();
    let (mut all, middle) = (0, [grid.width / 3, grid.height / 3]);
    for along_x in [true, false] {
        let length = if along_x { grid.width } else { grid.height }.min(ALONG);
        let at = |i: usize| if along_x { (i, middle[1]) } else { (middle[0], i) };
        let mut traces = (0..length).map(|i| subject.follow(&subject.base, &points, at(i).0, at(i).1));
        let Some(Some(mut here)) = traces.next() else { continue };
        for next in traces.flatten() {
            all += 1;
            for place in jumps(&here, &next, along_x) {
                *count.entry(place).or_default() += 1;
            }
            here = next;
        }
    }
    let charge = |((span, function), n): ((Span, &'static str), u32)| {
        let share = f64::from(n) / f64::from(all.max(1));
        let why = format!(
            "its argument jumps between neighbouring pixels at {} of them, which the derivative does not see",
            percent(share)
        );
        Charge::seen(span, function, share, why)
    };
    count.into_iter().map(charge).collect()
}
