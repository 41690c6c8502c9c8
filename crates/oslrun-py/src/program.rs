//! Programs, run at arrays of points. Values go straight from the tiles of a run into the arrays of Python.

use crate::error::raised;
use crate::services::{Answers, Services};
use crate::shader::Given;
use crate::values;
use crate::work::detached;
use numpy::{Element, PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use osl::{Column, OutputColumn, Points, RunOptions, Tile};
use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyList;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// A compiled program.
#[pyclass(frozen, module = "oslrun._native")]
pub(crate) struct Program {
    program: osl::Program,
    outs: Vec<Out>,
}

/// An output: an array, a triple, a matrix, or arrays of these.
struct Out {
    name: String,
    /// The first of its columns in a tile, which follow each other.
    first: usize,
    is_int: bool,
    /// Whether its columns are elements of an array.
    is_array: bool,
    elements: usize,
    components: usize,
}

impl Out {
    fn width(&self) -> usize {
        self.elements * self.components
    }

    fn shape(&self) -> Vec<usize> {
        let own: &[usize] = match self.components {
            1 => &[],
            16 => &[4, 4],
            _ => &[3],
        };
        self.is_array.then_some(self.elements).into_iter().chain(own.iter().copied()).collect()
    }
}

/// The name of an output without the index of an element at its end.
fn base(column: &OutputColumn) -> Option<&str> {
    column.output.strip_suffix(']')?.rsplit_once('[').map(|(base, _)| base)
}

/// A list of floats of one global: its name, and the numbers point by point.
type List<'a> = (&'a str, &'a [f32]);
/// The data of the points with a name: their kind, the length of an array, and an array or a value.
type Named<'py> = (String, String, Option<usize>, Bound<'py, PyAny>);

impl Program {
    pub(crate) fn new(program: osl::Program) -> Result<Program, osl::Error> {
        let mut outs: Vec<Out> = Vec::new();
        for (first, column) in program.columns()?.iter().enumerate() {
            let name = base(column).unwrap_or(&column.output);
            let is_array = base(column).is_some();
            let is_next = |out: &Out| out.name == name && (is_array && out.is_array || column.component > 0);
            if !outs.last().is_some_and(is_next) {
                let (name, is_int) = (name.to_string(), column.is_int);
                outs.push(Out { name, first, is_int, is_array, elements: 0, components: 0 });
            }
            if let Some(out) = outs.last_mut() {
                out.elements += usize::from(column.component == 0);
                out.components = out.components.max(column.component + 1);
            }
        }
        Ok(Program { program, outs })
    }

    /// Points with lists of globals.
    pub(crate) fn points<'a>(count: usize, lists: impl Iterator<Item = List<'a>>) -> PyResult<Points<'a>> {
        let mut points = Points::new(count);
        let (mut dx, mut dy) = (None, None);
        for (name, list) in lists {
            let triples = list.as_chunks::<3>().0;
            points = match name {
                "u" => points.u(list),
                "v" => points.v(list),
                "time" => points.time(list),
                "dtime" => points.dtime(list),
                "surfacearea" => points.surface_area(list),
                "backfacing" => points.backfacing(list),
                "P" => points.p(triples),
                "N" => points.n(triples),
                "Ng" => points.ng(triples),
                "I" => points.i(triples),
                "dPdu" => points.dpdu(triples),
                "dPdv" => points.dpdv(triples),
                "Ps" => points.ps(triples),
                "dPdtime" => points.dpdtime(triples),
                "uv_derivs" => points.uv_derivs(list.as_chunks::<4>().0),
                "dPdx" | "dPdy" => {
                    *(if name == "dPdx" { &mut dx } else { &mut dy }) = Some(triples);
                    points
                }
                _ => return Err(PyKeyError::new_err(format!("there is no global `{name}`"))),
            };
        }
        Ok(match (dx, dy) {
            (Some(dx), Some(dy)) => points.p_derivs(dx, dy),
            _ => points,
        })
    }
}

/// The numbers of an array that lie one after the other.
fn slice<'a, T: Element>(name: &str, array: &'a PyReadonlyArrayDyn<'_, T>) -> PyResult<&'a [T]> {
    array.as_slice().map_err(|why| PyValueError::new_err(format!("`{name}`: {why}")))
}

/// An array of numbers that stay with Python.
enum Numbers<'py> {
    Floats(PyReadonlyArrayDyn<'py, f32>),
    Ints(PyReadonlyArrayDyn<'py, i32>),
    Same(osl::Value),
}

impl<'py> Numbers<'py> {
    fn of((name, kind, _, object): &Named<'py>) -> PyResult<Numbers<'py>> {
        let wrong = |why: PyErr| PyTypeError::new_err(format!("`{name}`: {}", why.value(object.py())));
        let given = match kind.as_str() {
            "int" => object.extract().map(Numbers::Ints),
            "float" | "triple" | "matrix" => object.extract().map(Numbers::Floats),
            kind => values::of_kind(kind, object).map(Numbers::Same),
        };
        given.map_err(wrong)
    }

    /// Adds the data to points.
    fn add<'a>(&'a self, points: Points<'a>, (name, kind, length, _): &Named<'_>) -> PyResult<Points<'a>> {
        let column: Column<'a> = match (self, kind.as_str()) {
            (Numbers::Same(value), _) => return Ok(points.data_everywhere(name, value.clone())),
            (Numbers::Ints(array), _) => slice(name, array)?.into(),
            (Numbers::Floats(array), "triple") => slice(name, array)?.as_chunks::<3>().0.into(),
            (Numbers::Floats(array), "matrix") => slice(name, array)?.as_chunks::<16>().0.into(),
            (Numbers::Floats(array), _) => slice(name, array)?.into(),
        };
        Ok(points.data(
            name,
            match length {
                Some(length) => Column::Arrays(Box::new(column), *length),
                None => column,
            },
        ))
    }
}

