//! Groups: shaders as layers, with parameter values and connections, compiled to a program.

use crate::assign::set_in;
use crate::files::{Files, Includes};
use crate::program::Live;
use crate::stages::{self, CheckedGroup};
use crate::{CompileOptions, Error, Program, ReadOptions, Shader, Value};
use osl_hir::hir;
use osl_ir::passes;
use osl_ir::types::Base;
use osl_limits::Limits;
use osl_lower::group::{self, Layer};
use osl_lower::params::{self, ParamValues};
use osl_lower::taps::{self, Tap, TapPath};
use osl_lower::{Last, Requests};
use osl_syntax::source::SourceMap;
use std::sync::Arc;

/// Shaders that work together, with values for their parameters. The last layer always runs; another layer
/// runs only where its results are needed.
///
/// Each method adds to the group; [`Group::compile`] returns the first error of any step.
#[derive(Clone, Debug)]
pub struct Group {
    group: group::Group,
    sources: SourceMap,
    limits: Limits,
    failed: Option<Error>,
}

/// The name of a group without a name.
const UNNAMED: &str = "unnamed_group_1";

impl Default for Group {
    fn default() -> Group {
        Group::new()
    }
}

impl Group {
    /// A group without layers.
    pub fn new() -> Group {
        Group::named(UNNAMED)
    }

    /// A group without layers, with a name that shaders can query.
    pub fn named(name: &str) -> Group {
        Group {
            group: group::Group::new(name),
            sources: SourceMap::default(),
            limits: Limits::default(),
            failed: None,
        }
    }

    /// Reads a serialized group: the statements `param`, `shader` and `connect` of the language
    /// specification. Shaders come from the client's files: `NAME`, `NAME.osl` or `NAME.oso`. More layers and
    /// values can follow.
    ///
    /// ```
    /// use osl::{Group, MemoryFiles, Points, ReadOptions};
    ///
    /// let ramp = "shader ramp(float k = 1, output float o = 0) { o = k * u; }";
    /// let files = MemoryFiles::new().with("ramp.osl", ramp);
    /// let text = "param float k 3; shader ramp r;";
    /// let program = Group::read("a.group", text, &files, &ReadOptions::default())?.compile(&["o"])?;
    /// assert_eq!(program.run(&Points::new(1).u(&[0.5]))?.floats("o"), Some(vec![1.5]));
    /// # Ok::<(), osl::Error>(())
    /// ```
    ///
    /// # Errors
    /// The text or a shader has errors, or a shader is missing.
    pub fn read(name: &str, text: &str, files: &dyn Files, options: &ReadOptions) -> Result<Group, Error> {
        let includes = Includes(files);
        let CheckedGroup { sources, diagnostics, group } =
            stages::check_group(name, text, UNNAMED, &includes, &options.inner());
        match group {
            Some(group) => Ok(Group { group, sources, limits: options.limits.clone(), failed: None }),
            None => Err(Error::of(&diagnostics, &sources)),
        }
    }

    /// Sets the limits of the group: for its layers from here on, for compiling it, and for running its
    /// program.
    #[must_use]
    pub fn limits(mut self, limits: &Limits) -> Group {
        self.group = self.group.with_limits(limits);
        self.limits = limits.clone();
        self
    }

    /// Adds a layer. Its name must differ from those of the other layers.
    #[must_use]
    pub fn layer(self, name: &str, shader: &Shader) -> Group {
        self.and(|group, sources| {
            let base = sources.append(&shader.sources).ok_or("the sources have more than 4 GiB")?;
            let values = ParamValues::default();
            let layer = Layer { name: name.into(), program: shader.program.clone(), values, base };
            match group.add(layer) {
                Ok(_) => Ok(()),
                Err(_) => Err(format!("layer `{name}`: the name is taken, or there are too many layers")),
            }
        })
    }

