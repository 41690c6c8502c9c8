//! The pilot: some pixels with so many samples that they serve as truth.

use super::lattice::Bends;
use super::learn::Tried;
use super::{CLOSE, PEEK, PILOT, REFERENCE, REFERENCE_MORE, ROUGH, WITNESSES, Work, above, estimate};
use crate::sample::adapt::{FEWEST, Refiner, power_below};
use crate::sample::oracle::some_pixels;
use osl_exec::Stop;

impl Work<'_, '_> {
    /// Whether the centres of some pixels are as interpolated, wherever the lattice says so itself.
    pub(super) fn is_smooth(&mut self, bends: &Bends) -> Result<bool, Stop> {
        let peek = self.choose(PEEK, 0x9110);
        let bound = self.wanted.error;
        let before: Vec<Vec<f32>> = self
            .values
            .iter()
            .map(|plane| peek.iter().map(|pixel| plane[*pixel as usize]).collect())
            .collect();
        self.centres(peek.clone())?;
        let mut bending = 0;
        for (slot, pixel) in peek.iter().enumerate() {
            let off = |(plane, before): (&Vec<f32>, &Vec<f32>)| {
                above((plane[*pixel as usize] - before[slot]).abs(), CLOSE * bound)
            };
            if above(bends.at(*pixel as usize), bound) {
                bending += 1;
            } else if self.values.iter().zip(&before).any(off) {
                return Ok(false);
            }
        }
        Ok(bending as f32 <= ROUGH * peek.len() as f32)
    }

    fn choose(&self, (each, fewest, most): (usize, usize, usize), seed: u32) -> Vec<u32> {
        let count = self.width * self.height;
        some_pixels(count, (count / each).clamp(fewest, most), self.first ^ seed)
    }

    /// Chooses the pilot and has its samples taken.
    pub(super) fn pilot(&mut self) -> Result<Pilot, Stop> {
        let pilot = self.choose(PILOT, 0x2b07);
        let all = pilot.iter().map(|pixel| pixel + self.first).collect();
        let mut refiner = Refiner::new(self.shading, all);
        refiner.round(FEWEST.min(self.wanted.most))?;
        let (fewest, most) = WITNESSES;
        let witnesses = (0.5 * self.range() / self.wanted.error).clamp(fewest, most) as u32;
        Pilot::new(self, pilot, refiner, witnesses.next_power_of_two())
    }

    /// How far apart values of the lattice are, the most of all planes.
    fn range(&self) -> f32 {
        let range = |plane: &Vec<f32>| {
            let finite = plane.iter().filter(|x| x.is_finite());
            let (low, high) =
                finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
            (high - low).max(0.0)
        };
        self.values.iter().map(range).fold(0.0, f32::max)
    }
}

/// Pixels with so many samples that they serve as truth.
#[derive(Default)]
pub(super) struct Pilot {
    /// Numbers within the band.
    pub(super) pixels: Vec<u32>,
    /// Samples of each.
    pub(super) samples: Vec<u32>,
    /// For each plane, their values.
    pub(super) values: Vec<Vec<f32>>,
    /// What fewer samples would have said.
    pub(super) rounds: Vec<Round>,
    pub(super) evaluations: u64,
}

/// The pixels of a pilot after some samples.
pub(super) struct Round {
    pub(super) samples: u32,
    /// By pixel, the standard error; not a number for those that had stopped.
    errors: Vec<f32>,
    values: Vec<Vec<f32>>,
}

impl Pilot {
    /// Takes samples until they serve as truth. The refiner has done its first round.
    fn new(
        work: &mut Work<'_, '_>,
        pixels: Vec<u32>,
        mut refiner: Refiner<'_>,
        witnesses: u32,
    ) -> Result<Pilot, Stop> {
        let mut history = Vec::new();
        let most = power_below(work.wanted.most.saturating_mul(REFERENCE_MORE));
        while !refiner.active.is_empty() {
            let samples = refiner.samples;
            if samples <= work.wanted.most {
                let mut errors = vec![f32::NAN; pixels.len()];
                refiner.active.iter().for_each(|slot| errors[*slot] = refiner.error(*slot));
                history.push(Round { samples, errors, values: refiner.means() });
            }
            let enough = REFERENCE * work.wanted.error;
            refiner.settle(|_, error| samples >= witnesses && error <= enough);
            if refiner.active.is_empty() || 2 * samples > most {
                break;
            }
            refiner.round(2 * samples)?;
        }
        work.said.add(std::mem::take(&mut refiner.said));
        Ok(Pilot {
            pixels,
            samples: refiner.each.clone(),
            values: refiner.means(),
            rounds: history,
            evaluations: refiner.evaluations,
        })
    }

    /// How far values are from the truth, the most of all planes; 0 where the truth is no number, which nothing mends.
    pub(super) fn distance(&self, slot: usize, value: impl Fn(usize) -> f32) -> f32 {
        let mut worst = 0.0_f32;
        for (plane, truth) in self.values.iter().enumerate() {
            let truth = truth[slot];
            let distance = (value(plane) - truth).abs();
            if truth.is_finite() {
                worst = worst.max(if distance.is_nan() { f32::INFINITY } else { distance });
            }
        }
        worst
    }
}

impl Round {
    /// Estimate and error of a pixel in this round. The truth contains these samples; without them it would be further away.
    pub(super) fn tried(&self, truth: &Pilot, slot: usize, bend: f32) -> Tried {
        let share = self.samples as f32 / truth.samples[slot].max(1) as f32;
        let error = self.errors[slot];
        if share >= 1.0 || error.is_nan() {
            return (estimate(if error.is_nan() { 0.0 } else { error }, bend, self.samples), 0.0);
        }
        let distance = truth.distance(slot, |plane| self.values[plane][slot]);
        (estimate(error, bend, self.samples), distance / (1.0 - share).sqrt())
    }
}
