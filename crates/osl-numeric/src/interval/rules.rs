//! Tighter forms of operations that use an argument more than once, or that guard a function by a comparison
//! of its argument: the hull of both cases would forget what the comparison says.

use super::functions::{pow_accurate, square_of};
use super::{Enclosure, Interval, Whole};
use crate::real::{Number, Real};
use crate::{Int, LaneOp};

/// The bound of an operation on floats; `None` if its body is good enough.
pub(super) fn float(op: LaneOp, args: &[Enclosure]) -> Option<Interval> {
    let at = |i: usize| match args.get(i) {
        Some(Enclosure::Float(x)) => Some(*x),
        _ => None,
    };
    // The body gives a known result for known arguments.
    if args.iter().all(|arg| arg.value().is_some()) {
        return None;
    }
    Some(match op {
        LaneOp::FDiv => quotient(at(0)?, at(1)?),
        LaneOp::Min | LaneOp::Lower => smaller(at(0)?, at(1)?),
        LaneOp::Max => larger(at(0)?, at(1)?),
        LaneOp::Clamp => larger(smaller(at(0)?, at(2)?), at(1)?),
        LaneOp::Mix => mix(at(0)?, at(1)?, at(2)?),
        LaneOp::Smoothstep => smoothstep(at(0)?, at(1)?, at(2)?),
        LaneOp::Linearstep => linearstep(at(0)?, at(1)?, at(2)?),
        LaneOp::Mod | LaneOp::ModBy => modulo(at(0)?, at(1)?)?,
        LaneOp::Sqrt => root(at(0)?),
        LaneOp::InverseSqrt => inverse_root(at(0)?),
        LaneOp::SrgbToLinear => curve(
            at(0)?,
            0.04045,
            |x| x * Interval::point(1.0 / 12.92),
            |x| {
                let base = (x + Interval::point(0.055)) * Interval::point(1.0 / 1.055);
                pow_accurate(base, Interval::point(2.4))
            },
        ),
        LaneOp::LinearToSrgb => curve(
            at(0)?,
            0.003_130_8,
            |x| x * Interval::point(12.92),
            |x| {
                let power = pow_accurate(x, Interval::point(1.0 / 2.4));
                Interval::point(1.055) * power - Interval::point(0.055)
            },
        ),
        _ => return None,
    })
}

/// The bound of an operation on whole triples, matrices or ints; `None` if its body is good enough.
pub(super) fn whole(op: LaneOp, args: &[Enclosure]) -> Option<Enclosure> {
    if args.iter().all(|arg| arg.value().is_some()) {
        return None;
    }
    Some(match (op, args) {
        (LaneOp::IDiv, [Enclosure::Int(a), Enclosure::Int(b)]) => Enclosure::Int(int_quotient(*a, *b)),
        (LaneOp::IMod, [Enclosure::Int(a), Enclosure::Int(b)]) => Enclosure::Int(int_rest(*a, *b)),
        (LaneOp::Distance | LaneOp::SquareDistance, [Enclosure::Triple(a), Enclosure::Triple(b)]) => {
            let square = square_of(std::array::from_fn(|i| a[i] - b[i]));
            Enclosure::Float(if op == LaneOp::Distance { square.sqrt() } else { square })
        }
        (LaneOp::Length, [Enclosure::Triple(v)]) => Enclosure::Float(Interval::length(square_of(*v), *v)),
        (LaneOp::Normalize, [Enclosure::Triple(v)]) => Enclosure::Triple(direction(*v)),
        (LaneOp::HsvToRgb, [Enclosure::Triple(hsv)]) => Enclosure::Triple(hues(*hsv)?),
        (LaneOp::MGet, [Enclosure::Matrix(m), Enclosure::Int(row), Enclosure::Int(column)]) => {
            let mut hull = Interval::NONE;
            for row in row.lo.clamp(0, 3)..=row.hi.clamp(0, 3) {
                for column in column.lo.clamp(0, 3)..=column.hi.clamp(0, 3) {
                    hull = hull.hull(m[(4 * row + column) as usize]);
                }
            }
            Enclosure::Float(hull)
        }
        _ => return None,
    })
}

/// Positive numbers, and negative ones, without zero.
fn signs(x: Interval) -> [Interval; 2] {
    let tiny = f32::from_bits(1);
    [
        x.numbers().meet(Interval::new(tiny, f32::INFINITY)),
        x.numbers().meet(Interval::new(f32::NEG_INFINITY, -tiny)),
    ]
}

