//! Lane operations on intervals: the bodies of the list, met with the tighter forms of `rules`.

use super::{Interval, Truth, Whole, rules};
use crate::{Const, Int, Kind, LaneOp};
use std::sync::Arc;

/// The values that a value of a program may have.
#[derive(Clone, Debug, PartialEq)]
pub enum Enclosure {
    /// Of an int.
    Int(Whole),
    /// Of a float.
    Float(Interval),
    /// Of each component.
    Triple([Interval; 3]),
    /// Of each element, row by row.
    Matrix(Box<[Interval; 16]>),
    /// The string, if it is known.
    Str(Option<Arc<str>>),
    /// Whether a closure is something.
    Closure(Truth),
}

impl Enclosure {
    /// A constant.
    pub fn point(value: &Const) -> Enclosure {
        match value {
            Const::Int(n) => Enclosure::Int(Whole::point(*n)),
            Const::Float(x) => Enclosure::Float(Interval::point(*x)),
            Const::Triple(t) => Enclosure::Triple(t.map(Interval::point)),
            Const::Matrix(m) => Enclosure::Matrix(Box::new(m.map(Interval::point))),
            Const::Str(s) => Enclosure::Str(Some(s.clone())),
            Const::Null => Enclosure::Closure(Truth::known(false)),
        }
    }

    /// Every value of a kind.
    pub fn any(kind: Kind) -> Enclosure {
        match kind {
            Kind::Int => Enclosure::Int(Whole::ANY),
            Kind::Float => Enclosure::Float(Interval::ANY),
            Kind::Triple => Enclosure::Triple([Interval::ANY; 3]),
            Kind::Matrix => Enclosure::Matrix(Box::new([Interval::ANY; 16])),
            Kind::Str => Enclosure::Str(None),
            Kind::Closure => Enclosure::Closure(Truth::UNKNOWN),
        }
    }

    /// Its kind.
    pub fn kind(&self) -> Kind {
        match self {
            Enclosure::Int(_) => Kind::Int,
            Enclosure::Float(_) => Kind::Float,
            Enclosure::Triple(_) => Kind::Triple,
            Enclosure::Matrix(_) => Kind::Matrix,
            Enclosure::Str(_) => Kind::Str,
            Enclosure::Closure(_) => Kind::Closure,
        }
    }

    /// Its only value, if it has one. Closures have no values.
    pub fn value(&self) -> Option<Const> {
        Some(match self {
            Enclosure::Int(n) => Const::Int(n.value()?),
            Enclosure::Float(x) => Const::Float(x.value()?),
            Enclosure::Triple([x, y, z]) => Const::Triple([x.value()?, y.value()?, z.value()?]),
            Enclosure::Matrix(m) => {
                let mut known = Box::new([0.0; 16]);
                for (to, from) in known.iter_mut().zip(m.iter()) {
                    *to = from.value()?;
                }
                Const::Matrix(known)
            }
            Enclosure::Str(text) => Const::Str(text.clone()?),
            Enclosure::Closure(_) => return None,
        })
    }

    /// The intervals of its numbers; none for other kinds.
    pub fn numbers(&self) -> &[Interval] {
        match self {
            Enclosure::Float(x) => std::slice::from_ref(x),
            Enclosure::Triple(t) => t,
            Enclosure::Matrix(m) => &m[..],
            _ => &[],
        }
    }

    /// What it may be as a condition.
    pub fn truth(&self) -> Truth {
        match self {
            Enclosure::Int(n) => n.is_true(),
            Enclosure::Closure(truth) => *truth,
            _ => Truth::UNKNOWN,
        }
    }

    /// Whether a value is in it.
    pub fn contains(&self, value: &Const) -> bool {
        let all = |list: &[Interval], values: &[f32]| list.iter().zip(values).all(|(i, x)| i.contains(*x));
        match (self, value) {
            (Enclosure::Int(n), Const::Int(value)) => n.contains(*value),
            (Enclosure::Float(x), Const::Float(value)) => x.contains(*value),
            (Enclosure::Triple(t), Const::Triple(values)) => all(t, values),
            (Enclosure::Matrix(m), Const::Matrix(values)) => all(&m[..], &values[..]),
            (Enclosure::Str(text), Const::Str(value)) => text.as_ref().is_none_or(|text| text == value),
            (Enclosure::Closure(truth), Const::Null) => truth.no,
            _ => false,
        }
    }

