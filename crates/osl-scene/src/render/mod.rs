//! A small path tracer for previews.
//!
//! The picture is divided into tiles, each computed by one thread. A tile follows thousands of paths at once,
//! surface by surface, so that shaders run over many points of one material together. The result of a tile
//! depends only on the world, the options and its position, not on threads.

mod denoise;
mod layers;
mod path;
mod sampler;
mod shade;
mod tile;
mod tone;
mod walk;
mod world;

pub use denoise::{REACH, denoise};
pub use layers::Layer;
pub use path::Strategy;
pub use tone::{Curve, display, tone};
pub use world::{Body, Ground, Material, Object, World};

use osl_exec::{RunError, Said};
use osl_ir::types::Type;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use tile::{SIDE, Tile};

/// Options of the renderer.
#[derive(Clone, Copy, Debug)]
pub struct RenderOptions {
    /// Paths per pixel, as far as the limits permit; with `max_error`, only where needed.
    pub samples: u32,
    /// A pixel is finished when its standard error falls below this; measured in displayed brightness, from 0
    /// to 1.
    pub max_error: Option<f32>,
    /// Seed of the random numbers.
    pub seed: u32,
    /// How directions to lights are sampled.
    pub strategy: Strategy,
    /// The largest contribution of light that reaches the visible surface from another one: larger ones are
    /// reduced to it. That removes single bright pixels, and makes the picture slightly darker.
    pub clamp: Option<f32>,
    /// The first column, the column after the last one, and the same for rows: only tiles with such pixels
    /// are computed. [`Picture::crop`] drops all others.
    pub crop: Option<[usize; 4]>,
}

impl Default for RenderOptions {
    fn default() -> Self {
        RenderOptions {
            samples: 16,
            max_error: None,
            seed: 0,
            strategy: Strategy::Both,
            clamp: None,
            crop: None,
        }
    }
}

/// A picture.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// Its width in pixels.
    pub width: usize,
    /// Its height in pixels.
    pub height: usize,
    /// The light, whose name is empty; `samples` and `error` of each pixel; `albedo`, `normal` and `depth` of
    /// the visible surface; marks and outputs of its shaders.
    pub layers: Vec<Layer>,
    /// Messages of shaders, each once.
    pub messages: Vec<Said>,
    /// Messages of the shader of the camera.
    pub camera: Vec<Said>,
    /// Closures of shaders that are not rendered.
    pub unknown: Vec<Arc<str>>,
    /// Number of paths.
    pub samples: u64,
    /// Number of rays.
    pub rays: u64,
    /// Number of contributions of light that were reduced to the maximum.
    pub clamped: u64,
}

impl Picture {
    /// Keeps these columns and rows.
    pub fn crop(&mut self, columns: Range<usize>, rows: Range<usize>) {
        let width = self.width;
        let columns = columns.start.min(width)..columns.end.min(width);
        let rows = rows.start.min(self.height)..rows.end.min(self.height);
        let row = |plane: &[f32], row: usize| {
            plane.get(row * width + columns.start..row * width + columns.end).unwrap_or_default().to_vec()
        };
        for plane in self.layers.iter_mut().flat_map(|layer| &mut layer.planes) {
            *plane = rows.clone().flat_map(|at| row(plane, at)).collect();
        }
        (self.width, self.height) = (columns.len(), rows.len());
    }
}

/// Whether a tile has pixels of a crop.
fn touches([left, top, columns, rows]: [usize; 4], [x0, x1, y0, y1]: [usize; 4]) -> bool {
    left < x1 && x0 < left + columns && top < y1 && y0 < top + rows
}

/// Renders a picture on the threads of the current pool. `progress` is called with the completed share, from
/// 0 to 1.
///
/// # Errors
/// A shader exceeds its budget, or the command has to stop.
pub fn render(
    world: &World,
    options: &RenderOptions,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<Picture, RunError> {
    let [width, height] = world.view.resolution();
    let areas: Vec<[usize; 4]> = (0..height)
        .step_by(SIDE)
        .flat_map(|y| {
            (0..width).step_by(SIDE).map(move |x| [x, y, SIDE.min(width - x), SIDE.min(height - y)])
        })
        .filter(|area| options.crop.is_none_or(|crop| touches(*area, crop)))
        .collect();
    let most = u32::try_from(world.limits.scenes.samples).unwrap_or(u32::MAX).max(1);
    let options = RenderOptions { samples: options.samples.clamp(1, most), ..*options };
    let done = AtomicUsize::new(0);
    // Tiles are distributed one by one, since some take much longer than others.
    let tiles: Vec<Result<Tile, RunError>> = areas
        .par_iter()
        .with_max_len(1)
        .map(|area| {
            let tile = Tile::render(world, &options, *area, width);
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / areas.len().max(1) as f32);
            tile
        })
        .collect();
    let mut picture = Picture { width, height, ..Picture::default() };
    let mut notes = path::Notes::default();
    let size = width * height;
    let plane = || vec![0.0; size];
    let mut light = vec![plane(), plane(), plane()];
    let (mut samples, mut error) = (plane(), plane());
    for tile in tiles {
        let mut tile = tile?;
        let [left, top, columns, rows] = tile.area;
        let place = |pixel: usize| (top + pixel / columns) * width + left + pixel % columns;
        for pixel in 0..columns * rows {
            for (plane, x) in light.iter_mut().zip(tile.mean(pixel).to_array()) {
                plane[place(pixel)] = x;
            }
            samples[place(pixel)] = tile.count(pixel) as f32;
            error[place(pixel)] = tile.error(pixel);
            picture.samples += u64::from(tile.count(pixel));
        }
        for said in tile.notes.messages.iter_mut().chain(&mut tile.notes.camera) {
            said.first = place(said.first);
        }
        notes.add(std::mem::take(&mut tile.notes), &world.limits);
        let counts: Vec<u32> = (0..columns * rows).map(|pixel| tile.count(pixel)).collect();
        tile.layers.finish(&mut picture.layers, size, |pixel| counts.get(pixel).copied().unwrap_or(0), place);
    }
    let own = [
        ("", Type::COLOR, light),
        ("samples", Type::FLOAT, vec![samples]),
        ("error", Type::FLOAT, vec![error]),
    ];
    let own = own.map(|(name, ty, planes)| Layer { name: name.into(), ty, planes });
    picture.layers.splice(0..0, own);
    picture.rays = notes.rays;
    picture.clamped = notes.clamped;
    picture.messages = notes.messages;
    picture.camera = notes.camera;
    picture.unknown = notes.unknown;
    Ok(picture)
}
