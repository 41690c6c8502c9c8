//! Rewrites of operations that one instruction can do instead of two. Values keep their bits. This module
//! must not know registers.

use crate::block::{Binary, Block, Compare, Inst, IntCompare, MaskValue, Op, Value};

/// What two floats can be to each other, one bit each.
const LESS: u8 = 1;
const EQUAL: u8 = 2;
const GREATER: u8 = 4;
const NAN: u8 = 8;
const ANY: u8 = LESS | EQUAL | GREATER | NAN;

/// Each comparison, and the cases in which it is true.
const CASES: [(Compare, u8); 11] = [
    (Compare::Equal, EQUAL),
    (Compare::Less, LESS),
    (Compare::LessEqual, LESS | EQUAL),
    (Compare::GreaterEqual, GREATER | EQUAL),
    (Compare::Greater, GREATER),
    (Compare::EqualOrNan, EQUAL | NAN),
    (Compare::UnequalOrNan, LESS | GREATER | NAN),
    (Compare::LessOrNan, LESS | NAN),
    (Compare::LessEqualOrNan, LESS | EQUAL | NAN),
    (Compare::GreaterEqualOrNan, GREATER | EQUAL | NAN),
    (Compare::GreaterOrNan, GREATER | NAN),
];

fn cases(how: Compare) -> u8 {
    CASES.iter().find(|(have, _)| *have == how).map_or(0, |(_, cases)| *cases)
}

fn comparison(cases: u8) -> Option<Compare> {
    CASES.iter().find(|(_, have)| *have == cases).map(|(how, _)| *how)
}

fn made_by(block: &Block, mask: MaskValue) -> Option<Inst> {
    block.insts.get(mask.0 as usize).copied()
}

/// The opposite of a mask: the opposite comparison, or the mask of which it is the opposite.
pub(crate) fn not(block: &mut Block, a: MaskValue) -> Option<MaskValue> {
    let inst = made_by(block, a)?;
    Some(match (inst.op, inst.args()) {
        (Op::MaskNot, &[inner]) => MaskValue(inner),
        (Op::Compare(how), &[x, y]) => {
            let opposite = comparison(ANY & !cases(how))?;
            block.compare(opposite, Value(x), Value(y))
        }
        (Op::IntCompare(how), &[x, y]) => {
            let (opposite, x, y) = match how {
                IntCompare::Equal => (IntCompare::Unequal, x, y),
                IntCompare::Unequal => (IntCompare::Equal, x, y),
                IntCompare::Less => (IntCompare::LessEqual, y, x),
                IntCompare::LessEqual => (IntCompare::Less, y, x),
            };
            block.compare_ints(opposite, Value(x), Value(y))
        }
        _ => return None,
    })
}

/// Two tests of the same floats as a single one.
pub(crate) fn both(block: &mut Block, a: MaskValue, b: MaskValue) -> Option<MaskValue> {
    let (first, second) = (made_by(block, a)?, made_by(block, b)?);
    match (first.op, second.op) {
        (Op::Compare(p), Op::Compare(q)) if first.args() == second.args() => {
            let (how, args) = (comparison(cases(p) & cases(q))?, first.args());
            Some(block.compare(how, Value(*args.first()?), Value(*args.get(1)?)))
        }
        (Op::Class { nan, infinite }, Op::MaskNot) => {
            let excluded = made_by(block, MaskValue(*second.args().first()?))?;
            let Op::Class { nan: no_nan, infinite: finite } = excluded.op else { return None };
            let x = Value(*first.args().first()?);
            (first.args() == excluded.args()).then(|| block.class(x, nan && !no_nan, infinite && !finite))
        }
        _ => None,
    }
}

/// The smaller of two floats, if a choice is exactly what [`Binary::Min`] computes.
pub(crate) fn min(block: &mut Block, mask: MaskValue, yes: Value, no: Value) -> Option<Value> {
    let inst = made_by(block, mask)?;
    let (Op::Compare(how), &[x, y]) = (inst.op, inst.args()) else { return None };
    let straight = (yes.0, no.0) == (x, y);
    if !straight && (yes.0, no.0) != (y, x) {
        return None;
    }
    // The first float if it is smaller, in any of the four ways to say so.
    match (how, straight) {
        (Compare::Less, true) | (Compare::GreaterEqualOrNan, false) => {
            Some(block.binary(Binary::Min, Value(x), Value(y)))
        }
        (Compare::Greater, false) | (Compare::LessEqualOrNan, true) => {
            Some(block.binary(Binary::Min, Value(y), Value(x)))
        }
        _ => None,
    }
}

/// The mask of which this one is the opposite, if it is computed as such.
pub(crate) fn opposite(block: &Block, mask: MaskValue) -> Option<MaskValue> {
    let inst = made_by(block, mask)?;
    (inst.op == Op::MaskNot).then(|| inst.args().first().map(|inner| MaskValue(*inner)))?
}
