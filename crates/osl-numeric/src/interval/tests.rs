//! Laws of intervals: every result of the strict arithmetic is in them.

use super::functions::{ANGLES, OF_ATAN2, OF_SINE, OF_TANGENT, STEEPEST, TANGENT_ANGLES};
use super::*;
use crate::real::Real;
use crate::{Const, Kind, LaneOp, strict};

/// Marsaglia's xorshift.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, n: u64) -> u64 {
        (self.next() >> 11) % n
    }

    fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }

    fn float(&mut self) -> f32 {
        const SPECIAL: [f32; 14] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            2.0,
            3.0,
            -2.0,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            f32::MIN,
            f32::MIN_POSITIVE,
            1e-45,
        ];
        match self.below(12) {
            0 => SPECIAL[self.below(SPECIAL.len() as u64) as usize],
            1 => f32::from_bits(self.next() as u32),
            2 => (self.below(17) as f32) - 8.0,
            3 => (self.unit() - 0.5) * 200.0,
            4 => (self.unit() - 0.5) * 1e-3,
            5 => (self.unit() - 0.5) * 1e7,
            6..8 => self.unit(),
            _ => (self.unit() - 0.5) * 4.0,
        }
    }

    /// An interval and a number in it.
    fn number(&mut self) -> (Interval, f32) {
        let a = self.float();
        if self.below(40) == 0 {
            return (Interval::ANY, a);
        }
        let b = match self.below(4) {
            0 => a,
            1 => a * (1.0 + self.unit() * 1e-3),
            2 => a + self.unit() - 0.5,
            _ => self.float(),
        };
        if a.is_nan() || b.is_nan() {
            return (Interval::point(a).hull(Interval::point(b)), if self.below(2) == 0 { a } else { b });
        }
        let interval = Interval::new(least(a, b), most(a, b));
        let t = self.unit();
        let between = (f64::from(a) * f64::from(1.0 - t) + f64::from(b) * f64::from(t)) as f32;
        let x = match self.below(4) {
            0 => a,
            1 => b,
            _ if interval.contains(between) => between,
            _ => a,
        };
        (interval, x)
    }

    fn int(&mut self) -> (Whole, i32) {
        let one = |dice: &mut Dice| match dice.below(4) {
            0 => dice.next() as i32,
            1 => dice.below(5) as i32 - 1,
            2 => [i32::MIN, i32::MAX, 0, -1][dice.below(4) as usize],
            _ => dice.below(2001) as i32 - 1000,
        };
        let a = one(self);
        let b = if self.below(3) == 0 { a } else { one(self) };
        let whole = Whole { lo: a.min(b), hi: a.max(b) };
        let span = i64::from(whole.hi) - i64::from(whole.lo) + 1;
        (whole, (i64::from(whole.lo) + self.below(span as u64) as i64) as i32)
    }

    fn value(&mut self, kind: Kind) -> Option<(Enclosure, Const)> {
        Some(match kind {
            Kind::Int => {
                let (whole, n) = self.int();
                (Enclosure::Int(whole), Const::Int(n))
            }
            Kind::Float => {
                let (interval, x) = self.number();
                (Enclosure::Float(interval), Const::Float(x))
            }
            Kind::Triple => {
                let parts = [0; 3].map(|_| self.number());
                (Enclosure::Triple(parts.map(|p| p.0)), Const::Triple(parts.map(|p| p.1)))
            }
            Kind::Matrix => {
                let parts = [0; 16].map(|_| self.number());
                (Enclosure::Matrix(Box::new(parts.map(|p| p.0))), Const::Matrix(Box::new(parts.map(|p| p.1))))
            }
            Kind::Str | Kind::Closure => return None,
        })
    }
}

