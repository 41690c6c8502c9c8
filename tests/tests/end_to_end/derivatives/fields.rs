//! Models of gradient and simplex noise in f64. They share with the noises only the hash, and the rule that
//! picks a gradient from its bits.

use super::case::{Case, Model, even};
use osl_noise::hash::hash;

/// Perlin, Improving Noise, 2002: quintic weights, gradients along edges. `byte` of the hash for a component
/// of a triple.
pub(crate) fn perlin(p: &[f64], periods: &[f64], byte: Option<u32>) -> f64 {
    let dims = p.len();
    let mut sum = 0.0;
    for corner in 0..1_usize << dims {
        let (mut words, mut way, mut weight) = ([0_u32; 4], [0.0; 4], 1.0);
        for axis in 0..dims {
            let far = (corner >> axis & 1) as f64;
            let t = p[axis] - p[axis].floor();
            let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
            weight *= if far == 1.0 { fade } else { 1.0 - fade };
            way[axis] = t - far;
            let whole = p[axis].floor() + far;
            let whole = periods.get(axis).map_or(whole, |period| whole.rem_euclid(period.floor().max(1.0)));
            words[axis] = whole as i64 as u32;
        }
        let h = match dims {
            1 => hash([words[0]]),
            2 => hash([words[0], words[1]]),
            3 => hash([words[0], words[1], words[2]]),
            _ => hash(words),
        };
        let h = byte.map_or(h, |byte| h >> (8 * byte) & 0xff);
        sum += weight * slope(h, dims, way);
    }
    sum * [0.25, 0.6616, 0.9820, 0.8344][dims - 1]
}

fn signed(x: f64, negative: u32) -> f64 {
    if negative == 0 { x } else { -x }
}

fn slope(h: u32, dims: usize, [x, y, z, w]: [f64; 4]) -> f64 {
    match dims {
        1 => signed(f64::from(1 + (h & 7)), h & 8) * x,
        2 => {
            let (u, v) = if h & 7 < 4 { (x, y) } else { (y, x) };
            signed(u, h & 1) + signed(2.0 * v, h & 2)
        }
        3 => {
            let h = h & 15;
            let u = if h < 8 { x } else { y };
            let v = if h < 4 {
                y
            } else if h == 12 || h == 14 {
                x
            } else {
                z
            };
            signed(u, h & 1) + signed(v, h & 2)
        }
        _ => {
            let h = h & 31;
            let u = if h < 24 { x } else { y };
            let v = if h < 16 { y } else { z };
            let r = if h < 8 { z } else { w };
            signed(u, h & 1) + signed(v, h & 2) + signed(r, h & 4)
        }
    }
}

/// The final mixing of lookup3 (Jenkins), which is the hash of simplex noise.
fn scramble(p: u32, q: u32, r: u32) -> u32 {
    let (mut a, mut b, mut c) = (p, q, r ^ 0xdead_beef);
    let step = |x: &mut u32, y: u32, k: u32| *x = (*x ^ y).wrapping_sub(y.rotate_left(k));
    step(&mut c, b, 14);
    step(&mut a, c, 11);
    step(&mut b, a, 25);
    step(&mut c, b, 16);
    step(&mut a, c, 4);
    step(&mut b, a, 14);
    step(&mut c, b, 24);
    c
}

const PLANE: [[f64; 2]; 8] =
    [[-1.0, -1.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 1.0], [-1.0, 1.0], [0.0, -1.0], [0.0, 1.0], [1.0, -1.0]];
