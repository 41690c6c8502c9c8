//! The operations for which something can be proved: that an argument is in the function's domain, that a
//! divisor is never 0, that an index exists, that an int fits. They are the events that `sanitize` counts.

use super::defs::Defs;
use super::numbers::Numbers;
use crate::sanitize::Kind;
use osl_ir::Span;
use osl_ir::ir::{Body, Inst, Kernel, LaneOp, Op, ValueId};
use osl_numeric::Domain;
use osl_numeric::interval::{Enclosure, Interval, Whole};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The instructions that are watched, by their result, and what is to be proved of each.
#[derive(Debug, Default)]
pub(super) struct Watched(FxHashMap<ValueId, Vec<What>>);

impl Watched {
    /// The instructions of a body for which something can be proved and is not obvious. `is_own` tells
    /// whether the source has an instruction itself, rather than the compiler.
    pub(super) fn of(body: &Body, defs: &Defs, is_own: impl Fn(&Inst) -> bool) -> Watched {
        let mut watched = FxHashMap::default();
        for inst in body.insts() {
            let (Op::Lane(op, args), Some(result)) = (&inst.op, inst.results.first()) else { continue };
            // What holds for the constants alone, whatever the other arguments are, need not be said.
            let known = |arg: &ValueId| defs.constant(*arg).map(Enclosure::point);
            let given = args.iter().map(|arg| known(arg).unwrap_or_else(|| Enclosure::any(body.kind(*arg))));
            let given: Vec<Enclosure> = given.collect();
            let open = judge(*op, &given).into_iter().flatten().filter(|(_, (is_safe, _))| !is_safe);
            let open: Vec<What> = open.map(|(what, _)| what).collect();
            if !open.is_empty() && is_own(inst) {
                watched.insert(*result, open);
            }
        }
        Watched(watched)
    }
}

/// What is to be proved about an argument.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum What {
    /// It is not 0.
    Divisor,
    /// It is not negative.
    Root,
    /// It is positive.
    Logarithm,
    /// It is from -1 to 1.
    Arc,
    /// The base is not negative, or the exponent is whole; and a base of 0 has no negative exponent.
    Power,
    /// The vector is not zero.
    Direction,
    /// The edges are in order.
    Edges,
    /// An int can hold the number.
    Conversion,
    /// An int can hold the result.
    Overflow,
    /// The array with this name has the element.
    Index(Arc<str>),
}

impl What {
    /// The kind of the event that would happen.
    pub fn kind(&self) -> Kind {
        match self {
            What::Divisor => Kind::ZeroDivision,
            What::Edges => Kind::Edges,
            What::Conversion => Kind::IntConversion,
            What::Overflow => Kind::IntOverflow,
            What::Index(_) => Kind::Index,
            _ => Kind::Domain,
        }
    }
}

/// What was seen at a place.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// Whether it is right for all values.
    pub(super) is_safe: bool,
    /// Whether it is wrong for known values at code that is reached.
    pub(super) is_wrong: bool,
    /// The values of the argument.
    pub(super) values: Numbers,
}

/// A place of the source, and what is to be proved there.
pub(super) type ProofSite = (Span, What);

/// What one walk sees.
#[derive(Debug)]
pub(super) struct Sites {
    watched: Arc<Watched>,
    pub(super) seen: BTreeMap<ProofSite, Seen>,
    /// The number of open branches: code there may not be reached.
    pub(super) open: usize,
}

impl Sites {
    pub(super) fn new(watched: Arc<Watched>) -> Sites {
        Sites { watched, seen: BTreeMap::new(), open: 0 }
    }

    /// What is known without a walk: that nothing is proved at any place.
    pub(super) fn unknown(body: &Body, watched: &Arc<Watched>) -> Sites {
        let mut sites = Sites::new(watched.clone());
        for inst in body.insts() {
            let of_result = inst.results.first().and_then(|result| watched.0.get(result));
            let index = match &inst.op {
                Op::Kernel(Kernel::CheckIndex { name }, _) => Some(What::Index(name.clone())),
                _ => None,
            };
            for what in of_result.into_iter().flatten().cloned().chain(index) {
                sites.record(inst.span, what, (false, Numbers::NONE), false);
            }
        }
        sites
    }

