//! Values that a client passes and receives.

use osl_exec::Datum;
use osl_ir::ir::Const;
use osl_ir::types::{Extent, Type};

/// A value of a parameter, an attribute, user data or a metadatum.
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
    /// An array of matrices.
    Matrices(Vec<[f32; 16]>),
    /// An array of strings.
    Strings(Vec<String>),
    /// A struct: its fields with their names. Given to a parameter, it may lack fields.
    Struct(Vec<(String, Value)>),
    /// An array of structs or closures. It is a default only, and cannot be given to a parameter.
    List(Vec<Value>),
    /// The closure `0`, which reflects and emits nothing. It is a default only.
    NullClosure,
}

macro_rules! from {
    ($($type:ty => $variant:ident;)*) => {$(
        impl From<$type> for Value {
            fn from(x: $type) -> Value {
                Value::$variant(x.into())
            }
        }
    )*};
}

from! {
    i32 => Int;
    f32 => Float;
    [f32; 3] => Triple;
    [f32; 16] => Matrix;
    &str => String;
    String => String;
    Vec<i32> => Ints;
    Vec<f32> => Floats;
    Vec<[f32; 3]> => Triples;
    Vec<[f32; 16]> => Matrices;
    Vec<String> => Strings;
}

impl Value {
    /// Its type, and its elements as constants; `None` for structs and closures.
    pub(crate) fn constants(&self) -> Option<(Type, Vec<Const>)> {
        fn of<T: Clone>(list: &[T], constant: impl Fn(T) -> Const) -> Vec<Const> {
            list.iter().cloned().map(constant).collect()
        }
        let array = |ty: Type, len: usize| Type { extent: Extent::Array(len as u32), ..ty };
        let matrix = |m: [f32; 16]| Const::Matrix(Box::new(m));
        let string = |s: String| Const::Str(s.into());
        Some(match self {
            Value::Int(x) => (Type::INT, vec![Const::Int(*x)]),
            Value::Float(x) => (Type::FLOAT, vec![Const::Float(*x)]),
            Value::Triple(x) => (Type::COLOR, vec![Const::Triple(*x)]),
            Value::Matrix(x) => (Type::MATRIX, vec![matrix(*x)]),
            Value::String(x) => (Type::STRING, vec![string(x.clone())]),
            Value::Ints(x) => (array(Type::INT, x.len()), of(x, Const::Int)),
            Value::Floats(x) => (array(Type::FLOAT, x.len()), of(x, Const::Float)),
            Value::Triples(x) => (array(Type::COLOR, x.len()), of(x, Const::Triple)),
            Value::Matrices(x) => (array(Type::MATRIX, x.len()), of(x, matrix)),
            Value::Strings(x) => (array(Type::STRING, x.len()), of(x, string)),
            Value::Struct(_) | Value::List(_) | Value::NullClosure => return None,
        })
    }

    /// The value of constants: one, or an array; `None` for closures and an empty array.
    pub(crate) fn of_constants(list: &[Const], array: bool) -> Option<Value> {
        fn all<T>(list: &[Const], of: impl Fn(&Const) -> Option<T>) -> Vec<T> {
            list.iter().filter_map(of).collect()
        }
        macro_rules! array_of {
            ($variant:ident, $pattern:pat => $value:expr) => {
                Value::$variant(all(
                    list,
                    |constant| if let $pattern = constant { Some($value) } else { None },
                ))
            };
        }
        Some(match list {
            [one] if !array => match one {
                Const::Int(n) => Value::Int(*n),
                Const::Float(x) => Value::Float(*x),
                Const::Triple(x) => Value::Triple(*x),
                Const::Matrix(m) => Value::Matrix(**m),
                Const::Str(s) => Value::String(s.to_string()),
                Const::Null => return None,
            },
            [Const::Int(_), ..] => array_of!(Ints, Const::Int(n) => *n),
            [Const::Float(_), ..] => array_of!(Floats, Const::Float(x) => *x),
            [Const::Triple(_), ..] => array_of!(Triples, Const::Triple(x) => *x),
            [Const::Matrix(_), ..] => array_of!(Matrices, Const::Matrix(m) => **m),
            [Const::Str(_), ..] => array_of!(Strings, Const::Str(s) => s.to_string()),
            [Const::Null, ..] | [] => return None,
        })
    }

    /// The value in the interpreter's form; `element` selects one element of an array. `None` for structs and
    /// closures, which no query returns.
    pub(crate) fn datum(self, element: Option<usize>) -> Option<Datum> {
        let (ty, values) = self.constants()?;
        match element {
            None if ty.is_array() => Some(Datum::array(values)),
            None => values.into_iter().next().map(Datum::one),
            Some(at) if ty.is_array() => values.into_iter().nth(at).map(Datum::one),
            Some(_) => None,
        }
    }
}
