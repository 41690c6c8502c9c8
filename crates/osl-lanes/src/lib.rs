//! The lane operations as loops over slices, stamped from the one list of [`osl_numeric::for_each_lane_op!`].
//!
//! Each body becomes plain loops over slices, in a function for each operation and instruction set; the
//! compiler vectorises the loops. Hardly any are in single precision for AVX-512, which uses those for AVX2:
//! machine code takes over after some thousands of lanes. One function with the loops of all operations would
//! save calls, but takes the compiler more than twice the time. Cheap bodies have a loop for each combination
//! of lane arrays and single arguments, all others only one for lane arrays. Loops ignore the mask: inactive
//! lanes compute values that are not used.
//!
//! The loops are a crate of their own because they take most of the time of compiling the interpreter, and
//! change least. This crate must not know registers, programs, masks or the order of operations.

mod lane;
mod remainder;
mod word;

use lane::{Lane, One};
use osl_numeric::fast::FastFloat;
use osl_numeric::{Kind, LaneOp, MAX_ARGS};
use osl_simd::{FusedKernel, Isa, Kernel};
use std::marker::PhantomData;
pub use word::{Element, Word};

/// An argument of a lane operation.
#[derive(Clone, Copy, Debug)]
pub enum Arg<'a, W> {
    /// Lanes of each component, component by component.
    Each(&'a [W]),
    /// One value for all lanes: a word for each component.
    Same(&'a [W]),
}

impl<'a, W> Arg<'a, W> {
    /// Its words.
    #[inline(always)]
    pub fn words(self) -> &'a [W]
    where
        W: Copy,
    {
        let (Arg::Each(words) | Arg::Same(words)) = self;
        words
    }
}

/// The loops of one lane operation for a float type. `OP` is its number.
struct Single<'a, W, R, const OP: u16>(LaneCall<'a, W>, PhantomData<R>);

/// The loops of one lane operation in the fast arithmetic, if its precision is not
/// [`Strict`](osl_numeric::Precision::Strict).
struct FastSingle<'a, const OP: u16>(LaneCall<'a, u32>);

/// One lane operation over `n` lanes of each component. The components of arguments and of `out` are `stride`
/// words apart.
///
/// The loops panic if a slice is shorter than the call says.
pub struct LaneCall<'a, W> {
    /// The operation.
    pub op: LaneOp,
    /// Its arguments, and unused ones after them.
    pub args: [Arg<'a, W>; MAX_ARGS],
    /// Distance in words between the parts of an argument: 0 if all parts use the same words.
    pub apart: [usize; MAX_ARGS],
    /// Where the result is written.
    pub out: &'a mut [W],
    /// Number of lanes.
    pub n: usize,
    /// Distance in words between components.
    pub stride: usize,
    /// 1, or the number of a triple's components for an operation that works on each separately.
    pub parts: usize,
}

/// Number of elements in a matrix.
const ELEMENTS: usize = 16;

/// One part of a call.
struct CallPart<'a, W> {
    args: [Arg<'a, W>; MAX_ARGS],
    out: &'a mut [W],
    n: usize,
    stride: usize,
}

impl<W: Word> LaneCall<'_, W> {
    /// A matrix with one element replaced, copied element by element. `None` unless the index is the same for
    /// all lanes, as when a matrix is composed of sixteen numbers.
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
    fn each_part(self, run: impl Fn(CallPart<'_, W>)) {
        let LaneCall { mut args, apart, out, n, stride, parts, .. } = self;
        for part in 0..parts {
            if part > 0 {
                for (arg, apart) in args.iter_mut().zip(apart) {
                    let (Arg::Each(words) | Arg::Same(words)) = arg;
                    *words = &words[apart..];
                }
            }
            run(CallPart { args, out: &mut out[part * stride..], n, stride });
        }
    }
}

/// One argument. A single value was broadcast before.
#[inline(always)]
fn map1<W: Word, A: Lane<W>, O: Lane<W>>(call: CallPart<'_, W>, f: impl Fn(A) -> O) {
    let (n, stride) = (call.n, call.stride);
    let a = A::each(call.args[0].words(), n, stride);
    O::fill(
        call.out,
        n,
        stride,
        #[inline(always)]
        |i| f(A::at(a, i)),
    );
}

