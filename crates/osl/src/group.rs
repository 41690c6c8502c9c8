//! Groups: shaders as layers, with parameter values and connections, compiled to a program.

use crate::{Error, Program, Shader, Value, pipeline};
use osl_ir::group::{self, Layer};
use osl_ir::lower::{self, Last, Requests};
use osl_ir::params::{self, ParamError, ParamValues};
use osl_ir::types::{Base, Type};
use osl_ir::{hir, passes};
use osl_limits::Limits;
use osl_syntax::source::SourceMap;
use std::sync::Arc;

/// Shaders that work together. The last layer always runs; another layer runs only where its results are
/// needed.
#[derive(Clone, Copy, Debug)]
pub struct Group;

impl Group {
    /// Starts a group without layers.
    pub fn builder() -> GroupBuilder {
        GroupBuilder::named("unnamed_group_1")
    }
}

/// A group under construction. [`GroupBuilder::compile`] returns the first error of any step.
#[derive(Clone, Debug)]
pub struct GroupBuilder {
    group: group::Group,
    sources: SourceMap,
    limits: Limits,
    failed: Option<Error>,
}

impl GroupBuilder {
    /// Starts a group with a name, which shaders can query.
    pub fn named(name: &str) -> GroupBuilder {
        GroupBuilder {
            group: group::Group::new(name),
            sources: SourceMap::default(),
            limits: Limits::default(),
            failed: None,
        }
    }

    /// Sets the limits of the group: for its layers from here on, for compiling it, and for running its
    /// program.
    #[must_use]
    pub fn limits(mut self, limits: &Limits) -> GroupBuilder {
        self.group = self.group.with_limits(limits);
        self.limits = limits.clone();
        self
    }

    /// Adds a layer. Its name must differ from those of the other layers.
    #[must_use]
    pub fn layer(self, name: &str, shader: &Shader) -> GroupBuilder {
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
    #[must_use]
    pub fn param(self, name: &str, value: impl Into<Value>) -> GroupBuilder {
        self.and(|group, _| last(group, |layer| set(layer, name, &value.into())))
    }

    /// Lets a parameter of the layer added last take the point's user data of the same name, where there is
    /// any.
    #[must_use]
    pub fn interpolate(self, name: &str) -> GroupBuilder {
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
    pub fn connect(self, from: &str, to: &str) -> GroupBuilder {
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
        let GroupBuilder { group, sources, limits, failed } = self;
        if let Some(error) = failed {
            return Err(error);
        }
        let last = group.layers().last().ok_or_else(|| Error::new("the group has no layers"))?;
        let mut others: Vec<Arc<str>> = Vec::new();
        for name in outputs {
            let part = name.split_once('.').and_then(|(l, n)| Some((group.layers().get(group.find(l)?)?, n)));
            let (layer, output) = part.unwrap_or((last, name));
            if !has_output(&layer.program, output) && (output != "Ci" || part.is_some()) {
                return Err(Error::new(format!("layer `{}` has no output `{output}`", layer.name)));
            }
            if part.is_some() {
                others.push((*name).into());
            }
        }
        let last = match outputs {
            [] => Last::All,
            _ => Last::Named(outputs.iter().map(|name| (*name).into()).collect()),
        };
        let requests = Requests { outputs: others, last, limits: limits.clone(), ..Requests::default() };
        let mut body =
            lower::lower_group_for(&group, &requests).map_err(|list| Error::of(&list, &sources))?;
        if outputs.is_empty() {
            // Closures are computed only if they are named, since they cost time.
            body.outputs.retain(|output| output.ty.base != Base::Closure);
        }
        let wanted = (!outputs.is_empty()).then(|| outputs.iter().map(|name| (*name).into()).collect());
        let options =
            passes::Options { outputs: wanted, limits: limits.clone(), ..passes::Options::default() };
        Ok(Program::new(pipeline::finish(body, &options).program, sources, limits))
    }

    /// Performs a step, if no earlier one has failed.
    fn and(
        mut self,
        step: impl FnOnce(&mut group::Group, &mut SourceMap) -> Result<(), String>,
    ) -> GroupBuilder {
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
    let (ty, words) = value.words();
    let Layer { program, values, .. } = layer;
    let mut set = |ty| params::set_words(program, values, ty, name, &words);
    let result = match set(ty) {
        Err(ParamError::Type { .. }) if ty == Type::INT => set(Type::FLOAT),
        result => result,
    };
    result.map_err(|e| format!("layer `{}`: {e}", layer.name))
}

/// Whether a shader has an output with a name, or with a name that contains it as a part.
fn has_output(program: &hir::Program, name: &str) -> bool {
    let first = name.split('.').next().unwrap_or(name);
    let is = |p: &hir::Param| program.vars.get(p.var.0 as usize).is_some_and(|var| &*var.name == first);
    program.shader.params.iter().any(|p| p.output && is(p))
}
