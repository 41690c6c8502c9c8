//! A named system of RGB primaries: operations that depend on it get its number as another operand. With a
//! system, conversions of colors know only the spaces of the language itself.
//!
//! This pass does not run by default. It runs before the others if a system is requested.

use crate::ir::{Body, Const, Inst, Kernel, Kind, LaneOp, Op};
use smallvec::smallvec;

/// Converts colors to those of a system, given by its number in [`osl_numeric::color::SYSTEMS`].
pub fn set_primaries(body: &mut Body, system: i32) {
    for index in 0..body.blocks.len() {
        let Some(block) = body.blocks.get_mut(index) else { return };
        let insts = std::mem::take(&mut block.insts);
        let mut kept = Vec::with_capacity(insts.len());
        for mut inst in insts {
            let other = match &inst.op {
                // The usual operations have the primaries of the first system.
                Op::Lane(op, args) if system != 0 => in_system(*op).map(|op| Op::Lane(op, args.clone())),
                Op::Kernel(Kernel::ColorBetween, args) => {
                    Some(Op::Kernel(Kernel::ColorBetween, args.clone()))
                }
                _ => None,
            };
            if let Some(mut op) = other {
                let number = body.fresh(Kind::Int, inst.span);
                let constant = Op::Const(Const::Int(system));
                kept.push(Inst { op: constant, results: smallvec![number], span: inst.span });
                if let Op::Lane(_, args) | Op::Kernel(_, args) = &mut op {
                    args.push(number);
                }
                inst.op = op;
            }
            kept.push(inst);
        }
        if let Some(block) = body.blocks.get_mut(index) {
            block.insts = kept;
        }
    }
}

/// The operation that takes the number of a system.
fn in_system(op: LaneOp) -> Option<LaneOp> {
    Some(match op {
        LaneOp::XyzToRgb => LaneOp::XyzToRgbIn,
        LaneOp::RgbToXyz => LaneOp::RgbToXyzIn,
        LaneOp::Luminance => LaneOp::LuminanceIn,
        LaneOp::Blackbody => LaneOp::BlackbodyIn,
        LaneOp::Wavelength => LaneOp::WavelengthIn,
        _ => return None,
    })
}
