//! Constants of the library that are not exactly floats.
//!
//! Single precision uses the nearest float for each (for [`LibraryConstant::Degrees`] the reference's, one
//! unit below), and double precision the constant itself. Constants in a shader's text are not among them:
//! they are floats in every arithmetic.

use super::{Number, Real};

macro_rules! library_constants {
    ($($name:ident $single:expr, $exact:expr;)*) => {
        /// A constant of the library.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[expect(missing_docs, reason = "the table says what they are")]
        pub enum LibraryConstant { $($name),* }

        /// The single-precision value and the exact value of each.
        const TABLE: &[(f32, f64)] = &[$(($single, $exact)),*];
    };
}

library_constants! {
    Ln2 std::f32::consts::LN_2, std::f64::consts::LN_2;
    Ln10 std::f32::consts::LN_10, std::f64::consts::LN_10;
    TwoOverRootPi std::f32::consts::FRAC_2_SQRT_PI, std::f64::consts::FRAC_2_SQRT_PI;
    MinusTwoOverRootPi -std::f32::consts::FRAC_2_SQRT_PI, -std::f64::consts::FRAC_2_SQRT_PI;
    Degrees f32::from_bits(0x4265_2ee0), 180.0 / std::f64::consts::PI;
    Radians f32::from_bits(0x3c8e_fa35), std::f64::consts::PI / 180.0;
    Sixth 1.0 / 6.0, 1.0 / 6.0;
    MinusSixth -1.0 / 6.0, -1.0 / 6.0;
    TwoThirds 4.0 / 6.0, 4.0 / 6.0;
    // For the transfer curve of sRGB (IEC 61966-2-1), and for its derivatives.
    SrgbOffset 0.055, 0.055;
    SrgbScale 1.0 / 1.055, 1.0 / 1.055;
    SrgbPower 1.4, 1.4;
    SrgbFactor 2.4 / 1.055, 2.4 / 1.055;
    SrgbStraight 1.0 / 12.92, 1.0 / 12.92;
    SrgbEdge 0.04045, 0.04045;
    LinearPower 1.0 / 2.4 - 1.0, 1.0 / 2.4 - 1.0;
    LinearFactor 1.055 / 2.4, 1.055 / 2.4;
    LinearStraight 12.92, 12.92;
    LinearEdge 0.003_130_8, 0.003_130_8;
}

/// The constant with a number, as in [`LibraryConstant`]; 0 for any other number.
#[inline(always)]
pub fn of<R: Real>(number: R::Int) -> R {
    R::by_value([number], [], |[number], []| {
        let found = usize::try_from(number).ok().and_then(|at| TABLE.get(at));
        [found.map_or(Number::lit(0.0), |(single, exact)| Number::known(*single, *exact))]
    })[0]
}
