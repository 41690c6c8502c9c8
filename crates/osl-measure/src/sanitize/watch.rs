//! Counts events over the points of a grid.
//!
//! Events count where the source has the operation itself. Derivatives that the compiler writes, and the
//! inside of composed built-ins, are left out: their guards compute both sides of a choice, so an event there
//! need not matter.

use super::detect::{DIGITS_LOST, DetectedEvent, LOST_AT, can_cancel, events};
use super::words::{Example, example};
use super::{Event, Kind, Report};
use crate::quote::Quote;
use crate::trace::{self, Node, OnePoint, Trace, What};
use crate::words::closes;
use osl_exec::{PointSource, Services};
use osl_hir::builtins::{self, Emit};
use osl_ir::Span;
use osl_ir::ir::{Body, LaneOp};
use osl_ir::passes::{self, Pass};
use osl_limits::Limits;
use osl_syntax::source::SourceMap;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, BTreeSet};

/// A shader whose points are examined.
pub struct Subject {
    pub(crate) body: Body,
    /// The number of values before derivatives were written.
    pub(crate) written: usize,
    pub(crate) limits: Limits,
    /// What is not examined, in words.
    pub(crate) left_out: Vec<String>,
}

impl Subject {
    /// The program of a lowered body without notes. Code that no requested output needs is left out, as in a
    /// run.
    pub fn new(mut body: Body, options: &passes::Options) -> Subject {
        let mut options = options.clone();
        passes::closures_as_numbers(&mut body, options.outputs.as_mut());
        let options = &options;
        for pass in [Pass::Ssa, Pass::Slice, Pass::Dce] {
            passes::apply(&mut body, pass, options);
        }
        let written = body.values.len();
        let body = trace::prepare(body, &options.varying, &options.derivs, &options.limits);
        Subject { body, written, limits: options.limits.clone(), left_out: Vec::new() }
    }

    /// Follows a point.
    pub fn follow(&self, services: &Services, point: OnePoint<'_>) -> Trace {
        trace::follow(&self.body, services, point, &self.limits)
    }
}

/// Whether the source has the instruction of a node, rather than the compiler. `written` is the number of
/// values before derivatives were written.
fn is_of_source(node: &Node, written: usize) -> bool {
    node.span != Span::default() && node.result.is_none_or(|value| value.index() < written)
}

/// The events of a point, except cancellations, which only the other points can judge. `written` is the
/// number of values of the body before derivatives were written.
pub(crate) fn events_at(trace: &Trace, written: usize, sources: &SourceMap) -> BTreeSet<(Span, Kind)> {
    let mut all = BTreeSet::new();
    for node in trace.nodes.iter().filter(|node| is_of_source(node, written)) {
        for found in events(trace, node).into_iter().filter(|found| found.kind != Kind::Cancellation) {
            let is_own = match node.what {
                What::Lane(op) => is_written(op, sources.text(node.span)),
                _ => true,
            };
            if is_own {
                all.insert((node.span, found.kind));
            }
        }
    }
    all
}

/// The report, and what happened at each point.
pub struct Examined {
    /// The report.
    pub report: Report,
    /// The kinds of events at each point, row by row, by [`Kind::bit`].
    pub happened: Vec<u16>,
}

/// The points to examine, as pixels of a picture.
pub struct Points<'a> {
    /// The points.
    pub source: &'a dyn PointSource,
    /// Columns and rows of the picture.
    pub size: (usize, usize),
    /// The pixel of each point, row by row, if the picture does not show a point in each pixel, as on a
    /// surface. Otherwise, the points are those of a grid.
    pub pixels: Option<&'a [u32]>,
}

impl Points<'_> {
    pub(super) fn count(&self) -> usize {
        self.pixels.map_or(self.size.0.saturating_mul(self.size.1), <[u32]>::len)
    }

    /// The pixel of a point, row by row.
    fn pixel(&self, point: usize) -> usize {
        match (self.pixels, self.source.blocks()) {
            (Some(pixels), _) => pixels.get(point).map_or(0, |pixel| *pixel as usize),
            (None, Some(blocks)) => {
                let (x, y) = blocks.pixel(point);
                y * self.size.0 + x
            }
            (None, None) => point,
        }
    }
}

