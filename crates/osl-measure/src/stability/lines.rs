//! From the blame of instructions to lines of the source.

use super::blame::blame;
use super::instruction::{Blame, InstSite, ROUNDING};
use super::jumps::jumps;
use super::pairs::{Pairs, Partner, Side};
use super::subject::{Planes, Subject};
use super::sweep::{Setting, errors, percent, range};
use crate::explain::short;
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
    /// The line whose rounding the instruction magnifies, if most of it is from one line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnifies: Option<Partner>,
    /// The line that magnifies the instruction's rounding the most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnified_by: Option<Partner>,
}

/// An instruction with its score and its error.
#[derive(Default)]
struct Charge {
    place: InstSite,
    score: f64,
    error: f64,
    why: String,
    magnifies: Option<Partner>,
    magnified_by: Option<Partner>,
}

/// Number of points with the largest errors that are followed.
const WORST: usize = 24;
/// Points of a row and of a column at which derivatives are compared with differences.
const ALONG: usize = 64;

/// The lines that harm the points of a setting, the worst first.
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
    let mut found: BTreeMap<InstSite, Blame> = BTreeMap::default();
    let mut pairs = Pairs::default();
    let mut events: BTreeMap<(Span, Kind), u32> = BTreeMap::default();
    let (mut followed, mut skipped) = ((0, 0), 0);
    for (list, is_worst) in [(&worst, true), (&spread, false)] {
        for (x, y) in list {
            let Some(trace) = subject.follow(&subject.base, &points, *x, *y) else {
                skipped += 1;
                continue;
            };
            if is_worst {
                let blames = blame(&trace, &output_ranges(&trace, planes));
                for (place, blame) in blames.places {
                    found.entry(place).or_default().add(&blame);
                }
                pairs.merge(blames.pairs);
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
    for (place, blame) in &found {
        let score = blame.score() / n;
        if score > 0.0 {
            blamed.put(charge(place, blame, n, (&pairs, &found), sources), sources);
        }
    }
    for ((span, kind), count) in events {
        let share = f64::from(count) / f64::from(followed.1.max(1));
        let Some(does) = does(kind) else { continue };
        let why = format!("{does} at {} of the points", percent(share));
        noticed.put(Charge::seen(span, kind.name(), share, why), sources);
    }
    if subject.base.differentiates {
        for (span, function, share) in seen_jumps(subject, grid, setting) {
            let why = format!(
                "its argument jumps between neighbouring pixels at {} of them, which the derivative does not see",
                percent(share)
            );
            noticed.put(Charge::seen(span, function, share, why), sources);
        }
    }
    BlamedLines {
        blamed: blamed.culprits(setting, sources),
        noticed: noticed.culprits(setting, sources),
        skipped,
    }
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
    fn put(&mut self, charge: Charge, sources: &SourceMap) {
        let span = charge.place.span;
        if let (Some(file), Some(at)) = (sources.file_at(span.start), sources.place(span))
            && span != Span::default()
        {
            self.0.entry((file.base, at.line)).or_default().push(charge);
        }
    }

    /// The lines, the worst first, each with its worst instruction. The line that magnifies a rounding comes
    /// before the line that rounds.
    fn culprits(self, setting: &Setting, sources: &SourceMap) -> Vec<Culprit> {
        let of_line = |mut charges: Vec<Charge>| {
            charges.sort_by(|a, b| {
                b.score.total_cmp(&a.score).then(a.place.span.start.cmp(&b.place.span.start))
            });
            charges.into_iter().next()?.told(setting, sources)
        };
        let mut list: Vec<Culprit> = self.0.into_values().filter_map(of_line).collect();
        list.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.line.cmp(&b.line)));
        // Each line that magnifies is moved at most once, so that lines in a loop end somewhere.
        for at in 0..list.len() {
            let Some(by) = list.get(at).and_then(|culprit| culprit.magnified_by.clone()) else { continue };
            let later = list.iter().skip(at + 1).position(|c| (&c.file, c.line) == (&by.file, by.line));
            if let Some(from) = later.map(|later| at + 1 + later) {
                list[at..=from].rotate_right(1);
            }
        }
        list
    }
}

impl Charge {
    /// A numeric event.
    fn seen(span: Span, what: &str, share: f64, why: String) -> Charge {
        let place = InstSite { span, what: what.to_string() };
        Charge { place, score: share, error: share, why, ..Charge::default() }
    }

    fn told(self, setting: &Setting, sources: &SourceMap) -> Option<Culprit> {
        let Quote { file, line, column, text, code } = Quote::of(self.place.span, sources)?;
        Some(Culprit {
            file,
            line,
            column,
            text,
            code,
            what: self.place.what,
            setting: setting.text(),
            score: self.score,
            error: self.error,
            why: self.why,
            magnifies: self.magnifies,
            magnified_by: self.magnified_by,
        })
    }
}

/// What an instruction is blamed for at `points` points.
fn charge(
    place: &InstSite,
    blame: &Blame,
    points: f64,
    (pairs, found): (&Pairs, &BTreeMap<InstSite, Blame>),
    sources: &SourceMap,
) -> Charge {
    let mut charge = Charge {
        place: place.clone(),
        score: blame.score() / points,
        error: blame.amplified.max(blame.rounded) / points,
        ..Charge::default()
    };
    let runs = f64::from(blame.runs.max(1));
    let says = |own: &Option<Partner>, sources| own.as_ref().map(|partner| partner.words(place, sources));
    if blame.amplified >= ROUNDING * blame.rounded {
        charge.magnifies = pairs.partner(Side::Rounds, place, sources);
        let rounds = says(&charge.magnifies, sources);
        let factor = blame.factor;
        charge.why = match rounds {
            _ if blame.flips > 0 => {
                let at = rounds.map_or_else(String::new, |line| format!(" at what {line} rounds"));
                let share = percent(f64::from(blame.flips) / runs);
                format!(
                    "jumps{at}: its result is another than in double precision in {share} of its runs at the \
                     worst points"
                )
            }
            _ if !(factor > 1.0 && factor.is_finite()) => {
                "loses digits: a rounding of its arguments makes its result wrong".to_string()
            }
            Some(line) => {
                format!("loses digits: it magnifies up to {} times what {line} rounds", short(factor, 2))
            }
            None => format!(
                "loses digits: it magnifies the error of its arguments up to {} times",
                short(factor, 2)
            ),
        };
        return charge;
    }
    let times = runs / points;
    if times >= 4.0 {
        charge.why = format!("rounds its result {} times a point, which adds up", short(times, 2));
        return charge;
    }
    charge.magnified_by = pairs.partner(Side::Magnifies, place, sources);
    let by = charge.magnified_by.as_ref().and_then(|by| found.get(&by.place));
    charge.why = match (says(&charge.magnified_by, sources), by) {
        (Some(line), Some(by)) if by.flips > 0 => format!("rounds its result, at which {line} jumps"),
        (Some(line), Some(by)) => {
            format!("rounds its result, which {line} magnifies up to {} times", short(by.factor, 2))
        }
        _ => "rounds its result, which later lines make worse".to_string(),
    };
    charge
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
