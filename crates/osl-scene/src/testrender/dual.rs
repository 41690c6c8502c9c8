//! Numbers with their derivatives along x and y of the picture.

use glam::Vec3;
use osl_numeric::strict;
use std::ops::{Add, Mul, Neg, Sub};

/// A number and its two derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dual {
    /// The number.
    pub value: f32,
    /// Its derivatives along x and y.
    pub derivs: [f32; 2],
}

impl Dual {
    /// A constant.
    pub const fn constant(value: f32) -> Dual {
        Dual { value, derivs: [0.0; 2] }
    }

    /// Applies a function, given its value and its derivative at this number.
    fn map(self, value: f32, derivative: f32) -> Dual {
        Dual { value, derivs: self.derivs.map(|s| s * derivative) }
    }

    /// The square root; at 0 the derivatives are 0.
    pub fn sqrt(self) -> Dual {
        let root = self.value.max(0.0).sqrt();
        self.map(root, if root > 0.0 { 0.5 / root } else { 0.0 })
    }

    /// The arc cosine in radians. Outside −1 to 1 it is that of the border, with derivatives 0.
    pub fn acos(self) -> Dual {
        let inside = 1.0 - self.value * self.value;
        self.map(strict::acos(self.value), if inside > 0.0 { -1.0 / inside.sqrt() } else { 0.0 })
    }

    /// The angle of the point (`x`, self).
    pub fn atan2(self, x: Dual) -> Dual {
        let length2 = x.value * x.value + self.value * self.value;
        let scale = if length2 > 0.0 { 1.0 / length2 } else { 0.0 };
        let deriv = |axis: usize| (x.value * self.derivs[axis] - self.value * x.derivs[axis]) * scale;
        Dual { value: strict::atan2(self.value, x.value), derivs: [deriv(0), deriv(1)] }
    }
}

impl Add for Dual {
    type Output = Dual;
    fn add(self, b: Dual) -> Dual {
        Dual { value: self.value + b.value, derivs: [0, 1].map(|k| self.derivs[k] + b.derivs[k]) }
    }
}

impl Sub for Dual {
    type Output = Dual;
    fn sub(self, b: Dual) -> Dual {
        self + -b
    }
}

impl Neg for Dual {
    type Output = Dual;
    fn neg(self) -> Dual {
        self.map(-self.value, -1.0)
    }
}

/// The derivative of a product along an axis.
fn product_rule(a: Dual, b: Dual, axis: usize) -> f32 {
    a.value * b.derivs[axis] + a.derivs[axis] * b.value
}

impl Mul for Dual {
    type Output = Dual;
    fn mul(self, b: Dual) -> Dual {
        Dual { value: self.value * b.value, derivs: [0, 1].map(|axis| product_rule(self, b, axis)) }
    }
}

impl Mul<f32> for Dual {
    type Output = Dual;
    fn mul(self, b: f32) -> Dual {
        self.map(self.value * b, b)
    }
}

/// A vector and its derivatives along x and y.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dual3 {
    /// The vector.
    pub value: Vec3,
    /// Its derivatives along x and y.
    pub derivs: [Vec3; 2],
}

impl Dual3 {
    /// A component, 0 to 2.
    pub fn component(self, index: usize) -> Dual {
        Dual { value: self.value[index], derivs: self.derivs.map(|s| s[index]) }
    }

    /// The dot product with a constant vector.
    pub fn dot(self, b: Vec3) -> Dual {
        Dual { value: self.value.dot(b), derivs: self.derivs.map(|s| s.dot(b)) }
    }

    /// The direction, of length 1.
    pub fn normalize(self) -> Dual3 {
        let value = self.value.normalize_or_zero();
        let scale = 1.0 / self.value.length().max(f32::MIN_POSITIVE);
        Dual3 { value, derivs: self.derivs.map(|s| (s - value * s.dot(value)) * scale) }
    }

    /// The vector from a constant point, times a factor.
    pub fn from(self, origin: Vec3, factor: f32) -> Dual3 {
        Dual3 { value: (self.value - origin) * factor, derivs: self.derivs.map(|s| s * factor) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares derivatives with differences.
    fn check(f: impl Fn(Dual, Dual) -> Dual, x: f32, y: f32) {
        let found = f(Dual { value: x, derivs: [1.0, 0.0] }, Dual { value: y, derivs: [0.0, 1.0] });
        let at = |x: f32, y: f32| f(Dual::constant(x), Dual::constant(y)).value;
        let h = 1e-3;
        let [dx, dy] = [(at(x + h, y) - at(x - h, y)) / (2.0 * h), (at(x, y + h) - at(x, y - h)) / (2.0 * h)];
        assert!((found.derivs[0] - dx).abs() < 1e-3, "{found:?} {dx}");
        assert!((found.derivs[1] - dy).abs() < 1e-3, "{found:?} {dy}");
    }

    #[test]
    fn slopes_are_derivatives() {
        check(|x, y| x * y - x * 3.0 + y, 0.7, -0.4);
        check(|x, y| (x * x + y * y).sqrt(), 0.7, -0.4);
        check(|x, y| x.atan2(y), 0.7, -0.4);
        check(|x, y| (x * y).acos(), 0.7, -0.4);
        assert_eq!(Dual::constant(0.0).atan2(Dual::constant(0.0)).derivs, [0.0; 2]);
    }
}
