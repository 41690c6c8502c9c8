//! Values as trees.

use super::Walker;
use osl_ir::types::{Base, Extent, Type};
use std::sync::Arc;

/// A value of any type.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A whole number.
    Int(i32),
    /// A number.
    Float(f32),
    /// A color, point, vector or normal.
    Triple([f32; 3]),
    /// A matrix, row by row.
    Matrix([f32; 16]),
    /// A string.
    Text(Arc<str>),
    /// The elements of an array, or the fields of a struct.
    Many(Vec<Value>),
    /// No value, and values that the walker does not know.
    Nothing,
}

impl Value {
    /// Assigns another value; for arrays, as many elements as both have.
    pub(super) fn assign(&mut self, from: Value) {
        match (self, from) {
            (Value::Many(to), Value::Many(from)) => to.iter_mut().zip(from).for_each(|(t, f)| t.assign(f)),
            (to, from) => *to = from,
        }
    }

    /// The value as a float; an int becomes the nearest float.
    pub(super) fn float(&self) -> f32 {
        match self {
            Value::Int(n) => *n as f32,
            Value::Float(x) => *x,
            _ => 0.0,
        }
    }

    pub(super) fn int(&self) -> i32 {
        match self {
            Value::Int(n) => *n,
            _ => 0,
        }
    }

    pub(super) fn text(&self) -> Arc<str> {
        match self {
            Value::Text(text) => text.clone(),
            _ => "".into(),
        }
    }

    /// The value as a triple; a single number is repeated.
    pub(super) fn triple(&self) -> [f32; 3] {
        match self {
            Value::Triple(t) => *t,
            number => [number.float(); 3],
        }
    }

    /// The value as a matrix; a single number is put on the diagonal.
    pub(super) fn matrix(&self) -> [f32; 16] {
        match self {
            Value::Matrix(m) => *m,
            number => std::array::from_fn(|at| if at % 5 == 0 { number.float() } else { 0.0 }),
        }
    }

    /// The bits of the value in planes, with one bit pattern for all NaNs. Empty for strings.
    pub fn words(&self) -> Vec<u32> {
        let bits = |x: &f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
        match self {
            Value::Int(n) => vec![n.cast_unsigned()],
            Value::Float(x) => vec![bits(x)],
            Value::Triple(t) => t.iter().map(bits).collect(),
            Value::Matrix(m) => m.iter().map(bits).collect(),
            _ => Vec::new(),
        }
    }
}

impl Walker<'_> {
    /// The value of a variable of a type before the first assignment.
    pub(super) fn zero(&self, ty: Type) -> Value {
        match ty.extent {
            Extent::One => {}
            Extent::Array(n) => return Value::Many(vec![self.zero(ty.element()); n as usize]),
            Extent::Unsized => return Value::Many(vec![self.zero(ty.element())]),
        }
        match ty.base {
            Base::Int => Value::Int(0),
            Base::Float => Value::Float(0.0),
            Base::Color | Base::Point | Base::Vector | Base::Normal => Value::Triple([0.0; 3]),
            Base::Matrix => Value::Matrix([0.0; 16]),
            Base::String => Value::Text("".into()),
            Base::Struct(id) => {
                let fields = &self.program.structs.get(id).fields;
                Value::Many(fields.iter().map(|field| self.zero(field.ty)).collect())
            }
            _ => Value::Nothing,
        }
    }

    /// Whether a type is an array or contains one.
    pub(super) fn holds_array(&self, ty: Type) -> bool {
        let in_fields =
            |id| self.program.structs.get(id).fields.iter().any(|field| self.holds_array(field.ty));
        ty.is_array() || ty.as_struct().is_some_and(in_fields)
    }

    /// The parts of an output, named like its planes.
    pub(super) fn parts(&self, ty: Type, name: String, value: &Value, parts: &mut Vec<(String, Value)>) {
        match (ty.base, ty.extent, value) {
            (Base::Struct(id), Extent::One, Value::Many(fields)) => {
                for (field, value) in self.program.structs.get(id).fields.iter().zip(fields) {
                    self.parts(field.ty, format!("{name}.{}", field.name), value, parts);
                }
            }
            // A struct's field of a struct's array: `s.a[2]`, the index last.
            (Base::Struct(id), _, Value::Many(elements)) => {
                for (index, field) in self.program.structs.get(id).fields.iter().enumerate() {
                    let of = |element: &Value| match element {
                        Value::Many(fields) => fields.get(index).cloned().unwrap_or(Value::Nothing),
                        _ => Value::Nothing,
                    };
                    let values = Value::Many(elements.iter().map(of).collect());
                    let ty = Type { extent: ty.extent, ..field.ty };
                    self.parts(ty, format!("{name}.{}", field.name), &values, parts);
                }
            }
            (_, Extent::One, value) => parts.push((name, value.clone())),
            (_, _, Value::Many(elements)) => {
                for (index, element) in elements.iter().enumerate() {
                    parts.push((format!("{name}[{index}]"), element.clone()));
                }
            }
            _ => {}
        }
    }
}
