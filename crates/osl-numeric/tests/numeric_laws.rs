//! Laws of the arithmetic for all numbers: agreement with the standard library where that is exact, ranges,
//! inverses.

#![expect(clippy::excessive_precision, reason = "measured values are written with the digits they came with")]

use osl_numeric::{arith, color, common, geometry, matrix, rounding, strict};
use proptest::prelude::*;

/// Floats of every exponent, both zeros, infinities, NaN: a stride through all bit patterns, coprime to 2^32.
fn sampled_floats() -> impl Iterator<Item = f32> {
    (0..=u32::MAX).step_by(1_021).map(f32::from_bits)
}

/// Floats around the whole and half numbers at which rounding changes.
fn near_halves() -> impl Iterator<Item = f32> {
    let exact = (-4_000..4_000).map(|n| n as f32 * 0.5);
    let large =
        (0..64).flat_map(|n| [4_194_303.0 + n as f32 * 0.5, 8_388_600.0 + n as f32, 2e9 + n as f32 * 1e8]);
    exact.chain(large.flat_map(|x| [x, -x])).flat_map(|x: f32| [x.next_down(), x, x.next_up()])
}

fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

#[test]
fn rounding_agrees_with_the_standard_library() {
    for x in sampled_floats().chain(near_halves()).chain([0.0, -0.0, 0.499_999_97, f32::INFINITY, f32::NAN]) {
        assert!(same(rounding::floor(x), x.floor()), "floor({x:?})");
        assert!(same(rounding::ceil(x), x.ceil()), "ceil({x:?})");
        assert!(same(rounding::trunc(x), x.trunc()), "trunc({x:?})");
        assert!(same(rounding::round(x), x.round()), "round({x:?})");
        let fits = (-2_147_483_648.0..2_147_483_648.0).contains(&x);
        assert_eq!(rounding::trunc32(x), if fits { x as i32 } else { i32::MIN }, "trunc32({x:?})");
    }
}

#[test]
fn accurate_power_is_within_one_unit() {
    for i in 0..200_000_u32 {
        let x = f32::from_bits(0x3a00_0000 + i * 419);
        for y in [2.4_f32, 1.0 / 2.4, -1.7, 0.2, 5.0] {
            let exact = f64::from(x).powf(f64::from(y)) as f32;
            let off = strict::pow_accurate(x, y).to_bits().abs_diff(exact.to_bits());
            assert!(off <= 1, "{x:?} to the power of {y:?} is off by {off}");
        }
    }
    assert_eq!(strict::pow_accurate(1.0, 2.4), 1.0);
}

#[test]
fn integer_division_at_the_corners() {
    assert_eq!(arith::int_div(i32::MIN, -1), i32::MIN);
    assert_eq!(arith::int_rem(i32::MIN, -1), 0);
    assert_eq!((arith::int_div(3, 0), arith::int_rem(3, 0)), (0, 0));
    assert_eq!((arith::int_div(-7, 2), arith::int_rem(-7, 3)), (-3, -1));
    assert_eq!(arith::int_div(i32::MAX, i32::MAX - 1), 1);
    assert_eq!(arith::int_div(i32::MAX - 1, i32::MAX), 0);
    assert_eq!((arith::shl(1, 31), arith::shl(1, 33), arith::shr(-8, 1)), (i32::MIN, 2, -4));
}

#[test]
fn comparisons_with_nan_all_hold() {
    for (a, b) in [(f32::NAN, 1.0), (1.0, f32::NAN), (f32::NAN, f32::NAN)] {
        assert!(arith::lt(a, b) && arith::le(a, b) && arith::gt(a, b) && arith::ge(a, b));
        assert!(arith::eq(a, b) && arith::ne(a, b));
    }
    assert!(common::min(f32::NAN, 1.0).is_nan() && common::min(1.0, f32::NAN) == 1.0);
    assert!(common::max(f32::NAN, 1.0).is_nan() && common::max(1.0, f32::NAN) == 1.0);
    assert!(common::clamp(f32::NAN, 0.0, 1.0).is_nan());
    assert_eq!(common::clamp(0.5, f32::NAN, 1.0), 0.5);
}

