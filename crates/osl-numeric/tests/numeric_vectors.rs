//! Every row of the value forms of `fastmath_vectors.csv`, bit for bit; any NaN matches any other.

#![expect(clippy::expect_used, clippy::panic, reason = "a test ends where its data are not as expected")]

use std::io::Read;
use std::path::Path;

use osl_numeric::{arith, common, geometry, rounding, strict};

struct Row {
    function: String,
    args: Vec<f32>,
    expected: Vec<u32>,
}

fn rows() -> Vec<Row> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/fastmath_vectors.csv.gz");
    let file = std::fs::File::open(path).expect("the vectors are in the repository");
    let mut text = String::new();
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).expect("the vectors are gzipped text");
    text.lines().skip(1).map(row).collect()
}

fn row(line: &str) -> Row {
    let fields: Vec<&str> = line.split(',').collect();
    Row {
        function: fields[0].to_owned(),
        args: fields[1].split(';').map(|word| word.parse().expect("a float")).collect(),
        expected: fields[3].split(';').map(|word| u32::from_str_radix(word, 16).expect("bits")).collect(),
    }
}

fn triple(args: &[f32]) -> [f32; 3] {
    [args[0], args[1], args[2]]
}

fn unary(name: &str) -> Option<fn(f32) -> f32> {
    Some(match name {
        "sin" => strict::sin,
        "cos" => strict::cos,
        "tan" => strict::tan,
        "asin" => strict::asin,
        "acos" => strict::acos,
        "atan" => strict::atan,
        "sinh" => strict::sinh,
        "cosh" => strict::cosh,
        "tanh" => strict::tanh,
        "exp" => strict::exp,
        "exp2" => strict::exp2,
        "exp10" => strict::exp10,
        "expm1" => strict::expm1,
        "log" => strict::log,
        "log2" => strict::log2,
        "log10" => strict::log10,
        "log1p" => strict::log1p,
        "logb" => strict::logb,
        "cbrt" => strict::cbrt,
        "erf" => strict::erf,
        "erfc" => strict::erfc,
        "ierf" => strict::ierf,
        "sinpi" => strict::sinpi,
        "cospi" => strict::cospi,
        "sqrt" => common::sqrt,
        "inversesqrt" => common::inversesqrt,
        "fabs" => common::abs,
        "sign" => common::sign,
        "floor" => rounding::floor,
        "ceil" => rounding::ceil,
        "trunc" => rounding::trunc,
        "round" => rounding::round,
        _ => return None,
    })
}

fn binary(name: &str) -> Option<fn(f32, f32) -> f32> {
    Some(match name {
        "atan2" => strict::atan2,
        "pow" => strict::pow,
        "fmod" => strict::fmod,
        "safe_div" => arith::div,
        "step" => common::step,
        _ => return None,
    })
}

fn compute(name: &str, a: &[f32]) -> Vec<f32> {
    if let Some(f) = unary(name) {
        return vec![f(a[0])];
    }
    if let Some(f) = binary(name) {
        return vec![f(a[0], a[1])];
    }
    match name {
        "sincos" => <[f32; 2]>::from(strict::sincos(a[0])).to_vec(),
        "smoothstep" => vec![common::smoothstep(a[0], a[1], a[2])],
        "length" => vec![geometry::length(triple(a))],
        "normalize" => geometry::normalize(triple(a)).to_vec(),
        "dot" => vec![geometry::dot(triple(a), triple(&a[3..]))],
        "cross" => geometry::cross(triple(a), triple(&a[3..])).to_vec(),
        "distance" => vec![geometry::distance(triple(a), triple(&a[3..]))],
        _ => panic!("no body for {name}"),
    }
}

fn same(got: f32, expected: u32) -> bool {
    got.to_bits() == expected || (got.is_nan() && f32::from_bits(expected).is_nan())
}

/// Whether a row belongs to a body alone: derivatives, and what is made of them, need a run.
fn is_value(function: &str) -> bool {
    !function.ends_with(".d") && function != "filterwidth"
}

#[test]
fn every_value_row_agrees_to_the_bit() {
    let mut n_checked = 0;
    let mut wrong = Vec::new();
    for row in rows().into_iter().filter(|row| is_value(&row.function)) {
        let got = compute(&row.function, &row.args);
        n_checked += 1;
        let agrees = got.len() == row.expected.len()
            && got.iter().zip(&row.expected).all(|(&value, &bits)| same(value, bits));
        if !agrees {
            wrong.push(format!("{}{:?}: {got:?}, expected {:x?}", row.function, row.args, row.expected));
        }
    }
    let shown: Vec<_> = wrong.iter().take(20).collect();
    assert!(wrong.is_empty(), "{} of {n_checked} rows differ, such as {shown:#?}", wrong.len());
    assert!(n_checked > 9_000, "only {n_checked} rows: the file is not the one expected");
}
