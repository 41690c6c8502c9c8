//! An image that is computed some rows at a time.

use osl_exec::{Frame, Look, Plane, Run, RunError};
use std::ops::Range;

/// An image that is computed some rows at a time, from the first row on.
pub trait Rows {
    /// The planes of its pieces, without values.
    fn planes(&self) -> Result<Vec<Plane>, RunError>;

    /// Checks that the planes of this many points may be in memory.
    fn fits(&self, points: usize) -> Result<(), RunError>;

    /// Its next rows.
    fn rows(&mut self, rows: Range<usize>) -> Result<Frame, RunError>;

    /// Words of memory per word of a piece.
    fn weight(&self) -> usize {
        1
    }

    /// Whether all rows take no more memory together than piece by piece.
    fn is_plain(&self) -> bool {
        false
    }

    /// Computes rows without keeping the values, if it can: `look` gets those of each tile.
    fn look(&mut self, _rows: Range<usize>, _look: &Look<'_>) -> Option<Result<Frame, RunError>> {
        None
    }
}

/// A run with one point per pixel.
pub struct Points<'a, 'b> {
    /// The run.
    pub run: &'a Run<'b>,
    /// Pixels of a row.
    pub width: usize,
    /// Gets the number of points that are done.
    pub progress: &'a (dyn Fn(usize) + Sync),
}

impl Rows for Points<'_, '_> {
    fn planes(&self) -> Result<Vec<Plane>, RunError> {
        self.run.planes()
    }

    fn fits(&self, points: usize) -> Result<(), RunError> {
        self.run.fits(points)
    }

    fn rows(&mut self, rows: Range<usize>) -> Result<Frame, RunError> {
        self.run.points(rows.start * self.width..rows.end * self.width, self.progress)
    }

    fn is_plain(&self) -> bool {
        true
    }

    fn look(&mut self, rows: Range<usize>, look: &Look<'_>) -> Option<Result<Frame, RunError>> {
        Some(self.run.look(rows.start * self.width..rows.end * self.width, self.progress, look))
    }
}
