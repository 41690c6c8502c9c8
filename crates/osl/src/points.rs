//! Shading points, listed by an embedder.

use crate::{Error, RendererServices};
use osl_exec::{Datum, PointSource, left_handed};
use osl_ir::global::Global;
use osl_ir::ir::Axis;

/// The normal of points without one.
const NORMAL: [f32; 3] = [0.0, 0.0, 1.0];

/// Points to shade, in common space: arrays with one element per point. Globals that are not set are uniform:
/// `P` and `I` are 0, `N` and `Ng` are (0, 0, 1), `dPdu` and `dPdv` are the x and y axes, everything else is
/// 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    count: usize,
    columns: Vec<Column>,
    derivs: Vec<Derivs>,
    varying: Vec<Global>,
    varying_derivs: Vec<Global>,
}

/// A global at all points: its components, each an array.
#[derive(Clone, Debug, PartialEq)]
struct Column {
    global: Global,
    parts: Vec<Vec<f32>>,
}

/// The derivatives of a global: its change to the next pixel along x and y.
#[derive(Clone, Debug, PartialEq)]
struct Derivs {
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

    fn with_derivs(mut self, global: Global, axes: [Vec<Vec<f32>>; 2]) -> Points {
        self.derivs.retain(|s| s.global != global);
        self.derivs.push(Derivs { global, axes });
        if !self.varying_derivs.contains(&global) {
            self.varying_derivs.push(global);
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
    pub fn uv_derivs(self, derivs: &[[f32; 4]]) -> Points {
        let part = |at: usize| vec![derivs.iter().map(|s| s[at]).collect::<Vec<f32>>()];
        self.with_derivs(Global::U, [part(0), part(1)]).with_derivs(Global::V, [part(2), part(3)])
    }

    /// The derivatives of the positions: their change to the next pixel along x, and along y. Bump mapping
    /// needs them.
    #[must_use]
    pub fn p_derivs(self, dx: &[[f32; 3]], dy: &[[f32; 3]]) -> Points {
        let mut points = self.with_derivs(Global::P, [parts(dx), parts(dy)]);
        if !points.varying.contains(&Global::LeftHanded) {
            points.varying.push(Global::LeftHanded);
        }
        points
    }

    /// [`Global::LeftHanded`] at a point; points after the last one are like it.
    fn left_handed(&self, at: usize) -> f32 {
        let at = at.min(self.count.saturating_sub(1));
        let triple = |parts: &[Vec<f32>]| [0, 1, 2].map(|c| part(parts, c, at));
        let n = self.columns.iter().find(|c| c.global == Global::N);
        let n = n.map_or(NORMAL, |column| triple(&column.parts));
        let p = self.derivs.iter().find(|derivs| derivs.global == Global::P);
        p.map_or(0.0, |Derivs { axes: [x, y], .. }| left_handed(triple(x), triple(y), n))
    }

    /// Whether all arrays have the right length.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let columns = self.columns.iter().flat_map(|c| c.parts.iter().map(|p| (c.global, p.len())));
        let derivs = self.derivs.iter().flat_map(|s| s.axes.iter().flatten().map(|p| (s.global, p.len())));
        match columns.chain(derivs).find(|(_, len)| *len != self.count) {
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

fn part(parts: &[Vec<f32>], component: usize, at: usize) -> f32 {
    parts.get(component).and_then(|list| list.get(at)).copied().unwrap_or_default()
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
            Global::N | Global::Ng => NORMAL,
            Global::DPdu => [1.0, 0.0, 0.0],
            Global::DPdv => [0.0, 1.0, 0.0],
            _ => [0.0; 3],
        }
    }

    fn deriv(&self, _: Global, _: Axis) -> [f32; 3] {
        [0.0; 3]
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        if global == Global::LeftHanded {
            let at = |lane: usize| self.points.left_handed(first + lane);
            lanes.iter_mut().take(width).enumerate().for_each(|(lane, out)| *out = at(lane));
        } else if let Some(column) = self.points.columns.iter().find(|c| c.global == global) {
            copy(&column.parts, first, width, lanes);
        }
    }

    fn varying_derivs(&self) -> &[Global] {
        &self.points.varying_derivs
    }

    fn fill_deriv(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        if let Some(derivs) = self.points.derivs.iter().find(|s| s.global == global) {
            copy(&derivs.axes[axis as usize], first, width, lanes);
        }
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        let user = if object.is_empty() { self.services.user_data(name, point) } else { None };
        user.or_else(|| self.services.attribute(object, name, point))?.datum(element)
    }
}
