//! Range reduction: functions that are periodic, or that take the fraction of their operand.
//!
//! Any of them shows the digits behind the point of its operand, and so magnifies what an earlier instruction
//! rounded away. No other way to write the function avoids that; the instruction that forms the large operand
//! must.

use crate::trace::{Exact, NodeId, Trace, What};
use osl_ir::ir::{Kernel, LaneOp};

/// Instructions between a rounding to a whole number and the difference that takes the fraction.
const STEPS: usize = 4;

/// Whether a node repeats or reduces the range of its operand.
pub(super) fn reduces(trace: &Trace, id: NodeId) -> bool {
    let node = trace.node(id);
    match &node.what {
        What::Lane(LaneOp::Mod | LaneOp::ModBy | LaneOp::Fmod | LaneOp::FmodExact) => true,
        What::Lane(LaneOp::Sin | LaneOp::Cos | LaneOp::Tan) => {
            let size = |arg: &NodeId| {
                let exact = trace.node(*arg).exact.as_ref().map_or_else(Vec::new, Exact::numbers);
                exact.into_iter().fold(0.0, |most: f64, x| most.max(x.abs()))
            };
            node.args.iter().any(|arg| size(arg) > std::f64::consts::PI)
        }
        What::Lane(LaneOp::FSub | LaneOp::FAdd) => node.args.iter().any(|arg| is_whole(trace, *arg, STEPS)),
        What::Lane(op) => makes_whole(*op),
        What::Kernel(kernel, _) => matches!(
            **kernel,
            Kernel::Noise { .. }
                | Kernel::NamedNoise { .. }
                | Kernel::Texture { .. }
                | Kernel::Environment { .. }
                | Kernel::Volume { .. }
        ),
        _ => false,
    }
}

fn makes_whole(op: LaneOp) -> bool {
    matches!(op, LaneOp::Floor | LaneOp::Ceil | LaneOp::Trunc | LaneOp::Round | LaneOp::ToInt)
}

/// Whether a value is a whole number that was made from another one, or a multiple of one.
fn is_whole(trace: &Trace, id: NodeId, steps: usize) -> bool {
    let node = trace.node(id);
    let Some(steps) = steps.checked_sub(1) else { return false };
    match &node.what {
        What::Lane(op) if makes_whole(*op) => true,
        What::Lane(
            LaneOp::FMul
            | LaneOp::FNeg
            | LaneOp::ToFloat
            | LaneOp::Splat
            | LaneOp::Triple
            | LaneOp::X
            | LaneOp::Y
            | LaneOp::Z,
        )
        | What::Element => node.args.iter().any(|arg| is_whole(trace, *arg, steps)),
        _ => false,
    }
}
