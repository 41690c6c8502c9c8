//! The closures of points after a run, in columns: the kinds, weights and parameters of their components.
//!
//! A component has a row in each column, and its parameters are words of the column of parameters, in the
//! order of its kind.

use osl_ir::ir::{Const, Kind, Shape};
use osl_ir::text::{self, Flavour, Value};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::sync::Arc;

/// A component of a closure: a way to scatter or emit light, with its weight.
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// Red, green and blue factors.
    pub weight: [f32; 3],
    /// Name of the closure.
    pub name: Arc<str>,
    /// Its parameters in order. Copies of a component share them.
    pub params: Arc<[Param]>,
}

/// A parameter of a component.
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    /// The name of a keyword argument.
    pub key: Option<Arc<str>>,
    /// One value, or the elements of an array.
    pub values: SmallVec<[Const; 1]>,
    /// The components, if it is a closure.
    pub closure: Vec<Component>,
}

/// A kind of component that a program makes.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosureKind {
    /// Name of the closure.
    pub name: Arc<str>,
    /// The form of its parameters.
    pub shapes: Vec<Shape>,
}

/// The number of words of one value of a kind; a closure is a list of components.
fn words_of(kind: Kind) -> usize {
    if kind == Kind::Closure { 2 } else { kind.words() as usize }
}

/// Components that follow each other: the first one, and their number.
pub(crate) type List = (u32, u32);

/// A component in its columns.
type RowColumns = (u32, [f32; 3], u32);

/// The components of the points of a tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct Columns {
    kinds: Arc<[ClosureKind]>,
    /// The components of each point.
    points: Vec<List>,
    /// The index of the kind, the weight, and the first word of the parameters of each component.
    rows: Vec<RowColumns>,
    /// The parameters: floats by their bits, strings by their index in `texts`, a list of components as two
    /// words.
    words: Vec<u32>,
    texts: Vec<Arc<str>>,
    numbers: FxHashMap<Arc<str>, u32>,
    /// Bytes of all of it; a string counts wherever it is used, because which points share it depends on the
    /// tiles.
    bytes: u64,
}

impl Columns {
    /// No points yet.
    pub(crate) fn new(kinds: Arc<[ClosureKind]>) -> Columns {
        Columns { kinds, ..Columns::default() }
    }

    /// Bytes of the columns.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Number of points.
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// Adds the parameters of a component. Returns their first word.
    pub(crate) fn params(&mut self, words: &[u32]) -> u32 {
        let start = self.words.len();
        self.words.extend_from_slice(words);
        self.bytes += size_of_val(words) as u64;
        u32::try_from(start).unwrap_or(u32::MAX)
    }

    /// The index of a string.
    pub(crate) fn text(&mut self, text: Arc<str>) -> u32 {
        self.bytes += text.len() as u64;
        let next = self.texts.len() as u32;
        *self.numbers.entry(text).or_insert_with_key(|text| {
            self.texts.push(text.clone());
            next
        })
    }

    /// Adds components, after those of their parameters.
    pub(crate) fn list(&mut self, rows: &[RowColumns]) -> List {
        let first = self.rows.len();
        self.rows.extend_from_slice(rows);
        self.bytes += size_of_val(rows) as u64;
        (u32::try_from(first).unwrap_or(u32::MAX), rows.len() as u32)
    }

    /// Adds a point with these components.
    pub(crate) fn point(&mut self, list: List) {
        self.points.push(list);
        self.bytes += size_of::<List>() as u64;
    }

    fn rows(&self, (first, len): List) -> &[RowColumns] {
        self.rows.get(first as usize..).and_then(|rows| rows.get(..len as usize)).unwrap_or_default()
    }

    /// The components of a list.
    fn list_of(&self, list: List) -> impl Iterator<Item = Row<'_>> {
        self.rows(list).iter().filter_map(|(kind, weight, start)| {
            let words = self.words.get(*start as usize..)?;
            let of = self.kinds.get(*kind as usize)?;
            let length: usize = of.shapes.iter().map(|s| words_of(s.kind) * s.count as usize).sum();
            Some(Row { kind: *kind, weight: *weight, of, words: words.get(..length)?, columns: self })
        })
    }

    /// The components of a point.
    fn of_point(&self, point: usize) -> impl Iterator<Item = Row<'_>> {
        self.list_of(self.points.get(point).copied().unwrap_or_default())
    }

    /// The components of a list, each by itself.
    pub(crate) fn components(&self, list: List) -> Vec<Component> {
        self.list_of(list).filter_map(|row| row.component()).collect()
    }
}

/// A component of a closure at a point, in its columns.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    /// The index of its kind in [`Closures::kinds`].
    pub kind: u32,
    /// Red, green and blue factors.
    pub weight: [f32; 3],
    of: &'a ClosureKind,
    words: &'a [u32],
    columns: &'a Columns,
}

