//! Whether the fast functions are as good as they are said to be, as loops of each instruction set compute them.

use crate::arithmetic::{Double, Fast};
use crate::lanes;
use osl_ir::ir::LaneOp;
use osl_ir::numeric::fast::{BOUNDS, Bound};
use osl_noise::Isa;
use rayon::prelude::*;

/// Lanes of a call.
const LANES: usize = 4096;

fn op(name: &str) -> LaneOp {
    LaneOp::ALL.iter().copied().find(|op| op.text() == name).expect("a lane operation")
}

/// What is wrong with a function at those of some words that its bound speaks of: how many are beyond it, and the worst,
/// as a share of what is allowed.
fn check(isa: Isa, bound: &Bound, words: &[u32]) -> (usize, f64, f32) {
    let call = |x: &f32| (bound.from..=bound.to).contains(x);
    let kept: Vec<f32> = words.iter().map(|w| f32::from_bits(*w)).filter(call).collect();
    let (n, op) = (kept.len(), op(bound.name));
    if n == 0 {
        return (0, 0.0, 0.0);
    }
    let args: Vec<u32> = kept.iter().map(|x| x.to_bits()).collect();
    let mut got = vec![0; n];
    lanes::one::<Fast>(isa, op, &args, &mut got, n);
    let args: Vec<u64> = kept.iter().map(|x| f64::from(*x).to_bits()).collect();
    let mut exact = vec![0; n];
    lanes::one::<Double>(isa, op, &args, &mut exact, n);
    let mut worst = (0, 0.0, 0.0);
    for ((x, got), exact) in kept.iter().zip(got).zip(exact) {
        let (got, exact) = (f64::from(f32::from_bits(got)), f64::from_bits(exact));
        let share = match (got - exact).abs() / (bound.absolute + bound.relative * exact.abs()) {
            _ if got == exact => 0.0,
            share if share.is_nan() => f64::INFINITY,
            share => share,
        };
        worst.0 += usize::from(share > 1.0);
        if share > worst.1 {
            (worst.1, worst.2) = (share, *x);
        }
    }
    worst
}

/// Checks all functions at every `step`th float, and yields what is beyond the bounds.
fn all(step: usize) -> Vec<String> {
    let mut wrong = Vec::new();
    for bound in BOUNDS {
        for isa in Isa::all() {
            let blocks = (1_usize << 32).div_ceil(step * LANES);
            let found = (0..blocks).into_par_iter().map(|block| {
                let start = block * LANES * step;
                let words = (0..LANES).map(|i| start + i * step).take_while(|w| *w < 1 << 32);
                check(isa, bound, &words.map(|w| w as u32).collect::<Vec<u32>>())
            });
            let worse = |a: (usize, f64, f32), b: (usize, f64, f32)| {
                let (share, x) = if b.1 > a.1 { (b.1, b.2) } else { (a.1, a.2) };
                (a.0 + b.0, share, x)
            };
            let (count, share, x) = found.reduce(|| (0, 0.0, 0.0), worse);
            let line = format!("{} {isa:?}: {share:.3} of the bound at {x:e}, {count} beyond", bound.name);
            if step == 1 {
                eprintln!("{line}");
            }
            if count > 0 {
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

/// `cargo test --release -p osl-exec --lib bounds -- --ignored --nocapture`: some minutes for each function.
#[test]
#[ignore = "takes an hour or more"]
fn fast_functions_keep_their_bounds_at_all_floats() {
    let wrong = all(1);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
