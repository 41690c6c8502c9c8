//! Every row of the reference's noise vectors except the string hash: bit for bit; Gabor noise within a
//! tolerance.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use flate2::read::GzDecoder;
use osl_noise::{Kind, eval, eval_dual, eval_periodic, eval3, eval3_dual, eval3_periodic, gabor, hash};
use osl_simd::Isa;
use std::io::Read;

/// The test that reads a row.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Reader {
    /// Cell to simplex noise.
    Field,
    Gabor,
    /// Hashes of words and of floats.
    Words,
    /// Hashes of text, which no noise takes and this crate does not have.
    Text,
}

struct Row {
    /// Function, result type, arguments, expected numbers, their words, options.
    cells: Vec<String>,
    reader: Reader,
}

impl Row {
    fn args(&self) -> Vec<f32> {
        self.cells[2].split(' ').map(|a| a.parse().expect("number")).collect()
    }

    fn expected(&self) -> Vec<u32> {
        self.cells[4].split(' ').map(|b| u32::from_str_radix(b, 16).expect("bits")).collect()
    }

    fn triple(&self) -> bool {
        self.cells[1] == "triple"
    }

    /// The reference's result depends on the processor on which it ran.
    fn platform(&self) -> bool {
        self.cells[5] == "platform"
    }
}

fn all_rows() -> Vec<Row> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/noise_vectors.csv.gz");
    let mut text = String::new();
    GzDecoder::new(std::fs::File::open(path).expect("vectors")).read_to_string(&mut text).expect("text");
    text.lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<String> = line.split(',').map(str::to_string).collect();
            assert_eq!(cells.len(), 6, "{line}");
            let reader = match cells[0].as_str() {
                "inthash" | "hash_int" | "hash_float" => Reader::Words,
                "hash_string" => Reader::Text,
                "gabor" | "pgabor" | "d_gabor" | "d_pgabor" => Reader::Gabor,
                name => {
                    let plain = name.strip_prefix("d_").unwrap_or(name);
                    let known = field(plain).or_else(|| field(plain.strip_prefix('p')?));
                    assert!(known.is_some(), "no test reads {line}");
                    Reader::Field
                }
            };
            Row { cells, reader }
        })
        .collect()
}

fn rows(reader: Reader) -> Vec<Row> {
    all_rows().into_iter().filter(|r| r.reader == reader).collect()
}

fn same(got: f32, expected: u32) -> bool {
    got.to_bits() == expected || (got.is_nan() && f32::from_bits(expected).is_nan())
}

fn field(name: &str) -> Option<Kind> {
    Some(match name {
        "cell" => Kind::Cell,
        "hash" => Kind::Hash,
        "perlin" => Kind::Perlin,
        "uperlin" => Kind::UPerlin,
        "simplex" => Kind::Simplex,
        "usimplex" => Kind::USimplex,
        _ => return None,
    })
}

/// The result of a row for one instruction set, or `None` for rows of other functions.
fn result(isa: Isa, function: &str, triple: bool, args: &[f32]) -> Option<Vec<f32>> {
    let (dual, rest) = function.strip_prefix("d_").map_or((false, function), |r| (true, r));
    let (kind, periodic) = match field(rest) {
        Some(kind) => (kind, false),
        None => (field(rest.strip_prefix('p')?)?, true),
    };
    let slices: Vec<&[f32]> = args.iter().map(std::slice::from_ref).collect();
    let dims = args.len() / (if dual { 3 } else { 1 } + usize::from(periodic));
    let (coords, periods) = slices.split_at(if dual { 3 * dims } else { dims });
    let mut out = vec![0.0_f32; if dual { 3 } else { 1 } * if triple { 3 } else { 1 }];
    {
        let mut o = out.chunks_mut(1);
        let mut next = || o.next().expect("room");
        match (dual, triple, periodic) {
            (false, false, false) => eval(isa, kind, coords, next()),
            (false, true, false) => eval3(isa, kind, coords, [next(), next(), next()]),
            (false, false, true) => eval_periodic(isa, kind, coords, periods, next()),
            (false, true, true) => eval3_periodic(isa, kind, coords, periods, [next(), next(), next()]),
            (true, false, _) => eval_dual(isa, kind, coords, periods, [next(), next(), next()]),
            (true, true, _) => eval3_dual(isa, kind, coords, periods, std::array::from_fn(|_| next())),
        }
    }
    Some(out)
}

/// The options of a row of Gabor noise.
fn options(text: &str) -> gabor::Options {
    let mut options = gabor::Options::default();
    for pair in text.split(';').filter(|p| !p.is_empty() && *p != "platform") {
        let (token, value) = pair.split_once('=').expect("token and value");
        let numbers: Vec<f32> = value.split(' ').map(|n| n.parse().expect("number")).collect();
        match token {
            "anisotropic" => options.anisotropic = value.parse().expect("integer"),
            "direction" => options.direction = numbers.try_into().expect("three numbers"),
            "bandwidth" => options.bandwidth = numbers[0],
            "impulses" => options.impulses = numbers[0],
            "do_filter" => options.do_filter = value != "0",
            _ => panic!("unknown option {pair}"),
        }
    }
    options
}

