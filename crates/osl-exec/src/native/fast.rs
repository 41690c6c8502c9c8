//! The elementary functions of the fast arithmetic as vector operations: the bodies of `numeric::fast`, with
//! its coefficients.

use super::operation::Bodies;
use osl_ir::ir::LaneOp;
use osl_ir::numeric::fast::coefficients as c;
use osl_native::Compare::{Equal, Greater, GreaterEqual, Less, UnequalOrNan};
use osl_native::{Binary, IntCompare, Unary, Value};
use std::f32::consts::{LN_2, LOG2_E, LOG10_2, PI};

const SIGN: u32 = 0x8000_0000;

/// Functions of one float.
pub(super) fn one(b: &mut Bodies<'_>, op: LaneOp, x: Value) -> Option<Value> {
    use LaneOp as L;
    Some(match op {
        L::Sin => {
            let (inverse, whole) = (b.float(c::INV_PI), b.float(c::WHOLE));
            let shifted = b.plus_product(whole, x, inverse);
            let periods = b.sub(shifted, whole);
            let r = b.reduced(x, periods, c::MINUS_PI);
            b.sine(r, shifted)
        }
        L::Cos => {
            let (inverse, half, whole) = (b.float(c::INV_PI), b.float(0.5), b.float(c::WHOLE));
            let turns = b.plus_product(half, x, inverse);
            let shifted = b.add(turns, whole);
            let periods = b.sub(shifted, whole);
            let periods = b.sub(periods, half);
            let r = b.reduced(x, periods, c::MINUS_PI);
            let (r, ones) = (b.negative(r), b.0.bits(u32::MAX));
            let bits = b.0.binary(Binary::Xor, shifted, ones);
            b.sine(r, bits)
        }
        L::Tan => {
            let (inverse, whole) = (b.float(2.0 * c::INV_PI), b.float(c::WHOLE));
            let shifted = b.plus_product(whole, x, inverse);
            let periods = b.sub(shifted, whole);
            let r = b.reduced(x, periods, c::MINUS_PI_2);
            let p = b.odd(r, &c::TAN);
            let minus = b.float(-1.0);
            let inverse = b.quotient(minus, p);
            let turned = b.lowest(shifted);
            b.0.choose(turned, inverse, p)
        }
        L::Asin => {
            let (half, a) = (b.float(c::PI_2), b.half_acos(x));
            let r = b.sub(half, a);
            b.with_sign(r, x)
        }
        L::Acos => {
            let (pi, zero, a) = (b.float(PI), b.float(0.0), b.half_acos(x));
            let other = b.sub(pi, a);
            b.choose(Less, x, zero, other, a)
        }
        L::Atan => {
            let (one, half) = (b.float(1.0), b.float(c::PI_2));
            let magnitude = b.abs(x);
            let steep = b.0.compare(Greater, magnitude, one);
            let inverse = b.quotient(one, magnitude);
            let k = b.0.choose(steep, inverse, magnitude);
            let r = b.arc(k);
            let other = b.sub(half, r);
            let r = b.0.choose(steep, other, r);
            b.with_sign(r, x)
        }
        L::Sinh => {
            let (half, one) = (b.float(0.5), b.float(1.0));
            let a = b.abs(x);
            let e = b.exponential(a, LOG2_E);
            let inverse = b.reciprocal(e);
            let far = b.crossed(half, e, half, inverse);
            let near = b.odd(a, &c::SINH);
            let r = b.choose(Greater, a, one, far, near);
            b.with_sign(r, x)
        }
        L::Cosh => {
            let half = b.float(0.5);
            let a = b.abs(x);
            let e = b.exponential(a, LOG2_E);
            let inverse = b.reciprocal(e);
            let rest = b.mul(half, inverse);
            b.plus_product(rest, half, e)
        }
        L::Tanh => {
            let (one, two) = (b.float(1.0), b.float(2.0));
            let a = b.abs(x);
            let e = b.exponential(a, 2.0 * LOG2_E);
            let sum = b.add(one, e);
            let inverse = b.reciprocal(sum);
            let r = b.minus_product(one, two, inverse);
            b.with_sign(r, x)
        }
        L::Exp => b.exponential(x, LOG2_E),
        L::Exp2 => b.power_of_two(x),
        L::Expm1 => {
            let (half, small, one) = (b.float(0.5), b.float(0.01), b.float(1.0));
            let halved = b.mul(half, x);
            let series = b.plus_product(x, halved, x);
            let e = b.exponential(x, LOG2_E);
            let (magnitude, far) = (b.abs(x), b.sub(e, one));
            b.choose(Less, magnitude, small, series, far)
        }
        L::Log => b.scaled_logarithm(x, LN_2),
        L::Log2 => b.logarithm(x),
        L::Log10 => b.scaled_logarithm(x, LOG10_2),
        L::Cbrt => b.cube_root(x),
        L::Erf => b.error_function(x),
        L::Erfc => {
            let (one, erf) = (b.float(1.0), b.error_function(x));
            b.sub(one, erf)
        }
        _ => return None,
    })
}

