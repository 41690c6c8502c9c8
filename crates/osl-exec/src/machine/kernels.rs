//! Steps that need more than a lane's arithmetic: noise fields, named spaces, textures.

use super::Machine;
use super::mask::Mask;
use crate::lanes::Arg;
use crate::message::Message;
use crate::program::{Operand, Place};
use crate::register::{Lanes, floats, floats_mut};
use crate::services::IDENTITY;
use osl_image::{Footprint, Interp, LookupOptions, Texture, Wrap, lookup_values};
use osl_ir::Span;
use osl_ir::ir::{Kernel, LaneOp, NoiseField, TextureOption};
use osl_noise::Kind as Field;
use std::sync::Arc;

impl Machine<'_> {
    /// Runs a kernel over all lanes, or once where the result is shared.
    pub(super) fn kernel(
        &mut self,
        kernel: &Kernel,
        args: &[Operand],
        out: Operand,
        span: Span,
        mask: &Mask,
    ) {
        let _ = span;
        match kernel {
            Kernel::Noise { field, .. } => self.noise(*field, args, out),
            Kernel::NamedNoise { .. } => self.named_noise(args, out, mask),
            Kernel::SpaceMatrix => self.space_matrix(args, out, mask),
            Kernel::ColorFrom => self.color_from(args, out, mask),
            Kernel::Texture { options, footprint, .. } => self.texture(options, *footprint, args, out, mask),
        }
    }

    /// A noise field of the coordinates, which are one to four floats in one or two operands.
    fn noise(&mut self, field: NoiseField, args: &[Operand], out: Operand) {
        let n = if matches!(out.place, Place::Words(_)) { 1 } else { self.width };
        let mut spread: Vec<Lanes> = std::mem::take(&mut self.scratch);
        let mut target = self.take(out);
        {
            let mut coords: [&[f32]; 4] = [&[]; 4];
            let mut dims = 0;
            let mut scratch = spread.iter_mut();
            for arg in args {
                for component in 0..arg.words as usize {
                    let lanes = match self.component(*arg, component) {
                        Arg::Each(words) => floats(words),
                        Arg::Same(word) => match scratch.next() {
                            Some(lanes) => {
                                let lanes = &mut floats_mut(lanes.words_mut())[..n];
                                lanes.fill(f32::from_bits(word[0]));
                                &*lanes
                            }
                            None => &[],
                        },
                    };
                    if let Some(coord) = coords.get_mut(dims) {
                        *coord = lanes;
                        dims += 1;
                    }
                }
            }
            let coords = &coords[..dims];
            let field = field_of(field);
            let mut chunks = target.chunks_mut(n).map(floats_mut);
            match (out.words, chunks.next(), chunks.next(), chunks.next()) {
                (3, Some(x), Some(y), Some(z)) => osl_noise::eval3(self.isa, field, coords, [x, y, z]),
                (1, Some(x), ..) => osl_noise::eval(self.isa, field, coords, &mut x[..n]),
                _ => {}
            }
        }
        self.put(out, target);
        self.scratch = spread;
    }

    fn text(&self, number: u32) -> Arc<str> {
        self.program.strings.get(number as usize).cloned().unwrap_or_else(|| "".into())
    }

    /// A string that all active lanes share, if they do; reading the first active lane otherwise says which.
    fn shared_text(&self, operand: Operand, mask: &Mask) -> Option<Arc<str>> {
        match self.arg(operand) {
            Arg::Same(word) => Some(self.text(word[0])),
            Arg::Each(lanes) => {
                let first = *lanes.get(mask.first()?)?;
                let mut same = true;
                mask.for_each(|lane| same &= lanes[lane] == first);
                same.then(|| self.text(first))
            }
        }
    }

    /// The distinct strings among the active lanes, each with the lanes that have it.
    fn groups(&self, operand: Operand, mask: &Mask) -> Vec<(Arc<str>, Vec<u32>)> {
        let Arg::Each(lanes) = self.arg(operand) else { return Vec::new() };
        let mut numbers: Vec<u32> = Vec::new();
        mask.for_each(|lane| {
            if !numbers.contains(&lanes[lane]) {
                numbers.push(lanes[lane]);
            }
        });
        numbers
            .into_iter()
            .map(|n| (self.text(n), lanes.iter().map(|l| u32::from(*l == n)).collect()))
            .collect()
    }

    fn named_noise(&mut self, args: &[Operand], out: Operand, mask: &Mask) {
        let Some((name, coords)) = args.split_first() else { return };
        if let Some(text) = self.shared_text(*name, mask) {
            self.noise_by_name(&text, coords, out);
            return;
        }
        // Names differ between lanes: each field in turn, kept where its name stands.
        let all = Mask::all(self.width);
        let words = out.words as usize * self.width;
        let mut result = Lanes::new(words);
        for (text, lanes) in self.groups(*name, mask) {
            self.noise_by_name(&text, coords, out);
            let (here, _) = all.split(&lanes);
            if let Arg::Each(values) = self.arg(out) {
                for (to, from) in result.words_mut().chunks_mut(self.width).zip(values.chunks(self.width)) {
                    here.copy(to, from);
                }
            }
        }
        let mut target = self.take(out);
        for (to, from) in target.chunks_mut(self.width).zip(result.words().chunks(self.width)) {
            to.copy_from_slice(from);
        }
        self.put(out, target);
    }

    fn noise_by_name(&mut self, name: &str, coords: &[Operand], out: Operand) {
        match NoiseField::from_name(name) {
            Some(field) => self.noise(field, coords, out),
            None => {
                self.messages.add(Message::error(format!("noise type \"{name}\" is unknown")));
                let mut target = self.take(out);
                target.chunks_mut(1).for_each(|word| word.fill(0));
                self.put(out, target);
            }
        }
    }

    fn matrix_between(&mut self, from: &str, to: &str) -> [f32; 16] {
        let found = self.services.spaces.matrix(from, to).map_err(str::to_string);
        found.unwrap_or_else(|unknown| {
            self.messages.add(Message::error(format!("unknown transformation \"{unknown}\"")));
            IDENTITY
        })
    }

    fn space_matrix(&mut self, args: &[Operand], out: Operand, mask: &Mask) {
        let [from, to] = args else { return };
        let width = self.width;
        let mut target = self.take(out);
        if let (Some(from), Some(to)) = (self.shared_text(*from, mask), self.shared_text(*to, mask)) {
            let matrix = self.matrix_between(&from, &to);
            let n = if matches!(out.place, Place::Words(_)) { 1 } else { width };
            for (lanes, x) in target.chunks_mut(n).zip(matrix) {
                lanes.fill(x.to_bits());
            }
        } else {
            let number = |m: &Self, operand: Operand, lane: usize| match m.arg(operand) {
                Arg::Same(word) => word[0],
                Arg::Each(lanes) => lanes[lane],
            };
            let mut lanes = Vec::new();
            mask.for_each(|lane| lanes.push(lane));
            for lane in lanes {
                let (a, b) = (self.text(number(self, *from, lane)), self.text(number(self, *to, lane)));
                let matrix = self.matrix_between(&a, &b);
                for (column, x) in target.chunks_mut(width).zip(matrix) {
                    column[lane] = x.to_bits();
                }
            }
        }
        self.put(out, target);
    }

    fn color_from(&mut self, args: &[Operand], out: Operand, mask: &Mask) {
        let [name, color] = args else { return };
        let groups = match self.shared_text(*name, mask) {
            Some(text) => vec![(text, None)],
            None => self.groups(*name, mask).into_iter().map(|(t, lanes)| (t, Some(lanes))).collect(),
        };
        for (text, lanes) in groups {
            let here = lanes.map_or(Mask::all(self.width), |lanes| Mask::all(self.width).split(&lanes).0);
            let op = match &*text {
                "rgb" | "RGB" | "Rec709" => None,
                "hsv" => Some(LaneOp::HsvToRgb),
                "hsl" => Some(LaneOp::HslToRgb),
                "YIQ" => Some(LaneOp::YiqToRgb),
                "XYZ" => Some(LaneOp::XyzToRgb),
                "xyY" => Some(LaneOp::XyyToRgb),
                _ => {
                    let text = format!("unknown color space transformation \"{text}\" -> \"rgb\"");
                    self.messages.add(Message::error(text));
                    None
                }
            };
            match op {
                Some(op) if matches!(here, Mask::All(_)) => self.lane(op, &[*color], out),
                Some(op) => self.color_where(op, *color, out, &here),
                None => self.copy(*color, out, &here),
            }
        }
    }

    /// Converts at some lanes only: through the lane operation, one lane at a time.
    fn color_where(&mut self, op: LaneOp, color: Operand, out: Operand, here: &Mask) {
        let mut target = self.take(out);
        here.for_each(|lane| {
            let value: [u32; 3] = std::array::from_fn(|c| match self.component(color, c) {
                Arg::Same(word) => word[0],
                Arg::Each(lanes) => lanes[lane],
            });
            let mut result = [0; 3];
            let args = [Arg::Same(&value)];
            crate::lanes::run(self.isa, crate::lanes::LaneCall { op, args: &args, out: &mut result, n: 1 });
            for (lanes, word) in target.chunks_mut(self.width).zip(result) {
                lanes[lane] = word;
            }
        });
        self.put(out, target);
    }

    fn texture(
        &mut self,
        options: &[TextureOption],
        footprint: bool,
        args: &[Operand],
        out: Operand,
        mask: &Mask,
    ) {
        let [name, s, t, values @ ..] = args else { return };
        let slopes = if footprint { values.get(options.len()..).unwrap_or(&[]) } else { &[] };
        let mut target = self.take(out);
        let n = if matches!(out.place, Place::Words(_)) { 1 } else { self.width };
        let mut lanes = Vec::new();
        mask.for_each(|lane| lanes.push(lane));
        if n == 1 {
            lanes.truncate(1);
            lanes.iter_mut().for_each(|lane| *lane = 0);
        }
        let mut last: Option<(u32, Option<Arc<Texture>>)> = None;
        for lane in lanes {
            let number = self.word(*name, lane);
            if last.as_ref().is_none_or(|(n, _)| *n != number) {
                last = Some((number, self.open_texture(number)));
            }
            let mut value = [0.0; 4];
            if let Some((_, Some(texture))) = &last {
                let mut lookup = LookupOptions::default();
                for (option, value) in options.iter().zip(values) {
                    let word = self.word(*value, lane);
                    self.set_option(&mut lookup, *option, word);
                }
                let (s, t) = (f32::from_bits(self.word(*s, lane)), f32::from_bits(self.word(*t, lane)));
                let mut slope = [0.0; 4];
                for (slope, operand) in slope.iter_mut().zip(slopes) {
                    *slope = f32::from_bits(self.word(*operand, lane));
                }
                let [ds_dx, dt_dx, ds_dy, dt_dy] = slope;
                let footprint = Footprint { ds_dx, dt_dx, ds_dy, dt_dy };
                value = lookup_values(texture, s, t, &footprint, out.words as usize, &lookup);
            }
            for (lanes, value) in target.chunks_mut(n).zip(value).take(out.words as usize) {
                lanes[lane] = value.to_bits();
            }
        }
        self.put(out, target);
    }

    /// One component of an operand at one lane.
    fn word(&self, operand: Operand, lane: usize) -> u32 {
        match self.arg(operand) {
            Arg::Same(word) => word[0],
            Arg::Each(lanes) => lanes[lane],
        }
    }

    fn open_texture(&mut self, number: u32) -> Option<Arc<Texture>> {
        match self.services.textures.get(&self.text(number)) {
            Ok(texture) => Some(texture),
            Err(failure) => {
                self.messages.add(Message::error(failure.message()));
                None
            }
        }
    }

    fn set_option(&self, lookup: &mut LookupOptions, option: TextureOption, word: u32) {
        let number = f32::from_bits(word);
        let wrap = || Wrap::from_name(&self.text(word)).unwrap_or(Wrap::File);
        match option {
            TextureOption::Wrap => (lookup.wrap_s, lookup.wrap_t) = (wrap(), wrap()),
            TextureOption::SWrap => lookup.wrap_s = wrap(),
            TextureOption::TWrap => lookup.wrap_t = wrap(),
            TextureOption::Interp => lookup.interp = Interp::from_name(&self.text(word)).unwrap_or_default(),
            TextureOption::FirstChannel => lookup.first_channel = (word as i32).max(0) as usize,
            TextureOption::Fill => lookup.fill = number,
            TextureOption::Width => lookup.width = (number, number),
            TextureOption::SWidth => lookup.width.0 = number,
            TextureOption::TWidth => lookup.width.1 = number,
            TextureOption::Blur => lookup.blur = (number, number),
            TextureOption::SBlur => lookup.blur.0 = number,
            TextureOption::TBlur => lookup.blur.1 = number,
        }
    }
}

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