/// An array that takes an output.
enum Target<'py> {
    Floats(PyReadwriteArrayDyn<'py, f32>),
    Ints(PyReadwriteArrayDyn<'py, i32>),
}

impl<'py> Target<'py> {
    fn of(out: &Out, object: &Bound<'py, PyAny>) -> PyResult<Target<'py>> {
        Ok(match out.is_int {
            true => Target::Ints(object.extract()?),
            false => Target::Floats(object.extract()?),
        })
    }

    /// Its words, if there are as many as are written.
    fn words(&mut self, wanted: Option<usize>) -> PyResult<&mut [u32]> {
        let wrong = || PyValueError::new_err("an array for an output is not contiguous, or of another size");
        let words: &mut [u32] = match self {
            Target::Floats(array) => bytemuck::cast_slice_mut(array.as_slice_mut().map_err(|_| wrong())?),
            Target::Ints(array) => bytemuck::cast_slice_mut(array.as_slice_mut().map_err(|_| wrong())?),
        };
        if Some(words.len()) == wanted { Ok(words) } else { Err(wrong()) }
    }
}

/// Where and with whom a program runs.
#[derive(FromPyObject)]
struct Setting<'py> {
    renderer: PyRef<'py, Renderer>,
    services: Option<Py<PyAny>>,
    shape: Vec<usize>,
    threads: Option<usize>,
    closures: Vec<String>,
}

/// What a run says: messages, each with whether it is an error; printed text; the closures of outputs.
type Said<'py> = (Vec<(bool, String)>, String, Bound<'py, PyList>);

#[pymethods]
impl Program {
    /// The outputs: name, whether it is of ints, and the shape of a value.
    fn outputs(&self) -> Vec<(&str, bool, Vec<usize>)> {
        self.outs.iter().map(|out| (out.name.as_str(), out.is_int, out.shape())).collect()
    }

    /// Runs at some points. `lists` have a value for each point, `same` one for all of them.
    fn run<'py>(
        &self,
        py: Python<'py>,
        lists: Vec<(String, PyReadonlyArrayDyn<'py, f32>)>,
        same: Vec<(String, [f32; 3])>,
        named: Vec<Named<'py>>,
        targets: Vec<Bound<'py, PyAny>>,
        setting: Setting<'py>,
    ) -> PyResult<Said<'py>> {
        let count = setting.shape.iter().try_fold(1_usize, |product, n| product.checked_mul(*n));
        let count = count.ok_or_else(|| PyValueError::new_err("there are too many points"))?;
        let slices = lists.iter().map(|(name, array)| Ok((name.as_str(), slice(name, array)?)));
        let slices = slices.collect::<PyResult<Vec<List<'_>>>>()?;
        let mut points = Program::points(count, slices.into_iter())?;
        for (name, value) in &same {
            points = points.everywhere(name, *value).map_err(|error| raised(py, &error))?;
        }
        let numbers = named.iter().map(Numbers::of).collect::<PyResult<Vec<_>>>()?;
        for (named, numbers) in named.iter().zip(&numbers) {
            points = numbers.add(points, named)?;
        }
        let targets = self.outs.iter().zip(&targets).map(|(out, target)| Target::of(out, target));
        let mut targets = targets.collect::<PyResult<Vec<_>>>()?;
        // Rows that are shorter than a block gain nothing.
        let row = setting.shape.last().copied().filter(|row| setting.shape.len() > 1 && *row >= BAND_ROWS);
        if let Some(row) = row {
            points = points.row(row);
        }
        let bands = self.bands(count, row.filter(|_| setting.closures.is_empty()), &mut targets)?;
        let answers = setting.services.map(|object| {
            let has_spaces = object.bind(py).hasattr("transform").unwrap_or(true);
            Arc::new(Answers::new(object, setting.shape, has_spaces))
        });
        let renderer = match &answers {
            Some(answers) => setting.renderer.0.answering(Services(answers.clone())),
            None => setting.renderer.0.clone(),
        };
        let result = detached(py, |cancel| {
            if let Some(answers) = &answers {
                answers.stop(cancel);
            }
            let mut options = RunOptions::default().cancel(cancel);
            if let Some(threads) = setting.threads {
                options = options.threads(threads.max(1));
            }
            self.program.run_tiles(&points, &renderer, &options, &|tile| self.put(&bands, tile))
        })?;
        if let Some(error) = answers.and_then(|answers| answers.error()) {
            return Err(error);
        }
        let outputs = result.map_err(|error| raised(py, &error))?;
        let messages = outputs.messages().iter().map(|m| (m.error, m.text.clone())).collect();
        let closures = PyList::empty(py);
        for name in &setting.closures {
            if let Some(columns) = outputs.closures(name) {
                closures.append((name, crate::services::closures(py, columns)?))?;
            }
        }
        Ok((messages, outputs.printed(), closures))
    }
}

