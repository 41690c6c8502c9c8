//! The lane operations as loops, stamped from the one list of [`osl_ir::for_each_lane_op!`].
//!
//! Each body goes into a plain loop over slices for each combination of lane-array and single arguments that
//! matters, inside a function compiled for the instruction set in use; the compiler vectorises the loop. No
//! loop looks at a mask: lanes that do not run compute something that nobody reads.

mod lane;
mod run;

use crate::arithmetic::{Element, Word};
use crate::program::MAX_ARGS;
use lane::{Lane, One};
use osl_ir::ir::LaneOp;
use osl_noise::Kernel;
pub(crate) use run::{From, LaneRun, PIECE, Ready, ReadyArg, ReadyLane, Spread, StampedRun, one};
use std::marker::PhantomData;

/// An argument of a lane operation.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Arg<'a, W> {
    /// Lanes of each component, component by component.
    Each(&'a [W]),
    /// One value for all lanes: a word for each component.
    Same(&'a [W]),
}

impl<'a, W> Arg<'a, W> {
    /// What it points at.
    #[inline(always)]
    fn words(self) -> &'a [W]
    where
        W: Copy,
    {
        let (Arg::Each(words) | Arg::Same(words)) = self;
        words
    }
}

/// A lane operation by the floats that it computes with.
pub(crate) struct Stamped<'a, W, R>(LaneCall<'a, W>, PhantomData<R>);

impl<'a, W, R> Stamped<'a, W, R> {
    pub(crate) fn of(call: LaneCall<'a, W>) -> Self {
        Stamped(call, PhantomData)
    }
}

/// One lane operation over `n` lanes of each component. Components lie `stride` words apart, in arguments as in `out`.
pub(crate) struct LaneCall<'a, W> {
    op: LaneOp,
    args: [Arg<'a, W>; MAX_ARGS],
    /// By how many words the parts of an argument lie apart: 0 where one serves them all.
    apart: [usize; MAX_ARGS],
    out: &'a mut [W],
    n: usize,
    stride: usize,
    /// 1, or as many as the components of a triple for an operation that works on each by itself.
    parts: usize,
}

/// Elements of a matrix.
const ELEMENTS: usize = 16;

/// One part of a call.
struct Part<'a, W> {
    args: [Arg<'a, W>; MAX_ARGS],
    out: &'a mut [W],
    n: usize,
    stride: usize,
}

impl<W: Word> LaneCall<'_, W> {
    /// A matrix with another element, copied element by element. `None` unless its place is the same for all lanes, as where
    /// a matrix is made of sixteen numbers.
    #[inline(always)]
    fn with_element(&mut self) -> Option<()> {
        let (n, stride) = (self.n, self.stride);
        let [matrix, Arg::Same(row), Arg::Same(column), value] = self.args else { return None };
        let [row, column] = [row, column].map(|words| <i32 as Lane<W>>::same(words).clamp(0, 3) as usize);
        for (element, out) in self.out.chunks_mut(stride.max(1)).take(ELEMENTS).enumerate() {
            let (arg, at) = if element == 4 * row + column { (value, 0) } else { (matrix, element) };
            match arg {
                Arg::Each(words) => out[..n].copy_from_slice(&words[at * stride..][..n]),
                Arg::Same(words) => out[..n].fill(words[at]),
            }
        }
        Some(())
    }

    /// Calls `run` with each part.
    #[inline(always)]
    fn each_part(self, run: impl Fn(Part<'_, W>)) {
        let LaneCall { mut args, apart, out, n, stride, parts, .. } = self;
        for part in 0..parts {
            if part > 0 {
                for (arg, apart) in args.iter_mut().zip(apart) {
                    let (Arg::Each(words) | Arg::Same(words)) = arg;
                    *words = &words[apart..];
                }
            }
            run(Part { args, out: &mut out[part * stride..], n, stride });
        }
    }
}

#[inline(always)]
fn map1<W: Word, A: Lane<W>, O: Lane<W>>(call: Part<'_, W>, f: impl Fn(A) -> O) {
    let (n, stride) = (call.n, call.stride);
    if !W::FORMS {
        let a = A::each(call.args[0].words(), n, stride);
        return O::fill(
            call.out,
            n,
            stride,
            #[inline(always)]
            |i| f(A::at(a, i)),
        );
    }
    match call.args[0] {
        Arg::Each(a) => {
            let a = A::each(a, n, stride);
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |i| f(A::at(a, i)),
            );
        }
        Arg::Same(a) => {
            let value = f(A::same(a));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |_| value,
            );
        }
    }
}

