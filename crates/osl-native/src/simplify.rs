//! Rewrites of operations that one instruction can do instead of two. Values keep their bits. Each function
//! says what a block should hold instead.

use crate::inst::{Binary, Compare, Inst, IntCompare, MaskValue, Op, Value};

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

fn made_by(insts: &[Inst], mask: MaskValue) -> Option<Inst> {
    insts.get(mask.0 as usize).copied()
}

/// The opposite comparison, for a mask that is a comparison.
pub(crate) fn not(insts: &[Inst], a: MaskValue) -> Option<Inst> {
    let inst = made_by(insts, a)?;
    Some(match (inst.op, inst.args()) {
        (Op::Compare(how), args) => Inst::new(Op::Compare(comparison(ANY & !cases(how))?), args),
        (Op::IntCompare(how), &[x, y]) => {
            let (opposite, x, y) = match how {
                IntCompare::Equal => (IntCompare::Unequal, x, y),
                IntCompare::Unequal => (IntCompare::Equal, x, y),
                IntCompare::Less => (IntCompare::LessEqual, y, x),
                IntCompare::LessEqual => (IntCompare::Less, y, x),
            };
            Inst::new(Op::IntCompare(opposite), &[x, y])
        }
        _ => return None,
    })
}

/// Two tests of the same floats as a single one.
pub(crate) fn both(insts: &[Inst], a: MaskValue, b: MaskValue) -> Option<Inst> {
    let (first, second) = (made_by(insts, a)?, made_by(insts, b)?);
    match (first.op, second.op) {
        (Op::Compare(p), Op::Compare(q)) if first.args() == second.args() => {
            Some(Inst::new(Op::Compare(comparison(cases(p) & cases(q))?), first.args()))
        }
        (Op::Class { nan, infinite }, Op::MaskNot) => {
            let excluded = made_by(insts, MaskValue(*second.args().first()?))?;
            let Op::Class { nan: no_nan, infinite: finite } = excluded.op else { return None };
            let op = Op::Class { nan: nan && !no_nan, infinite: infinite && !finite };
            (first.args() == excluded.args()).then(|| Inst::new(op, first.args()))
        }
        _ => None,
    }
}

/// Three masks whose conjunction is that of `a` and `b`, if one of these is itself a conjunction and has the
/// mask that is known last. That comes last here too, so that only one operation waits for it.
pub(crate) fn late_last(insts: &[Inst], a: MaskValue, b: MaskValue) -> Option<[MaskValue; 3]> {
    let (a, b) = if a.0 < b.0 { (a, b) } else { (b, a) };
    let Inst { op: Op::MaskAnd, .. } = made_by(insts, b)? else { return None };
    let &[x, y] = made_by(insts, b)?.args() else { return None };
    let (early, late) = (x.min(y), x.max(y));
    (a.0 < late && early < late).then_some([a, MaskValue(early), MaskValue(late)])
}

/// The bits of the inverse of a constant, if a product with it has the bits of the quotient: for a power of
/// two. Both are the exact result, rounded once.
pub(crate) fn exact_inverse(insts: &[Inst], divisor: Value) -> Option<u32> {
    const SIGN: u32 = 0x8000_0000;
    let Op::Constant(bits) = insts.get(divisor.0 as usize)?.op else { return None };
    let exponent = (bits & !SIGN) >> 23;
    let is_power = bits & 0x007F_FFFF == 0 && (1..254).contains(&exponent);
    is_power.then(|| bits & SIGN | (254 - exponent) << 23)
}

/// A number that is 1 or 0: made from a mask, or a constant.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Truth {
    Mask(MaskValue),
    Known(bool),
}

/// The truth of which a value is the number.
pub(crate) fn truth(insts: &[Inst], value: Value) -> Option<Truth> {
    let inst = insts.get(value.0 as usize)?;
    match (inst.op, inst.args()) {
        (Op::Number, [mask]) => Some(Truth::Mask(MaskValue(*mask))),
        (Op::Constant(bits @ 0..2), _) => Some(Truth::Known(bits == 1)),
        _ => None,
    }
}

