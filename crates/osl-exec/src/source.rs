//! The source of shading points, as the interpreter sees it.

use crate::order::Blocks;
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Const, Kind};
use osl_ir::types::Type;
use osl_numeric::geometry::{cross, dot};
use std::sync::Arc;

/// A named datum of a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Datum {
    /// Its values: one, or the elements of an array.
    pub values: Vec<Const>,
    /// Whether it is an array.
    pub array: bool,
    /// The change of a single float to the next pixel along x and along y.
    pub derivs: [f32; 2],
    /// What its name stands for if the shader requests a value of another type.
    pub other: Option<Box<Datum>>,
    /// What answers in place of a scene that has no such datum, as text for a note.
    pub instead: Option<Arc<str>>,
}

impl Datum {
    /// A constant value.
    pub fn one(value: Const) -> Datum {
        Datum { values: vec![value], array: false, derivs: [0.0; 2], other: None, instead: None }
    }

    /// An array.
    pub fn array(values: Vec<Const>) -> Datum {
        Datum { values, array: true, derivs: [0.0; 2], other: None, instead: None }
    }

    /// The same, with a datum for requests that its own types do not suit.
    #[must_use]
    pub fn or(mut self, other: Datum) -> Datum {
        let mut last = &mut self.other;
        while let Some(datum) = last {
            last = &mut datum.other;
        }
        *last = Some(Box::new(other));
        self
    }

    /// The same for all its types, with what answers in place of a scene.
    #[must_use]
    pub fn instead(mut self, text: Arc<str>) -> Datum {
        self.other = self.other.map(|other| Box::new(other.instead(text.clone())));
        self.instead = Some(text);
        self
    }

    /// The first datum with exactly this type: `count` values of an array, or a single value if it is 0.
    pub fn of_type(&self, kind: Kind, count: usize) -> Option<&Datum> {
        let fits = |datum: &&Datum| {
            datum.array == (count > 0)
                && datum.values.len() == count.max(1)
                && datum.values.iter().all(|value| value.kind() == kind)
        };
        std::iter::successors(Some(self), |datum| datum.other.as_deref()).find(fits)
    }

    /// One element of its arrays.
    pub fn element(&self, at: usize) -> Option<Datum> {
        let all = std::iter::successors(Some(self), |datum| datum.other.as_deref());
        let elements = all.filter(|datum| datum.array).filter_map(|datum| datum.values.get(at).cloned());
        elements.map(Datum::one).reduce(Datum::or)
    }
}

/// The values of a datum at the points of a batch, with the type that the shader requests.
#[derive(Debug)]
pub struct DatumColumn<'a> {
    /// The kind of a value.
    pub kind: Kind,
    /// Number of elements of an array; 0 for a single value.
    pub count: usize,
    /// Number of points.
    pub width: usize,
    /// One array of `width` words for each component of each element: ints, and the bits of floats.
    pub words: &'a mut [u32],
    /// The changes of a single float to the next pixel along x and along y: one array for each axis. They are
    /// 0 unless a source sets them.
    pub derivs: &'a mut [f32],
}

/// A ray that a shader traces. Space: common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The point that traces it.
    pub point: usize,
    /// Where it starts.
    pub origin: [f32; 3],
    /// Where it goes.
    pub direction: [f32; 3],
}

/// The answer of a source of messages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answer {
    /// Whether there is an answer.
    pub found: bool,
    /// The values with the requested type: one, or the elements of an array. `None` leaves the shader's
    /// variable unchanged.
    pub values: Option<Vec<Const>>,
}

/// [`Global::LeftHanded`] for a point: 1 if the changes of its position to the next pixel along x and along y
/// are left-handed with its normal, else 0.
pub fn left_handed(dx: [f32; 3], dy: [f32; 3], n: [f32; 3]) -> f32 {
    f32::from(u8::from(dot(cross(dx, dy), n) < 0.0))
}