/// Tries each operation that many times with random intervals.
fn every_result_is_inside(times: usize, seed: u64) {
    let mut dice = Dice(seed);
    for op in LaneOp::ALL {
        let shape = op.shape();
        for _ in 0..times {
            let is_triple = shape.per_component && dice.below(8) == 0;
            let kind = |kind: Kind| if is_triple && kind == Kind::Float { Kind::Triple } else { kind };
            let args: Option<Vec<_>> = shape.args.iter().map(|k| dice.value(kind(*k))).collect();
            let Some(mut args) = args else { break };
            if matches!(op, LaneOp::FDivBy | LaneOp::ModBy | LaneOp::FmodExact) {
                // The divisor is a constant other than 0.
                let divisor = [1.0, 2.0, -0.5, 3.0, 0.1, 1e-3, 7e5][dice.below(7) as usize];
                args[1] = (Enclosure::Float(Interval::point(divisor)), Const::Float(divisor));
            }
            if *op == LaneOp::LibraryConstant {
                let n = dice.below(30) as i32;
                args[0] = (Enclosure::Int(Whole::point(n)), Const::Int(n));
            }
            let (wide, values): (Vec<Enclosure>, Vec<Const>) = args.into_iter().unzip();
            let Some(value) = op.eval(&values) else { continue };
            let Some(found) = eval(*op, &wide) else { panic!("{} has no bounds", op.text()) };
            assert!(found.contains(&value), "{}{values:?} = {value:?}, in {wide:?} {found:?}", op.text());
            // Single values give single values, as far as NaN allows.
            let points: Vec<Enclosure> = values.iter().map(Enclosure::point).collect();
            let is_plain = |list: &[Enclosure]| list.iter().all(|e| e.value().is_some());
            if is_plain(&points) {
                let one = eval(*op, &points).unwrap();
                assert!(one.contains(&value), "{}{values:?} = {value:?}, not {one:?}", op.text());
                if is_plain(std::slice::from_ref(&Enclosure::point(&value))) {
                    let is_same = one.value().is_some_and(|one| one.same_bits(&value));
                    assert!(is_same, "{}{values:?} = {value:?}, not only {one:?}", op.text());
                }
            }
        }
    }
}

#[test]
fn every_result_is_in_its_bounds() {
    every_result_is_inside(3_000, 0x9E37_79B9_7F4A_7C15);
}

/// `cargo test --release -p osl-numeric -- --ignored ten_million`
#[test]
#[ignore = "takes a minute"]
fn ten_million_results_are_in_their_bounds() {
    every_result_is_inside(10_000_000 / LaneOp::ALL.len(), 0x1234_5678_9ABC_DEF1);
}

/// Compares the strict functions at every `step`th float with their bounds.
fn errors_are_bounded(step: usize) {
    let floats = || (0..=u32::MAX).step_by(step).map(f32::from_bits).filter(|x| !x.is_nan());
    for error in ERRORS {
        let mut worst = 0.0_f64;
        let ends = [error.from, error.to].map(|x| (error.exact)(f64::from(x)));
        let room = |y: f64| error.absolute + error.relative * y.abs();
        for x in floats() {
            if error.name == "cosh" && x < 0.0 {
                continue;
            }
            let value = (error.strict)(x);
            if value.is_nan() && x.is_infinite() && error.name == "cbrt" {
                continue;
            }
            assert!((error.lo..=error.hi).contains(&value), "{}({x:e}) = {value:e}", error.name);
            if (error.from..=error.to).contains(&x) {
                let exact = (error.exact)(f64::from(x));
                worst = worst.max((f64::from(value) - exact).abs() / room(exact));
            } else {
                // Beyond the ends, the function does not come back.
                let end = ends[usize::from(x > error.to)];
                let rises = (x > error.to) != error.falls;
                let excess = if rises { end - f64::from(value) } else { f64::from(value) - end };
                assert!(excess <= room(end), "{}({x:e}) = {value:e} beyond its end", error.name);
            }
            for knot in error.knots {
                let at = (error.strict)(*knot);
                let is_above = (x > *knot) != error.falls;
                let is_right = x == *knot || if is_above { value >= at } else { value <= at };
                assert!(is_right, "{}({x:e}) = {value:e} across {knot}", error.name);
            }
        }
        println!("{}: {worst:.3} of the bound", error.name);
        assert!(worst <= 1.0, "{}: {worst}", error.name);
    }
    let mut worst = [0.0_f64; 3];
    for x in floats().filter(|x| x.abs() <= ANGLES) {
        let exact = f64::from(x);
        let off = |value: f32, exact: f64| (f64::from(value) - exact).abs() / OF_SINE;
        worst[0] = worst[0].max(off(strict::sin(x), <f64 as Real>::sin(exact)));
        worst[1] = worst[1].max(off(strict::cos(x), <f64 as Real>::cos(exact)));
        let tan = <f64 as Real>::tan(exact);
        if x.abs() <= TANGENT_ANGLES && tan.abs() <= STEEPEST {
            let room = OF_TANGENT * (1.0 + tan * tan);
            worst[2] = worst[2].max((f64::from(strict::tan(x)) - tan).abs() / room);
        }
    }
    println!("sin, cos, tan: {worst:.3?} of the bound");
    assert!(worst.iter().all(|w| *w <= 1.0), "{worst:?}");
    let mut state = Dice(77);
    for _ in 0..(u32::MAX as usize / step).min(100_000_000) {
        let (y, x) = (state.float(), state.float());
        let value = strict::atan2(y, x);
        if x.is_nan() || y.is_nan() || (x == 0.0 && y == 0.0) {
            continue;
        }
        let exact = <f64 as Real>::atan2(f64::from(y), f64::from(x));
        assert!((f64::from(value) - exact).abs() <= OF_ATAN2, "atan2({y:e}, {x:e}) = {value}");
        assert!(value.abs() <= std::f32::consts::PI);
    }
}

