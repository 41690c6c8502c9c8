//! Values: what a variable holds and an expression yields.
//!
//! An int has 32 bits in two's complement; a float is an IEEE binary32 number. Colors, points, vectors and
//! normals are triples of floats: their types differ, their values do not. An array or a struct is an
//! *aggregate*: a tree of values, which is copied as a whole. There are no pointers.
//!
//! ```
//! use osl_walker::printed;
//! // An int becomes the nearest float, a float loses its fraction, and a number fills a triple.
//! assert_eq!(printed(r#"float x = 7 / 2; printf("%g", x);"#), "3");
//! assert_eq!(printed(r#"printf("%d", (int)-1.5);"#), "-1");
//! assert_eq!(printed(r#"color c = 1; c[0] = 0.5; printf("%g", c);"#), "0.5 1 1");
//! ```

use osl_ir::types::{Base, Extent, StructTable, Type};
use std::sync::Arc;

/// A value of any type.
#[derive(Clone, Debug, PartialEq)]
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
    String(Arc<str>),
    /// The elements of an array, or the fields of a struct.
    Aggregate(Vec<Value>),
    /// The result of a function without one, and what the walker does not know.
    Void,
}

impl Value {
    /// The zero of a type: 0 for each number, the empty string for each string. An array without a length
    /// has one element.
    pub(crate) fn zero(ty: Type, structs: &StructTable) -> Value {
        let element = || Value::zero(ty.element(), structs);
        match ty.extent {
            Extent::One => {}
            Extent::Array(n) => return Value::Aggregate(vec![element(); n as usize]),
            Extent::Unsized => return Value::Aggregate(vec![element()]),
        }
        match ty.base {
            Base::Int => Value::Int(0),
            Base::Float => Value::Float(0.0),
            Base::Color | Base::Point | Base::Vector | Base::Normal => Value::Triple([0.0; 3]),
            Base::Matrix => Value::Matrix([0.0; 16]),
            Base::String => Value::String("".into()),
            Base::Struct(id) => {
                let fields = structs.get(id).fields.iter();
                Value::Aggregate(fields.map(|field| Value::zero(field.ty, structs)).collect())
            }
            Base::Closure | Base::Void | Base::Error => Value::Void,
        }
    }

    /// The value converted to another type. The resolver writes each conversion into the tree; a value of
    /// the right type stays as it is.
    pub(crate) fn converted(self, to: Type) -> Value {
        let is_number = matches!(self, Value::Int(_) | Value::Float(_));
        match to.base {
            Base::Int if is_number => Value::Int(self.int()),
            Base::Float if is_number => Value::Float(self.float()),
            Base::Color | Base::Point | Base::Vector | Base::Normal if is_number => {
                Value::Triple(self.triple())
            }
            Base::Matrix if is_number => Value::Matrix(self.matrix()),
            _ => self,
        }
    }

    /// Overwrites the value. An array keeps its length: as many elements are copied as both have.
    pub(crate) fn assign(&mut self, from: Value) {
        match (self, from) {
            (Value::Aggregate(to), Value::Aggregate(from)) => {
                to.iter_mut().zip(from).for_each(|(to, from)| to.assign(from));
            }
            (to, from) => *to = from,
        }
    }

    /// As a float: an int becomes the nearest one.
    pub(crate) fn float(&self) -> f32 {
        match self {
            Value::Int(n) => *n as f32,
            Value::Float(x) => *x,
            _ => 0.0,
        }
    }

    /// As an int: a float loses its fraction. Out of range, and for NaN, it is the smallest int.
    pub(crate) fn int(&self) -> i32 {
        match self {
            Value::Int(n) => *n,
            Value::Float(x) if (-2_147_483_648.0..2_147_483_648.0).contains(x) => *x as i32,
            Value::Float(_) => i32::MIN,
            _ => 0,
        }
    }

    /// As a triple: a number is repeated.
    pub(crate) fn triple(&self) -> [f32; 3] {
        match self {
            Value::Triple(t) => *t,
            number => [number.float(); 3],
        }
    }

    /// As a matrix: a number is on the diagonal, with zeros around it.
    pub(crate) fn matrix(&self) -> [f32; 16] {
        match self {
            Value::Matrix(m) => *m,
            number => std::array::from_fn(|at| if at % 5 == 0 { number.float() } else { 0.0 }),
        }
    }

    /// As a string.
    pub(crate) fn string(&self) -> Arc<str> {
        match self {
            Value::String(text) => text.clone(),
            _ => "".into(),
        }
    }
}
