//! The lane operations as loops, stamped from the one list of [`osl_ir::for_each_lane_op!`].
//!
//! Each body goes into a plain loop over slices for each combination of lane-array and single arguments that
//! matters, inside a function compiled for the instruction set in use; the compiler vectorises the loop. No
//! loop looks at a mask: lanes that do not run compute something that nobody reads.

use crate::program::MAX_ARGS;
use crate::register::{floats, floats_mut, ints, ints_mut};
use osl_ir::ir::LaneOp;
use osl_noise::{Isa, Kernel};

/// An argument of a lane operation.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Arg<'a> {
    /// Lanes of each component, component by component.
    Each(&'a [u32]),
    /// One value for all lanes: a word for each component.
    Same(&'a [u32]),
}

/// One lane operation over `n` lanes of each component. Components lie `stride` words apart, in arguments as in `out`.
/// `parts` is 1, or as many as the components of a triple for an operation that works on each by itself.
pub(crate) struct LaneCall<'a> {
    pub(crate) op: LaneOp,
    /// Each argument, and by how many words the parts lie apart in it: 0 where one serves them all.
    pub(crate) args: &'a [(Arg<'a>, usize)],
    pub(crate) out: &'a mut [u32],
    pub(crate) n: usize,
    pub(crate) stride: usize,
    pub(crate) parts: usize,
}

/// One part of a call.
struct Part<'a> {
    args: [Arg<'a>; MAX_ARGS],
    out: &'a mut [u32],
    n: usize,
    stride: usize,
}

