//! The options of reading, compiling and running.

use crate::{Points, Renderer};
use osl_exec::{Arithmetic, Isa};
use osl_ir::global::Global;
use osl_limits::{Cancel, Limits};
use osl_syntax::Version;
use std::fmt;
use std::sync::Arc;

/// How to read a text. With `ReadOptions::default()`, everything is accepted that can be understood.
///
/// ```
/// let options = osl::ReadOptions::default().define("SCALE", "2").strict(true);
/// let shader = osl::Shader::read("a.osl", "shader a(float x = SCALE) {}", &osl::NoFiles, &options)?;
/// assert_eq!(shader.params()[0].default, Some(2.0.into()));
/// # Ok::<(), osl::Error>(())
/// ```
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct ReadOptions {
    /// Macros to define first: name and text.
    pub defines: Vec<(String, String)>,
    /// Whether to accept only what the reference compiler accepts.
    pub strict: bool,
    /// The version of the language.
    pub version: Version,
    /// The limits of reading.
    pub limits: Limits,
}

impl ReadOptions {
    /// Defines a macro before the first line.
    #[must_use]
    pub fn define(mut self, name: &str, text: &str) -> ReadOptions {
        self.defines.push((name.to_string(), text.to_string()));
        self
    }

    /// Sets whether to accept only what the reference compiler accepts.
    #[must_use]
    pub fn strict(mut self, strict: bool) -> ReadOptions {
        self.strict = strict;
        self
    }

    /// Sets the version of the language.
    #[must_use]
    pub fn version(mut self, version: Version) -> ReadOptions {
        self.version = version;
        self
    }

    /// Sets the limits of reading.
    #[must_use]
    pub fn limits(mut self, limits: &Limits) -> ReadOptions {
        self.limits = limits.clone();
        self
    }

    pub(crate) fn inner(&self) -> osl_syntax::Options {
        let ReadOptions { defines, strict, version, limits } = self.clone();
        osl_syntax::Options { defines, strict, version, limits, ..osl_syntax::Options::default() }
    }
}

/// How to compile a group.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct CompileOptions {
    /// The requested outputs: those of the last layer by name, those of other layers as `LAYER.OUTPUT`. An
    /// empty list means all outputs of the last layer except closures.
    pub outputs: Vec<String>,
    /// The numbers with which the program computes.
    pub arithmetic: Arithmetic,
    /// Parameters to set by [`Program::set`](crate::Program::set) without compiling again: those of the last
    /// layer by name, those of other layers as `LAYER.PARAMETER`.
    pub live: Vec<String>,
    /// Variables at a line that become outputs: see [`CompileOptions::tap`].
    pub taps: Vec<String>,
    /// Whether the renderer traces rays: see [`CompileOptions::traces`].
    pub traces: bool,
    /// The globals that vary, and those whose derivatives vary; all if not given.
    pub(crate) varying: Option<[Vec<Global>; 2]>,
    /// The spaces that are known to be affine.
    pub(crate) affine: Vec<Arc<str>>,
}

impl CompileOptions {
    /// Compiles for points like these: globals that they do not list, and derivatives that they do not list,
    /// are the same at all points. The program is faster, and refuses to run at points that list more.
    ///
    /// ```
    /// use osl::{CompileOptions, Group, Points, Shader};
    ///
    /// let shader = Shader::compile("a.osl", "shader a(output float o = 0) { o = u + P[2]; }")?;
    /// let points = Points::new(2).u(vec![0.25, 0.5]);
    /// let options = CompileOptions::default().points(&points);
    /// let program = Group::new().layer("a", &shader).compile_with(&options)?;
    /// assert_eq!(program.run(&points)?.floats("o"), Some(vec![0.25, 0.5]));
    /// assert!(program.run(&points.p(vec![[0.0; 3]; 2])).is_err());
    /// # Ok::<(), osl::Error>(())
    /// ```
    #[must_use]
    pub fn points(mut self, points: &Points<'_>) -> CompileOptions {
        self.varying = Some([points.varying.clone(), points.varying_derivs.clone()]);
        self
    }

    /// Compiles for the spaces of a renderer. If its services [have no
    /// spaces](crate::RendererServices::has_spaces), positions are transformed in less time, and the program
    /// refuses to run with a renderer that has some.
    #[must_use]
    pub fn renderer(mut self, renderer: &Renderer) -> CompileOptions {
        self.affine = renderer.services.spaces.affine();
        self
    }

    /// Options for some outputs.
    pub fn outputs(outputs: &[&str]) -> CompileOptions {
        let outputs = outputs.iter().map(ToString::to_string).collect();
        CompileOptions { outputs, ..CompileOptions::default() }
    }

    /// Sets the numbers with which the program computes.
    #[must_use]
    pub fn arithmetic(mut self, arithmetic: Arithmetic) -> CompileOptions {
        self.arithmetic = arithmetic;
        self
    }

    /// Sets whether the renderer answers `trace` and `getmessage` with a source. Otherwise programs are
    /// compiled without these queries: no ray hits anything.
    #[must_use]
    pub fn traces(mut self, traces: bool) -> CompileOptions {
        self.traces = traces;
        self
    }

