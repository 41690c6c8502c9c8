//! A small path tracer that shades with OSL: batches of hits by material, closures in columns.
//!
//! `cargo run --release -p osl-examples --bin pathtracer -- picture.png` renders four balls on a floor. Each
//! round follows all paths by one ray: it finds what the rays hit, lets each material's program shade all of
//! its hits at once, adds the light that the closures emit, and continues each path by one component of its
//! closure.

#![allow(clippy::disallowed_methods, reason = "an example needs no more than the standard library")]

use image::{Rgb, RgbImage};
use osl::{Closures, Error, Group, Points, Program, Shader};

type V = [f32; 3];

const WIDTH: usize = 480;
const HEIGHT: usize = 270;
const SAMPLES: usize = 64;
const BOUNCES: usize = 6;
const SKY: V = [0.35, 0.45, 0.6];

/// The materials: name, text.
const MATERIALS: [(&str, &str); 4] = [
    (
        "floor",
        "surface tiles(float size = 0.6) {
            float line = min(mod(P[0], size), mod(P[2], size)) < 0.02;
            color base = mix(color(0.75, 0.7, 0.6), color(0.9), (float) noise(P * 3));
            Ci = mix(base, color(0.2), line) * diffuse(N);
        }",
    ),
    (
        "marble",
        "surface marble() {
            float vein = abs(noise(\"perlin\", P * 3 + noise(\"perlin\", P * 6)));
            Ci = 0.9 * mix(color(0.1, 0.2, 0.15), color(0.8, 0.85, 0.8), smoothstep(0, 0.25, vein)) * diffuse(N);
        }",
    ),
    ("mirror", "surface mirror(color tint = color(0.95, 0.85, 0.7)) { Ci = tint * reflection(N); }"),
    (
        "lamp",
        "surface lamp(float watts = 9) {
            float stripe = smoothstep(0.45, 0.55, mod(6 * v, 1));
            Ci = watts * color(1, 0.8, 0.5) * stripe * emission() + 0.5 * diffuse(N);
        }",
    ),
];

/// Centre, radius, and index of the material. The first is so large that it is a floor.
const BALLS: [(V, f32, usize); 5] = [
    ([0.0, -1000.0, 0.0], 1000.0, 0),
    ([-1.25, 0.7, 0.0], 0.7, 1),
    ([0.25, 0.7, -0.5], 0.7, 2),
    ([1.45, 0.5, 0.4], 0.5, 3),
    ([0.1, 0.3, 0.8], 0.3, 1),
];

/// A path: its pixel, its ray, and the share of the light along it that reaches the pixel.
struct Path {
    pixel: usize,
    from: V,
    to: V,
    share: V,
}

/// What a closure does with light.
#[derive(Clone, Copy)]
enum Lobe {
    Emits,
    Scatters,
    Mirrors,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = std::env::args().nth(1).unwrap_or("pathtracer.png".into());
    let compile = |(name, text): &(&str, &str)| -> Result<Program, Error> {
        Group::new().layer(name, &Shader::compile(name, text)?).compile(&["Ci"])
    };
    let programs: Vec<Program> = MATERIALS.iter().map(compile).collect::<Result<_, _>>()?;
    let mut light = vec![[0.0; 3]; WIDTH * HEIGHT];
    let mut random = Random(1);
    for _ in 0..SAMPLES {
        let mut paths: Vec<Path> = (0..WIDTH * HEIGHT).map(|pixel| camera(pixel, &mut random)).collect();
        for _ in 0..BOUNCES {
            paths = follow(paths, &programs, &mut light, &mut random)?;
        }
    }
    let mut picture = RgbImage::new(WIDTH as u32, HEIGHT as u32);
    for (pixel, light) in picture.pixels_mut().zip(&light) {
        *pixel =
            Rgb(light.map(|x| (255.0 * (1.0 - (-1.3 * x / SAMPLES as f32).exp()).powf(1.0 / 2.2)) as u8));
    }
    Ok(picture.save(file)?)
}

fn camera(pixel: usize, random: &mut Random) -> Path {
    let (x, y) = ((pixel % WIDTH) as f32 + random.next(), (pixel / WIDTH) as f32 + random.next());
    let to = [(x / WIDTH as f32 - 0.5) * 1.6, 0.34 - 0.9 * y / HEIGHT as f32, -1.35];
    Path { pixel, from: [0.1, 1.1, 4.6], to: unit(to), share: [1.0; 3] }
}