    /// Adds what was seen on another path.
    pub(super) fn add(&mut self, other: Sites) {
        for ((span, what), seen) in other.seen {
            self.record(span, what, (seen.is_safe, seen.values), false);
        }
    }

    fn record(&mut self, span: Span, what: What, (is_safe, values): (bool, Numbers), is_known: bool) {
        let is_wrong = !is_safe && is_known && self.open == 0;
        let seen = self.seen.entry((span, what)).or_insert(Seen {
            is_safe: true,
            is_wrong: false,
            values: Numbers::NONE,
        });
        seen.is_safe &= is_safe;
        seen.is_wrong |= is_wrong;
        seen.values = seen.values.hull(values);
    }

    /// A lane operation gets these arguments.
    pub(super) fn lane(&mut self, op: LaneOp, given: &[Enclosure], inst: &Inst) {
        let Some(result) = inst.results.first() else { return };
        let Some(open) = self.watched.0.get(result) else { return };
        let judged = judge(op, given).map(|judged| judged.filter(|(what, _)| open.contains(what)));
        let is_known = given.iter().all(|value| value.value().is_some());
        for (what, verdict) in judged.into_iter().flatten() {
            self.record(inst.span, what, verdict, is_known);
        }
    }

    /// An index and the length of its array.
    pub(super) fn index(&mut self, kernel: &Kernel, given: &[Enclosure], inst: &Inst) {
        let (Kernel::CheckIndex { name }, [Enclosure::Int(index), Enclosure::Int(length)]) = (kernel, given)
        else {
            return;
        };
        let is_safe = index.is_within(0, length.lo.saturating_sub(1));
        let is_known = index.value().is_some() && length.value().is_some();
        let what = What::Index(name.clone());
        self.record(inst.span, what, (is_safe, Numbers::int(*index)), is_known);
    }
}

/// The intervals of an argument, component by component.
fn parts(value: Option<&Enclosure>) -> &[Interval] {
    value.map_or(&[], Enclosure::numbers)
}

fn hull(parts: &[Interval]) -> Interval {
    parts.iter().fold(Interval::NONE, |hull, part| hull.hull(*part))
}

/// What is to be proved, whether it holds, and the values for which it was examined.
type Judged = (What, (bool, Numbers));

/// What is to be proved of an operation: at most two statements. As in `sanitize`, a NaN among the arguments
/// is not the fault of this operation, except of a conversion to int.
fn judge(op: LaneOp, given: &[Enclosure]) -> [Option<Judged>; 2] {
    match op {
        LaneOp::IDiv => [judge_divisor(given), judge_ints(op, given)],
        LaneOp::IMod => [judge_divisor(given), None],
        LaneOp::IAdd | LaneOp::ISub | LaneOp::IMul | LaneOp::INeg | LaneOp::IAbs => {
            [judge_ints(op, given), None]
        }
        _ => [judge_floats(op, given), None],
    }
}

/// That the divisor of an operation on ints is not 0.
fn judge_divisor(given: &[Enclosure]) -> Option<Judged> {
    let [_, Enclosure::Int(b)] = given else { return None };
    Some((What::Divisor, (!b.contains(0), Numbers::int(*b))))
}

/// That the result of an operation on ints fits.
fn judge_ints(op: LaneOp, given: &[Enclosure]) -> Option<Judged> {
    let (a, b) = match given {
        [Enclosure::Int(a), Enclosure::Int(b)] => (*a, *b),
        [Enclosure::Int(a)] => (*a, *a),
        _ => return None,
    };
    let is_reached = !a.is_empty() && !b.is_empty();
    is_reached.then(|| (What::Overflow, (fits(op, a, b), Numbers::NONE)))
}

