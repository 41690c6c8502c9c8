//! Noise fields over lanes.

use super::mask::Mask;
use super::{Machine, Target};
use crate::arithmetic::ArithmeticImpl;
use crate::fields::{Field, FieldCall, MAX_INPUTS, MAX_OUTPUTS};
use crate::message::Message;
use crate::register::Lanes;
use crate::step::{KernelStep, Location, Operand};
use osl_ir::ir::{GaborOption, Kernel, NoiseField};
use osl_lanes::Arg;
use osl_noise::{Kind as NoiseKind, gabor};

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// A noise field. Its arguments are the coordinates, one to four floats in one or two operands, then
    /// periods, then the derivatives of the coordinates. Results: the value and, if three are requested, its
    /// derivatives.
    pub(super) fn noise(
        &mut self,
        field: NoiseField,
        dims: usize,
        has_derivs: bool,
        args: &[Operand],
        outs: &[Operand],
    ) {
        let field = Field::Lattice(noise_kind(field));
        self.fields(&FieldCall { field, dims, has_derivs, dual: outs.len() == 3 }, args, outs);
    }

    /// Gabor noise, whose options may differ between lanes.
    fn gabor(
        &mut self,
        (dims, triple): (usize, bool),
        given: &[(GaborOption, Operand)],
        args: &[Operand],
        outs: &[Operand],
        mask: &Mask,
    ) {
        let once = matches!(outs.first(), Some(Operand { location: Location::Words(_), .. }));
        let lanes = if once { vec![0] } else { self.active(mask) };
        let uniform = given.iter().all(|(_, value)| matches!(self.arg(*value), Arg::Same(_)));
        let of = if uniform { &lanes[..lanes.len().min(1)] } else { &lanes };
        let options: Vec<gabor::Options> = of.iter().map(|lane| self.gabor_options(given, *lane)).collect();
        for at in 0..lanes.len() {
            let impulses = options.get(if uniform { 0 } else { at }).map_or(0.0, |options| options.impulses);
            let fields = if triple { 3 } else { 1 };
            self.work.pay(fields * (GABOR + IMPULSE * impulses.clamp(0.0, MAX_IMPULSES) as u64));
            if !self.work.close() {
                return;
            }
        }
        let field = Field::Gabor(&lanes, &options);
        self.fields(&FieldCall { field, dims, has_derivs: true, dual: outs.len() == 3 }, args, outs);
    }

    fn gabor_options(&self, given: &[(GaborOption, Operand)], lane: usize) -> gabor::Options {
        let mut options = gabor::Options::default();
        for (option, value) in given {
            match option {
                GaborOption::Anisotropic => options.anisotropic = self.bits(*value, lane) as i32,
                GaborOption::Direction => options.direction = self.singles(*value, lane),
                GaborOption::Bandwidth => options.bandwidth = self.single(*value, lane),
                GaborOption::Impulses => options.impulses = self.single(*value, lane),
                GaborOption::DoFilter => options.do_filter = self.bits(*value, lane) != 0,
            }
        }
        options
    }

    /// Calls a field with the components of its arguments, broadcast to the lanes where they are uniform, and
    /// those of its results.
    fn fields(&mut self, call: &FieldCall<'_>, args: &[Operand], outs: &[Operand]) {
        let Some(first) = outs.first() else { return };
        // The lanes that are computed, of those that a component has.
        let is_uniform = matches!(first.location, Location::Words(_));
        let (n, all) = if is_uniform { (1, 1) } else { (self.lanes, self.width) };
        let mut broadcasts = std::mem::take(&mut self.scratch);
        let mut targets: [Target<A::Word>; MAX_RESULTS] = std::array::from_fn(|i| match outs.get(i) {
            Some(out) => self.take(*out),
            None => Target::None,
        });
        {
            let mut inputs: [&[A::Word]; MAX_INPUTS] = [&[]; MAX_INPUTS];
            let mut count = 0;
            let mut scratch = broadcasts.iter_mut();
            for arg in args {
                for component in 0..arg.words as usize {
                    let lanes = match self.component(*arg, component) {
                        Arg::Each(words) => words.get(..n).unwrap_or(words),
                        Arg::Same(word) if n == 1 => word,
                        Arg::Same(word) => match scratch.next() {
                            Some(lanes) => {
                                let lanes = &mut lanes.words_mut()[..n];
                                lanes.fill(word[0]);
                                &*lanes
                            }
                            None => &[],
                        },
                    };
                    if let Some(input) = inputs.get_mut(count) {
                        *input = lanes;
                        count += 1;
                    }
                }
            }
            let mut lanes: [&mut [A::Word]; MAX_OUTPUTS] = Default::default();
            let mut found = 0;
            for (target, out) in targets.iter_mut().zip(outs) {
                for component in target.chunks_mut(all).take(out.words as usize) {
                    if let (Some(slot), Some(used)) = (lanes.get_mut(found), component.get_mut(..n)) {
                        *slot = used;
                        found += 1;
                    }
                }
            }
            A::field(self.isa, call, &inputs[..count], &mut lanes[..found]);
        }
        for (out, target) in outs.iter().zip(targets) {
            self.put(*out, target);
        }
        self.scratch = broadcasts;
    }

    pub(super) fn named_noise(&mut self, step: &KernelStep, mask: &Mask) {
        let Some((name, _)) = step.args.split_first() else { return };
        if let Some(text) = self.uniform_text(*name, mask) {
            self.noise_by_name(&text, step, mask);
            return;
        }
        // Names differ between lanes: each field is computed in turn, and kept at the lanes with its name.
        let mut results: Vec<Lanes<A::Word>> =
            step.outs.iter().map(|out| Lanes::new(out.words as usize * self.width)).collect();
        for (text, lanes) in self.groups(*name, mask) {
            let (here, _) = mask.split(self.isa, &lanes);
            // Meanwhile the other lanes wait, which they would not do alone.
            self.work.delay(NAME);
            self.noise_by_name(&text, step, &here);
            if !self.work.goes_on() {
                return;
            }
            for (out, result) in step.outs.iter().zip(&mut results) {
                let Arg::Each(values) = self.arg(*out) else { continue };
                for (to, from) in result.words_mut().chunks_mut(self.width).zip(values.chunks(self.width)) {
                    here.copy(self.isa, to, from);
                }
            }
        }
        for (out, result) in step.outs.iter().zip(results) {
            let mut target = self.take(*out);
            for (to, from) in target.chunks_mut(self.width).zip(result.words().chunks(self.width)) {
                to.copy_from_slice(from);
            }
            self.put(*out, target);
        }
    }

    fn noise_by_name(&mut self, name: &str, step: &KernelStep, mask: &Mask) {
        let Kernel::NamedNoise { dims, triple, periodic, options, has_derivs } = &step.kernel else { return };
        let dims = usize::from(*dims);
        let coordinates = step.kernel.coordinates().len() * if *periodic { 2 } else { 1 };
        let (plain, rest) = step.args[1..].split_at(coordinates.min(step.args.len() - 1));
        let (values, derivs) = rest.split_at(options.len().min(rest.len()));
        let args = [plain, derivs].concat();
        if let Some(field) = NoiseField::from_name(name, *periodic) {
            return self.noise(field, dims, *has_derivs, &args, &step.outs);
        }
        if name == "gabor" {
            let given: Vec<_> = options.iter().copied().zip(values.iter().copied()).collect();
            return self.gabor((dims, *triple), &given, &args, &step.outs, mask);
        }
        let value = match name {
            "unull" => 0.5_f32,
            "null" => 0.0,
            _ => {
                let kind = if *periodic { "periodic noise" } else { "noise" };
                let text = format!("{kind} type \"{name}\" is unknown, called from ({{0}})");
                let message = Message::error_at(text, vec![step.span]);
                self.report_all(mask, Message { at: Some(step.span), ..message });
                0.0
            }
        };
        for (index, out) in step.outs.iter().enumerate() {
            let mut target = self.take(*out);
            let value = if index == 0 { value } else { 0.0 };
            target.chunks_mut(1).for_each(|word| word.fill(A::of(value)));
            self.put(*out, target);
        }
    }
}

/// Steps of a field for which some lanes wait while others are computed.
const NAME: u64 = 200;
/// Steps of a Gabor noise field: finding the impulses near a point.
const GABOR: u64 = 100;
/// Steps for an impulse that overlaps a point on average; this is the maximum number of impulses.
const IMPULSE: u64 = 12;
const MAX_IMPULSES: f32 = 32.0;

/// Maximum number of results: a value and its derivatives along two axes.
const MAX_RESULTS: usize = 3;

/// The noise that computes a field of the IR.
pub fn noise_kind(field: NoiseField) -> NoiseKind {
    match field {
        NoiseField::Cell => NoiseKind::Cell,
        NoiseField::Hash => NoiseKind::Hash,
        NoiseField::Perlin => NoiseKind::Perlin,
        NoiseField::UPerlin => NoiseKind::UPerlin,
        NoiseField::Simplex => NoiseKind::Simplex,
        NoiseField::USimplex => NoiseKind::USimplex,
    }
}
