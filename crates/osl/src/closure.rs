//! Closures for embedders: what a shader says about light, for the embedder's renderer to interpret.
//!
//! A component is data, whatever its name: the renderer decides which closures exist.

use crate::Value;
use osl_exec::{Component, Param};

/// A component of a closure.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Closure {
    /// Red, green and blue factors.
    pub weight: [f32; 3],
    /// Its name.
    pub name: String,
    /// Its arguments in order; keyword arguments come last.
    pub arguments: Vec<Argument>,
}

/// An argument of a component.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Argument {
    /// The keyword, if it has one.
    pub key: Option<String>,
    /// Its value, unless it is a closure.
    pub value: Option<Value>,
    /// The components of a closure.
    pub closure: Vec<Closure>,
}

impl Closure {
    pub(crate) fn new(component: &Component) -> Closure {
        let Component { weight, name, params } = component;
        let argument = |param: &Param| Argument {
            key: param.key.as_ref().map(ToString::to_string),
            value: Value::of_constants(&param.values, false),
            closure: param.closure.iter().map(Closure::new).collect(),
        };
        Closure { weight: *weight, name: name.to_string(), arguments: params.iter().map(argument).collect() }
    }
}
