//! Evaluates lane operations on constants with the bodies of the list.

use super::LaneOp;
use crate::Scalar;
use crate::{Const, Kind};

macro_rules! lane {
    (F $real:ident) => {
        $real
    };
    (I $real:ident) => {
        i32
    };
    (T $real:ident) => {
        [$real; 3]
    };
    (M $real:ident) => {
        [$real; 16]
    };
}

macro_rules! eval_row {
    ($real:ident, $args:ident, $path:path, ($($arg:ident),*) -> S) => {{ None }};
    // Strings compare by value in `LaneOp::eval`, never by number.
    ($real:ident, $args:ident, $path:path, (S, S) -> $ret:ident) => {{ None }};
    // The only constant closure is null.
    ($real:ident, $args:ident, $path:path, ($($arg:ident),*) -> K) => {{ None }};
    ($real:ident, $args:ident, $path:path, (K) -> $ret:ident) => {{ None }};
    ($real:ident, $args:ident, $path:path, ($($arg:ident),*) -> $ret:ident) => {{
        let mut args = $args.iter();
        let result: lane!($ret $real) = $path($(<lane!($arg $real)>::from_const(args.next()?)?),*);
        result.into_const()
    }};
}

macro_rules! stamp {
    ($($name:ident $text:literal $class:ident ($($arg:ident),*) -> $ret:ident, $module:ident::$body:ident,
        $cost:ident $continuity:ident $precision:ident $domain:ident, $derivative:ident;)*) => {
        impl LaneOp {
            /// One lane of the operation on arguments of exactly the line's kinds.
            fn eval_lane<R: Scalar>(self, args: &[Const]) -> Option<Const> {
                match self {
                    $(LaneOp::$name => eval_row!(R, args, crate::$module::$body, ($($arg),*) -> $ret)),*
                }
            }
        }
    };
}

trait FromConst: Sized {
    fn from_const(value: &Const) -> Option<Self>;
}

trait IntoConst {
    /// The constant, if single precision can represent it.
    fn into_const(self) -> Option<Const>;
}

impl FromConst for i32 {
    fn from_const(value: &Const) -> Option<Self> {
        if let Const::Int(n) = value { Some(*n) } else { None }
    }
}

impl IntoConst for i32 {
    fn into_const(self) -> Option<Const> {
        Some(Const::Int(self))
    }
}

/// The float in single precision, if it can be represented exactly.
fn single<R: Scalar>(x: R) -> Option<f32> {
    let single = x.to_f32();
    (single.is_nan() || f64::from(single) == x.to_f64()).then_some(single)
}

fn singles<R: Scalar, const C: usize>(list: [R; C]) -> Option<[f32; C]> {
    let mut all = [0.0; C];
    for (to, from) in all.iter_mut().zip(list) {
        *to = single(from)?;
    }
    Some(all)
}

impl<R: Scalar> FromConst for R {
    fn from_const(value: &Const) -> Option<Self> {
        if let Const::Float(x) = value { Some(R::lit(*x)) } else { None }
    }
}

impl<R: Scalar> IntoConst for R {
    fn into_const(self) -> Option<Const> {
        single(self).map(Const::Float)
    }
}

impl<R: Scalar> FromConst for [R; 3] {
    fn from_const(value: &Const) -> Option<Self> {
        if let Const::Triple(t) = value { Some(t.map(R::lit)) } else { None }
    }
}

impl<R: Scalar> IntoConst for [R; 3] {
    fn into_const(self) -> Option<Const> {
        singles(self).map(Const::Triple)
    }
}

impl<R: Scalar> FromConst for [R; 16] {
    fn from_const(value: &Const) -> Option<Self> {
        if let Const::Matrix(m) = value { Some(m.map(R::lit)) } else { None }
    }
}

impl<R: Scalar> IntoConst for [R; 16] {
    fn into_const(self) -> Option<Const> {
        singles(self).map(|m| Const::Matrix(Box::new(m)))
    }
}

crate::for_each_lane_op!(stamp);

impl LaneOp {
    /// The result for constant arguments in the strict arithmetic. `None` if the arguments have the wrong
    /// kinds.
    pub fn eval(self, args: &[Const]) -> Option<Const> {
        self.eval_in::<f32>(args)
    }

