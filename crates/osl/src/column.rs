//! Columns: a value for each of many points.

use osl_exec::DatumColumn;
use osl_ir::ir::{Const, Kind};
use std::borrow::Cow;

/// A value for each of many points, lent or given: floats, ints, or triples.
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
}

impl Column<'_> {
    /// The number of values.
    pub fn len(&self) -> usize {
        match self {
            Column::Floats(list) => list.len(),
            Column::Ints(list) => list.len(),
            Column::Triples(list) => list.len(),
            Column::OneOfFour(list, _) => list.len(),
        }
    }

    /// Whether it has no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Copies values from `first` on, component by component; the last value repeats after the end. Ints
    /// become floats with the same bits.
    pub(crate) fn copy(&self, first: usize, width: usize, lanes: &mut [f32]) {
        match self {
            Column::Floats(list) => {
                let from = list.get(first..).unwrap_or_default();
                let (now, rest) = lanes.split_at_mut(from.len().min(lanes.len()));
                now.copy_from_slice(from.get(..now.len()).unwrap_or_default());
                rest.fill(list.last().copied().unwrap_or_default());
            }
            Column::Ints(list) => take(bytemuck::cast_slice(list), first, lanes, |bits| Some(bits)),
            Column::Triples(list) => {
                for (component, lanes) in lanes.chunks_mut(width.max(1)).enumerate() {
                    take(list, first, lanes, |triple| triple.get(component));
                }
            }
            Column::OneOfFour(list, at) => take(list, first, lanes, |four| four.get(*at)),
        }
    }

    /// Writes values from `first` on, if they have the requested type.
    pub(crate) fn fill(&self, first: usize, column: &mut DatumColumn<'_>) -> bool {
        let kind = match self {
            Column::Floats(_) | Column::OneOfFour(..) => Kind::Float,
            Column::Ints(_) => Kind::Int,
            Column::Triples(_) => Kind::Triple,
        };
        let fits = kind == column.kind && column.count == 0;
        if fits {
            self.copy(first, column.width, bytemuck::cast_slice_mut(column.words));
        }
        fits
    }

    /// The value of a point.
    pub(crate) fn value(&self, at: usize) -> Option<Const> {
        Some(match self {
            Column::Floats(list) => Const::Float(*list.get(at)?),
            Column::Ints(list) => Const::Int(*list.get(at)?),
            Column::Triples(list) => Const::Triple(*list.get(at)?),
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
