//! Checks that the fast functions keep their error bounds in the loops of each instruction set.

use crate::arithmetic::{self, Double, Fast};
use osl_ir::ir::LaneOp;
use osl_numeric::fast::{BOUNDS, Bound};
use osl_simd::Isa;
use rayon::prelude::*;

/// Lanes per call.
const LANES: usize = 4096;

fn op(name: &str) -> LaneOp {
    LaneOp::ALL.iter().copied().find(|op| op.text() == name).expect("a lane operation")
}

/// The comparison of a function with its bound: the number of violations, the largest error as a share of the
/// bound, and its argument.
#[derive(Clone, Copy, Default)]
struct Comparison {
    beyond: usize,
    worst: f64,
    at: f32,
}

impl Comparison {
    fn worse(self, other: Comparison) -> Comparison {
        let worst = if other.worst > self.worst { other } else { self };
        Comparison { beyond: self.beyond + other.beyond, ..worst }
    }
}

/// The violations of a function for the words to which its bound applies, for each instruction set.
fn check(isas: &[Isa], bound: &Bound, words: &[u32]) -> Vec<Comparison> {
    let call = |x: &f32| (bound.from..=bound.to).contains(x);
    let kept: Vec<f32> = words.iter().map(|w| f32::from_bits(*w)).filter(call).collect();
    let (n, op) = (kept.len(), op(bound.name));
    if n == 0 {
        return vec![Comparison::default(); isas.len()];
    }
    let args: Vec<u64> = kept.iter().map(|x| f64::from(*x).to_bits()).collect();
    let mut exact = vec![0; n];
    arithmetic::one::<Double>(Isa::detect(), op, &args, &mut exact, n);
    let args: Vec<u32> = kept.iter().map(|x| x.to_bits()).collect();
    let mut got = vec![0; n];
    let compare = |isa: &Isa| {
        arithmetic::one::<Fast>(*isa, op, &args, &mut got, n);
        let one = |((x, got), exact): ((&f32, &u32), &u64)| {
            let (got, exact) = (f64::from(f32::from_bits(*got)), f64::from_bits(*exact));
            let share = match (got - exact).abs() / (bound.absolute + bound.relative * exact.abs()) {
                _ if got == exact => 0.0,
                share if share.is_nan() => f64::INFINITY,
                share => share,
            };
            Comparison { beyond: usize::from(share > 1.0), worst: share, at: *x }
        };
        kept.iter().zip(&got).zip(&exact).map(one).fold(Comparison::default(), Comparison::worse)
    };
    isas.iter().map(compare).collect()
}

/// Checks all functions at every `step`th float, and returns the violations.
fn all(step: usize) -> Vec<String> {
    let isas = Isa::all();
    let mut wrong = Vec::new();
    for bound in BOUNDS {
        let blocks = (1_usize << 32).div_ceil(step * LANES);
        let found = (0..blocks).into_par_iter().map(|block| {
            let start = block * LANES * step;
            let words = (0..LANES).map(|i| start + i * step).take_while(|w| *w < 1 << 32);
            check(&isas, bound, &words.map(|w| w as u32).collect::<Vec<u32>>())
        });
        let none = || vec![Comparison::default(); isas.len()];
        let worse =
            |a: Vec<Comparison>, b: Vec<Comparison>| a.into_iter().zip(b).map(|(a, b)| a.worse(b)).collect();
        for (isa, Comparison { beyond, worst, at }) in isas.iter().zip(found.reduce(none, worse)) {
            let line = format!("{} {isa:?}: {worst:.3} of the bound at {at:e}, {beyond} beyond", bound.name);
            if step == 1 {
                eprintln!("{line}");
            }
            if beyond > 0 {
                wrong.push(line);
            }
        }
    }
    wrong
}

#[test]
fn fast_functions_keep_their_bounds_at_some_floats() {
    let wrong = all(10_007);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// `cargo test --release -p osl-exec --lib bounds -- --ignored --nocapture`: several minutes for each
/// function.
#[test]
#[ignore = "takes an hour or more"]
fn fast_functions_keep_their_bounds_at_all_floats() {
    let wrong = all(1);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
