//! Named spaces of points and of colors.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::{self, ArithmeticImpl};
use crate::message::Message;
use crate::services::IDENTITY;
use crate::step::{KernelStep, Location};
use osl_ir::ir::LaneOp;
use osl_lanes::Element;
use osl_numeric::Number;
use osl_numeric::color::ColorSystem;
use osl_numeric::named;
use osl_numeric::spaces::Path;

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// The matrix between two spaces, and a message for each unknown space, which counts as common space.
    fn matrix_between(&self, from: &str, to: &str) -> ([A::Real; 16], Vec<Message>) {
        match self.services.spaces.matrix(from, to) {
            Ok(matrix) => (matrix, Vec::new()),
            Err(unknown) => {
                let names = unknown.names.into_iter().flatten();
                let message = |name: &str| Message::error(format!("Unknown transformation \"{name}\""));
                (unknown.matrix, names.map(message).collect())
            }
        }
    }

    /// `both`: the matrix is the identity unless both spaces are known.
    pub(super) fn space_matrix(&mut self, both: bool, step: &KernelStep, mask: &Mask) {
        let ([from, to], [out]) = (&step.args[..], &step.outs[..]) else { return };
        let used = |matrix: [A::Real; 16], unknown: &[Message]| {
            if both && !unknown.is_empty() { IDENTITY.map(A::Real::lit) } else { matrix }
        };
        let width = self.width;
        if let (Some(from), Some(to)) = (self.uniform_text(*from, mask), self.uniform_text(*to, mask)) {
            let (matrix, unknown) = self.matrix_between(&from, &to);
            let matrix = used(matrix, &unknown);
            for message in unknown {
                self.report_all(mask, Message { at: Some(step.span), ..message });
            }
            let n = if matches!(out.location, Location::Words(_)) { 1 } else { width };
            let mut target = self.take(*out);
            for (lanes, x) in target.chunks_mut(n).zip(matrix) {
                lanes.fill(x.store());
            }
            self.put(*out, target);
            return;
        }
        for lane in self.active(mask) {
            let (a, b) = (self.text(self.bits(*from, lane)), self.text(self.bits(*to, lane)));
            let (matrix, unknown) = self.matrix_between(&a, &b);
            let matrix = used(matrix, &unknown);
            for message in unknown {
                self.report(step, lane, mask, message);
            }
            self.set_words(*out, lane, &matrix.map(A::Real::store));
            if !self.work.close() {
                return;
            }
        }
    }

    /// Whether both spaces are known, and the matrix.
    pub(super) fn find_space(&mut self, step: &KernelStep, mask: &Mask) {
        let ([from, to], [found, out]) = (&step.args[..], &step.outs[..]) else { return };
        for lane in self.lanes(&step.outs, mask) {
            let (a, b) = (self.text(self.bits(*from, lane)), self.text(self.bits(*to, lane)));
            let (matrix, unknown) = self.matrix_between(&a, &b);
            self.set_bits(*found, lane, unknown.is_empty().into());
            for message in unknown {
                self.report(step, lane, mask, message);
            }
            self.set_words(*out, lane, &matrix.map(A::Real::store));
            if !self.work.close() {
                return;
            }
        }
    }

    /// A color conversion between spaces whose names are computed; for constant names there are lane
    /// operations.
    pub(super) fn color_between(&mut self, step: &KernelStep, mask: &Mask) {
        let [out] = &step.outs[..] else { return };
        for lane in self.lanes(&step.outs, mask) {
            let ([from, to, color] | [from, to, color, _]) = step.args[..] else { return };
            // The number of the RGB system, if one is set.
            let system = step.args.get(3).map(|system| self.bits(*system, lane) as i32);
            let (from, to) = (&self.text(self.bits(from, lane)), &self.text(self.bits(to, lane)));
            let mut words = [0, 1, 2].map(|c| self.word(self.part(color, c), lane));
            let path = Path::between(from, to, system);
            if path.is_none() {
                let text = format!("Unknown color space transformation \"{from}\" -> \"{to}\"");
                self.report(step, lane, mask, Message::error(text));
            }
            for (op, number) in path.into_iter().flat_map(Path::steps) {
                let (from, number) = (words, number.unwrap_or(0));
                let rgb = || ColorSystem::<A::Real>::numbered(number);
                let color = || from.map(A::Real::load);
                match op {
                    LaneOp::XyzToRgbIn => words = rgb().to_rgb(color()).map(A::Real::store),
                    LaneOp::RgbToXyzIn => words = rgb().to_xyz(color()).map(A::Real::store),
                    LaneOp::ConvertNamed => words = named::convert(color(), number).map(A::Real::store),
                    op => arithmetic::one::<A>(self.isa, op, &from, &mut words, 1),
                }
            }
            self.set_words(*out, lane, &words);
            if !self.work.close() {
                return;
            }
        }
    }
}