/// Examines points on all threads. They are visited in an order that is spread over the picture, so that a
/// share of them stands for all when the time is over. The report does not depend on the number of threads.
pub fn sanitize(
    subject: &Subject,
    services: &Services,
    points: &Points<'_>,
    sources: &SourceMap,
    shader: &str,
) -> Examined {
    let (width, height) = points.size;
    let count = points.count();
    let mut watch = Watch::new(subject, sources);
    let mut report = Report {
        shader: shader.to_string(),
        grid: [width, height],
        digits_lost: DIGITS_LOST,
        lost_at: LOST_AT,
        ..Report::default()
    };
    let stride = stride(count);
    // A trace may be large, so only a few are kept at a time.
    let together = 2 * rayon::current_num_threads();
    let mut next = 0;
    'all: while next < count {
        let chunk: Vec<usize> = (next..count.min(next + together)).map(|at| nth(at, stride, count)).collect();
        next += chunk.len();
        if subject.limits.halted().is_some() {
            break;
        }
        let follow =
            |point: &usize| subject.follow(services, OnePoint { source: points.source, point: *point });
        let traces: Vec<Trace> = chunk.par_iter().map(follow).collect();
        for (point, trace) in chunk.iter().zip(&traces) {
            if trace.cut {
                // What ran out of time is left out as a whole.
                if subject.limits.halted().is_some() {
                    break 'all;
                }
                report.cut += 1;
            }
            report.points += 1;
            watch.point(trace, points.pixel(*point));
        }
    }
    report.not_examined = count - report.points;
    let reached = |span: &Span| watch.reached.get(span).map_or(0, |reached| reached.points);
    watch.places.retain(|(span, kind), tally| {
        *kind != Kind::Cancellation || tally.pixels.len() as f64 >= LOST_AT * reached(span) as f64
    });
    let mut happened = vec![0; width.saturating_mul(height)];
    for ((_, kind), tally) in &watch.places {
        for pixel in &tally.pixels {
            if let Some(kinds) = happened.get_mut(*pixel) {
                *kinds |= kind.bit();
            }
        }
    }
    let placed = |((span, kind), tally): (&(Span, Kind), &Tally)| {
        let Example { operands, result, exact, text } = tally.example.clone();
        let points = tally.pixels.len();
        Some(Event {
            kind: *kind,
            quote: Quote::of(*span, sources)?,
            points,
            share: points as f64 / report.points.max(1) as f64,
            times: tally.times,
            first: [tally.first % width, tally.first / width],
            operands,
            result,
            exact,
            example: text,
        })
    };
    report.events = watch.places.iter().filter_map(placed).collect();
    Examined { report, happened }
}

/// The point that is visited as number `at`.
pub(super) fn nth(at: usize, stride: usize, count: usize) -> usize {
    (at as u128 * stride as u128 % count.max(1) as u128) as usize
}

/// A step that visits each of `count` points once, and leaves no large part of them for the end: near the
/// golden section, and with no common divisor.
pub(super) fn stride(count: usize) -> usize {
    const GOLDEN: f64 = 0.618_034;
    let near = (count as f64 * GOLDEN) as usize;
    (near.max(1)..).find(|step| common_divisor(*step, count) == 1).unwrap_or(1)
}

fn common_divisor(mut a: usize, mut b: usize) -> usize {
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// The events of one kind at one place.
struct Tally {
    /// The points, row by row, in the order in which they were visited.
    pixels: Vec<usize>,
    times: u64,
    /// The first pixel, row by row.
    first: usize,
    /// The event there.
    example: Example,
}

/// The points that computed something.
#[derive(Default)]
struct Reached {
    points: usize,
    last: Option<usize>,
}

/// The events of all points so far.
struct Watch<'a> {
    subject: &'a Subject,
    sources: &'a SourceMap,
    places: BTreeMap<(Span, Kind), Tally>,
    /// The points that computed each sum or difference.
    reached: FxHashMap<Span, Reached>,
    /// Whether the source has an operation at a span, or a built-in that uses it.
    written: BTreeMap<(Span, LaneOp), bool>,
}

