//! One lattice for all pixels. Most images need the same method almost everywhere; then it is quicker to
//! compute a whole lattice at once than to decide for each cell, and probes alone show whether it is right.

use super::policy::{
    ALLOWED, COARSE, FIRST_TRIALS, HOPELESS, PROBE_WHOLE, SMALL_IMAGE, SPIKE, SPIKES, SPIKES_BELOW,
    SURE_PROBES, TRIED,
};
use super::probe::Probes;
use super::{LatticeOutcome, Work, above, probes_of, trials};
use crate::sample::weights::weighted;
use osl_exec::RunError;

/// A lattice that was computed for all pixels, and how many of them may exceed the bound.
pub(super) struct Whole {
    pub(super) step: usize,
    pub(super) found: LatticeOutcome,
}

impl Work<'_, '_> {
    /// Computes the coarsest lattice that is right around a few of the pending probes, if there is one, and
    /// settles the pixels for which it is good enough.
    pub(super) fn uniform(
        &mut self,
        probes: &mut Probes,
        pending: &mut [bool],
    ) -> Result<Option<Whole>, RunError> {
        let some = trials(&probes.open(pending));
        for step in [2, 1] {
            let is_right = self.few_fail(&some, |work, part| {
                let tried = work.try_at(probes, part, step)?;
                let failed = tried.iter().filter(|(_, own)| work.is_wrong(own)).count();
                // Where edges lie on the borders of pixels, their centres are right.
                Ok(if step == 1 { failed.min(work.uneven(probes, part)) } else { failed })
            })?;
            if is_right {
                return Ok(Some(self.settle_whole(step, probes, pending)?));
            }
        }
        Ok(None)
    }

    /// Whether at most `TRIED` of some trials fail. A few are made first, because a lattice that is not right
    /// mostly fails at many; they are judged again with the others. `failed` makes some trials, and counts
    /// those that fail.
    fn few_fail(
        &mut self,
        some: &[usize],
        mut failed: impl FnMut(&mut Self, &[usize]) -> Result<usize, RunError>,
    ) -> Result<bool, RunError> {
        let (one_in, most) = FIRST_TRIALS;
        let first: Vec<usize> = some.iter().copied().step_by(one_in).collect();
        Ok(failed(self, &first)? <= most && failed(self, some)? <= TRIED)
    }

    /// Computes a whole lattice and settles the pixels for which it is good enough.
    fn settle_whole(
        &mut self,
        step: usize,
        probes: &mut Probes,
        pending: &mut [bool],
    ) -> Result<Whole, RunError> {
        if step > 1 {
            self.whole(step)?;
        }
        pending.fill(true);
        let count = pending.len();
        let wanted = probes_of(count, PROBE_WHOLE, if step == 1 { SURE_PROBES } else { 0 });
        self.probe(probes, wanted.saturating_sub(probes.count()))?;
        if step > 1 {
            return Ok(Whole { step, found: self.settle_one(step, probes, pending, 0.0)? });
        }
        // So many random pixels show a share of one in a thousand by themselves. Their own centre decides, or
        // the parabola through its neighbours. Where edges lie on the borders of pixels, the first is right.
        let all: Vec<usize> = (0..probes.count()).collect();
        let spare = ALLOWED * all.len() as f32;
        let found = |failed: f32| {
            let off = failed * count as f32 / all.len().max(1) as f32;
            Whole { step, found: LatticeOutcome { off, ..LatticeOutcome::default() } }
        };
        if let Some(failed) = self.columns_do(probes, &all, spare)? {
            pending.fill(false);
            return Ok(found(failed));
        }
        self.whole(step)?;
        let mut failed = f32::INFINITY;
        if self.failures(probes, &trials(&all), step)?.0 <= HOPELESS {
            failed = self.failures(probes, &all, step)?.1;
        }
        if failed > spare {
            failed = self.uneven(probes, &all) as f32;
        }
        if failed <= spare {
            pending.fill(false);
            return Ok(found(failed));
        }
        Ok(Whole { step, found: self.settle_one(step, probes, pending, 0.0)? })
    }

    /// How many probes those stand for at which every second column is not enough, if these are few. The
    /// image with the others interpolated is judged as if it were the lattice of all pixels, by a few of the
    /// probes first. Nothing is lost if it is not enough, because then the columns belong to that lattice.
    fn columns_do(&mut self, probes: &Probes, all: &[usize], spare: f32) -> Result<Option<f32>, RunError> {
        let is_right = self.few_fail(&trials(all), |work, part| {
            let pixels: Vec<usize> = part.iter().map(|slot| probes.pixels[*slot] as usize).collect();
            work.between_columns(&pixels)?;
            Ok(work.failures(probes, part, 1)?.0)
        })?;
        if !is_right {
            return Ok(None);
        }
        self.columns()?;
        let (_, failed) = self.failures(probes, all, 1)?;
        Ok((failed <= spare).then_some(failed))
    }

    /// The number of probes at which a lattice is wrong, and how many probes these stand for.
    fn failures(&mut self, probes: &Probes, slots: &[usize], step: usize) -> Result<(usize, f32), RunError> {
        let errors = self.errors(probes, slots, step)?;
        let failed = errors.iter().filter(|own| self.is_wrong(own));
        Ok(failed.fold((0, 0.0), |(count, sum), own| (count + 1, sum + own.stands_for)))
    }

    /// Whether the coarsest lattice hit so many features of about a pixel that it missed too many others.
    /// Larger images do not ask, and small ones neither: there, probes show it.
    pub(super) fn has_spikes(&mut self) -> Result<bool, RunError> {
        let (width, height) = (self.width, self.height);
        if !(SMALL_IMAGE..SPIKES_BELOW).contains(&(width * height)) {
            return Ok(false);
        }
        let inner = |size: usize| (COARSE..size.saturating_sub(COARSE)).step_by(COARSE);
        let all = || inner(height).flat_map(move |y| inner(width).map(move |x| y * width + x));
        let [far, near] = SPIKE.map(|times| times * self.wanted.error);
        let stands_out = |work: &Self, at: usize, step: usize, near: f32| {
            let mut planes = work.values.iter().zip(work.weights.iter());
            planes.any(|(plane, weight)| {
                let beside = [at - step, at + step, at - step * width, at + step * width].map(|at| plane[at]);
                let mean = 0.25 * beside.iter().sum::<f32>();
                let apart = |x: f32| weighted((x - mean).abs(), weight);
                above(apart(plane[at]), far) && beside.iter().all(|x| apart(*x) <= near)
            })
        };
        let found: Vec<usize> = all().filter(|at| stands_out(self, *at, COARSE, near)).collect();
        if found.is_empty() {
            return Ok(false);
        }
        let some: Vec<usize> = found.iter().copied().step_by(found.len().div_ceil(SPIKES).max(1)).collect();
        let mut needed = vec![false; width * height];
        some.iter()
            .for_each(|at| [at - 1, at + 1, at - width, at + width].iter().for_each(|at| needed[*at] = true));
        self.centres(&needed)?;
        let spikes = some.iter().filter(|at| stands_out(self, **at, 1, f32::INFINITY)).count();
        let share = (found.len() * spikes) as f32 / some.len().max(1) as f32;
        Ok(spikes > 1 && share > ALLOWED * all().count() as f32)
    }
}