fn gabor_result(isa: Isa, row: &Row) -> Vec<f32> {
    let (name, args) = (row.cells[0].as_str(), row.args());
    let (dual, periodic) = (name.starts_with("d_"), name.contains("pgabor"));
    let slices: Vec<&[f32]> = args.iter().map(std::slice::from_ref).collect();
    let dims = args.len() / (if dual { 3 } else { 1 } + usize::from(periodic));
    let (coords, rest) = slices.split_at(dims);
    let (partials, periods) = rest.split_at(if dual { 2 * dims } else { 0 });
    let points = gabor::Points { coords, partials, periods };
    let options = [options(&row.cells[5])];
    let mut out = vec![0.0_f32; if dual { 3 } else { 1 } * if row.triple() { 3 } else { 1 }];
    let mut o = out.chunks_mut(1);
    let mut next = || o.next().expect("room");
    match (dual, row.triple()) {
        (false, false) => gabor::eval(isa, points, &options, next()),
        (false, true) => gabor::eval3(isa, points, &options, [next(), next(), next()]),
        (true, false) => gabor::eval_dual(isa, points, &options, [next(), next(), next()]),
        (true, true) => gabor::eval3_dual(isa, points, &options, std::array::from_fn(|_| next())),
    }
    if dual {
        // Computed without partials, the values are the same.
        let mut values = [[f32::NAN]; 3];
        let [x, y, z] = &mut values;
        gabor::eval3(isa, points, &options, [x, y, z]);
        let n = out.len() / 3;
        assert!(values.iter().zip(&out[..n]).all(|(v, o)| same(v[0], o.to_bits())), "{:?}", row.cells);
    }
    out
}

#[test]
fn no_row_is_left_unread() {
    let rows = all_rows();
    let count = |reader| rows.iter().filter(|r| r.reader == reader).count();
    let readers = [Reader::Field, Reader::Gabor, Reader::Words, Reader::Text];
    assert_eq!(readers.map(count), [FIELDS, GABORS, WORDS, 41]);
    assert_eq!(rows.len(), FIELDS + GABORS + WORDS + 41);
}

const FIELDS: usize = 7660;
const GABORS: usize = 1842;
const WORDS: usize = 268;

#[test]
fn gabor_matches_every_row() {
    // The reference takes exp, sin and cos from a library, whose last bits depend on the platform.
    const TOLERANCE: f32 = 2e-6;
    let (mut exact, mut numbers, mut worst) = (0, 0, 0.0_f32);
    for row in rows(Reader::Gabor) {
        let expected: Vec<f32> = row.expected().into_iter().map(f32::from_bits).collect();
        let dual = row.cells[0].starts_with("d_");
        let n_values = if dual { expected.len() / 3 } else { expected.len() };
        let steepest = expected[n_values..].iter().fold(0.0_f32, |m, p| m.max(p.abs()));
        let results: Vec<Vec<f32>> = Isa::all().into_iter().map(|isa| gabor_result(isa, &row)).collect();
        for got in &results {
            assert_eq!(got.len(), expected.len());
            for (i, (g, e)) in got.iter().zip(&expected).enumerate() {
                assert!(same(*g, results[0][i].to_bits()), "instruction sets differ: {:?}", row.cells);
                let size = if i < n_values { e.abs() } else { steepest };
                let error = if same(*g, e.to_bits()) { 0.0 } else { (g - e).abs() / (1.0 + size) };
                // Written such that NaN fails.
                assert!(error <= TOLERANCE, "{:?} got {got:?}", row.cells);
                worst = worst.max(error);
                exact += usize::from(error == 0.0);
                numbers += 1;
            }
        }
    }
    // Errors stay far inside the tolerance, because the reference's library rounds nearly as well as this
    // one.
    assert!(worst < 1e-7 && exact * 100 > numbers * 95, "{exact} of {numbers} exact, worst error {worst:e}");
}

/// Rows whose results depend on the reference's platform are no exception: values out of range give the same
/// lattice cell, and NaN the same word, as where the reference ran, on every machine.
#[test]
fn fields_match_every_row() {
    let mut platform = 0;
    let mut wrong = Vec::new();
    for row in rows(Reader::Field) {
        let (args, expected) = (row.args(), row.expected());
        platform += usize::from(row.platform());
        for isa in Isa::all() {
            let got = result(isa, &row.cells[0], row.triple(), &args).expect("a field");
            if got.len() != expected.len() || !got.iter().zip(&expected).all(|(g, e)| same(*g, *e)) {
                wrong.push(format!("{isa:?} {:?} got {got:?}", row.cells));
            }
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong[..wrong.len().min(20)].join("\n"));
    assert_eq!(platform, 1040, "rows that the vectors mark as platform-dependent");
}

#[test]
fn words_match_every_row() {
    for row in rows(Reader::Words) {
        let args = row.cells[2].split(' ');
        let words: Vec<u32> = match row.cells[0].as_str() {
            "inthash" => args.map(|a| a.parse().expect("word")).collect(),
            "hash_int" => args.map(|a| a.parse::<i32>().expect("integer") as u32).collect(),
            _ => args.map(|a| a.parse::<f32>().expect("number").to_bits()).collect(),
        };
        let got = match words.as_slice() {
            [a] => hash::hash([*a]),
            [a, b] => hash::hash([*a, *b]),
            [a, b, c] => hash::hash([*a, *b, *c]),
            [a, b, c, d] => hash::hash([*a, *b, *c, *d]),
            [a, b, c, d, e] => hash::hash([*a, *b, *c, *d, *e]),
            _ => panic!("{:?}", row.cells),
        };
        assert_eq!(format!("{got:08x}"), row.cells[4], "{:?}", row.cells);
    }
}
