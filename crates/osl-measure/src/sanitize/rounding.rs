//! A second opinion on digits: each point is followed three times with random rounding, and the digits in
//! which the three agree are those that rounding leaves right.
//!
//! This needs no double precision. So it also sees what double precision does not change: ints, hashes, and
//! coordinates of textures that depend on rounded numbers.

use super::detect::ALL_DIGITS;
use super::watch::{Points, Subject, nth, stride};
use crate::quote::Quote;
use crate::trace::{self, Alone, Exact, Node, NodeId, OnePoint, Trace, What};
use osl_exec::Services;
use osl_ir::Span;
use osl_ir::ir::Const;
use osl_syntax::source::SourceMap;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

/// Runs of each point: the smallest number for which the method is used.
pub(crate) const RUNS: usize = 3;
/// Student's t for 95 % and two degrees of freedom.
const STUDENT: f64 = 4.303;
/// Points are at most so many; they are spread over the picture.
const MOST: usize = 1024;
/// An output has few digits at a point if it has lost this many.
const LOST: f64 = 3.0;
/// An instruction is to blame if its result has this many digits fewer than its operands.
const DROP: f64 = 2.0;

/// The digits that random rounding leaves.
#[derive(Clone, Debug, Serialize)]
pub struct Rounding {
    /// Runs of each point.
    pub runs: usize,
    /// The points that were compared.
    pub points: usize,
    /// The number of points that were too long to be followed to their end.
    pub cut: usize,
    /// The number of points that were not examined, because the time was over.
    pub not_examined: usize,
    /// The outputs that have numbers.
    pub outputs: Vec<Digits>,
    /// Where the digits fall apart, at the points at which an output has few; the most points first.
    pub lines: Vec<Apart>,
}

/// The digits of an output in which the runs agree, relative to its largest value: at most 7.2, which is all
/// that a float has.
#[derive(Clone, Debug, Serialize)]
pub struct Digits {
    /// The output.
    pub name: String,
    /// At the worst point.
    pub least: f64,
    /// At 95 % of the points at least.
    pub usual: f64,
    /// The number of points at which three digits or more are lost.
    pub few: usize,
}

/// A place where digits fall apart.
#[derive(Clone, Debug, Serialize)]
pub struct Apart {
    /// Where.
    #[serde(flatten)]
    pub quote: Quote,
    /// The number of points.
    pub points: usize,
    /// Whether the runs take different paths after it.
    pub parts: bool,
}

/// The mean and the standard deviation of a number over the runs, and whether the runs disagree on whether it
/// is a number at all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Spread {
    mean: f64,
    deviation: f64,
    is_split: bool,
}

impl Spread {
    fn of(values: [f64; RUNS]) -> Spread {
        if values.iter().all(|x| x.to_bits() == values[0].to_bits() || *x == values[0]) {
            return Spread { mean: if values[0].is_finite() { values[0] } else { 0.0 }, ..Spread::default() };
        }
        if !values.iter().all(|x| x.is_finite()) {
            return Spread { is_split: !values.iter().all(|x| x.is_nan()), ..Spread::default() };
        }
        let mean = values.iter().sum::<f64>() / RUNS as f64;
        let squares = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
        Spread { mean, deviation: (squares / (RUNS - 1) as f64).sqrt(), is_split: false }
    }

    /// The decimal digits that are right with a probability of 95 %, for numbers of this size.
    fn digits(self, size: f64) -> f64 {
        match self {
            Spread { is_split: true, .. } => 0.0,
            Spread { deviation: 0.0, .. } => ALL_DIGITS,
            Spread { deviation, .. } => {
                let share = (RUNS as f64).sqrt() * size / (STUDENT * deviation);
                pxfm::f_log10(share.max(1.0)).min(ALL_DIGITS)
            }
        }
    }
}

/// A place to blame, and whether the runs take different paths after it.
type Blamed = (Span, bool);

/// A point: for each output, the spreads of its numbers and the place to blame if they are too large.
struct Compared(Vec<(Vec<Spread>, Option<Blamed>)>);

