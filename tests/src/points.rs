//! Points for tests of single functions: each point knows its number, and has derivatives.

use osl_exec::PointSource;
use osl_hir::hir::Global;
use osl_ir::ir::Axis;

/// `u` is the point's number. `v` and the components of `P` are -0, so adding them changes no value, but they
/// have derivatives: a parameter plus `v` has the parameter's value, with derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Points {
    /// Number of points.
    pub count: usize,
    /// The numbers are multiples of this,
    pub step: usize,
    /// less multiples of this.
    pub modulus: usize,
}

impl Points {
    /// Points numbered from 0.
    pub fn new(count: usize) -> Points {
        Points { count, step: 1, modulus: usize::MAX }
    }
}

impl PointSource for Points {
    fn count(&self) -> usize {
        self.count
    }

    fn varying(&self) -> &[Global] {
        &[Global::U, Global::V, Global::P]
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        if matches!(global, Global::N | Global::Ng) { [0.0, 0.0, 1.0] } else { [0.0; 3] }
    }

    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        match (global, axis) {
            (Global::V, Axis::X) => [1.0, 0.0, 0.0],
            (Global::V, Axis::Y) => [0.5, 0.0, 0.0],
            (Global::P, Axis::X) => [1.0, 0.5, 0.25],
            (Global::P, Axis::Y) => [-0.5, 1.0, 2.0],
            _ => [0.0; 3],
        }
    }

    fn fill(&self, global: Global, first: usize, _: usize, lanes: &mut [f32]) {
        lanes.fill(-0.0);
        if global == Global::U {
            for (lane, u) in lanes.iter_mut().enumerate() {
                let point = (first + lane).min(self.count.saturating_sub(1));
                *u = (point * self.step % self.modulus) as f32;
            }
        }
    }
}
