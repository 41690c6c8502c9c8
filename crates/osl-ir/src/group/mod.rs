//! Shader groups: layers, each a shader with values for its parameters, and connections from parameter to parameter.
//!
//! [`Group`] is the model, checked as it is built; [`text`] reads the serialized form of the OSL specification (chapter
//! "Describing shader groups"). [`crate::lower::lower_group`] makes one body of a group. This module must not know files:
//! shaders come from whoever builds the group.

mod connect;
mod rules;
pub mod text;

pub use connect::ConnectError;
pub use rules::{Checks, Rules};

use crate::hir::Program;
use crate::params::ParamValues;
use osl_limits::Limits;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// A shader of a group, with its instance values.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Its name, unlike those of the other layers.
    pub name: Arc<str>,
    /// The shader.
    pub program: Arc<Program>,
    /// Values of its parameters.
    pub values: ParamValues,
    /// What to add to spans of the program to make them spans of the group's source map.
    pub base: u32,
}

/// One side of a connection: a parameter or a part of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct End {
    /// The layer.
    pub layer: usize,
    /// The parameter, by its place in the shader's list.
    pub param: usize,
    /// The way to a field of a struct, from the outermost.
    pub fields: Vec<usize>,
    /// A component of a triple.
    pub component: Option<u8>,
}

/// A connection: the value goes from a layer to a later one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Connection {
    /// Where the value comes from.
    pub from: End,
    /// Where it goes.
    pub to: End,
}

/// A group. The last layer is the one that runs; others run where what they yield is needed.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// Its name.
    pub name: Arc<str>,
    /// Which layers run, and what unmarked parameters do.
    pub rules: Rules,
    pub(crate) layers: Vec<Layer>,
    pub(crate) connections: Vec<Connection>,
    /// The place of each layer, by name.
    by_name: FxHashMap<Arc<str>, usize>,
    /// How large it may become.
    limits: Limits,
}

impl Group {
    /// A group without layers.
    pub fn new(name: impl Into<Arc<str>>) -> Group {
        Group { name: name.into(), ..Group::default() }
    }

    /// The same group with other limits.
    pub fn with_limits(self, limits: &Limits) -> Group {
        Group { limits: limits.clone(), ..self }
    }

    /// The layers in order.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The connections in order.
    pub fn connections(&self) -> &[Connection] {
        &self.connections
    }

    /// Adds a layer; hands it back where its name is taken or there are too many.
    ///
    /// # Errors
    /// The layer, which was not added.
    pub fn add(&mut self, layer: Layer) -> Result<usize, Box<Layer>> {
        if self.layers.len() as u64 >= self.limits.reading.layers || self.find(&layer.name).is_some() {
            return Err(Box::new(layer));
        }
        self.by_name.insert(layer.name.clone(), self.layers.len());
        self.layers.push(layer);
        Ok(self.layers.len() - 1)
    }

    /// A layer, to change its values.
    pub fn layer_mut(&mut self, index: usize) -> Option<&mut Layer> {
        self.layers.get_mut(index)
    }

    /// An end of a connection as a text names it: `layer.parameter`, with the field or component.
    pub fn show(&self, end: &End) -> String {
        let Some(layer) = self.layers.get(end.layer) else { return String::new() };
        let program = &layer.program;
        let Some(param) = program.shader.params.get(end.param) else { return layer.name.to_string() };
        let var = &program.vars[param.var.0 as usize];
        let (mut text, mut ty) = (format!("{}.{}", layer.name, var.name), var.ty);
        for field in &end.fields {
            let Some(field) = ty.as_struct().and_then(|id| program.structs.get(id).fields.get(*field)) else {
                break;
            };
            text += &format!(".{}", field.name);
            ty = field.ty;
        }
        if let Some(component) = end.component {
            text += &format!("[{component}]");
        }
        text
    }

    /// The layer of a name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }
}
