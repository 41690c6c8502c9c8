//! The lane operations as vector operations, for the single-precision arithmetics.
//!
//! Each follows the body in `osl_ir::numeric`, operation by operation in its order, so that results have the
//! same bits; a test compares every one with its body. Operations that are missing here are interpreted.

use super::fast;
use osl_ir::ir::LaneOp;
use osl_native::Compare::{
    Equal, EqualOrNan, Greater, GreaterEqual, GreaterEqualOrNan, GreaterOrNan, Less, LessEqual,
    LessEqualOrNan, LessOrNan, UnequalOrNan,
};
use osl_native::{Binary, Block, Compare, IntCompare, Truth, Unary, Value};
use std::sync::LazyLock;

/// A smaller sum of squares has lost bits, as in `numeric::geometry`.
const UNDERFLOWS_BELOW: f32 = f32::from_bits(0x0100_0000);
/// All floats from here on are whole numbers.
const WHOLE: f32 = 8_388_608.0;
const SIGN: u32 = 0x8000_0000;

/// The single-precision arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Style {
    /// Products and sums are rounded separately.
    Strict,
    /// Products and sums are fused where possible, and inverse roots are approximated: `numeric::fast`.
    Fast,
}

/// Whether an operation is supported.
pub(super) fn is_known(op: LaneOp, style: Style) -> bool {
    static STRICT: LazyLock<Vec<LaneOp>> = LazyLock::new(|| known(Style::Strict));
    static FAST: LazyLock<Vec<LaneOp>> = LazyLock::new(|| known(Style::Fast));
    let known = if style == Style::Strict { &STRICT } else { &FAST };
    known.binary_search(&op).is_ok()
}

fn known(style: Style) -> Vec<LaneOp> {
    let is_known = |op: &LaneOp| {
        let mut block = Block::new();
        let words = op.shape().args.iter().map(|kind| kind.words() as usize).sum();
        let args = vec![block.bits(0); words];
        operation(&mut block, *op, &args, style).is_some()
    };
    LaneOp::ALL.iter().copied().filter(is_known).collect()
}

/// Adds an operation to a block; the words of its arguments are given in sequence. Returns the words of its
/// result, or `None` for an unsupported operation.
pub(super) fn operation(block: &mut Block, op: LaneOp, args: &[Value], style: Style) -> Option<Words> {
    let b = &mut Bodies(block, style);
    match *args {
        [x] if op != LaneOp::Splat => {
            one(b, op, x).or_else(|| elementary(style, || fast::one(b, op, x))).map(Words::one)
        }
        [x, y] => two(b, op, x, y).or_else(|| elementary(style, || fast::two(b, op, x, y))).map(Words::one),
        _ => more(b, op, args),
    }
}

/// An elementary function, which only the fast arithmetic has as vector operations.
fn elementary(style: Style, function: impl FnOnce() -> Option<Value>) -> Option<Value> {
    if style == Style::Fast { function() } else { None }
}

/// The words of a result.
#[derive(Clone, Copy)]
pub(super) struct Words {
    list: [Value; 3],
    count: usize,
}

impl Words {
    fn one(x: Value) -> Words {
        Words { list: [x; 3], count: 1 }
    }

    fn three(list: [Value; 3]) -> Words {
        Words { list, count: 3 }
    }

    pub(super) fn list(&self) -> &[Value] {
        &self.list[..self.count]
    }
}

