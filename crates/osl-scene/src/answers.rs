//! Answers to attributes under the names that a renderer gives them: values of the points that shaders
//! otherwise read as globals, and constants.
//!
//! This module must not know which renderer it is.

use crate::mesh::Bounds;
use glam::{Mat4, Vec3};
use osl_exec::Datum;
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Const};
use std::collections::BTreeMap;

/// What of a point an attribute is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// The surface coordinates, and 0.
    Uv,
    /// The first surface coordinate.
    U,
    /// The second surface coordinate.
    V,
    /// The position in the box around the object, from 0 to 1; 0.5 along an axis without extent.
    Generated,
    /// The unit tangent along u.
    Tangent,
    /// The position in common space.
    Position,
    /// The normal in common space.
    Normal,
    /// The position in object space.
    ObjectPosition,
    /// The unit normal in object space.
    ObjectNormal,
    /// The place in the picture: 0 to 1 from the left and from the bottom.
    Window,
    /// The origin of object space in common space.
    Location,
    /// A number for each surface, from 0 to 1.
    Random,
    /// The number of the point.
    Index,
    /// The change of u to the next pixel along x.
    Du,
    /// The change of v to the next pixel along y.
    Dv,
}

/// How values answer requests of other types than their own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Types {
    /// Only of their own type; three floats are any triple, or an array.
    #[default]
    Exact,
    /// A float answers triples; two or three floats answer a float, their mean, and triples.
    Mean,
    /// A float answers triples, as in assignments.
    Widen,
}

impl Types {
    /// The datum of an attribute with as many floats.
    pub fn floats(self, values: &[f32]) -> Datum {
        let float = |x: f32| Datum::one(Const::Float(x));
        let triple = |x: [f32; 3]| Datum::one(Const::Triple(x)).or(array(&x));
        match (self, values) {
            (Types::Exact, [x]) => float(*x),
            (_, [x]) => float(*x).or(triple([*x; 3])),
            (Types::Mean, [x, y]) => float((x + y) / 2.0).or(triple([*x, *y, 0.0])),
            (Types::Mean, [x, y, z]) => float((x + y + z) / 3.0).or(triple([*x, *y, *z])),
            (_, [x, y, z]) => triple([*x, *y, *z]),
            (_, values) => array(values),
        }
    }

    /// The datum of an int attribute.
    pub fn int(self, value: i32) -> Datum {
        let own = Datum::one(Const::Int(value));
        if self == Types::Widen { own.or(self.floats(&[value as f32])) } else { own }
    }
}

fn array(values: &[f32]) -> Datum {
    Datum::array(values.iter().copied().map(Const::Float).collect())
}

/// An answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// The same at all points.
    Same(Datum),
    /// A value of the point, of which the attribute has the first floats; none for an int.
    Point(Of, Option<usize>),
}

/// Answers by object and name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answers {
    /// The answers; the object is empty for attributes of the surface.
    pub list: BTreeMap<String, BTreeMap<String, Answer>>,
    /// How values of points answer requests of other types.
    pub types: Types,
    /// Whether other objects have the attributes of the surface.
    pub any_object: bool,
    /// Whether an element that is equal to the length of an array asks for the whole array.
    pub index_is_length: bool,
}

impl Answers {
    /// The answer with a name.
    pub(crate) fn find(&self, object: &str, name: &str) -> Option<&Answer> {
        let own = self.list.get(object);
        let own = own.or_else(|| self.list.get("").filter(|_| self.any_object))?;
        own.get(name)
    }

    /// One element of a datum, or all of it.
    pub(crate) fn part(&self, datum: Datum, element: Option<usize>) -> Option<Datum> {
        let Some(at) = element else { return Some(datum) };
        let whole = std::iter::successors(Some(&datum), |datum| datum.other.as_deref())
            .find(|datum| self.index_is_length && datum.array && datum.values.len() == at)
            .map(|datum| Datum { other: None, ..datum.clone() });
        match (datum.element(at), whole) {
            (Some(element), Some(whole)) => Some(element.or(whole)),
            (element, whole) => element.or(whole),
        }
    }
}

/// Where a surface is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The box around it in object space.
    pub bounds: Bounds,
    /// From object space to common space, for column vectors.
    pub to_common: Mat4,
    /// From common space to the picture: 0 to 1 from the left and from the top. Without it, the picture is
    /// the unit square of the surface coordinates.
    pub to_window: Option<Mat4>,
    /// A number from 0 to 1 that is different for each surface.
    pub random: f32,
}

impl Default for Place {
    fn default() -> Place {
        let bounds = Bounds { min: Vec3::Z, max: Vec3::ONE };
        Place { bounds, to_common: Mat4::IDENTITY, to_window: None, random: 0.5 }
    }
}

/// A point, by its globals and their changes to the next pixel.
pub struct At<'a> {
    /// A global; a scalar is in the first element.
    pub global: &'a dyn Fn(Global) -> [f32; 3],
    /// The change of a global.
    pub change: &'a dyn Fn(Global, Axis) -> [f32; 3],
    /// The number of the point.
    pub index: usize,
}