    /// Keeps parameters live: [`Program::set`](crate::Program::set) changes them without compiling again.
    /// They must be numbers, triples or matrices, arrays or structs of these, and each needs a value or a
    /// constant default. All other parameters are compiled in, which makes programs smaller and faster.
    ///
    /// ```
    /// use osl::{CompileOptions, Group, Points, Shader};
    ///
    /// let text = "shader a(float size = 2, output float o = 0) { o = size * u; }";
    /// let shader = Shader::compile("a.osl", text)?;
    /// let options = CompileOptions::outputs(&["o"]).live(&["size"]);
    /// let mut program = Group::new().layer("a", &shader).compile_with(&options)?;
    /// let points = Points::new(1).u(&[0.5]);
    /// assert_eq!(program.run(&points)?.floats("o"), Some(vec![1.0]));
    /// program.set("size", 3.0)?;
    /// assert_eq!(program.run(&points)?.floats("o"), Some(vec![1.5]));
    /// # Ok::<(), osl::Error>(())
    /// ```
    #[must_use]
    pub fn live(mut self, params: &[&str]) -> CompileOptions {
        self.live.extend(params.iter().map(ToString::to_string));
        self
    }
}

impl CompileOptions {
    /// Makes an output of a variable at a line, in addition to the other outputs: `42:dist` is the value of
    /// `dist` after the statement on line 42, where a point gets there several times the last one;
    /// `42:dist@3` is that of the third visit. The output is called `line42.dist` or `line42.dist.round3`,
    /// and `line42.dist.reached` is 1 where a point got there, unless every point does.
    ///
    /// The variable may be a local of a function, a parameter or a global; `42:list[2].x` is a part of one.
    /// `57/42:dist` counts only calls on line 57. `noise.h:7:n` is in an included file, or in another layer;
    /// without a file, the line is one of the last layer's. Taps do not change the other outputs.
    ///
    /// ```
    /// use osl::{CompileOptions, Group, Points, Shader};
    ///
    /// let text = "shader a(output float o = 0) {\n float half = u / 2;\n o = half + 1;\n}";
    /// let shader = Shader::compile("a.osl", text)?;
    /// let options = CompileOptions::default().tap("2:half");
    /// let program = Group::new().layer("a", &shader).compile_with(&options)?;
    /// let outputs = program.run(&Points::new(1).u(&[0.5]))?;
    /// assert_eq!(outputs.floats("line2.half"), Some(vec![0.25]));
    /// assert_eq!(outputs.floats("o"), Some(vec![1.25]));
    /// # Ok::<(), osl::Error>(())
    /// ```
    #[must_use]
    pub fn tap(mut self, tap: &str) -> CompileOptions {
        self.taps.push(tap.to_string());
        self
    }
}

/// Is called during a run with the number of finished points, from any thread.
pub(crate) type Progress = Arc<dyn Fn(usize) + Send + Sync>;

/// How to run a program. None of these options changes the results.
///
/// ```
/// use osl::{Cancel, Group, Points, Renderer, RunOptions, Shader};
///
/// let shader = Shader::compile("a.osl", "shader a(output float o = 0) { o = 2 * u; }")?;
/// let program = Group::new().layer("a", &shader).compile(&[])?;
/// let cancel = Cancel::new();
/// let options = RunOptions::default().threads(1).cancel(&cancel);
/// let outputs = program.run_with(&Points::new(1).u(&[0.5]), &Renderer::default(), &options)?;
/// assert_eq!(outputs.floats("o"), Some(vec![1.0]));
/// # Ok::<(), osl::Error>(())
/// ```
#[derive(Clone, Default)]
pub struct RunOptions {
    isa: Option<Isa>,
    threads: Option<usize>,
    cancel: Option<Cancel>,
    progress: Option<Progress>,
}

impl RunOptions {
    /// Sets the instruction set; by default, the widest one of this processor.
    #[must_use]
    pub fn instruction_set(mut self, isa: Isa) -> RunOptions {
        self.isa = Some(isa);
        self
    }

    /// Sets the maximum number of threads; by default, one for each core. With one thread, everything runs on
    /// the calling thread, and no thread is started.
    #[must_use]
    pub fn threads(mut self, threads: usize) -> RunOptions {
        self.threads = Some(threads);
        self
    }

    /// Lets another thread cancel the run, which then fails with [`ErrorKind::Cancelled`].
    ///
    /// [`ErrorKind::Cancelled`]: crate::ErrorKind::Cancelled
    #[must_use]
    pub fn cancel(mut self, cancel: &Cancel) -> RunOptions {
        self.cancel = Some(cancel.clone());
        self
    }

    /// Sets a function that is called from time to time, from any thread, with the number of finished points.
    #[must_use]
    pub fn progress(mut self, progress: impl Fn(usize) + Send + Sync + 'static) -> RunOptions {
        self.progress = Some(Arc::new(progress));
        self
    }

    /// The options for the interpreter.
    pub(crate) fn inner(&self, limits: &Limits) -> osl_exec::RunOptions {
        let limits = self.cancel.as_ref().map_or_else(|| limits.clone(), |cancel| limits.until(cancel));
        let mut options = osl_exec::RunOptions { closures: true, limits, ..osl_exec::RunOptions::default() };
        options.threads = self.threads;
        if let Some(isa) = self.isa {
            options.isa = isa;
        }
        options
    }

    pub(crate) fn report(&self, done: usize) {
        if let Some(progress) = &self.progress {
            progress(done);
        }
    }
}

impl fmt::Debug for RunOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let RunOptions { isa, threads, cancel, progress } = self;
        let mut fields = f.debug_struct("RunOptions");
        fields.field("isa", isa).field("threads", threads).field("cancel", cancel);
        fields.field("progress", &progress.is_some()).finish()
    }
}