/// Operations of a float or int.
fn one(b: &mut Bodies<'_>, op: LaneOp, x: Value) -> Option<Value> {
    use LaneOp as L;
    Some(match op {
        L::FNeg => b.negative(x),
        L::INeg => {
            let zero = b.0.bits(0);
            b.0.binary(Binary::IntSub, zero, x)
        }
        L::ICompl => {
            let ones = b.0.bits(u32::MAX);
            b.0.binary(Binary::Xor, x, ones)
        }
        L::IAbs => b.0.unary(Unary::IntAbs, x),
        L::KSome => {
            let some = b.0.not_zero(x);
            b.0.number(some)
        }
        L::ToFloat => b.0.unary(Unary::ToFloat, x),
        L::ToInt => b.0.unary(Unary::ToInt, x),
        L::Still => x,
        L::Abs => b.abs(x),
        L::Sign => {
            let (zero, one, minus) = (b.0.float(0.0), b.0.float(1.0), b.0.float(-1.0));
            let not_negative = b.choose(Equal, x, zero, zero, one);
            b.choose(Less, x, zero, minus, not_negative)
        }
        L::Floor => b.0.unary(Unary::Floor, x),
        L::Ceil => b.0.unary(Unary::Ceil, x),
        L::Trunc => b.0.unary(Unary::Trunc, x),
        L::Round => b.round(x),
        L::IsNan => b.class(x, true, false),
        L::IsInf => b.class(x, false, true),
        L::IsFinite => {
            let not = b.0.class(x, true, true);
            let finite = b.0.not(not);
            b.0.number(finite)
        }
        L::Sqrt => {
            let (zero, root) = (b.0.float(0.0), b.root(x));
            b.choose(GreaterEqual, x, zero, root, zero)
        }
        L::InverseSqrt => {
            let (zero, inverse) = (b.0.float(0.0), b.inverse_root(x));
            b.choose(Greater, x, zero, inverse, zero)
        }
        L::Root => b.root(x),
        _ => return None,
    })
}

/// Operations of two floats or ints.
fn two(b: &mut Bodies<'_>, op: LaneOp, x: Value, y: Value) -> Option<Value> {
    use LaneOp as L;
    Some(match op {
        L::FAdd => b.add(x, y),
        L::FSub => b.sub(x, y),
        L::FMul => b.mul(x, y),
        L::FDiv => b.div(x, y),
        L::FDivBy => b.quotient(x, y),
        L::IAdd => b.0.binary(Binary::IntAdd, x, y),
        L::ISub => b.0.binary(Binary::IntSub, x, y),
        L::IMul => b.0.binary(Binary::IntMul, x, y),
        L::IAnd => b.0.binary(Binary::And, x, y),
        L::IOr => b.0.binary(Binary::Or, x, y),
        L::IXor => b.0.binary(Binary::Xor, x, y),
        L::IShl => b.shift(Binary::Shl, x, y),
        L::IShr => b.shift(Binary::Shr, x, y),
        L::IMin => b.0.binary(Binary::IntMin, x, y),
        L::IMax => b.0.binary(Binary::IntMax, x, y),
        L::FLt => b.compared(LessOrNan, x, y),
        L::FLe => b.compared(LessEqualOrNan, x, y),
        L::FGt => b.compared(GreaterOrNan, x, y),
        L::FGe => b.compared(GreaterEqualOrNan, x, y),
        L::FEq => b.compared(EqualOrNan, x, y),
        L::FNe => b.compared(UnequalOrNan, x, y),
        L::ILt => b.compared_ints(IntCompare::Less, x, y),
        L::ILe => b.compared_ints(IntCompare::LessEqual, x, y),
        L::IGt => b.compared_ints(IntCompare::Less, y, x),
        L::IGe => b.compared_ints(IntCompare::LessEqual, y, x),
        L::IEq | L::SEq => b.compared_ints(IntCompare::Equal, x, y),
        L::INe | L::SNe => b.compared_ints(IntCompare::Unequal, x, y),
        L::Min => b.min(x, y),
        L::Max => b.max(x, y),
        L::Lower => b.choose(LessOrNan, x, y, x, y),
        L::Step => b.step(x, y),
        L::Mod => {
            let quotient = b.div(x, y);
            let whole = b.0.unary(Unary::Floor, quotient);
            b.less_product(x, y, whole)
        }
        L::ModBy => {
            let quotient = b.quotient(x, y);
            let whole = b.0.unary(Unary::Floor, quotient);
            b.less_product(x, y, whole)
        }
        _ => return None,
    })
}