/// A quotient that is 0 where it is not finite. A divisor of 0 gives 0, so only the other divisors count.
fn quotient(a: Interval, b: Interval) -> Interval {
    let parts = signs(b).map(|part| if part.is_empty() { part } else { a.numbers() / part });
    let plain = parts[0].hull(parts[1]);
    let mut result = plain.clip(f32::MIN, f32::MAX);
    let is_guarded = b.has_zero() || a.nan || b.nan || plain.nan || plain.has_infinity();
    if is_guarded {
        result = result.hull(Interval::point(0.0));
    }
    result
}

/// The result of `min` and its like where one of the numbers may be NaN: the first.
fn unordered(a: Interval, b: Interval) -> Interval {
    if a.nan || b.nan { a } else { Interval::NONE }
}

/// The smaller of two numbers; `min` and `lower` both compare by OSL's rule, true for NaN.
fn smaller(a: Interval, b: Interval) -> Interval {
    let ordered = if a.is_empty() || b.is_empty() {
        Interval::NONE
    } else {
        // Zeros of both signs are equal: which of them is the result depends on the order of the arguments.
        let zero = if a.has_zero() && b.has_zero() { Interval::ZERO } else { Interval::NONE };
        let (lo, hi) = (super::least(a.lo, b.lo), super::least(a.hi, b.hi));
        Interval { lo, hi, nan: false }.hull(zero)
    };
    ordered.hull(unordered(a, b))
}

/// The larger of two numbers; the first if one is NaN.
fn larger(a: Interval, b: Interval) -> Interval {
    let ordered = if a.is_empty() || b.is_empty() {
        Interval::NONE
    } else {
        let zero = if a.has_zero() && b.has_zero() { Interval::ZERO } else { Interval::NONE };
        Interval { lo: super::most(a.lo, b.lo), hi: super::most(a.hi, b.hi), nan: false }.hull(zero)
    };
    ordered.hull(unordered(a, b))
}

/// A few of the smallest floats: results near 0 are rounded to a multiple of them.
const TINY: f64 = 3e-44;
/// From here on, a product may overflow although the exact result does not.
const FAR: f64 = 1e38;

/// The exact function is linear in each argument, so that its extremes are at corners; three roundings
/// follow.
fn mix(a: Interval, b: Interval, t: Interval) -> Interval {
    let plain = crate::common::mix(a, b, t);
    if plain.nan || plain.is_empty() || a.has_infinity() || b.has_infinity() || t.has_infinity() {
        return plain;
    }
    let (mut lo, mut hi, mut size) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
    for a in [a.lo, a.hi].map(f64::from) {
        for b in [b.lo, b.hi].map(f64::from) {
            for t in [t.lo, t.hi].map(f64::from) {
                let value = a * (1.0 - t) + b * t;
                (lo, hi) = (lo.min(value), hi.max(value));
                size = size.max(a.abs() * (1.0 + t.abs()) + b.abs() * t.abs());
            }
        }
    }
    if size > FAR {
        return plain;
    }
    let error = size * 2.4e-7 + TINY;
    plain.meet(Interval::outward(lo - error, hi + error))
}

/// Where the result is neither 0 nor 1, x is between the edges.
fn smoothstep(edge0: Interval, edge1: Interval, x: Interval) -> Interval {
    let is_plain = |x: Interval| !x.nan && !x.has_infinity();
    let overflows = (edge1.hi - edge0.lo).is_infinite() || (edge0.hi - edge1.lo).is_infinite();
    if !(is_plain(edge0) && is_plain(edge1) && is_plain(x)) || overflows {
        return crate::common::smoothstep(edge0, edge1, x);
    }
    let mut result = ends(edge0, edge1, x);
    let (before, after) = (x.lt(edge0), x.ge(edge1));
    if before.no && after.no {
        let t = between(edge0, edge1, x);
        let cubic = |t: f32| {
            let t = f64::from(t);
            (3.0 - 2.0 * t) * (t * t)
        };
        // Four roundings; none of them exceeds 1, as a test shows for all floats.
        let inner = Interval::outward(cubic(t.lo) * (1.0 - 5e-7) - TINY, cubic(t.hi) * (1.0 + 5e-7) + TINY)
            .clip(0.0, 1.0);
        result = result.hull(inner);
    }
    result
}

