//! The pilot: some of the pixels that need samples are sampled first, with twice as many samples as the
//! others will have. Each number of samples is judged by twice as many samples, so the cost of judging is
//! proportional to the cost of the image.

use super::Work;
use super::curvature::Curvatures;
use super::limits::{Rung, StoppingRule, fit};
use super::policy::*;
use super::probe::{Probes, distance};
use crate::sample::adapt::Refiner;
use crate::sample::error::weighted;
use crate::sample::oracle::some_pixels;
use osl_exec::RunError;
use pxfm::{f_log2f, f_powf};

impl<'a> Work<'_, 'a> {
    /// Chooses the pilot pixels and samples them until they show how to sample the others. `allowed` is the
    /// share of the pixels that may exceed the bound.
    pub(super) fn pilot(
        &mut self,
        (curvatures, probes): (&Curvatures, &Probes),
        pixels: &[u32],
        allowed: f32,
    ) -> Result<(Refiner<'a>, StoppingRule), RunError> {
        let all = self.known.len();
        // A quarter of the pixels that need samples, but at least 64; all of them in small images.
        let (of_few, available) = if all < SMALL_IMAGE { (1, pixels.len()) } else { (10, pixels.len() / 4) };
        let wanted =
            (all / PILOT).max((all / of_few).min(SURE_PROBES)).min(SMALL_IMAGE).min(available.max(64));
        let seed = self.first ^ 0x2b07;
        let chosen = some_pixels(pixels.len(), wanted, seed).iter().map(|at| pixels[*at as usize]).collect();
        let mut pilot = Pilot::new(self, (curvatures, self.range(probes)), chosen);
        pilot.double()?;
        loop {
            pilot.double()?;
            let last = pilot.refiner.samples > self.wanted.most || pilot.refiner.active.is_empty();
            if let Some(found) = pilot.rule(allowed, last) {
                let found = StoppingRule { power: pilot.convergence, ..found };
                return Ok((pilot.refiner, found));
            }
            pilot.drop_settled();
        }
    }

    /// The largest difference between two values of the lattices or the probes, over all planes.
    fn range(&self, probes: &Probes) -> f32 {
        let none = Vec::new();
        let seen = probes.values.iter().chain(std::iter::repeat(&none));
        let planes = self.values.iter().zip(seen).zip(self.weights.iter());
        let size = |((plane, seen), weight): ((&Vec<f32>, &Vec<f32>), f32)| {
            let finite = plane.iter().chain(seen).copied().filter(|x| x.is_finite());
            let ends = (f32::INFINITY, f32::NEG_INFINITY);
            let (low, high) = finite.fold(ends, |(low, high), x| (low.min(x), high.max(x)));
            weighted((high - low).max(0.0), weight)
        };
        planes.map(size).fold(0.0, f32::max)
    }
}

struct Pilot<'a> {
    refiner: Refiner<'a>,
    /// For each pixel, the curvature of the coarsest lattice around it.
    guards: Vec<f32>,
    rounds: Vec<Round>,
    bound: f32,
    /// The rate at which squared errors fall, as a power of the number of samples: 1 if samples are no better
    /// than independent ones, 3 if the shader is smooth.
    convergence: f32,
    /// Minimum samples per pixel: enough to hit any feature large enough to change the pixel by the bound.
    min_samples: u32,
}

/// The pixels after some samples.
struct Round {
    samples: u32,
    /// For each pixel; below every limit if it was finished before this round.
    estimates: Vec<f32>,
    /// For each plane, the values of the pixels.
    values: Vec<Vec<f32>>,
    /// How far the pixels moved in this round, the largest over the planes.
    moves: Vec<f32>,
}

