//! Numbers, ints and masks that are nodes of a block.
//!
//! The operations of the arithmetic's traits add nodes, or are computed at once if all operands are
//! constants. What no node computes is missing.

use osl_native::{Binary, Block, Compare, IntCompare, MaskValue, Unary, Value};
use osl_numeric::{Int, Mask, Number, Real, Single, rounding};
use std::cell::RefCell;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

const SIGN: u32 = 0x8000_0000;

/// A value while a body runs: a constant, a node of the block, or missing if it cannot be recorded.
#[derive(Clone, Copy, Debug)]
pub(super) enum Item<'a, C, N> {
    Constant(C),
    Node(&'a RefCell<Block>, N),
    Missing,
}

pub(super) type Word<'a> = Item<'a, u32, Value>;

impl Word<'_> {
    pub(super) fn value(self, block: &mut Block) -> Option<Value> {
        match self {
            Item::Constant(bits) => Some(block.bits(bits)),
            Item::Node(_, value) => Some(value),
            Item::Missing => None,
        }
    }
}

/// The result of an operation on words: computed if all are constants, else recorded.
fn record<'a, C, N, const COUNT: usize>(
    args: [Word<'a>; COUNT],
    compute: impl FnOnce([u32; COUNT]) -> C,
    write: impl FnOnce(&mut Block, [Value; COUNT]) -> N,
) -> Item<'a, C, N> {
    let (mut block, mut constants) = (None, [0; COUNT]);
    for (constant, arg) in constants.iter_mut().zip(args) {
        match arg {
            Item::Constant(bits) => *constant = bits,
            Item::Node(cell, _) => block = Some(cell),
            Item::Missing => return Item::Missing,
        }
    }
    let Some(cell) = block else { return Item::Constant(compute(constants)) };
    let block = &mut *cell.borrow_mut();
    let values = args.map(|arg| match arg {
        Item::Node(_, value) => value,
        Item::Constant(bits) => block.bits(bits),
        Item::Missing => block.bits(0),
    });
    Item::Node(cell, write(block, values))
}

/// `yes` where the mask is set, else `no`.
fn choose<'a>(mask: Condition<'a>, yes: Word<'a>, no: Word<'a>) -> Word<'a> {
    match mask.0 {
        Item::Constant(mask) => {
            if mask {
                yes
            } else {
                no
            }
        }
        Item::Node(cell, mask) => {
            let block = &mut *cell.borrow_mut();
            match (yes.value(block), no.value(block)) {
                (Some(yes), Some(no)) => Item::Node(cell, block.choose(mask, yes, no)),
                _ => Item::Missing,
            }
        }
        Item::Missing => Item::Missing,
    }
}

/// A recorded mask.
#[derive(Clone, Copy, Debug)]
pub(super) struct Condition<'a>(Item<'a, bool, MaskValue>);

impl Mask for Condition<'_> {}

impl<'a> Condition<'a> {
    /// The result if one operand is the constant `decisive`, which determines it.
    fn with(
        self,
        other: Self,
        decisive: bool,
        write: impl FnOnce(&mut Block, MaskValue, MaskValue) -> MaskValue,
    ) -> Self {
        match (self.0, other.0) {
            (Item::Missing, _) | (_, Item::Missing) => Condition(Item::Missing),
            (Item::Constant(c), _) => {
                if c == decisive {
                    self
                } else {
                    other
                }
            }
            (_, Item::Constant(c)) => {
                if c == decisive {
                    other
                } else {
                    self
                }
            }
            (Item::Node(cell, a), Item::Node(_, b)) => {
                Condition(Item::Node(cell, write(&mut cell.borrow_mut(), a, b)))
            }
        }
    }
}

impl BitAnd for Condition<'_> {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        self.with(other, false, Block::both)
    }
}

impl BitOr for Condition<'_> {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        self.with(other, true, Block::either)
    }
}

impl Not for Condition<'_> {
    type Output = Self;
    fn not(self) -> Self {
        Condition(match self.0 {
            Item::Constant(mask) => Item::Constant(!mask),
            Item::Node(cell, mask) => Item::Node(cell, cell.borrow_mut().not(mask)),
            Item::Missing => Item::Missing,
        })
    }
}

/// A recorded int.
#[derive(Clone, Copy, Debug)]
pub(super) struct Integer<'a>(pub(super) Word<'a>);

impl<'a> Integer<'a> {
    fn unary(self, op: Unary, compute: impl FnOnce(i32) -> i32) -> Self {
        Integer(record([self.0], |[x]| compute(x as i32) as u32, |block, [x]| block.unary(op, x)))
    }

