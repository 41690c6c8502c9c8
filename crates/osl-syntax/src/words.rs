//! The words and operators of the language that tokens and trees share.

use std::sync::Arc;

/// The kind of a shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShaderKind {
    /// `shader`: any use.
    Generic,
    /// `surface`.
    Surface,
    /// `displacement`.
    Displacement,
    /// `volume`.
    Volume,
}

/// Names of types.
#[derive(Clone, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "each variant is the keyword of its name")]
pub enum TypeName {
    Int,
    Float,
    Color,
    Point,
    Vector,
    Normal,
    Matrix,
    String,
    Void,
    /// A struct, by name.
    Struct(Arc<str>),
}

/// Prefix operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnaryOp {
    /// `-`
    Neg,
    /// `!` and `not`
    Not,
    /// `~`
    Compl,
}

/// Binary operators, from tighter to looser within a family.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "named as in operator overloads, __operator__X__")]
pub enum BinaryOp {
    Mul,
    Div,
    Mod,
    Add,
    Sub,
    Shl,
    Shr,
    Lt,
    Le,
    Gt,
    Ge,
    Eq,
    Ne,
    BitAnd,
    BitXor,
    BitOr,
    And,
    Or,
}

impl BinaryOp {
    /// How tightly it binds: operators with a higher number first.
    pub(crate) fn precedence(self) -> u8 {
        use BinaryOp::*;
        match self {
            Or => 1,
            And => 2,
            BitOr => 3,
            BitXor => 4,
            BitAnd => 5,
            Eq | Ne => 6,
            Lt | Le | Gt | Ge => 7,
            Shl | Shr => 8,
            Add | Sub => 9,
            Mul | Div | Mod => 10,
        }
    }
}
