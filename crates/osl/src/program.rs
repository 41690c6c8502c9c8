//! Programs, and the results of running them.

use crate::assign::set_in;
use crate::order::Order;
use crate::points::Source;
use crate::{Closures, Error, Points, Renderer, RunOptions, Value};
use osl_exec::{Arithmetic, Frame, Plane, Run};
use osl_hir::hir;
use osl_ir::ir::{Const, Kind};
use osl_limits::Limits;
use osl_lower::params::ParamValues;
use osl_syntax::source::SourceMap;
use std::ops::Range;
use std::sync::Arc;

/// A compiled group. It may run any number of times, from any thread. A clone shares the machine code and has
/// its own values of live parameters, so each thread of a renderer can keep a clone and set them.
#[derive(Clone, Debug)]
pub struct Program {
    program: osl_exec::Program,
    live: Arc<[Live]>,
    /// Whether it was compiled with rays.
    traces: bool,
    sources: Arc<SourceMap>,
    limits: Limits,
    has_closures: bool,
}

impl Program {
    pub(crate) fn new(
        program: osl_exec::Program,
        (live, traces): (Vec<Live>, bool),
        sources: SourceMap,
        limits: Limits,
        has_closures: bool,
    ) -> Program {
        let (live, sources) = (live.into(), Arc::new(sources));
        Program { program, live, traces, sources, limits, has_closures }
    }

    /// Sets a live parameter for all runs from now on, by the name under which
    /// [`CompileOptions::live`](crate::CompileOptions::live) has it. The results are those of a program that
    /// was compiled with the value, bit for bit, except where the language distinguishes constants: a
    /// quotient by a constant may be infinite, and `isconstant` tells.
    ///
    /// An array has the length that it had when the program was compiled: missing elements are zero.
    ///
    /// # Errors
    /// The program has no such live parameter, or the value is not of its type.
    pub fn set(&mut self, name: &str, value: impl Into<Value>) -> Result<(), Error> {
        let Some(live) = self.live.iter().find(|live| live.name == name) else {
            return Err(Error::new(format!("the program has no live parameter `{name}`")));
        };
        let mut values = ParamValues::default();
        set_in(&live.program, &mut values, &live.param, &value.into()).map_err(Error::new)?;
        for field in &live.fields {
            let Some(given) = values.get(field) else { continue };
            let path = format!("{}.{field}", live.layer);
            let inputs: Vec<usize> = (0..self.program.inputs().len())
                .filter(|at| *self.program.inputs()[*at].name == *path)
                .collect();
            if given.len() > inputs.len() && !inputs.is_empty() {
                let most = inputs.len();
                return Err(Error::new(format!("parameter `{field}` was compiled for {most} elements")));
            }
            for (element, index) in inputs.into_iter().enumerate() {
                let kind = self.program.inputs()[index].value.kind();
                let value = given.get(element).cloned().unwrap_or_else(|| Const::zero(kind));
                self.program.set_input(index, value);
            }
        }
        Ok(())
    }

    /// The names of the live parameters.
    pub fn live(&self) -> impl Iterator<Item = &str> {
        self.live.iter().map(|live| live.name.as_str())
    }

    /// The numbers with which it computes, from [`CompileOptions`](crate::CompileOptions).
    pub fn arithmetic(&self) -> Arithmetic {
        self.program.arithmetic()
    }

    /// Runs at all points, on all cores, without services: there are no attributes, and textures are looked
    /// up below the working directory.
    ///
    /// # Errors
    /// The length of an array differs from the number of points, or a loop does not end.
    pub fn run(&self, points: &Points<'_>) -> Result<Outputs, Error> {
        self.run_with(points, &Renderer::default(), &RunOptions::default())
    }

    /// Runs at all points, with a renderer's services.
    ///
    /// # Errors
    /// Those of [`Program::run`]; also if the run is cancelled.
    pub fn run_with(
        &self,
        points: &Points<'_>,
        renderer: &Renderer,
        options: &RunOptions,
    ) -> Result<Outputs, Error> {
        self.any_points(points, renderer, options, None)
    }

