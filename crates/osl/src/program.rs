//! Programs, and the results of running them.

use crate::points::Source;
use crate::{Closure, Error, Points, Renderer};
use osl_exec::{Frame, Plane, RunOptions};
use osl_ir::ir::Kind;
use osl_limits::Limits;
use osl_syntax::source::SourceMap;

/// A compiled group. It may run any number of times, from any thread.
#[derive(Debug)]
pub struct Program {
    program: osl_exec::Program,
    sources: SourceMap,
    limits: Limits,
}

impl Program {
    pub(crate) fn new(program: osl_exec::Program, sources: SourceMap, limits: Limits) -> Program {
        Program { program, sources, limits }
    }

    /// Runs at all points, on all cores, without services: there are no attributes, and textures are looked
    /// up below the working directory.
    ///
    /// # Errors
    /// The length of an array differs from the number of points, or a loop does not end.
    pub fn run(&self, points: &Points) -> Result<Outputs, Error> {
        self.run_with(points, &Renderer::default())
    }

    /// Runs at all points, on all cores, with a renderer's services.
    ///
    /// # Errors
    /// Those of [`Program::run`].
    pub fn run_with(&self, points: &Points, renderer: &Renderer) -> Result<Outputs, Error> {
        points.check()?;
        let source = Source { points, services: &*renderer.answers };
        let options = RunOptions { closures: true, limits: self.limits.clone(), ..RunOptions::default() };
        let frame = osl_exec::run(&self.program, &renderer.services, &source, &options, &|_| ());
        let frame = frame.map_err(Error::new)?;
        let messages = frame.said(|span| {
            self.sources.place(span).map_or_else(String::new, |p| format!("{}:{}", p.file, p.line))
        });
        let messages = messages.into_iter().map(|(error, text)| Message { error, text }).collect();
        Ok(Outputs { frame, messages })
    }
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
    pub fn closures(&self, name: &str) -> Option<Vec<Vec<Closure>>> {
        let found = self.frame.closures.iter().find(|closures| &*closures.output == name)?;
        let point = |list: &Vec<osl_exec::Component>| list.iter().map(Closure::new).collect();
        Some(found.points.iter().map(point).collect())
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
