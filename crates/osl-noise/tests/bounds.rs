//! The ranges and slopes of the fields hold for every choice of gradients.
//!
//! For a box of positions within a cell, each corner contributes at most its largest weighted gradient term.
//! The sum over the corners bounds the field in the box; boxes whose bound is too large are split.

#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs, reason = "a test says what must hold")]

use osl_noise::Kind;
use osl_noise::bounds::{largest, steepest};
use std::ops::{Add, Mul, Neg, Sub};

/// Numbers between two.
#[derive(Clone, Copy, Debug)]
struct Box1(f64, f64);

impl Box1 {
    const fn at(x: f64) -> Box1 {
        Box1(x, x)
    }
    fn square(self) -> Box1 {
        let most = self.0.abs().max(self.1.abs());
        let least = if self.0 <= 0.0 && self.1 >= 0.0 { 0.0 } else { self.0.abs().min(self.1.abs()) };
        Box1(least * least, most * most)
    }
    fn positive(self) -> Box1 {
        Box1(self.0.max(0.0), self.1.max(0.0))
    }
    fn size(self) -> f64 {
        self.0.abs().max(self.1.abs())
    }
    /// A function that rises.
    fn rising(self, f: impl Fn(f64) -> f64) -> Box1 {
        Box1(f(self.0), f(self.1))
    }
}

impl Add for Box1 {
    type Output = Box1;
    fn add(self, other: Box1) -> Box1 {
        Box1(self.0 + other.0, self.1 + other.1)
    }
}

impl Sub for Box1 {
    type Output = Box1;
    fn sub(self, other: Box1) -> Box1 {
        self + -other
    }
}

impl Neg for Box1 {
    type Output = Box1;
    fn neg(self) -> Box1 {
        Box1(-self.1, -self.0)
    }
}

impl Mul for Box1 {
    type Output = Box1;
    fn mul(self, other: Box1) -> Box1 {
        let [a, b, c, d] = [self.0 * other.0, self.0 * other.1, self.1 * other.0, self.1 * other.1];
        Box1(a.min(b).min(c.min(d)), a.max(b).max(c.max(d)))
    }
}

/// What is bounded.
#[derive(Clone, Copy, PartialEq)]
enum Of {
    Value,
    /// The slope along the first axis: the fields are alike along all axes.
    Slope(usize),
}

/// Gradients with a 0 along one axis and ±1 along the others.
fn edges(dims: usize) -> Vec<Vec<f64>> {
    let mut list = Vec::new();
    for zero in 0..dims {
        for bits in 0..1 << (dims - 1) {
            let sign = |n: usize| if (bits >> n) & 1 == 1 { 1.0 } else { -1.0 };
            let mut signs = (0..dims - 1).map(sign);
            list.push((0..dims).map(|axis| if axis == zero { 0.0 } else { signs.next().unwrap() }).collect());
        }
    }
    list
}

fn perlin_gradients(dims: usize) -> Vec<Vec<f64>> {
    match dims {
        1 => (1..=8).flat_map(|k| [vec![f64::from(k)], vec![-f64::from(k)]]).collect(),
        2 => {
            let signs = [1.0, -1.0];
            let all = signs.iter().flat_map(|s| signs.iter().map(move |t| (*s, *t)));
            all.flat_map(|(s, t)| [vec![s, 2.0 * t], vec![2.0 * t, s]]).collect()
        }
        _ => edges(dims),
    }
}

fn simplex_gradients(dims: usize) -> Vec<Vec<f64>> {
    match dims {
        1 => perlin_gradients(1),
        2 => [[-1, -1], [1, 0], [-1, 0], [1, 1], [-1, 1], [0, -1], [0, 1], [1, -1]]
            .iter()
            .map(|g| g.iter().map(|x| f64::from(*x)).collect())
            .collect(),
        _ => edges(dims),
    }
}