/// A truth where a mask is known to be set, or known not to be.
pub(crate) fn under(insts: &[Inst], truth: Truth, mask: MaskValue, is_set: bool) -> Truth {
    let Truth::Mask(other) = truth else { return truth };
    if other == mask {
        Truth::Known(is_set)
    } else if opposite(insts, other) == Some(mask) || opposite(insts, mask) == Some(other) {
        Truth::Known(!is_set)
    } else {
        truth
    }
}

/// The mask that a comparison of a number of 1 or 0 tests, and whether it is that mask or its opposite.
pub(crate) fn tested(insts: &[Inst], how: IntCompare, a: Value, b: Value) -> Option<(MaskValue, bool)> {
    let is_equal = match how {
        IntCompare::Equal => true,
        IntCompare::Unequal => false,
        IntCompare::Less | IntCompare::LessEqual => return None,
    };
    match (truth(insts, a)?, truth(insts, b)?) {
        (Truth::Mask(mask), Truth::Known(bit)) | (Truth::Known(bit), Truth::Mask(mask)) => {
            Some((mask, bit == is_equal))
        }
        _ => None,
    }
}

/// If a value is a choice whose alternative is another value: its mask and what it chooses.
pub(crate) fn nested(insts: &[Inst], choice: Value, other: Value) -> Option<(MaskValue, Value)> {
    let inst = insts.get(choice.0 as usize)?;
    match (inst.op, inst.args()) {
        (Op::Choose, &[mask, yes, no]) if no == other.0 => Some((MaskValue(mask), Value(yes))),
        _ => None,
    }
}

/// The smaller of two floats, if a choice is exactly what [`Binary::Min`] computes.
pub(crate) fn min(insts: &[Inst], mask: MaskValue, yes: Value, no: Value) -> Option<Inst> {
    let inst = made_by(insts, mask)?;
    let (Op::Compare(how), &[x, y]) = (inst.op, inst.args()) else { return None };
    let straight = (yes.0, no.0) == (x, y);
    if !straight && (yes.0, no.0) != (y, x) {
        return None;
    }
    // The first float if it is smaller, in any of the four ways to say so.
    match (how, straight) {
        (Compare::Less, true) | (Compare::GreaterEqualOrNan, false) => {
            Some(Inst::new(Op::Binary(Binary::Min), &[x, y]))
        }
        (Compare::Greater, false) | (Compare::LessEqualOrNan, true) => {
            Some(Inst::new(Op::Binary(Binary::Min), &[y, x]))
        }
        _ => None,
    }
}

/// The mask `m`, if this mask is computed as `not m`.
pub(crate) fn opposite(insts: &[Inst], mask: MaskValue) -> Option<MaskValue> {
    let inst = made_by(insts, mask)?;
    (inst.op == Op::MaskNot).then(|| inst.args().first().map(|inner| MaskValue(*inner)))?
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::Block;

    #[test]
    fn of_three_masks_the_last_one_comes_last() {
        let mut block = Block::new();
        let array = block.array();
        let [x, y, z] = [0, 16, 32].map(|word| block.lanes(array, word));
        let active = block.not_zero(x);
        let (near, below) = (block.compare(Compare::Less, x, y), block.compare(Compare::Less, y, z));
        let inner = block.both(near, below);
        let all = block.both(active, inner);
        let early = made_by(&block.insts, all).and_then(|inst| inst.args().first().copied());
        let early = early.and_then(|v| made_by(&block.insts, MaskValue(v)));
        assert_eq!(made_by(&block.insts, all).map(|inst| inst.args()[1]), Some(below.0));
        assert_eq!(early, Some(Inst::new(Op::MaskAnd, &[active.0, near.0])));
    }
}
