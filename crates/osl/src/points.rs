//! Shading points, listed by an embedder.

use crate::order::Order;
use crate::{Column, Error, RendererServices, Value};
use osl_exec::{Answer, Datum, DatumColumn, PointSource, Ray, left_handed};
use osl_ir::global::Global;
use osl_ir::ir::Axis;
use osl_ir::types::Type;
use std::borrow::Cow;

/// The value of a global that is not set.
fn default(global: Global) -> [f32; 3] {
    match global {
        Global::N | Global::Ng => [0.0, 0.0, 1.0],
        Global::DPdu => [1.0, 0.0, 0.0],
        Global::DPdv => [0.0, 1.0, 0.0],
        _ => [0.0; 3],
    }
}

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
    columns: Vec<OfGlobal<'a>>,
    derivs: Vec<Derivs<'a>>,
    data: Vec<Data<'a>>,
    same_data: Vec<(String, Value)>,
    uniform: Vec<(Global, [f32; 3])>,
    row: Option<usize>,
    pub(crate) varying: Vec<Global>,
    pub(crate) varying_derivs: Vec<Global>,
}

/// A global at all points.
#[derive(Clone, Debug, PartialEq)]
struct OfGlobal<'a> {
    global: Global,
    values: Column<'a>,
}

/// The derivatives of a global: its change to the next pixel along x and y.
#[derive(Clone, Debug, PartialEq)]
struct Derivs<'a> {
    global: Global,
    axes: [Column<'a>; 2],
}

/// User data at all points, and their derivatives along both axes if they are given.
#[derive(Clone, Debug, PartialEq)]
struct Data<'a> {
    name: String,
    values: Column<'a>,
    derivs: Option<[Column<'a>; 2]>,
}