/// 0 where x may be before the first edge, 1 where it may be after the second.
fn ends(edge0: Interval, edge1: Interval, x: Interval) -> Interval {
    let mut result = Interval::NONE;
    if x.lt(edge0).yes {
        result = result.hull(Interval::point(0.0));
    }
    if x.ge(edge1).yes {
        result = result.hull(Interval::point(1.0));
    }
    result
}

/// The share of the way from the first edge to the second, for x between them.
fn between(edge0: Interval, edge1: Interval, x: Interval) -> Interval {
    // With the edges in order everywhere, the share grows with x and falls with each edge, so that its
    // extremes are at corners; three roundings follow. Else any share is possible.
    if edge0.hi >= edge1.lo {
        return Interval::new(0.0, 1.0);
    }
    let at = |edge0: f32, edge1: f32, x: f32| {
        let [edge0, edge1, x] = [edge0, edge1, x].map(f64::from);
        (x - edge0) / (edge1 - edge0)
    };
    let lo = if x.lo < edge0.hi { 0.0 } else { at(edge0.hi, edge1.hi, x.lo) };
    let hi = if x.hi >= edge1.lo { 1.0 } else { at(edge0.lo, edge1.lo, x.hi) };
    Interval::outward(lo * (1.0 - 1e-6) - TINY, hi * (1.0 + 1e-6) + TINY).clip(0.0, 1.0)
}

fn linearstep(edge0: Interval, edge1: Interval, x: Interval) -> Interval {
    let is_plain = |x: Interval| !x.nan && !x.has_infinity();
    let plain = crate::common::linearstep(edge0, edge1, x);
    if !(is_plain(edge0) && is_plain(edge1) && is_plain(x)) || edge0.hi >= edge1.lo {
        return plain;
    }
    // The clamped x is between the edges, so that a quotient of rounded differences is between 0 and 1. The
    // difference of the edges may overflow, which gives 0.
    plain.meet(
        between(edge0, edge1, x).hull(ends(edge0, edge1, x)).hull(if (edge1.hi - edge0.lo).is_infinite() {
            Interval::point(0.0)
        } else {
            Interval::NONE
        }),
    )
}

/// The remainder is from 0 to the divisor, up to rounding; within one period it is a difference.
fn modulo(a: Interval, b: Interval) -> Option<Interval> {
    let is_plain = |x: Interval| !x.nan && !x.has_infinity() && !x.is_empty();
    let b_value = b.value().filter(|b| *b != 0.0 && b.is_finite())?;
    if !is_plain(a) {
        return None;
    }
    let quotient = a / b;
    if quotient.has_infinity() || f64::from(a.magnitude()) > FAR {
        return None;
    }
    let whole = quotient.floor();
    if whole.lo == whole.hi {
        return Some(a - b * whole);
    }
    let is_power_of_two = b_value.to_bits() & 0x007f_ffff == 0 && b_value.is_normal();
    let error = if is_power_of_two && whole.is_within(-1e9, 1e9) {
        // Quotient and product are exact, except for a quotient so small that it is rounded to 0.
        if b_value == 1.0 { 0.0 } else { 1.2e-38 }
    } else {
        4e-7 * (f64::from(a.magnitude()) + f64::from(b_value.abs())) + TINY
    };
    let (lo, hi) = if b_value > 0.0 { (0.0, f64::from(b_value)) } else { (f64::from(b_value), 0.0) };
    Some(Interval::outward(lo - error, hi + error).hull(if lo == 0.0 || hi == 0.0 {
        Interval::ZERO
    } else {
        Interval::NONE
    }))
}

/// 0 for negative numbers and NaN.
fn root(x: Interval) -> Interval {
    let root = x.numbers().meet(Interval::new(-0.0, f32::INFINITY)).increasing(f32::sqrt);
    let is_guarded = x.nan || (!x.is_empty() && x.lo < 0.0);
    if is_guarded { root.hull(Interval::point(0.0)) } else { root }
}

/// 0 for numbers that are not positive.
fn inverse_root(x: Interval) -> Interval {
    let [positive, _] = signs(x);
    let inverse = if positive.is_empty() { Interval::NONE } else { positive.inverse_root() };
    let is_guarded = x.nan || (!x.is_empty() && x.lo <= 0.0);
    if is_guarded { inverse.hull(Interval::point(0.0)) } else { inverse }
}