impl<'a> Row<'a> {
    /// Name of the closure.
    pub fn name(&self) -> &'a Arc<str> {
        &self.of.name
    }

    /// The form of a parameter, and its words: floats by their bits.
    pub fn words(&self, param: usize) -> Option<(&'a Shape, &'a [u32])> {
        let mut start = 0;
        for shape in self.of.shapes.get(..param)? {
            start += words_of(shape.kind) * shape.count as usize;
        }
        let shape = self.of.shapes.get(param)?;
        let length = words_of(shape.kind) * shape.count as usize;
        Some((shape, self.words.get(start..start + length)?))
    }

    /// The values of a parameter: one, or the elements of an array. None of a closure.
    pub fn values(&self, param: usize) -> Option<SmallVec<[Const; 1]>> {
        let (shape, words) = self.words(param)?;
        let values = words.chunks_exact(words_of(shape.kind)).filter(|_| shape.kind != Kind::Closure);
        values.map(|words| self.columns.value(shape.kind, words)).collect()
    }

    /// The components of a parameter that is a closure.
    pub fn inner(&self, param: usize) -> impl Iterator<Item = Row<'a>> + use<'a> {
        let words = self.words(param).filter(|(shape, _)| shape.kind == Kind::Closure);
        let columns = self.columns;
        words.into_iter().flat_map(|(_, words)| words.chunks_exact(2)).flat_map(move |words| {
            let list = (words.first().copied().unwrap_or(0), words.get(1).copied().unwrap_or(0));
            columns.list_of(list)
        })
    }

    /// The component by itself, without its columns.
    pub fn component(&self) -> Option<Component> {
        let param = |(at, shape): (usize, &Shape)| {
            let closure = self.inner(at).filter_map(|row| row.component()).collect();
            Some(Param { key: shape.key.clone(), values: self.values(at)?, closure })
        };
        let params: Option<Arc<[Param]>> = self.of.shapes.iter().enumerate().map(param).collect();
        Some(Component { weight: self.weight, name: self.of.name.clone(), params: params? })
    }
}

impl Columns {
    fn value(&self, kind: Kind, words: &[u32]) -> Option<Const> {
        let float = |at: usize| words.get(at).copied().map(f32::from_bits);
        Some(match kind {
            Kind::Int => Const::Int(*words.first()? as i32),
            Kind::Float => Const::Float(float(0)?),
            Kind::Triple => Const::Triple([float(0)?, float(1)?, float(2)?]),
            Kind::Matrix => {
                let mut matrix = [0.0; 16];
                for (at, to) in matrix.iter_mut().enumerate() {
                    *to = float(at)?;
                }
                Const::Matrix(Box::new(matrix))
            }
            Kind::Str => Const::Str(self.texts.get(*words.first()? as usize)?.clone()),
            Kind::Closure => Const::Null,
        })
    }
}

/// A closure output over all points.
#[derive(Clone, Debug, Default)]
pub struct Closures {
    /// Name of the output, `a[2]` for an element of an array.
    pub output: Arc<str>,
    kinds: Arc<[ClosureKind]>,
    tiles: Vec<Columns>,
    /// For each point, in order: its tile, and its number there.
    places: Vec<(u32, u32)>,
}

impl Closures {
    /// The points of some tiles. `position` is the place of a point in the results, by its number over all
    /// tiles.
    pub(crate) fn new(output: Arc<str>, tiles: Vec<Columns>, position: impl Fn(usize) -> usize) -> Closures {
        let mut places = vec![(0, 0); tiles.iter().map(Columns::len).sum()];
        let all =
            tiles.iter().enumerate().flat_map(|(tile, columns)| (0..columns.len()).map(move |at| (tile, at)));
        for (number, (tile, at)) in all.enumerate() {
            if let Some(place) = places.get_mut(position(number)) {
                *place = (tile as u32, at as u32);
            }
        }
        let kinds = tiles.first().map(|columns| columns.kinds.clone()).unwrap_or_default();
        Closures { output, kinds, tiles, places }
    }

    /// Appends the points of the next piece of a run.
    pub(crate) fn append(&mut self, next: Closures) {
        let before = self.tiles.len() as u32;
        self.places.extend(next.places.into_iter().map(|(tile, at)| (before + tile, at)));
        self.tiles.extend(next.tiles);
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    fn place(&self, point: usize) -> Option<(&Columns, usize)> {
        let (tile, at) = self.places.get(point)?;
        Some((self.tiles.get(*tile as usize)?, *at as usize))
    }

    /// The kinds of components that the program makes; not each of them need occur.
    pub fn kinds(&self) -> &[ClosureKind] {
        &self.kinds
    }

    /// The components of a point, in their columns.
    pub fn rows(&self, point: usize) -> impl Iterator<Item = Row<'_>> {
        self.place(point).into_iter().flat_map(|(columns, at)| columns.of_point(at))
    }

    /// The components of a point, each by itself.
    pub fn point(&self, point: usize) -> Vec<Component> {
        self.rows(point).filter_map(|row| row.component()).collect()
    }

    /// Names and weights of the components of a point.
    pub fn weights(&self, point: usize) -> impl Iterator<Item = (&Arc<str>, [f32; 3])> {
        self.rows(point).map(|row| (row.name(), row.weight))
    }
}