fn close(got: [f32; 3], expected: [f32; 3]) -> bool {
    got.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 3e-7 * b.abs().max(1.0))
}

/// Values of the language's appendix, measured on the reference.
#[test]
fn check_values_of_geometry_and_color() {
    let (x, y) = (2.3_f32, 0.3_f32);
    let incident = geometry::normalize([x, y, -1.0]);
    let up = [0.0, 0.0, 1.0];
    assert_eq!(geometry::reflect([x, y, -1.0], up), [x, y, 1.0]);
    assert!(close(geometry::refract(incident, up, 0.75), [0.682_934_1, 0.089_078_366, -0.725_028_3]));
    assert_eq!(geometry::refract(geometry::normalize([x, y, -0.1]), up, 1.5), [0.0; 3]);
    assert_eq!(geometry::faceforward(up, [x, y, 1.0], up), [-0.0, -0.0, -1.0]);

    let rec709 = color::ColorSystem::rec709();
    assert_eq!(
        rec709.rgb_from_xyz,
        [
            3.242_979_3,
            -0.968_997_7,
            0.055_668_347,
            -1.538_336_4,
            1.875_491_6,
            -0.204_117_15,
            -0.498_919_93,
            0.041_544_538,
            1.057_698_3
        ]
    );
    assert_eq!(
        rec709.xyz_from_rgb,
        [
            0.412_135_27,
            0.212_507_23,
            0.019_318_823,
            0.357_675_08,
            0.715_350_15,
            0.119_224_966,
            0.180_356_79,
            0.072_142_705,
            0.949_879_05
        ]
    );
    assert_eq!(rec709.luminance_of([x, y, 1.0]), 0.775_514_3);
    assert_eq!(color::rgb_to_hsv([0.1 * x, y, 0.5]), [0.623_456_8, 0.539_999_96, 0.5]);
    assert_eq!(color::hsv_to_rgb([x, y, 0.5]), [0.380_000_05, 0.5, 0.349_999_99]);
    assert_eq!(color::xyz_to_xyy(rec709.to_xyz([x, y, 0.5])), [0.469_427_7, 0.303_053_5, 0.739_443_06]);
    assert_eq!([y, x, 0.01].map(color::srgb_to_linear::<f32>), [0.073_238_97, 6.870_246_9, 0.000_773_993_8]);
    assert_eq!(color::hsl_to_rgb([y, 0.4, 0.6]), [0.504, 0.76, 0.440_000_03]);
    assert_eq!(color::yiq_to_rgb([y, 0.4, 0.6]), [1.054_22, -0.196_780_03, 0.879_780_1]);
    assert_eq!(rec709.to_rgb(color::xyy_to_xyz([y, 0.4, 0.6])), [0.311_824_86, 0.707_941_1, 0.378_544_66]);
    assert_eq!(rec709.to_rgb([y, 0.4, 0.6]), [0.058_207_303, 0.484_424_03, 0.569_672_64]);
}

#[test]
fn check_values_of_small_functions() {
    let (x, y) = (2.3_f32, 0.3_f32);
    assert_eq!(common::linearstep(0.2, 1.0, y), 0.125_000_015);
    assert!(same(common::linearstep(1.0, 0.0, y), -0.0));
    assert_eq!(common::modulo(x, 0.7), 0.200_000_05);
    assert_eq!((common::modulo(-x, 0.7), common::modulo(x, -0.7), common::modulo(x, 0.0)), (0.5, -0.5, x));
    assert_eq!(common::mix(x, y, 0.25), 1.8);
    assert_eq!((common::select(1.0, 2.0, 0.0), common::select(1.0, 2.0, -1.0)), (1.0, 2.0));
    let projective = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(matrix::transform_point(projective, [x, y, 2.0]), [1.15, 0.15, 1.0]);
}

#[test]
fn singular_matrices_invert_to_the_identity() {
    let identity = matrix::diagonal(1.0_f32);
    assert_eq!(matrix::inverse([0.0_f32; 16]), identity);
    assert_eq!(matrix::inverse([1.0_f32; 16]), identity);
    let flat = [1.0, 2.0, 3.0, 0.0, 2.0, 4.0, 6.0, 0.0, 1.0, 0.0, 1.0, 0.0, 5.0, 6.0, 7.0, 1.0];
    assert_eq!(matrix::inverse(flat), identity);
}