/// Fills the output of a call; the expression computes the value of lane `$i`.
macro_rules! fill {
    ($call:ident, $i:ident, $value:expr) => {
        O::fill(
            $call.out,
            $call.n,
            $call.stride,
            #[inline(always)]
            |$i| $value,
        )
    };
}

/// Two arguments. With `FORMS` one of them may be single, otherwise both are lanes.
#[inline(always)]
fn map2<const FORMS: bool, W: Word, A: Lane<W>, B: Lane<W>, O: Lane<W>>(
    call: CallPart<'_, W>,
    f: impl Fn(A, B) -> O,
) {
    let [a, b, ..] = call.args;
    let each_a = || A::each(a.words(), call.n, call.stride);
    let each_b = || B::each(b.words(), call.n, call.stride);
    match (a, b) {
        (Arg::Same(a), Arg::Each(_)) if FORMS => {
            let (a, b) = (A::same(a), each_b());
            fill!(call, i, f(a, B::at(b, i)));
        }
        (Arg::Each(_), Arg::Same(b)) if FORMS => {
            let (a, b) = (each_a(), B::same(b));
            fill!(call, i, f(A::at(a, i), b));
        }
        _ => {
            let (a, b) = (each_a(), each_b());
            fill!(call, i, f(A::at(a, i), B::at(b, i)));
        }
    }
}

/// Three arguments, all lanes.
#[inline(always)]
fn map3<W: Word, A: Lane<W>, B: Lane<W>, C: Lane<W>, O: Lane<W>>(
    call: CallPart<'_, W>,
    f: impl Fn(A, B, C) -> O,
) {
    let [a, b, c, _] = call.args;
    let a = A::each(a.words(), call.n, call.stride);
    let b = B::each(b.words(), call.n, call.stride);
    let c = C::each(c.words(), call.n, call.stride);
    fill!(call, i, f(A::at(a, i), B::at(b, i), C::at(c, i)));
}

