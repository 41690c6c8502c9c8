//! The bodies of the lane operations that are not defined elsewhere: operators, comparisons with truth values
//! 0 and 1, choices, parts of triples and matrices, and the elementary functions by name.
//!
//! This module must not compute anything new: it only gives the functions of the other modules the shape that
//! [`for_each_lane_op!`](crate::for_each_lane_op) requires.

use super::color::ColorSystem;
use super::geometry::Triple;
use super::int::Int;
use super::matrix::Matrix;
use super::{Real, arith};

macro_rules! functions {
    ($($name:ident($($arg:ident: $ty:ty),*) -> $ret:ty = $body:expr;)*) => {$(
        #[doc = concat!("The body of the lane operation `", stringify!($name), "`.")]
        #[inline(always)]
        pub fn $name<R: Real>($($arg: $ty),*) -> $ret {
            $body
        }
    )*};
}

functions! {
    add(a: R, b: R) -> R = a + b;
    sub(a: R, b: R) -> R = a - b;
    mul(a: R, b: R) -> R = a * b;
    neg(a: R) -> R = -a;
    mul_add(a: R, b: R, c: R) -> R = c.plus_product(a, b);
    mul_sub(a: R, b: R, c: R) -> R = c.minus_product(a, b);
    lt(a: R, b: R) -> R::Int = R::Int::of_mask(arith::lt(a, b));
    le(a: R, b: R) -> R::Int = R::Int::of_mask(arith::le(a, b));
    gt(a: R, b: R) -> R::Int = R::Int::of_mask(arith::gt(a, b));
    ge(a: R, b: R) -> R::Int = R::Int::of_mask(arith::ge(a, b));
    eq(a: R, b: R) -> R::Int = R::Int::of_mask(arith::eq(a, b));
    ne(a: R, b: R) -> R::Int = R::Int::of_mask(arith::ne(a, b));
    triple_eq(a: Triple<R>, b: Triple<R>) -> R::Int = R::Int::of_mask(same(a, b));
    triple_ne(a: Triple<R>, b: Triple<R>) -> R::Int = R::Int::of_mask(differ(a, b));
    matrix_eq(a: Matrix<R>, b: Matrix<R>) -> R::Int = R::Int::of_mask(same(a, b));
    matrix_ne(a: Matrix<R>, b: Matrix<R>) -> R::Int = R::Int::of_mask(differ(a, b));
    choose(c: R::Int, a: R, b: R) -> R = R::select(c.is_true(), a, b);
    lower(a: R, b: R) -> R = R::select(arith::lt(a, b), a, b);
    root(x: R) -> R = x.sqrt();
    triple(x: R, y: R, z: R) -> Triple<R> = [x, y, z];
    splat(x: R) -> Triple<R> = [x; 3];
    x(t: Triple<R>) -> R = t[0];
    y(t: Triple<R>) -> R = t[1];
    z(t: Triple<R>) -> R = t[2];
    component(t: Triple<R>, i: R::Int) -> R =
        R::select(i.le(R::Int::lit(0)), t[0], R::select(i.eq(R::Int::lit(1)), t[1], t[2]));
    with_component(t: Triple<R>, i: R::Int, v: R) -> Triple<R> = [
        R::select(i.le(R::Int::lit(0)), v, t[0]),
        R::select(i.eq(R::Int::lit(1)), v, t[1]),
        R::select(R::Int::lit(1).lt(i), v, t[2]),
    ];
    xyz_to_rgb(c: Triple<R>) -> Triple<R> = ColorSystem::<R>::rec709().to_rgb(c);
    rgb_to_xyz(c: Triple<R>) -> Triple<R> = ColorSystem::<R>::rec709().to_xyz(c);
    still(x: R) -> R = x;
    luminance(c: Triple<R>) -> R = ColorSystem::<R>::rec709().luminance_of(c);
    xyz_to_rgb_in(c: Triple<R>, system: R::Int) -> Triple<R> =
        R::by_value([system], c, |[system], c| ColorSystem::numbered(system).to_rgb(c));
    rgb_to_xyz_in(c: Triple<R>, system: R::Int) -> Triple<R> =
        R::by_value([system], c, |[system], c| ColorSystem::numbered(system).to_xyz(c));
    luminance_in(c: Triple<R>, system: R::Int) -> R =
        R::by_value([system], c, |[system], c| [ColorSystem::numbered(system).luminance_of(c)])[0];
    fmod_exact(x: R, y: R) -> R = x.fmod_exact(y);
    sin(x: R) -> R = x.sin();
    cos(x: R) -> R = x.cos();
    tan(x: R) -> R = x.tan();
    asin(x: R) -> R = x.asin();
    acos(x: R) -> R = x.acos();
    atan(x: R) -> R = x.atan();
    sinh(x: R) -> R = x.sinh();
    cosh(x: R) -> R = x.cosh();
    tanh(x: R) -> R = x.tanh();
    exp(x: R) -> R = x.exp();
    exp2(x: R) -> R = x.exp2();
    expm1(x: R) -> R = x.expm1();
    log(x: R) -> R = x.log();
    log2(x: R) -> R = x.log2();
    log10(x: R) -> R = x.log10();
    logb(x: R) -> R = x.logb();
    cbrt(x: R) -> R = x.cbrt();
    erf(x: R) -> R = x.erf();
    erfc(x: R) -> R = x.erfc();
    floor(x: R) -> R = x.floor();
    ceil(x: R) -> R = x.ceil();
    trunc(x: R) -> R = x.trunc();
    round(x: R) -> R = x.round();
    atan2(a: R, b: R) -> R = a.atan2(b);
    pow(a: R, b: R) -> R = a.pow(b);
    fmod(a: R, b: R) -> R = a.fmod(b);
}