/// The number of components of a global that attributes are made of.
pub fn components(global: Global) -> usize {
    if matches!(global, Global::U | Global::V) { 1 } else { 3 }
}

impl Of {
    /// The value at a point.
    fn value(self, at: &At<'_>, place: &Place) -> [f32; 3] {
        let global = |global| Vec3::from((at.global)(global));
        let object_position = || place.to_common.inverse().transform_point3(global(Global::P));
        let (u, v) = (|| global(Global::U).x, || global(Global::V).x);
        let value = match self {
            Of::Uv => Vec3::new(u(), v(), 0.0),
            Of::U => Vec3::X * u(),
            Of::V => Vec3::X * v(),
            Of::Generated => {
                let size = place.bounds.max - place.bounds.min;
                let from = object_position() - place.bounds.min;
                Vec3::select(size.cmpgt(Vec3::ZERO), from / size, Vec3::splat(0.5))
            }
            Of::Tangent => global(Global::DPdu).normalize_or_zero(),
            Of::Position => global(Global::P),
            Of::Normal => global(Global::N),
            Of::ObjectPosition => object_position(),
            // Normals are transformed by the transpose of the inverse, here of the way to object space.
            Of::ObjectNormal => {
                place.to_common.transpose().transform_vector3(global(Global::N)).normalize_or_zero()
            }
            Of::Window => match &place.to_window {
                Some(to_window) => {
                    let p = to_window.project_point3(global(Global::P));
                    Vec3::new(p.x, 1.0 - p.y, 0.0)
                }
                None => Vec3::new(u(), v(), 0.0),
            },
            Of::Location => place.to_common.transform_point3(Vec3::ZERO),
            Of::Random => Vec3::X * place.random,
            Of::Index => Vec3::X * at.index as f32,
            Of::Du => Vec3::X * (at.change)(Global::U, Axis::X)[0],
            Of::Dv => Vec3::X * (at.change)(Global::V, Axis::Y)[0],
        };
        value.to_array()
    }

    /// The datum at a point.
    pub(crate) fn datum(self, floats: Option<usize>, types: Types, at: &At<'_>, place: &Place) -> Datum {
        let value = self.value(at, place);
        let Some(n) = floats else {
            return types.int(i32::try_from(at.index).unwrap_or(i32::MAX));
        };
        let datum = types.floats(value.get(..n).unwrap_or(&value));
        let along = match self {
            Of::U => Global::U,
            Of::V => Global::V,
            _ => return datum,
        };
        Datum { derivs: Axis::BOTH.map(|axis| (at.change)(along, axis)[0]), ..datum }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osl_ir::ir::Kind;

    fn at<T>(work: impl FnOnce(&At<'_>) -> T) -> T {
        let global = |global| match global {
            Global::P => [3.0, 4.0, 5.0],
            Global::U => [0.25, 0.0, 0.0],
            Global::V => [0.75, 0.0, 0.0],
            Global::DPdu => [0.0, 2.0, 0.0],
            _ => [0.0, 0.0, 1.0],
        };
        work(&At { global: &global, change: &|_, axis| [axis as usize as f32 + 1.0, 0.0, 0.0], index: 7 })
    }

    #[test]
    fn values_of_points_have_the_types_of_their_attributes() {
        let place = Place {
            bounds: Bounds { min: Vec3::new(1.0, 0.0, 4.0), max: Vec3::new(5.0, 0.0, 6.0) },
            to_common: Mat4::from_translation(Vec3::X),
            ..Place::default()
        };
        let of = |of: Of| at(|at| of.value(at, &place));
        assert_eq!(of(Of::Generated), [0.25, 0.5, 0.5]);
        assert_eq!(of(Of::ObjectPosition), [2.0, 4.0, 5.0]);
        assert_eq!((of(Of::Tangent), of(Of::Location)), ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0]));
        let uv = at(|at| Of::Uv.datum(Some(2), Types::Mean, at, &place));
        let read = |kind, count| uv.of_type(kind, count).map(|datum| datum.values.clone());
        assert_eq!(read(Kind::Float, 0), Some(vec![Const::Float(0.5)]), "the mean");
        assert_eq!(read(Kind::Triple, 0), Some(vec![Const::Triple([0.25, 0.75, 0.0])]));
        assert_eq!((read(Kind::Float, 2), read(Kind::Int, 0)), (None, None));
        let u = at(|at| Of::U.datum(Some(1), Types::Exact, at, &place));
        assert_eq!((u.derivs, u.of_type(Kind::Triple, 0)), ([1.0, 2.0], None));
        let index = at(|at| Of::Index.datum(None, Types::Widen, at, &place));
        assert_eq!(index.of_type(Kind::Float, 0).map(|d| d.values.clone()), Some(vec![Const::Float(7.0)]));
    }

    #[test]
    fn an_index_may_be_a_length() {
        let answers = Answers { index_is_length: true, ..Answers::default() };
        let uv = Types::Exact.floats(&[0.25, 0.75]);
        let part = |at| answers.part(uv.clone(), Some(at));
        assert_eq!(part(2), Some(uv.clone()));
        assert_eq!(part(1), Some(Datum::one(Const::Float(0.75))));
        assert_eq!(part(3), None);
    }
}
