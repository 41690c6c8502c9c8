//! The coordinate and the width of a pixel as the written shader sees them: measured by a source whose body
//! only gives them to further outputs.
//!
//! This module must not know levels.

use super::frame::Frame;
use super::inputs::Inputs;
use super::judge::{Judge, Set, Truth, Variant};
use super::{Build, Stop, write};
use crate::sample::{Pattern, some_pixels};
use crate::stability::fix::source::Source;
use osl_exec::RunError;

/// A program that gives the coordinate.
pub(super) struct Place {
    variant: Variant,
    /// The components of the coordinate as expressions, and then the width of a pixel.
    pub(super) columns: Vec<String>,
    /// The plane of each.
    planes: Vec<usize>,
}

/// Pixels from which the width of a pixel is taken.
const PIXELS: usize = 256;

impl Place {
    /// Builds the program.
    pub(super) fn of(
        (source, frame, inputs): (&Source<'_>, &Frame, &Inputs),
        judge: &Judge<'_>,
        build: &Build<'_>,
    ) -> Result<Place, Stop> {
        Place::built((source, frame, inputs), judge, build).ok_or_else(refused)
    }

    fn built(
        (source, frame, inputs): (&Source<'_>, &Frame, &Inputs),
        judge: &Judge<'_>,
        build: &Build<'_>,
    ) -> Option<Place> {
        let (text, outputs) = write::probe(source, frame, inputs)?;
        let variant = judge.variant(build(&text)?.plain);
        let ground = judge.ground(1.0, Set::Fitted);
        let shading = judge.shading(&variant, &ground, &Pattern::new(1, judge.seed));
        let all = shading.planes();
        let plane = |name: &String| all.iter().position(|plane| *plane.output == **name);
        let planes: Option<Vec<usize>> = outputs.iter().map(plane).collect();
        Some(Place { planes: planes?, columns: write::columns(source, inputs), variant })
    }

    /// The width of a pixel at footprint 1.
    pub(super) fn width(&self, judge: &Judge<'_>) -> Result<f64, Stop> {
        let ground = judge.ground(1.0, Set::Fitted);
        let shading = judge.shading(&self.variant, &ground, &Pattern::new(1, judge.seed));
        let pixels = some_pixels(judge.grid.width * judge.grid.height, PIXELS, judge.seed);
        let values = shading.chosen(&pixels, 1)?;
        let plane = self.planes.last().and_then(|plane| values.get(*plane));
        let mut widths = plane.cloned().unwrap_or_default();
        widths.sort_by(f32::total_cmp);
        let middle = widths.get(widths.len() / 2).copied().map_or(0.0, f64::from);
        (middle > 0.0 && middle.is_finite()).then_some(middle).ok_or_else(refused)
    }

    /// The values of the columns at the centres of the pixels of a reference.
    pub(super) fn at(&self, judge: &Judge<'_>, truth: &Truth) -> Result<Vec<Vec<f32>>, RunError> {
        let mut values = judge.values(&self.variant, truth, 1)?;
        let take = |plane: &usize| values.get_mut(*plane).map(std::mem::take).unwrap_or_default();
        Ok(self.planes.iter().map(take).collect())
    }
}

fn refused() -> Stop {
    Stop::Refused("the width of a pixel in the shader's coordinate is not known".to_string())
}
