//! Embeds a shader in another program: compiles a source text and computes values at the program's own
//! points.
//!
//! `cargo run -p osl-examples --bin embed` shades points on a sphere, as a renderer's rays would hit them,
//! and prints them as characters.

#![allow(clippy::print_stdout, reason = "its purpose is to print")]

use osl::{Error, Group, Points, Shader};

const SHADER: &str = "
    shader stripes(float width = 0.1, output float mask = 0, output float facing = 0) {
        float warp = 0.4 * noise(2 * P);
        mask = mod(v + warp, 2 * width) < width;
        facing = -dot(N, I);
    }";

/// Columns and rows of the picture.
const SIZE: (usize, usize) = (60, 30);

/// The point where the ray through a character of the picture, in direction -z, hits the unit sphere.
fn hit(column: usize, row: usize) -> Option<[f32; 3]> {
    let x = 2.1 * ((column as f32 + 0.5) / SIZE.0 as f32 - 0.5);
    let y = 2.1 * (0.5 - (row as f32 + 0.5) / SIZE.1 as f32);
    let square = 1.0 - x * x - y * y;
    (square >= 0.0).then(|| [x, y, square.sqrt()])
}

fn main() -> Result<(), Error> {
    let pixels: Vec<(usize, usize)> =
        (0..SIZE.1).flat_map(|row| (0..SIZE.0).map(move |column| (column, row))).collect();
    let hits: Vec<Option<[f32; 3]>> = pixels.iter().map(|(column, row)| hit(*column, *row)).collect();
    // Only hit points are shaded: the points are a list, in any order.
    let p: Vec<[f32; 3]> = hits.iter().flatten().copied().collect();
    #[expect(clippy::disallowed_methods, reason = "an example needs no more than the standard library")]
    let v: Vec<f32> = p.iter().map(|p| p[1].asin() / std::f32::consts::PI + 0.5).collect();
    let rays = vec![[0.0, 0.0, -1.0]; p.len()];
    let points = Points::new(p.len()).p(&p).n(&p).v(v).i(&rays);

    let stripes = Shader::compile("stripes.osl", SHADER)?;
    let program = Group::new().layer("stripes", &stripes).param("width", 0.08).compile(&[])?;
    let outputs = program.run(&points)?;

    let mask = outputs.floats("mask").unwrap_or_default();
    let facing = outputs.floats("facing").unwrap_or_default();
    let mut shaded = mask.iter().zip(&facing);
    for row in hits.chunks(SIZE.0) {
        let character = |hit: &Option<[f32; 3]>| match hit.and_then(|_| shaded.next()) {
            None => ' ',
            Some((mask, facing)) if *mask > 0.0 => {
                if *facing > 0.5 {
                    '#'
                } else {
                    '+'
                }
            }
            Some((_, facing)) => {
                if *facing > 0.5 {
                    '-'
                } else {
                    '.'
                }
            }
        };
        println!("{}", row.iter().map(character).collect::<String>().trim_end());
    }
    Ok(())
}
