//! Gabor noise of many points, which share the impulses of their cells: the bits of each point alone.

#![allow(clippy::indexing_slicing, missing_docs, reason = "a test says what must hold")]

use osl_noise::gabor::{self, Options, Points};
use osl_simd::Isa;
use proptest::prelude::*;

const POINTS: usize = 90;

/// Columns of numbers, one number for each point.
type Columns = Vec<Vec<f32>>;

fn slices(columns: &Columns) -> Vec<&[f32]> {
    columns.iter().map(Vec::as_slice).collect()
}

fn one(columns: &Columns, point: usize) -> Columns {
    columns.iter().map(|column| vec![column[point]]).collect()
}

#[derive(Debug)]
struct Case {
    coords: Columns,
    partials: Columns,
    periods: Columns,
    options: Vec<Options>,
}

impl Case {
    /// The results of the four functions, NaN as one word: 1, 3, 3 and 9 numbers for each point.
    fn results(&self, isa: Isa) -> Vec<Vec<u32>> {
        let (coords, partials, periods) =
            (slices(&self.coords), slices(&self.partials), slices(&self.periods));
        let points = Points { coords: &coords, partials: &partials, periods: &periods };
        let mut out = vec![vec![0.0; self.coords[0].len()]; 16];
        let mut next = out.iter_mut().map(Vec::as_mut_slice);
        let mut next = || next.next().unwrap_or_default();
        gabor::eval(isa, points, &self.options, next());
        gabor::eval3(isa, points, &self.options, [next(), next(), next()]);
        gabor::eval_dual(isa, points, &self.options, [next(), next(), next()]);
        gabor::eval3_dual(isa, points, &self.options, std::array::from_fn(|_| next()));
        let word = |x: &f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
        out.iter().map(|column| column.iter().map(word).collect()).collect()
    }

    /// A point of the case alone.
    fn point(&self, point: usize) -> Case {
        Case {
            coords: one(&self.coords, point),
            partials: one(&self.partials, point),
            periods: one(&self.periods, point),
            options: vec![self.options[if self.options.len() == 1 { 0 } else { point }]],
        }
    }
}

/// A number for each point: the same, changing in small steps, or one of a few.
fn column(range: std::ops::Range<f32>) -> impl Strategy<Value = Vec<f32>> {
    let few = prop::collection::vec(range.clone(), POINTS);
    prop_oneof![
        3 => range.clone().prop_map(|x| vec![x; POINTS]),
        2 => (range, -0.1f32..0.1).prop_map(|(x, step)| (0..POINTS).map(|i| x + step * i as f32).collect()),
        1 => few,
    ]
}

/// Options for all points. Some of them, or all, change from point to point.
fn options() -> impl Strategy<Value = Vec<Options>> {
    let bandwidth = prop_oneof![3 => 0.5f32..3.0, 1 => Just(f32::NAN), 1 => 0.0f32..200.0];
    let length = prop_oneof![4 => Just(1.0f32), 1 => Just(1e7), 1 => Just(1e25), 1 => Just(f32::INFINITY)];
    let first = (0i32..3, bandwidth, prop_oneof![Just(16.0f32), -1.0f32..40.0], any::<bool>(), length);
    (first, prop::array::uniform3(column(-2.0..2.0)), 0u32..6).prop_map(
        |((anisotropic, bandwidth, impulses, do_filter, length), [x, y, z], change)| {
            let options = (0..POINTS).map(|i| Options {
                anisotropic: if change == 5 { i as i32 % 3 } else { anisotropic },
                direction: [x[i] * length, y[i], z[i]],
                bandwidth: if change == 4 { bandwidth + (i % 3) as f32 * 0.01 } else { bandwidth },
                impulses: if change == 2 { impulses + (i % 3) as f32 } else { impulses },
                do_filter: do_filter && (change != 3 || i % 7 != 0),
            });
            options.take(if change == 0 { 1 } else { POINTS }).collect()
        },
    )
}

fn case() -> impl Strategy<Value = Case> {
    let coords = prop::array::uniform3(column(-9.0..9.0));
    let partials = prop::array::uniform6(column(-0.4..0.4));
    let odd = prop_oneof![Just(f32::NAN), Just(f32::INFINITY), Just(3e9f32), Just(-0.0), Just(-1e-30)];
    let odd = prop::option::of((0..POINTS, 0usize..3, odd));
    (1usize..5, coords, partials, options(), column(0.0..5.0), 0u32..4, odd).prop_map(
        |(dims, coords, partials, options, period, parts, odd)| {
            let fourth = vec![0.5; POINTS];
            let mut coords: Columns = coords.into_iter().chain([fourth.clone()]).take(dims).collect();
            if let Some((point, axis, x)) = odd {
                coords[axis % dims][point] = x;
            }
            let [ax, ay, az, bx, by, bz] = partials;
            let first = [ax, ay, az, fourth.clone()].into_iter().take(dims);
            let second = [bx, by, bz, fourth].into_iter().take(dims);
            Case {
                coords,
                partials: if parts & 1 == 0 { first.chain(second).collect() } else { Columns::new() },
                periods: if parts & 2 == 0 { Columns::new() } else { vec![period; dims] },
                options,
            }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn points_together_have_the_bits_of_each_alone(case in case()) {
        let alone: Vec<_> = (0..POINTS).map(|i| case.point(i).results(Isa::baseline())).collect();
        for isa in Isa::all() {
            for (k, column) in case.results(isa).iter().enumerate() {
                for (i, word) in column.iter().enumerate() {
                    let [other] = alone[i][k][..] else { continue };
                    prop_assert_eq!(*word, other, "{:?}, result {}, point {}", isa, k, i);
                }
            }
        }
    }
}