/// Functions of two floats.
pub(super) fn two(b: &mut Bodies<'_>, op: LaneOp, x: Value, y: Value) -> Option<Value> {
    match op {
        LaneOp::Pow => Some(b.power(x, y)),
        LaneOp::Atan2 => Some(b.angle(x, y)),
        _ => None,
    }
}

impl Bodies<'_> {
    fn float(&mut self, x: f32) -> Value {
        self.0.float(x)
    }

    fn with_sign(&mut self, x: Value, sign: Value) -> Value {
        let magnitude = self.abs(x);
        let bit = self.0.bits(SIGN);
        let sign = self.0.binary(Binary::And, sign, bit);
        self.0.binary(Binary::Or, magnitude, sign)
    }

    /// Whether the lowest bit is set.
    fn lowest(&mut self, bits: Value) -> osl_native::Truth {
        let one = self.0.bits(1);
        let lowest = self.0.binary(Binary::And, bits, one);
        self.0.not_zero(lowest)
    }

    fn shifted_left(&mut self, bits: Value, by: u32) -> Value {
        let by = self.0.bits(by);
        self.0.binary(Binary::Shl, bits, by)
    }

    /// The polynomial with these coefficients, highest power first.
    fn horner(&mut self, x: Value, coefficients: &[f32]) -> Value {
        let mut sum = self.float(coefficients.first().copied().unwrap_or(0.0));
        for coefficient in coefficients.iter().skip(1) {
            let next = self.float(*coefficient);
            sum = self.plus_product(next, sum, x);
        }
        sum
    }

    /// `x` plus a polynomial of its square, times that square and `x`.
    fn odd(&mut self, x: Value, coefficients: &[f32]) -> Value {
        let square = self.mul(x, x);
        let p = self.horner(square, coefficients);
        let p = self.mul(p, square);
        self.plus_product(x, p, x)
    }

    fn reduced(&mut self, x: Value, periods: Value, [high, low]: [f32; 2]) -> Value {
        let (high, low) = (self.float(high), self.float(low));
        let near = self.plus_product(x, periods, high);
        self.plus_product(near, periods, low)
    }

    fn sine(&mut self, r: Value, bits: Value) -> Value {
        let p = self.odd(r, &c::SIN);
        let sign = self.shifted_left(bits, 31);
        let p = self.0.binary(Binary::Xor, p, sign);
        let (minus, one) = (self.float(-1.0), self.float(1.0));
        let p = self.choose(GreaterEqual, p, minus, p, minus);
        self.choose(Greater, p, one, one, p)
    }

    fn half_acos(&mut self, x: Value) -> Value {
        let (one, magnitude) = (self.float(1.0), self.abs(x));
        let m = self.choose(Less, magnitude, one, magnitude, one);
        let rest = self.sub(one, m);
        let (root, p) = (self.root(rest), self.horner(m, &c::ACOS));
        self.mul(root, p)
    }

    fn arc(&mut self, k: Value) -> Value {
        let square = self.mul(k, k);
        let p = self.horner(square, &c::ATAN);
        self.mul(p, k)
    }

    /// 2 to the power of `x` times `factor`.
    fn exponential(&mut self, x: Value, factor: f32) -> Value {
        let factor = self.float(factor);
        let x = self.mul(x, factor);
        self.power_of_two(x)
    }

    fn power_of_two(&mut self, x: Value) -> Value {
        let (low, high, whole) = (self.float(-126.0), self.float(126.0), self.float(c::WHOLE));
        let x = self.choose(GreaterEqual, x, low, x, low);
        let x = self.choose(Greater, x, high, high, x);
        let shifted = self.add(x, whole);
        let nearest = self.sub(shifted, whole);
        let f = self.sub(x, nearest);
        let r = self.horner(f, &c::EXP2);
        let exponent = self.shifted_left(shifted, 23);
        self.0.binary(Binary::IntAdd, r, exponent)
    }

    fn logarithm(&mut self, x: Value) -> Value {
        let (least, most, one) = (self.float(f32::MIN_POSITIVE), self.float(f32::MAX), self.float(1.0));
        let x = self.choose(GreaterEqual, x, least, x, least);
        let word = self.choose(Greater, x, most, most, x);
        let (start, distance) = (self.0.bits(0x3f40_0000), self.0.bits(23));
        let above = self.0.binary(Binary::IntSub, word, start);
        let exponent = self.0.binary(Binary::Shr, above, distance);
        let scale = self.shifted_left(exponent, 23);
        let mantissa = self.0.binary(Binary::IntSub, word, scale);
        let f = self.sub(mantissa, one);
        let (p, exponent) = (self.horner(f, &c::LOG2), self.0.unary(Unary::ToFloat, exponent));
        self.plus_product(exponent, p, f)
    }

    fn scaled_logarithm(&mut self, x: Value, scale: f32) -> Value {
        let (logarithm, scale) = (self.logarithm(x), self.float(scale));
        self.mul(logarithm, scale)
    }

    fn reciprocal(&mut self, x: Value) -> Value {
        let (magic, two) = (self.0.bits(0x7ef3_11c7), self.float(2.0));
        let mut y = self.0.binary(Binary::IntSub, magic, x);
        for _ in 0..3 {
            let factor = self.minus_product(two, x, y);
            y = self.mul(y, factor);
        }
        y
    }

    fn cube_root(&mut self, x: Value) -> Value {
        let (zero, third, whole) = (self.float(0.0), self.float(1.0 / 3.0), self.float(c::WHOLE));
        let sign = x;
        let x = self.abs(x);
        let eight = self.0.bits(8);
        let bits = self.0.binary(Binary::Shr, x, eight);
        let bits = self.0.unary(Unary::ToFloat, bits);
        let thirds = self.mul(bits, third);
        let thirds = self.add(thirds, whole);
        let thirds = self.0.binary(Binary::IntSub, thirds, whole);
        let thirds = self.shifted_left(thirds, 8);
        let magic = self.0.bits(0x54a2_1d2a);
        let mut y = self.0.binary(Binary::IntSub, magic, thirds);
        let (x_third, limit) = (self.mul(x, third), self.float(4.0 / 3.0));
        for _ in 0..3 {
            let (part, square) = (self.mul(x_third, y), self.mul(y, y));
            let factor = self.minus_product(limit, part, square);
            y = self.mul(y, factor);
        }
        let root = self.mul(x, y);
        let root = self.mul(root, y);
        let root = self.choose(Equal, x, zero, zero, root);
        self.with_sign(root, sign)
    }

    fn error_function(&mut self, x: Value) -> Value {
        let (one, four, sign) = (self.float(1.0), self.float(4.0), x);
        let x = self.abs(x);
        let x = self.choose(Greater, x, four, four, x);
        let r = self.horner(x, &c::ERF);
        let r2 = self.mul(r, r);
        let r4 = self.mul(r2, r2);
        let r8 = self.mul(r4, r4);
        let r16 = self.mul(r8, r8);
        let inverse = self.reciprocal(r16);
        let r = self.sub(one, inverse);
        self.with_sign(r, sign)
    }

    fn power(&mut self, x: Value, y: Value) -> Value {
        let (zero, one, two) = (self.float(0.0), self.float(1.0), self.float(2.0));
        let (most, whole, small) = (self.float(f32::MAX), self.float(c::WHOLE), self.float(4_194_304.0));
        let base = self.abs(x);
        let logarithm = self.logarithm(base);
        let exponent = self.mul(y, logarithm);
        let magnitude = self.power_of_two(exponent);
        let shifted = self.add(y, whole);
        let nearest = self.sub(shifted, whole);
        let size = self.abs(y);
        let is_small = self.0.compare(Less, size, small);
        let differs = self.0.compare(UnequalOrNan, nearest, y);
        let fractional = self.0.both(is_small, differs);
        let odd = self.lowest(shifted);
        let odd = self.0.both(is_small, odd);
        let negative = self.negative(magnitude);
        let of_negative = self.0.choose(odd, negative, magnitude);
        let of_negative = self.0.choose(fractional, zero, of_negative);
        let square = self.mul(x, x);
        let square = self.choose(Greater, square, most, most, square);
        let r = self.choose(Less, x, zero, of_negative, magnitude);
        let r = self.choose(Equal, y, two, square, r);
        let r = self.choose(Equal, y, one, x, r);
        let r = self.choose(Equal, x, zero, zero, r);
        self.choose(Equal, y, zero, one, r)
    }

    /// The angle of the point (x, y).
    fn angle(&mut self, y: Value, x: Value) -> Value {
        let (zero, one) = (self.float(0.0), self.float(1.0));
        let (half, pi) = (self.float(c::PI_2), self.float(PI));
        let (a, b) = (self.abs(x), self.abs(y));
        let steep = self.0.compare(Greater, b, a);
        let (small, large) = (self.0.choose(steep, a, b), self.0.choose(steep, b, a));
        let ratio = self.quotient(small, large);
        let k = self.choose(Equal, a, b, one, ratio);
        let k = self.choose(Equal, b, zero, zero, k);
        let r = self.arc(k);
        let other = self.sub(half, r);
        let r = self.0.choose(steep, other, r);
        let other = self.sub(pi, r);
        let none = self.0.bits(0);
        let behind = self.is(IntCompare::Less, x, none);
        let r = self.0.choose(behind, other, r);
        self.with_sign(r, y)
    }
}