    /// Sets a parameter of the layer added last; `s.a` is a field. A float parameter accepts an int, a triple
    /// accepts a float, and an array that is too short is padded with zeros.
    ///
    /// ```
    /// # use osl::{Group, Points, Shader, Value};
    /// let text = "shader a(float k[3] = {1, 1, 1}, output float o = 0) { o = k[1]; }";
    /// let shader = Shader::compile("a.osl", text)?;
    /// let program = Group::new().layer("a", &shader).param("k", vec![1.0, 2.0]).compile(&["o"])?;
    /// assert_eq!(program.run(&Points::new(1))?.floats("o"), Some(vec![2.0]));
    /// # Ok::<(), osl::Error>(())
    /// ```
    #[must_use]
    pub fn param(self, name: &str, value: impl Into<Value>) -> Group {
        self.and(|group, _| last(group, |layer| set(layer, name, &value.into())))
    }

    /// Lets a parameter of the layer added last take the point's user data of the same name, where there is
    /// any.
    #[must_use]
    pub fn interpolate(self, name: &str) -> Group {
        self.and(|group, _| {
            last(group, |layer| {
                layer.values.interpolate(name);
                Ok(())
            })
        })
    }

    /// Connects an output or parameter of a layer to a parameter of a later one:
    /// `connect("noise.out", "paint.c[1]")`.
    #[must_use]
    pub fn connect(self, from: &str, to: &str) -> Group {
        self.and(|group, _| {
            let end = |path: &str| {
                let parts = path.split_once('.').map(|(layer, param)| (layer.to_string(), param.to_string()));
                parts.ok_or_else(|| format!("`{path}` is not of the form LAYER.PARAMETER"))
            };
            let (from, to) = (end(from)?, end(to)?);
            group.connect((&from.0, &from.1), (&to.0, &to.1)).map_err(|e| e.to_string())
        })
    }

    /// Compiles the group for some of its outputs: those of the last layer by name, those of other layers as
    /// `LAYER.OUTPUT`. An empty list means all outputs of the last layer except closures. Code that the
    /// outputs do not need is removed.
    ///
    /// # Errors
    /// An earlier step failed, an output does not exist, or the program is too large.
    pub fn compile(self, outputs: &[&str]) -> Result<Program, Error> {
        self.compile_with(&CompileOptions::outputs(outputs))
    }

    /// Compiles the group.
    ///
    /// # Errors
    /// Those of [`Group::compile`].
    pub fn compile_with(self, options: &CompileOptions) -> Result<Program, Error> {
        let Group { mut group, sources, limits, failed } = self;
        if let Some(error) = failed {
            return Err(error);
        }
        let CompileOptions { outputs, arithmetic, live, taps, traces, varying, affine } = options;
        let live = live.iter().map(|name| make_live(&mut group, name)).collect::<Result<Vec<Live>, String>>();
        let live = live.map_err(Error::new)?;
        let last = group.layers().last().ok_or_else(|| Error::new("the group has no layers"))?;
        let mut others: Vec<Arc<str>> = Vec::new();
        for name in outputs {
            let part = name.split_once('.').and_then(|(l, n)| Some((group.layers().get(group.find(l)?)?, n)));
            let (layer, output) = part.unwrap_or((last, name));
            if !has_output(&layer.program, output) && (output != "Ci" || part.is_some()) {
                return Err(Error::new(format!("layer `{}` has no output `{output}`", layer.name)));
            }
            if part.is_some() {
                others.push(name.as_str().into());
            }
        }
        let mut named: Option<Vec<Arc<str>>> =
            (!outputs.is_empty()).then(|| outputs.iter().map(|name| name.as_str().into()).collect());
        let last = named.clone().map_or(Last::All, Last::Named);
        let taps = taps.iter().map(|text| tap(&group, &sources, text)).collect::<Result<Vec<Tap>, String>>();
        let taps = taps.map_err(Error::new)?;
        let tapped: Vec<Arc<str>> =
            taps.iter().flat_map(|tap| [tap.name.clone(), tap.mask.clone()]).collect();
        let is_all = named.is_none();
        named.iter_mut().for_each(|named| named.extend(tapped.iter().cloned()));
        let requests =
            Requests { outputs: others, last, taps, limits: limits.clone(), ..Requests::default() };
        let mut body =
            osl_lower::lower_group_for(&group, &requests).map_err(|list| Error::of(&list, &sources))?;
        if is_all {
            // Closures are computed only if they are named, since they cost time.
            body.outputs.retain(|output| output.ty.base != Base::Closure || tapped.contains(&output.name));
        }
        let mut options = passes::Options {
            outputs: named,
            arithmetic: *arithmetic,
            traces: *traces,
            limits: limits.clone(),
            affine: affine.clone(),
            ..passes::Options::default()
        };
        if let Some(varying) = varying.clone() {
            [options.varying, options.derivs] = varying;
        }
        let has_closures = body.outputs.iter().any(|output| output.ty.base == Base::Closure);
        let program = stages::finish(body, &options).program;
        Ok(Program::new(program, (live, *traces), sources, limits, has_closures))
    }

