//! A model of Gabor noise in f64, without and with the filter. Sources: Lagae, Lefebvre, Drettakis and Dutré,
//! Procedural noise using sparse Gabor convolution, 2009; Lagae, Lefebvre and Dutré, Improving Gabor noise,
//! 2011.
//!
//! It shares with the noise only the hash, the conversion of a word to a number, and the radius of the
//! kernels.

use super::case::{Case, Model, Piece, even};
use osl_noise::gabor::{self, Options};
use osl_noise::hash::{hash, unit};
use std::f64::consts::{PI, TAU};

struct Sequence(u32);

impl Sequence {
    fn draw(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(3_039_177_861);
        f64::from(unit(self.0))
    }
}

/// Frequency and phase of an impulse, uniform on the sphere, along the direction, or around the circle.
fn wave(sequence: &mut Sequence, options: &Options) -> ([f64; 3], f64) {
    let direction = options.direction.map(f64::from);
    let frequency = match options.anisotropic {
        0 => {
            let turn = TAU * sequence.draw();
            let up = 2.0 * sequence.draw() - 1.0;
            let out = (1.0 - up * up).max(0.0).sqrt();
            [turn.cos() * out, turn.sin() * out, up]
        }
        1 => direction,
        _ => {
            let turn = TAU * sequence.draw();
            let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            [length * turn.cos(), length * turn.sin(), 0.0]
        }
    };
    (frequency, TAU * sequence.draw())
}

/// The noise without filter.
fn noise(p: [f64; 3], periods: Option<[f64; 3]>, seed: u32, options: &Options, piece: &mut Piece) -> f64 {
    let radius = f64::from(gabor::radius(options));
    // The Gaussian of a kernel is 0.02 at its radius.
    let a = (-0.02_f64.ln() / PI).sqrt() / radius;
    let impulses = f64::from(options.impulses);
    let volume = 4.0 / 3.0 * PI;
    let empty = (-impulses / volume).exp();
    let place = p.map(|x| x / radius);
    let mut sum = 0.0;
    for offset in 0..27 {
        let cell = [offset % 3, offset / 3 % 3, offset / 9].map(|o| f64::from(o) - 1.0);
        let cell: [f64; 3] = std::array::from_fn(|axis| place[axis].floor() + cell[axis]);
        let words: [u32; 3] = std::array::from_fn(|axis| {
            let whole = periods.map_or(cell[axis], |periods| cell[axis].rem_euclid(periods[axis]));
            whole as i64 as u32
        });
        let word = hash([words[0], words[1], words[2], seed]);
        let mut sequence = Sequence(word.max(1));
        let (mut left, mut count) = (sequence.draw(), 0);
        while left > empty {
            count += 1;
            left *= sequence.draw();
        }
        for _ in 0..count {
            let (z, y, x) = (sequence.draw(), sequence.draw(), sequence.draw());
            let way: [f64; 3] =
                std::array::from_fn(|axis| radius * (place[axis] - cell[axis] - [x, y, z][axis]));
            let (frequency, phase) = wave(&mut sequence, options);
            let square = way.iter().map(|x| x * x).sum::<f64>();
            if piece.is(square < radius * radius) {
                let angle = (0..3).map(|axis| frequency[axis] * way[axis]).sum::<f64>();
                sum += (-PI * a * a * square).exp() * (TAU * angle + phase).cos();
            }
        }
    }
    let density = impulses / (volume * radius.powi(3));
    let variance = 1.0 / (4.0 * 2.0_f64.sqrt() * a.powi(3));
    sum / density.sqrt() * 0.5 / (3.0 * variance.sqrt())
}

const FORMS: [(&str, &str, &[usize]); 3] =
    [("s", "5", &[9]), ("s, t", "5, 3", &[9, 10]), ("a", "point(5, 3, 4)", &[0, 1, 2])];

/// Gabor noise in one to three dimensions, for each kind of direction, periodic or not.
pub(crate) fn noises() -> Vec<Case> {
    let mut cases = Vec::new();
    for (coordinates, periods, inputs) in FORMS {
        for (anisotropic, bandwidth, impulses) in [(0, 1.0, 16.0), (1, 2.0, 8.0), (2, 1.5, 5.0)] {
            for periodic in [false, true] {
                let triple = periodic;
                let options = Options {
                    anisotropic,
                    direction: [1.0, 2.0, 0.5],
                    bandwidth,
                    impulses,
                    do_filter: false,
                };
                let texts = format!(
                    "\"anisotropic\", {anisotropic}, \"direction\", vector(1, 2, 0.5), \"bandwidth\", {bandwidth:?}, \
                     \"impulses\", {impulses:?}, \"do_filter\", 0"
                );
                let model: Model = Box::new(move |x, p| {
                    let place = std::array::from_fn(|axis| inputs.get(axis).map_or(0.0, |i| x.0[*i]));
                    let periods = [5.0, 3.0, 4.0];
                    let periods =
                        std::array::from_fn(|axis| if axis < inputs.len() { periods[axis] } else { 1.0 });
                    let periods = periodic.then_some(periods);
                    [0, 1, 2].map(|seed| {
                        if seed > 0 && !triple { 0.0 } else { noise(place, periods, seed, &options, p) }
                    })
                });
                let (row, periods) =
                    if periodic { ("pnoise", format!(", {periods}")) } else { ("noise", String::new()) };
                let ty = if triple { "vector" } else { "float" };
                let code = format!("({ty}){row}(\"gabor\", {coordinates}{periods}, {texts})");
                // A value is the sum of hundreds of terms, so there are fewer points.
                cases.push(
                    Case {
                        points: [60, 20],
                        inside: (16.0, "the place within a cell is what is left of the coordinates"),
                        ..Case::new(row, &code, triple, model)
                    }
                    .on(&[even(-10.0, 10.0).edges(-10.0, 10.0)]),
                );
            }
        }
    }
    cases
}
