//! The values that operations compute with: their kinds, and constants.

use std::sync::Arc;

/// The kind of a value, for storage and arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// 32-bit integer; truth values are 0 and 1.
    Int,
    /// Number of the arithmetic in use.
    Float,
    /// Three floats.
    Triple,
    /// Sixteen floats, row by row.
    Matrix,
    /// String.
    Str,
    /// Closure.
    Closure,
}

impl Kind {
    /// 32-bit words of a value.
    pub fn words(self) -> u32 {
        match self {
            Kind::Int | Kind::Float | Kind::Str | Kind::Closure => 1,
            Kind::Triple => 3,
            Kind::Matrix => 16,
        }
    }
}

/// A constant.
#[derive(Clone, Debug, PartialEq)]
pub enum Const {
    /// An int.
    Int(i32),
    /// A float.
    Float(f32),
    /// Three floats.
    Triple([f32; 3]),
    /// Sixteen floats, row by row.
    Matrix(Box<[f32; 16]>),
    /// A string.
    Str(Arc<str>),
    /// The null closure.
    Null,
}

impl Const {
    /// Its kind.
    pub fn kind(&self) -> Kind {
        match self {
            Const::Int(_) => Kind::Int,
            Const::Float(_) => Kind::Float,
            Const::Triple(_) => Kind::Triple,
            Const::Matrix(_) => Kind::Matrix,
            Const::Str(_) => Kind::Str,
            Const::Null => Kind::Closure,
        }
    }

    /// Zero, empty or null, by kind.
    pub fn zero(kind: Kind) -> Const {
        match kind {
            Kind::Int => Const::Int(0),
            Kind::Float => Const::Float(0.0),
            Kind::Triple => Const::Triple([0.0; 3]),
            Kind::Matrix => Const::Matrix(Box::new([0.0; 16])),
            Kind::Str => Const::Str("".into()),
            Kind::Closure => Const::Null,
        }
    }

    /// Whether the bits are equal: −0 and 0 differ, and a NaN equals itself.
    pub fn same_bits(&self, other: &Const) -> bool {
        let eq = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        match (self, other) {
            (Const::Float(a), Const::Float(b)) => a.to_bits() == b.to_bits(),
            (Const::Triple(a), Const::Triple(b)) => eq(a, b),
            (Const::Matrix(a), Const::Matrix(b)) => eq(&a[..], &b[..]),
            _ => self == other,
        }
    }
}
