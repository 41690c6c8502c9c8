//! From the blame of instructions to lines of the source.

use super::blame::{Blame, Place, ROUNDING, blame};
use super::jumps::jumps;
use super::subject::{Planes, Subject};
use super::sweep::{Setting, errors, percent, range};
use crate::quote::Quote;
use crate::sanitize::{Kind, events_at};
use osl_ir::Span;
use osl_scene::Grid;
use osl_syntax::source::SourceMap;
use serde::Serialize;
use std::collections::BTreeMap;

/// A source line to blame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Culprit {
    /// The file.
    pub file: String,
    /// The line, from 1.
    pub line: u32,
    /// The column of the instruction with the highest score, from 1.
    pub column: u32,
    /// The text of the line.
    pub text: String,
    /// The text of that instruction.
    pub code: String,
    /// Its operation, in the words of the IR; or the kind of the numeric event.
    pub what: String,
    /// The setting at which it happens.
    pub setting: String,
    /// What lines are ranked by: the error that the instruction magnifies, and with less weight the error of
    /// its rounding.
    pub score: f64,
    /// The larger of these two errors, as a share of the outputs' range, averaged over the examined points.
    /// For numeric events, the share of the points.
    pub error: f64,
    /// The explanation, in words.
    pub why: String,
}

/// An instruction with its score, its error and an explanation.
type Charge = (Place, [f64; 2], String);

/// Number of points with the largest errors that are followed.
const WORST: usize = 24;
/// Points of a row and of a column at which derivatives are compared with differences.
const ALONG: usize = 64;

/// The lines that harm the points of a setting, the worst first.
#[derive(Clone, Debug, Default)]
pub struct Found {
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
) -> Found {
    let points = setting.points(grid);
    let worst = if blames { worst(planes, grid) } else { Vec::new() };
    let spread = spread(grid);
    let mut found: BTreeMap<Place, Blame> = BTreeMap::default();
    let mut events: BTreeMap<(Span, Kind), u32> = BTreeMap::default();
    let (mut followed, mut skipped) = ((0, 0), 0);
    for (list, is_worst) in [(&worst, true), (&spread, false)] {
        for (x, y) in list {
            let Some(trace) = subject.follow(&subject.base, &points, *x, *y) else {
                skipped += 1;
                continue;
            };
            if is_worst {
                for (place, blame) in blame(&trace, &output_ranges(&trace, planes)) {
                    found.entry(place).or_default().add(&blame);
                }
            } else {
                for event in events_at(&trace, subject.base.written, sources) {
                    *events.entry(event).or_default() += 1;
                }
            }
            if is_worst { followed.0 += 1 } else { followed.1 += 1 }
        }
    }
    let (mut blamed, mut noticed) = (Lines::default(), Lines::default());
    let n = f64::from(followed.0.max(1));
    for (place, blame) in found {
        let score = blame.score() / n;
        if score > 0.0 {
            let why = reason(&blame, n);
            let error = blame.amplified.max(blame.rounded) / n;
            blamed.put(place, [score, error], why, sources);
        }
    }
    for ((span, kind), count) in events {
        let share = f64::from(count) / f64::from(followed.1.max(1));
        let Some(does) = does(kind) else { continue };
        let why = format!("{does} at {} of the points", percent(share));
        noticed.put(Place { span, what: kind.name().to_string() }, [share; 2], why, sources);
    }
    if subject.base.differentiates {
        for (span, function, share) in seen_jumps(subject, grid, setting) {
            let what = function.to_string();
            let why = format!(
                "its argument jumps between neighbouring pixels at {} of them, which the derivative does not see",
                percent(share)
            );
            noticed.put(Place { span, what }, [share; 2], why, sources);
        }
    }
    Found { blamed: blamed.culprits(setting, sources), noticed: noticed.culprits(setting, sources), skipped }
}

