//! Shading points, listed by an embedder.

use crate::{Error, RendererServices};
use osl_exec::{Datum, PointSource, left_handed};
use osl_ir::global::Global;
use osl_ir::ir::Axis;
use std::borrow::Cow;

/// The normal of points without one.
const NORMAL: [f32; 3] = [0.0, 0.0, 1.0];

/// Points to shade, in common space: for each global a column with one element for each point, lent or given.
/// Globals that are not set are uniform: `P` and `I` are 0, `N` and `Ng` are (0, 0, 1), `dPdu` and `dPdv` are
/// the x and y axes, everything else is 0.
///
/// ```
/// let p = vec![[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
/// let points = osl::Points::new(2).p(&p).n(&p).u(vec![0.25, 0.75]);
/// assert_eq!(points.count(), 2);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points<'a> {
    count: usize,
    columns: Vec<Column<'a>>,
    derivs: Vec<Derivs<'a>>,
    varying: Vec<Global>,
    varying_derivs: Vec<Global>,
}

/// A global at all points.
#[derive(Clone, Debug, PartialEq)]
struct Column<'a> {
    global: Global,
    values: Values<'a>,
}

/// The derivatives of a global: its change to the next pixel along x and y.
#[derive(Clone, Debug, PartialEq)]
struct Derivs<'a> {
    global: Global,
    axes: [Values<'a>; 2],
}