impl<'a> Watch<'a> {
    fn new(subject: &'a Subject, sources: &'a SourceMap) -> Watch<'a> {
        let (places, reached, written) = (BTreeMap::new(), FxHashMap::default(), BTreeMap::new());
        Watch { subject, sources, places, reached, written }
    }

    /// Counts the events of a point.
    fn point(&mut self, trace: &Trace, pixel: usize) {
        let mut here: BTreeMap<(Span, Kind), (u64, &Node, DetectedEvent)> = BTreeMap::new();
        let written = self.subject.written;
        for node in trace.nodes.iter().filter(|node| is_of_source(node, written)) {
            if can_cancel(node) {
                let reached = self.reached.entry(node.span).or_default();
                if reached.last.replace(pixel) != Some(pixel) {
                    reached.points += 1;
                }
            }
            for found in events(trace, node) {
                if self.is_written(node) {
                    here.entry((node.span, found.kind)).or_insert((0, node, found)).0 += 1;
                }
            }
        }
        for (place, (times, node, found)) in here {
            let tally = self.places.entry(place).or_insert_with(|| Tally {
                pixels: Vec::new(),
                times: 0,
                first: pixel,
                example: example(trace, node, found),
            });
            tally.pixels.push(pixel);
            tally.times += times;
            if pixel < tally.first {
                (tally.first, tally.example) = (pixel, example(trace, node, found));
            }
        }
    }

    fn is_written(&mut self, node: &Node) -> bool {
        let What::Lane(op) = node.what else { return true };
        let sources = self.sources;
        *self.written.entry((node.span, op)).or_insert_with(|| is_written(op, sources.text(node.span)))
    }
}

/// Whether the code of an instruction is this operation, rather than a built-in that uses it inside.
pub(crate) fn is_written(op: LaneOp, code: &str) -> bool {
    let head = |op: LaneOp| op.text().split('.').next().unwrap_or_default();
    let Some(row) = callee(code).and_then(builtins::find) else { return true };
    let own = head(op);
    match row.emit {
        Emit::Lane(other) => head(other) == own,
        // The forms for ints of a function, and forms with more arguments.
        _ => row.name == own || own.strip_prefix('i') == Some(row.name),
    }
}

/// The name of the function, if the code is a single call.
fn callee(code: &str) -> Option<&str> {
    let code = code.trim();
    let (name, rest) = code.split_once('(')?;
    let name = name.trim_end();
    if name.is_empty() || !name.chars().all(|c| c.is_alphanumeric() || c == '_') {
        return None;
    }
    (closes(rest.char_indices(), '(', ')')? + 1 == rest.len()).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_visited_once() {
        for count in [1, 2, 3, 64, 100, 4096, 4097] {
            let stride = stride(count);
            let mut seen = vec![false; count];
            (0..count).for_each(|i| seen[i * stride % count] = true);
            assert!(seen.iter().all(|seen| *seen), "{count}");
        }
    }

    #[test]
    fn calls_are_told_from_operators() {
        assert_eq!(callee("aastep(0.5, (u))"), Some("aastep"));
        assert_eq!(callee("f(u) / g(v)"), None);
        assert_eq!(callee("(int) x"), None);
        assert_eq!(callee("a / b"), None);
        assert!(is_written(LaneOp::FDiv, "a / f(b)"));
        assert!(!is_written(LaneOp::FDiv, "aastep(0.5, u)"));
        assert!(is_written(LaneOp::Log, "log(u)"));
        assert!(is_written(LaneOp::FmodExact, "fmod(u, 2)"));
        assert!(is_written(LaneOp::ToInt, "int(u)"));
    }
}