/// Four arguments are rare, so there is only one loop, which checks the form of each argument.
#[inline(always)]
fn map4<W: Word, A: Lane<W>, B: Lane<W>, C: Lane<W>, D: Lane<W>, O: Lane<W>>(
    call: CallPart<'_, W>,
    f: impl Fn(A, B, C, D) -> O,
) {
    let CallPart { args, out, n, stride } = call;
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

// A float is wrapped for its loop, because an implementation for all floats could overlap with that for ints,
// as far as the compiler knows.
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

/// Whether an operation has separate loops for single arguments: one with a matrix and another argument.
/// In others, single values are broadcast first, which costs a small part of the loop and saves code.
const fn has_forms(op: LaneOp) -> bool {
    let args = op.shape().args;
    args.len() == 2 && matches!(args[0], Kind::Matrix)
}

/// Whether an operation has separate loops for single arguments, by the number of the operation. If not, the
/// caller broadcasts single arguments to lanes. The same holds for an operation whose arguments are all
/// single.
pub const FORMS: [bool; LaneOp::ALL.len()] = {
    let mut forms = [false; LaneOp::ALL.len()];
    let mut at = 0;
    while at < forms.len() {
        forms[at] = has_forms(LaneOp::ALL[at]);
        at += 1;
    }
    forms
};

macro_rules! call {
    ($op:ident, $call:ident, $w:ident, $r:ident, $path:path, ($a:ident) -> $o:ident) => {
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
    ($op:ident, $call:ident, $w:ident, $r:ident, $path:path, ($a:ident, $b:ident) -> $o:ident) => {
        $call.each_part(
            #[inline(always)]
            |part| {
                map2::<{ has_forms(LaneOp::$op) }, $w, lane!($r $a), lane!($r $b), lane!($r $o)>(
                    part,
                    #[inline(always)]
                    |a, b| wrap!($o $path(unwrap!($a a), unwrap!($b b))),
                )
            },
        )
    };
    ($op:ident, $call:ident, $w:ident, $r:ident, $path:path, ($a:ident, $b:ident, $c:ident) -> $o:ident) => {
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
    ($op:ident, $call:ident, $w:ident, $r:ident, $path:path, ($a:ident, $b:ident, $c:ident, $d:ident) -> $o:ident) => {
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

/// Dispatches the loops of an operation of the strict arithmetic. Two operations compute in double precision,
/// so that there is no machine code for them: they have loops for AVX-512.
macro_rules! dispatch {
    (SrgbToLinear $isa:ident, $loops:expr) => {
        $isa.dispatch($loops)
    };
    (LinearToSrgb $isa:ident, $loops:expr) => {
        $isa.dispatch($loops)
    };
    ($op:ident $isa:ident, $loops:expr) => {
        $isa.dispatch_to_avx2($loops)
    };
}

/// What concerns an operation that differs in the fast arithmetic; nothing for the others, which use the
/// strict loops.
macro_rules! if_fast {
    (strict $($what:tt)*) => {
        ()
    };
    ($precision:ident $what:expr) => {
        $what
    };
}

/// The loops of an operation in the fast arithmetic, if they differ.
macro_rules! fast_single {
    (strict $($rest:tt)*) => {};
    ($precision:ident $op:ident $($rest:tt)*) => {
        impl FusedKernel for FastSingle<'_, { LaneOp::$op as u16 }> {
            #[inline(always)]
            fn fused(self) {
                let call = self.0;
                call!($op, call, u32, Fused, $($rest)*)
            }
            #[inline(always)]
            fn plain(self) {
                let call = self.0;
                call!($op, call, u32, Plain, $($rest)*)
            }
        }
    };
}

type Fused = FastFloat<true>;
type Plain = FastFloat<false>;

macro_rules! stamp {
    ($($name:ident $text:literal $class:ident ($($arg:ident),*) -> $ret:ident, $module:ident::$body:ident,
        $cost:ident $continuity:ident $precision:ident $domain:ident, $derivative:ident;)*) => {
        $(
            impl<W: Word, R: Element<W>> Kernel for Single<'_, W, R, { LaneOp::$name as u16 }> {
                type Output = ();
                #[inline(always)]
                fn run(self) {
                    #[allow(unused_mut, reason = "one operation changes it")]
                    let mut call = self.0;
                    if matches!(LaneOp::$name, LaneOp::MSet) && call.with_element().is_some() {
                        return;
                    }
                    // Its body for single precision has a call, which is no vector.
                    if matches!(LaneOp::$name, LaneOp::FmodExact) && W::narrow(&[]).is_some() {
                        call.each_part(remainder::part);
                        return;
                    }
                    call!($name, call, W, R, osl_numeric::$module::$body, ($($arg),*) -> $ret)
                }
            }

            fast_single!($precision $name osl_numeric::$module::$body, ($($arg),*) -> $ret);
        )*

        /// Runs an operation of the strict arithmetic.
        pub fn run_strict(isa: Isa, call: LaneCall<'_, u32>) {
            match call.op {
                $(LaneOp::$name => dispatch!($name isa,
                    Single::<u32, f32, { LaneOp::$name as u16 }>(call, PhantomData))),*
            }
        }

        /// Runs an operation in double precision.
        pub fn run_double(isa: Isa, call: LaneCall<'_, u64>) {
            match call.op {
                $(LaneOp::$name => isa.dispatch_widest(
                    Single::<u64, f64, { LaneOp::$name as u16 }>(call, PhantomData))),*
            }
        }

        /// Runs an operation of the fast arithmetic whose precision is not
        /// [`Strict`](osl_numeric::Precision::Strict).
        pub fn run_fast(isa: Isa, call: LaneCall<'_, u32>) {
            match call.op {
                $(LaneOp::$name => if_fast!($precision
                    isa.dispatch_fused(FastSingle::<{ LaneOp::$name as u16 }>(call)))),*
            }
        }

        /// The same with fused multiply-add, on any machine. It is slow where the processor has no such
        /// instruction, so only tests use it; it is compiled where it is called.
        #[inline]
        pub fn run_fused(call: LaneCall<'_, u32>) {
            match call.op {
                $(LaneOp::$name => if_fast!($precision FastSingle::<{ LaneOp::$name as u16 }>(call).fused())),*
            }
        }
    };
}

osl_numeric::for_each_lane_op!(stamp);
