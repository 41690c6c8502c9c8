//! Closures for embedders: what a shader says about light, for the embedder's renderer to interpret.
//!
//! A component is data, whatever its name: the renderer decides which closures exist.

use crate::Value;
use osl_exec::{Component, Param};
use osl_ir::ir::Const;

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
            value: value(&param.values),
            closure: param.closure.iter().map(Closure::new).collect(),
        };
        Closure { weight: *weight, name: name.to_string(), arguments: params.iter().map(argument).collect() }
    }
}

/// One value, or an array; `None` for closures.
fn value(list: &[Const]) -> Option<Value> {
    Some(match list {
        [Const::Int(n)] => Value::Int(*n),
        [Const::Float(x)] => Value::Float(*x),
        [Const::Triple(t)] => Value::Triple(*t),
        [Const::Matrix(m)] => Value::Matrix(**m),
        [Const::Str(s)] => Value::String(s.to_string()),
        [Const::Int(_), ..] => {
            Value::Ints(all(list, |v| if let Const::Int(n) = v { Some(*n) } else { None }))
        }
        [Const::Float(_), ..] => {
            Value::Floats(all(list, |v| if let Const::Float(x) = v { Some(*x) } else { None }))
        }
        [Const::Triple(_), ..] => {
            Value::Triples(all(list, |v| if let Const::Triple(t) = v { Some(*t) } else { None }))
        }
        [Const::Str(_), ..] => {
            Value::Strings(all(list, |v| if let Const::Str(s) = v { Some(s.to_string()) } else { None }))
        }
        _ => return None,
    })
}

fn all<T>(list: &[Const], of: impl Fn(&Const) -> Option<T>) -> Vec<T> {
    list.iter().filter_map(of).collect()
}
