//! Decides whether samples may be taken in a cheaper arithmetic, by repeating the probes at pending pixels in
//! it.
//!
//! The gain is not measured here, because images must not depend on the clock. The caller offers a cheaper
//! arithmetic only if it expects it to be faster.

use super::Work;
use super::policy::SURE_PROBES;
use super::probe::{Probes, distance};
use crate::sample::error::Block;
use crate::sample::image::{Cheaper, Shading};
use crate::sample::weights::weighted;
use osl_exec::RunError;

impl<'a> Work<'_, 'a> {
    /// Samples pending pixels in the cheaper arithmetic from here on, if there is one and it is accurate
    /// enough. The bound is then reduced by its largest error.
    pub(super) fn choose_arithmetic(&mut self, probes: &Probes, pending: &[bool]) -> Result<(), RunError> {
        let Some(program) = self.shading.cheaper else { return Ok(()) };
        let open = probes.open(pending);
        // With fewer, rare errors would be missed.
        if open.len() < SURE_PROBES / 2 {
            return Ok(());
        }
        let cheaper = Shading { program, cheaper: None, ..self.shading.clone() };
        let [weighty, largest] = self.difference(&cheaper, probes, &open)?;
        if weighty <= 0.02 * self.wanted.error {
            let pixels = pending.iter().filter(|pending| **pending).count() as u64;
            self.chosen = Some(Cheaper { compared: open.len() as u64, largest, pixels });
            self.wanted.error -= weighty;
            self.sampled = cheaper;
        }
        Ok(())
    }

    /// The largest difference between the probes and another way to run the shader: times the factor of its
    /// plane, and in the units of its output.
    fn difference(
        &mut self,
        other: &Shading<'_>,
        probes: &Probes,
        slots: &[usize],
    ) -> Result<[f32; 2], RunError> {
        let pixels: Vec<u32> = slots.iter().map(|slot| probes.pixels[*slot] + self.first).collect();
        let batch = other.batch(&pixels, 0..1)?;
        self.evaluations += pixels.len() as u64;
        let worst = |(values, blocks): (&Vec<f32>, &Vec<Block>)| {
            let one = |(slot, block): (&usize, &Block)| {
                let (value, truth) = (block.mean(), values[*slot]);
                // One is finite and the other is not: no bound holds.
                if value.is_finite() == truth.is_finite() { distance(value, truth) } else { f32::INFINITY }
            };
            slots.iter().zip(blocks).map(one).fold(0.0, f32::max)
        };
        let planes = probes.values.iter().zip(&batch.blocks).map(worst).zip(self.weights.iter());
        Ok(planes.filter(|(_, weight)| *weight > 0.0).fold(
            [0.0, 0.0],
            |[weighty, largest]: [f32; 2], (own, weight)| {
                [weighty.max(weighted(own, weight)), largest.max(own)]
            },
        ))
    }
}
