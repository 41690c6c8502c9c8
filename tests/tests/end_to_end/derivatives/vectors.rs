//! The reference's own derivatives: every row of `fastmath_vectors.csv` whose function ends in `.d`, and
//! those of `filterwidth`, bit for bit, through runs of `Dx` and `Dy`.

use super::case::Case;
use super::measure;
use super::source::Point;
use osl_tests::run;
use std::collections::BTreeMap;
use std::io::Read;

/// Arguments and results of a row: each argument has its value, its derivative along x, and its derivative
/// along y.
type Row = (Vec<f32>, Vec<u32>);

/// The one function whose rows have derivatives only as arguments.
const WIDTH: &str = "filterwidth";

fn rows() -> BTreeMap<String, Vec<Row>> {
    let path = run::root().join("tests/data/fastmath_vectors.csv.gz");
    let mut text = String::new();
    flate2::read::GzDecoder::new(std::fs::File::open(path).unwrap()).read_to_string(&mut text).unwrap();
    let mut rows: BTreeMap<String, Vec<Row>> = BTreeMap::new();
    for line in text.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let width = Some(fields[0]).filter(|function| *function == WIDTH);
        if let Some(function) = fields[0].strip_suffix(".d").or(width) {
            let args = fields[1].split(';').map(|x| x.parse().unwrap()).collect();
            let words = fields[3].split(';').map(|x| u32::from_str_radix(x, 16).unwrap()).collect();
            rows.entry(function.to_string()).or_default().push((args, words));
        }
    }
    rows
}

/// The call of a function, whether its result is a triple, and for each argument the inputs of its
/// components.
fn call(function: &str) -> (String, bool, &'static [&'static [usize]]) {
    let vectors = matches!(function, "dot" | "cross" | "length" | "normalize" | "distance");
    let args: &[&[usize]] = match function {
        "length" | "normalize" => &[&[3, 4, 5]],
        _ if vectors => &[&[0, 1, 2], &[3, 4, 5]],
        "atan2" | "pow" | "fmod" => &[&[9], &[10]],
        "smoothstep" => &[&[9], &[10], &[0]],
        _ => &[&[9]],
    };
    let names = match (vectors, args.len()) {
        (true, 1) => "b",
        (true, _) => "(vector)a, b",
        (_, 1) => "s",
        (_, 2) => "s, t",
        _ => "s, t, a[0]",
    };
    (format!("{function}({names})"), matches!(function, "cross" | "normalize"), args)
}

fn point(values: &[f32], args: &[&[usize]]) -> Point {
    let mut point = Point { x: [0.0; 11], d: [[0.0; 11]; 2] };
    let mut values = values.iter();
    for inputs in args {
        let [dx, dy] = &mut point.d;
        for to in [&mut point.x, dx, dy] {
            for input in *inputs {
                to[*input] = *values.next().unwrap();
            }
        }
    }
    assert!(values.next().is_none());
    point
}

/// Number of rows in which NaN is compared differently: its sign is ignored, and zero times NaN is NaN.
const OTHER_NANS: usize = 3;

/// NaNs are equal, and so are zeros of both signs: a product with zero is omitted, so the sign of a zero
/// derivative has no meaning.
fn same(got: f32, expected: u32) -> bool {
    let expected = f32::from_bits(expected);
    got.to_bits() == expected.to_bits()
        || (got.is_nan() && expected.is_nan())
        || (got == 0.0 && expected == 0.0)
}

/// The failing rows of a call, as text; results start at word `skip`.
fn check(
    code: &str,
    triple: bool,
    args: &[&[usize]],
    rows: &[Row],
    skip: usize,
    other: &mut usize,
) -> Vec<String> {
    let case = Case::zero("vectors", code, triple);
    let points: Vec<Point> = rows.iter().map(|(values, _)| point(values, args)).collect();
    let computed = measure::computed(&case, &points).unwrap();
    let mut wrong = Vec::new();
    for ((values, expected), got) in rows.iter().zip(&computed) {
        let n = if triple { 3 } else { 1 };
        let got: Vec<f32> = got.iter().flat_map(|part| &part[..n]).copied().collect();
        let expected = &expected[skip..][..3 * n];
        let nan = values.iter().any(|x| x.is_nan())
            && ["fabs", "length", "normalize"].iter().any(|f| code.starts_with(f));
        if nan {
            *other += 1;
        } else if !got.iter().zip(expected).all(|(got, expected)| same(*got, *expected)) {
            let expected: Vec<f32> = expected.iter().map(|word| f32::from_bits(*word)).collect();
            wrong.push(format!("{code} of {values:?}: {got:?} rather than {expected:?}"));
        }
    }
    wrong
}

#[test]
fn every_row_with_derivatives_agrees_to_the_bit() {
    let (mut total, mut other, mut wrong) = (0, 0, Vec::new());
    for (function, rows) in rows().into_iter().filter(|(function, _)| function != WIDTH) {
        total += rows.len();
        if function == "sincos" {
            for (code, skip) in [("float x = 0; sincos(s, f, x);", 0), ("float x = 0; sincos(s, x, f);", 3)] {
                wrong.extend(check(code, false, &[&[9]], &rows, skip, &mut other));
            }
        } else {
            let (code, triple, args) = call(&function);
            wrong.extend(check(&code, triple, args, &rows, 0, &mut other));
        }
    }
    let shown: Vec<&String> = wrong.iter().take(40).collect();
    assert!(wrong.is_empty(), "{} differ, such as {shown:#?}", wrong.len());
    assert_eq!((total, other), (1970, OTHER_NANS), "rows with derivatives, and those of them that differ");
}

#[test]
fn every_row_of_widths_agrees_to_the_bit() {
    let rows = rows().remove(WIDTH).unwrap();
    assert_eq!(rows.len(), 20);
    let points: Vec<Point> = rows.iter().map(|(values, _)| point(values, &[&[9]])).collect();
    let computed = measure::computed(&Case::zero("vectors", "filterwidth(s)", false), &points).unwrap();
    for ((values, expected), got) in rows.iter().zip(&computed) {
        assert!(same(got[0][0], expected[0]), "{values:?}: {} for {:x}", got[0][0], expected[0]);
    }
}
