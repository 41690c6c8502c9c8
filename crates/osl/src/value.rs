//! Values that an embedder passes and receives.

use osl_exec::Datum;
use osl_ir::ir::Const;
use osl_ir::types::{Extent, Type};
use std::sync::Arc;

/// A value of a parameter, an attribute or user data.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Value {
    /// An int.
    Int(i32),
    /// A float.
    Float(f32),
    /// A color, point, vector or normal.
    Triple([f32; 3]),
    /// A matrix, row by row.
    Matrix([f32; 16]),
    /// A string.
    String(String),
    /// An array of ints.
    Ints(Vec<i32>),
    /// An array of floats.
    Floats(Vec<f32>),
    /// An array of triples.
    Triples(Vec<[f32; 3]>),
    /// An array of strings.
    Strings(Vec<String>),
}

impl From<i32> for Value {
    fn from(x: i32) -> Value {
        Value::Int(x)
    }
}

impl From<f32> for Value {
    fn from(x: f32) -> Value {
        Value::Float(x)
    }
}

impl From<[f32; 3]> for Value {
    fn from(x: [f32; 3]) -> Value {
        Value::Triple(x)
    }
}

impl From<[f32; 16]> for Value {
    fn from(x: [f32; 16]) -> Value {
        Value::Matrix(x)
    }
}

impl From<&str> for Value {
    fn from(x: &str) -> Value {
        Value::String(x.to_string())
    }
}

impl From<String> for Value {
    fn from(x: String) -> Value {
        Value::String(x)
    }
}

impl Value {
    /// Its type, and its elements as words.
    pub(crate) fn words(&self) -> (Type, Vec<Arc<str>>) {
        fn of<T: ToString>(list: &[T]) -> Vec<Arc<str>> {
            list.iter().map(|x| x.to_string().into()).collect()
        }
        let array = |ty: Type, len: usize| Type { extent: Extent::Array(len as u32), ..ty };
        match self {
            Value::Int(x) => (Type::INT, of(&[*x])),
            Value::Float(x) => (Type::FLOAT, of(&[*x])),
            Value::Triple(x) => (Type::COLOR, of(x)),
            Value::Matrix(x) => (Type::MATRIX, of(x)),
            Value::String(x) => (Type::STRING, of(&[x])),
            Value::Ints(x) => (array(Type::INT, x.len()), of(x)),
            Value::Floats(x) => (array(Type::FLOAT, x.len()), of(x)),
            Value::Triples(x) => (array(Type::COLOR, x.len()), of(x.as_flattened())),
            Value::Strings(x) => (array(Type::STRING, x.len()), of(x)),
        }
    }

    /// The value in the interpreter's form; `element` selects one element of an array.
    pub(crate) fn datum(self, element: Option<usize>) -> Option<Datum> {
        let string = |x: String| Const::Str(x.into());
        let whole = match self {
            Value::Int(x) => Datum::one(Const::Int(x)),
            Value::Float(x) => Datum::one(Const::Float(x)),
            Value::Triple(x) => Datum::one(Const::Triple(x)),
            Value::Matrix(x) => Datum::one(Const::Matrix(Box::new(x))),
            Value::String(x) => Datum::one(string(x)),
            Value::Ints(x) => Datum::array(x.into_iter().map(Const::Int).collect()),
            Value::Floats(x) => Datum::array(x.into_iter().map(Const::Float).collect()),
            Value::Triples(x) => Datum::array(x.into_iter().map(Const::Triple).collect()),
            Value::Strings(x) => Datum::array(x.into_iter().map(string).collect()),
        };
        match element {
            None => Some(whole),
            Some(at) if whole.array => whole.values.into_iter().nth(at).map(Datum::one),
            Some(_) => None,
        }
    }
}