/// Follows all paths by one ray. Returns those that go on.
fn follow(
    paths: Vec<Path>,
    programs: &[Program],
    light: &mut [V],
    random: &mut Random,
) -> Result<Vec<Path>, Error> {
    // The hits of each material: the path, the distance and the ball.
    let mut hits: Vec<Vec<(Path, f32, usize)>> = programs.iter().map(|_| Vec::new()).collect();
    for path in paths {
        let near = |(at, ball): (usize, &(V, f32, usize))| Some((hit(&path, ball.0, ball.1)?, at));
        match BALLS.iter().enumerate().filter_map(near).min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((distance, ball)) => hits[BALLS[ball].2].push((path, distance, ball)),
            None => add(&mut light[path.pixel], mul(path.share, mul(SKY, [0.6 + 0.8 * path.to[1]; 3]))),
        }
    }
    let mut next = Vec::new();
    for (program, hits) in programs.iter().zip(hits) {
        let p: Vec<V> = hits.iter().map(|(path, t, _)| along(path, *t)).collect();
        let n: Vec<V> = p.iter().zip(&hits).map(|(p, (_, _, ball))| unit(sub(*p, BALLS[*ball].0))).collect();
        let i: Vec<V> = hits.iter().map(|(path, ..)| path.to).collect();
        let v: Vec<f32> = n.iter().map(|n| 0.5 + 0.5 * n[1]).collect();
        let outputs = program.run(&Points::new(hits.len()).p(&p).n(&n).i(&i).v(&v))?;
        let Some(closures) = outputs.closures("Ci") else { continue };
        let lobes = lobes(&closures);
        for (at, (path, ..)) in hits.into_iter().enumerate() {
            next.extend(scatter(path, (&closures, &lobes, at), p[at], n[at], light, random));
        }
    }
    Ok(next)
}

/// What each kind of closure does; a renderer decides this once for a program.
fn lobes(closures: &Closures) -> Vec<Lobe> {
    let lobe = |name: &str| match name {
        "emission" => Lobe::Emits,
        "reflection" => Lobe::Mirrors,
        _ => Lobe::Scatters,
    };
    closures.kinds().iter().map(|kind| lobe(&kind.name)).collect()
}

/// Adds the light that a closure emits, and continues the path by one of its other components.
fn scatter(
    path: Path,
    (closures, lobes, at): (&Closures, &[Lobe], usize),
    p: V,
    n: V,
    light: &mut [V],
    random: &mut Random,
) -> Option<Path> {
    let (mut chosen, mut sum) = (None, 0.0);
    for component in closures.at(at) {
        let (lobe, weight) = (lobes[component.kind()], component.weight());
        if let Lobe::Emits = lobe {
            add(&mut light[path.pixel], mul(path.share, weight));
            continue;
        }
        // Each component is chosen with a probability in proportion to its brightness.
        let bright = weight.iter().sum::<f32>() / 3.0;
        sum += bright;
        if random.next() * sum < bright {
            let normal = component.triple(0).unwrap_or(n);
            chosen = Some((lobe, weight.map(|x| x / bright), normal));
        }
    }
    let (lobe, weight, normal) = chosen?;
    let to = match lobe {
        Lobe::Mirrors => sub(path.to, normal.map(|x| 2.0 * dot(path.to, normal) * x)),
        // A point of a sphere that touches the surface: the cosine and the density cancel.
        _ => unit(sub(normal, random.sphere().map(|x| -0.999 * x))),
    };
    let share = mul(path.share, weight.map(|x| x * sum));
    Some(Path { from: sub(p, n.map(|x| -1e-3 * x)), to, share, ..path })
}

/// The distance to a ball along a ray.
fn hit(path: &Path, centre: V, radius: f32) -> Option<f32> {
    let to = sub(path.from, centre).map(f64::from);
    let way = path.to.map(f64::from);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (b, c) = (dot(to, way), dot(to, to) - f64::from(radius).powi(2));
    let root = (b * b - c).sqrt();
    let nearest = if -b - root > 1e-4 { -b - root } else { -b + root };
    (nearest > 1e-4).then_some(nearest as f32)
}

fn along(path: &Path, t: f32) -> V {
    sub(path.from, path.to.map(|x| -t * x))
}
fn sub(a: V, b: V) -> V {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
fn mul(a: V, b: V) -> V {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}
fn dot(a: V, b: V) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn add(to: &mut V, x: V) {
    to.iter_mut().zip(x).for_each(|(to, x)| *to += x);
}
fn unit(a: V) -> V {
    a.map(|x| x / dot(a, a).sqrt())
}

/// Numbers from 0 to 1 by chance (a linear congruence, Knuth's constants).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    /// A point on the unit sphere.
    fn sphere(&mut self) -> V {
        loop {
            let p = [(); 3].map(|()| 2.0 * self.next() - 1.0);
            if dot(p, p) > 1e-4 && dot(p, p) < 1.0 {
                return unit(p);
            }
        }
    }
}