    fn binary(self, other: Self, op: Binary, compute: impl FnOnce(i32, i32) -> i32) -> Self {
        let compute = |[x, y]: [u32; 2]| compute(x as i32, y as i32) as u32;
        Integer(record([self.0, other.0], compute, |block, [x, y]| block.binary(op, x, y)))
    }

    /// The quotient by a constant; 0 for 0.
    fn quotient_by(self, divisor: i32) -> Self {
        let size = divisor.unsigned_abs();
        let sign = self.shr(Self::lit(31));
        let quotient = match size {
            0 => Self::lit(0),
            1 => self,
            // Below zero, a shift rounds away from it.
            _ if size.is_power_of_two() => {
                let lacking = sign & Self::lit((size - 1) as i32);
                self.wrapping_add(lacking).shr(Self::lit(size.trailing_zeros() as i32))
            }
            _ => {
                let (factor, distance) = inverse(size);
                let product = self.unary(Unary::HighProduct(factor as i32), |x| {
                    ((i64::from(x) * i64::from(factor as i32)) >> 32) as i32
                });
                // As an int, a factor of 2^31 or more is 2^32 smaller.
                let is_less = factor > i32::MAX as u32;
                let product = if is_less { product.wrapping_add(self) } else { product };
                product.shr(Self::lit(distance)).wrapping_sub(sign)
            }
        };
        if divisor < 0 { Self::lit(0).wrapping_sub(quotient) } else { quotient }
    }

    fn compare(self, other: Self, how: IntCompare, compute: impl FnOnce(i32, i32) -> bool) -> Condition<'a> {
        let compute = |[x, y]: [u32; 2]| compute(x as i32, y as i32);
        Condition(record([self.0, other.0], compute, |block, [x, y]| block.compare_ints(how, x, y)))
    }
}

/// A factor and a distance: the upper half of a number's product with the factor, shifted right by the
/// distance, is the quotient by a divisor that is above 2 and no power of two, rounded down; for a number
/// below zero one less than the quotient (Granlund and Montgomery, "Division by Invariant Integers using
/// Multiplication", 1994).
fn inverse(divisor: u32) -> (u32, i32) {
    let divisor = u64::from(divisor);
    let mut distance = 0;
    loop {
        let power = 1_u64 << (32 + distance);
        let factor = power / divisor + 1;
        // What the factor is too large by, times 2^31, must not be larger than the power.
        if factor * divisor - power <= 2 << distance {
            return (factor as u32, distance);
        }
        distance += 1;
    }
}

macro_rules! int_operators {
    ($($trait:ident $name:ident $op:tt $binary:ident;)*) => {$(
        impl $trait for Integer<'_> {
            type Output = Self;
            fn $name(self, other: Self) -> Self {
                self.binary(other, Binary::$binary, |x, y| x $op y)
            }
        }
    )*};
}

int_operators! {
    BitAnd bitand & And;
    BitOr bitor | Or;
    BitXor bitxor ^ Xor;
}

impl Not for Integer<'_> {
    type Output = Self;
    fn not(self) -> Self {
        self ^ Self::lit(-1)
    }
}

impl<'a> Int for Integer<'a> {
    type Mask = Condition<'a>;

    fn lit(value: i32) -> Self {
        Integer(Item::Constant(value as u32))
    }

    fn select(mask: Condition<'a>, yes: Self, no: Self) -> Self {
        Integer(choose(mask, yes.0, no.0))
    }

    fn of_mask(mask: Condition<'a>) -> Self {
        Integer(match mask.0 {
            Item::Constant(mask) => Item::Constant(mask.into()),
            Item::Node(cell, mask) => Item::Node(cell, cell.borrow_mut().number(mask)),
            Item::Missing => Item::Missing,
        })
    }

