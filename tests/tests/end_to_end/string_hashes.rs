//! Compares hashes of strings with the reference's, through a shader: the rows `hash_string` of the noise
//! vectors.

use osl_exec::RunOptions;
use osl_scene::Grid;
use osl_tests::run;
use std::io::Read;

#[test]
fn every_row() {
    let file = std::fs::File::open(run::root().join("tests/data/noise_vectors.csv.gz")).unwrap();
    let mut text = String::new();
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).unwrap();
    let shader = "shader s(string t = \"\", output int known = 0, output int found = 0) {
        known = hash(t); found = hash(concat(t, substr(t, 0, u > 2))); }";
    let mut rows = 0;
    for line in text.lines().filter(|line| line.starts_with("hash_string,")) {
        let cells: Vec<&str> = line.split(',').collect();
        let (string, expected) = (cells[2], u32::from_str_radix(cells[4], 16).unwrap());
        let params = [("t".to_string(), string.to_string())];
        let frame = run::run("s", shader, &params, &Grid::new(2, 1), &RunOptions::default()).unwrap();
        for plane in &frame.planes {
            assert_eq!(plane.words[..], [expected; 2], "{} of {string:?}", plane.output);
        }
        rows += 1;
    }
    assert_eq!(rows, 41);
}
