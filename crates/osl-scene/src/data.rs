//! Points with additional data: user data and attributes by name.

use crate::answers::{Answer, Answers, At, Place, components};
use osl_exec::{Blocks, Datum, PointSource, left_handed};
use osl_ir::global::Global;
use osl_ir::ir::Axis;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Data that are the same at all points: globals, and data by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Data {
    /// Globals that are the same at all points, in place of those of the points; a scalar is in the first
    /// element.
    pub globals: BTreeMap<Global, [f32; 3]>,
    /// User data of the surface: the values of interpolated parameters, and attributes of no object.
    pub user: BTreeMap<String, Datum>,
    /// Attributes of no object; user data with the same name come first if they have the requested type.
    pub attributes: BTreeMap<String, Datum>,
    /// Attributes of objects, by object and name.
    pub objects: BTreeMap<String, BTreeMap<String, Datum>>,
    /// Answers to attributes that neither these data nor the points have.
    pub answers: Arc<Answers>,
    /// Where the surface of the points is.
    pub place: Place,
}

impl Data {
    /// A datum, or one element of an array.
    pub fn find(&self, object: &str, name: &str, element: Option<usize>) -> Option<Datum> {
        let (first, second) = match object {
            "" => (self.user.get(name), self.attributes.get(name)),
            _ => (self.objects.get(object)?.get(name), None),
        };
        let found = |datum: &Datum| match element {
            None => Some(datum.clone()),
            Some(at) => datum.element(at),
        };
        [first, second].into_iter().flatten().filter_map(found).reduce(Datum::or)
    }

    /// The answer to an attribute of a point, after what is known of it.
    pub fn answered(
        &self,
        known: Option<Datum>,
        (object, name, element): (&str, &str, Option<usize>),
        at: &At<'_>,
    ) -> Option<Datum> {
        let answer = self.answers.find(object, name).and_then(|answer| {
            let datum = match answer {
                Answer::Same(datum) => datum.clone(),
                Answer::Point(of, floats) => of.datum(*floats, self.answers.types, at, &self.place),
            };
            self.answers.part(datum, element)
        });
        match (known, answer) {
            (Some(known), Some(answer)) => Some(known.or(answer)),
            (known, answer) => known.or(answer),
        }
    }
}

/// The points of a source, with data.
#[derive(Clone, Debug)]
pub struct WithData<S> {
    /// The points.
    pub points: S,
    /// Their data; data not found here are requested from the points.
    pub data: Data,
}

impl<S: PointSource> PointSource for WithData<S> {
    fn count(&self) -> usize {
        self.points.count()
    }

    fn blocks(&self) -> Option<Blocks> {
        self.points.blocks()
    }

    fn pixel(&self, position: usize) -> usize {
        self.points.pixel(position)
    }

