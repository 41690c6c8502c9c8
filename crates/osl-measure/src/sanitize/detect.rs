//! The numeric events of one executed instruction.
//!
//! All facts come from the trace: the operands and the result in strict arithmetic, and for cancellation also
//! in double precision. The domains of functions are those of the list of lane operations. This module must
//! not know points, sources or reports.

use super::Kind;
use crate::explain::digits;
use crate::trace::{Node, Trace, What};
use osl_ir::ir::{Const, Kernel, LaneOp};
use osl_numeric::{Cost, Domain, MAX_ARGS};

/// Decimal digits that a float can hold.
pub(super) const ALL_DIGITS: f64 = 7.2;
/// A sum or difference is catastrophic if its result has this many right digits fewer than its operands.
pub const DIGITS_LOST: f64 = 4.0;
/// Differences that cross 0 lose digits at a few points, which does no harm. So cancellation counts only from
/// this share of the points that compute the difference.
pub const LOST_AT: f64 = 0.02;

/// An event of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct DetectedEvent {
    /// What happened.
    pub(super) kind: Kind,
    /// The component at which it happened, if the operation works on each component by itself.
    pub(super) component: Option<usize>,
}

/// The events of an instruction that ran in strict arithmetic, each kind once.
pub(super) fn events(trace: &Trace, node: &Node) -> Vec<DetectedEvent> {
    let Some(result) = &node.strict else { return Vec::new() };
    match &node.what {
        // Taking a triple apart computes nothing.
        What::Lane(op) if op.cost() == Cost::Part => Vec::new(),
        What::Lane(op) => {
            let Some(args) = operands(trace, node) else { return Vec::new() };
            match op.shape().per_component {
                true => each(trace, node, *op, &args, result),
                false => whole(*op, &args, result),
            }
        }
        What::Kernel(kernel, _) if matches!(**kernel, Kernel::Noise { .. } | Kernel::NamedNoise { .. }) => {
            let Some(args) = operands(trace, node) else { return Vec::new() };
            born(&floats_of(&args), &floats(result)).map_or_else(Vec::new, of_all)
        }
        What::Note(kernel) if matches!(**kernel, Kernel::CheckIndex { .. }) => {
            match operands(trace, node).as_deref() {
                Some([Const::Int(index), Const::Int(length)]) if !(0..*length).contains(index) => {
                    of_all(Kind::Index)
                }
                _ => Vec::new(),
            }
        }
        _ => Vec::new(),
    }
}

/// The strict values of the operands; `None` if one of them is undefined on this path.
pub(super) fn operands<'a>(trace: &'a Trace, node: &Node) -> Option<Vec<&'a Const>> {
    node.args.iter().map(|id| trace.node(*id).strict.as_ref()).collect()
}

fn of_all(kind: Kind) -> Vec<DetectedEvent> {
    vec![DetectedEvent { kind, component: None }]
}

/// An operation on ints, on whole triples or on matrices.
fn whole(op: LaneOp, args: &[&Const], result: &Const) -> Vec<DetectedEvent> {
    let found = match (op, args, result) {
        (LaneOp::ToInt, [Const::Float(x)], _) => (!fits_int(*x)).then_some(Kind::IntConversion),
        (LaneOp::IDiv | LaneOp::IMod, [_, Const::Int(0)], _) => Some(Kind::ZeroDivision),
        (_, _, Const::Int(got)) => {
            let exact = int_result(op, args);
            exact.is_some_and(|exact| exact != i64::from(*got)).then_some(Kind::IntOverflow)
        }
        // Constants of the library may be infinite on purpose.
        (LaneOp::LibraryConstant, ..) => None,
        _ => {
            let is_outside = op.domain() != Domain::Everywhere && {
                let wide: Vec<Vec<f64>> = args.iter().map(|arg| widened(arg)).collect();
                op.domain().excludes(&wide)
            };
            if is_outside { Some(Kind::Domain) } else { born(&floats_of(args), &floats(result)) }
        }
    };
    found.map_or_else(Vec::new, of_all)
}

/// The result of an operation on ints without wrapping; `None` for operations that cannot wrap.
fn int_result(op: LaneOp, args: &[&Const]) -> Option<i64> {
    let int = |i: usize| match args.get(i) {
        Some(Const::Int(n)) => Some(i64::from(*n)),
        _ => None,
    };
    match op {
        LaneOp::IAdd => Some(int(0)? + int(1)?),
        LaneOp::ISub => Some(int(0)? - int(1)?),
        LaneOp::IMul => Some(int(0)? * int(1)?),
        LaneOp::IDiv => int(0)?.checked_div(int(1)?),
        LaneOp::INeg => Some(-int(0)?),
        LaneOp::IAbs => Some(int(0)?.abs()),
        _ => None,
    }
}

