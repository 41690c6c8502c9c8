//! The lane operations as loops, stamped from the one list of [`osl_ir::for_each_lane_op!`].
//!
//! Each body goes into a plain loop over slices for each combination of lane-array and single arguments that
//! matters, inside a function compiled for the instruction set in use; the compiler vectorises the loop. No
//! loop looks at a mask: lanes that do not run compute something that nobody reads.

use crate::arithmetic::{Element, Word};
use crate::program::MAX_ARGS;
use osl_ir::ir::LaneOp;
use osl_noise::Kernel;
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

/// One lane operation over `n` lanes of each component. Components lie `stride` words apart, in arguments as in `out`.
/// `parts` is 1, or as many as the components of a triple for an operation that works on each by itself.
pub(crate) struct LaneCall<'a, W> {
    pub(crate) op: LaneOp,
    /// Each argument, and by how many words the parts lie apart in it: 0 where one serves them all. Words without
    /// [`Word::FORMS`] come as lane arrays alone.
    pub(crate) args: &'a [(Arg<'a, W>, usize)],
    pub(crate) out: &'a mut [W],
    pub(crate) n: usize,
    pub(crate) stride: usize,
    pub(crate) parts: usize,
}

/// One part of a call.
struct Part<'a, W> {
    args: [Arg<'a, W>; MAX_ARGS],
    out: &'a mut [W],
    n: usize,
    stride: usize,
}

impl<W: Word> LaneCall<'_, W> {
    /// Calls `run` with each part.
    #[inline(always)]
    fn each_part(self, run: impl Fn(Part<'_, W>)) {
        let LaneCall { args, out, n, stride, parts, .. } = self;
        for part in 0..parts {
            let mut list = [Arg::Same(&[]); MAX_ARGS];
            for (slot, (arg, apart)) in list.iter_mut().zip(args) {
                *slot = match arg {
                    Arg::Each(words) => Arg::Each(&words[part * apart..]),
                    Arg::Same(words) => Arg::Same(&words[part * apart..]),
                };
            }
            run(Part { args: list, out: &mut out[part * stride..], n, stride });
        }
    }
}

/// A lane operation by the floats that it computes with.
pub(crate) struct Stamped<'a, W, R>(LaneCall<'a, W>, PhantomData<R>);

impl<'a, W, R> Stamped<'a, W, R> {
    pub(crate) fn of(call: LaneCall<'a, W>) -> Self {
        Stamped(call, PhantomData)
    }
}