    fn varying(&self) -> &[Global] {
        self.points.varying()
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        let globals = &self.data.globals;
        match (globals.get(&global), global, globals.get(&Global::N)) {
            (Some(value), ..) => *value,
            (None, Global::LeftHanded, Some(n)) => {
                let [dx, dy] = Axis::BOTH.map(|axis| self.points.deriv(Global::P, axis));
                [left_handed(dx, dy, *n), 0.0, 0.0]
            }
            _ => self.points.uniform(global),
        }
    }

    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        self.points.deriv(global, axis)
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        self.points.fill(global, first, width, lanes);
    }

    fn varying_derivs(&self) -> &[Global] {
        self.points.varying_derivs()
    }

    fn fill_deriv(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        self.points.fill_deriv(global, axis, first, width, lanes);
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        let own = self.data.find(object, name, element);
        let known = own.or_else(|| self.points.attribute(object, name, element, point));
        let global = |global: Global| {
            if !self.points.varying().contains(&global) {
                return self.uniform(global);
            }
            let mut lanes = [0.0; 3];
            self.points.fill(global, point, 1, &mut lanes[..components(global)]);
            lanes
        };
        let change = |global: Global, axis: Axis| {
            let mut lanes = [0.0; 3];
            match self.points.varying_derivs().contains(&global) {
                true => self.points.fill_deriv(global, axis, point, 1, &mut lanes[..components(global)]),
                false => lanes = self.points.deriv(global, axis),
            }
            lanes
        };
        self.data.answered(
            known,
            (object, name, element),
            &At { global: &global, change: &change, index: point },
        )
    }

    fn attribute_global(&self, object: &str, name: &str, element: Option<usize>) -> Option<Global> {
        let is_given = self.data.find(object, name, element).is_some();
        if is_given { None } else { self.points.attribute_global(object, name, element) }
    }

    fn attribute_is_shared(&self, object: &str, name: &str, element: Option<usize>) -> bool {
        if let Some(Answer::Point(..)) = self.data.answers.find(object, name) {
            return false;
        }
        self.data.find(object, name, element).is_some()
            || self.points.attribute_is_shared(object, name, element)
            || (self.data.answers.find(object, name).is_some()
                && self.points.attribute(object, name, element, 0).is_none())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Grid;
    use osl_ir::ir::{Const, Kind};

    #[test]
    fn user_data_go_before_attributes_and_objects_have_their_own() {
        let mut data = Data::default();
        let float = |x| Datum::one(Const::Float(x));
        data.user.insert("a".into(), float(1.0));
        data.attributes.insert("a".into(), float(2.0));
        data.attributes.insert("list".into(), Datum::array(vec![Const::Int(4), Const::Int(5)]));
        data.objects.entry("box".into()).or_default().insert("a".into(), float(3.0));
        assert_eq!(data.find("", "a", None), Some(float(1.0).or(float(2.0))));
        assert_eq!(data.find("box", "a", None), Some(float(3.0)));
        assert_eq!(data.find("sphere", "a", None), None);
        assert_eq!(data.find("", "list", Some(1)), Some(Datum::one(Const::Int(5))));
        assert_eq!(data.find("", "list", Some(2)), None);
        assert_eq!(data.find("", "a", Some(0)), None, "not an array");

        data.user
            .insert("id".into(), Datum::one(Const::Str("x".into())).or(Datum::array(vec![Const::Int(8)])));
        data.attributes.insert("id".into(), Datum::one(Const::Int(7)));
        let of = |kind, count| {
            data.find("", "id", None).and_then(|found| Some(found.of_type(kind, count)?.values.clone()))
        };
        assert_eq!(of(Kind::Int, 0), Some(vec![Const::Int(7)]), "user data of another type hide nothing");
        assert_eq!(of(Kind::Int, 1), Some(vec![Const::Int(8)]));
        assert_eq!(of(Kind::Float, 0), None);
        assert_eq!(data.find("", "id", Some(0)), Some(Datum::one(Const::Int(8))));
    }

    #[test]
    fn a_given_normal_settles_the_handedness() {
        let with = |scale: [f32; 2], n: Option<[f32; 3]>| {
            let mut data = Data::default();
            data.globals.extend(n.map(|n| (Global::N, n)));
            let points = WithData { points: Grid { scale, ..Grid::new(5, 3) }, data };
            points.uniform(Global::LeftHanded)[0]
        };
        assert_eq!((with([1.0; 2], None), with([-1.0, 1.0], None)), (0.0, 1.0));
        assert_eq!(with([1.0; 2], Some([0.0, 0.0, -1.0])), 1.0);
        assert_eq!(with([-1.0, 1.0], Some([0.0, 0.0, -1.0])), 0.0);
    }

    #[test]
    fn shared_attributes_are_the_same_at_all_points() {
        let mut data = Data::default();
        data.attributes.insert("s".into(), Datum::one(Const::Float(1.0)));
        data.objects.entry("box".into()).or_default().insert("a".into(), Datum::one(Const::Int(2)));
        let points = WithData { points: Grid::new(5, 3), data };
        let mut shared = 0;
        for object in ["", "box"] {
            for name in ["s", "t", "a", "unknown"] {
                let at = |point| points.attribute(object, name, None, point);
                let all: Vec<_> = (0..points.count()).map(at).collect();
                let is_shared = points.attribute_is_shared(object, name, None);
                assert_eq!(is_shared, all.iter().all(|datum| *datum == all[0]), "{object} {name}");
                shared += usize::from(is_shared);
            }
        }
        assert_eq!(shared, 7, "all but t");
    }
}