    /// Runs at all points, and passes the values on, tile by tile, from any thread and in any order. So they
    /// need not all be in memory, and are still in the processor's cache. The outputs that come back have
    /// closures, messages and text, but no values.
    ///
    /// ```
    /// use osl::{Group, Points, Renderer, RunOptions, Shader, Tile};
    /// use std::sync::Mutex;
    ///
    /// let shader = Shader::compile("a.osl", "shader a(output float o = 0) { o = 2 * u; }")?;
    /// let program = Group::new().layer("a", &shader).compile(&[])?;
    /// let sum = Mutex::new(0.0);
    /// let add = |tile: Tile<'_>| {
    ///     for word in tile.words[0] {
    ///         *sum.lock().unwrap() += f32::from_bits(*word);
    ///     }
    /// };
    /// let points = Points::new(2).u(vec![0.25, 0.5]);
    /// program.run_tiles(&points, &Renderer::default(), &RunOptions::default(), &add)?;
    /// assert_eq!(sum.into_inner().unwrap(), 1.5);
    /// # Ok::<(), osl::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`Program::run_with`].
    pub fn run_tiles(
        &self,
        points: &Points<'_>,
        renderer: &Renderer,
        options: &RunOptions,
        look: &(dyn Fn(Tile<'_>) + Sync),
    ) -> Result<Outputs, Error> {
        self.any_points(points, renderer, options, Some(look))
    }

    /// What the words of a [`Tile`] are, column by column.
    ///
    /// # Errors
    /// There are more columns than the limits of the group permit.
    pub fn columns(&self) -> Result<Vec<OutputColumn>, Error> {
        let (renderer, points) = (Renderer::default(), Points::new(1));
        let source = Source { points: &points, services: &*renderer.answers, traces: false, order: None };
        let inner = RunOptions::default().inner(&self.limits);
        let planes = Run::new(&self.program, &renderer.services, &source, &inner).planes();
        let column = |p: Plane| OutputColumn {
            output: p.output.to_string(),
            component: p.component,
            is_int: p.kind == Kind::Int,
        };
        let planes = planes.map_err(|error| Error::run(&error, &self.sources))?;
        Ok(planes.into_iter().map(column).collect())
    }

    fn any_points(
        &self,
        points: &Points<'_>,
        renderer: &Renderer,
        options: &RunOptions,
        look: Option<&(dyn Fn(Tile<'_>) + Sync)>,
    ) -> Result<Outputs, Error> {
        points.check()?;
        // The results of other runs are in the order in which points are shaded.
        let order = points.order().filter(|_| look.is_some() && !self.has_closures);
        let source = Source { points, services: &*renderer.answers, traces: self.traces, order };
        let inner = osl_exec::RunOptions { tile: Tile::POINTS, ..options.inner(&self.limits) };
        let progress = |done: usize| options.report(done);
        let run = Run::new(&self.program, &renderer.services, &source, &inner);
        let frame = match look {
            None => run.points(0..points.count(), &progress),
            Some(look) => run.look(0..points.count(), &progress, &|number, words| {
                look(Tile { first: number * Tile::POINTS, words, order });
            }),
        };
        let mut frame = frame.map_err(|error| Error::run(&error, &self.sources))?;
        if let Some(order) = order {
            frame.printed.sort_by_key(|printed| order.position(printed.point));
        }
        let messages = frame.said(|span| {
            self.sources.place(span).map_or_else(String::new, |p| format!("{}:{}", p.file, p.line))
        });
        let messages = messages.into_iter().map(|(error, text)| Message { error, text }).collect();
        Ok(Outputs { frame, messages })
    }
}

/// The values of some points: see [`Program::run_tiles`].
#[derive(Clone, Copy, Debug)]
pub struct Tile<'a> {
    /// For each of [`Program::columns`], a word for each point: the bits of a float, or an int.
    pub words: &'a [&'a [u32]],
    first: usize,
    order: Option<Order>,
}

impl Tile<'_> {
    /// The largest number of points in a tile.
    pub const POINTS: usize = 4096;

    /// The pieces whose points follow each other: the first of the points, and the places of their words.
    pub fn pieces(&self) -> impl Iterator<Item = (usize, Range<usize>)> {
        let count = self.words.first().map_or(0, |words| words.len());
        let whole = self.order.is_none().then_some((self.first, 0..count));
        let pieces = self.order.map(|order| order.runs(self.first, count));
        whole.into_iter().chain(pieces.into_iter().flatten())
    }
}

/// One component of an output.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct OutputColumn {
    /// The name of the output; `a[2]` for an element of an array.
    pub output: String,
    /// Which component: 0 of a scalar, 0 to 2 of a triple, 0 to 15 of a matrix.
    pub component: usize,
    /// Whether its words are ints.
    pub is_int: bool,
}

