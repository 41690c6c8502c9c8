//! Shader groups: layers, each a shader with values for its parameters, and connections between parameters.
//!
//! [`Group`] is the model, which is checked while it is built; [`text`] reads the serialized form of the OSL
//! specification (chapter "Describing shader groups"). [`crate::lower_group`] makes one body of a group.

mod connect;
mod rules;
pub mod text;

pub use connect::ConnectError;
pub use rules::{Checks, Rules};

use crate::params::ParamValues;
use osl_hir::hir::Program;
use osl_limits::Limits;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// A shader of a group, with its instance values.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Its name, different from those of the other layers.
    pub name: Arc<str>,
    /// The shader.
    pub program: Arc<Program>,
    /// Values of its parameters.
    pub values: ParamValues,
    /// The offset to add to spans of the program to make them spans of the group's source map.
    pub base: u32,
}

/// One side of a connection: a parameter or a part of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct End {
    /// The layer.
    pub layer: usize,
    /// The parameter, by its index in the shader's list.
    pub param: usize,
    /// The path to a field of a struct, from the outermost.
    pub fields: Vec<usize>,
    /// A component of a triple.
    pub component: Option<u8>,
}

/// A connection, which passes a value from a layer to a later one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Connection {
    /// Where the value comes from.
    pub from: End,
    /// Its destination.
    pub to: End,
}

/// A group. The last layer always runs; another layer runs only where its results are needed.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// Its name.
    pub name: Arc<str>,
    /// The rules: which layers run, and the meaning of unmarked parameters.
    pub rules: Rules,
    pub(crate) layers: Vec<Layer>,
    pub(crate) connections: Vec<Connection>,
    /// The index of each layer, by name.
    by_name: FxHashMap<Arc<str>, usize>,
    /// The limits on its size.
    limits: Limits,
}

impl Group {
    /// A group without layers.
    pub fn new(name: impl Into<Arc<str>>) -> Group {
        Group { name: name.into(), ..Group::default() }
    }

    /// Sets the limits of the group.
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

    /// Adds a layer. Refuses it if its name is taken or there are too many layers.
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

    /// An end of a connection as in the text of a group: `layer.parameter`, with the field or component.
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

    /// The layer with a name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }
}
