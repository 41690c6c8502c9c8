//! Queries of a texture's header, one lane at a time.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::message::Message;
use crate::step::{KernelStep, Location, Operand};
use osl_image::{Attribute, LoadFailure, SubImage, Texture, TextureCache};
use osl_ir::ir::{Const, Kind};
use std::sync::Arc;

/// The value of a datum, or the file that cannot be read.
type Answer = Result<Option<Vec<Const>>, Arc<LoadFailure>>;

/// Steps for looking for a file.
const FILE: u64 = 500;
/// Maximum number of files of a name.
const SQUARES: u64 = 100;

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// A datum of a texture's header.
    pub(super) fn texture_info(&mut self, kind: Kind, count: usize, step: &KernelStep, mask: &Mask) {
        let Some((found, outs)) = step.outs.split_last() else { return };
        let [file, datum, at @ ..] = &step.args[..] else { return };
        for lane in self.lanes(&step.outs, mask) {
            let (name, word) = (self.text(self.bits(*file, lane)), self.text(self.bits(*datum, lane)));
            if !self.pay_file(self.bits(*file, lane)) {
                return;
            }
            let at = match at {
                [s, t] => Some((self.single(*s, lane), self.single(*t, lane))),
                _ => None,
            };
            let values = match self.datum(&name, &word, (kind, count), at) {
                Ok(values) => values,
                Err(failure) => {
                    self.unreadable(&name, &failure, *file, (step, lane, mask));
                    None
                }
            };
            self.set_bits(*found, lane, values.is_some().into());
            for (out, value) in outs.iter().zip(values.into_iter().flatten()) {
                self.set_value(*out, lane, &value);
            }
            if !self.work.close() {
                return;
            }
        }
    }

    /// Charges for looking for a file, or for the files of all squares: names in the program are known after
    /// the first time, but a point can make any number of others. Returns whether the point can afford it.
    pub(super) fn pay_file(&mut self, number: u32) -> bool {
        if number as usize >= self.program.strings.len() {
            self.work.pay(if TextureCache::is_tiled(&self.text(number)) { SQUARES * FILE } else { FILE });
        }
        self.work.affords(0)
    }

    /// A datum of a texture. If the name is tiled, it is that of the texture at (s, t), or else the one on
    /// which all files agree.
    fn datum(&self, name: &str, datum: &str, (kind, count): (Kind, usize), at: Option<(f32, f32)>) -> Answer {
        let textures = &self.services.textures;
        let read = |texture: &Texture| header(texture, datum, kind, count);
        if datum == "exists" {
            return Ok(in_form(vec![Const::Int(textures.exists(name).into())], kind, count));
        }
        let tiles = if TextureCache::is_tiled(name) { textures.tiles(name) } else { Arc::default() };
        if tiles.is_empty() {
            return textures.get(name).map(|texture| read(&texture));
        }
        if let Some((s, t)) = at {
            match textures.tile(name, SubImage::default(), s, t).0 {
                Ok(texture) => return Ok(read(&texture)),
                Err(failure) if failure.is_missing() => {}
                Err(failure) => return Err(failure),
            }
        }
        let mut common: Option<Vec<Const>> = None;
        for tile in tiles.iter() {
            let value = read(&*textures.get(tile)?);
            if value.is_none() || common.is_some() && common != value {
                return Ok(None);
            }
            common = value;
        }
        Ok(common)
    }

    /// Reports a file that cannot be read. For constant names, the reference examines files at compile time,
    /// with a different message; tools that stand in for it do the same.
    fn unreadable(
        &mut self,
        name: &Arc<str>,
        why: &LoadFailure,
        file: Operand,
        (step, lane, mask): (&KernelStep, usize, &Mask),
    ) {
        let why =
            if self.services.reference_texts { why.reference_message() } else { why.message().to_owned() };
        let is_constant = matches!(file.location, Location::Words(at) if self.program.is_constant(at));
        let who = if self.services.reference_texts && is_constant {
            format!("Shader error [{}]: ", self.program.shader(step.span))
        } else {
            "[RendererServices::get_texture_info] ".to_owned()
        };
        let text = format!("{who}Invalid image file \"{name}\": {why}");
        self.report(step, lane, mask, Message::error(text).about_file(name.clone()));
    }
}

/// A datum of a texture's header, in the requested form.
fn header(texture: &Texture, datum: &str, kind: Kind, count: usize) -> Option<Vec<Const>> {
    let int = |n: usize| Const::Int(i32::try_from(n).unwrap_or(i32::MAX));
    let text = |text: &str| vec![Const::Str(text.into())];
    let corners = |[x0, y0, x1, y1]: [i32; 4]| {
        let six = count == 6;
        let list: &[i32] = if six { &[x0, y0, 0, x1, y1, 0] } else { &[x0, y0, x1, y1] };
        list.iter().copied().map(Const::Int).collect()
    };
    let values = match datum {
        "resolution" if count == 3 => vec![int(texture.width()), int(texture.height()), Const::Int(1)],
        "resolution" => vec![int(texture.width()), int(texture.height())],
        "channels" => vec![int(texture.channels().len())],
        "subimages" => vec![int(texture.n_parts())],
        "miplevels" => vec![int(texture.n_levels())],
        "texturetype" if texture.is_environment() => text("Environment"),
        "texturetype" => text("Plain Texture"),
        "textureformat" => text(texture.attributes().text("textureformat").unwrap_or("Plain Texture")),
        "datawindow" => corners(texture.data_window()),
        "displaywindow" => corners(texture.display_window()),
        "averagecolor" => return color(&texture.average()?, kind, count),
        "constantcolor" => return color(&texture.constant()?, kind, count),
        "averagealpha" => return color(&[alpha(texture, &texture.average()?)?], kind, count),
        "constantalpha" => return color(&[alpha(texture, &texture.constant()?)?], kind, count),
        _ => match texture.attributes().get(datum)? {
            Attribute::Ints(list) => list.iter().copied().map(Const::Int).collect(),
            Attribute::Floats(list) => list.iter().copied().map(Const::Float).collect(),
            Attribute::Triple(triple) => vec![Const::Triple(*triple)],
            Attribute::Matrix(matrix) => vec![Const::Matrix(Box::new(*matrix))],
            Attribute::Text(own) => text(own),
        },
    };
    in_form(values, kind, count)
}

/// Channels as floats, or as a triple. Missing channels are 0.
fn color(channels: &[f32], kind: Kind, count: usize) -> Option<Vec<Const>> {
    let channel = |c: usize| channels.get(c).copied().unwrap_or(0.0);
    match kind {
        Kind::Triple if count == 0 => Some(vec![Const::Triple([channel(0), channel(1), channel(2)])]),
        Kind::Float => Some((0..count.max(1)).map(|c| Const::Float(channel(c))).collect()),
        _ => None,
    }
}

fn alpha(texture: &Texture, channels: &[f32]) -> Option<f32> {
    texture.alpha().and_then(|alpha| channels.get(alpha)).copied()
}

/// The values, if they have the requested form; ints are accepted as floats.
fn in_form(values: Vec<Const>, kind: Kind, count: usize) -> Option<Vec<Const>> {
    if values.len() != count.max(1) {
        return None;
    }
    let one = |value: Const| match value {
        Const::Int(n) if kind == Kind::Float => Some(Const::Float(n as f32)),
        value => (value.kind() == kind).then_some(value),
    };
    values.into_iter().map(one).collect()
}
