//! The errors of the fast functions.

/// The error bound of a function of one argument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Its name in shaders.
    pub name: &'static str,
    /// The first argument for which the bound holds.
    pub from: f32,
    /// The last argument.
    pub to: f32,
    /// The error is at most this plus `relative` times the magnitude of the result.
    pub absolute: f64,
    /// See `absolute`.
    pub relative: f64,
}

const fn bound(name: &'static str, from: f32, to: f32, absolute: f64, relative: f64) -> Bound {
    Bound { name, from, to, absolute, relative }
}

/// The largest angle with an accurate sine.
const ANGLE: f32 = 1000.0;

/// The errors of the functions, with and without fused operations. Functions that are not listed are exact or
/// correctly rounded.
pub const BOUNDS: &[Bound] = &[
    bound("sin", -ANGLE, ANGLE, 1.6e-6, 0.0),
    bound("cos", -ANGLE, ANGLE, 1.6e-6, 0.0),
    bound("tan", -1.5, 1.5, 1e-7, 2e-5),
    bound("asin", -1.0, 1.0, 5e-5, 0.0),
    bound("acos", -1.0, 1.0, 5e-5, 0.0),
    bound("atan", f32::MIN, f32::MAX, 5e-6, 0.0),
    bound("sinh", -87.0, 87.0, 0.0, 2e-5),
    bound("cosh", -87.0, 87.0, 0.0, 2e-5),
    bound("tanh", f32::MIN, f32::MAX, 4e-6, 0.0),
    bound("exp", -87.0, 87.0, 0.0, 1.3e-5),
    bound("exp2", -126.0, 126.0, 0.0, 4e-6),
    bound("expm1", -87.0, 87.0, 4e-6, 1.3e-5),
    bound("log", f32::MIN_POSITIVE, f32::MAX, 2.5e-6, 2e-7),
    bound("log2", f32::MIN_POSITIVE, f32::MAX, 2.5e-6, 2e-7),
    bound("log10", f32::MIN_POSITIVE, f32::MAX, 2.5e-6, 2e-7),
    bound("cbrt", f32::MIN_POSITIVE, f32::MAX, 0.0, 2e-6),
    bound("erf", f32::MIN, f32::MAX, 3e-6, 0.0),
    bound("erfc", f32::MIN, f32::MAX, 3e-6, 0.0),
    bound("inversesqrt", f32::MIN_POSITIVE, f32::MAX, 0.0, 6e-6),
];