/// What holds for arguments that are floats.
fn judge_floats(op: LaneOp, given: &[Enclosure]) -> Option<Judged> {
    let all =
        |i: usize, test: fn(Interval) -> bool| parts(given.get(i)).iter().all(|part| test(part.numbers()));
    let at = |i: usize| hull(parts(given.get(i)));
    let floats = |i: usize| Numbers::float(at(i));
    Some(match op {
        LaneOp::ToInt => {
            let x = at(0);
            (What::Conversion, (!x.may_be_nan() && is_int(x), Numbers::float(x)))
        }
        LaneOp::Smoothstep | LaneOp::Linearstep => (What::Edges, (ordered(given, 0, 1, true), Numbers::NONE)),
        LaneOp::Clamp => (What::Edges, (ordered(given, 1, 2, false), Numbers::NONE)),
        LaneOp::Pow => (What::Power, (powers(given), floats(0))),
        _ => match op.domain() {
            Domain::Divisors => (What::Divisor, (all(1, |x| x.is_empty() || !x.has_zero()), floats(1))),
            Domain::Roots => (What::Root, (all(0, |x| x.is_empty() || x.lo() >= 0.0), floats(0))),
            Domain::Logs => (What::Logarithm, (all(0, |x| x.is_empty() || x.lo() > 0.0), floats(0))),
            Domain::Arcs => (What::Arc, (all(0, |x| x.is_within(-1.0, 1.0)), floats(0))),
            Domain::Directions => {
                let is_safe = parts(given.first()).iter().any(|x| !x.is_empty() && !x.has_zero());
                (What::Direction, (is_safe, Numbers::NONE))
            }
            _ => return None,
        },
    })
}

/// Whether every result of an operation on ints fits.
fn fits(op: LaneOp, a: Whole, b: Whole) -> bool {
    if op == LaneOp::IDiv {
        return !(a.contains(i32::MIN) && b.contains(-1));
    }
    let [a, b] = [[a.lo, a.hi], [b.lo, b.hi]].map(|ends| ends.map(i64::from));
    let is_int = |x: i64| i32::try_from(x).is_ok();
    let pairs = || a.into_iter().flat_map(|a| b.into_iter().map(move |b| (a, b)));
    match op {
        LaneOp::IAdd => pairs().all(|(a, b)| is_int(a + b)),
        LaneOp::ISub => pairs().all(|(a, b)| is_int(a - b)),
        LaneOp::IMul => pairs().all(|(a, b)| is_int(a * b)),
        _ => a.into_iter().all(|a| is_int(-a)),
    }
}

fn is_int(x: Interval) -> bool {
    x.is_within(-2_147_483_648.0, 2_147_483_520.0)
}

/// Whether a lower edge is always below the upper one, or not above it.
fn ordered(given: &[Enclosure], low: usize, high: usize, strictly: bool) -> bool {
    let (low, high) = (parts(given.get(low)), parts(given.get(high)));
    let at = |list: &[Interval], i: usize| list.get(i).or(list.first()).copied().unwrap_or(Interval::ANY);
    (0..low.len().max(high.len())).all(|i| {
        let (low, high) = (at(low, i).numbers(), at(high, i).numbers());
        let is_empty = low.is_empty() || high.is_empty();
        is_empty || if strictly { low.hi() < high.lo() } else { low.hi() <= high.lo() }
    })
}

fn powers(given: &[Enclosure]) -> bool {
    let (bases, powers) = (parts(given.first()), parts(given.get(1)));
    let at = |list: &[Interval], i: usize| list.get(i).or(list.first()).copied().unwrap_or(Interval::ANY);
    (0..bases.len().max(powers.len())).all(|i| {
        let (base, power) = (at(bases, i).numbers(), at(powers, i).numbers());
        if base.is_empty() || power.is_empty() {
            return true;
        }
        let is_whole = power.lo() == power.hi() && power.lo().fract() == 0.0;
        let is_pole = base.has_zero() && power.lo() < 0.0;
        (base.lo() >= 0.0 || is_whole) && !is_pole
    })
}