const SPACE: [[f64; 3]; 16] = [
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [-1.0, 0.0, 1.0],
    [0.0, -1.0, 1.0],
    [1.0, 0.0, -1.0],
    [0.0, 1.0, -1.0],
    [-1.0, 0.0, -1.0],
    [0.0, -1.0, -1.0],
    [1.0, -1.0, 0.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [-1.0, -1.0, 0.0],
    [1.0, 0.0, 1.0],
    [-1.0, 0.0, 1.0],
    [0.0, 1.0, -1.0],
    [0.0, -1.0, -1.0],
];

fn gradient(corner: [u32; 4], dims: usize, seed: u32) -> [f64; 4] {
    let [i, j, k, l] = corner;
    match dims {
        2 => {
            let [x, y] = PLANE[(scramble(i, j, seed) & 7) as usize];
            [x, y, 0.0, 0.0]
        }
        3 => {
            let [x, y, z] = SPACE[(scramble(i, j, scramble(k, seed, 0)) & 15) as usize];
            [x, y, z, 0.0]
        }
        _ => {
            // One axis is 0, and the signs of the others are bits 2, 1, 0.
            let h = scramble(i, j, scramble(k, l, seed)) & 31;
            let mut bits = [4, 2, 1].into_iter();
            std::array::from_fn(|axis| {
                if axis as u32 == h >> 3 {
                    return 0.0;
                }
                signed(1.0, h & bits.next().unwrap_or(0))
            })
        }
    }
}

/// Gustavson, Simplex noise demystified, 2005.
pub(crate) fn simplex(p: &[f64], seed: u32) -> f64 {
    let dims = p.len();
    if dims == 1 {
        let corner = |whole: f64| {
            let x = p[0] - whole;
            let h = scramble(whole as i64 as u32, seed, 0);
            (1.0 - x * x).powi(4) * signed(f64::from(1 + (h & 7)), h & 8) * x
        };
        return 0.36 * (corner(p[0].floor()) + corner(p[0].floor() + 1.0));
    }
    let n = dims as f64;
    let skew = ((n + 1.0).sqrt() - 1.0) / n;
    let back = (1.0 - 1.0 / (n + 1.0).sqrt()) / n;
    let s = p.iter().sum::<f64>() * skew;
    let base: Vec<f64> = p.iter().map(|x| (x + s).floor()).collect();
    let t = base.iter().sum::<f64>() * back;
    let origin: Vec<f64> = p.iter().zip(&base).map(|(x, b)| x - b + t).collect();
    let mut axes: Vec<usize> = (0..dims).collect();
    axes.sort_by(|i, j| origin[*j].total_cmp(&origin[*i]));
    let (mut offset, mut sum) = ([0.0; 4], 0.0);
    for q in 0..=dims {
        if q > 0 {
            offset[axes[q - 1]] = 1.0;
        }
        let way: Vec<f64> = (0..dims).map(|a| origin[a] - offset[a] + q as f64 * back).collect();
        let left = 0.5 - way.iter().map(|x| x * x).sum::<f64>();
        if left > 0.0 {
            let words =
                std::array::from_fn(|a| if a < dims { (base[a] + offset[a]) as i64 as u32 } else { 0 });
            let g = gradient(words, dims, seed);
            sum += left.powi(4) * (0..dims).map(|a| g[a] * way[a]).sum::<f64>();
        }
    }
    sum * [64.0, 68.0, 54.0][dims - 2]
}

/// Coordinates and periods of each dimension in a program, and their inputs.
const FORMS: [(&str, &str, &[usize]); 4] = [
    ("s", "5", &[9]),
    ("s, t", "5, 3.5", &[9, 10]),
    ("a", "point(5, 3, 4)", &[0, 1, 2]),
    ("a, s", "point(5, 3, 4), 2", &[0, 1, 2, 9]),
];
const PERIODS: [&[f64]; 4] = [&[5.0], &[5.0, 3.5], &[5.0, 3.0, 4.0], &[5.0, 3.0, 4.0, 2.0]];

/// A field: its call, its row, whether it is periodic, and its value for a component.
struct Field {
    row: &'static str,
    name: &'static str,
    periodic: bool,
    of: fn(&[f64], &[f64], Option<u32>) -> f64,
}

/// Rows of "Noise" except Gabor noise.
pub(crate) fn fields() -> Vec<Case> {
    let of_perlin: fn(&[f64], &[f64], Option<u32>) -> f64 = perlin;
    let half_perlin: fn(&[f64], &[f64], Option<u32>) -> f64 = |p, q, c| 0.5 * perlin(p, q, c) + 0.5;
    let of_simplex: fn(&[f64], &[f64], Option<u32>) -> f64 = |p, _, c| simplex(p, c.unwrap_or(0));
    let half_simplex: fn(&[f64], &[f64], Option<u32>) -> f64 = |p, _, c| 0.5 * simplex(p, c.unwrap_or(0));
    let list = [
        ("snoise", "", false, of_perlin),
        ("noise", "", false, half_perlin),
        ("noise", "perlin", false, of_perlin),
        ("noise", "uperlin", false, half_perlin),
        ("noise", "simplex", false, of_simplex),
        ("noise", "usimplex", false, half_simplex),
        ("psnoise", "", true, of_perlin),
        ("pnoise", "", true, half_perlin),
        ("pnoise", "perlin", true, of_perlin),
        ("pnoise", "uperlin", true, half_perlin),
    ];
    let mut cases = Vec::new();
    for (row, name, periodic, of) in list {
        for dims in 0..4 {
            for triple in [false, true] {
                cases.push(field(&Field { row, name, periodic, of }, dims, triple));
            }
        }
    }
    for triple in [false, true] {
        let code = |call: &str| format!("({}){call}", if triple { "vector" } else { "float" });
        for (row, call) in [
            ("cellnoise", "cellnoise(a, s)"),
            ("hashnoise", "hashnoise(a, s)"),
            ("noise", "noise(\"cell\", a)"),
            ("noise", "noise(\"hash\", s, t)"),
            ("pnoise", "pnoise(\"cell\", s, 3)"),
            ("pnoise", "pnoise(\"hash\", a, point(2))"),
        ] {
            cases.push(Case::zero(row, &code(call), triple));
        }
    }
    cases
}

fn field(field: &Field, dims: usize, triple: bool) -> Case {
    let (coordinates, periods, inputs) = FORMS[dims];
    let (of, periodic) = (field.of, field.periodic);
    let name = if field.name.is_empty() { String::new() } else { format!("\"{}\", ", field.name) };
    let periods = if periodic { format!(", {periods}") } else { String::new() };
    let ty = if triple { "vector" } else { "float" };
    let code = format!("({ty}){}({name}{coordinates}{periods})", field.row);
    let model: Model = Box::new(move |x, _| {
        let p: Vec<f64> = inputs.iter().map(|i| x.0[*i]).collect();
        let periods = if periodic { PERIODS[dims] } else { &[] };
        if triple { [0, 1, 2].map(|c| of(&p, periods, Some(c))) } else { [of(&p, periods, None), 0.0, 0.0] }
    });
    let inside = (32.0, "the place within a cell is what is left of the coordinates, and gradients cancel");
    Case { inside, ..Case::new(field.row, &code, triple, model) }.on(&[even(-20.0, 20.0).edges(-1e4, 1e4)])
}