/// A type that lanes hold.
trait Lane<W: Word>: Copy {
    /// A view of lane arrays.
    type Each<'a>: Copy;
    fn each(words: &[W], n: usize, stride: usize) -> Self::Each<'_>;
    fn at(each: Self::Each<'_>, lane: usize) -> Self;
    fn same(words: &[W]) -> Self;
    fn fill(out: &mut [W], n: usize, stride: usize, f: impl Fn(usize) -> Self);
}

/// A float.
#[derive(Clone, Copy)]
struct One<R>(R);

impl<W: Word, R: Element<W>> Lane<W> for One<R> {
    type Each<'a> = &'a [W];
    #[inline(always)]
    fn each(words: &[W], n: usize, _: usize) -> &[W] {
        &words[..n]
    }
    #[inline(always)]
    fn at(each: &[W], lane: usize) -> One<R> {
        One(R::load(each[lane]))
    }
    #[inline(always)]
    fn same(words: &[W]) -> One<R> {
        One(R::load(words[0]))
    }
    #[inline(always)]
    fn fill(out: &mut [W], n: usize, _: usize, f: impl Fn(usize) -> One<R>) {
        fill_one(
            &mut out[..n],
            #[inline(always)]
            |i| f(i).0.store(),
        );
    }
}

impl<W: Word> Lane<W> for i32 {
    type Each<'a> = &'a [W];
    #[inline(always)]
    fn each(words: &[W], n: usize, _: usize) -> &[W] {
        &words[..n]
    }
    #[inline(always)]
    fn at(each: &[W], lane: usize) -> i32 {
        each[lane].bits() as i32
    }
    #[inline(always)]
    fn same(words: &[W]) -> i32 {
        words[0].bits() as i32
    }
    #[inline(always)]
    fn fill(out: &mut [W], n: usize, _: usize, f: impl Fn(usize) -> i32) {
        fill_one(
            &mut out[..n],
            #[inline(always)]
            |i| W::of(f(i) as u32),
        );
    }
}

impl<W: Word, R: Element<W>, const C: usize> Lane<W> for [R; C] {
    type Each<'a> = [&'a [W]; C];
    #[inline(always)]
    fn each(words: &[W], n: usize, stride: usize) -> [&[W]; C] {
        let mut each = [&words[..n]; C];
        if C == 3 {
            each[1] = &words[stride..][..n];
            each[2] = &words[2 * stride..][..n];
        } else {
            each.iter_mut().enumerate().for_each(|(c, lanes)| *lanes = &words[c * stride..][..n]);
        }
        each
    }
    #[inline(always)]
    fn at(each: [&[W]; C], lane: usize) -> [R; C] {
        // Straight code: loops inside keep the loop over lanes from being vectorised.
        let mut v = [R::lit(0.0); C];
        if C == 3 {
            v[0] = R::load(each[0][lane]);
            v[1] = R::load(each[1][lane]);
            v[2] = R::load(each[2][lane]);
        } else {
            v.iter_mut().zip(each).for_each(|(v, lanes)| *v = R::load(lanes[lane]));
        }
        v
    }
    #[inline(always)]
    fn same(words: &[W]) -> [R; C] {
        std::array::from_fn(|c| R::load(words[c]))
    }
    #[inline(always)]
    fn fill(out: &mut [W], n: usize, stride: usize, f: impl Fn(usize) -> [R; C]) {
        if C == 3 {
            let (x, rest) = out.split_at_mut(stride);
            let (y, z) = rest.split_at_mut(stride);
            fill_three(
                &mut x[..n],
                &mut y[..n],
                &mut z[..n],
                #[inline(always)]
                |i| {
                    let v = f(i);
                    [v[0].store(), v[1].store(), v[2].store()]
                },
            );
            return;
        }
        for i in 0..n {
            let v = f(i);
            for (c, value) in v.into_iter().enumerate() {
                out[c * stride + i] = value.store();
            }
        }
    }
}

// The slices are parameters of their own so that the compiler knows that they overlap with nothing. The loops count:
// an iterator over the output leaves checks of the inputs in the loop, which then runs its last 64 lanes one by one.
#[inline(always)]
#[expect(clippy::needless_range_loop, reason = "checks would be left in the loop")]
fn fill_one<T>(out: &mut [T], f: impl Fn(usize) -> T) {
    let n = out.len();
    for i in 0..n {
        out[i] = f(i);
    }
}

#[inline(always)]
fn fill_three<W: Copy>(x: &mut [W], y: &mut [W], z: &mut [W], f: impl Fn(usize) -> [W; 3]) {
    let n = x.len();
    let (y, z) = (&mut y[..n], &mut z[..n]);
    for i in 0..n {
        let v = f(i);
        x[i] = v[0];
        y[i] = v[1];
        z[i] = v[2];
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
    ($($name:ident $text:literal $class:ident ($($arg:ident),*) -> $ret:ident, $path:path;)*) => {
        impl<W: Word, R: Element<W>> Kernel for Stamped<'_, W, R> {
            type Output = ();
            #[inline(always)]
            fn run(self) {
                let call = self.0;
                match call.op {
                    $(LaneOp::$name => call!(call, W, R, $path, ($($arg),*) -> $ret)),*
                }
            }
        }
    };
}

osl_ir::for_each_lane_op!(stamp);
