//! The pilot: some of the pixels that need samples go ahead of the others, with twice as many as these will have. So each
//! number of samples is judged by twice as many, and what the judgement costs is in proportion to what the image does.

use super::learn::{Rung, Steps, fixed, steps};
use super::peek::distance;
use super::{BOLD, CAREFUL, DROPPED, NEARLY, PILOT, PROMISED, THRIFT, WITNESSES, Work};
use crate::sample::adapt::Refiner;
use crate::sample::oracle::some_pixels;
use osl_exec::Stop;
use pxfm::{f_hypotf, f_log2f, f_powf};
use rayon::prelude::*;

impl<'a> Work<'_, 'a> {
    /// Chooses some of the pixels, and samples them until they tell how the others are to be sampled. `allowed` is the share of
    /// them that may be off.
    pub(super) fn pilot(&mut self, pixels: &[u32], allowed: f32) -> Result<(Refiner<'a>, Steps), Stop> {
        let (of_all, of_these, fewest) = PILOT;
        let wanted = (self.known.len() / of_all).min(pixels.len() / of_these).max(fewest);
        let seed = self.first ^ 0x2b07;
        let chosen = some_pixels(pixels.len(), wanted, seed).iter().map(|at| pixels[*at as usize]).collect();
        let mut pilot = Pilot::new(self, chosen);
        let of = [pixels.len() as f32, self.known.len() as f32];
        pilot.double()?;
        loop {
            pilot.double()?;
            let last = pilot.refiner.samples > self.wanted.most || pilot.refiner.active.is_empty();
            if let Some(found) = pilot.lesson(allowed, of, last) {
                return Ok((pilot.refiner, found));
            }
            pilot.drop_settled();
        }
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

/// The slowest and the fastest that squares of errors are taken to fall, as powers of the number of samples.
const SLOWEST: f32 = 1.0;
const FASTEST: f32 = 3.0;
/// How many times more may be off where the sizes of errors tell how many are: counting knows less.
const SCALED: f32 = 1.2;
/// What is slower than this has edges.
const EDGES: f32 = 1.5;
/// Share of the pixels that move less than those that convergence is seen in: the tail is what counts.
const LARGE: f32 = 0.95;

struct Pilot<'a> {
    refiner: Refiner<'a>,
    /// By pixel, what the coarsest lattice says of its surroundings.
    guards: Vec<f32>,
    rounds: Vec<Round>,
    bound: f32,
    /// Samples without which no pixel is done with, as many as would see what covers so much of a pixel that it matters.
    witnesses: u32,
}

/// The pixels after some samples.
struct Round {
    samples: u32,
    /// By pixel; not a number where it has had no more samples than before.
    estimates: Vec<f32>,
    /// For each plane.
    values: Vec<Vec<f32>>,
}

