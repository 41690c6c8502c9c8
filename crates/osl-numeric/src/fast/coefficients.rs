//! Coefficients of the fast functions. Polynomials begin with the highest power.

/// Adding this to a number rounds it to a whole number in the low bits.
pub(super) const WHOLE: f32 = 12_582_912.0;

/// 1/π.
pub(super) const INV_PI: f32 = std::f32::consts::FRAC_1_PI;
/// π/2.
pub(super) const PI_2: f32 = std::f32::consts::FRAC_PI_2;

/// -π in two parts, for fused operations.
pub(super) const MINUS_PI: [f32; 2] = [-std::f32::consts::PI, 8.742_278e-8];
/// -π in three parts whose products with small integers are exact.
pub(super) const MINUS_PI_PARTS: [f32; 3] = [-3.140_625, -0.000_967_502_6, -1.509_906_7e-7];
/// -π/2 in two parts.
pub(super) const MINUS_PI_2: [f32; 2] = [-PI_2, 4.371_139e-8];
/// -π/2 in three parts of the same kind.
pub(super) const MINUS_PI_2_PARTS: [f32; 3] = [-1.570_312_5, -0.000_483_751_3, -7.549_533_6e-8];

/// Sine: powers of the squared angle.
pub(super) const SIN: [f32; 3] = [-0.000_185_422_24, 0.008_314_275, -0.166_658_54];
/// Tangent, in the same form.
pub(super) const TAN: [f32; 4] = [0.043_088_8, 0.041_398_55, 0.136_065_07, 0.333_154_32];
/// Arc tangent.
pub(super) const ATAN: [f32; 6] =
    [-0.013_480_626, 0.057_477_742, -0.121_239_5, 0.195_636_1, -0.332_994_64, 0.999_995_65];
/// Arc cosine, divided by √(1 - x).
pub(super) const ACOS: [f32; 4] = [-0.020_892_033, 0.076_897_38, -0.212_875_19, 1.570_758_3];
/// 2 to the power of a number within 1/2 of 0.
pub(super) const EXP2: [f32; 5] = [0.009_582_853, 0.055_906_426, 0.240_240_99, 0.693_124_2, 1.0];
/// Logarithm to base 2 of 1 plus the argument.
pub(super) const LOG2: [f32; 6] =
    [-0.145_179_3, 0.292_726_73, -0.371_069_28, 0.481_645_58, -0.721_094_55, 1.442_681_6];
/// Hyperbolic sine of a small number.
pub(super) const SINH: [f32; 2] = [0.008_610_608, 0.166_582_14];
/// Sixteenth root of the reciprocal of 1 minus the error function.
pub(super) const ERF: [f32; 7] =
    [4.306_378e-5, 0.000_276_567_2, 0.000_152_014_3, 0.009_270_527, 0.042_282_01, 0.070_523_076, 1.0];