/// Bands of points that follow each other, and for each its part of each array. Several tiles may write in
/// one.
struct Bands<'a> {
    /// The number of points in a band.
    points: usize,
    parts: Vec<Mutex<Vec<&'a mut [u32]>>>,
}

impl Program {
    fn bands<'a>(
        &self,
        count: usize,
        row: Option<usize>,
        targets: &'a mut [Target<'_>],
    ) -> PyResult<Bands<'a>> {
        // Tiles of an image are blocks of some rows; a band has several rows, so that few tiles share two.
        let points = row.map_or(Tile::POINTS, |row| row.saturating_mul(BAND_ROWS));
        let parts: Vec<Mutex<_>> = (0..count.div_ceil(points)).map(|_| Mutex::new(Vec::new())).collect();
        for (out, target) in self.outs.iter().zip(targets) {
            let words = target.words(count.checked_mul(out.width()))?;
            for (band, part) in parts.iter().zip(words.chunks_mut(points.saturating_mul(out.width()).max(1)))
            {
                band.lock().unwrap_or_else(PoisonError::into_inner).push(part);
            }
        }
        Ok(Bands { points, parts })
    }

    /// Writes a tile into the arrays.
    fn put(&self, bands: &Bands<'_>, tile: Tile<'_>) {
        let mut open = None;
        for (band, at, words) in tile.pieces().flat_map(|piece| split(piece, bands.points)) {
            if open.as_ref().is_none_or(|(other, _)| *other != band) {
                // Never two at once, so that no two threads wait for each other.
                drop(open.take());
                let Some(parts) = bands.parts.get(band) else { return };
                open = Some((band, parts.lock().unwrap_or_else(PoisonError::into_inner)));
            }
            let Some((_, parts)) = &mut open else { return };
            for (out, part) in self.outs.iter().zip(parts.iter_mut()) {
                let width = out.width();
                let to = part.get_mut(at * width..(at + words.len()) * width).unwrap_or_default();
                let columns = tile.words.get(out.first..out.first + width).unwrap_or_default();
                put_values(columns.iter().filter_map(|column| column.get(words.clone())), width, to);
            }
        }
    }
}

/// Writes the words of values of this many words, from a column for each word.
fn put_values<'a>(mut columns: impl Iterator<Item = &'a [u32]>, width: usize, to: &mut [u32]) {
    match width {
        1 => {
            if let Some(from) = columns.next().filter(|from| from.len() == to.len()) {
                to.copy_from_slice(from);
            }
        }
        3 => {
            let (Some(xs), Some(ys), Some(zs)) = (columns.next(), columns.next(), columns.next()) else {
                return;
            };
            let values = to.as_chunks_mut::<3>().0;
            for (((value, x), y), z) in values.iter_mut().zip(xs).zip(ys).zip(zs) {
                *value = [*x, *y, *z];
            }
        }
        _ => {
            for (place, from) in columns.enumerate() {
                let to = to.iter_mut().skip(place).step_by(width.max(1));
                to.zip(from).for_each(|(to, word)| *to = *word);
            }
        }
    }
}

/// The parts of a piece that are in one band each: the band, the first point in it, and the places of the
/// words.
fn split(
    (first, mut words): (usize, Range<usize>),
    points: usize,
) -> impl Iterator<Item = (usize, usize, Range<usize>)> {
    let (mut band, mut at) = (first / points, first % points);
    std::iter::from_fn(move || {
        let length = (points - at).min(words.len());
        let part = (band, at, words.start..words.start + length);
        (band, at, words.start) = (band + 1, 0, words.start + length);
        (length > 0).then_some(part)
    })
}

/// Rows of an image in a band: as many as in a block.
const BAND_ROWS: usize = 32;

/// The textures of runs, which are kept between them.
#[pyclass(frozen, module = "oslrun._native")]
pub(crate) struct Renderer(pub(crate) osl::Renderer);

/// Textures of Python, and those of folders where these have none.
struct Textures(Arc<Given>);

impl osl::RendererServices for Textures {
    fn files(&self) -> Option<Arc<dyn osl::Files>> {
        Some(self.0.clone())
    }

    fn has_spaces(&self) -> bool {
        false
    }
}

#[pymethods]
impl Renderer {
    /// `textures` are files by name.
    #[new]
    fn new(textures: BTreeMap<String, Vec<u8>>, folders: Vec<PathBuf>) -> Renderer {
        Renderer(osl::Renderer::new(Textures(Arc::new(Given::new(&textures, folders)))))
    }
}
