//! Where shading points come from, as the interpreter sees it.

use osl_ir::hir::Global;
use osl_ir::ir::Axis;

/// A set of shading points.
pub trait PointSource: Sync {
    /// How many there are.
    fn count(&self) -> usize;

    /// The globals that differ from point to point.
    fn varying(&self) -> &[Global];

    /// The value of a global that all points share; scalars in the first element. Space: common.
    fn uniform(&self, global: Global) -> [f32; 3];

    /// How a global changes from a pixel to its neighbour along an axis; scalars in the first element.
    fn slope(&self, global: Global, axis: Axis) -> [f32; 3];

    /// Writes a varying global for the points from `first` on. **Shape:** `lanes` holds as many arrays of `width`
    /// floats as the global has components. Points past the last repeat the last one.
    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]);
}
