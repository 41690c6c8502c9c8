//! Texture lookups and queries, one lane at a time.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::Arithmetic;
use crate::message::Message;
use crate::program::{KernelStep, Operand};
use osl_image::{
    Footprint, Interp, LookupOptions, Sample, SubImage, Texture, TextureCache, Wrap, lookup, lookup_values,
};
use osl_ir::ir::{Const, Kind, TextureOption};
use std::sync::Arc;

/// What the options of a lookup come to.
#[derive(Default)]
struct Options {
    lookup: LookupOptions,
    /// The image of the file, by number or name.
    part: Part,
    /// What the lookup yields instead where there is no file.
    missing_color: Option<[f32; 3]>,
    missing_alpha: f32,
}

#[derive(Clone, Debug, PartialEq)]
enum Part {
    Index(usize),
    Name(Arc<str>),
}

impl Default for Part {
    fn default() -> Self {
        Part::Index(0)
    }
}

impl Part {
    fn sub_image(&self) -> SubImage<'_> {
        match self {
            Part::Index(index) => SubImage::Index(*index),
            Part::Name(name) => SubImage::Name(name),
        }
    }
}

/// The texture of the last lane.
struct Opened {
    number: u32,
    part: Part,
    /// Whether the name stands for a texture in each unit square.
    tiled: bool,
    texture: Result<Arc<Texture>, Arc<str>>,
}

impl<A: Arithmetic> Machine<'_, A> {
    /// Lookups in the plane: the lanes differ in coordinates and options, and mostly share the file.
    pub(super) fn texture(
        &mut self,
        options: &[TextureOption],
        (footprint, quiet, tangents): (bool, bool, bool),
        step: &KernelStep,
        mask: &Mask,
    ) {
        let [name, s, t, rest @ ..] = &step.args[..] else { return };
        let (values, slopes) = rest.split_at(options.len().min(rest.len()));
        let slopes = if footprint { slopes } else { &[] };
        let mut opened: Option<Opened> = None;
        for lane in self.lanes(&step.outs, mask) {
            let given = self.lookup_options(options, values, lane);
            let float = |m: &Self, o: &Operand| m.single(*o, lane);
            let at = (float(self, s), float(self, t));
            let (opened, s, t) = self.opened(&mut opened, (self.bits(*name, lane), &given.part), at);
            let mut slope = [0.0; 4];
            slope.iter_mut().zip(slopes).for_each(|(to, from)| *to = float(self, from));
            let [ds_dx, dt_dx, ds_dy, dt_dy] = slope;
            let footprint = Footprint { ds_dx, dt_dx, ds_dy, dt_dy };
            let sample = opened.map(|texture| {
                let channels = step.outs.first().map_or(1, |o| o.words as usize) + 1;
                if tangents {
                    lookup(texture, s, t, &footprint, channels, &given.lookup)
                } else {
                    let value = lookup_values(texture, s, t, &footprint, channels, &given.lookup);
                    Sample { value, ..Sample::default() }
                }
            });
            self.deliver(step, (lane, mask), &sample, (quiet, "texture"), &given);
            // What could not be looked up does not change.
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
        }
    }

    /// Lookups by direction, without filtering: y is up, and the middle of the image looks along -z.
    pub(super) fn environment(
        &mut self,
        options: &[TextureOption],
        quiet: bool,
        step: &KernelStep,
        mask: &Mask,
    ) {
        let [name, direction, values @ ..] = &step.args[..] else { return };
        let mut opened: Option<Opened> = None;
        for lane in self.lanes(&step.outs, mask) {
            let mut given = self.lookup_options(options, values, lane);
            (given.lookup.wrap_s, given.lookup.wrap_t) = (Wrap::Periodic, Wrap::Clamp);
            let [x, y, z] = self.singles(*direction, lane).map(f64::from);
            let s = (-x).atan2(z) / std::f64::consts::TAU + 0.5;
            let t = 0.5 - y.atan2(x.hypot(z)) / std::f64::consts::PI;
            let name = (self.bits(*name, lane), &given.part);
            let (opened, ..) = self.opened(&mut opened, name, (0.0, 0.0));
            let sample = opened.map(|texture| {
                let channels = step.outs.first().map_or(1, |o| o.words as usize) + 1;
                let value = lookup_values(
                    texture,
                    s as f32,
                    t as f32,
                    &Footprint::default(),
                    channels,
                    &given.lookup,
                );
                Sample { value, ..Sample::default() }
            });
            self.deliver(step, (lane, mask), &sample, (quiet, "environment"), &given);
        }
    }

    /// Writes value, alpha and error message of a lookup.
    fn deliver(
        &mut self,
        step: &KernelStep,
        (lane, mask): (usize, &Mask),
        sample: &Result<Sample, &Arc<str>>,
        (quiet, function): (bool, &str),
        given: &Options,
    ) {
        let [color, alpha, message, ..] = &step.outs[..] else { return };
        let behind = color.words as usize;
        let (value, beyond, text): ([f32; 3], f32, Arc<str>) = match (sample, given.missing_color) {
            (Ok(sample), _) => {
                let [r, g, b, a] = sample.value;
                ([r, g, b], if behind == 1 { g } else { a }, "".into())
            }
            (Err(_), Some(color)) => (color, given.missing_alpha, "".into()),
            (Err(why), None) => {
                if !quiet {
                    let text = format!("[RendererServices::{function}] {why}");
                    let name = step.args.first().map(|name| self.text(self.bits(*name, lane)));
                    let message = Message { file: name, ..Message::error(text) };
                    self.report(step, lane, mask, message);
                }
                ([0.0; 3], 0.0, (*why).clone())
            }
        };
        self.set_floats(*color, lane, &value);
        self.set_floats(*alpha, lane, &[beyond]);
        if quiet {
            self.set_value(*message, lane, &Const::Str(text));
        }
    }

    /// The texture of a name at (s, t), or why there is none, and the coordinates in it. The one of the lane before is
    /// at hand.
    fn opened<'o>(
        &self,
        last: &'o mut Option<Opened>,
        (number, part): (u32, &Part),
        (s, t): (f32, f32),
    ) -> (Result<&'o Arc<Texture>, &'o Arc<str>>, f32, f32) {
        let same = |opened: &Opened| opened.number == number && opened.part == *part && !opened.tiled;
        let (opened, s, t) = match last.take().filter(same) {
            Some(opened) => (opened, s, t),
            None => {
                let name = self.text(number);
                let (loaded, s, t) = self.services.textures.tile(&name, part.sub_image(), s, t);
                let texture = loaded.map_err(|failure| failure.message().into());
                let tiled = TextureCache::is_tiled(&name);
                (Opened { number, part: part.clone(), tiled, texture }, s, t)
            }
        };
        (last.insert(opened).texture.as_ref(), s, t)
    }

    fn lookup_options(&self, options: &[TextureOption], values: &[Operand], lane: usize) -> Options {
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
                    given.missing_color = Some(self.singles(*value, lane));
                }
                TextureOption::MissingAlpha => given.missing_alpha = number,
                TextureOption::SubImage => {
                    given.part = Part::Index(usize::try_from(word as i32).unwrap_or(0))
                }
                TextureOption::SubImageName => given.part = Part::Name(self.text(word)),
            }
        }
        given
    }

    /// A datum of a texture's header.
    pub(super) fn texture_info(&mut self, kind: Kind, count: usize, step: &KernelStep, mask: &Mask) {
        let Some((found, outs)) = step.outs.split_last() else { return };
        for lane in self.lanes(&step.outs, mask) {
            let [Const::Str(file), Const::Str(datum)] = &self.values(&step.args, &step.kinds, lane)[..]
            else {
                return;
            };
            let values = if &**datum == "exists" {
                Some(vec![Const::Int(self.services.textures.exists(file).into())])
            } else {
                match self.services.textures.get(file) {
                    Ok(texture) => header(&texture, datum, kind, count),
                    Err(failure) => {
                        let (shader, why) = (self.program.shader(step.span), failure.message());
                        let text = format!("Shader error [{shader}]: Invalid image file \"{file}\": {why}");
                        let message = Message::error(text).about_file(file.clone());
                        self.report(step, lane, mask, message);
                        None
                    }
                }
            };
            let fits = |v: &Vec<Const>| v.len() == count.max(1) && v.iter().all(|v| v.kind() == kind);
            let values = values.filter(fits);
            self.set_bits(*found, lane, values.is_some().into());
            for (out, value) in outs.iter().zip(values.into_iter().flatten()) {
                self.set_value(*out, lane, &value);
            }
        }
    }
}

