//! Shading points, listed by an embedder.

use crate::{Error, RendererServices};
use osl_exec::{Datum, PointSource};
use osl_ir::hir::Global;
use osl_ir::ir::Axis;

/// Points to shade, in common space: arrays with one element per point. Globals that are not set are uniform:
/// `P` and `I` are 0, `N` and `Ng` are (0, 0, 1), `dPdu` and `dPdv` are the x and y axes, everything else is
/// 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    count: usize,
    columns: Vec<Column>,
    slopes: Vec<Slopes>,
    varying: Vec<Global>,
    varying_slopes: Vec<Global>,
}

/// A global at all points: its components, each an array.
#[derive(Clone, Debug, PartialEq)]
struct Column {
    global: Global,
    parts: Vec<Vec<f32>>,
}

/// The derivatives of a global: its change to the next pixel along x and y.
#[derive(Clone, Debug, PartialEq)]
struct Slopes {
    global: Global,
    axes: [Vec<Vec<f32>>; 2],
}

/// The components of triples, each an array.
fn parts(list: &[[f32; 3]]) -> Vec<Vec<f32>> {
    (0..3).map(|part| list.iter().map(|x| x[part]).collect()).collect()
}

impl Points {
    /// The given number of points, with default values.
    pub fn new(count: usize) -> Points {
        Points { count, ..Points::default() }
    }

    /// The number of points.
    pub fn count(&self) -> usize {
        self.count
    }

    fn with(mut self, global: Global, parts: Vec<Vec<f32>>) -> Points {
        self.columns.retain(|c| c.global != global);
        self.columns.push(Column { global, parts });
        if !self.varying.contains(&global) {
            self.varying.push(global);
        }
        self
    }

    fn sloping(mut self, global: Global, axes: [Vec<Vec<f32>>; 2]) -> Points {
        self.slopes.retain(|s| s.global != global);
        self.slopes.push(Slopes { global, axes });
        if !self.varying_slopes.contains(&global) {
            self.varying_slopes.push(global);
        }
        self
    }

    /// Surface coordinate u.
    #[must_use]
    pub fn u(self, u: impl Into<Vec<f32>>) -> Points {
        self.with(Global::U, vec![u.into()])
    }

    /// Surface coordinate v.
    #[must_use]
    pub fn v(self, v: impl Into<Vec<f32>>) -> Points {
        self.with(Global::V, vec![v.into()])
    }

    /// Positions.
    #[must_use]
    pub fn p(self, p: &[[f32; 3]]) -> Points {
        self.with(Global::P, parts(p))
    }

    /// Shading normals; also used as geometric normals unless these are set.
    #[must_use]
    pub fn n(self, n: &[[f32; 3]]) -> Points {
        let set = self.varying.contains(&Global::Ng);
        let points = self.with(Global::N, parts(n));
        if set { points } else { points.ng(n) }
    }

    /// Geometric normals.
    #[must_use]
    pub fn ng(self, ng: &[[f32; 3]]) -> Points {
        self.with(Global::Ng, parts(ng))
    }

    /// Directions of the rays that hit the points.
    #[must_use]
    pub fn i(self, i: &[[f32; 3]]) -> Points {
        self.with(Global::I, parts(i))
    }

    /// Tangents along u.
    #[must_use]
    pub fn dpdu(self, dpdu: &[[f32; 3]]) -> Points {
        self.with(Global::DPdu, parts(dpdu))
    }

    /// Tangents along v.
    #[must_use]
    pub fn dpdv(self, dpdv: &[[f32; 3]]) -> Points {
        self.with(Global::DPdv, parts(dpdv))
    }

    /// Times within the shutter interval.
    #[must_use]
    pub fn time(self, time: impl Into<Vec<f32>>) -> Points {
        self.with(Global::Time, vec![time.into()])
    }

    /// The derivatives of u and v: `[du/dx, du/dy, dv/dx, dv/dy]` of each point, as changes to the next
    /// pixel. Texture lookups filter by them.
    #[must_use]
    pub fn uv_slopes(self, slopes: &[[f32; 4]]) -> Points {
        let part = |at: usize| vec![slopes.iter().map(|s| s[at]).collect::<Vec<f32>>()];
        self.sloping(Global::U, [part(0), part(1)]).sloping(Global::V, [part(2), part(3)])
    }

    /// The derivatives of the positions: their change to the next pixel along x, and along y. Bump mapping
    /// needs them.
    #[must_use]
    pub fn p_slopes(self, dx: &[[f32; 3]], dy: &[[f32; 3]]) -> Points {
        self.sloping(Global::P, [parts(dx), parts(dy)])
    }

    /// Whether all arrays have the right length.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let columns = self.columns.iter().flat_map(|c| c.parts.iter().map(|p| (c.global, p.len())));
        let slopes = self.slopes.iter().flat_map(|s| s.axes.iter().flatten().map(|p| (s.global, p.len())));
        match columns.chain(slopes).find(|(_, len)| *len != self.count) {
            Some((global, len)) => {
                Err(Error::new(format!("there are {} points, but {len} values of {global:?}", self.count)))
            }
            None => Ok(()),
        }
    }
}

/// Points with the services that answer a shader's queries about them.
pub(crate) struct Source<'a> {
    pub(crate) points: &'a Points,
    pub(crate) services: &'a dyn RendererServices,
}

/// Copies values from `first` on; the last value repeats after the end.
fn copy(parts: &[Vec<f32>], first: usize, width: usize, lanes: &mut [f32]) {
    for (part, lanes) in parts.iter().zip(lanes.chunks_mut(width.max(1))) {
        let from = part.get(first..).unwrap_or_default();
        let here = from.len().min(lanes.len());
        let (now, rest) = lanes.split_at_mut(here);
        now.copy_from_slice(&from[..here]);
        rest.fill(part.last().copied().unwrap_or(0.0));
    }
}

impl PointSource for Source<'_> {
    fn count(&self) -> usize {
        self.points.count
    }

    fn varying(&self) -> &[Global] {
        &self.points.varying
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        match global {
            Global::N | Global::Ng => [0.0, 0.0, 1.0],
            Global::DPdu => [1.0, 0.0, 0.0],
            Global::DPdv => [0.0, 1.0, 0.0],
            _ => [0.0; 3],
        }
    }

    fn slope(&self, _: Global, _: Axis) -> [f32; 3] {
        [0.0; 3]
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        if let Some(column) = self.points.columns.iter().find(|c| c.global == global) {
            copy(&column.parts, first, width, lanes);
        }
    }

    fn varying_slopes(&self) -> &[Global] {
        &self.points.varying_slopes
    }

    fn fill_slope(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        if let Some(slopes) = self.points.slopes.iter().find(|s| s.global == global) {
            copy(&slopes.axes[axis as usize], first, width, lanes);
        }
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        let user = if object.is_empty() { self.services.user_data(name, point) } else { None };
        user.or_else(|| self.services.attribute(object, name, point))?.datum(element)
    }
}
