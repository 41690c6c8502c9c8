//! The errors of levels: reference values of pixels at each footprint, and how far a program is from them.
//!
//! There are two sets of points, at other positions and with other samples: levels are made and chosen on
//! the first, and the second only judges them. A third set is the given image itself.

use super::errors::{BLOCKS, Off, Square, shift};
use super::ground::{Ground, Sides};
use crate::cost::cost;
use crate::sample::{Filter, Oracle, Pattern, Shading, oracle, reaches, some_pixels};
use osl::stages::{self, Compiled};
use osl_exec::{PointSource, RunError, RunOptions, Services};
use osl_ir::global::Global;
use osl_ir::ir::Body;
use osl_ir::passes;
use osl_ir::types::Type;
use osl_scene::Grid;
use std::ops::Range;

/// The footprints that are measured: a pixel is so many times larger than in the given image.
pub(super) const FOOTPRINTS: [f64; 9] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0];

/// The largest side that is measured.
pub(super) const LARGEST: f64 = 256.0;
/// Pixels of a set of square ones, and of elongated ones.
const SQUARE: usize = 1024;
const ELONGATED: usize = 512;
/// Smallest and largest number of samples of a reference value.
const SAMPLES: (u32, u32) = (32, 128);
/// The work of all reference values, in additions: it sets the number of samples, so that this number does
/// not depend on the clock.
const WORK: f64 = 4e9;
/// How far the rounded mean of an int may be off, as a share of its range.
const ROUNDING: f64 = 0.01;
/// Largest number of samples of the original that a level is compared with.
pub(super) const MOST: u32 = 64;

/// A compiled shader.
pub(super) struct Variant {
    pub(super) compiled: Compiled,
    /// Its cost, in additions.
    pub(super) cost: f64,
}

/// The set of points on which levels are made, the one that judges them, and the pixels that show a part of
/// the given image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Set {
    Fitted,
    HeldOut,
    Home,
}

impl Set {
    /// How many images it is away from the origin, its seed for pixels and for samples.
    fn place(self, seed: u32) -> (f64, u32, u32) {
        match self {
            Set::Fitted => (0.0, seed.wrapping_mul(7) ^ 0x10d5, seed ^ 0x0a11),
            Set::Home => (0.0, seed.wrapping_mul(17) ^ 0x30fe, seed ^ 0x0c33),
            Set::HeldOut => (1.61, seed.wrapping_mul(13) ^ 0x6e1d, seed ^ 0x0b22),
        }
    }
}

/// The surroundings of all runs.
pub(super) struct Judge<'a> {
    pub(super) services: &'a Services,
    pub(super) options: &'a RunOptions,
    pub(super) grid: &'a Grid,
    pub(super) turned: Vec<Global>,
    pub(super) seed: u32,
    pub(super) outputs: Vec<Output>,
    samples: u32,
}

/// An output of the shader.
#[derive(Clone, Debug)]
pub(super) struct Output {
    pub(super) name: String,
    pub(super) ty: Type,
    pub(super) planes: Range<usize>,
    /// The size of its range, and its ends below. Errors are shares of this size.
    pub(super) range: f64,
    pub(super) ends: [f32; 2],
}

/// The reference values of pixels of one shape.
pub(super) struct Truth {
    pub(super) sides: Sides,
    pub(super) set: Set,
    ground: Ground,
    oracle: Oracle,
    /// The block of the picture in which each pixel lies.
    blocks: Vec<usize>,
}

impl<'a> Judge<'a> {
    /// Measures the ranges of the outputs and decides on the number of samples.
    pub(super) fn new(
        (services, options): (&'a Services, &'a RunOptions),
        grid: &'a Grid,
        (turned, seed): (Vec<Global>, u32),
        original: Body,
    ) -> Result<(Judge<'a>, Variant), RunError> {
        let mut judge =
            Judge { services, options, grid, turned, seed, outputs: Vec::new(), samples: SAMPLES.0 };
        let variant = judge.variant(original);
        let each = WORK / (2.0 * FOOTPRINTS.len() as f64 * SQUARE as f64 * variant.cost.max(1.0));
        judge.samples = 1 << (each.clamp(f64::from(SAMPLES.0), f64::from(SAMPLES.1)) as u32).ilog2();
        judge.outputs = judge.ranges(&variant)?;
        Ok((judge, variant))
    }

