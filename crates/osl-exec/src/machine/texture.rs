//! Texture lookups, one lane at a time.
//!
//! For a texture's header see `texture_info`.

use super::Machine;
use super::mask::Mask;
use super::report::is_uniform;
use crate::arithmetic::ArithmeticImpl;
use crate::message::Message;
use crate::step::{KernelStep, Operand};
use osl_image::{
    Footprint, Interp, LoadFailure, LookupOptions, OwnedSubImage, Sample, Texture, TextureCache, Wrap,
    environment, lookup, lookup_values,
};
use osl_ir::ir::{Const, TextureOption};
use osl_lanes::Arg;
use std::sync::Arc;

/// The evaluated options of a lookup.
#[derive(Default)]
struct Options {
    lookup: LookupOptions,
    /// The image in the file, by number or name.
    part: OwnedSubImage,
    /// The channels in place of a missing file; without them, a missing file is an error.
    missing: Option<[Option<f32>; 4]>,
}

impl Options {
    /// Color and alpha for a missing file; the alpha is the channel after the requested ones.
    fn instead(&self, channels: usize) -> ([f32; 3], f32) {
        let [r, g, b, a] =
            self.missing.unwrap_or_default().map(|channel| channel.unwrap_or(self.lookup.fill));
        ([r, g, b], if channels == 1 { g } else { a })
    }
}

/// The texture of the previous lane.
struct LastTexture {
    number: u32,
    part: OwnedSubImage,
    /// Whether the name is tiled, with a texture for each unit square.
    tiled: bool,
    texture: Result<Arc<Texture>, Failure>,
}

/// Why a texture is missing.
#[derive(Clone)]
struct Failure {
    name: Arc<str>,
    why: Arc<LoadFailure>,
    /// Whether it is a square without a file in a tiled texture, which is not an error.
    hole: bool,
}

impl Failure {
    /// Whether it is the same failure of the same name.
    fn is(&self, other: &Failure) -> bool {
        Arc::ptr_eq(&self.why, &other.why) && self.name == other.name
    }
}

/// The lanes of a step that want the same missing texture, and their message.
#[derive(Default)]
struct Missing {
    message: Option<(Failure, Message)>,
    lanes: Vec<usize>,
}

/// Steps for a probe of a lookup, which blends some texels of two levels.
const PROBE: u64 = 6;
/// Maximum number of probes in a lookup.
const MAX_PROBES: u64 = 64;
/// Approximate number of probes in a lookup by direction.
const DIRECTIONS: u64 = 16;

