//! Checks of values in programs that were lowered with checks: infinite or NaN values, and uninitialised
//! variables.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::message::Message;
use crate::step::KernelStep;
use osl_ir::ir::{Const, UNSET_TEXT};

/// The floats of a value.
fn floats(value: &Const) -> &[f32] {
    match value {
        Const::Float(x) => std::slice::from_ref(x),
        Const::Triple(t) => t,
        Const::Matrix(m) => &m[..],
        _ => &[],
    }
}

/// A value with uninitialised parts replaced by zero.
fn mended(value: &Const) -> Const {
    let mend = |x: f32| if x.is_nan() { 0.0 } else { x };
    match value {
        Const::Int(i32::MIN) => Const::Int(0),
        Const::Str(text) if **text == *UNSET_TEXT => Const::Str("".into()),
        Const::Float(x) => Const::Float(mend(*x)),
        Const::Triple(t) => Const::Triple(t.map(mend)),
        Const::Matrix(m) => Const::Matrix(Box::new(m.map(mend))),
        value => value.clone(),
    }
}

impl<A: ArithmeticImpl> Machine<'_, A> {
    pub(super) fn check_finite(&mut self, name: &str, op: &str, step: &KernelStep, mask: &Mask) {
        let (Some(arg), Some(kind)) = (step.args.first(), step.kinds.first()) else { return };
        for lane in self.active(mask) {
            let value = self.value(*arg, *kind, lane);
            let Some(x) = floats(&value).iter().find(|x| !x.is_finite()) else { continue };
            let sign = if x.is_sign_negative() { "-" } else { "" };
            let shown = if x.is_nan() { "nan" } else { "inf" };
            let text = format!("Detected {sign}{shown} value in {name} at {{0}} (op {op})");
            self.report(step, lane, mask, Message::error_at(text, vec![step.span]));
            if !self.work.close() {
                return;
            }
        }
    }

    pub(super) fn check_set(&mut self, what: &str, reader: &str, step: &KernelStep, mask: &Mask) {
        let (Some(arg), Some(kind)) = (step.args.first(), step.kinds.first()) else { return };
        let Some(out) = step.outs.first() else { return };
        for lane in self.lanes(&step.outs, mask) {
            let value = self.value(*arg, *kind, lane);
            let mended = mended(&value);
            if !mended.same_bits(&value) {
                let names = self.program.names(step.span);
                let layer = names.map_or_else(String::new, |(index, names)| {
                    format!("group {}, layer {index} {}, shader {}, ", names.group, names.layer, names.shader)
                });
                let text = format!(
                    "Detected possible use of uninitialized value in {what} at {{0}} ({layer}{reader})"
                );
                self.report(step, lane, mask, Message::error_at(text, vec![step.span]));
            }
            self.set_value(*out, lane, &mended);
            if !self.work.close() {
                return;
            }
        }
    }
}