/// The inverse of a matrix step by step, with a row exchanged only where that is needed; `None` if there is
/// none.
fn inverse_by_steps(m: [f32; 16]) -> Option<[f32; 16]> {
    let mut rows: [[f32; 8]; 4] = std::array::from_fn(|row| {
        std::array::from_fn(|at| if at < 4 { m[4 * row + at] } else { f32::from(u8::from(at == row + 4)) })
    });
    for column in 0..4 {
        let mut pivot = column;
        for row in column + 1..4 {
            if rows[row][column].abs() > rows[pivot][column].abs() {
                pivot = row;
            }
        }
        if rows[pivot][column] == 0.0 {
            return None;
        }
        rows.swap(pivot, column);
        for row in column + 1..4 {
            let factor = rows[row][column] / rows[column][column];
            let taken = rows[column];
            rows[row].iter_mut().zip(taken).for_each(|(x, taken)| *x -= factor * taken);
        }
    }
    for column in (0..4).rev() {
        let pivot = rows[column][column];
        rows[column].iter_mut().for_each(|x| *x /= pivot);
        for row in 0..column {
            let factor = rows[row][column];
            let taken = rows[column];
            rows[row].iter_mut().zip(taken).for_each(|(x, taken)| *x -= factor * taken);
        }
    }
    Some(std::array::from_fn(|at| rows[at / 4][4 + at % 4]))
}

#[test]
fn all_cases_of_the_inverse_have_the_bits_of_its_steps() {
    let mut state = 7_u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state >> 8
    };
    let (mut regular, mut singular) = (0, 0);
    for round in 0..20_000 {
        let m: [f32; 16] = std::array::from_fn(|_| match (round % 5, next() % 8) {
            // Zeros, equal magnitudes, and what is no number.
            (1, 0..4) => 0.0,
            (2, n) => n as f32 - 4.0,
            (3, 0) => [f32::INFINITY, f32::NAN, -0.0, 1e-40][next() as usize % 4],
            _ => next() as f32 / 4_194_304.0 - 2.0,
        });
        if (m[3], m[7], m[11], m[15]) == (0.0, 0.0, 0.0, 1.0) {
            continue;
        }
        let steps = inverse_by_steps(m);
        if steps.is_some() {
            regular += 1
        } else {
            singular += 1
        }
        let expected = steps.unwrap_or(matrix::diagonal(1.0));
        for (got, expected) in matrix::inverse(m).into_iter().zip(expected) {
            assert!(same(got, expected), "{got:e} for {expected:e} in {m:?}");
        }
    }
    assert!(regular > 10_000 && singular > 100, "{regular} {singular}");
}

fn any_float() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits)
}