#[inline(always)]
fn map2<W: Word, A: Lane<W>, B: Lane<W>, O: Lane<W>>(call: Part<'_, W>, f: impl Fn(A, B) -> O) {
    let (n, stride) = (call.n, call.stride);
    if !W::FORMS {
        let (a, b) = (A::each(call.args[0].words(), n, stride), B::each(call.args[1].words(), n, stride));
        return O::fill(
            call.out,
            n,
            stride,
            #[inline(always)]
            |i| f(A::at(a, i), B::at(b, i)),
        );
    }
    match (call.args[0], call.args[1]) {
        (Arg::Each(a), Arg::Each(b)) => {
            let (a, b) = (A::each(a, n, stride), B::each(b, n, stride));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |i| f(A::at(a, i), B::at(b, i)),
            );
        }
        (Arg::Same(a), Arg::Each(b)) => {
            let (a, b) = (A::same(a), B::each(b, n, stride));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |i| f(a, B::at(b, i)),
            );
        }
        (Arg::Each(a), Arg::Same(b)) => {
            let (a, b) = (A::each(a, n, stride), B::same(b));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |i| f(A::at(a, i), b),
            );
        }
        (Arg::Same(a), Arg::Same(b)) => {
            let value = f(A::same(a), B::same(b));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |_| value,
            );
        }
    }
}

#[inline(always)]
fn map3<W: Word, A: Lane<W>, B: Lane<W>, C: Lane<W>, O: Lane<W>>(
    call: Part<'_, W>,
    f: impl Fn(A, B, C) -> O,
) {
    let (n, stride) = (call.n, call.stride);
    if !W::FORMS {
        let (a, b) = (A::each(call.args[0].words(), n, stride), B::each(call.args[1].words(), n, stride));
        let c = C::each(call.args[2].words(), n, stride);
        return O::fill(
            call.out,
            n,
            stride,
            #[inline(always)]
            |i| f(A::at(a, i), B::at(b, i), C::at(c, i)),
        );
    }
    use Arg::{Each, Same};
    match (call.args[0], call.args[1], call.args[2]) {
        (Each(a), Each(b), Each(c)) => {
            let (a, b, c) = (A::each(a, n, stride), B::each(b, n, stride), C::each(c, n, stride));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |i| f(A::at(a, i), B::at(b, i), C::at(c, i)),
            );
        }
        (Same(a), Each(b), Each(c)) => {
            let (a, b, c) = (A::same(a), B::each(b, n, stride), C::each(c, n, stride));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |i| f(a, B::at(b, i), C::at(c, i)),
            );
        }
        (Each(a), Same(b), Each(c)) => {
            let (a, b, c) = (A::each(a, n, stride), B::same(b), C::each(c, n, stride));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |i| f(A::at(a, i), b, C::at(c, i)),
            );
        }
        (Each(a), Each(b), Same(c)) => {
            let (a, b, c) = (A::each(a, n, stride), B::each(b, n, stride), C::same(c));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |i| f(A::at(a, i), B::at(b, i), c),
            );
        }
        (Same(a), Same(b), Each(c)) => {
            let (a, b, c) = (A::same(a), B::same(b), C::each(c, n, stride));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |i| f(a, b, C::at(c, i)),
            );
        }
        (Same(a), Each(b), Same(c)) => {
            let (a, b, c) = (A::same(a), B::each(b, n, stride), C::same(c));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |i| f(a, B::at(b, i), c),
            );
        }
        (Each(a), Same(b), Same(c)) => {
            let (a, b, c) = (A::each(a, n, stride), B::same(b), C::same(c));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |i| f(A::at(a, i), b, c),
            );
        }
        (Same(a), Same(b), Same(c)) => {
            let value = f(A::same(a), B::same(b), C::same(c));
            O::fill(
                call.out,
                n,
                stride,
                #[inline(always)]
                |_| value,
            );
        }
    }
}

