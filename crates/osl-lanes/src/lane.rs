//! The element types of lanes, as loops read and write them: floats, ints, triples and matrices.

use crate::word::{Element, Word};

/// An element type of lanes.
pub(super) trait Lane<W: Word>: Copy {
    /// A view of lane arrays.
    type Each<'a>: Copy;
    fn each(words: &[W], n: usize, stride: usize) -> Self::Each<'_>;
    fn at(each: Self::Each<'_>, lane: usize) -> Self;
    fn same(words: &[W]) -> Self;
    fn fill(out: &mut [W], n: usize, stride: usize, f: impl Fn(usize) -> Self);
}

/// A float.
#[derive(Clone, Copy)]
pub(super) struct One<R>(pub(super) R);

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
        osl_simd::fill(
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
        osl_simd::fill(
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
        // Straight code: an inner loop would prevent the vectorisation of the loop over lanes.
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
            osl_simd::fill_three(
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
