//! The pilot: some of the pixels that need samples are sampled first, with twice as many samples as the
//! others will have. Each sample count is judged by twice as many samples, so the cost of judging is
//! proportional to the cost of the image.

use super::Work;
use super::curvature::Curvatures;
use super::learn::{Rung, Steps, clairvoyant, fixed, order, steps};
use super::policy::*;
use super::probe::{Probes, distance};
use crate::sample::adapt::Refiner;
use crate::sample::oracle::some_pixels;
use crate::sample::weights::weighted;
use osl_exec::RunError;
use pxfm::{f_log2f, f_powf};
use rayon::prelude::*;
use std::sync::Arc;

impl<'a> Work<'_, 'a> {
    /// Chooses the pilot pixels and samples them until they show how to sample the others. `allowed` is the
    /// share of the pixels that may exceed the bound.
    pub(super) fn pilot(
        &mut self,
        (curvatures, probes): (&Curvatures, &Probes),
        pixels: &[u32],
        allowed: f32,
    ) -> Result<(Refiner<'a>, Steps), RunError> {
        let (of_all, of_these, fewest) = PILOT;
        let (of_small, some) = SMALL_PILOT;
        let all = self.known.len();
        let (of_small, of_these) = if all < SMALL_IMAGE { (1, 1) } else { (of_small, of_these) };
        let wanted = (all / of_all).max((all / of_small).min(some)).min(LARGEST_PILOT);
        let wanted = wanted.min(pixels.len() / of_these).max(fewest);
        let seed = self.first ^ 0x2b07;
        let chosen = some_pixels(pixels.len(), wanted, seed).iter().map(|at| pixels[*at as usize]).collect();
        let mut pilot = Pilot::new(self, (curvatures, self.range(probes)), chosen);
        let of = [pixels.len() as f32, self.known.len() as f32];
        pilot.take(pilot.first)?;
        loop {
            pilot.double()?;
            let last = pilot.refiner.samples > self.wanted.most || pilot.refiner.active.is_empty();
            if let Some(found) = pilot.lesson(allowed, of, last) {
                let found = Steps { power: pilot.convergence, ..found };
                return Ok((pilot.refiner, found));
            }
            pilot.drop_settled();
        }
    }

    /// The largest difference between two values of the lattices or the probes, over all planes.
    fn range(&self, probes: &Probes) -> f32 {
        let none = Vec::new();
        let seen = probes.values.iter().chain(std::iter::repeat(&none));
        let size = |plane: &[f32], seen: &[f32]| {
            let [[low, high], [lowest, highest]] = [plane, seen].map(ends);
            (high.max(highest) - low.min(lowest)).max(0.0)
        };
        let planes = self.values.iter().zip(seen).zip(self.weights.iter());
        planes.map(|((plane, seen), weight)| weighted(size(plane, seen), weight)).fold(0.0, f32::max)
    }
}

/// The smallest and the largest finite value.
fn ends(values: &[f32]) -> [f32; 2] {
    // In several lanes, so that the compiler puts them into vectors.
    let (chunks, rest) = values.as_chunks::<LANES>();
    let mut last = [f32::NAN; LANES];
    last.iter_mut().zip(rest).for_each(|(last, x)| *last = *x);
    let none = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    let (low, high) = chunks.iter().chain([&last]).fold(none, |(mut low, mut high), chunk| {
        for lane in 0..LANES {
            let x = chunk[lane];
            let x = if x.abs() < f32::INFINITY { x } else { f32::NAN };
            low[lane] = if x < low[lane] { x } else { low[lane] };
            high[lane] = if x > high[lane] { x } else { high[lane] };
        }
        (low, high)
    });
    [low.into_iter().fold(f32::INFINITY, f32::min), high.into_iter().fold(f32::NEG_INFINITY, f32::max)]
}

/// Values that are compared at a time.
const LANES: usize = 8;