fn triples(limit: f32) -> impl Strategy<Value = [f32; 3]> {
    prop::array::uniform3(-limit..limit)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 512, ..ProptestConfig::default() })]
    #[test]
    fn division_is_always_finite(a in any_float(), b in any_float()) {
        prop_assert!(arith::div(a, b).is_finite());
    }

    #[test]
    fn integer_division_is_that_of_the_language(a in any::<i32>(), b in any::<i32>(), shift in 0_u32..31) {
        for b in [b, b >> shift, (b >> shift).wrapping_neg()] {
            prop_assert_eq!(arith::int_div(a, b), if b == 0 { 0 } else { a.wrapping_div(b) });
            prop_assert_eq!(arith::int_rem(a, b), if b == 0 { 0 } else { a.wrapping_rem(b) });
        }
    }

    #[test]
    fn smoothstep_is_a_ratio(edge0 in -10.0_f32..10.0, edge1 in -10.0_f32..10.0, x in -20.0_f32..20.0) {
        let s = common::smoothstep(edge0, edge1, x);
        prop_assert!((0.0..=1.0).contains(&s), "{}", s);
        prop_assert_eq!(common::smoothstep(edge0, edge0, x), common::step(edge0, x));
    }

    #[test]
    fn elementary_functions_of_numbers_are_numbers(x in any_float(), y in any_float()) {
        prop_assume!(x.is_finite() && y.is_finite());
        for value in [
            strict::sin(x), strict::cos(x), strict::asin(x), strict::acos(x), strict::atan(x),
            strict::atan2(x, y), strict::sinh(x), strict::cosh(x), strict::tanh(x), strict::exp(x),
            strict::log(x), strict::pow(x, y), strict::cbrt(x), strict::erf(x), common::sqrt(x),
            common::inversesqrt(x),
        ] {
            prop_assert!(value.is_finite(), "{} {}: {}", x, y, value);
        }
        prop_assert!(strict::sin(x).abs() <= 1.0 && strict::cos(x).abs() <= 1.0);
    }

    #[test]
    fn normalized_vectors_have_length_one_or_zero(v in prop::array::uniform3(any_float())) {
        let length = geometry::length(geometry::normalize(v));
        // Outside this range the squares lose bits or overflow, and the reference guarantees only
        // termination.
        let in_range = v.iter().any(|x| x.abs() > 1e-18) && v.iter().all(|x| x.abs() < 1e18);
        prop_assert!(!in_range || (length - 1.0).abs() < 1e-6, "length {}", length);
        prop_assert_eq!(geometry::normalize([0.0, -0.0, v[0] * 0.0]), [0.0; 3]);
    }

    #[test]
    fn lengths_agree_where_no_rescue_is_needed(v in triples(100.0)) {
        prop_assume!(geometry::dot(v, v) >= 2.0 * f32::MIN_POSITIVE);
        prop_assert_eq!(geometry::length(v), geometry::length_unrescued(v));
    }

    #[test]
    fn hsv_and_hsl_come_back(r in 0.0_f32..1.0, g in 0.0_f32..1.0, b in 0.0_f32..1.0) {
        let rgb = [r, g, b];
        for back in [color::hsv_to_rgb(color::rgb_to_hsv(rgb)), color::hsl_to_rgb(color::rgb_to_hsl(rgb))] {
            // A saturation below 0.0001 counts as gray, which explains the tolerance.
            prop_assert!(back.iter().zip(rgb).all(|(x, y)| (x - y).abs() < 1.1e-4), "{:?}", back);
        }
        let srgb = rgb.map(color::linear_to_srgb::<f32>).map(color::srgb_to_linear::<f32>);
        prop_assert!(srgb.iter().zip(rgb).all(|(x, y)| (x - y).abs() < 1e-5), "{:?}", srgb);
    }

    #[test]
    fn hsv_is_the_textbook_case_by_case(h in -3.0_f32..3.0, s in 0.0_f32..1.0, v in 0.0_f32..2.0) {
        let turn = 6.0 * (h - h.floor());
        let k = turn.floor();
        let f = turn - k;
        let (p, q, t) = (v * (1.0 - s), v * (1.0 - s * f), v * (1.0 - s * (1.0 - f)));
        let expected = match (s < 0.0001, k as i32) {
            (true, _) => [v, v, v],
            (_, 0) => [v, t, p],
            (_, 1) => [q, v, p],
            (_, 2) => [p, v, t],
            (_, 3) => [p, q, v],
            (_, 4) => [t, p, v],
            _ => [v, p, q],
        };
        prop_assert_eq!(color::hsv_to_rgb([h, s, v]), expected);
    }

    #[test]
    fn inverse_undoes(rows in prop::array::uniform16(-1.0_f32..1.0), affine in any::<bool>()) {
        let mut m = rows;
        for i in 0..4 {
            m[5 * i] += 3.0;
        }
        if affine {
            (m[3], m[7], m[11], m[15]) = (0.0, 0.0, 0.0, 1.0);
        }
        let product = matrix::multiply(m, matrix::inverse(m));
        for (got, expected) in product.iter().zip(matrix::diagonal(1.0_f32)) {
            prop_assert!((got - expected).abs() < 1e-4, "{:?}", product);
        }
        let both = matrix::determinant(m) * matrix::determinant(matrix::inverse(m));
        prop_assert!((both - 1.0).abs() < 1e-3, "{}", both);
    }
}