    /// Performs a step, if no earlier one has failed.
    fn and(mut self, step: impl FnOnce(&mut group::Group, &mut SourceMap) -> Result<(), String>) -> Group {
        if self.failed.is_none() {
            self.failed = step(&mut self.group, &mut self.sources).err().map(Error::new);
        }
        self
    }
}

fn last(group: &mut group::Group, step: impl FnOnce(&mut Layer) -> Result<(), String>) -> Result<(), String> {
    let at = group.layers().len().checked_sub(1).ok_or("a parameter belongs to a layer: add one first")?;
    group.layer_mut(at).map_or(Ok(()), step)
}

fn set(layer: &mut Layer, name: &str, value: &Value) -> Result<(), String> {
    let Layer { program, values, .. } = layer;
    set_in(program, values, name, value).map_err(|e| format!("layer `{}`: {e}", layer.name))
}

/// Makes a parameter live, with its default if it has no value: `PARAMETER` of the last layer, or
/// `LAYER.PARAMETER`.
fn make_live(group: &mut group::Group, name: &str) -> Result<Live, String> {
    let part = name.split_once('.').and_then(|(layer, param)| Some((group.find(layer)?, param)));
    let at = group.layers().len().checked_sub(1).ok_or("the group has no layers")?;
    let (at, param) = part.unwrap_or((at, name));
    let layer = group.layer_mut(at).ok_or("the group has no layers")?;
    let wrong = |layer: &Layer, why: &str| format!("layer `{}`: parameter `{param}` {why}", layer.name);
    let Some(ty) = params::type_of(&layer.program, param) else {
        return Err(wrong(layer, "does not exist"));
    };
    if matches!(ty.base, Base::String | Base::Closure) {
        return Err(wrong(layer, "cannot be live: it is a string or a closure"));
    }
    let fields = crate::param::leaves(&layer.program, param, ty);
    for field in &fields {
        if layer.values.get(field).is_none() {
            let Some(default) = crate::param::default(&layer.program, field) else {
                return Err(wrong(layer, "cannot be live: it has neither a value nor a constant default"));
            };
            set(layer, field, &default)?;
        }
        layer.values.make_live(field);
    }
    let (param, program, layer) = (param.to_string(), layer.program.clone(), layer.name.clone());
    Ok(Live { name: name.to_string(), program, layer, param, fields })
}

/// A tap, in the last layer or in that which has its file.
fn tap(group: &group::Group, sources: &SourceMap, text: &str) -> Result<Tap, String> {
    let wanted = TapPath::parse(text)?;
    let layers: Vec<_> = group.layers().iter().map(|layer| (&*layer.program, layer.base)).collect();
    let found = taps::find_in(&wanted, &layers, sources);
    found.map_err(|why| format!("tap `{text}`: {why}"))
}

/// Whether a shader has an output with a name, or with a name that contains it as a part.
fn has_output(program: &hir::Program, name: &str) -> bool {
    let first = name.split('.').next().unwrap_or(name);
    let is = |p: &hir::Param| program.vars.get(p.var.0 as usize).is_some_and(|var| &*var.name == first);
    program.shader.params.iter().any(|p| p.output && is(p))
}