/// Whether a float without its fraction is an int. Both limits are exact as floats.
fn fits_int(x: f32) -> bool {
    (-2_147_483_648.0..2_147_483_648.0).contains(&x)
}

/// An operation that works on each component.
fn each(trace: &Trace, node: &Node, op: LaneOp, args: &[&Const], result: &Const) -> Vec<DetectedEvent> {
    let components = if matches!(result, Const::Triple(_)) { 3 } else { 1 };
    let mut found: Vec<DetectedEvent> = Vec::new();
    for component in 0..components {
        let Some(got) = part(result, component) else { continue };
        let mut given = [0.0; MAX_ARGS];
        let mut count = 0;
        for (place, x) in given.iter_mut().zip(args.iter().filter_map(|arg| part(arg, component))) {
            *place = x;
            count += 1;
        }
        let kind = of_component(op, &given[..count], got)
            .or_else(|| cancels(trace, node, component).then_some(Kind::Cancellation));
        if let Some(kind) = kind.filter(|kind| found.iter().all(|known| known.kind != *kind)) {
            found.push(DetectedEvent { kind, component: Some(component) });
        }
    }
    found
}

/// The event of one component, from its operands and its result.
fn of_component(op: LaneOp, given: &[f32], got: f32) -> Option<Kind> {
    if given.iter().any(|x| x.is_nan()) {
        return None;
    }
    let wide = || given.iter().map(|x| vec![f64::from(*x)]).collect::<Vec<_>>();
    if op.domain() != Domain::Everywhere && op.domain().excludes(&wide()) {
        return Some(if op.domain() == Domain::Divisors { Kind::ZeroDivision } else { Kind::Domain });
    }
    match (op, given) {
        // A pole, for which the language has the value 0.
        (LaneOp::Pow, [base, power]) if *base == 0.0 && *power < 0.0 => return Some(Kind::Domain),
        (LaneOp::Smoothstep | LaneOp::Linearstep, [low, high, _]) if low >= high => return Some(Kind::Edges),
        (LaneOp::Clamp, [_, low, high]) if low > high => return Some(Kind::Edges),
        // A quotient that overflows is 0 in the language.
        (LaneOp::FDiv, [a, b]) if a.is_finite() && !(a / b).is_finite() => return Some(Kind::Infinity),
        _ => {}
    }
    born(given, &[got])
}

/// Whether a result is the first NaN, infinity or denormal of its chain: no operand is one already.
fn born(given: &[f32], got: &[f32]) -> Option<Kind> {
    if given.iter().any(|x| x.is_nan()) {
        return None;
    }
    if got.iter().any(|x| x.is_nan()) {
        return Some(Kind::Nan);
    }
    if got.iter().any(|x| x.is_infinite()) && given.iter().all(|x| x.is_finite()) {
        return Some(Kind::Infinity);
    }
    let is_new = got.iter().any(|x| x.is_subnormal()) && !given.iter().any(|x| x.is_subnormal());
    is_new.then_some(Kind::Denormal)
}

/// Whether an operation can lose digits by cancellation.
pub(super) fn can_cancel(node: &Node) -> bool {
    matches!(node.what, What::Lane(LaneOp::FAdd | LaneOp::FSub))
}

/// Whether a sum or difference loses more digits than its operands have lost already.
fn cancels(trace: &Trace, node: &Node, component: usize) -> bool {
    if !can_cancel(node) {
        return false;
    }
    let right = |node: &Node| {
        let strict = part(node.strict.as_ref()?, component)?;
        let exact = node.exact.as_ref()?.numbers();
        let exact = *exact.get(component).or(exact.first())?;
        (strict.is_finite() && exact.is_finite())
            .then(|| digits(f64::from(strict), exact).map_or(ALL_DIGITS, |n| n.min(ALL_DIGITS)))
    };
    let given: Option<Vec<f64>> = node.args.iter().map(|id| right(trace.node(*id))).collect();
    let (Some(given), Some(got)) = (given, right(node)) else { return false };
    given.into_iter().fold(ALL_DIGITS, f64::min) - got > DIGITS_LOST
}

/// A component of a float or triple; a single number stands for all three.
pub(super) fn part(value: &Const, component: usize) -> Option<f32> {
    match value {
        Const::Float(x) => Some(*x),
        Const::Triple(t) => t.get(component).copied(),
        _ => None,
    }
}

fn floats(value: &Const) -> Vec<f32> {
    match value {
        Const::Float(x) => vec![*x],
        Const::Triple(t) => t.to_vec(),
        Const::Matrix(m) => m.to_vec(),
        _ => Vec::new(),
    }
}

fn floats_of(values: &[&Const]) -> Vec<f32> {
    values.iter().flat_map(|value| floats(value)).collect()
}

fn widened(value: &Const) -> Vec<f64> {
    match value {
        Const::Int(n) => vec![f64::from(*n)],
        other => floats(other).into_iter().map(f64::from).collect(),
    }
}