struct Pilot<'a> {
    refiner: Refiner<'a>,
    /// For each pixel, the curvature of the coarsest lattice around it.
    guards: Vec<f32>,
    rounds: Vec<Round>,
    bound: f32,
    /// The time of estimating a pixel's error, in evaluations.
    estimating: f64,
    /// The smallest number of samples that is tried.
    first: u32,
    /// The rate at which squared errors fall, as a power of the sample count: 1 if samples are no better than
    /// independent ones, 3 if the shader is smooth.
    convergence: f32,
    /// A factor on the largest changes of pixels by the last doubling, as a share of their errors before,
    /// which are smaller than the convergence says where edges lie along the sides of the pixels.
    tail: f32,
    /// Minimum samples per pixel: enough to hit any feature large enough to change the pixel by the bound.
    min_samples: u32,
}

/// The pixels after some samples.
struct Round {
    samples: u32,
    /// For each pixel; NaN if it was finished before this round.
    estimates: Vec<f32>,
    /// The pixels in the order of their estimates.
    order: Arc<[(f32, u32)]>,
    /// For each plane, the values of the pixels.
    values: Vec<Vec<f32>>,
    /// How far the pixels moved in this round, the largest over the planes.
    moves: Vec<f32>,
}

impl<'a> Pilot<'a> {
    fn new(work: &Work<'_, 'a>, (curvatures, range): (&Curvatures, f32), pixels: Vec<u32>) -> Pilot<'a> {
        let guards = work.guards(curvatures, &pixels);
        let (times, fewest, most) = MIN_SAMPLES;
        let min_samples = (times * range / work.wanted.error).clamp(fewest, most) as u32;
        Pilot {
            refiner: Refiner::new(&work.sampled, pixels).with(&work.weights),
            guards,
            rounds: Vec::new(),
            bound: work.wanted.error,
            estimating: work.estimating,
            first: if work.estimating < DEAR_ESTIMATE { 2 } else { 4 },
            convergence: SLOWEST,
            tail: 1.0,
            min_samples: min_samples.next_power_of_two(),
        }
    }

    fn double(&mut self) -> Result<(), RunError> {
        self.take(2 * self.refiner.samples)
    }

    /// Brings the active pixels to a number of samples, and records the estimates and the values.
    fn take(&mut self, samples: u32) -> Result<(), RunError> {
        self.refiner.round(samples, true)?;
        let mut estimates = vec![f32::NAN; self.guards.len()];
        for slot in &self.refiner.active {
            let [error, moved] = [self.refiner.error(*slot), self.refiner.moved[*slot]];
            estimates[*slot] = estimate(error, moved, self.guards[*slot], samples);
        }
        let values = || {
            let values = self.refiner.means();
            let moves = self.rounds.last().map_or_else(Vec::new, |last| self.moves(&last.values, &values));
            (values, moves)
        };
        let (order, (values, moves)) = rayon::join(|| order(&estimates), values);
        self.rounds.push(Round { samples, estimates, order, values, moves });
        self.convergence = self.measured_convergence();
        self.tail = self.measured_tail();
        Ok(())
    }

    /// The sample count before the last, if it may have been enough, so that it is worth looking closer.
    fn nearly_enough(&self, allowed: f32) -> Option<Rung> {
        let [.., before, last] = &self.rounds[..] else { return None };
        // Samples that converge no faster than independent ones indicate edges, which so few samples can
        // miss.
        if self.refiner.samples < self.min_samples && self.convergence < EDGES {
            return None;
        }
        let most = (NEARLY * self.guards.len() as f32).max(allowed);
        Some(self.rung(before, last)).filter(|rung| rung.failed(BOLD * self.bound) <= most)
    }

    /// How to sample the other pixels, or `None` if the pilot needs more samples to decide. After the `last`
    /// round the best result so far is returned. `allowed` is the share of the pixels with samples that may
    /// exceed the bound; `pixels` of `all` pixels need samples.
    fn lesson(&self, allowed: f32, [pixels, all]: [f32; 2], last: bool) -> Option<Steps> {
        let count = self.guards.len() as f32;
        let allowed = allowed * count;
        let newest = if last { None } else { Some(self.nearly_enough(allowed * SCALED)?) };
        let mut rungs = self.rungs(newest);
        let affordable = |rungs: &[Rung], steps: &Steps, times: f32| {
            let fixed = fixed(rungs, self.bound, PROMISED as f32 * all / pixels * count);
            let work = steps.work as f32 / count * pixels + times * self.refiner.evaluations as f32;
            fixed.is_some_and(|fixed| work <= THRIFT * fixed as f32 * all)
        };
        // Scaled errors predict failures more precisely than counting does.
        let allowed = if rungs.iter().all(Rung::is_scaled) { SCALED * allowed } else { allowed };
        if let Some(samples) = fixed(&rungs, BOLD * self.bound, allowed) {
            let [work, rounds] = clairvoyant(&rungs, BOLD * self.bound);
            let all = f64::from(samples) * f64::from(count);
            if !last && LEARNED * work + self.estimating * rounds >= all && all <= DEARER * LEARNED * work {
                let limits = vec![(samples, f32::INFINITY)];
                return Some(Steps { limits, work: all, rounds: f64::from(count), ..Steps::default() });
            }
        }
        if count < MANY_PIXELS && !last {
            // Few pixels cannot distinguish one failure from three, so limits from them are stricter.
            let [bold, share] = SMALL;
            let found = self.steps(&rungs, bold, share * allowed);
            if found.failed <= share * allowed {
                return Some(self.plain(found, &rungs, allowed));
            }
        }
        if last {
            // Pixels that exceed the bound with all their samples do not make the others dearer.
            let never = rungs.last().map_or(0.0, |rung| rung.failed(self.bound));
            let few = if never <= ALLOWED_OF_FEW * count { UNAVOIDABLE * never } else { 0.0 };
            let found = self.steps(&rungs, 1.0, allowed.max(few));
            return Some(Steps { short: found.failed > allowed, ..found });
        }
        let found = self.steps(&rungs, BOLD, allowed);
        if found.failed > allowed {
            rungs.push(self.next(&rungs)?);
            let found = self.steps(&rungs, BOLD, allowed);
            let is_good = found.failed <= allowed && !affordable(&rungs, &found, 2.0);
            return is_good.then(|| self.plain(found, &rungs, allowed));
        }
        // If adaptive sampling saves much, a stricter threshold is affordable.
        let care = CARE * allowed;
        let careful = self.steps(&rungs, CAREFUL, care);
        if careful.failed <= care {
            let is_affordable = affordable(&rungs, &careful, 1.0);
            return Some(if is_affordable { careful } else { self.plain(found, &rungs, allowed) });
        }
        (!affordable(&rungs, &careful, 2.0)).then(|| self.plain(found, &rungs, allowed))
    }

    /// The cheapest limits at which few enough pixels exceed a share of the bound.
    fn steps(&self, rungs: &[Rung], share: f32, allowed: f32) -> Steps {
        steps(rungs, (share * self.bound, allowed), self.estimating as f32)
    }

    /// The same number of samples for all pixels, if limits do not save the time that estimates take.
    fn plain(&self, found: Steps, rungs: &[Rung], allowed: f32) -> Steps {
        let Some(samples) = fixed(rungs, BOLD * self.bound, allowed) else { return found };
        let work = f64::from(samples) * self.guards.len() as f64;
        if found.work + self.estimating * found.rounds < work || work > DEARER * found.work {
            return found;
        }
        Steps { limits: vec![(samples, f32::INFINITY)], work, ..found }
    }

    /// Predicts a sample count that was not tried from the one before, if that was nearly good enough.
    fn next(&self, rungs: &[Rung]) -> Option<Rung> {
        let before = rungs.last()?;
        let less = f_powf(0.5, 0.5 * self.convergence);
        let last = self.rounds.last()?;
        let tried =
            before.tried.iter().zip(&last.estimates).map(|((_, error), e)| (*e, less * error)).collect();
        Some(Rung::new(last.samples, tried, last.order.clone(), self.bound))
    }

    /// The estimated and actual errors of each sample count except the last, judged by the last. The newest
    /// of them may be known.
    fn rungs(&self, newest: Option<Rung>) -> Vec<Rung> {
        let Some((last, rounds)) = self.rounds.split_last() else { return Vec::new() };
        let unknown = rounds.len() - usize::from(newest.is_some());
        let mut rungs: Vec<Rung> = rounds[..unknown].par_iter().map(|round| self.rung(round, last)).collect();
        rungs.extend(newest);
        rungs
    }

    /// A sample count, judged by the last.
    fn rung(&self, round: &Round, last: &Round) -> Rung {
        let power = self.convergence;
        // The reference contains these samples, so the true difference is larger.
        let seen = |all: u32| {
            let tail = if all == 2 * round.samples { self.tail } else { 1.0 };
            tail * seen_share(round.samples, all, power)
        };
        let known: Vec<(u32, f32)> = self.rounds.iter().map(|r| (r.samples, seen(r.samples))).collect();
        let error = |(moved, all): (f32, &u32)| {
            if *all <= round.samples {
                return 0.0;
            }
            let known = known.iter().find(|(samples, _)| samples == all);
            moved / known.map_or_else(|| seen(*all), |(_, seen)| *seen)
        };
        let errors = self.moves(&round.values, &last.values).into_iter().zip(&self.refiner.each).map(error);
        let tried = round.estimates.iter().copied().zip(errors).collect();
        Rung::new(round.samples, tried, round.order.clone(), self.bound)
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
    /// than the samples before.
    fn measured_convergence(&self) -> f32 {
        let [.., _, second, third] = &self.rounds[..] else { return SLOWEST };
        let slots = &self.refiner.active;
        let large = |round: &Round| {
            let mut moves: Vec<f32> = slots.iter().map(|slot| round.moves[*slot]).collect();
            let at = (LARGE * moves.len() as f32) as usize;
            if at >= moves.len() {
                return 0.0;
            }
            *moves.select_nth_unstable_by(at, f32::total_cmp).1
        };
        let ratio = large(second) / large(third);
        if ratio.is_finite() { (2.0 * f_log2f(ratio)).clamp(SLOWEST, FASTEST) } else { SLOWEST }
    }

    /// How much less of the largest errors the last samples show than [`seen_share`] says. The errors two
    /// rounds ago are seen twice: by as many samples again, and by three times as many.
    fn measured_tail(&self) -> f32 {
        let [.., first, second, third] = &self.rounds[..] else { return 1.0 };
        let count = (self.guards.len() / TAIL).max(FEWEST_IN_TAIL).min(self.guards.len());
        let large = |mut moves: Vec<f32>| {
            moves.retain(|x| x.is_finite());
            if moves.len() > count {
                moves.select_nth_unstable_by(count, |a, b| b.total_cmp(a));
                moves.truncate(count);
            }
            moves.iter().map(|x| x * x).sum::<f32>()
        };
        let [by_second, by_third] =
            [large(second.moves.clone()), large(self.moves(&first.values, &third.values))];
        let seen = |to: &Round| seen_share(first.samples, to.samples, self.convergence);
        let tail = (by_second / by_third).sqrt() * seen(third) / seen(second);
        if tail.is_finite() { tail.clamp(LEAST_TAIL, 1.0) } else { 1.0 }
    }

    /// Drops pixels for which further samples would show nothing new.
    fn drop_settled(&mut self) {
        let [.., _, last] = &self.rounds[..] else { return };
        let enough = DROPPED * self.bound;
        let min_samples = self.min_samples;
        let small = |slot: usize| last.estimates[slot] <= enough && last.moves[slot] <= enough;
        let samples = last.samples;
        self.refiner.settle(|slot, _| samples >= min_samples && small(slot));
    }
}

/// The part of the error of some samples that shows in their distance from the mean of all, which contains
/// them. `power` is the rate at which squared errors fall.
fn seen_share(samples: u32, all: u32, power: f32) -> f32 {
    (1.0 - f_powf(samples as f32 / all as f32, power)).sqrt()
}

/// The estimated error of a pixel: its standard error combined with the change by the later half of its
/// samples, and at least the lattice's curvature divided by the sample count, for features that may hide
/// between samples.
pub(super) fn estimate(error: f32, moved: f32, curvature: f32, samples: u32) -> f32 {
    let [error, moved] = [error, moved].map(f64::from);
    let error = (error * error + moved * moved).sqrt() as f32;
    if curvature.is_finite() { error.max(curvature / samples as f32) } else { error }
}
