//! Images with the same number of samples in every pixel.
//!
//! This module must not know how that number is chosen.

use super::error::Block;
use super::image::{Image, Shading, not_finite};
use osl_exec::{Frame, RunError};
use std::ops::Range;

impl Shading<'_> {
    /// Renders some rows of an image with the same number of samples in each pixel, at most as many as the
    /// pattern has. A single sample lies at the pixel's centre: its values are those of a run without
    /// samples.
    ///
    /// # Errors
    /// A loop exceeds its budget.
    pub fn rows(&self, rows: Range<usize>, samples: u32) -> Result<Image, RunError> {
        let samples = samples.clamp(1, self.pattern.count());
        let pixels = self.pixels(rows);
        let mut image = Image::default();
        let values: Vec<Vec<f32>> = if samples == 1 {
            self.centres(&pixels, &mut image.frame)?
        } else {
            let batch = self.batch(&pixels, 0..samples)?;
            image.frame = batch.said;
            batch.blocks.iter().map(|plane| plane.iter().map(Block::mean).collect()).collect()
        };
        image.tally.pixels = pixels.len() as u64;
        image.tally.evaluations = pixels.len() as u64 * u64::from(samples);
        image.tally.note(samples, pixels.len() as u64);
        image.tally.not_finite = not_finite(&values);
        image.frame.planes = self.filled(values);
        Ok(image)
    }

    /// The values of some pixels with a number of samples, plane by plane.
    ///
    /// # Errors
    /// A loop exceeds its budget.
    pub fn chosen(&self, pixels: &[u32], samples: u32) -> Result<Vec<Vec<f32>>, RunError> {
        let batch = self.batch(pixels, 0..samples.clamp(1, self.pattern.count()))?;
        Ok(batch.blocks.iter().map(|plane| plane.iter().map(Block::mean).collect()).collect())
    }

    /// The values at the centres of pixels, which are numbered row by row: those of an image with one sample.
    ///
    /// # Errors
    /// A loop exceeds its budget.
    pub fn at_centres(&self, pixels: &[u32]) -> Result<Vec<Vec<f32>>, RunError> {
        self.centres(pixels, &mut Frame::default())
    }
}
