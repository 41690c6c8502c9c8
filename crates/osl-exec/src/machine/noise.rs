//! Noise fields over lanes.

use super::mask::Mask;
use super::{Machine, Target};
use crate::lanes::Arg;
use crate::message::Message;
use crate::program::{KernelStep, Operand, Place};
use crate::register::{Lanes, floats, floats_mut};
use osl_ir::ir::{GaborOption, Kernel, NoiseField};
use osl_noise::{Isa, Kind as Field, gabor};

impl Machine<'_> {
    /// A noise field of the coordinates, which are one to four floats in one or two operands, then periods, then
    /// tangents of the coordinates. Results: the value and, where three are wanted, its tangents.
    pub(super) fn noise(
        &mut self,
        field: NoiseField,
        dims: usize,
        tangents: bool,
        args: &[Operand],
        outs: &[Operand],
    ) {
        let field = field_of(field);
        self.fields(args, outs, |isa, inputs, lanes| {
            // Coordinates, periods where there are any, then the tangents.
            let (plain, slopes) = inputs.split_at(inputs.len() - if tangents { 2 * dims } else { 0 });
            let (coords, periods) = plain.split_at(dims.min(plain.len()));
            let mut duals: [&[f32]; 12] = [&[]; 12];
            let moving = coords.iter().chain(slopes);
            duals.iter_mut().zip(moving).for_each(|(to, from)| *to = from);
            let duals = &duals[..coords.len() + slopes.len()];
            match lanes {
                [x] if periods.is_empty() => osl_noise::eval(isa, field, coords, x),
                [x] => osl_noise::eval_periodic(isa, field, coords, periods, x),
                [v, dx, dy] if outs.len() == 3 => {
                    osl_noise::eval_dual(isa, field, duals, periods, [v, dx, dy]);
                }
                [x, y, z] if periods.is_empty() => osl_noise::eval3(isa, field, coords, [x, y, z]),
                [x, y, z] => osl_noise::eval3_periodic(isa, field, coords, periods, [x, y, z]),
                [a, b, c, d, e, f, g, h, i] => {
                    osl_noise::eval3_dual(isa, field, duals, periods, [a, b, c, d, e, f, g, h, i]);
                }
                _ => {}
            }
            // What comes of a hash alone is never NaN.
            if !matches!(field, Field::Cell | Field::Hash) {
                lanes.iter_mut().for_each(|lanes| isa.dispatch(OneNan(lanes)));
            }
        });
    }

    /// Gabor noise, whose options may differ between lanes.
    fn gabor(&mut self, dims: usize, given: &[(GaborOption, Operand)], args: &[Operand], outs: &[Operand]) {
        let shared = given.iter().all(|(_, value)| matches!(self.arg(*value), Arg::Same(_)));
        let count = if shared { 1 } else { self.width };
        let options: Vec<gabor::Options> = (0..count).map(|lane| self.gabor_options(given, lane)).collect();
        self.fields(args, outs, |isa, inputs, lanes| {
            let (plain, partials) = inputs.split_at(inputs.len() - (2 * dims).min(inputs.len()));
            let (coords, periods) = plain.split_at(dims.min(plain.len()));
            let points = gabor::Points { coords, partials, periods };
            match lanes {
                [x] => gabor::eval(isa, points, &options, x),
                [v, dx, dy] if outs.len() == 3 => gabor::eval_dual(isa, points, &options, [v, dx, dy]),
                [x, y, z] => gabor::eval3(isa, points, &options, [x, y, z]),
                [a, b, c, d, e, f, g, h, i] => {
                    gabor::eval3_dual(isa, points, &options, [a, b, c, d, e, f, g, h, i]);
                }
                _ => {}
            }
            lanes.iter_mut().for_each(|lanes| isa.dispatch(OneNan(lanes)));
        });
    }

    fn gabor_options(&self, given: &[(GaborOption, Operand)], lane: usize) -> gabor::Options {
        let mut options = gabor::Options::default();
        for (option, value) in given {
            let word = self.word(*value, lane);
            match option {
                GaborOption::Anisotropic => options.anisotropic = word as i32,
                GaborOption::Direction => {
                    options.direction =
                        [0, 1, 2].map(|c| f32::from_bits(self.word(self.part(*value, c), lane)));
                }
                GaborOption::Bandwidth => options.bandwidth = f32::from_bits(word),
                GaborOption::Impulses => options.impulses = f32::from_bits(word),
                GaborOption::DoFilter => options.do_filter = word != 0,
            }
        }
        options
    }

    /// Calls a field with the components of its arguments, spread over the lanes where they are shared, and those of
    /// its results.
    fn fields(
        &mut self,
        args: &[Operand],
        outs: &[Operand],
        field: impl FnOnce(Isa, &[&[f32]], &mut [&mut [f32]]),
    ) {
        let Some(first) = outs.first() else { return };
        let n = if matches!(first.place, Place::Words(_)) { 1 } else { self.width };
        let mut spread: Vec<Lanes> = std::mem::take(&mut self.scratch);
        let mut targets: [Target; MAX_OUTPUTS] = std::array::from_fn(|i| match outs.get(i) {
            Some(out) => self.take(*out),
            None => Target::None,
        });
        {
            let mut inputs: [&[f32]; MAX_INPUTS] = [&[]; MAX_INPUTS];
            let mut count = 0;
            let mut scratch = spread.iter_mut();
            for arg in args {
                for component in 0..arg.words as usize {
                    let lanes = match self.component(*arg, component) {
                        Arg::Each(words) => floats(words),
                        Arg::Same(word) if n == 1 => floats(word),
                        Arg::Same(word) => match scratch.next() {
                            Some(lanes) => {
                                let lanes = &mut floats_mut(lanes.words_mut())[..n];
                                lanes.fill(f32::from_bits(word[0]));
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
            let mut lanes: [&mut [f32]; 3 * MAX_OUTPUTS] = Default::default();
            let mut found = 0;
            for (target, out) in targets.iter_mut().zip(outs) {
                for chunk in target.chunks_mut(n).take(out.words as usize) {
                    if let Some(slot) = lanes.get_mut(found) {
                        *slot = floats_mut(chunk);
                        found += 1;
                    }
                }
            }
            field(self.isa, &inputs[..count], &mut lanes[..found]);
        }
        for (out, target) in outs.iter().zip(targets) {
            self.put(*out, target);
        }
        self.scratch = spread;
    }

    pub(super) fn named_noise(&mut self, step: &KernelStep, mask: &Mask) {
        let Some((name, _)) = step.args.split_first() else { return };
        if let Some(text) = self.shared_text(*name, mask) {
            self.noise_by_name(&text, step, mask);
            return;
        }
        // Names differ between lanes: each field in turn, kept where its name stands.
        let all = Mask::all(self.width);
        let mut results: Vec<Lanes> =
            step.outs.iter().map(|out| Lanes::new(out.words as usize * self.width)).collect();
        for (text, lanes) in self.groups(*name, mask) {
            let (here, _) = all.split(&lanes);
            self.noise_by_name(&text, step, &here);
            for (out, result) in step.outs.iter().zip(&mut results) {
                let Arg::Each(values) = self.arg(*out) else { continue };
                for (to, from) in result.words_mut().chunks_mut(self.width).zip(values.chunks(self.width)) {
                    here.copy(to, from);
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
        let Kernel::NamedNoise { dims, periodic, options, tangents, .. } = &step.kernel else { return };
        let dims = usize::from(*dims);
        let coordinates = step.kernel.coordinates().len() * if *periodic { 2 } else { 1 };
        let (plain, rest) = step.args[1..].split_at(coordinates.min(step.args.len() - 1));
        let (values, slopes) = rest.split_at(options.len().min(rest.len()));
        let args = [plain, slopes].concat();
        if let Some(field) = NoiseField::from_name(name, *periodic) {
            return self.noise(field, dims, *tangents, &args, &step.outs);
        }
        if name == "gabor" {
            let given: Vec<_> = options.iter().copied().zip(values.iter().copied()).collect();
            return self.gabor(dims, &given, &args, &step.outs);
        }
        let value = match name {
            "unull" => 0.5_f32,
            "null" => 0.0,
            _ => {
                let kind = if *periodic { "periodic noise" } else { "noise" };
                let text = format!("{kind} type \"{name}\" is unknown, called from ({{0}})");
                let message = Message::error_at(text, vec![step.span]);
                self.messages.add(self.first + mask.first().unwrap_or(0), message);
                0.0
            }
        };
        for (index, out) in step.outs.iter().enumerate() {
            let mut target = self.take(*out);
            let value = if index == 0 { value } else { 0.0 };
            target.chunks_mut(1).for_each(|word| word.fill(value.to_bits()));
            self.put(*out, target);
        }
    }
}

/// Makes every NaN the same: which one comes of coordinates that are none depends on the instruction set.
struct OneNan<'a>(&'a mut [f32]);

impl osl_noise::Kernel for OneNan<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for x in self.0 {
            *x = if x.is_nan() { f32::NAN } else { *x };
        }
    }
}

/// Results at most: a value and its tangents along two axes, each of up to three words.
const MAX_OUTPUTS: usize = 3;
/// Words of all arguments together: four coordinates, their periods, their tangents along two axes.
const MAX_INPUTS: usize = 16;

fn field_of(field: NoiseField) -> Field {
    match field {
        NoiseField::Cell => Field::Cell,
        NoiseField::Hash => Field::Hash,
        NoiseField::Perlin => Field::Perlin,
        NoiseField::UPerlin => Field::UPerlin,
        NoiseField::Simplex => Field::Simplex,
        NoiseField::USimplex => Field::USimplex,
    }
}
