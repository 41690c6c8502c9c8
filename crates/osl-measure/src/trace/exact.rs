//! Values in double precision, and the lane operations on them.
//!
//! The operations are those of [`osl_numeric::for_each_lane_op!`] with `f64` as the element type: the same
//! program, without rounding to single precision.

use osl_ir::ir::{Const, Kind, LaneOp};
use std::sync::Arc;

/// A value in double precision.
#[derive(Clone, Debug, PartialEq)]
pub enum Exact {
    /// An int.
    Int(i32),
    /// A float.
    Float(f64),
    /// Three floats.
    Triple([f64; 3]),
    /// Sixteen floats, row by row.
    Matrix(Box<[f64; 16]>),
    /// A string.
    Str(Arc<str>),
    /// A closure: true unless it is null.
    Closure(bool),
}

impl Exact {
    /// A constant of the program, exactly.
    pub fn widen(value: &Const) -> Exact {
        match value {
            Const::Int(n) => Exact::Int(*n),
            Const::Float(x) => Exact::Float(f64::from(*x)),
            Const::Triple(t) => Exact::Triple(t.map(f64::from)),
            Const::Matrix(m) => Exact::Matrix(Box::new(m.map(f64::from))),
            Const::Str(s) => Exact::Str(s.clone()),
            Const::Null => Exact::Closure(false),
        }
    }

    /// The nearest single-precision value.
    pub fn round(&self) -> Const {
        match self {
            Exact::Int(n) => Const::Int(*n),
            Exact::Float(x) => Const::Float(*x as f32),
            Exact::Triple(t) => Const::Triple(t.map(|x| x as f32)),
            Exact::Matrix(m) => Const::Matrix(Box::new(m.map(|x| x as f32))),
            Exact::Str(s) => Const::Str(s.clone()),
            Exact::Closure(_) => Const::Null,
        }
    }

    /// The numbers of the value; empty for a string or closure.
    pub fn numbers(&self) -> Vec<f64> {
        match self {
            Exact::Int(n) => vec![f64::from(*n)],
            Exact::Float(x) => vec![*x],
            Exact::Triple(t) => t.to_vec(),
            Exact::Matrix(m) => m.to_vec(),
            Exact::Str(_) | Exact::Closure(_) => Vec::new(),
        }
    }

    /// A value of a kind, made from these numbers; missing ones are zero.
    pub fn of_numbers(kind: Kind, numbers: &[f64]) -> Exact {
        let at = |i: usize| numbers.get(i).copied().unwrap_or(0.0);
        match kind {
            Kind::Int => Exact::Int(at(0) as i32),
            Kind::Float => Exact::Float(at(0)),
            Kind::Triple => Exact::Triple([at(0), at(1), at(2)]),
            Kind::Matrix => Exact::Matrix(Box::new(std::array::from_fn(at))),
            Kind::Str => Exact::Str("".into()),
            Kind::Closure => Exact::Closure(false),
        }
    }

    /// The value as a condition.
    pub fn truth(&self) -> bool {
        matches!(self, Exact::Int(n) if *n != 0) || matches!(self, Exact::Closure(true))
    }

    /// The kind of the value.
    pub fn kind(&self) -> Kind {
        match self {
            Exact::Int(_) => Kind::Int,
            Exact::Float(_) => Kind::Float,
            Exact::Triple(_) => Kind::Triple,
            Exact::Matrix(_) => Kind::Matrix,
            Exact::Str(_) => Kind::Str,
            Exact::Closure(_) => Kind::Closure,
        }
    }
}

/// A type that an operation takes or returns.
trait LaneType: Sized {
    fn of(value: &Exact) -> Option<Self>;
    fn put(self) -> Exact;
}

macro_rules! part {
    ($($ty:ty => $variant:ident, $x:ident, $read:expr, $write:expr;)*) => {$(
        impl LaneType for $ty {
            fn of(value: &Exact) -> Option<Self> {
                match value {
                    Exact::$variant($x) => Some($read),
                    _ => None,
                }
            }
            fn put(self) -> Exact {
                let $x = self;
                Exact::$variant($write)
            }
        }
    )*};
}

part! {
    i32 => Int, x, *x, x;
    f64 => Float, x, *x, x;
    [f64; 3] => Triple, x, *x, x;
    [f64; 16] => Matrix, x, **x, Box::new(x);
}

macro_rules! lane {
    (F) => {
        f64
    };
    (I) => {
        i32
    };
    (S) => {
        i32
    };
    (K) => {
        i32
    };
    (T) => {
        [f64; 3]
    };
    (M) => {
        [f64; 16]
    };
}

macro_rules! row {
    ($args:ident, $path:path, ($($arg:ident),*) -> $o:ident) => {{
        let mut args = $args.iter();
        let result: lane!($o) = $path($(<lane!($arg) as LaneType>::of(args.next()?)?),*);
        Some(result.put())
    }};
}

macro_rules! stamp {
    ($($name:ident $text:literal $class:ident ($($arg:ident),*) -> $ret:ident, $module:ident::$body:ident,
        $cost:ident $continuity:ident $precision:ident $domain:ident, $derivative:ident;)*) => {
        fn one(op: LaneOp, args: &[Exact]) -> Option<Exact> {
            match op {
                $(LaneOp::$name => row!(args, osl_numeric::$module::$body, ($($arg),*) -> $ret)),*
            }
        }
    };
}

osl_numeric::for_each_lane_op!(stamp);

/// The result of a lane operation; `None` if the arguments have the wrong kinds.
pub fn eval(op: LaneOp, args: &[Exact]) -> Option<Exact> {
    match (op, args) {
        (LaneOp::SEq, [a @ Exact::Str(_), b @ Exact::Str(_)]) => return Some(Exact::Int((a == b).into())),
        (LaneOp::SNe, [a @ Exact::Str(_), b @ Exact::Str(_)]) => return Some(Exact::Int((a != b).into())),
        (LaneOp::SChoose | LaneOp::KChoose, [cond, a, b]) => {
            return Some(if cond.truth() { a.clone() } else { b.clone() });
        }
        (LaneOp::KSome, [a]) => return Some(Exact::Int(a.truth().into())),
        _ => {}
    }
    if !(op.shape().per_component && args.iter().any(|a| a.kind() == Kind::Triple)) {
        return one(op, args);
    }
    let mut result = [0.0; 3];
    for (component, out) in result.iter_mut().enumerate() {
        let of = |a: &Exact| match a {
            Exact::Triple(t) => Exact::Float(t[component]),
            other => other.clone(),
        };
        let lane: Vec<Exact> = args.iter().map(of).collect();
        let Exact::Float(value) = one(op, &lane)? else { return None };
        *out = value;
    }
    Some(Exact::Triple(result))
}