/// `weight · (gradient · way)`, or its derivative along an axis, at most; for the best gradient.
fn term(gradients: &[Vec<f64>], way: &[Box1], weight: Box1, slope: Option<(Box1, usize)>) -> f64 {
    let of = |g: &Vec<f64>| {
        let dot = g.iter().zip(way).fold(Box1::at(0.0), |sum, (g, way)| sum + Box1::at(*g) * *way);
        match slope {
            None => (weight * dot).size(),
            Some((slope, axis)) => (slope * dot + weight * Box1::at(g[axis])).size(),
        }
    };
    gradients.iter().map(of).fold(0.0, f64::max)
}

fn perlin(place: &[Box1], of: Of, gradients: &[Vec<f64>]) -> f64 {
    const SCALE: [f64; 5] = [0.0, 0.25, 0.6616, 0.982, 0.8344];
    let dims = place.len();
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    // 30 t² (1 - t)²
    let steepness = |t: Box1| Box1::at(30.0) * (t * (Box1::at(1.0) - t)).square();
    let mut sum = 0.0;
    for corner in 0..1_usize << dims {
        let far = |axis: usize| (corner >> axis) & 1 == 1;
        let part = |axis: usize| {
            let s = place[axis].rising(fade);
            if far(axis) { s } else { Box1::at(1.0) - s }
        };
        let weight = (0..dims).map(part).fold(Box1::at(1.0), Mul::mul);
        let way: Vec<Box1> =
            (0..dims).map(|axis| if far(axis) { place[axis] - Box1::at(1.0) } else { place[axis] }).collect();
        let slope = match of {
            Of::Value => None,
            Of::Slope(axis) => {
                let rest = (0..dims).filter(|other| *other != axis).map(part).fold(Box1::at(1.0), Mul::mul);
                let own = steepness(place[axis]);
                Some((rest * if far(axis) { own } else { -own }, axis))
            }
        };
        sum += term(gradients, &way, weight, slope);
    }
    sum * SCALE[dims]
}

/// Within the simplex whose coordinates fall from the first axis on.
fn simplex(skewed: &[Box1], of: Of, gradients: &[Vec<f64>]) -> f64 {
    const SCALE: [f64; 5] = [0.0, 0.36, 64.0, 68.0, 54.0];
    let dims = skewed.len();
    let n = dims as f64;
    let g = if dims == 1 { 0.0 } else { (1.0 - 1.0 / (n + 1.0).sqrt()) / n };
    let start = if dims == 1 { 1.0 } else { 0.5 };
    let total = skewed.iter().fold(Box1::at(0.0), |sum, x| sum + *x);
    let mut sum = 0.0;
    for corner in 0..=dims {
        let way: Vec<Box1> = (0..dims)
            .map(|axis| {
                // x - g · (sum of all), with the own coordinate counted once.
                let others = total.0 - skewed[axis].0;
                let others = Box1(others, total.1 - skewed[axis].1);
                let own = skewed[axis] * Box1::at(1.0 - g) - others * Box1::at(g);
                own - Box1::at(if axis < corner { 1.0 } else { 0.0 } - g * corner as f64)
            })
            .collect();
        let t = way.iter().fold(Box1::at(start), |t, x| t - x.square()).positive();
        let (t3, t4) = (t.rising(|t| t * t * t), t.rising(|t| t * t * t * t));
        let slope = match of {
            Of::Value => None,
            Of::Slope(axis) => Some((Box1::at(-8.0) * t3 * way[axis], axis)),
        };
        sum += term(gradients, &way, t4, slope);
    }
    sum * SCALE[dims]
}