/// A set of shading points.
pub trait PointSource: Sync {
    /// The number of points.
    fn count(&self) -> usize;

    /// The order of the points on an image; `None` means row by row, or any other order that the results
    /// share.
    fn blocks(&self) -> Option<Blocks> {
        None
    }

    /// The pixel of a point, row by row, from the point's position on the image; equal to the position if
    /// each pixel has one point.
    fn pixel(&self, position: usize) -> usize {
        position
    }

    /// The globals that differ from point to point. A program refuses to run if it was compiled for fewer,
    /// see [`RunError::VariesMore`](crate::RunError::VariesMore).
    fn varying(&self) -> &[Global];

    /// The value of a uniform global; a scalar is in the first element. Space: common.
    fn uniform(&self, global: Global) -> [f32; 3];

    /// The derivative of a global along an axis: its change from a pixel to its neighbour; a scalar is in the
    /// first element.
    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3];

    /// Writes a varying global for the points from `first` on. **Shape:** `lanes` contains one array of
    /// `width` floats for each component of the global. After the last point, its value repeats.
    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]);

    /// The globals whose derivatives differ from point to point; [`PointSource::fill_deriv`] returns them.
    fn varying_derivs(&self) -> &[Global] {
        &[]
    }

    /// Writes a varying derivative in the layout of [`PointSource::fill`].
    fn fill_deriv(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        let _ = first;
        let deriv = self.deriv(global, axis);
        lanes.chunks_mut(width.max(1)).zip(deriv).for_each(|(lanes, x)| lanes.fill(x));
    }

    /// Whether it answers [`PointSource::trace`] and [`PointSource::message`]. Otherwise programs are
    /// compiled without these queries.
    fn traces(&self) -> bool {
        false
    }

    /// Whether a ray from an origin in a direction hits something. Space: common.
    fn trace(&self, origin: [f32; 3], direction: [f32; 3], point: usize) -> bool {
        let _ = (origin, direction, point);
        false
    }

    /// Whether each of the rays hits something; `hits` has an element for each.
    fn trace_all(&self, rays: &[Ray], hits: &mut [bool]) {
        for (hit, ray) in hits.iter_mut().zip(rays) {
            *hit = self.trace(ray.origin, ray.direction, ray.point);
        }
    }

    /// The value with a name in a source of messages, such as the last ray, with this type.
    fn message(&self, source: &str, name: &str, ty: Type, point: usize) -> Answer {
        let _ = (source, name, ty, point);
        Answer::default()
    }

    /// Writes the value with a name in a source of messages for some points, as for
    /// [`PointSource::fill_attribute`]. Returns `false` if the points have to be asked one by one.
    fn fill_messages(
        &self,
        (source, name): (&str, &str),
        points: &[usize],
        column: &mut DatumColumn<'_>,
    ) -> bool {
        let _ = (source, name, points, column);
        false
    }

    /// A named datum of a point or of an object, or one element of it; `None` if there is none.
    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        let _ = (object, name, element, point);
        None
    }

    /// The scalar global whose values and derivatives a datum has at all points.
    fn attribute_global(&self, object: &str, name: &str, element: Option<usize>) -> Option<Global> {
        let _ = (object, name, element);
        None
    }

    /// Writes a datum of the points from `first` on, equal to that of [`PointSource::attribute`]; after the
    /// last point, its value repeats. Returns `false` if the points have to be asked one by one: the datum is
    /// missing at some, has another type, or the source has no column of it.
    fn fill_attribute(
        &self,
        (object, name, element): (&str, &str, Option<usize>),
        first: usize,
        column: &mut DatumColumn<'_>,
    ) -> bool {
        let _ = (object, name, element, first, column);
        false
    }

    /// Whether [`PointSource::attribute`] gives all points the same answer to a query, so that one point can
    /// ask for all.
    fn attribute_is_shared(&self, object: &str, name: &str, element: Option<usize>) -> bool {
        let _ = (object, name, element);
        false
    }
}