/// What an instruction does at a numeric event; `None` for events of precision, for which lines are blamed.
fn does(kind: Kind) -> Option<&'static str> {
    match kind {
        Kind::Domain | Kind::ZeroDivision => Some("is given what it is not defined for"),
        Kind::IntOverflow => Some("overflows an int"),
        Kind::IntConversion => Some("makes an int of a float that does not fit"),
        Kind::Edges => Some("has edges out of order"),
        Kind::Index => Some("is an index out of range"),
        Kind::Nan => Some("makes a NaN"),
        Kind::Infinity => Some("makes a number that is too large for a float"),
        Kind::Cancellation | Kind::Denormal => None,
    }
}

/// Charges by line.
#[derive(Default)]
struct Lines(BTreeMap<(u32, u32), Vec<Charge>>);

impl Lines {
    fn put(&mut self, place: Place, score: [f64; 2], why: String, sources: &SourceMap) {
        if let (Some(file), Some(at)) = (sources.file_at(place.span.start), sources.place(place.span))
            && place.span != Span::default()
        {
            self.0.entry((file.base, at.line)).or_default().push((place, score, why));
        }
    }

    /// The lines, the worst first, each with its worst instruction.
    fn culprits(self, setting: &Setting, sources: &SourceMap) -> Vec<Culprit> {
        let of_line = |mut instructions: Vec<Charge>| {
            instructions.sort_by(|a, b| b.1[0].total_cmp(&a.1[0]).then(a.0.span.start.cmp(&b.0.span.start)));
            let (place, score, why) = instructions.into_iter().next()?;
            culprit(&place, score, why, setting, sources)
        };
        let mut list: Vec<Culprit> = self.0.into_values().filter_map(of_line).collect();
        list.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.line.cmp(&b.line)));
        list
    }
}

fn reason(blame: &Blame, points: f64) -> String {
    let runs = f64::from(blame.runs.max(1));
    if blame.amplified >= ROUNDING * blame.rounded {
        if blame.flips > 0 {
            let share = f64::from(blame.flips) / runs;
            return format!(
                "jumps: its result is another than in double precision in {} of its runs at the worst points",
                percent(share)
            );
        }
        return match blame.factor {
            factor if factor > 1.0 && factor.is_finite() => {
                format!(
                    "loses digits: it magnifies the error of its arguments up to {} times",
                    crate::explain::short(factor, 2)
                )
            }
            _ => "loses digits: a rounding of its arguments makes its result wrong".to_string(),
        };
    }
    let times = runs / points;
    if times >= 4.0 {
        return format!("rounds its result {} times a point, which adds up", crate::explain::short(times, 2));
    }
    "rounds its result, which later lines make worse".to_string()
}

fn culprit(
    place: &Place,
    [score, error]: [f64; 2],
    why: String,
    setting: &Setting,
    sources: &SourceMap,
) -> Option<Culprit> {
    let Quote { file, line, column, text, code } = Quote::of(place.span, sources)?;
    Some(Culprit {
        file,
        line,
        column,
        text,
        code,
        what: place.what.clone(),
        setting: setting.text(),
        score,
        error,
        why,
    })
}

/// The ranges of the outputs of a trace.
fn output_ranges(trace: &crate::trace::Trace, planes: &Planes) -> Vec<f64> {
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
fn worst(planes: &Planes, grid: &Grid) -> Vec<(usize, usize)> {
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
fn spread(grid: &Grid) -> Vec<(usize, usize)> {
    let steps = |n: usize| (0..6).map(move |i| (i * n + n / 2) / 6);
    steps(grid.height).flat_map(|y| steps(grid.width).map(move |x| (x, y))).collect()
}

/// Calls of derivatives across jumps, with the share of the points at which they occur.
fn seen_jumps(subject: &Subject<'_>, grid: &Grid, setting: &Setting) -> Vec<(Span, &'static str, f64)> {
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
    count.into_iter().map(|((span, f), n)| (span, f, f64::from(n) / f64::from(all.max(1)))).collect()
}