/// Four arguments: rare, so one loop that asks each argument.
#[inline(always)]
fn map4<W: Word, A: Lane<W>, B: Lane<W>, C: Lane<W>, D: Lane<W>, O: Lane<W>>(
    call: Part<'_, W>,
    f: impl Fn(A, B, C, D) -> O,
) {
    let Part { args, out, n, stride } = call;
    O::fill(
        out,
        n,
        stride,
        #[inline(always)]
        |i| {
            f(
                pick(args[0], n, stride, i),
                pick(args[1], n, stride, i),
                pick(args[2], n, stride, i),
                pick(args[3], n, stride, i),
            )
        },
    );
}

#[inline(always)]
fn pick<W: Word, T: Lane<W>>(arg: Arg<'_, W>, n: usize, stride: usize, lane: usize) -> T {
    match arg {
        Arg::Each(words) => T::at(T::each(words, n, stride), lane),
        Arg::Same(words) => T::same(words),
    }
}

// A float is wrapped for its loop: an impl for every float might be one for ints, as far as the compiler can tell.
macro_rules! lane {
    ($real:ident F) => {
        One<$real>
    };
    ($real:ident I) => {
        i32
    };
    ($real:ident S) => {
        i32
    };
    ($real:ident K) => {
        i32
    };
    ($real:ident T) => {
        [$real; 3]
    };
    ($real:ident M) => {
        [$real; 16]
    };
}

macro_rules! wrap {
    (F $value:expr) => {
        One($value)
    };
    ($kind:ident $value:expr) => {
        $value
    };
}

macro_rules! unwrap {
    (F $name:ident) => {
        $name.0
    };
    ($kind:ident $name:ident) => {
        $name
    };
}

macro_rules! call {
    ($call:ident, $w:ident, $r:ident, $path:path, ($a:ident) -> $o:ident) => {
        $call.each_part(
            #[inline(always)]
            |part| {
                map1::<$w, lane!($r $a), lane!($r $o)>(
                    part,
                    #[inline(always)]
                    |a| wrap!($o $path(unwrap!($a a))),
                )
            },
        )
    };
    ($call:ident, $w:ident, $r:ident, $path:path, ($a:ident, $b:ident) -> $o:ident) => {
        $call.each_part(
            #[inline(always)]
            |part| {
                map2::<$w, lane!($r $a), lane!($r $b), lane!($r $o)>(
                    part,
                    #[inline(always)]
                    |a, b| wrap!($o $path(unwrap!($a a), unwrap!($b b))),
                )
            },
        )
    };
    ($call:ident, $w:ident, $r:ident, $path:path, ($a:ident, $b:ident, $c:ident) -> $o:ident) => {
        $call.each_part(
            #[inline(always)]
            |part| {
                map3::<$w, lane!($r $a), lane!($r $b), lane!($r $c), lane!($r $o)>(
                    part,
                    #[inline(always)]
                    |a, b, c| wrap!($o $path(unwrap!($a a), unwrap!($b b), unwrap!($c c))),
                )
            },
        )
    };
    ($call:ident, $w:ident, $r:ident, $path:path, ($a:ident, $b:ident, $c:ident, $d:ident) -> $o:ident) => {
        $call.each_part(
            #[inline(always)]
            |part| {
                map4::<$w, lane!($r $a), lane!($r $b), lane!($r $c), lane!($r $d), lane!($r $o)>(
                    part,
                    #[inline(always)]
                    |a, b, c, d| wrap!($o $path(unwrap!($a a), unwrap!($b b), unwrap!($c c), unwrap!($d d))),
                )
            },
        )
    };
}

macro_rules! stamp {
    ($($name:ident $text:literal $class:ident ($($arg:ident),*) -> $ret:ident, $module:ident::$body:ident,
        $cost:ident $continuity:ident $precision:ident, $derivative:ident;)*) => {
        impl<W: Word, R: Element<W>> Kernel for Stamped<'_, W, R> {
            type Output = ();
            #[inline(always)]
            fn run(self) {
                let mut call = self.0;
                if call.op == LaneOp::MSet && call.with_element().is_some() {
                    return;
                }
                match call.op {
                    $(LaneOp::$name => call!(call, W, R, osl_ir::numeric::$module::$body, ($($arg),*) -> $ret)),*
                }
            }
        }
    };
}

osl_ir::for_each_lane_op!(stamp);
