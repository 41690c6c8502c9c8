//! What each operation computes, one lane at a time. This module must not know code.

use osl_native::{Binary, Compare, IntCompare, Unary};

pub(crate) const BINARY: [Binary; 15] = [
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
    Binary::And,
    Binary::Or,
    Binary::Xor,
    Binary::Shl,
    Binary::Shr,
];

pub(crate) const UNARY: [Unary; 8] = [
    Unary::Sqrt,
    Unary::InverseRoot,
    Unary::Floor,
    Unary::Ceil,
    Unary::Trunc,
    Unary::ToFloat,
    Unary::ToInt,
    Unary::IntAbs,
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
pub(crate) fn plain(x: f32) -> u32 {
    if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() }
}

pub(crate) fn binary(op: Binary, a: u32, b: u32) -> u32 {
    let (x, y) = (f32::from_bits(a), f32::from_bits(b));
    let (i, j) = (a as i32, b as i32);
    match op {
        Binary::Add => plain(x + y),
        Binary::Sub => plain(x - y),
        Binary::Mul => plain(x * y),
        Binary::Div => plain(x / y),
        Binary::Min => {
            if x < y {
                a
            } else {
                b
            }
        }
        Binary::IntAdd => i.wrapping_add(j) as u32,
        Binary::IntSub => i.wrapping_sub(j) as u32,
        Binary::IntMul => i.wrapping_mul(j) as u32,
        Binary::IntMin => i.min(j) as u32,
        Binary::IntMax => i.max(j) as u32,
        Binary::And => a & b,
        Binary::Or => a | b,
        Binary::Xor => a ^ b,
        Binary::Shl => a.checked_shl(b).unwrap_or(0),
        Binary::Shr => (i >> b.min(31)) as u32,
    }
}

pub(crate) fn unary(op: Unary, a: u32) -> u32 {
    let x = f32::from_bits(a);
    match op {
        Unary::Sqrt => plain(x.sqrt()),
        // The result for zero is unspecified; NaN means that it is not compared.
        Unary::InverseRoot if x == 0.0 => f32::NAN.to_bits(),
        Unary::InverseRoot => plain(1.0 / x.sqrt()),
        Unary::Floor => plain(x.floor()),
        Unary::Ceil => plain(x.ceil()),
        Unary::Trunc => plain(x.trunc()),
        Unary::ToFloat => (a as i32 as f32).to_bits(),
        Unary::ToInt => {
            let fits = x > -2_147_483_904.0 && x < 2_147_483_648.0;
            if fits { x as i32 as u32 } else { i32::MIN as u32 }
        }
        Unary::IntAbs => (a as i32).wrapping_abs() as u32,
    }
}

/// A word unless it is NaN.
pub(crate) fn number(word: u32) -> Option<u32> {
    (!f32::from_bits(word).is_nan()).then_some(word)
}

pub(crate) fn length(v: [u32; 3]) -> u32 {
    let [x, y, z] = v.map(|x| f32::from_bits(x).abs());
    let square = x * x + y * y + z * z;
    let largest = if x < y { y } else { x };
    let largest = if largest < z { z } else { largest };
    let [p, q, r] = [x, y, z].map(|x| x / largest);
    let rescued = if largest == 0.0 { 0.0 } else { largest * (p * p + q * q + r * r).sqrt() };
    plain(if square < f32::from_bits(0x0100_0000) { rescued } else { square.sqrt() })
}

pub(crate) fn compare(how: Compare, a: u32, b: u32) -> bool {
    let (x, y) = (f32::from_bits(a), f32::from_bits(b));
    let nan = x.is_nan() || y.is_nan();
    match how {
        Compare::Equal => x == y,
        Compare::Less => x < y,
        Compare::LessEqual => x <= y,
        Compare::GreaterEqual => x >= y,
        Compare::Greater => x > y,
        Compare::EqualOrNan => x == y || nan,
        Compare::UnequalOrNan => x != y,
        Compare::LessOrNan => x < y || nan,
        Compare::LessEqualOrNan => x <= y || nan,
        Compare::GreaterEqualOrNan => x >= y || nan,
        Compare::GreaterOrNan => x > y || nan,
    }
}

pub(crate) fn compare_ints(how: IntCompare, a: u32, b: u32) -> bool {
    let (i, j) = (a as i32, b as i32);
    match how {
        IntCompare::Equal => i == j,
        IntCompare::Less => i < j,
        IntCompare::LessEqual => i <= j,
        IntCompare::Unequal => i != j,
    }
}

/// Whether words are equal, or both NaN.
pub(crate) fn alike(a: u32, b: u32) -> bool {
    a == b || f32::from_bits(a).is_nan() && f32::from_bits(b).is_nan()
}