/// All others.
fn more(b: &mut Bodies<'_>, op: LaneOp, args: &[Value]) -> Option<Words> {
    use LaneOp as L;
    Some(match (op, args) {
        (L::FMulAdd, &[x, y, z]) => Words::one(b.plus_product(z, x, y)),
        (L::FMulSub, &[x, y, z]) => Words::one(b.minus_product(z, x, y)),
        (L::Choose | L::IChoose | L::SChoose | L::KChoose, &[c, x, y]) => {
            let truth = b.0.not_zero(c);
            Words::one(b.0.choose(truth, x, y))
        }
        (L::Clamp, &[x, low, high]) => Words::one(b.clamp(x, low, high)),
        (L::Mix, &[x, y, t]) => {
            let one = b.0.float(1.0);
            let rest = b.sub(one, t);
            let first = b.mul(x, rest);
            Words::one(b.plus_product(first, y, t))
        }
        (L::Select, &[x, y, c]) => {
            let zero = b.0.float(0.0);
            Words::one(b.choose(UnequalOrNan, c, zero, y, x))
        }
        (L::Smoothstep, &[low, high, x]) => Words::one(b.smoothstep(low, high, x)),
        (L::Linearstep, &[low, high, x]) => {
            let held = b.clamp(x, low, high);
            let (above, range) = (b.sub(held, low), b.sub(high, low));
            let (ramp, step) = (b.div(above, range), b.step(low, x));
            Words::one(b.choose(Equal, low, high, step, ramp))
        }
        (L::Triple, &[x, y, z]) => Words::three([x, y, z]),
        (L::Splat, &[x]) => Words::three([x; 3]),
        (L::X, &[x, _, _]) | (L::Y, &[_, x, _]) | (L::Z, &[_, _, x]) => Words::one(x),
        (L::Get, &[x, y, z, i]) => {
            let (zero, one) = (b.0.bits(0), b.0.bits(1));
            let (first, second) = (b.is(IntCompare::LessEqual, i, zero), b.is(IntCompare::Equal, i, one));
            let rest = b.0.choose(second, y, z);
            Words::one(b.0.choose(first, x, rest))
        }
        (L::Set, &[x, y, z, i, v]) => {
            let (zero, one) = (b.0.bits(0), b.0.bits(1));
            let first = b.is(IntCompare::LessEqual, i, zero);
            let second = b.is(IntCompare::Equal, i, one);
            let third = b.is(IntCompare::Less, one, i);
            Words::three([b.0.choose(first, v, x), b.0.choose(second, v, y), b.0.choose(third, v, z)])
        }
        (L::TEq | L::TNe, &[x, y, z, p, q, r]) => {
            let x = b.0.compare(EqualOrNan, x, p);
            let y = b.0.compare(EqualOrNan, y, q);
            let z = b.0.compare(EqualOrNan, z, r);
            let all = b.0.both(x, y);
            let all = b.0.both(all, z);
            let told = if op == L::TEq { all } else { b.0.not(all) };
            Words::one(b.0.number(told))
        }
        (L::Dot, &[x, y, z, p, q, r]) => Words::one(b.dot([x, y, z], [p, q, r])),
        (L::Cross, &[x, y, z, p, q, r]) => {
            let first = b.crossed(y, r, z, q);
            let second = b.crossed(z, p, x, r);
            Words::three([first, second, b.crossed(x, q, y, p)])
        }
        (L::Length, &[x, y, z]) => Words::one(b.length([x, y, z])),
        (L::Distance | L::SquareDistance, &[x, y, z, p, q, r]) => {
            let difference = [b.sub(x, p), b.sub(y, q), b.sub(z, r)];
            let square = b.dot(difference, difference);
            Words::one(if op == L::Distance { b.root(square) } else { square })
        }
        (L::Normalize, &[x, y, z]) => {
            let (zero, square) = (b.0.float(0.0), b.dot([x, y, z], [x, y, z]));
            let inverse = b.inverse_root(square);
            let above = b.0.compare(Greater, square, zero);
            Words::three([x, y, z].map(|x| {
                let scaled = b.mul(x, inverse);
                b.0.choose(above, scaled, zero)
            }))
        }
        (L::FaceForward, &[x, y, z, i, j, k, p, q, r]) => {
            let (zero, facing) = (b.0.float(0.0), b.dot([i, j, k], [p, q, r]));
            let turned = b.0.compare(Greater, facing, zero);
            Words::three([x, y, z].map(|x| {
                let negative = b.negative(x);
                b.0.choose(turned, negative, x)
            }))
        }
        (L::Reflect, &[i, j, k, x, y, z]) => {
            let (two, along) = (b.0.float(2.0), b.dot([x, y, z], [i, j, k]));
            let twice = b.mul(two, along);
            let mut part = |i, x| {
                let normal = b.mul(x, twice);
                b.sub(i, normal)
            };
            Words::three([part(i, x), part(j, y), part(k, z)])
        }
        (L::TransformPoint | L::TransformVector, args) => {
            let (m, p) = args.split_first_chunk::<16>()?;
            b.transform(m, *p.first_chunk::<3>()?, op == L::TransformPoint)
        }
        (L::HsvToRgb, &[h, s, v]) => Words::three(b.hsv_to_rgb(h, s, v)),
        _ => return None,
    })
}

