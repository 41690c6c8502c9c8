//! What the pilot teaches: which ways of computing a pixel are to be trusted, and how far.

use super::lattice::{Bends, between};
use super::pilot::Pilot;
use super::{BELOW_FAILED, CLOSE, EVIDENCE, FEW, TRUSTED, Work, above};
use osl_exec::Stop;

/// What the pilot taught: up to which estimates ways of computing a pixel are to be trusted.
#[derive(Debug, Default)]
pub(super) struct Lesson {
    pub(super) coarse: f32,
    /// Every second pixel, and each one's centre; `None` where it does not pay.
    pub(super) fine: Option<f32>,
    pub(super) centre: Option<f32>,
    /// By rounds.
    pub(super) samples: Vec<(u32, f32)>,
}

impl Lesson {
    /// What is trusted without a pilot.
    pub(super) fn untaught(bound: f32) -> Lesson {
        let [lattice, centre, _] = TRUSTED.map(|share| share * bound);
        Lesson { coarse: lattice, fine: Some(lattice), centre: Some(centre), samples: Vec::new() }
    }

    /// What was taught of every second pixel, or of each.
    fn at(&mut self, step: usize) -> &mut Option<f32> {
        if step == 1 { &mut self.centre } else { &mut self.fine }
    }
}

/// Nothing is trusted.
const NEVER: f32 = -1.0;

impl Work<'_, '_> {
    /// Judges the ways of computing a pixel by the pilot.
    pub(super) fn learn(&mut self, truth: &Pilot, bends: &Bends) -> Result<Lesson, Stop> {
        let mut lesson = Lesson::default();
        let mut left: Vec<usize> = (0..truth.pixels.len()).collect();
        let pixel = |slot: &usize| truth.pixels[*slot] as usize;
        let tried: Vec<Tried> = left
            .iter()
            .map(|slot| {
                (bends.at(pixel(slot)), truth.distance(*slot, |plane| self.values[plane][pixel(slot)]))
            })
            .collect();
        let [lattice, centre, samples] = TRUSTED;
        (lesson.coarse, left) = trust(&tried, &left, self.wanted.error, lattice);
        for step in [2, 1] {
            // Of few pixels there is little to learn: these ways are then as good as their estimates.
            if left.len() < FEW {
                let most = if step == 1 { centre } else { lattice } * self.wanted.error;
                *lesson.at(step) = Some(most);
                continue;
            }
            let tried = self.try_step(step, truth, &left)?;
            let most = if step == 1 { centre } else { lattice };
            let (limit, rest) = trust(&tried, &left, self.wanted.error, most);
            // A lattice that rejects most pixels costs more than it saves.
            let pays = (left.len() - rest.len()) * [0, 5, 4][step] > left.len();
            if pays {
                *lesson.at(step) = Some(limit);
                left = rest;
            }
        }
        for round in &truth.rounds {
            if left.len() < FEW {
                break;
            }
            let tried: Vec<Tried> =
                left.iter().map(|slot| round.tried(truth, *slot, bends.at(pixel(slot)))).collect();
            let (limit, rest) = trust(&tried, &left, self.wanted.error, samples);
            lesson.samples.push((round.samples, limit));
            left = rest;
        }
        Ok(lesson)
    }

    /// Tries a finer lattice around pixels of the pilot, without keeping it: neighbours are to be left as they are.
    fn try_step(&mut self, step: usize, truth: &Pilot, slots: &[usize]) -> Result<Vec<Tried>, Stop> {
        let width = self.width;
        let place = |slot: &usize| {
            let pixel = truth.pixels[*slot] as usize;
            [pixel % width, pixel / width]
        };
        let mut needed: Vec<u32> = slots.iter().flat_map(|slot| self.around(place(slot), step)).collect();
        needed.sort_unstable();
        needed.dedup();
        let (known, values) = (self.known.clone(), self.values.clone());
        self.centres(needed)?;
        let tried = slots
            .iter()
            .map(|slot| {
                let pixel = truth.pixels[*slot] as usize;
                let (x, y) = (pixel % width, pixel / width);
                let bend = self.bend([x, y], step);
                let cell = self.cell(x, y, step);
                let distance = truth.distance(*slot, |plane| match step {
                    1 => self.values[plane][pixel],
                    _ => between(&self.values[plane], width, cell, [x, y]),
                });
                (bend, distance)
            })
            .collect();
        (self.known, self.values) = (known, values);
        Ok(tried)
    }
}

/// An estimate of an error, and the error.
pub(super) type Tried = (f32, f32);

/// Up to which estimate a way of computing pixels is to be trusted, and the pixels that are left for the next one.
fn trust(tried: &[Tried], slots: &[usize], bound: f32, most: f32) -> (f32, Vec<usize>) {
    let failed = |(_, error): &&Tried| above(*error, CLOSE * bound);
    let best_failed = tried.iter().filter(failed).map(|(e, _)| *e).fold(f32::INFINITY, f32::min);
    if best_failed <= 0.0 {
        return (NEVER, slots.to_vec());
    }
    let safe = BELOW_FAILED * best_failed;
    let beyond = tried.iter().map(|(e, _)| *e).filter(|e| e.is_finite() && (most * bound..=safe).contains(e));
    let (count, furthest) = beyond.fold((0, most * bound), |(n, far), e| (n + 1, far.max(e)));
    let limit = if count >= EVIDENCE { furthest } else { safe.min(most * bound) };
    let rest: Vec<usize> =
        slots.iter().zip(tried).filter(|(_, (e, _))| above(*e, limit)).map(|(slot, _)| *slot).collect();
    if slots.len() - rest.len() < FEW { (NEVER, slots.to_vec()) } else { (limit, rest) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trust_ends_below_the_best_pixel_that_failed() {
        let slots: Vec<usize> = (0..40).collect();
        let all = |estimate: f32| (0..40).map(|i| (estimate + 0.01 * i as f32, 0.1)).collect::<Vec<Tried>>();
        let mut tried = all(0.1);
        tried[30].1 = 2.0;
        let (limit, rest) = trust(&tried, &slots, 1.0, 1.0);
        assert!((limit - 0.32).abs() < 1e-6, "four fifths of 0.4: {limit}");
        assert_eq!(rest, slots[23..]);
        let (limit, rest) = trust(&all(0.1), &slots, 1.0, 0.3);
        assert_eq!((limit, rest.len()), (0.3, 19), "never beyond what is trusted anyway");
        tried[0] = (0.0, 5.0);
        let (limit, rest) = trust(&tried, &slots, 1.0, 1.0);
        assert_eq!((limit, rest.len()), (NEVER, 40), "an estimate of 0 that fails is worth nothing");
        let mut lucky = all(0.1);
        lucky.iter_mut().skip(10).for_each(|one| one.1 = 2.0);
        assert_eq!(trust(&lucky, &slots, 1.0, 1.0).0, NEVER, "a few that did not fail are no evidence");
    }
}
