//! Steps that need more than the arithmetic of a lane: dispatches each kernel.

use super::Machine;
use super::mask::Mask;
use super::memo::{Key, MemoEntry};
use crate::arithmetic::ArithmeticImpl;
use crate::message::Message;
use crate::step::{KernelStep, Operand};
use osl_ir::ir::{Const, Kernel, Kind};

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// Runs a kernel over the active lanes, or once if the result is uniform.
    pub(super) fn kernel(&mut self, step: &KernelStep, mask: &Mask) {
        let KernelStep { args, outs, .. } = step;
        match &step.kernel {
            Kernel::Noise { field, dims, has_derivs, .. } => {
                self.noise(*field, usize::from(*dims), *has_derivs, args, outs);
            }
            Kernel::NamedNoise { .. } => self.named_noise(step, mask),
            Kernel::SpaceMatrix { .. } if self.has_lasted(step.lasting) => {}
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
            Kernel::Hash => self.hash(step),
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

    /// A function without effect, computed once for lanes with the same arguments.
    fn pure(&mut self, step: &KernelStep, mask: &Mask, f: impl Fn(&[Const]) -> Const) {
        self.once_each(step, mask, |machine, lane| {
            let args = machine.values(&step.args, &step.kinds, lane);
            let text = |arg: &Const| if let Const::Str(text) = arg { text.len() } else { 0 };
            machine.pay_text(args.iter().map(text).sum());
            f(&args)
        });
    }

    /// The words of some operands at one lane, if they are few and none is a closure.
    pub(super) fn key(&self, args: &[Operand], lane: usize) -> Option<Key<A::Word>> {
        // The number of a closure differs from lane to lane.
        let is_kept = args.iter().all(|arg| arg.kind != Kind::Closure);
        let components = |arg: Operand| (0..arg.words as usize).map(move |c| self.part(arg, c));
        let words = args.iter().copied().flat_map(components).map(|part| self.word(part, lane));
        is_kept.then(|| Key::of(words))?
    }

    /// A step with one result of one word that depends only on its arguments: `f` computes it and pays for
    /// it, once for lanes with the same arguments. Each lane is charged as if it computed the result.
    pub(super) fn once_each(
        &mut self,
        step: &KernelStep,
        mask: &Mask,
        f: impl Fn(&mut Self, usize) -> Const,
    ) {
        let Some(out) = step.outs.first() else { return };
        let mut memo = std::mem::take(&mut self.memo);
        memo.begin();
        for run in self.runs(&step.args, &step.outs, mask) {
            let lane = run.first;
            let key = self.key(&step.args, lane);
            let word = match key.and_then(|key| memo.find(&key)) {
                Some(MemoEntry { word, cost }) => {
                    self.work.pay_steps(cost);
                    word
                }
                None => {
                    let result = f(self, lane);
                    self.set_value(*out, lane, &result);
                    let word = self.word(*out, lane);
                    if let Some(key) = key {
                        memo.keep(key, MemoEntry { word, cost: self.work.of_lane() });
                    }
                    word
                }
            };
            self.set_run(*out, run.lanes, word);
            if !self.work.close_all(run.active) {
                break;
            }
        }
        self.memo = memo;
    }
}
