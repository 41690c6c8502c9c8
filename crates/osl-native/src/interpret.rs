//! Runs a block without machine code, one lane at a time: the definition of what its operations compute. Each
//! lane takes its own way through the regions.
//!
//! It is slow, runs everywhere, and is meant for tests of blocks on machines without a
//! [`Target`](crate::Target).

use crate::block::Block;
use crate::code::Words;
use crate::inst::{Array, Binary, Carry, Compare, IntCompare, Kind, Op, Region, Unary};
use std::ops::Range;

/// Computes lanes of the arrays. `None` if an array is missing, too short or read-only, or if the block
/// stops.
pub fn interpret(block: &Block, arrays: &mut [Words<'_>], lanes: Range<usize>) -> Option<()> {
    let mut words = vec![0; block.insts.len()];
    for lane in lanes {
        // Where the lane goes on after a part that it skips. What is in memory can be used after that part.
        let (mut at, mut resumes) = (0, 0);
        while let Some(inst) = block.insts.get(at) {
            if at < resumes && !inst.op.is_source() {
                at += 1;
                continue;
            }
            let arg = |n: usize| inst.args().get(n).and_then(|v| words.get(*v as usize)).copied();
            words[at] = match inst.op {
                Op::Lanes(array, word) => read(arrays, array, word as usize + lane)?,
                Op::Word(array, word) => read(arrays, array, word as usize)?,
                Op::LookUp(array, word) => read(arrays, array, (word + (arg(0)? & 15)) as usize)?,
                Op::LanesAt(array, word) => read(arrays, array, (word + arg(0)?) as usize + lane)?,
                Op::Gather(array, word) => read(arrays, array, (word + arg(0)?) as usize)?,
                Op::Constant(bits) => bits,
                Op::Unary(op) => unary(op, arg(0)?),
                Op::Binary(op) => binary(op, arg(0)?, arg(1)?),
                Op::Compare(how) => compare(how, arg(0)?, arg(1)?).into(),
                Op::IntCompare(how) => compare_ints(how, arg(0)?, arg(1)?).into(),
                Op::NotZero => (arg(0)? != 0).into(),
                Op::Class { nan, infinite } => class(arg(0)?, nan, infinite).into(),
                Op::MaskAnd => arg(0)? & arg(1)?,
                Op::MaskOr => arg(0)? | arg(1)?,
                Op::MaskNot => arg(0)? ^ 1,
                Op::Choose => arg(if arg(0)? != 0 { 1 } else { 2 })?,
                Op::Fused { less } => fused([arg(0)?, arg(1)?, arg(2)?], less),
                Op::Length => length(arg(1)?, [arg(2)?, arg(3)?, arg(4)?]),
                Op::Number => arg(0)?,
                Op::Store(array, word) => {
                    let value = arg(0)?;
                    *written(arrays, array, word as usize + lane)? = value;
                    0
                }
                Op::StoreAt(array, word) => {
                    let (offset, value) = (arg(0)?, arg(1)?);
                    *written(arrays, array, (word + offset) as usize + lane)? = value;
                    0
                }
                Op::Stop => {
                    if arg(0)? != 0 {
                        return None;
                    }
                    0
                }
                Op::Begin(region) | Op::End(region) => {
                    let next = enter_or_leave(block.regions.get(region as usize)?, at, &mut words)?;
                    (at, resumes) = if next > at { (at + 1, next) } else { (next, 0) };
                    continue;
                }
                // Written at the start and at the end of its region.
                Op::Carried { .. } => words[at],
            };
            at += 1;
        }
    }
    Some(())
}

/// The operation after the start or the end of a region. Sets the values that the region carries.
fn enter_or_leave(region: &Region, at: usize, words: &mut [u32]) -> Option<usize> {
    let value = |words: &[u32], v: u32| words.get(v as usize).copied();
    let begins = at == region.begin as usize;
    let from = |carry: &Carry| value(words, if begins { carry.init } else { carry.next });
    let list = region.carried.iter().map(from).collect::<Option<Vec<u32>>>()?;
    let inside = match region.kind {
        Kind::Loop => begins || value(words, region.again)? != 0,
        Kind::Skip { mask } => begins && value(words, mask)? != 0,
    };
    for (carry, word) in region.carried.iter().zip(list) {
        *words.get_mut(if inside { carry.param } else { carry.result } as usize)? = word;
    }
    Some(1 + if inside { region.begin } else { region.end } as usize)
}

fn written<'a>(arrays: &'a mut [Words<'_>], Array(array): Array, word: usize) -> Option<&'a mut u32> {
    match arrays.get_mut(array as usize)? {
        Words::Write(list) => list.get_mut(word),
        Words::Read(_) => None,
    }
}

fn read(arrays: &[Words<'_>], Array(array): Array, word: usize) -> Option<u32> {
    match arrays.get(array as usize)? {
        Words::Read(list) => list.get(word).copied(),
        Words::Write(list) => list.get(word).copied(),
    }
}

/// An operation on one word.
pub fn unary(op: Unary, a: u32) -> u32 {
    let x = f32::from_bits(a);
    match op {
        Unary::Sqrt => x.sqrt().to_bits(),
        Unary::InverseRoot => (1.0 / x.sqrt()).to_bits(),
        Unary::Floor => x.floor().to_bits(),
        Unary::Ceil => x.ceil().to_bits(),
        Unary::Trunc => x.trunc().to_bits(),
        Unary::ToFloat => (a as i32 as f32).to_bits(),
        Unary::ToInt => {
            let fits = x > -2_147_483_904.0 && x < 2_147_483_648.0;
            if fits { x as i32 as u32 } else { i32::MIN as u32 }
        }
        Unary::IntAbs => (a as i32).unsigned_abs(),
        Unary::HighProduct(factor) => ((i64::from(a as i32) * i64::from(factor)) >> 32) as u32,
    }
}

/// An operation on two words.
pub fn binary(op: Binary, a: u32, b: u32) -> u32 {
    let (x, y) = (f32::from_bits(a), f32::from_bits(b));
    let (i, j) = (a as i32, b as i32);
    match op {
        Binary::Add => (x + y).to_bits(),
        Binary::Sub => (x - y).to_bits(),
        Binary::Mul => (x * y).to_bits(),
        Binary::Div => (x / y).to_bits(),
        Binary::Min => {
            if x < y {
                a
            } else {
                b
            }
        }
        Binary::IntAdd => a.wrapping_add(b),
        Binary::IntSub => a.wrapping_sub(b),
        Binary::IntMul => a.wrapping_mul(b),
        Binary::IntMin => i.min(j) as u32,
        Binary::IntMax => i.max(j) as u32,
        Binary::WordMin => a.min(b),
        Binary::And => a & b,
        Binary::Or => a | b,
        Binary::Xor => a ^ b,
        Binary::Shl => a.checked_shl(b).unwrap_or(0),
        Binary::Shr => (i >> b.min(31)) as u32,
    }
}

/// A comparison of two floats.
pub fn compare(how: Compare, a: u32, b: u32) -> bool {
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

/// A comparison of two ints.
pub fn compare_ints(how: IntCompare, a: u32, b: u32) -> bool {
    let (i, j) = (a as i32, b as i32);
    match how {
        IntCompare::Equal => i == j,
        IntCompare::Less => i < j,
        IntCompare::LessEqual => i <= j,
        IntCompare::Unequal => i != j,
    }
}

fn class(a: u32, nan: bool, infinite: bool) -> bool {
    let x = f32::from_bits(a);
    nan && x.is_nan() || infinite && x.is_infinite()
}

fn fused(args: [u32; 3], less: bool) -> u32 {
    let [x, y, z] = args.map(f32::from_bits);
    (if less { -y } else { y }).mul_add(z, x).to_bits()
}

/// The length of a vector by its square; see [`Block::length`].
pub fn length(square: u32, v: [u32; 3]) -> u32 {
    let (square, [x, y, z]) = (f32::from_bits(square), v.map(|x| f32::from_bits(x).abs()));
    let largest = if x < y { y } else { x };
    let largest = if largest < z { z } else { largest };
    let [p, q, r] = [x, y, z].map(|x| x / largest);
    let rescued = if largest == 0.0 { 0.0 } else { largest * (p * p + q * q + r * r).sqrt() };
    (if square < f32::from_bits(0x0100_0000) { rescued } else { square.sqrt() }).to_bits()
}