    /// The outputs with their ranges. An image with more of the pattern counts too, because the one at
    /// footprint 1 may show less than a cell of it.
    fn ranges(&self, original: &Variant) -> Result<Vec<Output>, RunError> {
        let mut outputs: Vec<Output> = Vec::new();
        for footprint in [1.0, 4.0, 16.0] {
            let ground = self.ground([footprint; 2], Set::Fitted);
            let pattern = Pattern::new(1, self.seed);
            let shading = self.shading(original, &ground, &pattern);
            let planes = shading.planes();
            for (at, mut reach) in reaches(&shading)?.into_iter().enumerate() {
                let ty = planes.get(reach.planes.start).map_or(Type::FLOAT, |plane| plane.ty);
                if let Some(own) = outputs.get(at) {
                    reach.ends = [reach.ends[0].min(own.ends[0]), reach.ends[1].max(own.ends[1])];
                }
                let (name, range, ends) = (reach.name.to_string(), f64::from(reach.size()), reach.ends);
                let output = Output { name, ty, range, ends, planes: reach.planes };
                match outputs.get_mut(at) {
                    Some(own) => *own = output,
                    None => outputs.push(output),
                }
            }
        }
        Ok(outputs)
    }

    /// Compiles a body for the points.
    pub(super) fn variant(&self, body: Body) -> Variant {
        let ground = self.ground([1.0; 2], Set::Fitted);
        let options = passes::Options {
            varying: ground.varying().to_vec(),
            derivs: ground.varying_derivs().to_vec(),
            affine: self.services.spaces.affine(),
            limits: self.options.limits.clone(),
            ..passes::Options::default()
        };
        let compiled = stages::finish(body, &options);
        let cost = cost(&compiled.body);
        Variant { compiled, cost }
    }

    /// The points of a set. Levels are made for all surfaces and views, and must hold for those of a run.
    pub(super) fn ground(&self, sides: Sides, set: Set) -> Ground {
        let ground = Ground::new(self.grid, sides, set.place(self.seed).0, &self.turned, self.seed);
        if set == Set::Fitted { ground } else { ground.still() }
    }

