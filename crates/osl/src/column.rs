//! Columns: a value for each of many points.

use osl_exec::{Datum, DatumColumn};
use osl_ir::ir::{Const, Kind};
use std::borrow::Cow;
use std::ops::Range;

/// A value for each of many points, lent or given.
///
/// ```
/// let given: osl::Column<'_> = vec![0.25_f32, 0.75].into();
/// assert_eq!(given.len(), 2);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Column<'a> {
    /// Floats.
    Floats(Cow<'a, [f32]>),
    /// Ints.
    Ints(Cow<'a, [i32]>),
    /// Colors, points, vectors or normals.
    Triples(Cow<'a, [[f32; 3]]>),
    /// Matrices, row by row.
    Matrices(Cow<'a, [[f32; 16]]>),
    /// Arrays of this many values each, one after the other.
    Arrays(Box<Column<'a>>, usize),
    /// One of four floats of each point.
    OneOfFour(Cow<'a, [[f32; 4]]>, usize),
}

macro_rules! from {
    ($($type:ty => $variant:ident;)*) => {$(
        impl From<Vec<$type>> for Column<'_> {
            fn from(values: Vec<$type>) -> Self {
                Column::$variant(values.into())
            }
        }

        impl<'a> From<&'a [$type]> for Column<'a> {
            fn from(values: &'a [$type]) -> Self {
                Column::$variant(values.into())
            }
        }

        impl<'a> From<&'a Vec<$type>> for Column<'a> {
            fn from(values: &'a Vec<$type>) -> Self {
                Column::$variant(values.into())
            }
        }
    )*};
}

from! {
    f32 => Floats;
    i32 => Ints;
    [f32; 3] => Triples;
    [f32; 16] => Matrices;
}

impl Column<'_> {
    /// The number of points that have a value; a part of an array counts as one more.
    pub fn len(&self) -> usize {
        match self {
            Column::Floats(list) => list.len(),
            Column::Ints(list) => list.len(),
            Column::Triples(list) => list.len(),
            Column::Matrices(list) => list.len(),
            Column::Arrays(all, length) => all.len().div_ceil(*length.max(&1)),
            Column::OneOfFour(list, _) => list.len(),
        }
    }

    /// Whether it has no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Copies values from `first` on to some lanes of each component; the last value repeats after the end.
    /// Ints become floats with the same bits. There are no lanes for arrays.
    pub(crate) fn copy(&self, first: usize, to: Range<usize>, width: usize, lanes: &mut [f32]) {
        match self {
            Column::Triples(list) => triples(list, first, to, width, lanes),
            Column::Matrices(list) => {
                for (component, lanes) in lanes.chunks_mut(width.max(1)).enumerate() {
                    let lanes = lanes.get_mut(to.clone()).unwrap_or_default();
                    take(list, first, lanes, |matrix| matrix.get(component));
                }
            }
            Column::Arrays(..) => {}
            scalars => {
                let lanes = lanes.get_mut(to).unwrap_or_default();
                match scalars {
                    Column::Floats(list) => {
                        let from = list.get(first..).unwrap_or_default();
                        let (now, rest) = lanes.split_at_mut(from.len().min(lanes.len()));
                        now.copy_from_slice(from.get(..now.len()).unwrap_or_default());
                        rest.fill(list.last().copied().unwrap_or_default());
                    }
                    Column::Ints(list) => take(bytemuck::cast_slice(list), first, lanes, |bits| Some(bits)),
                    Column::OneOfFour(list, at) => take(list, first, lanes, |four| four.get(*at)),
                    _ => {}
                }
            }
        }
    }

    /// Whether it has values of the requested type.
    pub(crate) fn suits(&self, column: &DatumColumn<'_>) -> bool {
        let kind = match self {
            Column::Floats(_) | Column::OneOfFour(..) => Kind::Float,
            Column::Ints(_) => Kind::Int,
            Column::Triples(_) => Kind::Triple,
            Column::Matrices(_) => Kind::Matrix,
            Column::Arrays(..) => return false,
        };
        kind == column.kind && column.count == 0
    }

    /// Writes values from `first` on, if they have the requested type.
    pub(crate) fn fill(&self, first: usize, column: &mut DatumColumn<'_>) -> bool {
        let fits = self.suits(column);
        if fits {
            self.copy(first, 0..column.width, column.width, bytemuck::cast_slice_mut(column.words));
        }
        fits
    }

    /// The value of a point, or one element of its array.
    pub(crate) fn datum(&self, at: usize, element: Option<usize>) -> Option<Datum> {
        match (self, element) {
            (Column::Arrays(all, length), None) => {
                let elements = at.checked_mul(*length)?..at.checked_add(1)?.checked_mul(*length)?;
                elements.map(|at| all.value(at)).collect::<Option<Vec<Const>>>().map(Datum::array)
            }
            (Column::Arrays(all, length), Some(element)) if element < *length => {
                all.value(at.checked_mul(*length)?.checked_add(element)?).map(Datum::one)
            }
            (_, None) => self.value(at).map(Datum::one),
            _ => None,
        }
    }

    /// The value of a point, unless it is an array.
    pub(crate) fn value(&self, at: usize) -> Option<Const> {
        Some(match self {
            Column::Floats(list) => Const::Float(*list.get(at)?),
            Column::Ints(list) => Const::Int(*list.get(at)?),
            Column::Triples(list) => Const::Triple(*list.get(at)?),
            Column::Matrices(list) => Const::Matrix(Box::new(*list.get(at)?)),
            Column::Arrays(..) => return None,
            Column::OneOfFour(list, part) => Const::Float(*list.get(at)?.get(*part)?),
        })
    }

    /// The float of a point.
    pub(crate) fn float(&self, at: usize) -> f32 {
        if let Some(Const::Float(x)) = self.value(at) { x } else { 0.0 }
    }

    /// The triple of a point.
    pub(crate) fn triple(&self, at: usize) -> [f32; 3] {
        if let Some(Const::Triple(triple)) = self.value(at) { triple } else { [0.0; 3] }
    }
}

/// Copies a part of each value from `first` on; the last value repeats after the end.
fn take<T>(list: &[T], first: usize, lanes: &mut [f32], part: impl Fn(&T) -> Option<&f32>) {
    let part = |value: &T| part(value).copied().unwrap_or_default();
    let from = list.get(first..).unwrap_or_default();
    let (now, rest) = lanes.split_at_mut(from.len().min(lanes.len()));
    now.iter_mut().zip(from).for_each(|(lane, value)| *lane = part(value));
    rest.fill(list.last().map_or(0.0, part));
}

/// Copies triples from `first` on to some lanes of three components, in one pass; the last one repeats after
/// the end.
fn triples(list: &[[f32; 3]], first: usize, to: Range<usize>, width: usize, lanes: &mut [f32]) {
    let Some((xs, rest)) = lanes.split_at_mut_checked(width) else { return };
    let Some((ys, zs)) = rest.split_at_mut_checked(width) else { return };
    let parts = (xs.get_mut(to.clone()), ys.get_mut(to.clone()), zs.get_mut(to));
    let (Some(xs), Some(ys), Some(zs)) = parts else { return };
    let from = list.get(first..).unwrap_or_default();
    for (((x, y), z), triple) in xs.iter_mut().zip(ys.iter_mut()).zip(zs.iter_mut()).zip(from) {
        [*x, *y, *z] = *triple;
    }
    let last = list.last().copied().unwrap_or_default();
    for (lanes, x) in [xs, ys, zs].into_iter().zip(last) {
        lanes.get_mut(from.len()..).unwrap_or_default().fill(x);
    }
}