/// A setter for each global: the name, the type of a value, the global, and what the values are.
macro_rules! columns {
    ($($(#[$doc:meta])* $name:ident: $type:ty => $global:ident as $values:ident;)*) => {
        impl<'a> Points<'a> {$(
            $(#[$doc])*
            #[must_use]
            pub fn $name(self, values: impl Into<Cow<'a, [$type]>>) -> Points<'a> {
                self.with(Global::$global, Column::$values(values.into()))
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

    fn with(mut self, global: Global, values: Column<'a>) -> Points<'a> {
        self.columns.retain(|c| c.global != global);
        self.columns.push(OfGlobal { global, values });
        if !self.varying.contains(&global) {
            self.varying.push(global);
        }
        if global == Global::N && !self.varying.contains(&Global::Ng) {
            self.varying.push(Global::Ng);
        }
        self
    }

    /// Sets a global that is the same at all points, by its name; a scalar is the first number. A list of
    /// values takes precedence. The geometric normal follows the shading normal unless it is set, too.
    ///
    /// ```
    /// let points = osl::Points::new(2).u(vec![0.25, 0.75]).everywhere("time", [0.5, 0.0, 0.0])?;
    /// # Ok::<(), osl::Error>(())
    /// ```
    ///
    /// # Errors
    /// There is no such global.
    pub fn everywhere(mut self, name: &str, value: [f32; 3]) -> Result<Points<'a>, Error> {
        let is_none = |global: Global| matches!(global, Global::Ci | Global::LeftHanded);
        let is = |global: &Global| global.name().trim_end_matches("()") == name && !is_none(*global);
        let found = Global::ALL.into_iter().find(is);
        let global = found.ok_or_else(|| Error::new(format!("there is no global `{name}`")))?;
        self.uniform.retain(|(other, _)| *other != global);
        self.uniform.push((global, value));
        Ok(self)
    }

    /// Says that the points are the pixels of an image with rows of this width, so that
    /// [`Program::run_tiles`](crate::Program::run_tiles) shades neighbours together. The values stay the
    /// same; those of patterns take less time.
    #[must_use]
    pub fn row(mut self, width: usize) -> Points<'a> {
        self.row = Some(width).filter(|width| *width > 0 && self.count.is_multiple_of(*width));
        self
    }

    /// The order in which points are shaded, if it is not their own.
    pub(crate) fn order(&self) -> Option<Order> {
        Some(Order::new(self.row?, self.count))
    }

    /// The value of a global that is the same at all points.
    fn same(&self, global: Global) -> [f32; 3] {
        let of = |wanted: Global| self.uniform.iter().find(|(global, _)| *global == wanted);
        let found = of(global).or_else(|| if global == Global::Ng { of(Global::N) } else { None });
        found.map_or_else(|| default(global), |(_, value)| *value)
    }

    fn with_derivs(mut self, global: Global, axes: [Column<'a>; 2]) -> Points<'a> {
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
        let part = |at: usize| Column::OneOfFour(derivs.clone(), at);
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
            self.with_derivs(Global::P, [Column::Triples(dx.into()), Column::Triples(dy.into())]);
        if !points.varying.contains(&Global::LeftHanded) {
            points.varying.push(Global::LeftHanded);
        }
        points
    }

    /// User data that differ from point to point: the values of interpolated parameters with this name, and
    /// attributes of no object. They take precedence over those of the renderer.
    ///
    /// ```
    /// use osl::{Group, Points, Shader};
    ///
    /// let text = "shader a(float wear = 1 [[int lockgeom = 0]], output float o = 0) { o = 2 * wear; }";
    /// let program = Group::new().layer("a", &Shader::compile("a.osl", text)?).compile(&["o"])?;
    /// let points = Points::new(2).data("wear", vec![0.25_f32, 0.5]);
    /// assert_eq!(program.run(&points)?.floats("o"), Some(vec![0.5, 1.0]));
    /// # Ok::<(), osl::Error>(())
    /// ```
    #[must_use]
    pub fn data(mut self, name: &str, values: impl Into<Column<'a>>) -> Points<'a> {
        self.data.retain(|data| data.name != name);
        self.data.push(Data { name: name.to_string(), values: values.into(), derivs: None });
        self
    }

    /// The same for floats with derivatives: their change to the next pixel along x, and along y. Texture
    /// coordinates need them.
    #[must_use]
    pub fn data_with_derivs(
        self,
        name: &str,
        values: impl Into<Cow<'a, [f32]>>,
        dx: impl Into<Cow<'a, [f32]>>,
        dy: impl Into<Cow<'a, [f32]>>,
    ) -> Points<'a> {
        let mut points = self.data(name, Column::Floats(values.into()));
        if let Some(data) = points.data.last_mut() {
            data.derivs = Some([Column::Floats(dx.into()), Column::Floats(dy.into())]);
        }
        points
    }

    /// User data that are the same at all points, unless there are some that differ.
    #[must_use]
    pub fn data_everywhere(mut self, name: &str, value: impl Into<Value>) -> Points<'a> {
        self.same_data.retain(|(other, _)| other != name);
        self.same_data.push((name.to_string(), value.into()));
        self
    }

    /// The column of user data with a name.
    fn data_column(&self, object: &str, name: &str, element: Option<usize>) -> Option<&Data<'a>> {
        let is_user_data = |data: &Data<'a>| element.is_none() || matches!(data.values, Column::Arrays(..));
        self.data.iter().find(|data| object.is_empty() && data.name == name && is_user_data(data))
    }

    /// The user data with a name that are the same at all points.
    fn data_of_all(&self, object: &str, name: &str) -> Option<&Value> {
        let found = self.same_data.iter().find(|(other, _)| object.is_empty() && other == name);
        found.map(|(_, value)| value)
    }

    /// The values of a global that is set. The shading normals are also the geometric ones unless these are
    /// set.
    fn column(&self, global: Global) -> Option<&Column<'a>> {
        let of = |global: Global| self.columns.iter().find(|column| column.global == global);
        let is_own = |(global, _): &(Global, [f32; 3])| *global == Global::Ng;
        let follows = global == Global::Ng && !self.uniform.iter().any(is_own);
        let found = of(global).or_else(|| if follows { of(Global::N) } else { None });
        found.map(|column| &column.values)
    }

    /// [`Global::LeftHanded`] at a point; points after the last one are like it.
    fn left_handed(&self, at: usize) -> f32 {
        let at = at.min(self.count.saturating_sub(1));
        let n = self.column(Global::N).map_or_else(|| self.same(Global::N), |values| values.triple(at));
        let p = self.derivs.iter().find(|derivs| derivs.global == Global::P);
        p.map_or(0.0, |Derivs { axes: [x, y], .. }| left_handed(x.triple(at), y.triple(at), n))
    }

    /// Whether all columns have the right length.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let columns = self.columns.iter().map(|c| (c.global, c.values.len()));
        let derivs = self.derivs.iter().flat_map(|s| s.axes.iter().map(|p| (s.global, p.len())));
        let data = self.data.iter().flat_map(|data| {
            let all = std::iter::once(&data.values).chain(data.derivs.iter().flatten());
            all.map(|column| (&*data.name, column.len()))
        });
        let globals = columns.chain(derivs).map(|(global, len)| (global.name(), len));
        match globals.chain(data).find(|(_, len)| *len != self.count) {
            Some((name, len)) => {
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
    /// Whether the program was compiled with rays.
    pub(crate) traces: bool,
    /// The order in which points are shaded, if it is not that of the points.
    pub(crate) order: Option<Order>,
}

impl Source<'_> {
    fn position(&self, point: usize) -> usize {
        self.order.map_or(point, |order| order.position(point))
    }

    /// Copies the values of points, wherever they are in the lists.
    fn copy(&self, values: &Column<'_>, first: usize, width: usize, lanes: &mut [f32]) {
        match self.order {
            None => values.copy(first, 0..width, width, lanes),
            Some(order) => {
                order.runs(first, width).for_each(|(at, to)| values.copy(at, to, width, lanes));
            }
        }
    }
}

impl PointSource for Source<'_> {
    fn count(&self) -> usize {
        self.points.count
    }

    fn pixel(&self, position: usize) -> usize {
        self.position(position)
    }

    fn varying(&self) -> &[Global] {
        &self.points.varying
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        self.points.same(global)
    }

    fn deriv(&self, _: Global, _: Axis) -> [f32; 3] {
        [0.0; 3]
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        if global == Global::LeftHanded {
            let at = |lane: usize| self.points.left_handed(self.position(first + lane));
            lanes.iter_mut().take(width).enumerate().for_each(|(lane, out)| *out = at(lane));
        } else if let Some(values) = self.points.column(global) {
            self.copy(values, first, width, lanes);
        } else {
            let same = self.points.same(global);
            lanes.chunks_mut(width.max(1)).zip(same).for_each(|(lanes, x)| lanes.fill(x));
        }
    }

    fn varying_derivs(&self) -> &[Global] {
        &self.points.varying_derivs
    }

    fn fill_deriv(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        if let Some(derivs) = self.points.derivs.iter().find(|s| s.global == global) {
            self.copy(&derivs.axes[axis as usize], first, width, lanes);
        }
    }

    fn traces(&self) -> bool {
        self.traces
    }

    fn trace_all(&self, rays: &[Ray], hits: &mut [bool]) {
        match self.order {
            None => self.services.trace_all(rays, hits),
            Some(order) => {
                let of = |ray: &Ray| Ray { point: order.position(ray.point), ..*ray };
                self.services.trace_all(&rays.iter().map(of).collect::<Vec<Ray>>(), hits);
            }
        }
    }

    fn message(&self, source: &str, name: &str, ty: Type, point: usize) -> Answer {
        let value = self.services.message(source, name, self.position(point));
        let found = value.as_ref().and_then(Value::constants);
        // A color, point, vector or normal is given as a triple.
        let fits =
            |given: &Type| given.extent == ty.extent && (*given == ty || given.is_triple() && ty.is_triple());
        Answer {
            found: found.is_some(),
            values: found.filter(|(given, _)| fits(given)).map(|(_, list)| list),
        }
    }

    fn fill_messages(
        &self,
        (source, name): (&str, &str),
        points: &[usize],
        column: &mut DatumColumn<'_>,
    ) -> bool {
        let positions: Vec<usize> = points.iter().map(|point| self.position(*point)).collect();
        let given = self.services.messages(source, name, &positions);
        given.is_some_and(|given| given.len() == points.len() && given.fill(0, column))
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        let point = self.position(point);
        if let Some(data) = self.points.data_column(object, name, element) {
            let axis = |axis: usize| data.derivs.as_ref().map_or(0.0, |derivs| derivs[axis].float(point));
            return Some(Datum { derivs: [axis(0), axis(1)], ..data.values.datum(point, element)? });
        }
        if let Some(value) = self.points.data_of_all(object, name) {
            return value.clone().datum(element);
        }
        let user = if object.is_empty() { self.services.user_data(name, point) } else { None };
        user.or_else(|| self.services.attribute(object, name, point))?.datum(element)
    }

    fn fill_attribute(
        &self,
        (object, name, element): (&str, &str, Option<usize>),
        first: usize,
        column: &mut DatumColumn<'_>,
    ) -> bool {
        let width = column.width;
        if let Some(Data { values, derivs, .. }) = self.points.data_column(object, name, element) {
            for (values, lanes) in derivs.iter().flatten().zip(column.derivs.chunks_mut(width.max(1))) {
                self.copy(values, first, width, lanes);
            }
            let suits = values.suits(column);
            if suits {
                self.copy(values, first, width, bytemuck::cast_slice_mut(column.words));
            }
            return suits;
        }
        // Services are asked for points that follow each other.
        if self.order.is_some() || self.points.data_of_all(object, name).is_some() {
            return false;
        }
        let points = first..self.points.count.min(first + width);
        let given = element.is_none().then(|| self.services.attributes(object, name, points.clone()));
        given.flatten().is_some_and(|given| given.len() == points.len() && given.fill(0, column))
    }

    fn attribute_is_shared(&self, object: &str, name: &str, element: Option<usize>) -> bool {
        let is_shared =
            || self.points.data_of_all(object, name).is_some() || self.services.is_uniform(object, name);
        self.points.data_column(object, name, element).is_none() && is_shared()
    }
}