/// The values of a column, point by point.
#[derive(Clone, Debug, PartialEq)]
enum Values<'a> {
    Floats(Cow<'a, [f32]>),
    Triples(Cow<'a, [[f32; 3]]>),
    /// One of four numbers of each point.
    OneOfFour(Cow<'a, [[f32; 4]]>, usize),
}

impl Values<'_> {
    fn len(&self) -> usize {
        match self {
            Values::Floats(list) => list.len(),
            Values::Triples(list) => list.len(),
            Values::OneOfFour(list, _) => list.len(),
        }
    }

    /// Copies values from `first` on, component by component; the last value repeats after the end.
    fn copy(&self, first: usize, width: usize, lanes: &mut [f32]) {
        match self {
            Values::Floats(list) => {
                let from = list.get(first..).unwrap_or_default();
                let (now, rest) = lanes.split_at_mut(from.len().min(lanes.len()));
                now.copy_from_slice(from.get(..now.len()).unwrap_or_default());
                rest.fill(list.last().copied().unwrap_or_default());
            }
            Values::Triples(list) => {
                for (component, lanes) in lanes.chunks_mut(width.max(1)).enumerate() {
                    take(list, first, lanes, |triple| triple.get(component));
                }
            }
            Values::OneOfFour(list, at) => take(list, first, lanes, |four| four.get(*at)),
        }
    }

    /// The triple of a point.
    fn triple(&self, at: usize) -> [f32; 3] {
        match self {
            Values::Triples(list) => list.get(at).copied().unwrap_or_default(),
            _ => [0.0; 3],
        }
    }
}

/// Copies a part of each value from `first` on; the last value repeats after the end.
fn take<T>(list: &[T], first: usize, lanes: &mut [f32], part: impl Fn(&T) -> Option<&f32>) {
    let (from, last) = (list.get(first..).unwrap_or_default(), list.last());
    for (lane, value) in lanes.iter_mut().zip(from.iter().map(Some).chain(std::iter::repeat(last))) {
        *lane = value.and_then(&part).copied().unwrap_or_default();
    }
}

/// A setter for each global: the name, the type of a value, the global, and what the values are.
macro_rules! columns {
    ($($(#[$doc:meta])* $name:ident: $type:ty => $global:ident as $values:ident;)*) => {
        impl<'a> Points<'a> {$(
            $(#[$doc])*
            #[must_use]
            pub fn $name(self, values: impl Into<Cow<'a, [$type]>>) -> Points<'a> {
                self.with(Global::$global, Values::$values(values.into()))
            }
        )*}
    };
}

columns! {
    /// Surface coordinate u.
    u: f32 => U as Floats;
    /// Surface coordinate v.
    v: f32 => V as Floats;
    /// Positions.
    p: [f32; 3] => P as Triples;
    /// Shading normals; also used as geometric normals unless these are set.
    n: [f32; 3] => N as Triples;
    /// Geometric normals.
    ng: [f32; 3] => Ng as Triples;
    /// Directions of the rays that hit the points.
    i: [f32; 3] => I as Triples;
    /// Tangents along u.
    dpdu: [f32; 3] => DPdu as Triples;
    /// Tangents along v.
    dpdv: [f32; 3] => DPdv as Triples;
    /// Positions of the lamp for which a volume is shaded.
    ps: [f32; 3] => Ps as Triples;
    /// Times within the shutter interval.
    time: f32 => Time as Floats;
    /// Lengths of the shutter interval.
    dtime: f32 => Dtime as Floats;
    /// Velocities: changes of the position in a unit of time.
    dpdtime: [f32; 3] => DPdtime as Triples;
    /// Areas of the objects: `surfacearea()`.
    surface_area: f32 => SurfaceArea as Floats;
    /// 1 where the ray hits the back of the surface, else 0: `backfacing()`.
    backfacing: f32 => Backfacing as Floats;
}

impl<'a> Points<'a> {
    /// The given number of points, with default values.
    pub fn new(count: usize) -> Points<'a> {
        Points { count, ..Points::default() }
    }

    /// The number of points.
    pub fn count(&self) -> usize {
        self.count
    }

    fn with(mut self, global: Global, values: Values<'a>) -> Points<'a> {
        self.columns.retain(|c| c.global != global);
        self.columns.push(Column { global, values });
        if !self.varying.contains(&global) {
            self.varying.push(global);
        }
        if global == Global::N && !self.varying.contains(&Global::Ng) {
            self.varying.push(Global::Ng);
        }
        self
    }

    fn with_derivs(mut self, global: Global, axes: [Values<'a>; 2]) -> Points<'a> {
        self.derivs.retain(|s| s.global != global);
        self.derivs.push(Derivs { global, axes });
        if !self.varying_derivs.contains(&global) {
            self.varying_derivs.push(global);
        }
        self
    }

    /// The derivatives of u and v: `[du/dx, du/dy, dv/dx, dv/dy]` of each point, as changes to the next
    /// pixel. Texture lookups filter by them.
    #[must_use]
    pub fn uv_derivs(self, derivs: impl Into<Cow<'a, [[f32; 4]]>>) -> Points<'a> {
        let derivs = derivs.into();
        let part = |at: usize| Values::OneOfFour(derivs.clone(), at);
        let axes = [[part(0), part(1)], [part(2), part(3)]];
        let [u, v] = axes;
        self.with_derivs(Global::U, u).with_derivs(Global::V, v)
    }

    /// The derivatives of the positions: their change to the next pixel along x, and along y. Bump mapping
    /// needs them.
    #[must_use]
    pub fn p_derivs(
        self,
        dx: impl Into<Cow<'a, [[f32; 3]]>>,
        dy: impl Into<Cow<'a, [[f32; 3]]>>,
    ) -> Points<'a> {
        let mut points =
            self.with_derivs(Global::P, [Values::Triples(dx.into()), Values::Triples(dy.into())]);
        if !points.varying.contains(&Global::LeftHanded) {
            points.varying.push(Global::LeftHanded);
        }
        points
    }

    /// The values of a global that is set. The shading normals are also the geometric ones unless these are
    /// set.
    fn column(&self, global: Global) -> Option<&Values<'a>> {
        let of = |global: Global| self.columns.iter().find(|column| column.global == global);
        let found = of(global).or_else(|| if global == Global::Ng { of(Global::N) } else { None });
        found.map(|column| &column.values)
    }

    /// [`Global::LeftHanded`] at a point; points after the last one are like it.
    fn left_handed(&self, at: usize) -> f32 {
        let at = at.min(self.count.saturating_sub(1));
        let n = self.column(Global::N).map_or(NORMAL, |values| values.triple(at));
        let p = self.derivs.iter().find(|derivs| derivs.global == Global::P);
        p.map_or(0.0, |Derivs { axes: [x, y], .. }| left_handed(x.triple(at), y.triple(at), n))
    }

    /// Whether all columns have the right length.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let columns = self.columns.iter().map(|c| (c.global, c.values.len()));
        let derivs = self.derivs.iter().flat_map(|s| s.axes.iter().map(|p| (s.global, p.len())));
        match columns.chain(derivs).find(|(_, len)| *len != self.count) {
            Some((global, len)) => {
                let name = global.name();
                Err(Error::new(format!("there are {} points, but {len} values of {name}", self.count)))
            }
            None => Ok(()),
        }
    }
}

/// Points with the services that answer a shader's queries about them.
pub(crate) struct Source<'a> {
    pub(crate) points: &'a Points<'a>,
    pub(crate) services: &'a dyn RendererServices,
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
        } else if let Some(values) = self.points.column(global) {
            values.copy(first, width, lanes);
        }
    }

    fn varying_derivs(&self) -> &[Global] {
        &self.points.varying_derivs
    }

    fn fill_deriv(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        if let Some(derivs) = self.points.derivs.iter().find(|s| s.global == global) {
            derivs.axes[axis as usize].copy(first, width, lanes);
        }
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        let user = if object.is_empty() { self.services.user_data(name, point) } else { None };
        user.or_else(|| self.services.attribute(object, name, point))?.datum(element)
    }
}
