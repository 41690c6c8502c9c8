//! Coordinates far beyond the lattice: every instruction set and batch length gives the same bits.

#![allow(missing_docs, reason = "a test says what must hold")]

use osl_noise::{Kind, eval};
use osl_simd::Isa;

#[test]
fn the_same_bits_however_many_points_there_are() {
    let coordinates = [1e38_f32, -1e38, 1e30, -1e30, 3e9, -3e9, 2147483648.0, -2147483648.0, 1e10, 0.3];
    let mut wrong = Vec::new();
    for kind in [Kind::UPerlin, Kind::Perlin, Kind::Cell, Kind::Hash, Kind::Simplex, Kind::USimplex] {
        for dimensions in 1..=4_usize {
            let step = if dimensions == 4 { 97 } else { 1 };
            for at in (0..10_usize.pow(dimensions as u32)).step_by(step) {
                let point: Vec<f32> =
                    (0..dimensions).map(|axis| coordinates[at / 10_usize.pow(axis as u32) % 10]).collect();
                let mut all = Vec::new();
                for isa in Isa::all() {
                    for n in [1, 6, 16, 40] {
                        let slices: Vec<Vec<f32>> = point.iter().map(|x| vec![*x; n]).collect();
                        let slices: Vec<&[f32]> = slices.iter().map(Vec::as_slice).collect();
                        let mut out = vec![0.0; n];
                        eval(isa, kind, &slices, &mut out);
                        all.extend(
                            out.iter().map(|x| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() }),
                        );
                    }
                }
                if all.iter().any(|bits| *bits != all[0]) {
                    wrong.push((kind, point));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} points, such as {:?}", wrong.len(), &wrong[..wrong.len().min(5)]);
}