/// A curve that is straight up to an edge.
fn curve(
    x: Interval,
    edge: f32,
    straight: impl Fn(Interval) -> Interval,
    curved: impl Fn(Interval) -> Interval,
) -> Interval {
    let low = x.numbers().meet(Interval::new(f32::NEG_INFINITY, edge));
    let high = x.numbers().meet(Interval::new(edge.next_up(), f32::INFINITY));
    let mut result = Interval::NONE;
    if !low.is_empty() {
        result = result.hull(straight(low));
    }
    if !high.is_empty() {
        result = result.hull(curved(high));
    }
    if x.nan { Interval::ANY } else { result }
}

/// Vectors with smaller squares lose digits when they are normalised.
const SAFE_SQUARE: f32 = 1e-30;

/// The components of a vector of length 1, up to rounding.
fn direction(v: [Interval; 3]) -> [Interval; 3] {
    let square = square_of(v);
    let nan = v.iter().any(|x| x.nan || x.has_infinity()) || square.has_infinity();
    if nan {
        return [Interval::ANY; 3];
    }
    let size = if square.lo >= SAFE_SQUARE { 1.0 + 1e-6 } else { 1.5 };
    let squares = v.map(super::functions::square);
    std::array::from_fn(|i| {
        let others = |end: fn(Interval) -> f32| {
            (0..3).filter(|j| *j != i).map(|j| f64::from(end(squares[j]))).sum::<f64>()
        };
        let all = Interval::outward(-size, size);
        if square.lo < SAFE_SQUARE {
            // A square that is 0 gives 0.
            let (lo, hi) = (if v[i].lo < 0.0 { -size } else { 0.0 }, if v[i].hi > 0.0 { size } else { 0.0 });
            return Interval::outward(lo, hi).hull(Interval::ZERO);
        }
        // The component grows with its own coordinate, and its magnitude falls with the others.
        let share = |x: f32, others: f64| {
            let x = f64::from(x);
            x / (x * x + others).sqrt()
        };
        let (least, most) = (others(Interval::lo), others(Interval::hi));
        let lo = share(v[i].lo, if v[i].lo < 0.0 { least } else { most });
        let hi = share(v[i].hi, if v[i].hi < 0.0 { most } else { least });
        let margin = |x: f64| if x.is_nan() { size } else { x.abs() * 1e-6 + 1e-38 };
        Interval::outward(lo - margin(lo), hi + margin(hi)).meet(all)
    })
}

/// The colors for a saturation from 0 to 1: each component is between the value and the gray part of it.
fn hues([h, s, v]: [Interval; 3]) -> Option<[Interval; 3]> {
    let is_plain = |x: Interval| !x.nan && !x.has_infinity();
    if !(is_plain(h) && is_plain(v) && s.is_within(0.0, 1.0)) {
        return None;
    }
    let plain = crate::color::hsv_to_rgb([h, s, v]);
    let one = Interval::point(1.0);
    // Along a sixth of the circle, the share of the saturation goes from 0 to 1.
    let share = Interval::new(0.0, 1.0);
    let all = v.hull(v * (one - s * share));
    Some(plain.map(|component| component.meet(all)))
}

/// An int quotient, 0 for a divisor of 0.
fn int_quotient(a: Whole, b: Whole) -> Whole {
    let positive = b.meet(Whole { lo: 1, hi: i32::MAX });
    let negative = b.meet(Whole { lo: i32::MIN, hi: -1 });
    let mut result = if b.contains(0) { Whole::point(0) } else { Whole::NONE };
    for part in [positive, negative].into_iter().filter(|part| !part.is_empty()) {
        result = result.hull(a.quotient(part));
    }
    result
}

/// An int remainder: it has the sign of the number, and is smaller than the divisor and not larger than the
/// number.
fn int_rest(a: Whole, b: Whole) -> Whole {
    let size = Ord::max(i64::from(b.lo).abs(), i64::from(b.hi).abs()) - 1;
    let size = i32::try_from(Ord::max(size, 0)).unwrap_or(i32::MAX);
    // A number below the divisor is its own remainder.
    if b.lo > 0 && a.lo >= 0 && a.hi < b.lo {
        return a;
    }
    Whole { lo: Ord::max(Ord::min(a.lo, 0), -size), hi: Ord::min(Ord::max(a.hi, 0), size) }
}