    fn is_true(self) -> Condition<'a> {
        Condition(record([self.0], |[x]| x != 0, |block, [x]| block.not_zero(x)))
    }

    fn eq(self, other: Self) -> Condition<'a> {
        self.compare(other, IntCompare::Equal, |x, y| x == y)
    }

    fn lt(self, other: Self) -> Condition<'a> {
        self.compare(other, IntCompare::Less, |x, y| x < y)
    }

    fn ne(self, other: Self) -> Condition<'a> {
        self.compare(other, IntCompare::Unequal, |x, y| x != y)
    }

    fn le(self, other: Self) -> Condition<'a> {
        self.compare(other, IntCompare::LessEqual, |x, y| x <= y)
    }

    fn wrapping_add(self, other: Self) -> Self {
        self.binary(other, Binary::IntAdd, i32::wrapping_add)
    }

    fn wrapping_sub(self, other: Self) -> Self {
        self.binary(other, Binary::IntSub, i32::wrapping_sub)
    }

    fn wrapping_mul(self, other: Self) -> Self {
        self.binary(other, Binary::IntMul, i32::wrapping_mul)
    }

    fn wrapping_abs(self) -> Self {
        self.unary(Unary::IntAbs, i32::wrapping_abs)
    }

    fn min(self, other: Self) -> Self {
        self.binary(other, Binary::IntMin, Ord::min)
    }

    fn max(self, other: Self) -> Self {
        self.binary(other, Binary::IntMax, Ord::max)
    }

    fn shl(self, distance: Self) -> Self {
        self.binary(distance & Self::lit(31), Binary::Shl, Int::shl)
    }

    fn shr(self, distance: Self) -> Self {
        self.binary(distance & Self::lit(31), Binary::Shr, Int::shr)
    }

    fn quotient(self, divisor: Self) -> Self {
        if let Item::Constant(divisor) = divisor.0 {
            return self.quotient_by(divisor as i32);
        }
        // A loop computes the inverse of a divisor that does not change only once.
        let inverse = Float::lit(1.0) / Float::from_int(divisor);
        let about = |x: Self| (Float::from_int(x) * inverse).to_int();
        let left = |x: Self, times: Self| x.wrapping_sub(times.wrapping_mul(divisor));
        // Four roundings of 2^-24 each put the first quotient off by up to 513, that of what it leaves by
        // one. All products and sums are right modulo 2^32.
        let first = about(self);
        let rest = left(self, first);
        let second = about(rest);
        let rest = left(rest, second);
        let quotient = first.wrapping_add(second);
        // What is left must be smaller than the divisor, and have the sign of the dividend. Negative
        // magnitudes hold for the least int too.
        let zero = Self::lit(0);
        let magnitude = |x: Self| Int::min(x, zero.wrapping_sub(x));
        let too_large = (rest ^ self).lt(zero) & rest.ne(zero);
        let too_small = !too_large & magnitude(rest).le(magnitude(divisor));
        let one = (self ^ divisor).shr(Self::lit(31)) | Self::lit(1);
        let larger = Self::select(too_small, quotient.wrapping_add(one), quotient);
        Self::select(too_large, quotient.wrapping_sub(one), larger)
    }
}

/// A recorded float of the strict arithmetic.
#[derive(Clone, Copy, Debug)]
pub(super) struct Float<'a>(pub(super) Word<'a>);

impl<'a> Float<'a> {
    fn unary(self, op: Unary, compute: impl FnOnce(f32) -> f32) -> Self {
        let compute = |[x]: [u32; 1]| compute(f32::from_bits(x)).to_bits();
        Float(record([self.0], compute, |block, [x]| block.unary(op, x)))
    }

    fn binary(self, other: Self, op: Binary, compute: impl FnOnce(f32, f32) -> f32) -> Self {
        let compute = |[x, y]: [u32; 2]| compute(f32::from_bits(x), f32::from_bits(y)).to_bits();
        Float(record([self.0, other.0], compute, |block, [x, y]| block.binary(op, x, y)))
    }

    fn compare(self, other: Self, how: Compare, compute: impl FnOnce(f32, f32) -> bool) -> Condition<'a> {
        let compute = |[x, y]: [u32; 2]| compute(f32::from_bits(x), f32::from_bits(y));
        Condition(record([self.0, other.0], compute, |block, [x, y]| block.compare(how, x, y)))
    }

    fn class(self, nan: bool, infinite: bool) -> Condition<'a> {
        let compute = |[x]: [u32; 1]| {
            let x = f32::from_bits(x);
            nan && x.is_nan() || infinite && x.is_infinite()
        };
        Condition(record([self.0], compute, |block, [x]| block.class(x, nan, infinite)))
    }

    fn fused(self, a: Self, b: Self, less: bool) -> Self {
        let compute = |[x, a, b]: [u32; 3]| {
            let [x, a, b] = [x, a, b].map(f32::from_bits);
            if less { x.minus_fused(a, b) } else { x.plus_fused(a, b) }.to_bits()
        };
        Float(record([self.0, a.0, b.0], compute, |block, [x, a, b]| block.fused(x, [a, b], less)))
    }
}