impl LaneCall<'_> {
    /// Calls `run` with each part.
    #[inline(always)]
    fn each_part(self, run: impl Fn(Part<'_>)) {
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

/// Runs the operation with the instruction set.
pub(crate) fn run(isa: Isa, call: LaneCall<'_>) {
    isa.dispatch(call);
}

/// A type that lanes hold.
trait Lane: Copy {
    /// A view of lane arrays.
    type Each<'a>: Copy;
    fn each(words: &[u32], n: usize, stride: usize) -> Self::Each<'_>;
    fn at(each: Self::Each<'_>, lane: usize) -> Self;
    fn same(words: &[u32]) -> Self;
    fn fill(out: &mut [u32], n: usize, stride: usize, f: impl Fn(usize) -> Self);
}

impl Lane for f32 {
    type Each<'a> = &'a [f32];
    #[inline(always)]
    fn each(words: &[u32], n: usize, _: usize) -> &[f32] {
        &floats(words)[..n]
    }
    #[inline(always)]
    fn at(each: &[f32], lane: usize) -> f32 {
        each[lane]
    }
    #[inline(always)]
    fn same(words: &[u32]) -> f32 {
        f32::from_bits(words[0])
    }
    #[inline(always)]
    fn fill(out: &mut [u32], n: usize, _: usize, f: impl Fn(usize) -> f32) {
        fill_one(&mut floats_mut(out)[..n], f);
    }
}

impl Lane for i32 {
    type Each<'a> = &'a [i32];
    #[inline(always)]
    fn each(words: &[u32], n: usize, _: usize) -> &[i32] {
        &ints(words)[..n]
    }
    #[inline(always)]
    fn at(each: &[i32], lane: usize) -> i32 {
        each[lane]
    }
    #[inline(always)]
    fn same(words: &[u32]) -> i32 {
        words[0] as i32
    }
    #[inline(always)]
    fn fill(out: &mut [u32], n: usize, _: usize, f: impl Fn(usize) -> i32) {
        fill_one(&mut ints_mut(out)[..n], f);
    }
}

impl<const C: usize> Lane for [f32; C] {
    type Each<'a> = [&'a [f32]; C];
    #[inline(always)]
    fn each(words: &[u32], n: usize, stride: usize) -> [&[f32]; C] {
        let all = floats(words);
        let mut each = [&all[..n]; C];
        if C == 3 {
            each[1] = &all[stride..][..n];
            each[2] = &all[2 * stride..][..n];
        } else {
            each.iter_mut().enumerate().for_each(|(c, lanes)| *lanes = &all[c * stride..][..n]);
        }
        each
    }
    #[inline(always)]
    fn at(each: [&[f32]; C], lane: usize) -> [f32; C] {
        // Straight code: loops inside keep the loop over lanes from being vectorised.
        let mut v = [0.0; C];
        if C == 3 {
            v[0] = each[0][lane];
            v[1] = each[1][lane];
            v[2] = each[2][lane];
        } else {
            v.iter_mut().zip(each).for_each(|(v, lanes)| *v = lanes[lane]);
        }
        v
    }
    #[inline(always)]
    fn same(words: &[u32]) -> [f32; C] {
        std::array::from_fn(|c| f32::from_bits(words[c]))
    }
    #[inline(always)]
    fn fill(out: &mut [u32], n: usize, stride: usize, f: impl Fn(usize) -> [f32; C]) {
        let out = floats_mut(out);
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
                    [v[0], v[1], v[2]]
                },
            );
            return;
        }
        for i in 0..n {
            let v = f(i);
            for (c, value) in v.into_iter().enumerate() {
                out[c * stride + i] = value;
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
fn fill_three(x: &mut [f32], y: &mut [f32], z: &mut [f32], f: impl Fn(usize) -> [f32; 3]) {
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
fn map1<A: Lane, O: Lane>(call: Part<'_>, f: impl Fn(A) -> O) {
    let (n, stride) = (call.n, call.stride);
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
fn map2<A: Lane, B: Lane, O: Lane>(call: Part<'_>, f: impl Fn(A, B) -> O) {
    let (n, stride) = (call.n, call.stride);
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
fn map3<A: Lane, B: Lane, C: Lane, O: Lane>(call: Part<'_>, f: impl Fn(A, B, C) -> O) {
    let (n, stride) = (call.n, call.stride);
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
fn map4<A: Lane, B: Lane, C: Lane, D: Lane, O: Lane>(call: Part<'_>, f: impl Fn(A, B, C, D) -> O) {
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
fn pick<T: Lane>(arg: Arg<'_>, n: usize, stride: usize, lane: usize) -> T {
    match arg {
        Arg::Each(words) => T::at(T::each(words, n, stride), lane),
        Arg::Same(words) => T::same(words),
    }
}

macro_rules! lane {
    (F) => {
        f32
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
        [f32; 3]
    };
    (M) => {
        [f32; 16]
    };
}

macro_rules! call {
    ($call:ident, $path:path, ($a:ident) -> $o:ident) => {
        $call.each_part(
            #[inline(always)]
            |part| map1::<lane!($a), lane!($o)>(part, $path),
        )
    };
    ($call:ident, $path:path, ($a:ident, $b:ident) -> $o:ident) => {
        $call.each_part(
            #[inline(always)]
            |part| map2::<lane!($a), lane!($b), lane!($o)>(part, $path),
        )
    };
    ($call:ident, $path:path, ($a:ident, $b:ident, $c:ident) -> $o:ident) => {
        $call.each_part(
            #[inline(always)]
            |part| map3::<lane!($a), lane!($b), lane!($c), lane!($o)>(part, $path),
        )
    };
    ($call:ident, $path:path, ($a:ident, $b:ident, $c:ident, $d:ident) -> $o:ident) => {
        $call.each_part(
            #[inline(always)]
            |part| map4::<lane!($a), lane!($b), lane!($c), lane!($d), lane!($o)>(part, $path),
        )
    };
}

macro_rules! stamp {
    ($($name:ident $text:literal $class:ident ($($arg:ident),*) -> $ret:ident, $path:path;)*) => {
        impl Kernel for LaneCall<'_> {
            type Output = ();
            #[inline(always)]
            fn run(self) {
                let call = self;
                match call.op {
                    $(LaneOp::$name => call!(call, $path, ($($arg),*) -> $ret)),*
                }
            }
        }
    };
}

osl_ir::for_each_lane_op!(stamp);