/// The bodies, in terms of the operations of a block.
pub(super) struct Bodies<'a>(pub(super) &'a mut Block, Style);

impl Bodies<'_> {
    pub(super) fn add(&mut self, x: Value, y: Value) -> Value {
        self.0.binary(Binary::Add, x, y)
    }

    pub(super) fn sub(&mut self, x: Value, y: Value) -> Value {
        self.0.binary(Binary::Sub, x, y)
    }

    pub(super) fn mul(&mut self, x: Value, y: Value) -> Value {
        self.0.binary(Binary::Mul, x, y)
    }

    pub(super) fn quotient(&mut self, x: Value, y: Value) -> Value {
        self.0.binary(Binary::Div, x, y)
    }

    pub(super) fn root(&mut self, x: Value) -> Value {
        self.0.unary(Unary::Sqrt, x)
    }

    /// `x + y z`, rounded once in the fast arithmetic.
    pub(super) fn plus_product(&mut self, x: Value, y: Value, z: Value) -> Value {
        if self.1 == Style::Fast {
            return self.0.fused(x, [y, z], false);
        }
        let product = self.mul(y, z);
        self.add(x, product)
    }

    /// `x - y z`, rounded once in the fast arithmetic.
    pub(super) fn minus_product(&mut self, x: Value, y: Value, z: Value) -> Value {
        if self.1 == Style::Fast {
            return self.0.fused(x, [y, z], true);
        }
        self.less_product(x, y, z)
    }

    /// `x - y z`, rounded twice.
    pub(super) fn less_product(&mut self, x: Value, y: Value, z: Value) -> Value {
        let product = self.mul(y, z);
        self.sub(x, product)
    }

    /// `x y - p q`.
    pub(super) fn crossed(&mut self, x: Value, y: Value, p: Value, q: Value) -> Value {
        let (first, second) = (self.mul(x, y), self.mul(p, q));
        self.sub(first, second)
    }

    pub(super) fn inverse_root(&mut self, x: Value) -> Value {
        if self.1 == Style::Strict {
            return self.0.unary(Unary::InverseRoot, x);
        }
        let (least, most, zero) =
            (self.0.float(f32::MIN_POSITIVE), self.0.float(f32::MAX), self.0.float(0.0));
        let (half, three_halves) = (self.0.float(0.5), self.0.float(1.5));
        let held = self.choose(Greater, x, least, x, least);
        let half = self.mul(half, held);
        let (magic, one) = (self.0.bits(0x5f37_59df), self.0.bits(1));
        let shifted = self.0.binary(Binary::Shr, held, one);
        let mut y = self.0.binary(Binary::IntSub, magic, shifted);
        for _ in 0..2 {
            let part = self.mul(half, y);
            let factor = self.0.fused(three_halves, [part, y], true);
            y = self.mul(y, factor);
        }
        self.choose(LessEqual, x, most, y, zero)
    }

    pub(super) fn negative(&mut self, x: Value) -> Value {
        let sign = self.0.bits(SIGN);
        self.0.binary(Binary::Xor, x, sign)
    }

    pub(super) fn abs(&mut self, x: Value) -> Value {
        let rest = self.0.bits(!SIGN);
        self.0.binary(Binary::And, x, rest)
    }

    pub(super) fn choose(&mut self, how: Compare, x: Value, y: Value, yes: Value, no: Value) -> Value {
        let truth = self.0.compare(how, x, y);
        self.0.choose(truth, yes, no)
    }

    pub(super) fn compared(&mut self, how: Compare, x: Value, y: Value) -> Value {
        let truth = self.0.compare(how, x, y);
        self.0.number(truth)
    }

    pub(super) fn is(&mut self, how: IntCompare, x: Value, y: Value) -> Truth {
        self.0.compare_ints(how, x, y)
    }

    pub(super) fn compared_ints(&mut self, how: IntCompare, x: Value, y: Value) -> Value {
        let truth = self.is(how, x, y);
        self.0.number(truth)
    }

    pub(super) fn class(&mut self, x: Value, nan: bool, infinite: bool) -> Value {
        let truth = self.0.class(x, nan, infinite);
        self.0.number(truth)
    }

    /// Only the low five bits of the distance count.
    pub(super) fn shift(&mut self, op: Binary, x: Value, by: Value) -> Value {
        let five = self.0.bits(31);
        let by = self.0.binary(Binary::And, by, five);
        self.0.binary(op, x, by)
    }

    /// 0 if the quotient is not finite.
    pub(super) fn div(&mut self, x: Value, y: Value) -> Value {
        let (zero, quotient) = (self.0.float(0.0), self.quotient(x, y));
        let not = self.0.class(quotient, true, true);
        self.0.choose(not, zero, quotient)
    }

    pub(super) fn min(&mut self, x: Value, y: Value) -> Value {
        // The first one if either is NaN or both are equal, which for the operation is the second operand.
        self.0.binary(Binary::Min, y, x)
    }

    pub(super) fn max(&mut self, x: Value, y: Value) -> Value {
        self.choose(LessEqual, x, y, y, x)
    }

    pub(super) fn clamp(&mut self, x: Value, low: Value, high: Value) -> Value {
        let below = self.min(x, high);
        self.max(below, low)
    }

    pub(super) fn step(&mut self, edge: Value, x: Value) -> Value {
        let (zero, one) = (self.0.float(0.0), self.0.float(1.0));
        self.choose(Less, x, edge, zero, one)
    }

    pub(super) fn smoothstep(&mut self, low: Value, high: Value, x: Value) -> Value {
        let (zero, one) = (self.0.float(0.0), self.0.float(1.0));
        let (two, three) = (self.0.float(2.0), self.0.float(3.0));
        let (above, range) = (self.sub(x, low), self.sub(high, low));
        let t = self.quotient(above, range);
        let falling = self.less_product(three, two, t);
        let square = self.mul(t, t);
        let between = self.mul(falling, square);
        let above = self.choose(GreaterEqual, x, high, one, between);
        self.choose(Less, x, low, zero, above)
    }

    pub(super) fn round(&mut self, x: Value) -> Value {
        let (zero, one, half) = (self.0.float(0.0), self.0.float(1.0), self.0.float(0.5));
        let (limit, sign) = (self.0.float(WHOLE), self.0.bits(SIGN));
        let magnitude = self.abs(x);
        let whole = self.0.unary(Unary::Trunc, magnitude);
        let rest = self.sub(magnitude, whole);
        let up = self.choose(GreaterEqual, rest, half, one, zero);
        let rounded = self.add(whole, up);
        let sign = self.0.binary(Binary::And, x, sign);
        let signed = self.0.binary(Binary::Or, rounded, sign);
        self.choose(Less, magnitude, limit, signed, x)
    }

    pub(super) fn dot(&mut self, [x, y, z]: [Value; 3], [p, q, r]: [Value; 3]) -> Value {
        let first = self.mul(x, p);
        let second = self.plus_product(first, y, q);
        self.plus_product(second, z, r)
    }

    pub(super) fn length(&mut self, v: [Value; 3]) -> Value {
        let square = self.dot(v, v);
        if self.1 == Style::Strict {
            return self.0.length(square, v);
        }
        let (zero, limit) = (self.0.float(0.0), self.0.float(UNDERFLOWS_BELOW));
        let [x, y, z] = v.map(|x| self.abs(x));
        let largest = self.choose(Less, x, y, y, x);
        let largest = self.choose(Less, largest, z, z, largest);
        let scaled = [x, y, z].map(|x| self.quotient(x, largest));
        let sum = self.dot(scaled, scaled);
        let root = self.root(sum);
        let length = self.mul(largest, root);
        let rescued = self.choose(Equal, largest, zero, zero, length);
        let plain = self.root(square);
        self.choose(Less, square, limit, rescued, plain)
    }

    pub(super) fn transform(&mut self, m: &[Value; 16], [x, y, z]: [Value; 3], is_point: bool) -> Words {
        let mut linear = |column: usize| {
            let first = self.mul(x, m[column]);
            let second = self.plus_product(first, y, m[4 + column]);
            self.plus_product(second, z, m[8 + column])
        };
        let moved = [linear(0), linear(1), linear(2)];
        if !is_point {
            return Words::three(moved);
        }
        let w = linear(3);
        let w = self.add(w, m[15]);
        let zero = self.0.float(0.0);
        let some = self.0.compare(UnequalOrNan, w, zero);
        let mut part = |x, shift| {
            let x = self.add(x, shift);
            let x = self.quotient(x, w);
            self.0.choose(some, x, zero)
        };
        Words::three([part(moved[0], m[12]), part(moved[1], m[13]), part(moved[2], m[14])])
    }

    pub(super) fn hsv_to_rgb(&mut self, h: Value, s: Value, v: Value) -> [Value; 3] {
        let (one, six) = (self.0.float(1.0), self.0.float(6.0));
        let whole = self.0.unary(Unary::Floor, h);
        let turn = self.sub(h, whole);
        let h = self.mul(six, turn);
        let sixth = self.0.unary(Unary::Floor, h);
        let f = self.sub(h, sixth);
        let rest = self.sub(one, s);
        let p = self.mul(v, rest);
        let part = self.mul(s, f);
        let rest = self.sub(one, part);
        let q = self.mul(v, rest);
        let fall = self.sub(one, f);
        let part = self.mul(s, fall);
        let rest = self.sub(one, part);
        let t = self.mul(v, rest);
        let is: [Truth; 5] = [0.0, 1.0, 2.0, 3.0, 4.0].map(|k| {
            let k = self.0.float(k);
            self.0.compare(Equal, sixth, k)
        });
        let two_or_three = self.0.either(is[2], is[3]);
        let red = self.0.choose(is[4], t, v);
        let red = self.0.choose(two_or_three, p, red);
        let red = self.0.choose(is[1], q, red);
        let one_or_two = self.0.either(is[1], is[2]);
        let green = self.0.choose(is[3], q, p);
        let green = self.0.choose(one_or_two, v, green);
        let green = self.0.choose(is[0], t, green);
        let (none_or_one, three_or_four) = (self.0.either(is[0], is[1]), self.0.either(is[3], is[4]));
        let blue = self.0.choose(three_or_four, v, q);
        let blue = self.0.choose(is[2], t, blue);
        let blue = self.0.choose(none_or_one, p, blue);
        let gray = self.0.float(0.0001);
        let gray = self.0.compare(Less, s, gray);
        [red, green, blue].map(|x| self.0.choose(gray, v, x))
    }
}
