//! Laws of the fields: the same bits in every batch and instruction set, plausible values everywhere, correct
//! gradients.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl_noise::{Kind, eval, eval_dual, eval3};
use osl_simd::Isa;
use proptest::prelude::*;

fn any_coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => -1000.0f32..1000.0,
        1 => any::<f32>(),
        1 => prop_oneof![Just(0.0f32), Just(-0.0), Just(f32::INFINITY), Just(f32::NAN), Just(-1e-30), Just(3e9)],
    ]
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|v| if v.is_nan() { 0x7fc0_0000 } else { v.to_bits() }).collect()
}

proptest! {
    #[test]
    fn a_batch_is_its_points(points in prop::collection::vec(prop::array::uniform4(any_coordinate()), 1..70)) {
        let column = |a: usize| points.iter().map(|p| p[a]).collect::<Vec<f32>>();
        let columns: Vec<Vec<f32>> = (0..4).map(column).collect();
        for kind in Kind::ALL {
            for dims in 1..=4 {
                let coords: Vec<&[f32]> = columns[..dims].iter().map(Vec::as_slice).collect();
                let mut singles = vec![0.0; points.len()];
                for (i, single) in singles.iter_mut().enumerate() {
                    let one: Vec<&[f32]> = coords.iter().map(|c| &c[i..=i]).collect();
                    eval(Isa::baseline(), kind, &one, std::slice::from_mut(single));
                }
                for isa in Isa::all() {
                    let mut out = vec![0.0; points.len()];
                    eval(isa, kind, &coords, &mut out);
                    prop_assert_eq!(bits(&out), bits(&singles), "{:?} {} {:?}", kind, dims, isa);
                    let (mut x, mut y, mut z) = (out.clone(), out.clone(), out.clone());
                    eval3(isa, kind, &coords, [&mut x, &mut y, &mut z]);
                    // The first value of the triple of a smooth field equals the float form; cell and hash
                    // noise share nothing with it.
                    if !matches!(kind, Kind::Cell | Kind::Hash) {
                        prop_assert_eq!(bits(&x), bits(&singles));
                    }
                }
            }
        }
    }

    /// Points of a patch share the data of their cells. The patch includes whole coordinates, zeros of both
    /// signs and values just below them.
    #[test]
    fn a_patch_is_its_points(
        corner in prop::array::uniform3(-3i32..3),
        step in prop_oneof![Just(0.0625f32), Just(0.25), Just(1.0), 0.001f32..2.0],
        turn in prop::array::uniform3(-1.0f32..1.0),
        level in any::<bool>(),
        odd in prop::option::of((0usize..300, 0usize..3, prop_oneof![Just(-0.0f32), Just(-1e-30), Just(-5.9e-8), Just(4e6), any_coordinate()])),
    ) {
        let column = |a: usize| (0..300).map(|i| {
            let (x, y) = ((i % 16) as f32 * step, (i / 16) as f32 * step);
            let straight = [x, y, 0.0][a];
            corner[a] as f32 + if level { straight } else { straight + turn[a] * (x - y) }
        }).collect::<Vec<f32>>();
        let mut columns: Vec<Vec<f32>> = (0..3).map(column).collect();
        if let Some((lane, axis, x)) = odd {
            columns[axis][lane] = x;
        }
        for kind in [Kind::Perlin, Kind::UPerlin, Kind::Simplex, Kind::USimplex] {
            for dims in 2..=3 {
                let coords: Vec<&[f32]> = columns[..dims].iter().map(Vec::as_slice).collect();
                let mut singles = vec![0.0; 300];
                for (i, single) in singles.iter_mut().enumerate() {
                    let one: Vec<&[f32]> = coords.iter().map(|c| &c[i..=i]).collect();
                    eval(Isa::baseline(), kind, &one, std::slice::from_mut(single));
                }
                for isa in Isa::all() {
                    let mut out = vec![0.0; 300];
                    eval(isa, kind, &coords, &mut out);
                    prop_assert_eq!(bits(&out), bits(&singles), "{:?} {} {:?}", kind, dims, isa);
                }
                let partials: Vec<Vec<f32>> = (0..2 * dims).map(|k| (0..300).map(|i| match odd {
                    Some((lane, axis, x)) if lane == i + 1 && axis == k % 3 => x,
                    _ => ((i * 7 + k * 5) % 13) as f32 * step - turn[k % 3],
                }).collect()).collect();
                let all: Vec<&[f32]> = coords.iter().copied().chain(partials.iter().map(Vec::as_slice)).collect();
                let singles: Vec<[u32; 3]> = (0..300).map(|i| {
                    let one: Vec<&[f32]> = all.iter().map(|c| &c[i..=i]).collect();
                    let (mut v, mut dx, mut dy) = ([0.0], [0.0], [0.0]);
                    eval_dual(Isa::baseline(), kind, &one, &[], [&mut v, &mut dx, &mut dy]);
                    [bits(&v)[0], bits(&dx)[0], bits(&dy)[0]]
                }).collect();
                for isa in Isa::all() {
                    let (mut v, mut dx, mut dy) = (vec![0.0; 300], vec![0.0; 300], vec![0.0; 300]);
                    eval_dual(isa, kind, &all, &[], [&mut v, &mut dx, &mut dy]);
                    for (part, out) in [v, dx, dy].iter().enumerate() {
                        let expected: Vec<u32> = singles.iter().map(|s| s[part]).collect();
                        prop_assert_eq!(bits(out), expected, "{:?} {} {:?}, part {}", kind, dims, isa, part);
                    }
                }
            }
        }
    }

    #[test]
    fn gradients_follow_differences(p in prop::array::uniform3(-20.0f32..20.0)) {
        for kind in [Kind::Perlin, Kind::UPerlin, Kind::Simplex, Kind::USimplex] {
            for axis in 0..3 {
                let h = 1.0 / 256.0;
                let at = |step: f32| {
                    let mut q = p;
                    q[axis] += step;
                    let coords: Vec<&[f32]> = q.iter().map(std::slice::from_ref).collect();
                    let mut out = [0.0];
                    eval(Isa::baseline(), kind, &coords, &mut out);
                    f64::from(out[0])
                };
                let difference = (at(h) - at(-h)) / f64::from(2.0 * h);
                let mut partial = [0.0; 3];
                partial[axis] = 1.0;
                let all: Vec<&[f32]> = p.iter().chain(&partial).chain(&[0.0; 3]).map(std::slice::from_ref).collect();
                let (mut v, mut dx, mut dy) = ([0.0], [0.0], [0.0]);
                eval_dual(Isa::baseline(), kind, &all, &[], [&mut v, &mut dx, &mut dy]);
                // The error of the finite difference: second derivatives stay below about 100.
                prop_assert!((f64::from(dx[0]) - difference).abs() < 0.02, "{kind:?} {p:?} {} {difference}", dx[0]);
                prop_assert_eq!(dy[0], 0.0);
            }
        }
    }
}