/// A live parameter.
#[derive(Clone, Debug)]
pub(crate) struct Live {
    /// Its name for the client.
    pub(crate) name: String,
    /// The shader and the layer that have it.
    pub(crate) program: Arc<hir::Program>,
    pub(crate) layer: Arc<str>,
    /// Its name in the shader.
    pub(crate) param: String,
    /// Its parts that are not structs: `s.a`.
    pub(crate) fields: Vec<String>,
}

/// A message of a shader.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Whether it is an error rather than a warning.
    pub error: bool,
    /// The text.
    pub text: String,
}

/// The values of outputs at all points, in their order. Elements of arrays are separate outputs, `a[2]`, and
/// so are fields of structs, `s.a`. Strings are not included; for closures see [`Outputs::closures`].
#[derive(Clone, Debug)]
pub struct Outputs {
    frame: Frame,
    messages: Vec<Message>,
}

impl Outputs {
    /// The names of all outputs, layer by layer.
    pub fn names(&self) -> Vec<&str> {
        let first = self.frame.planes.iter().filter(|p| p.component == 0);
        first.map(|p| &*p.output).collect()
    }

    /// A float output, or an int one as floats.
    pub fn floats(&self, name: &str) -> Option<Vec<f32>> {
        match &self.planes(name)[..] {
            [one] => Some(one.floats()),
            _ => None,
        }
    }

    /// One component of an output at all points, without a copy: 0 of a float, 0 to 2 of a triple, 0 to 15 of
    /// a matrix. `None` for ints.
    pub fn component(&self, name: &str, component: usize) -> Option<&[f32]> {
        let plane = self.frame.planes.iter().find(|p| &*p.output == name && p.component == component)?;
        (plane.kind != Kind::Int).then(|| bytemuck::cast_slice(&plane.words))
    }

    /// A float output in double precision, as accurate as it was computed; or an int one.
    pub fn doubles(&self, name: &str) -> Option<Vec<f64>> {
        match &self.planes(name)[..] {
            [one] => Some(one.doubles()),
            _ => None,
        }
    }

    /// An int output.
    pub fn ints(&self, name: &str) -> Option<Vec<i32>> {
        match &self.planes(name)[..] {
            [one] if one.kind == Kind::Int => Some(one.words.iter().map(|w| *w as i32).collect()),
            _ => None,
        }
    }

    /// A color, point, vector or normal.
    pub fn triples(&self, name: &str) -> Option<Vec<[f32; 3]>> {
        self.grouped(name)
    }

    /// A matrix, row by row.
    pub fn matrices(&self, name: &str) -> Option<Vec<[f32; 16]>> {
        self.grouped(name)
    }

    /// The components of a closure output, or of `Ci`, at each point. It must have been named when the group
    /// was compiled.
    pub fn closures(&self, name: &str) -> Option<Closures<'_>> {
        self.frame.closures.iter().find(|closures| &*closures.output == name).map(Closures)
    }

    /// The messages of the run, each once.
    pub fn messages(&self) -> &[Message] {
        &self.messages
    }

    /// Text that the shader printed, point by point, without text that it writes to files.
    pub fn printed(&self) -> String {
        self.frame.printed.iter().filter(|p| p.file.is_none()).map(|p| p.text.as_str()).collect()
    }

    fn planes(&self, name: &str) -> Vec<&Plane> {
        self.frame.planes.iter().filter(|p| &*p.output == name).collect()
    }

    /// Groups the components of each point.
    fn grouped<const N: usize>(&self, name: &str) -> Option<Vec<[f32; N]>> {
        let planes = self.planes(name);
        if planes.len() != N {
            return None;
        }
        let mut all = vec![[0.0; N]; planes.first()?.words.len()];
        for (component, plane) in planes.iter().enumerate() {
            for (point, word) in all.iter_mut().zip(&plane.words) {
                if let Some(x) = point.get_mut(component) {
                    *x = f32::from_bits(*word);
                }
            }
        }
        Some(all)
    }
}