macro_rules! int_functions {
    ($($name:ident($($arg:ident),*) = $body:expr;)*) => {$(
        #[doc = concat!("The body of the lane operation `", stringify!($name), "`.")]
        #[inline(always)]
        pub fn $name<I: Int>($($arg: I),*) -> I {
            $body
        }
    )*};
}

int_functions! {
    int_and(a, b) = a & b;
    int_or(a, b) = a | b;
    int_xor(a, b) = a ^ b;
    int_compl(a) = !a;
    int_lt(a, b) = I::of_mask(a.lt(b));
    int_le(a, b) = I::of_mask(a.le(b));
    int_gt(a, b) = I::of_mask(b.lt(a));
    int_ge(a, b) = I::of_mask(b.le(a));
    int_eq(a, b) = I::of_mask(a.eq(b));
    int_ne(a, b) = I::of_mask(a.ne(b));
    int_truth(a) = I::of_mask(a.is_true());
    choose_int(c, a, b) = I::select(c.is_true(), a, b);
}

/// Whether all components are equal, in OSL's sense: a NaN equals everything.
#[inline(always)]
fn same<R: Real, const N: usize>(a: [R; N], b: [R; N]) -> R::Mask {
    let mut same = arith::eq(a[0], b[0]);
    for at in 1..N {
        same = same & arith::eq(a[at], b[at]);
    }
    same
}

/// Whether some components differ, in OSL's sense: a NaN differs from everything.
#[inline(always)]
fn differ<R: Real, const N: usize>(a: [R; N], b: [R; N]) -> R::Mask {
    let mut differ = arith::ne(a[0], b[0]);
    for at in 1..N {
        differ = differ | arith::ne(a[at], b[at]);
    }
    differ
}

/// The body of the lane operation `mchoose`.
#[inline(always)]
pub fn choose_matrix<R: Real>(c: R::Int, a: Matrix<R>, b: Matrix<R>) -> Matrix<R> {
    std::array::from_fn(|i| R::select(c.is_true(), a[i], b[i]))
}

/// The index of an element; a row or column outside the matrix counts as its last.
#[inline(always)]
fn index<I: Int>(row: I, column: I) -> I {
    let (first, last) = (I::lit(0), I::lit(3));
    let (row, column) = (row.max(first).min(last), column.max(first).min(last));
    I::lit(4).wrapping_mul(row).wrapping_add(column)
}

/// The body of the lane operation `mget`; indices outside the matrix select its last row or column.
#[inline(always)]
pub fn element<R: Real>(m: Matrix<R>, row: R::Int, column: R::Int) -> R {
    R::by_value(
        [index(row, column)],
        m,
        #[inline(always)]
        |[at], m| [m[(at & 15) as usize]],
    )[0]
}

/// The body of the lane operation `mset`; indices outside the matrix select its last row or column.
#[inline(always)]
pub fn with_element<R: Real>(m: Matrix<R>, row: R::Int, column: R::Int, value: R) -> Matrix<R> {
    let at = index(row, column);
    std::array::from_fn(|i| R::select(at.eq(R::Int::lit(i as i32)), value, m[i]))
}