/// Follows points three times, on all threads. The result does not depend on their number.
pub fn rounding(
    subject: &Subject,
    services: &Services,
    points: &Points<'_>,
    sources: &SourceMap,
) -> Rounding {
    let count = points.count();
    let wanted = count.min(MOST);
    let stride = stride(count);
    let one = |at: usize| {
        let point = OnePoint { source: points.source, point: nth(at, stride, count) };
        let follow = |run: u32| {
            trace::follow_alone(&subject.body, services, point, &subject.limits, Alone::Single(run))
        };
        let traces = [0, 1, 2].map(follow);
        let is_over = subject.limits.halted().is_some();
        let is_cut = traces.iter().any(|trace| trace.cut);
        (is_over, (!is_cut).then(|| compare(&traces)))
    };
    let together = 2 * rayon::current_num_threads();
    let mut names: Vec<String> = Vec::new();
    let mut found: Vec<Compared> = Vec::new();
    let (mut next, mut cut, mut is_over) = (0, 0, false);
    while next < wanted && !is_over {
        let chunk: Vec<_> = (next..wanted.min(next + together)).into_par_iter().map(one).collect();
        for (was_over, compared) in chunk {
            is_over |= was_over;
            if is_over {
                break;
            }
            next += 1;
            match compared {
                Some((own, compared)) => {
                    names = own;
                    found.push(compared);
                }
                None => cut += 1,
            }
        }
    }
    let (outputs, lines) = judged(&names, &found, sources);
    Rounding { runs: RUNS, points: found.len(), cut, not_examined: wanted - next, outputs, lines }
}

/// The digits of each output over the points, and the places to blame.
fn judged(names: &[String], found: &[Compared], sources: &SourceMap) -> (Vec<Digits>, Vec<Apart>) {
    let mut outputs = Vec::new();
    let mut blamed: BTreeMap<Span, (usize, bool, usize)> = BTreeMap::new();
    for (at, name) in names.iter().enumerate() {
        let own = || found.iter().enumerate().filter_map(|(i, point)| Some((i, point.0.get(at)?)));
        let spreads = own().flat_map(|(_, (spreads, _))| spreads);
        let size = spreads.map(|spread| spread.mean.abs()).fold(0.0, f64::max);
        let digits =
            |spreads: &[Spread]| spreads.iter().map(|spread| spread.digits(size)).fold(ALL_DIGITS, f64::min);
        let mut all: Vec<f64> = Vec::new();
        let mut few = 0;
        for (point, (spreads, place)) in own() {
            let digits = digits(spreads);
            all.push(digits);
            if digits > ALL_DIGITS - LOST {
                continue;
            }
            few += 1;
            if let Some((span, parts)) = place {
                let entry = blamed.entry(*span).or_insert((0, false, usize::MAX));
                // A place counts once for a point.
                if entry.2 != point {
                    *entry = (entry.0 + 1, entry.1, point);
                }
                entry.1 |= parts;
            }
        }
        if own().all(|(_, (spreads, _))| spreads.is_empty()) {
            continue;
        }
        all.sort_by(f64::total_cmp);
        let least = all.first().copied().unwrap_or(ALL_DIGITS);
        let usual = all.get(all.len() / 20).copied().unwrap_or(ALL_DIGITS);
        outputs.push(Digits { name: name.clone(), least, usual, few });
    }
    let mut lines: Vec<Apart> = blamed
        .into_iter()
        .filter_map(|(span, (points, parts, _))| {
            Some(Apart { quote: Quote::of(span, sources)?, points, parts })
        })
        .collect();
    lines.sort_by_key(|apart| (std::cmp::Reverse(apart.points), apart.quote.line, apart.quote.column));
    (outputs, lines)
}

/// The outputs of a point in its runs.
fn compare(traces: &[Trace; RUNS]) -> (Vec<String>, Compared) {
    let alike = alike(traces);
    let is_whole = traces.iter().all(|trace| trace.nodes.len() == alike);
    let mut names = Vec::new();
    let mut outputs = Vec::new();
    for (at, (name, _, ids)) in traces[0].outputs.iter().enumerate() {
        let spreads = spreads(&output(traces, at));
        let is_apart =
            spreads.iter().any(|spread| *spread != Spread { mean: spread.mean, ..Spread::default() });
        let place = match (is_apart, is_whole) {
            (false, _) => None,
            (true, true) => dropped(traces, ids).map(|span| (span, false)),
            (true, false) => parted(traces, alike).map(|span| (span, true)),
        };
        names.push(name.to_string());
        outputs.push((spreads, place));
    }
    (names, Compared(outputs))
}

/// The number of nodes, from the first one on, that are the same instructions in all runs.
pub(crate) fn alike(traces: &[Trace; RUNS]) -> usize {
    let [first, others @ ..] = traces;
    let is_same = |at: &usize| {
        let Some(node) = first.nodes.get(*at) else { return false };
        others.iter().all(|other| {
            other.nodes.get(*at).is_some_and(|other| {
                (&other.what, other.span, &other.args, other.result)
                    == (&node.what, node.span, &node.args, node.result)
            })
        })
    };
    (0..first.nodes.len()).take_while(is_same).count()
}