impl<'a> Pilot<'a> {
    fn new(work: &Work<'_, 'a>, pixels: Vec<u32>) -> Pilot<'a> {
        let guards = work.guards(&pixels);
        let (times, fewest, most) = WITNESSES;
        let witnesses = (times * work.range() / work.wanted.error).clamp(fewest, most) as u32;
        Pilot {
            refiner: Refiner::new(&work.sampled, pixels),
            guards,
            rounds: Vec::new(),
            bound: work.wanted.error,
            witnesses: witnesses.next_power_of_two(),
        }
    }

    /// Takes twice as many samples, and notes what they say.
    fn double(&mut self) -> Result<(), Stop> {
        let samples = (2 * self.refiner.samples).max(2);
        self.refiner.round(samples, true)?;
        let mut estimates = vec![f32::NAN; self.guards.len()];
        for slot in &self.refiner.active {
            estimates[*slot] = estimate(&self.refiner, *slot, self.guards[*slot]);
        }
        self.rounds.push(Round { samples, estimates, values: self.refiner.means() });
        Ok(())
    }

    /// How the other pixels are to be sampled, unless more samples are needed to tell; the best if these are the `last`. A share
    /// `allowed` may be off of the pixels that need samples, so many of all.
    fn lesson(&self, allowed: f32, [pixels, all]: [f32; 2], last: bool) -> Option<Steps> {
        let mut rungs = self.rungs();
        let count = self.guards.len() as f32;
        let allowed = allowed * count;
        let affordable = |rungs: &[Rung], steps: &Steps, times: f32| {
            let fixed = fixed(rungs, self.bound, PROMISED * all / pixels * count);
            let work = steps.work as f32 / count * pixels + times * self.refiner.evaluations as f32;
            fixed.is_some_and(|fixed| work <= THRIFT * fixed as f32 * all)
        };
        // More is known then than how many are off.
        let allowed = if rungs.iter().all(Rung::is_scaled) { SCALED * allowed } else { allowed };
        let at_least = rungs.last().map_or(0.0, |rung| rung.failed(BOLD * self.bound));
        if at_least > (NEARLY * count).max(allowed) && !last {
            return None;
        }
        // Where samples are no better than independent there are edges, which as few samples miss.
        if !last && self.refiner.samples < self.witnesses && self.convergence() < EDGES {
            return None;
        }
        let found = steps(&rungs, BOLD * self.bound, allowed);
        if last {
            return Some(Steps { short: found.failed > allowed, ..found });
        }
        if found.failed > allowed {
            rungs.push(self.next(&rungs)?);
            let found = steps(&rungs, BOLD * self.bound, allowed);
            return (found.failed <= allowed && !affordable(&rungs, &found, 2.0)).then_some(found);
        }
        // Who saves can afford to be careful.
        let careful = steps(&rungs, CAREFUL * self.bound, 0.5 * allowed);
        if careful.failed <= 0.5 * allowed {
            return Some(if affordable(&rungs, &careful, 1.0) { careful } else { found });
        }
        (!affordable(&rungs, &careful, 2.0)).then_some(found)
    }

    /// A number of samples that has not been tried, from the one before, if that was all but good enough.
    fn next(&self, rungs: &[Rung]) -> Option<Rung> {
        let before = rungs.last()?;
        let less = f_powf(0.5, 0.5 * self.convergence());
        let last = self.rounds.last()?;
        let tried =
            before.tried.iter().zip(&last.estimates).map(|((_, error), e)| (*e, less * error)).collect();
        Some(Rung::new(last.samples, tried, self.bound))
    }

    /// What is known of each number of samples but the last, by the last.
    fn rungs(&self) -> Vec<Rung> {
        let Some((last, rounds)) = self.rounds.split_last() else { return Vec::new() };
        let power = self.convergence();
        let rung = |round: &Round| {
            let error = |slot: usize| {
                let share = round.samples as f32 / self.refiner.each[slot] as f32;
                // The truth contains these samples; without them it would be further away.
                if share < 1.0 { moved(round, last, slot) / (1.0 - f_powf(share, power)).sqrt() } else { 0.0 }
            };
            let tried = (0..self.guards.len()).map(|slot| (round.estimates[slot], error(slot))).collect();
            Rung::new(round.samples, tried, self.bound)
        };
        rounds.par_iter().map(rung).collect()
    }

    /// How squares of errors fall with the number of samples, as a power of it: 1 where samples are as good as independent, 3
    /// where the shader is smooth. Seen in how much less the last samples moved pixels than those before.
    fn convergence(&self) -> f32 {
        let [.., first, second, third] = &self.rounds[..] else { return SLOWEST };
        let slots = &self.refiner.active;
        let large = |from: &Round, to: &Round| {
            let mut moves: Vec<f32> = slots.iter().map(|slot| moved(from, to, *slot)).collect();
            moves.sort_by(f32::total_cmp);
            moves.get((LARGE * moves.len() as f32) as usize).copied().unwrap_or(0.0)
        };
        let ratio = large(first, second) / large(second, third);
        if ratio.is_finite() { (2.0 * f_log2f(ratio)).clamp(SLOWEST, FASTEST) } else { SLOWEST }
    }

    /// Leaves pixels as they are of which more samples would not say more.
    fn drop_settled(&mut self) {
        let [.., before, last] = &self.rounds[..] else { return };
        let enough = DROPPED * self.bound;
        let witnesses = self.witnesses;
        let small = |slot: usize| last.estimates[slot] <= enough && moved(before, last, slot) <= enough;
        let samples = last.samples;
        self.refiner.settle(|slot, _| samples >= witnesses && small(slot));
    }
}

/// How far a pixel moved from a round to a later one, the most of all planes.
fn moved(from: &Round, to: &Round, slot: usize) -> f32 {
    let far = |(a, b): (&Vec<f32>, &Vec<f32>)| distance(a[slot], b[slot]);
    from.values.iter().zip(&to.values).map(far).fold(0.0, f32::max)
}

/// The error of a pixel with samples: their standard error and how far the later half of them moved it, and an `n`th of what
/// the lattice around it says, for what may hide between them.
pub(super) fn estimate(refiner: &Refiner<'_>, slot: usize, bend: f32) -> f32 {
    let error = f_hypotf(refiner.error(slot), refiner.moved[slot]);
    if bend.is_finite() { error.max(bend / refiner.samples as f32) } else { error }
}
