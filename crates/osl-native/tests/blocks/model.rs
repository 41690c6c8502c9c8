//! What each operation computes, one lane at a time. This module must not know code.

pub(crate) use osl_native::interpret::{compare, compare_ints};
use osl_native::{Binary, Compare, IntCompare, Unary, interpret};

pub(crate) const BINARY: [Binary; 16] = [
    Binary::Add,
    Binary::Sub,
    Binary::Mul,
    Binary::Div,
    Binary::Min,
    Binary::IntAdd,
    Binary::IntSub,
    Binary::IntMul,
    Binary::IntMin,
    Binary::IntMax,
    Binary::WordMin,
    Binary::And,
    Binary::Or,
    Binary::Xor,
    Binary::Shl,
    Binary::Shr,
];

pub(crate) const UNARY: [Unary; 11] = [
    Unary::Sqrt,
    Unary::InverseRoot,
    Unary::Floor,
    Unary::Ceil,
    Unary::Trunc,
    Unary::ToFloat,
    Unary::ToInt,
    Unary::IntAbs,
    Unary::HighProduct(0x6666_6667),
    Unary::HighProduct(-0x6DB6_DB6D),
    Unary::HighProduct(i32::MIN),
];

pub(crate) const COMPARE: [Compare; 11] = [
    Compare::Equal,
    Compare::Less,
    Compare::LessEqual,
    Compare::GreaterEqual,
    Compare::Greater,
    Compare::EqualOrNan,
    Compare::UnequalOrNan,
    Compare::LessOrNan,
    Compare::LessEqualOrNan,
    Compare::GreaterEqualOrNan,
    Compare::GreaterOrNan,
];

pub(crate) const INT_COMPARE: [IntCompare; 4] =
    [IntCompare::Equal, IntCompare::Less, IntCompare::LessEqual, IntCompare::Unequal];

/// Replaces every NaN by one, because the NaN that an operation on two NaNs returns is unspecified.
pub(crate) fn plain(x: u32) -> u32 {
    if f32::from_bits(x).is_nan() { f32::NAN.to_bits() } else { x }
}

pub(crate) fn binary(op: Binary, a: u32, b: u32) -> u32 {
    let is_float = matches!(op, Binary::Add | Binary::Sub | Binary::Mul | Binary::Div);
    let result = interpret::binary(op, a, b);
    if is_float { plain(result) } else { result }
}

pub(crate) fn unary(op: Unary, a: u32) -> u32 {
    match op {
        // The result for zero is unspecified; NaN means that it is not compared.
        Unary::InverseRoot if a << 1 == 0 => f32::NAN.to_bits(),
        Unary::ToFloat | Unary::ToInt | Unary::IntAbs | Unary::HighProduct(_) => interpret::unary(op, a),
        _ => plain(interpret::unary(op, a)),
    }
}

/// A word unless it is NaN.
pub(crate) fn number(word: u32) -> Option<u32> {
    (!f32::from_bits(word).is_nan()).then_some(word)
}

pub(crate) fn length(v: [u32; 3]) -> u32 {
    let [x, y, z] = v.map(f32::from_bits);
    plain(interpret::length((x * x + y * y + z * z).to_bits(), v))
}

/// Whether words are equal, or both NaN.
pub(crate) fn alike(a: u32, b: u32) -> bool {
    a == b || f32::from_bits(a).is_nan() && f32::from_bits(b).is_nan()
}
