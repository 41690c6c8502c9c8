//! Where shading points come from, as the interpreter sees it.

use crate::order::Blocks;
use osl_ir::hir::Global;
use osl_ir::ir::{Axis, Const};
use osl_ir::types::Type;

/// A named datum of a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Datum {
    /// Its values: one, or the elements of an array.
    pub values: Vec<Const>,
    /// Whether it is an array.
    pub array: bool,
    /// How a single float changes to the next pixel along x and along y.
    pub slopes: [f32; 2],
}

impl Datum {
    /// A value that does not change.
    pub fn one(value: Const) -> Datum {
        Datum { values: vec![value], array: false, slopes: [0.0; 2] }
    }

    /// An array.
    pub fn array(values: Vec<Const>) -> Datum {
        Datum { values, array: true, slopes: [0.0; 2] }
    }
}

/// What a source of messages answers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answer {
    /// Whether there is an answer.
    pub found: bool,
    /// The values of the asked type: one, or the elements of an array. `None` leaves the shader's variable as it is.
    pub values: Option<Vec<Const>>,
}

/// A set of shading points.
pub trait PointSource: Sync {
    /// How many there are.
    fn count(&self) -> usize;

    /// The order of the points on an image; `None` is row by row, or any other that results are to have too.
    fn blocks(&self) -> Option<Blocks> {
        None
    }

    /// The pixel that a point belongs to, row by row, by the point's position on the image; its position, where each pixel
    /// has one point.
    fn pixel(&self, position: usize) -> usize {
        position
    }

    /// The globals that differ from point to point.
    fn varying(&self) -> &[Global];

    /// The value of a global that all points share; scalars in the first element. Space: common.
    fn uniform(&self, global: Global) -> [f32; 3];

    /// How a global changes from a pixel to its neighbour along an axis; scalars in the first element.
    fn slope(&self, global: Global, axis: Axis) -> [f32; 3];

    /// Writes a varying global for the points from `first` on. **Shape:** `lanes` holds as many arrays of `width`
    /// floats as the global has components. Points past the last repeat the last one.
    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]);

    /// The globals whose slopes differ from point to point; [`PointSource::fill_slope`] gives them.
    fn varying_slopes(&self) -> &[Global] {
        &[]
    }

    /// Writes a varying slope, in the form of [`PointSource::fill`].
    fn fill_slope(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        let _ = first;
        let slope = self.slope(global, axis);
        lanes.chunks_mut(width.max(1)).zip(slope).for_each(|(lanes, x)| lanes.fill(x));
    }

    /// Whether it answers [`PointSource::trace`] and [`PointSource::message`]. Programs for one that does not are compiled
    /// without the questions.
    fn traces(&self) -> bool {
        false
    }

    /// Whether a ray from an origin in a direction hits something. Space: common.
    fn trace(&self, origin: [f32; 3], direction: [f32; 3], point: usize) -> bool {
        let _ = (origin, direction, point);
        false
    }

    /// What a source of messages, such as the last ray, knows of a name, as a value of this type.
    fn message(&self, source: &str, name: &str, ty: Type, point: usize) -> Answer {
        let _ = (source, name, ty, point);
        Answer::default()
    }

    /// A named datum of a point or of an object, or one element of it; `None` if there is none.
    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        let _ = (object, name, element, point);
        None
    }
}