/// Whether a bound holds in all boxes; splits them where it is not clear.
fn holds(dims: usize, bound: f64, most: usize, at: impl Fn(&[Box1]) -> Option<f64>) -> usize {
    let mut open = vec![vec![Box1(0.0, 1.0); dims]];
    let mut count = 0;
    while let Some(place) = open.pop() {
        count += 1;
        assert!(count < most, "not proved: {place:?} with {:?} of {bound}", at(&place));
        if at(&place).is_none_or(|value| value <= bound) {
            continue;
        }
        let width = |x: &Box1| x.1 - x.0;
        let longest = (0..dims).max_by(|a, b| width(&place[*a]).total_cmp(&width(&place[*b]))).unwrap();
        let middle = f64::midpoint(place[longest].0, place[longest].1);
        for half in [Box1(place[longest].0, middle), Box1(middle, place[longest].1)] {
            let mut part = place.clone();
            part[longest] = half;
            open.push(part);
        }
    }
    count
}

fn prove(dims: usize, most: usize) {
    let bound = |kind: Kind| f64::from(largest(kind, dims).unwrap().1) - 5e-6;
    let slope = |kind: Kind| f64::from(steepest(kind, dims).unwrap()) - 5e-6;
    let gradients = perlin_gradients(dims);
    // Perlin noise is symmetric about the middle of a cell.
    let half = |place: &[Box1]| place.iter().all(|x| x.0 < 0.5);
    let counts = [
        holds(dims, bound(Kind::Perlin), most, |p| half(p).then(|| perlin(p, Of::Value, &gradients))),
        holds(dims, slope(Kind::Perlin), most, |p| half(p).then(|| perlin(p, Of::Slope(0), &gradients))),
    ];
    let gradients = simplex_gradients(dims);
    let sorted = |place: &[Box1]| place.windows(2).all(|pair| pair[0].1 >= pair[1].0);
    let value = |of: Of| {
        let gradients = &gradients;
        move |p: &[Box1]| sorted(p).then(|| simplex(p, of, gradients))
    };
    let mut simplexes = vec![holds(dims, bound(Kind::Simplex), most, value(Of::Value))];
    simplexes.extend((0..dims).map(|axis| holds(dims, slope(Kind::Simplex), most, value(Of::Slope(axis)))));
    println!("{dims} dimensions: {counts:?} and {simplexes:?} boxes");
}

#[test]
fn fields_of_few_dimensions_stay_in_their_bounds() {
    prove(1, 10_000);
    prove(2, 100_000);
    prove(3, 1_000_000);
}

/// `cargo test --release -p osl-noise --test bounds -- --ignored --nocapture`
#[test]
#[ignore = "takes a minute"]
fn fields_of_four_dimensions_stay_in_their_bounds() {
    prove(4, 2_000_000_000);
}

/// Many points of all fields, whatever the dimension.
#[test]
fn computed_values_are_in_their_bounds() {
    let mut state = 0x9E37_79B9_u32;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as f32 / u32::MAX as f32
    };
    let isa = osl_simd::Isa::detect();
    for dims in 1..=4 {
        for kind in Kind::ALL {
            let count = 20_000;
            let coords: Vec<Vec<f32>> =
                (0..dims).map(|_| (0..count).map(|_| (next() - 0.5) * 200.0).collect()).collect();
            let list: Vec<&[f32]> = coords.iter().map(Vec::as_slice).collect();
            let mut out = vec![0.0; count];
            osl_noise::eval(isa, kind, &list, &mut out);
            let (lo, hi) = largest(kind, dims).unwrap();
            assert!(out.iter().all(|x| (lo..=hi).contains(x)), "{kind:?} {dims}");
            let Some(slope) = steepest(kind, dims) else { continue };
            // Neighbours along each axis.
            for axis in 0..dims {
                let mut moved = coords.clone();
                moved[axis].iter_mut().for_each(|x| *x += 0.01);
                let list: Vec<&[f32]> = moved.iter().map(Vec::as_slice).collect();
                let mut other = vec![0.0; count];
                osl_noise::eval(isa, kind, &list, &mut other);
                let most = slope * 0.0101 + 2e-4 * slope;
                let is_right = out.iter().zip(&other).all(|(a, b)| (a - b).abs() <= most);
                assert!(is_right, "{kind:?} {dims} along {axis}");
            }
        }
    }
}