    pub(super) fn shading<'s>(
        &'s self,
        variant: &'s Variant,
        ground: &'s Ground,
        pattern: &Pattern,
    ) -> Shading<'s> {
        Shading {
            program: &variant.compiled.program,
            services: self.services,
            surface: ground,
            options: self.options,
            cheaper: None,
            pattern: pattern.clone(),
            filter: Filter::default(),
        }
    }

    /// The reference values of pixels of a shape, from samples of the original.
    pub(super) fn truth(&self, original: &Variant, sides: Sides, set: Set) -> Result<Truth, RunError> {
        let ground = self.ground(sides, set);
        let (pixels, blocks) = self.pixels(sides, set);
        let pattern = Pattern::new(1, self.seed);
        let oracle = oracle(&self.shading(original, &ground, &pattern), &pixels, self.samples)?;
        Ok(Truth { sides, set, ground, oracle, blocks })
    }

    /// The columns and rows of a set. The image at footprint 1 is in the first corner of the one with larger
    /// pixels.
    fn shown(&self, sides: Sides, set: Set) -> [usize; 2] {
        let shown = |n: usize, side: f64| match set {
            Set::Home => ((n as f64 / side).ceil() as usize + 1).min(n),
            _ => n,
        };
        [shown(self.grid.width, sides[0]).max(1), shown(self.grid.height, sides[1]).max(1)]
    }

    /// The pixels of a set, and the block of its picture in which each lies.
    fn pixels(&self, sides: Sides, set: Set) -> (Vec<u32>, Vec<usize>) {
        let [columns, rows] = self.shown(sides, set);
        let place = |at: u32| {
            let (x, y) = (at as usize % columns, at as usize / columns);
            let block = |at: usize, n: usize| (at * BLOCKS / n).min(BLOCKS - 1);
            ((y * self.grid.width + x) as u32, block(y, rows) * BLOCKS + block(x, columns))
        };
        let count = if sides[0] == sides[1] { SQUARE } else { ELONGATED };
        some_pixels(columns * rows, count, set.place(self.seed).1).into_iter().map(place).unzip()
    }

    /// The errors of a program with a number of samples.
    pub(super) fn off(&self, variant: &Variant, truth: &Truth, samples: u32) -> Result<Off, RunError> {
        Ok(self.compare(&self.values(variant, truth, samples)?, truth))
    }

    /// The values of a program at the pixels of the reference, as a run computes them: one sample lies at the
    /// centre of its pixel.
    pub(super) fn values(
        &self,
        variant: &Variant,
        truth: &Truth,
        samples: u32,
    ) -> Result<Vec<Vec<f32>>, RunError> {
        if samples <= 1 {
            let pattern = Pattern::new(1, self.seed);
            return self.shading(variant, &truth.ground, &pattern).at_centres(&truth.oracle.pixels);
        }
        let pattern = Pattern::new(samples, truth.set.place(self.seed).2);
        self.shading(variant, &truth.ground, &pattern).chosen(&truth.oracle.pixels, samples)
    }

    /// The errors of planes of values.
    pub(super) fn compare(&self, values: &[Vec<f32>], truth: &Truth) -> Off {
        let pixels = truth.oracle.pixels.len();
        let mut off = Off::default();
        for output in &self.outputs {
            let mut squares = vec![0.0; pixels];
            let mut own = 0.0;
            let mut shifts: Vec<Square> = Vec::new();
            let share = 1.0 / (output.range * output.range * output.planes.len().max(1) as f64);
            for plane in output.planes.clone() {
                let (Some(wanted), Some(doubt)) =
                    (truth.oracle.values.get(plane), truth.oracle.errors.get(plane))
                else {
                    continue;
                };
                let values = values.get(plane);
                let mut errors = vec![None; pixels];
                for (at, (square, signed)) in squares.iter_mut().zip(&mut errors).enumerate() {
                    let wanted = wanted.get(at).copied().map_or(f64::NAN, f64::from);
                    let value = values.and_then(|list| list.get(at)).copied().map_or(f64::NAN, f64::from);
                    let doubt = doubt.get(at).copied().map_or(f64::NAN, f64::from);
                    if wanted.is_finite() && doubt.is_finite() {
                        let error = if value.is_finite() { value - wanted } else { output.range };
                        *square += error * error * share;
                        own += doubt * doubt * share;
                        *signed = Some(error / output.range);
                    }
                }
                shifts.push(shift(&errors, &truth.blocks));
            }
            // The mean of an int is rounded.
            let rounding = if output.ty == Type::INT { (0.5 / output.range).min(ROUNDING) } else { 0.0 };
            off.rounding.push(rounding);
            off.squares.push(squares);
            off.own.push(own / pixels.max(1) as f64);
            off.shifts.push(shifts);
        }
        off
    }

    /// The mean of each plane over reference values.
    pub(super) fn means(&self, truths: &[&Truth]) -> Vec<f64> {
        let planes = self.outputs.iter().map(|o| o.planes.end).max().unwrap_or(0);
        let mean = |plane: usize| {
            let lists = truths.iter().filter_map(|truth| truth.oracle.values.get(plane));
            let values = lists.flatten().copied().filter(|x| x.is_finite()).map(f64::from);
            let (sum, count) = values.fold((0.0, 0.0_f64), |(sum, n), x| (sum + x, n + 1.0));
            sum / count.max(1.0)
        };
        (0..planes).map(mean).collect()
    }

    /// The number of pixels of a reference.
    pub(super) fn samples(&self) -> u32 {
        self.samples
    }
}
