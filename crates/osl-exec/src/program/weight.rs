//! What steps count against the budget of a batch.

use super::Step;
use osl_ir::ir::LaneOp;

/// What a step counts: about one for 50 ns over a batch of 256 lanes.
pub(crate) fn weight(step: &Step) -> u64 {
    match step {
        Step::Lane(step) => of_op(step.op) * u64::from(step.out.words.min(3)),
        Step::Load { .. } | Step::Store { .. } => 6,
        Step::Kernel(_) | Step::If { .. } => 2,
        Step::FindCells { roots, .. } => 4 * roots.len() as u64,
        // Counted as they run.
        Step::Loop { .. } | Step::Shared { .. } => 0,
    }
}

fn of_op(op: LaneOp) -> u64 {
    use LaneOp as L;
    match op {
        L::Blackbody | L::Wavelength | L::BlackbodyIn | L::WavelengthIn => 500,
        L::LuminanceIn | L::XyzToRgbIn | L::RgbToXyzIn => 100,
        L::MInverse | L::MMul | L::MDet => 30,
        L::Sin | L::Cos | L::Tan | L::Asin | L::Acos | L::Atan | L::Atan2 => 10,
        L::Sinh | L::Cosh | L::Tanh | L::Cbrt | L::Erf | L::Erfc | L::Fmod | L::FmodExact => 10,
        L::Pow | L::Exp | L::Exp2 | L::Expm1 | L::Log | L::Log2 | L::Log10 => 10,
        _ => 1,
    }
}
