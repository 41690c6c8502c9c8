//! Steps that need more than the arithmetic of a lane: dispatches each kernel.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::message::Message;
use crate::program::KernelStep;
use osl_ir::ir::{Const, Kernel};

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// Runs a kernel over the active lanes, or once if the result is uniform.
    pub(super) fn kernel(&mut self, step: &KernelStep, mask: &Mask) {
        let KernelStep { args, outs, .. } = step;
        match &step.kernel {
            Kernel::Noise { field, dims, has_derivs, .. } => {
                self.noise(*field, usize::from(*dims), *has_derivs, args, outs);
            }
            Kernel::NamedNoise { .. } => self.named_noise(step, mask),
            Kernel::SpaceMatrix { both } => self.space_matrix(*both, step, mask),
            Kernel::FindSpace => self.find_space(step, mask),
            Kernel::ColorBetween => self.color_between(step, mask),
            Kernel::Texture { options, footprint, quiet, has_derivs, .. } => {
                self.texture(options, (*footprint, *quiet, *has_derivs), step, mask);
            }
            Kernel::Environment { options, footprint, quiet, .. } => {
                self.environment(options, (*footprint, *quiet), step, mask);
            }
            Kernel::Volume { options, quiet, .. } => self.volume(options, *quiet, step, mask),
            Kernel::TextureInfo { kind, count } => self.texture_info(*kind, usize::from(*count), step, mask),
            Kernel::Text(function) => {
                let most = self.limits.running.string_bytes;
                self.pure(step, mask, |args| function.eval(args, most));
            }
            Kernel::DictFind => self.dict_find(step, mask),
            Kernel::DictNext => self.dict_next(step, mask),
            Kernel::DictValue { kind, count } => self.dict_value(*kind, usize::from(*count), step, mask),
            Kernel::IsConstant => self.pure(step, mask, |_| Const::Int(0)),
            Kernel::Format(shapes) => self.format(shapes, step, mask),
            Kernel::Print { sink, shapes } => self.print(*sink, shapes, step, mask),
            Kernel::SetMessage(form) => self.set_message(form, step, mask),
            Kernel::GetMessage(form) => self.get_message(form, step, mask),
            Kernel::Report { text, places } => {
                let message = Message::error_at(text.clone(), places.clone());
                self.report_all(mask, Message { at: Some(step.span), ..message });
            }
            Kernel::Split { pieces } => self.split(pieces.0, step, mask),
            Kernel::Regex { whole, places } => self.regex(*whole, places.map(|s| s.0), step, mask),
            Kernel::Hash => self.hash(step, mask),
            Kernel::Attribute { kind, count, .. } => self.attribute(*kind, *count, step, mask),
            Kernel::Trace => self.trace(step, mask),
            Kernel::SourceMessage { base, kind, count } => {
                self.source_message((*base, *kind), *count, step, mask);
            }
            Kernel::RayType => {
                let ray = if self.services.ray.is_empty() { "camera" } else { &self.services.ray };
                self.pure(step, mask, |args| Const::Int((args == [Const::Str(ray.into())]).into()));
            }
            Kernel::SplineInverse { knots, .. } => self.spline_inverse(knots.0, step, mask),
            Kernel::Component { name, shapes } => self.component_of(name, shapes, step, mask),
            Kernel::ClosureSum => self.closure_sum(step, mask),
            Kernel::ClosureScale => self.closure_scale(step, mask),
            Kernel::CheckIndex { name } => self.check_index(name, step, mask),
            Kernel::CheckFinite { name, op } => self.check_finite(name, op, step, mask),
            Kernel::CheckSet { what, reader } => self.check_set(what, reader, step, mask),
            Kernel::Note { .. } => {}
        }
    }

    /// A function without effect, recomputed only where its arguments change from lane to lane.
    fn pure(&mut self, step: &KernelStep, mask: &Mask, f: impl Fn(&[Const]) -> Const) {
        let Some(out) = step.outs.first() else { return };
        let mut last: Option<(Vec<Const>, Const)> = None;
        for lane in self.lanes(&step.outs, mask) {
            let args = self.values(&step.args, &step.kinds, lane);
            // Charged as if each lane computed it.
            let text = |arg: &Const| if let Const::Str(text) = arg { text.len() } else { 0 };
            self.pay_text(args.iter().map(text).sum());
            let result = match last.take() {
                Some((before, result)) if before == args => result,
                _ => f(&args),
            };
            self.set_value(*out, lane, &result);
            last = Some((args, result));
            if !self.work.close() {
                return;
            }
        }
    }
}
