//! Every row of the reference's noise vectors that this crate covers, bit for bit.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use flate2::read::GzDecoder;
use osl_noise::{Isa, Kind, eval, eval_dual, eval_periodic, eval3, eval3_dual, eval3_periodic, hash};
use std::io::Read;

fn rows() -> Vec<Vec<String>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/noise_vectors.csv.gz");
    let mut text = String::new();
    GzDecoder::new(std::fs::File::open(path).expect("vectors")).read_to_string(&mut text).expect("text");
    text.lines().skip(1).map(|l| l.split(',').map(str::to_string).collect()).collect()
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

#[test]
fn fields_match_every_row() {
    let (mut checked, mut platform) = (0, 0);
    let mut wrong = Vec::new();
    for row in rows() {
        let args: Vec<f32> = row[2].split(' ').filter_map(|a| a.parse().ok()).collect();
        for isa in Isa::all() {
            let Some(got) = result(isa, &row[0], row[1] == "triple", &args) else { continue };
            let expected: Vec<u32> =
                row[4].split(' ').map(|b| u32::from_str_radix(b, 16).expect("bits")).collect();
            let same = got.len() == expected.len()
                && got
                    .iter()
                    .zip(&expected)
                    .all(|(g, e)| g.to_bits() == *e || (g.is_nan() && f32::from_bits(*e).is_nan()));
            if row[5] == "platform" {
                platform += usize::from(!same);
                continue;
            }
            checked += 1;
            if !same {
                wrong.push(format!("{isa:?} {row:?} got {got:?}"));
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "{} of {checked} wrong:\n{}",
        wrong.len(),
        wrong[..wrong.len().min(20)].join("\n")
    );
    assert!(checked >= 5000, "{checked} rows");
    // Rows that depend on the platform: ours follow the same out-of-range rule, but for partials that are undefined.
    assert!(platform <= 60, "{platform} platform rows differ");
}

#[test]
fn words_match_every_row() {
    let mut checked = 0;
    for row in rows().iter().filter(|r| r[0] == "inthash") {
        let w: Vec<u32> = row[2].split(' ').map(|a| a.parse().expect("word")).collect();
        let got = match w.as_slice() {
            [a] => hash::hash([*a]),
            [a, b] => hash::hash([*a, *b]),
            [a, b, c] => hash::hash([*a, *b, *c]),
            [a, b, c, d] => hash::hash([*a, *b, *c, *d]),
            [a, b, c, d, e] => hash::hash([*a, *b, *c, *d, *e]),
            _ => continue,
        };
        assert_eq!(format!("{got:08x}"), row[4]);
        checked += 1;
    }
    assert_eq!(checked, 200);
}
