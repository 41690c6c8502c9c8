//! The cost of steps against the limit of a point.
//!
//! Steps that work on vectors are charged by their operations: one for each. This is a fraction of a
//! nanosecond for a point if hundreds of points take the same path, and some tens of nanoseconds, the
//! interpreter's work, if a point runs alone. Steps that work lane by lane cost time at each point, so they
//! are charged by time: [`SERIAL`] steps for 16 nanoseconds.

use crate::step::{Array, Step};
use osl_ir::ir::{Cost, Kernel, LaneOp};

/// Steps for 16 nanoseconds of work on a single lane.
pub(crate) const SERIAL: u64 = 8;

/// The cost of a step, without nested steps and without the part that depends on values.
pub(crate) fn weight(step: &Step) -> u64 {
    match step {
        Step::Lane(step) => of_op(step.op) * u64::from(step.out.words.min(3)),
        Step::Load(_) | Step::Store(_) => 4,
        Step::Kernel(step) => of_kernel(&step.kernel) + step.outs.len() as u64,
        Step::If { results, .. } => 4 + results.len() as u64,
        Step::FindCells { roots, .. } => 4 * roots.len() as u64,
        // Charged during execution.
        Step::Loop { .. } | Step::PerCell { .. } => 0,
    }
}

/// The cost of arrays before anything runs: each of their words is cleared for each point.
pub(crate) fn of_arrays(arrays: &[Array]) -> u64 {
    arrays.iter().map(|a| u64::from(a.words) * u64::from(a.len) * SERIAL).fold(0, u64::saturating_add)
}

fn of_op(op: LaneOp) -> u64 {
    match op.cost() {
        Cost::Part | Cost::Cheap | Cost::Root | Cost::Medium => 1,
        Cost::Exponential | Cost::Trigonometric | Cost::Power => 4,
        Cost::Matrix => 20,
        Cost::System => 60,
        Cost::Spectrum => 300,
    }
}

/// The cost of a kernel that does not depend on its values.
fn of_kernel(kernel: &Kernel) -> u64 {
    let noise = |dims: u8, triple: bool, has_derivs: bool| {
        (2 << dims.min(4)) * if triple { 3 } else { 1 } * if has_derivs { 2 } else { 1 }
    };
    let serial = match kernel {
        // The fields work on vectors.
        Kernel::Noise { dims, triple, has_derivs, .. } => return noise(*dims, *triple, *has_derivs),
        Kernel::NamedNoise { dims, triple, has_derivs, .. } => 10 + noise(*dims, *triple, *has_derivs),
        Kernel::Texture { options, .. } | Kernel::Environment { options, .. } => {
            30 + 2 * options.len() as u64
        }
        Kernel::Volume { options, .. } => 10 + 2 * options.len() as u64,
        Kernel::TextureInfo { count, .. } => 20 + u64::from(*count),
        Kernel::SpaceMatrix { .. } | Kernel::FindSpace | Kernel::ColorBetween => 40,
        Kernel::Regex { .. } | Kernel::DictFind => 40,
        Kernel::Print { .. } | Kernel::Format(_) | Kernel::Split { .. } => 20,
        Kernel::Attribute { .. } | Kernel::SourceMessage { .. } | Kernel::Trace => 20,
        Kernel::SetMessage(_) | Kernel::GetMessage(_) => 20,
        Kernel::DictNext | Kernel::DictValue { .. } => 10,
        Kernel::Text(_) | Kernel::RayType | Kernel::IsConstant | Kernel::SplineInverse { .. } => 10,
        Kernel::Component { shapes, .. } => 10 + shapes.len() as u64,
        Kernel::ClosureSum | Kernel::ClosureScale => 4,
        Kernel::Report { .. } => 20,
        Kernel::CheckIndex { .. } | Kernel::CheckFinite { .. } | Kernel::CheckSet { .. } => 2,
        Kernel::Hash => 2,
        Kernel::Note { .. } => 0,
    };
    serial * SERIAL
}