/// The last number before the runs part on which they disagree as an int: the condition or the index.
fn parted(traces: &[Trace; RUNS], alike: usize) -> Option<Span> {
    let differs = |at: &usize| {
        let [a, b, c] =
            traces.each_ref().map(|trace| trace.nodes.get(*at).and_then(|node| node.strict.as_ref()));
        matches!(a, Some(Const::Int(_))) && (a != b || a != c)
    };
    let at = (0..alike).rev().find(differs)?;
    traces[0].nodes.get(at).map(|node| node.span).filter(|span| *span != Span::default())
}

/// Which nodes are on the way to these values.
pub(crate) fn needed(trace: &Trace, ids: &[NodeId]) -> Vec<bool> {
    let nodes = &trace.nodes;
    let mut needed = vec![false; nodes.len()];
    let mark = |id: &NodeId, needed: &mut Vec<bool>| {
        if let Some(place) = needed.get_mut(*id as usize) {
            *place = true;
        }
    };
    ids.iter().for_each(|id| mark(id, &mut needed));
    for at in (0..nodes.len()).rev() {
        if needed[at] {
            nodes[at].args.iter().for_each(|id| mark(id, &mut needed));
        }
    }
    needed
}

/// The instruction on the way to a value whose result has most digits fewer than its operands.
fn dropped(traces: &[Trace; RUNS], ids: &[NodeId]) -> Option<Span> {
    let nodes = &traces[0].nodes;
    let needed = needed(&traces[0], ids);
    let digits = |at: usize| {
        let numbers = traces.each_ref().map(|trace| numbers(trace.nodes.get(at)));
        let own = |spread: Spread| spread.digits(spread.mean.abs());
        spreads(&numbers).into_iter().map(own).fold(ALL_DIGITS, f64::min)
    };
    let mut worst: Option<(f64, Span)> = None;
    for (at, node) in nodes.iter().enumerate().filter(|(at, _)| needed[*at]) {
        if node.span == Span::default() || !matches!(node.what, What::Lane(_) | What::Kernel(..)) {
            continue;
        }
        let own = digits(at);
        if own > ALL_DIGITS - DROP {
            continue;
        }
        let given = node.args.iter().map(|id| digits(*id as usize)).fold(ALL_DIGITS, f64::min);
        if given - own > worst.map_or(DROP, |(drop, _)| drop) {
            worst = Some((given - own, node.span));
        }
    }
    worst.map(|(_, span)| span)
}

/// The spread of each number; runs with other numbers of numbers have none.
fn spreads(numbers: &[Vec<f64>; RUNS]) -> Vec<Spread> {
    let [a, b, c] = numbers;
    a.iter().zip(b).zip(c).map(|((a, b), c)| Spread::of([*a, *b, *c])).collect()
}

/// The numbers of an output in each run.
pub(crate) fn output(traces: &[Trace; RUNS], at: usize) -> [Vec<f64>; RUNS] {
    traces.each_ref().map(|trace| {
        let ids = trace.outputs.get(at).map(|(_, _, ids)| &ids[..]).unwrap_or_default();
        ids.iter().flat_map(|id| numbers(trace.nodes.get(*id as usize))).collect()
    })
}

/// The numbers of a node in the arithmetic that was followed.
pub(crate) fn numbers(node: Option<&Node>) -> Vec<f64> {
    let value = node.and_then(|node| node.strict.as_ref().map(Exact::widen).or_else(|| node.exact.clone()));
    value.map(|value| value.numbers()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_those_of_student() {
        assert_eq!(Spread::of([0.5; 3]).digits(0.5), ALL_DIGITS);
        assert_eq!(Spread::of([f64::NAN; 3]).digits(1.0), ALL_DIGITS);
        assert_eq!(Spread::of([f64::NAN, 1.0, 1.0]).digits(1.0), 0.0);
        assert_eq!(Spread::of([1.0, 2.0, -1.0]).digits(0.7), 0.0);
        // A mean of 1 and a deviation of 1e-3: sqrt(3) / (4.303 * 1e-3) = 402.5.
        let digits = Spread::of([0.999, 1.0, 1.001]).digits(1.0);
        assert!((digits - 2.604_8).abs() < 1e-3, "{digits}");
    }
}
