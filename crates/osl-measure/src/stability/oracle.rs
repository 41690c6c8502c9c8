//! Whether double precision has enough digits to be the truth.
//!
//! Some points are followed three times in double precision, with results that are rounded up or down by
//! chance. Where the outputs of these runs differ notably, the errors of a report are not known. They are
//! not known either where the runs agree in the end, but an operand on the way had no right digit: a
//! recurrence may then have left its path and reached another limit.

use super::lines::{WORST, output_ranges, spread, worst};
use super::sensitivity::LineKey;
use super::subject::{Planes, Subject};
use super::sweep::NOTABLE;
use super::trial::Setting;
use crate::quote::{Quote, line_at};
use crate::sanitize::{RUNS, alike, needed, numbers, output};
use crate::trace::{NodeId, Trace, What};
use crate::words::short;
use osl_ir::Span;
use osl_ir::ir::LaneOp;
use osl_scene::Grid;
use osl_syntax::source::SourceMap;
use serde::Serialize;
use std::collections::BTreeMap;

/// The relative distance of the runs at which a number has no right digit.
const NO_DIGIT: f64 = 0.5;

/// The part of the budget for following points that these runs may take besides.
const SHARE: u64 = 8;

/// The relative distance that rounding alone makes in double precision.
const ROUNDING: f64 = 1e-16;

/// Double precision has too few digits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NotEnough {
    /// The number of points at which it has too few.
    pub points: usize,
    /// The number of points that were followed.
    pub followed: usize,
    /// How much the outputs of the runs differ at most, as a share of the range. It is small if a divisor
    /// without a right digit is all that was found.
    pub error: f64,
    /// Where most digits are lost.
    pub place: Option<Quote>,
}

impl NotEnough {
    /// The finding in words.
    pub(super) fn text(&self) -> String {
        let mut text = format!(
            "double precision is not enough here, so that these errors are not known: at {} of {} followed points ",
            self.points, self.followed
        );
        text += &match self.error >= NOTABLE {
            true => {
                format!("its own roundings change an output by up to {} of the range", short(self.error, 2))
            }
            false => "a divisor on the way has no right digit".to_string(),
        };
        if let Some(Quote { file, line, code, .. }) = &self.place {
            text += &format!("; most digits are lost at {file}:{line}, `{code}`");
        }
        text
    }
}

/// The digits that a line loses, and the place in it that loses most.
type Lost = BTreeMap<LineKey, (f64, (f64, Span))>;

/// Compares runs at the points with the largest errors and at others. `None` if double precision is enough,
/// or if no point could be followed.
pub(super) fn not_enough(
    subject: &Subject<'_>,
    grid: &Grid,
    planes: &Planes,
    sources: &SourceMap,
) -> Option<NotEnough> {
    let points = Setting::AsGiven.points(grid);
    let mut found = NotEnough { points: 0, followed: 0, error: 0.0, place: None };
    let mut lost = Lost::new();
    let mut budget = subject.limits.running.traces / SHARE;
    for (x, y) in worst(planes, grid).into_iter().take(WORST / 3).chain(spread(grid)) {
        let run = |run| subject.follow_doubled(&points, (x, y), run);
        let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(run) else { break };
        let traces = [a, b, c];
        let nodes = traces.iter().map(|trace| trace.nodes.len() as u64).sum();
        let Some(left) = budget.checked_sub(nodes) else { break };
        budget = left;
        if traces.iter().any(|trace| trace.cut) {
            continue;
        }
        found.followed += 1;
        let error = output_error(&traces, &output_ranges(&traces[0], planes));
        let (has_broken, own) = losses(&traces, sources);
        if error >= NOTABLE || has_broken {
            found.points += 1;
            found.error = found.error.max(error);
            for (line, (digits, most)) in own {
                let entry = lost.entry(line).or_insert((0.0, most));
                entry.0 += digits;
                if most.0 > entry.1.0 {
                    entry.1 = most;
                }
            }
        }
    }
    let worst = lost.into_values().max_by(|a, b| a.0.total_cmp(&b.0));
    found.place = worst.and_then(|(_, (_, span))| Quote::of(span, sources));
    (found.points > 0).then_some(found)
}

/// The largest difference of the outputs, as a share of their ranges.
fn output_error(traces: &[Trace; RUNS], ranges: &[f64]) -> f64 {
    let share = |(at, range): (usize, &f64)| distance(&output(traces, at)).min(*range) / range;
    ranges.iter().enumerate().map(share).fold(0.0, f64::max)
}

/// The largest distance of one number in the runs; infinite if it is finite in some of them.
fn distance([a, b, c]: &[Vec<f64>; RUNS]) -> f64 {
    let one = |((a, b), c): ((&f64, &f64), &f64)| match [a, b, c].map(|x| x.is_finite()) {
        [true, true, true] => a.max(*b).max(*c) - a.min(*b).min(*c),
        [false, false, false] => 0.0,
        _ => f64::INFINITY,
    };
    a.iter().zip(b).zip(c).map(one).fold(0.0, f64::max)
}

/// Whether a divisor that the outputs need has no right digit, and a sum with the quotient has none either;
/// and the digits that each line loses. The last correction of an iteration that converges is such a
/// quotient, but the sum with it is right.
fn losses(traces: &[Trace; RUNS], sources: &SourceMap) -> (bool, Lost) {
    let [first, ..] = traces;
    let outputs: Vec<NodeId> = first.outputs.iter().flat_map(|(_, _, ids)| ids.iter().copied()).collect();
    let needed = needed(first, &outputs);
    let mut shares: Vec<f64> = Vec::new();
    let mut spoilt = vec![false; first.nodes.len()];
    let (mut is_broken, mut lost) = (false, Lost::new());
    for (at, node) in first.nodes.iter().enumerate().take(alike(traces)) {
        let values = traces.each_ref().map(|trace| numbers(trace.nodes.get(at)));
        let size = values.iter().flatten().fold(0.0_f64, |size, x| size.max(x.abs()));
        let distance = distance(&values);
        shares.push(if distance > 0.0 { (distance / size).clamp(0.0, 1.0) } else { 0.0 });
        let of = |id: &NodeId| shares.get(*id as usize).copied().unwrap_or(0.0);
        let own = shares.last().copied().unwrap_or(0.0);
        if needed.get(at) != Some(&true) || own == 0.0 {
            continue;
        }
        let is_spoilt = |id: &NodeId| spoilt.get(*id as usize) == Some(&true);
        let divides = matches!(node.what, What::Lane(LaneOp::FDiv | LaneOp::FDivBy));
        let by_nothing = divides && node.args.get(1).is_some_and(|id| of(id) > NO_DIGIT);
        if own > NO_DIGIT && (by_nothing || node.args.iter().any(is_spoilt)) {
            spoilt[at] = true;
            is_broken |= matches!(node.what, What::Lane(LaneOp::FAdd | LaneOp::FSub));
        }
        let given = node.args.iter().map(of).fold(ROUNDING, f64::max);
        if own > given
            && let Some(line) = line_at(node.span, sources)
        {
            let digits = pxfm::f_log10(own / given);
            let entry = lost.entry(line).or_insert((0.0, (0.0, node.span)));
            entry.0 += digits;
            if digits > entry.1.0 {
                entry.1 = (digits, node.span);
            }
        }
    }
    (is_broken, lost)
}