/// What a texture's header says, in the form that is asked for.
fn header(texture: &Texture, datum: &str, kind: Kind, count: usize) -> Option<Vec<Const>> {
    let int = |n: usize| Const::Int(i32::try_from(n).unwrap_or(i32::MAX));
    let (width, height) = (texture.width(), texture.height());
    let means = |n: usize| (0..n).map(|c| texture.average(c)).collect::<Vec<f32>>();
    Some(match datum {
        "resolution" if count == 3 => vec![int(width), int(height), Const::Int(1)],
        "resolution" => vec![int(width), int(height)],
        "channels" => vec![int(texture.channels().len())],
        "subimages" => vec![int(texture.n_parts())],
        "textureformat" | "texturetype" => vec![Const::Str("Plain Texture".into())],
        "datawindow" | "displaywindow" => {
            vec![Const::Int(0), Const::Int(0), int(width.saturating_sub(1)), int(height.saturating_sub(1))]
        }
        "averagecolor" if kind == Kind::Triple => match means(3)[..] {
            [r, g, b] => vec![Const::Triple([r, g, b])],
            _ => return None,
        },
        "averagecolor" => means(count.max(1)).into_iter().map(Const::Float).collect(),
        "averagealpha" => {
            let alpha = texture.channels().iter().position(|c| c == "A");
            vec![Const::Float(alpha.map_or(1.0, |c| texture.average(c)))]
        }
        _ => return None,
    })
}