#[test]
fn the_errors_of_functions_are_bounded() {
    errors_are_bounded(10_007);
}

/// `cargo test --release -p osl-numeric -- --ignored many_floats --nocapture`
#[test]
#[ignore = "takes some minutes"]
fn the_errors_of_functions_are_bounded_for_many_floats() {
    errors_are_bounded(17);
}

#[test]
fn the_cubic_of_smoothstep_stays_below_one() {
    for bits in (0..=1.0_f32.to_bits()).step_by(if cfg!(debug_assertions) { 101 } else { 1 }) {
        let t = f32::from_bits(bits);
        let cubic = (3.0 - 2.0 * t) * (t * t);
        assert!((0.0..=1.0).contains(&cubic), "{t:e}");
    }
}

#[test]
fn guards_are_understood() {
    let float = |lo: f32, hi: f32| Enclosure::Float(Interval::new(lo, hi));
    let of = |op: LaneOp, args: &[Enclosure]| eval(op, args).unwrap();
    // A divisor of 0 gives 0, and only the other divisors count.
    assert_eq!(of(LaneOp::FDiv, &[float(1.0, 2.0), float(0.5, 1.0)]), float(1.0, 4.0));
    let Enclosure::Float(quotient) = of(LaneOp::FDiv, &[float(1.0, 2.0), float(0.0, 1.0)]) else { panic!() };
    assert!(quotient.is_within(0.0, f32::MAX));
    assert_eq!(of(LaneOp::Min, &[float(0.0, 1.0), float(0.5, 0.5)]), float(0.0, 0.5));
    assert_eq!(of(LaneOp::Clamp, &[float(-5.0, 5.0), float(0.5, 0.5), float(1.0, 1.0)]), float(0.5, 1.0));
    assert_eq!(
        of(LaneOp::Sqrt, &[float(-1.0, 4.0)]),
        float(0.0, 2.0).hull(&Enclosure::Float(Interval::ZERO))
    );
    let within = |e: Enclosure, lo: f32, hi: f32| matches!(e, Enclosure::Float(x) if x.is_within(lo, hi));
    assert!(within(of(LaneOp::Smoothstep, &[float(0.2, 0.2), float(0.8, 0.8), float(-9.0, 9.0)]), 0.0, 1.0));
    assert!(within(of(LaneOp::ModBy, &[float(-9.0, 9.0), float(1.0, 1.0)]), 0.0, 1.0));
    assert!(within(of(LaneOp::Sin, &[float(0.1, 0.2)]), 0.0998, 0.1988));
    assert!(within(of(LaneOp::Pow, &[float(0.0, 1.0), float(3.0, 3.0)]), 0.0, 1.0));
}