/// `(r, g, b) * name (parameters)`.
pub fn show(component: &Component) -> String {
    let [r, g, b] = component.weight.map(number);
    let mut parts: Vec<String> = Vec::new();
    for param in component.params.iter() {
        parts.extend(param.key.iter().map(|key| format!("\"{key}\"")));
        let values: Vec<String> = param.values.iter().map(constant).collect();
        match &values[..] {
            [] | [_] => parts.extend(values),
            several => parts.push(format!("[{}]", several.join(", "))),
        }
        if !param.closure.is_empty() {
            parts.push(param.closure.iter().map(show).collect::<Vec<_>>().join(" + "));
        }
    }
    format!("({r}, {g}, {b}) * {} ({})", component.name, parts.join(", "))
}

fn number(x: f32) -> String {
    text::format("%g", &[Value::Consts(vec![Const::Float(x)])], Flavour::Print, 64)
}

fn constant(value: &Const) -> String {
    let list = |all: &[f32]| format!("({})", all.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", "));
    match value {
        Const::Int(n) => n.to_string(),
        Const::Float(x) => number(*x),
        Const::Triple(t) => list(t),
        Const::Matrix(m) => list(&m[..]),
        Const::Str(s) => format!("\"{s}\""),
        Const::Null => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(kind: Kind, count: u32) -> Shape {
        Shape { kind, count, key: None }
    }

    fn kinds() -> Arc<[ClosureKind]> {
        let plain =
            [shape(Kind::Str, 2), shape(Kind::Triple, 1), shape(Kind::Matrix, 1), shape(Kind::Int, 1)];
        let layer = [shape(Kind::Closure, 1), shape(Kind::Closure, 1)];
        [("plain", plain.to_vec()), ("layer", layer.to_vec()), ("bare", Vec::new())]
            .into_iter()
            .map(|(name, shapes)| ClosureKind { name: name.into(), shapes })
            .collect()
    }

    #[test]
    fn components_come_back_with_their_parameters() {
        let mut columns = Columns::new(kinds());
        let texts = ["a", "b", "a"].map(|text| columns.text(text.into()));
        assert_eq!(texts, [0, 1, 0]);
        let mut words = vec![texts[0], texts[1]];
        words.extend((0..19).map(|at| (at as f32).to_bits()));
        words.push(7);
        let plain = columns.params(&words);
        let inner = columns.list(&[(0, [0.5; 3], plain), (2, [1.0, 2.0, 3.0], 0)]);
        let layer = columns.params(&[inner.0, inner.1, 0, 0]);
        let whole = columns.list(&[(1, [2.0; 3], layer), (2, [0.25; 3], 0)]);
        columns.point(whole);
        columns.point((0, 0));
        let closures = Closures::new("Ci".into(), vec![columns], |number| number);
        assert_eq!(closures.len(), 2);
        let found = closures.point(0);
        let names: Vec<_> = closures.weights(0).map(|(name, weight)| (name.to_string(), weight)).collect();
        assert_eq!(names, [("layer".to_string(), [2.0; 3]), ("bare".to_string(), [0.25; 3])]);
        let text: Vec<String> = found.iter().map(show).collect();
        let matrix: Vec<String> = (3..19).map(|at| at.to_string()).collect();
        let plain =
            format!("(0.5, 0.5, 0.5) * plain ([\"a\", \"b\"], (0, 1, 2), ({}), 7)", matrix.join(", "));
        assert_eq!(
            text,
            [
                format!("(2, 2, 2) * layer ({plain} + (1, 2, 3) * bare ())"),
                "(0.25, 0.25, 0.25) * bare ()".into()
            ]
        );
        assert!(closures.point(1).is_empty() && closures.point(2).is_empty());
    }

    #[test]
    fn points_are_in_the_order_of_the_results() {
        let tile = |weights: &[f32]| {
            let mut columns = Columns::new(kinds());
            for weight in weights {
                let list = columns.list(&[(2, [*weight; 3], 0)]);
                columns.point(list);
            }
            columns
        };
        // The second tile comes first.
        let position = |number: usize| (number + 2) % 5;
        let mut all = Closures::new("Ci".into(), vec![tile(&[2.0, 3.0, 4.0]), tile(&[0.0, 1.0])], position);
        all.append(Closures::new("Ci".into(), vec![tile(&[5.0])], |number| number));
        let weights: Vec<f32> = (0..all.len()).flat_map(|at| all.weights(at).map(|(_, w)| w[0])).collect();
        assert_eq!(weights, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    }

    #[test]
    fn wrong_words_are_no_components() {
        let mut columns = Columns::new(kinds());
        for row in [(9, [1.0; 3], 0), (0, [1.0; 3], 0), (0, [1.0; 3], u32::MAX)] {
            let list = columns.list(&[row]);
            columns.point(list);
        }
        columns.point((3, 9));
        let closures = Closures::new("Ci".into(), vec![columns], |number| number);
        assert!((0..4).all(|at| closures.point(at).is_empty()));
    }
}