/// The maximum number of probes for this footprint: twice the ratio of its axes, which is at most the sum of
/// their squares divided by the area between them.
fn probes([ds_dx, dt_dx, ds_dy, dt_dy]: [f32; 4]) -> u64 {
    let squares = ds_dx * ds_dx + dt_dx * dt_dx + ds_dy * ds_dy + dt_dy * dt_dy;
    let area = (ds_dx * dt_dy - dt_dx * ds_dy).abs();
    if squares == 0.0 {
        return 1;
    }
    // For NaN this is 0, and the maximum is used.
    match (2.0 * squares / area) as u64 {
        0 => MAX_PROBES,
        ratio => ratio.min(MAX_PROBES),
    }
}

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// Lookups in the plane: the lanes differ in coordinates and options, and mostly share the file.
    pub(super) fn texture(
        &mut self,
        options: &[TextureOption],
        (footprint, quiet, has_derivs): (bool, bool, bool),
        step: &KernelStep,
        mask: &Mask,
    ) {
        let [name, s, t, rest @ ..] = &step.args[..] else { return };
        let (values, derivs) = rest.split_at(options.len().min(rest.len()));
        let derivs = if footprint { derivs } else { &[] };
        let channels = step.outs.first().map_or(1, |o| o.words as usize);
        let mut opened: Option<LastTexture> = None;
        let mut missing = Missing::default();
        let is_shared = self.are_single(values);
        let mut given = Options::default();
        let lanes = self.lanes(&step.outs, mask);
        let (s, t) = (self.singles_at(*s, &lanes), self.singles_at(*t, &lanes));
        let mut changes = vec![[0.0; 4]; lanes.len()];
        for (at, deriv) in derivs.iter().enumerate().take(4) {
            let each = self.singles_at(*deriv, &lanes);
            changes.iter_mut().zip(each).for_each(|(to, from)| to[at] = from);
        }
        for (index, ((lane, deriv), at)) in
            lanes.into_iter().zip(changes).zip(s.into_iter().zip(t)).enumerate()
        {
            if index == 0 || !is_shared {
                given = self.lookup_options(options, values, channels, lane);
            }
            self.work.pay(PROBE * probes(deriv));
            let number = self.bits(*name, lane);
            if !self.pay_file(number) {
                break;
            }
            let (opened, s, t) = self.opened(&mut opened, (number, &given.part), at);
            let [ds_dx, dt_dx, ds_dy, dt_dy] = deriv;
            let footprint = Footprint { ds_dx, dt_dx, ds_dy, dt_dy };
            let sample = opened.map(|texture| {
                if has_derivs {
                    lookup(texture, s, t, &footprint, channels + 1, &given.lookup)
                } else {
                    let value = lookup_values(texture, s, t, &footprint, channels + 1, &given.lookup);
                    Sample { value, ..Sample::default() }
                }
            });
            self.deliver(step, (lane, mask), &sample, (quiet, "texture"), (&given, &mut missing));
            // A failed lookup is constant.
            let sample = sample.unwrap_or_default();
            if let (Some(color), [color_x, color_y, alpha_x, alpha_y]) =
                (step.outs.first(), step.outs.get(3..).unwrap_or(&[]))
            {
                let behind = color.words as usize;
                for (to, alpha, ds, dt) in
                    [(color_x, alpha_x, ds_dx, dt_dx), (color_y, alpha_y, ds_dy, dt_dy)]
                {
                    let change: [f32; 4] = std::array::from_fn(|c| sample.d_ds[c] * ds + sample.d_dt[c] * dt);
                    self.set_floats(*to, lane, &change);
                    self.set_floats(*alpha, lane, &change[behind..]);
                }
            }
            if !self.work.close() {
                break;
            }
        }
        self.report_missing(step, mask, missing);
    }

    /// Lookups by direction.
    pub(super) fn environment(
        &mut self,
        options: &[TextureOption],
        (footprint, quiet): (bool, bool),
        step: &KernelStep,
        mask: &Mask,
    ) {
        let [name, direction, rest @ ..] = &step.args[..] else { return };
        let (values, changes) = rest.split_at(options.len().min(rest.len()));
        let changes = if footprint { changes } else { &[] };
        let channels = step.outs.first().map_or(1, |o| o.words as usize);
        let mut opened: Option<LastTexture> = None;
        let mut missing = Missing::default();
        let is_shared = self.are_single(values);
        let mut given = Options::default();
        for (index, lane) in self.lanes(&step.outs, mask).into_iter().enumerate() {
            if index == 0 || !is_shared {
                given = self.lookup_options(options, values, channels, lane);
            }
            let towards = self.singles(*direction, lane);
            let change =
                |m: &Self, index: usize| changes.get(index).map_or([0.0; 3], |o| m.singles(*o, lane));
            let (d_dx, d_dy) = (change(self, 0), change(self, 1));
            let number = self.bits(*name, lane);
            self.work.pay(PROBE * DIRECTIONS);
            if !self.pay_file(number) {
                break;
            }
            let name = (number, &given.part);
            let (opened, ..) = self.opened(&mut opened, name, (0.0, 0.0));
            let sample = opened.map(|texture| {
                let value = environment(texture, towards, d_dx, d_dy, channels + 1, &given.lookup);
                Sample { value, ..Sample::default() }
            });
            self.deliver(step, (lane, mask), &sample, (quiet, "environment"), (&given, &mut missing));
            if !self.work.close() {
                break;
            }
        }
        self.report_missing(step, mask, missing);
    }

    /// Lookups in volumes, which always fail, since no volume format is supported.
    pub(super) fn volume(&mut self, options: &[TextureOption], quiet: bool, step: &KernelStep, mask: &Mask) {
        let [name, values @ ..] = &step.args[..] else { return };
        let channels = step.outs.first().map_or(1, |o| o.words as usize);
        let mut opened: Option<LastTexture> = None;
        let mut missing = Missing::default();
        let is_shared = self.are_single(values);
        let mut given = Options::default();
        for (index, lane) in self.lanes(&step.outs, mask).into_iter().enumerate() {
            if index == 0 || !is_shared {
                given = self.lookup_options(options, values, channels, lane);
            }
            let number = self.bits(*name, lane);
            if !self.pay_file(number) {
                break;
            }
            let (file, ..) = self.opened(&mut opened, (number, &given.part), (0.0, 0.0));
            let unread = || Failure {
                name: self.text(number),
                why: LoadFailure::new("texture3d: volume files are not supported"),
                hole: false,
            };
            let failure = file.err().cloned().unwrap_or_else(unread);
            self.deliver(step, (lane, mask), &Err(&failure), (quiet, "texture3d"), (&given, &mut missing));
            if !self.work.close() {
                break;
            }
        }
        self.report_missing(step, mask, missing);
    }

    /// Writes value, alpha and error message of a lookup.
    fn deliver(
        &mut self,
        step: &KernelStep,
        (lane, mask): (usize, &Mask),
        sample: &Result<Sample, &Failure>,
        (quiet, function): (bool, &str),
        (given, missing): (&Options, &mut Missing),
    ) {
        let [color, alpha, message, ..] = &step.outs[..] else { return };
        let behind = color.words as usize;
        let (value, beyond) = match sample {
            Ok(sample) => {
                let [r, g, b, a] = sample.value;
                ([r, g, b], if behind == 1 { g } else { a })
            }
            Err(_) => given.instead(behind),
        };
        self.set_floats(*color, lane, &value);
        self.set_floats(*alpha, lane, &[beyond]);
        let failure = sample.as_ref().err().filter(|_| given.missing.is_none());
        match failure {
            Some(failure) if quiet => {
                let text = self.reason(failure);
                self.set_value(*message, lane, &Const::Str(text));
            }
            Some(failure) if !failure.hole => {
                if !missing.message.as_ref().is_some_and(|(known, _)| known.is(failure)) {
                    let done = std::mem::take(missing);
                    self.report_missing(step, mask, done);
                    let message = self.missing_message(failure, function);
                    missing.message = Some((Failure::clone(failure), message));
                }
                missing.lanes.push(lane);
                self.pay_report(missing.message.as_ref().map_or(0, |(_, message)| message.text.len()));
            }
            // The number of the empty string.
            _ if quiet => self.set_bits(*message, lane, 0),
            _ => {}
        }
    }

    /// Why a texture is missing, for the shader.
    fn reason(&self, Failure { why, hole, .. }: &Failure) -> Arc<str> {
        match self.services.reference_texts {
            // The shader gets the reason once for each file.
            true if *hole || why.take_report().is_none() => "unknown".into(),
            true => why.reference_message().into(),
            false => why.message().into(),
        }
    }

    /// Why a texture is missing, as an error of the run.
    fn missing_message(&self, Failure { name, why, .. }: &Failure, function: &str) -> Message {
        let text: Arc<str> = match self.services.reference_texts {
            true => why.reference_message().into(),
            false => why.message().into(),
        };
        Message::error(format!("[RendererServices::{function}] {text}")).about_file(name.clone())
    }

    /// Reports a missing texture for all lanes that want it; of all active lanes if the result of the step is
    /// uniform. They have been charged.
    fn report_missing(&mut self, step: &KernelStep, mask: &Mask, missing: Missing) {
        let Missing { message: Some((_, message)), lanes } = missing else { return };
        let message = Message { at: Some(step.span), ..message };
        if is_uniform(step) {
            self.report_all(mask, message);
        } else {
            let first = self.first;
            self.messages.add(lanes.into_iter().map(|lane| first + lane), message);
        }
    }

    /// The texture with a name at (s, t), or the reason why it is missing, and the coordinates in it. The
    /// texture of the previous lane is reused.
    fn opened<'o>(
        &self,
        last: &'o mut Option<LastTexture>,
        (number, part): (u32, &OwnedSubImage),
        (s, t): (f32, f32),
    ) -> (Result<&'o Arc<Texture>, &'o Failure>, f32, f32) {
        // It stays where it is, because most lanes only ask whether it is still the same.
        last.take_if(|opened| opened.number != number || opened.part != *part || opened.tiled);
        let (mut s, mut t) = (s, t);
        let opened = last.get_or_insert_with(|| {
            let name = self.text(number);
            let textures = &self.services.textures;
            let tiled = TextureCache::is_tiled(&name);
            let loaded;
            (loaded, s, t) = textures.tile(&name, part.sub_image(), s, t);
            let texture = loaded.map_err(|why| {
                let hole = tiled && why.is_missing() && !textures.tiles(&name).is_empty();
                Failure { name, why, hole }
            });
            LastTexture { number, part: part.clone(), tiled, texture }
        });
        (opened.texture.as_ref(), s, t)
    }

    /// The floats of an operand at some lanes, in single precision.
    pub(super) fn singles_at(&self, operand: Operand, lanes: &[usize]) -> Vec<f32> {
        match self.arg(operand) {
            Arg::Same(words) => vec![A::single(words[0]); lanes.len()],
            Arg::Each(words) => lanes.iter().map(|lane| A::single(words[*lane])).collect(),
        }
    }

    /// Whether all lanes have the same values.
    fn are_single(&self, values: &[Operand]) -> bool {
        values.iter().all(|value| matches!(self.arg(*value), Arg::Same(_)))
    }

    /// The options of a lookup of a number of channels.
    fn lookup_options(
        &self,
        options: &[TextureOption],
        values: &[Operand],
        channels: usize,
        lane: usize,
    ) -> Options {
        let mut given = Options::default();
        let lookup = &mut given.lookup;
        for (option, value) in options.iter().zip(values) {
            let word = self.bits(*value, lane);
            let number = self.single(*value, lane);
            let wrap = || Wrap::from_name(&self.text(word)).unwrap_or(Wrap::File);
            match option {
                TextureOption::Wrap => (lookup.wrap_s, lookup.wrap_t) = (wrap(), wrap()),
                TextureOption::SWrap => lookup.wrap_s = wrap(),
                TextureOption::TWrap => lookup.wrap_t = wrap(),
                TextureOption::Interp => {
                    lookup.interp = Interp::from_name(&self.text(word)).unwrap_or_default()
                }
                TextureOption::FirstChannel => lookup.first_channel = (word as i32).max(0) as usize,
                TextureOption::Fill => lookup.fill = number,
                TextureOption::Width => lookup.width = (number, number),
                TextureOption::SWidth => lookup.width.0 = number,
                TextureOption::TWidth => lookup.width.1 = number,
                TextureOption::Blur => lookup.blur = (number, number),
                TextureOption::SBlur => lookup.blur.0 = number,
                TextureOption::TBlur => lookup.blur.1 = number,
                TextureOption::MissingColor => {
                    let [_, _, _, alpha] = given.missing.unwrap_or_default();
                    let [r, g, b] = self.singles(*value, lane).map(Some);
                    given.missing = Some([r, g, b, alpha.or(Some(0.0))]);
                }
                // It replaces the channel after the requested ones.
                TextureOption::MissingAlpha => {
                    let missing = given.missing.get_or_insert_default();
                    missing[if channels == 1 { 1 } else { 3 }] = Some(number);
                }
                TextureOption::SubImage => {
                    given.part = OwnedSubImage::Index(usize::try_from(word as i32).unwrap_or(0))
                }
                TextureOption::SubImageName => given.part = OwnedSubImage::Name(self.text(word)),
            }
        }
        given
    }
}
