//! Values with a derivative, and the conversions of [`color`] on such values, which give derivatives of
//! colors.
//!
//! All other derivatives are written as ordinary instructions. These conversions, and the search of
//! [`super::spline`], have so many cases that they are evaluated a second time instead. This module must not
//! know axes or passes.

use super::color;
use super::geometry::Triple;
use super::real::{Number, Real, Scalar};
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value and its derivative. Compared by value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dual<R> {
    /// The value.
    pub(super) v: R,
    /// Its derivative.
    pub(super) d: R,
}

impl<R: Scalar> PartialEq for Dual<R> {
    #[inline(always)]
    fn eq(&self, other: &Self) -> bool {
        self.v == other.v
    }
}

impl<R: Scalar> PartialOrd for Dual<R> {
    #[inline(always)]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.v.partial_cmp(&other.v)
    }
}

impl<R: Real> Add for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Dual { v: self.v + b.v, d: self.d + b.d }
    }
}

impl<R: Real> Sub for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Dual { v: self.v - b.v, d: self.d - b.d }
    }
}

impl<R: Real> Mul for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Dual { v: self.v * b.v, d: self.v * b.d + self.d * b.v }
    }
}

impl<R: Real> Div for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        let v = self.v / b.v;
        Dual { v, d: (R::lit(1.0) / b.v) * (self.d - v * b.d) }
    }
}

impl<R: Real> Neg for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Dual { v: -self.v, d: -self.d }
    }
}

impl<R: Real> Number for Dual<R> {
    type Mask = R::Mask;

    #[inline(always)]
    fn lit(value: f32) -> Self {
        Dual { v: R::lit(value), d: R::lit(0.0) }
    }

    #[inline(always)]
    fn known(single: f32, exact: f64) -> Self {
        Dual { v: R::known(single, exact), d: R::lit(0.0) }
    }

    #[inline(always)]
    fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Dual { v: R::select(mask, yes.v, no.v), d: R::select(mask, yes.d, no.d) }
    }

    #[inline(always)]
    fn eq(self, other: Self) -> R::Mask {
        self.v.eq(other.v)
    }

    #[inline(always)]
    fn lt(self, other: Self) -> R::Mask {
        self.v.lt(other.v)
    }

    #[inline(always)]
    fn le(self, other: Self) -> R::Mask {
        self.v.le(other.v)
    }

    #[inline(always)]
    fn floor(self) -> Self {
        Dual { v: self.v.floor(), d: R::lit(0.0) }
    }

    #[inline(always)]
    fn is_nan(self) -> R::Mask {
        self.v.is_nan()
    }
}

macro_rules! tangents {
    ($($name:ident)*) => {$(
        #[doc = concat!("How the result of [`color::", stringify!($name), "`] changes where its argument is `c` and changes by `d`.")]
        #[inline(always)]
        pub fn $name<R: Real>(c: Triple<R>, d: Triple<R>) -> Triple<R> {
            let dual = [Dual { v: c[0], d: d[0] }, Dual { v: c[1], d: d[1] }, Dual { v: c[2], d: d[2] }];
            let [x, y, z] = color::$name(dual);
            [x.d, y.d, z.d]
        }
    )*};
}

tangents! { hsv_to_rgb rgb_to_hsv hsl_to_rgb rgb_to_hsl xyy_to_xyz xyz_to_xyy }

#[cfg(test)]
mod tests {
    use super::*;

    /// Compared with differences, away from the borders between cases.
    #[test]
    fn tangents_are_slopes() {
        type Pair = (fn(Triple<f32>) -> Triple<f32>, fn(Triple<f32>, Triple<f32>) -> Triple<f32>);
        let pairs: [Pair; 6] = [
            (color::hsv_to_rgb, hsv_to_rgb),
            (color::rgb_to_hsv, rgb_to_hsv),
            (color::hsl_to_rgb, hsl_to_rgb),
            (color::rgb_to_hsl, rgb_to_hsl),
            (color::xyy_to_xyz, xyy_to_xyz),
            (color::xyz_to_xyy, xyz_to_xyy),
        ];
        let (c, d) = ([0.31_f32, 0.72, 0.45], [0.6_f32, -0.3, 0.2]);
        for (index, (value, tangent)) in pairs.into_iter().enumerate() {
            let h = 1.0 / 512.0;
            let at = |k: f32| value([0, 1, 2].map(|i| c[i] + k * d[i]));
            let (before, after) = (at(-h), at(h));
            let got = tangent(c, d);
            for i in 0..3 {
                let slope = (after[i] - before[i]) / (2.0 * h);
                assert!((slope - got[i]).abs() < 2e-3, "{index} {i}: {} for {slope}", got[i]);
            }
        }
    }
}
