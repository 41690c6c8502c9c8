//! Points with explicitly set values and derivatives of globals.

use super::case::INPUTS;
use osl_exec::{Datum, PointSource};
use osl_hir::hir::Global;
use osl_ir::ir::{Axis, Const};

/// The inputs of a point and how they change along x and y.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) x: [f32; INPUTS],
    pub(crate) d: [[f32; INPUTS]; 2],
}

/// The points of a run. The datum `s` of a point is its first scalar.
pub(crate) struct Points(pub(crate) Vec<Point>);

const GLOBALS: [Global; 5] = [Global::P, Global::I, Global::Ps, Global::U, Global::V];

fn first(global: Global) -> Option<usize> {
    let at = GLOBALS.iter().position(|g| *g == global)?;
    Some(if at < 3 { at * 3 } else { at + 6 })
}

impl Points {
    fn write(
        &self,
        global: Global,
        from: usize,
        width: usize,
        lanes: &mut [f32],
        of: impl Fn(&Point) -> [f32; INPUTS],
    ) {
        let Some(first) = first(global) else { return };
        for (component, lanes) in lanes.chunks_mut(width.max(1)).enumerate() {
            for (lane, out) in lanes.iter_mut().enumerate() {
                *out = of(&self.0[(from + lane).min(self.0.len() - 1)])[first + component];
            }
        }
    }
}

impl PointSource for Points {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn varying(&self) -> &[Global] {
        &GLOBALS
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        if matches!(global, Global::N | Global::Ng) { [0.0, 0.0, 1.0] } else { [0.0; 3] }
    }

    fn deriv(&self, _: Global, _: Axis) -> [f32; 3] {
        [0.0; 3]
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        self.write(global, first, width, lanes, |p| p.x);
    }

    fn varying_derivs(&self) -> &[Global] {
        &GLOBALS
    }

    fn fill_deriv(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        self.write(global, first, width, lanes, |p| p.d[axis as usize]);
    }

    fn attribute(&self, _: &str, name: &str, _: Option<usize>, point: usize) -> Option<Datum> {
        let point = &self.0[point.min(self.0.len() - 1)];
        let derivs = [point.d[0][9], point.d[1][9]];
        (name == "s").then(|| Datum { derivs, ..Datum::one(Const::Float(point.x[9])) })
    }
}

/// A pseudorandom sequence (Steele, Lea and Flood, SplitMix, 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// From 0 to 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.word() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + self.unit() * (high - low)
    }
}