    /// Combines two of the same kind part by part; every value of the kind if the kinds differ.
    fn zip(
        &self,
        other: &Enclosure,
        whole: impl Fn(Whole, Whole) -> Whole,
        number: impl Fn(Interval, Interval) -> Interval,
    ) -> Enclosure {
        match (self, other) {
            (Enclosure::Int(a), Enclosure::Int(b)) => Enclosure::Int(whole(*a, *b)),
            (Enclosure::Float(a), Enclosure::Float(b)) => Enclosure::Float(number(*a, *b)),
            (Enclosure::Triple(a), Enclosure::Triple(b)) => {
                Enclosure::Triple(std::array::from_fn(|i| number(a[i], b[i])))
            }
            (Enclosure::Matrix(a), Enclosure::Matrix(b)) => {
                Enclosure::Matrix(Box::new(std::array::from_fn(|i| number(a[i], b[i]))))
            }
            (Enclosure::Str(a), Enclosure::Str(b)) => {
                Enclosure::Str(a.clone().filter(|a| b.as_ref() == Some(a)))
            }
            (Enclosure::Closure(a), Enclosure::Closure(b)) => Enclosure::Closure(a.or_else(*b)),
            _ => Enclosure::any(self.kind()),
        }
    }

    /// Everything in both.
    #[must_use]
    pub fn hull(&self, other: &Enclosure) -> Enclosure {
        self.zip(other, Whole::hull, Interval::hull)
    }

    /// As [`Interval::widen`].
    #[must_use]
    pub fn widen(&self, next: &Enclosure) -> Enclosure {
        self.zip(next, Whole::widen, Interval::widen)
    }
}

/// A type that an operation takes or returns.
trait LaneType: Sized {
    fn of(value: &Enclosure) -> Option<Self>;
    fn put(self) -> Enclosure;
}

macro_rules! part {
    ($($ty:ty => $variant:ident, $x:ident, $read:expr, $write:expr;)*) => {$(
        impl LaneType for $ty {
            fn of(value: &Enclosure) -> Option<Self> {
                match value {
                    Enclosure::$variant($x) => Some($read),
                    _ => None,
                }
            }
            fn put(self) -> Enclosure {
                let $x = self;
                Enclosure::$variant($write)
            }
        }
    )*};
}

part! {
    Whole => Int, x, *x, x;
    Interval => Float, x, *x, x;
    [Interval; 3] => Triple, x, *x, x;
    [Interval; 16] => Matrix, x, **x, Box::new(x);
}

macro_rules! lane {
    (F) => {
        Interval
    };
    (I) => {
        Whole
    };
    (S) => {
        Whole
    };
    (K) => {
        Whole
    };
    (T) => {
        [Interval; 3]
    };
    (M) => {
        [Interval; 16]
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
        fn one(op: LaneOp, args: &[Enclosure]) -> Option<Enclosure> {
            match op {
                $(LaneOp::$name => row!(args, crate::$module::$body, ($($arg),*) -> $ret)),*
            }
        }
    };
}

crate::for_each_lane_op!(stamp);

/// The results of an operation; `None` if the arguments have the wrong kinds.
pub fn eval(op: LaneOp, args: &[Enclosure]) -> Option<Enclosure> {
    match (op, args) {
        (LaneOp::SEq | LaneOp::SNe, [Enclosure::Str(a), Enclosure::Str(b)]) => {
            let truth = match (a, b) {
                (Some(a), Some(b)) => Truth::known((a == b) == (op == LaneOp::SEq)),
                _ => Truth::UNKNOWN,
            };
            return Some(Enclosure::Int(Whole::of_mask(truth)));
        }
        (LaneOp::SChoose | LaneOp::KChoose, [cond, a, b]) => {
            return Some(match cond.truth().value() {
                Some(true) => a.clone(),
                Some(false) => b.clone(),
                None => a.hull(b),
            });
        }
        (LaneOp::KSome, [a]) => return Some(Enclosure::Int(Whole::of_mask(a.truth()))),
        _ => {}
    }
    if !op.shape().per_component {
        return rules::whole(op, args).or_else(|| one(op, args));
    }
    if !args.iter().any(|arg| arg.kind() == Kind::Triple) {
        return rules::float(op, args).map(Enclosure::Float).or_else(|| one(op, args));
    }
    let mut result = [Interval::NONE; 3];
    for (component, out) in result.iter_mut().enumerate() {
        let of = |arg: &Enclosure| match arg {
            Enclosure::Triple(t) => Enclosure::Float(t[component]),
            other => other.clone(),
        };
        let lane: Vec<Enclosure> = args.iter().map(of).collect();
        *out = match rules::float(op, &lane) {
            Some(sharp) => sharp,
            None => {
                let Enclosure::Float(value) = one(op, &lane)? else { return None };
                value
            }
        };
    }
    Some(Enclosure::Triple(result))
}
