//! Random rounding: an arithmetic that rounds each inexact result of an operation up or down by chance.
//!
//! Runs that differ only in these choices agree in the digits that rounding leaves right. This is the CESTAC
//! method (Vignes and La Porte 1974; Vignes, "A stochastic arithmetic for reliable scientific computation",
//! 1993). A result that is exact stays as it is: the operation on the same operands in double precision
//! tells.

use super::{Exact, eval};
use osl_ir::ir::{Const, LaneOp};

/// The choices of one run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Random(u32);

/// Results of noise that differ by more than this from double precision are on another side of a jump, where
/// neither of the two is a rounding of the other.
const JUMP: f64 = 1e-3;

/// Zeros at the end of a double whose last operation was most likely exact.
const EXACT: u32 = 16;

impl Random {
    /// The choices of a run at a point.
    pub(super) fn new(run: u32, point: usize) -> Random {
        Random(mixed(run.wrapping_mul(0x9e37_79b1) ^ mixed(point as u32)))
    }

    /// The result of a lane operation. `at` is different for each instruction that runs.
    pub(super) fn lane(self, op: LaneOp, args: &[Const], result: Const, at: usize) -> Const {
        if !matches!(result, Const::Float(_) | Const::Triple(_) | Const::Matrix(_)) {
            return result;
        }
        let wide: Vec<Exact> = args.iter().map(Exact::widen).collect();
        let Some(exact) = eval(op, &wide) else { return result };
        let exact = exact.numbers();
        self.each(result, at, |component, x| {
            let exact = *exact.get(component)?;
            let rest = match op {
                LaneOp::FAdd | LaneOp::FSub => rest(op, &wide, component)?,
                _ => 0.0,
            };
            ends(x, exact, rest)
        })
    }

    /// A result of noise that has this value in double precision.
    pub(super) fn noise(self, result: Const, exact: &Exact, at: usize) -> Const {
        let exact = exact.numbers();
        self.each(result, at, |component, x| {
            let exact = *exact.get(component)?;
            let is_near = (f64::from(x) - exact).abs() <= JUMP * exact.abs().max(1.0);
            if is_near { ends(x, exact, 0.0) } else { None }
        })
    }

    /// A result in double precision, or a neighbour. One that ends in zeros is most likely exact, and one
    /// that is an operand, except for its sign, certainly. Equal results have equal neighbours, so that a
    /// comparison of a number with itself stays.
    pub(super) fn double(self, value: Exact, args: &[Exact]) -> Exact {
        if !matches!(value, Exact::Float(_) | Exact::Triple(_) | Exact::Matrix(_)) {
            return value;
        }
        let given: Vec<f64> = args.iter().flat_map(Exact::numbers).map(f64::abs).collect();
        let one = |x: f64| {
            let bits = x.to_bits();
            if !x.is_finite() || bits.trailing_zeros() >= EXACT || given.contains(&x.abs()) {
                return x;
            }
            let choice = mixed(self.0 ^ mixed(bits as u32 ^ mixed((bits >> 32) as u32)));
            [x, x, x.next_down(), x.next_up()][(choice >> 30) as usize]
        };
        let numbers: Vec<f64> = value.numbers().into_iter().map(one).collect();
        Exact::of_numbers(value.kind(), &numbers)
    }

    /// Chooses one of two ends for each component that has two.
    fn each(self, value: Const, at: usize, ends: impl Fn(usize, f32) -> Option<[f32; 2]>) -> Const {
        let one = |component: usize, x: f32| {
            let choice = mixed(self.0 ^ mixed((at as u32).wrapping_mul(17) ^ component as u32));
            ends(component, x).map_or(x, |ends| ends[(choice >> 31) as usize])
        };
        match value {
            Const::Float(x) => Const::Float(one(0, x)),
            Const::Triple(t) => Const::Triple([0, 1, 2].map(|i| one(i, t[i]))),
            Const::Matrix(m) => Const::Matrix(Box::new(std::array::from_fn(|i| one(i, m[i])))),
            other => other,
        }
    }
}

/// The two floats between which a result may be: the neighbours of the exact one, and the result itself, so
/// that the error of an approximated function counts too. `None` if the result is exact. `rest` is what the
/// exact result in double precision lacks.
fn ends(x: f32, exact: f64, rest: f64) -> Option<[f32; 2]> {
    let wide = f64::from(x);
    if !wide.is_finite() || !exact.is_finite() || (wide == exact && rest == 0.0) {
        return None;
    }
    let near = exact as f32;
    let difference = (exact - f64::from(near)) + rest;
    let (below, above) = match difference {
        d if d < 0.0 => (near.next_down(), near),
        d if d > 0.0 => (near, near.next_up()),
        _ => (near, near),
    };
    let ends = [below.min(x), above.max(x)];
    ends.iter().all(|end| end.is_finite()).then_some(ends)
}

/// What the sum or difference of two floats lacks in double precision (Knuth's two-sum).
fn rest(op: LaneOp, args: &[Exact], component: usize) -> Option<f64> {
    let [a, b] = args else { return None };
    let of = |value: &Exact| match value {
        Exact::Float(x) => Some(*x),
        Exact::Triple(t) => t.get(component).copied(),
        _ => None,
    };
    let (a, b) = (of(a)?, of(b)?);
    let b = if op == LaneOp::FSub { -b } else { b };
    let sum = a + b;
    let of_b = sum - a;
    Some((a - (sum - of_b)) + (b - of_b))
}

/// A hash of an int (Wellons, "lowbias32").
fn mixed(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results(op: LaneOp, a: f32, b: f32) -> Vec<f32> {
        let args = [Const::Float(a), Const::Float(b)];
        let Some(result) = op.eval(&args) else { return Vec::new() };
        let mut found: Vec<f32> = (0..64)
            .filter_map(|run| match Random::new(run, 5).lane(op, &args, result.clone(), 9) {
                Const::Float(x) => Some(x),
                _ => None,
            })
            .collect();
        found.sort_by(f32::total_cmp);
        found.dedup();
        found
    }

    #[test]
    fn exact_results_stay_and_others_have_both_neighbours() {
        assert_eq!(results(LaneOp::FAdd, 0.5, 0.25), [0.75]);
        assert_eq!(results(LaneOp::FMul, 3.0, 0.125), [0.375]);
        assert_eq!(results(LaneOp::Min, 0.1, 0.3), [0.1]);
        let third = 1.0_f32 / 3.0;
        // The nearest float is above a third.
        assert_eq!(results(LaneOp::FDiv, 1.0, 3.0), [third.next_down(), third]);
        assert_eq!(results(LaneOp::FAdd, 4096.0, third).len(), 2);
        // What double precision does not hold either counts too.
        assert_eq!(results(LaneOp::FAdd, 1e20, 1.0), [1e20, 1e20_f32.next_up()]);
        assert_eq!(results(LaneOp::FSub, 1e20, 1.0), [1e20_f32.next_down(), 1e20]);
        assert_eq!(results(LaneOp::FDiv, 1.0, 0.0), [0.0]);
        assert_eq!(results(LaneOp::FMul, 3e38, 10.0), [f32::INFINITY]);
    }
}
