//! Paints the texture `pebbles.png`: rounded, veined stones in many colors, tileable.
//!
//! ```text
//! cargo run -p osl-image --example pebbles -- examples/textures/pebbles.png
//! ```

use std::path::Path;
use std::process::ExitCode;

use osl_image::{BitDepth, ImageError, PngOptions, Transfer, write_png};

/// Pixels along each side.
const SIZE: usize = 256;
/// Cells along each side; each holds the center of one stone.
const CELLS: i32 = 7;

fn main() -> ExitCode {
    let path = std::env::args().nth(1).unwrap_or_else(|| "pebbles.png".to_owned());
    match paint(Path::new(&path)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => fail(&error),
    }
}

#[expect(clippy::print_stderr, reason = "an example tells its user what went wrong")]
fn fail(error: &ImageError) -> ExitCode {
    eprintln!("{error}");
    ExitCode::FAILURE
}

fn paint(path: &Path) -> Result<(), ImageError> {
    let mut planes = vec![Vec::new(); 3];
    for y in 0..SIZE {
        for x in 0..SIZE {
            let at = |i: usize| (i as f32 + 0.5) / SIZE as f32 * CELLS as f32;
            for (plane, value) in planes.iter_mut().zip(pebble(at(x), at(y))) {
                plane.push(value);
            }
        }
    }
    let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
    write_png(
        path,
        SIZE,
        SIZE,
        &planes,
        PngOptions { transfer: Transfer::Srgb, depth: BitDepth::Eight, software: None },
    )
}

/// The linear color at a point measured in cells: the nearest stone, shaded as a dome, or the dark gap.
fn pebble(x: f32, y: f32) -> [f32; 3] {
    let (nearest, second) = two_nearest(x, y);
    // The distance to the border between the two stones, rounded off where stones meet.
    let inside = (second.distance - nearest.distance).clamp(0.0, 1.0);
    let edge = smooth(0.06, 0.22, inside);
    let dome = smooth(0.0, 0.9, inside);
    // Light from the upper left.
    let slope = -(nearest.dx + nearest.dy) * 0.55;
    let light = (0.35 + 0.55 * dome + slope * 0.5).max(0.06);
    let veins = vein(nearest.cell, nearest.dx, nearest.dy);
    let base = color(nearest.cell);
    let gap = [0.012, 0.010, 0.014];
    std::array::from_fn(|i| {
        let stone = (base[i] * (1.0 - veins) + 0.75 * veins) * light;
        gap[i] + (stone - gap[i]) * edge
    })
}

#[derive(Clone, Copy)]
struct Neighbour {
    cell: (i32, i32),
    dx: f32,
    dy: f32,
    distance: f32,
}

fn two_nearest(x: f32, y: f32) -> (Neighbour, Neighbour) {
    let far = Neighbour { cell: (0, 0), dx: 0.0, dy: 0.0, distance: f32::INFINITY };
    let (mut nearest, mut second) = (far, far);
    for j in y as i32 - 2..=y as i32 + 2 {
        for i in x as i32 - 2..=x as i32 + 2 {
            // The image tiles because cells repeat.
            let cell = (i.rem_euclid(CELLS), j.rem_euclid(CELLS));
            let dx = x - (i as f32 + 0.15 + 0.7 * random(cell, 0));
            let dy = y - (j as f32 + 0.15 + 0.7 * random(cell, 1));
            let found = Neighbour { cell, dx, dy, distance: (dx * dx + dy * dy).sqrt() };
            if found.distance < nearest.distance {
                (nearest, second) = (found, nearest);
            } else if found.distance < second.distance {
                second = found;
            }
        }
    }
    (nearest, second)
}

/// One of the palette's colors, a little lighter or darker.
fn color(cell: (i32, i32)) -> [f32; 3] {
    const PALETTE: [[f32; 3]; 8] = [
        [0.70, 0.13, 0.06],
        [0.85, 0.42, 0.07],
        [0.80, 0.66, 0.22],
        [0.16, 0.42, 0.12],
        [0.04, 0.36, 0.42],
        [0.07, 0.14, 0.46],
        [0.34, 0.08, 0.33],
        [0.62, 0.58, 0.50],
    ];
    let pick = (random(cell, 2) * PALETTE.len() as f32) as usize;
    let shade = 0.75 + 0.5 * random(cell, 3);
    PALETTE[pick.min(PALETTE.len() - 1)].map(|v| v * shade)
}

/// The strength of a pale vein at an offset from the center of a stone: bands in a direction chosen per
/// stone.
fn vein(cell: (i32, i32), dx: f32, dy: f32) -> f32 {
    let (a, b) = (random(cell, 4) - 0.5, random(cell, 5) - 0.5);
    let length = (a * a + b * b).sqrt().max(1e-3);
    let bend = 0.25 * (dx * b - dy * a) / length;
    let across = (dx * a + dy * b) / length * (3.0 + 3.0 * random(cell, 6)) + bend * bend * 4.0;
    let to_band = (across - across.floor() - 0.5).abs();
    0.35 * random(cell, 7) * smooth(0.36, 0.5, to_band)
}

/// A number in 0..1 for a cell and a purpose.
fn random(cell: (i32, i32), purpose: u32) -> f32 {
    let mut h =
        (cell.0 as u32).wrapping_mul(0x9e37_79b1) ^ (cell.1 as u32).wrapping_mul(0x85eb_ca6b) ^ purpose;
    for _ in 0..3 {
        h ^= h >> 15;
        h = h.wrapping_mul(0x2c1b_3c6d);
    }
    (h >> 8) as f32 / (1 << 24) as f32
}

fn smooth(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