impl<'a> Pilot<'a> {
    fn new(work: &Work<'_, 'a>, (curvatures, range): (&Curvatures, f32), pixels: Vec<u32>) -> Pilot<'a> {
        let guards = work.guards(curvatures, &pixels);
        let (times, [least, most]) = MIN_SAMPLES;
        let min_samples = (times * range / work.wanted.error).clamp(least, most) as u32;
        Pilot {
            refiner: Refiner::new(&work.sampled, pixels).with(&work.weights),
            guards,
            rounds: Vec::new(),
            bound: work.wanted.error,
            convergence: 1.0,
            min_samples: min_samples.next_power_of_two(),
        }
    }

    /// Doubles the samples of the active pixels, and records the estimates and the values.
    fn double(&mut self) -> Result<(), RunError> {
        let samples = 2 * self.refiner.samples.max(1);
        self.refiner.round(samples, true)?;
        let mut estimates = vec![f32::NEG_INFINITY; self.guards.len()];
        for slot in &self.refiner.active {
            let [error, moved] = [self.refiner.error(*slot), self.refiner.moved[*slot]];
            estimates[*slot] = estimate(error, moved, self.guards[*slot], samples);
        }
        let values = self.refiner.means();
        let moves = self.rounds.last().map_or_else(Vec::new, |last| self.moves(&last.values, &values));
        self.rounds.push(Round { samples, estimates, values, moves });
        self.convergence = self.measured_convergence();
        Ok(())
    }

    /// How to sample the other pixels, or `None` if the pilot needs more samples to decide. After the `last`
    /// round the best result so far is returned. `allowed` is the share of the pixels with samples that may
    /// exceed the bound.
    fn rule(&self, allowed: f32, last: bool) -> Option<StoppingRule> {
        let count = self.guards.len() as f32;
        let allowed = allowed * count;
        let (judge, rounds) = self.rounds.split_last()?;
        if last {
            // Pixels that exceed the bound with all their samples do not make the others dearer.
            let rungs: Vec<Rung> = rounds.iter().map(|round| self.rung(round, judge)).collect();
            let never = rungs.last().map_or(0, |rung| rung.failed(self.bound));
            let found = fit(&rungs, self.bound, allowed.max(never as f32));
            return Some(StoppingRule { short: found.failed as f32 > allowed, ..found });
        }
        // Samples that converge no faster than independent ones indicate edges, which so few samples can
        // miss.
        if judge.samples < self.min_samples && self.convergence < EDGES {
            return None;
        }
        let nearly = allowed.max(NEARLY * count);
        let is_enough = |rung: &Rung| rung.failed(CLOSE * self.bound) as f32 <= nearly;
        let newest = Some(self.rung(rounds.last()?, judge)).filter(is_enough)?;
        let mut rungs: Vec<Rung> =
            rounds[..rounds.len() - 1].iter().map(|round| self.rung(round, judge)).collect();
        rungs.push(newest);
        let found = fit(&rungs, CLOSE * self.bound, allowed);
        if found.failed as f32 <= allowed {
            return Some(found);
        }
        rungs.push(self.predicted(rungs.last()?, judge));
        let found = fit(&rungs, CLOSE * self.bound, allowed);
        (found.failed as f32 <= allowed).then_some(found)
    }

    /// Predicts the errors with all samples from those with half of them.
    fn predicted(&self, before: &Rung, last: &Round) -> Rung {
        let less = f_powf(0.5, 0.5 * self.convergence);
        let tried = before.tried.iter().zip(&last.estimates).map(|((_, error), e)| (*e, less * error));
        Rung::new(last.samples, tried.collect())
    }

    /// A number of samples, judged by the last.
    fn rung(&self, round: &Round, last: &Round) -> Rung {
        // The reference contains these samples, so the true difference is larger.
        let error = |(moved, all): (f32, &u32)| match *all <= round.samples {
            true => 0.0,
            false => moved / seen_share(round.samples, *all, self.convergence),
        };
        let errors = self.moves(&round.values, &last.values).into_iter().zip(&self.refiner.each).map(error);
        Rung::new(round.samples, round.estimates.iter().copied().zip(errors).collect())
    }

    /// How far the pixels moved between two rounds with these values, the largest over the planes.
    fn moves(&self, from: &[Vec<f32>], to: &[Vec<f32>]) -> Vec<f32> {
        let mut moves = vec![0.0_f32; self.guards.len()];
        for ((from, to), weight) in from.iter().zip(to).zip(self.refiner.weights.iter()) {
            for (moved, (a, b)) in moves.iter_mut().zip(from.iter().zip(to)) {
                *moved = moved.max(weighted(distance(*a, *b), weight));
            }
        }
        moves
    }

    /// The rate at which squared errors fall, measured by how much less the last samples moved the pixels
    /// than the samples before, at the 95th percentile of the changes.
    fn measured_convergence(&self) -> f32 {
        let [.., _, second, third] = &self.rounds[..] else { return 1.0 };
        let large = |round: &Round| {
            let mut moves: Vec<f32> = self.refiner.active.iter().map(|slot| round.moves[*slot]).collect();
            let at = moves.len() * 19 / 20;
            if at >= moves.len() { 0.0 } else { *moves.select_nth_unstable_by(at, f32::total_cmp).1 }
        };
        let ratio = large(second) / large(third);
        if ratio.is_finite() { (2.0 * f_log2f(ratio)).clamp(1.0, 3.0) } else { 1.0 }
    }

    /// Drops pixels for which further samples would show nothing new.
    fn drop_settled(&mut self) {
        let [.., _, last] = &self.rounds[..] else { return };
        let (enough, min_samples, samples) = (0.2 * self.bound, self.min_samples, last.samples);
        let small = |slot: usize| last.estimates[slot] <= enough && last.moves[slot] <= enough;
        self.refiner.settle(|slot, _| samples >= min_samples && small(slot));
    }
}

/// The part of the error of some samples that shows in their distance from the mean of all, which contains
/// them. `power` is the rate at which squared errors fall.
fn seen_share(samples: u32, all: u32, power: f32) -> f32 {
    (1.0 - f_powf(samples as f32 / all as f32, power)).sqrt()
}

/// The estimated error of a pixel: its standard error combined with the change by the later half of its
/// samples, and at least the lattice's curvature divided by the number of samples, for features that may hide
/// between samples.
pub(super) fn estimate(error: f32, moved: f32, curvature: f32, samples: u32) -> f32 {
    let [error, moved] = [error, moved].map(f64::from);
    let error = (error * error + moved * moved).sqrt() as f32;
    if curvature.is_finite() { error.max(curvature / samples as f32) } else { error }
}