macro_rules! float_operators {
    ($($trait:ident $name:ident $op:tt;)*) => {$(
        impl $trait for Float<'_> {
            type Output = Self;
            fn $name(self, other: Self) -> Self {
                self.binary(other, Binary::$trait, |x, y| x $op y)
            }
        }
    )*};
}

float_operators! {
    Add add +;
    Sub sub -;
    Mul mul *;
    Div div /;
}

impl Neg for Float<'_> {
    type Output = Self;
    fn neg(self) -> Self {
        Float((Integer(self.0) ^ Integer(Item::Constant(SIGN))).0)
    }
}

impl<'a> Number for Float<'a> {
    type Mask = Condition<'a>;

    fn lit(value: f32) -> Self {
        Float(Item::Constant(value.to_bits()))
    }

    fn known(single: f32, _: f64) -> Self {
        Self::lit(single)
    }

    fn select(mask: Condition<'a>, yes: Self, no: Self) -> Self {
        Float(choose(mask, yes.0, no.0))
    }

    fn eq(self, other: Self) -> Condition<'a> {
        self.compare(other, Compare::Equal, |x, y| x == y)
    }

    fn lt(self, other: Self) -> Condition<'a> {
        self.compare(other, Compare::Less, |x, y| x < y)
    }

    fn le(self, other: Self) -> Condition<'a> {
        self.compare(other, Compare::LessEqual, |x, y| x <= y)
    }

    fn gt(self, other: Self) -> Condition<'a> {
        self.compare(other, Compare::Greater, |x, y| x > y)
    }

    fn ge(self, other: Self) -> Condition<'a> {
        self.compare(other, Compare::GreaterEqual, |x, y| x >= y)
    }

    fn is_nan(self) -> Condition<'a> {
        self.class(true, false)
    }

    fn floor(self) -> Self {
        self.unary(Unary::Floor, Number::floor)
    }
}

impl<'a> Real for Float<'a> {
    type Int = Integer<'a>;
    type Plain = f32;

    fn from_int(value: Integer<'a>) -> Self {
        Float(value.unary(Unary::ToFloat, |x| f32::from_int(x).to_bits() as i32).0)
    }

    fn to_int(self) -> Integer<'a> {
        let compute = |[x]: [u32; 1]| f32::from_bits(x).to_int() as u32;
        Integer(record([self.0], compute, |block, [x]| block.unary(Unary::ToInt, x)))
    }

    fn by_value<const I: usize, const N: usize, const M: usize>(
        _: [Integer<'a>; I],
        _: [Self; N],
        _: impl FnOnce([i32; I], [f32; N]) -> [f32; M],
    ) -> [Self; M] {
        [Float(Item::Missing); M]
    }

    fn is_finite(self) -> Condition<'a> {
        !self.class(true, true)
    }

    fn abs(self) -> Self {
        Float((Integer(self.0) & Integer(Item::Constant(!SIGN))).0)
    }

    fn copysign(self, sign: Self) -> Self {
        self.abs().with_sign(sign)
    }

    fn ceil(self) -> Self {
        self.unary(Unary::Ceil, Real::ceil)
    }

    fn trunc(self) -> Self {
        self.unary(Unary::Trunc, Real::trunc)
    }

    fn round(self) -> Self {
        rounding::round(self)
    }

    fn sqrt(self) -> Self {
        self.unary(Unary::Sqrt, f32::sqrt)
    }

    fn inverse_root(self) -> Self {
        self.unary(Unary::InverseRoot, Real::inverse_root)
    }

    fn length(square: Self, v: [Self; 3]) -> Self {
        let compute = |[square, x, y, z]: [u32; 4]| {
            f32::length(f32::from_bits(square), [x, y, z].map(f32::from_bits)).to_bits()
        };
        let words = [square.0, v[0].0, v[1].0, v[2].0];
        Float(record(words, compute, |block, [square, x, y, z]| block.length(square, [x, y, z])))
    }

    fn fmod_exact(self, _: Self) -> Self {
        Float(Item::Missing)
    }

    fn pow_accurate(self, _: Self) -> Self {
        Float(Item::Missing)
    }

    osl_numeric::strict_functions!();
}

impl<'a> Single for Float<'a> {
    fn to_bits(self) -> Integer<'a> {
        Integer(self.0)
    }

    fn from_bits(bits: Integer<'a>) -> Self {
        Float(bits.0)
    }

    fn plus_fused(self, a: Self, b: Self) -> Self {
        self.fused(a, b, false)
    }

    fn minus_fused(self, a: Self, b: Self) -> Self {
        self.fused(a, b, true)
    }
}
