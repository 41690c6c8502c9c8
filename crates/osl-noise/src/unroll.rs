//! Small arrays and loops as straight code.
//!
//! The compiler vectorises a loop over points only if the body contains no loop at that stage. The standard
//! library's `array::map` and `from_fn`, and loops over corners, are unrolled too late for that.

/// The array of `f(0)`, `f(1)` …, up to four elements.
#[inline(always)]
pub(crate) fn array<T: Copy, const D: usize>(mut f: impl FnMut(usize) -> T) -> [T; D] {
    const { assert!(D <= 4, "further elements would repeat the first") };
    let mut out = [f(0); D];
    if D > 1 {
        out[1] = f(1);
    }
    if D > 2 {
        out[2] = f(2);
    }
    if D > 3 {
        out[3] = f(3);
    }
    out
}

/// Calls `f` with 0 up to but not including `n`, which is at most 16 and known at compile time.
#[inline(always)]
pub(crate) fn each(n: usize, mut f: impl FnMut(usize)) {
    macro_rules! calls {
        ($($i:literal)*) => { $(if n > $i { f($i); })* };
    }
    calls!(0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15);
}
