//! A single point of a source.

use osl_exec::{Datum, PointSource};
use osl_ir::global::Global;
use osl_ir::ir::Axis;

/// One point of a source of points.
#[derive(Clone, Copy)]
pub struct OnePoint<'a> {
    /// All points.
    pub source: &'a dyn PointSource,
    /// The index of the point, in the order in which the source fills.
    pub point: usize,
}

impl OnePoint<'_> {
    /// The index of the point at a column and row of an image of `width` by `height`; `None` if it is
    /// outside.
    pub fn at_pixel(
        source: &dyn PointSource,
        width: usize,
        height: usize,
        x: usize,
        y: usize,
    ) -> Option<usize> {
        if x >= width || y >= height {
            return None;
        }
        match source.blocks() {
            Some(blocks) => (0..source.count()).find(|point| blocks.pixel(*point) == (x, y)),
            None => Some(y * width + x),
        }
    }

    /// The value of a global; a scalar is in the first element.
    pub fn global(&self, global: Global) -> [f32; 3] {
        if !self.source.varying().contains(&global) {
            return self.source.uniform(global);
        }
        self.filled(global, |lanes| self.source.fill(global, self.point, 1, lanes))
    }

    /// How a global changes along an axis.
    pub fn deriv_of(&self, global: Global, axis: Axis) -> [f32; 3] {
        if !self.source.varying_derivs().contains(&global) {
            return self.source.deriv(global, axis);
        }
        self.filled(global, |lanes| self.source.fill_deriv(global, axis, self.point, 1, lanes))
    }

    fn filled(&self, global: Global, fill: impl FnOnce(&mut [f32])) -> [f32; 3] {
        let mut value = [0.0; 3];
        let scalar = matches!(
            global,
            Global::U
                | Global::V
                | Global::Time
                | Global::Dtime
                | Global::SurfaceArea
                | Global::Backfacing
                | Global::LeftHanded
        );
        fill(&mut value[..if scalar { 1 } else { 3 }]);
        value
    }
}

impl PointSource for OnePoint<'_> {
    fn count(&self) -> usize {
        1
    }

    fn varying(&self) -> &[Global] {
        &[]
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        self.global(global)
    }

    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        self.deriv_of(global, axis)
    }

    fn fill(&self, global: Global, _: usize, width: usize, lanes: &mut [f32]) {
        let value = self.global(global);
        lanes.chunks_mut(width.max(1)).zip(value).for_each(|(lanes, x)| lanes.fill(x));
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, _: usize) -> Option<Datum> {
        self.source.attribute(object, name, element, self.point)
    }
}