    /// The result for constant arguments in double precision, if single precision can represent it: a more
    /// precise arithmetic must not use a rounded constant.
    pub fn eval_exactly(self, args: &[Const]) -> Option<Const> {
        self.eval_in::<f64>(args)
    }

    fn eval_in<R: Scalar>(self, args: &[Const]) -> Option<Const> {
        match (self, args) {
            (LaneOp::SEq, [Const::Str(a), Const::Str(b)]) => return Some(Const::Int((a == b).into())),
            (LaneOp::SNe, [Const::Str(a), Const::Str(b)]) => return Some(Const::Int((a != b).into())),
            (LaneOp::SChoose, [Const::Int(c), a @ Const::Str(_), b @ Const::Str(_)]) => {
                return Some(if *c != 0 { a.clone() } else { b.clone() });
            }
            (LaneOp::KSome, [Const::Null]) => return Some(Const::Int(0)),
            _ => {}
        }
        let per_component = self.shape().per_component && args.iter().any(|a| a.kind() == Kind::Triple);
        if !per_component {
            return self.eval_lane::<R>(args);
        }
        let mut result = [0.0; 3];
        for (component, out) in result.iter_mut().enumerate() {
            let lane: Vec<Const> = args
                .iter()
                .map(|a| match a {
                    Const::Triple(t) => Const::Float(t[component]),
                    other => other.clone(),
                })
                .collect();
            let Const::Float(value) = self.eval_lane::<R>(&lane)? else { return None };
            *out = value;
        }
        Some(Const::Triple(result))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Precision;
    use crate::fast::FastFloat;

    /// Small numbers of every kind, and a few where functions break.
    fn value(kind: Kind, state: &mut u32) -> Option<Const> {
        let mut next = || {
            *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *state >> 8
        };
        let mut float = || match next() % 16 {
            0 => [0.0, -0.0, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE][next() as usize % 5],
            1 => f32::from_bits(next() << 8),
            _ => next() as f32 / (1 << 22) as f32 - 2.0,
        };
        Some(match kind {
            Kind::Float => Const::Float(float()),
            Kind::Triple => Const::Triple([float(), float(), float()]),
            Kind::Matrix => Const::Matrix(Box::new(std::array::from_fn(|_| float()))),
            Kind::Int => Const::Int(next() as i32 % 40 - 9),
            _ => return None,
        })
    }

    fn same(a: &Option<Const>, b: &Option<Const>) -> bool {
        // The sign and payload of a NaN are not specified.
        let bits = |x: &f32| if x.is_nan() { u32::MAX } else { x.to_bits() };
        let all = |a: &[f32], b: &[f32]| a.iter().map(bits).eq(b.iter().map(bits));
        match (a, b) {
            (Some(Const::Float(a)), Some(Const::Float(b))) => bits(a) == bits(b),
            (Some(Const::Triple(a)), Some(Const::Triple(b))) => all(a, b),
            (Some(Const::Matrix(a)), Some(Const::Matrix(b))) => all(&a[..], &b[..]),
            (a, b) => a == b,
        }
    }

    /// The interpreter runs the loops of the strict arithmetic for what is `strict` in a fast run.
    #[test]
    fn what_is_strict_has_the_same_bits_in_the_fast_arithmetic() {
        let mut wrong = Vec::new();
        for op in LaneOp::ALL {
            let mut state = 7;
            let (mut differs, mut compared) = (false, 0);
            for _ in 0..4000 {
                let args: Option<Vec<Const>> =
                    op.shape().args.iter().map(|kind| value(*kind, &mut state)).collect();
                let Some(args) = args else { break };
                let strict = op.eval_in::<f32>(&args);
                differs |= !same(&strict, &op.eval_in::<FastFloat<false>>(&args));
                differs |= !same(&strict, &op.eval_in::<FastFloat<true>>(&args));
                compared += 1;
            }
            if compared > 0 && differs == (op.precision() == Precision::Strict) {
                wrong.push(*op);
            }
        }
        assert_eq!(wrong, []);
    }
}
