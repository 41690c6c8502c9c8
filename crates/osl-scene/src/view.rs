//! A surface as a camera sees it: the surface points at its pixels.

use crate::camera::{Camera, View};
use crate::math;
use crate::mesh::{Bounds, SurfacePoint};
use crate::shape::Surface;
use crate::surface_points::{Footprint, SurfacePoints};
use glam::Vec3;
use osl_exec::Blocks;
use rayon::prelude::*;

/// The points of a picture. Only pixels that show the surface have one.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The points; neighbours on the image are adjacent.
    pub points: SurfacePoints,
    /// The pixel of each point, numbered row by row from the top.
    pub pixels: Vec<u32>,
}

/// Pixels per task.
const TILE: usize = 1 << 12;

/// Traces a ray through the centre of each pixel.
pub fn look(view: &View, surface: &dyn Surface) -> Seen {
    let [width, height] = view.resolution();
    let count = width * height;
    let blocks = Blocks::new(width, height);
    let tiles: Vec<Vec<(u32, SurfacePoint, Vec3, Footprint)>> = (0..count.div_ceil(TILE))
        .into_par_iter()
        .map(|tile| {
            let first = tile * TILE;
            let mut found = Vec::new();
            blocks.each(first, TILE.min(count - first), |_, (x, y)| {
                let ray = view.ray(x as f32 + 0.5, y as f32 + 0.5);
                if let Some((_, point)) = surface.hit(ray.origin, ray.direction, 0.0..f32::INFINITY) {
                    let footprint = Footprint::of(&point, &ray);
                    found.push(((y * width + x) as u32, point, ray.direction, footprint));
                }
            });
            found
        })
        .collect();
    gathered(view, tiles, surface)
}

/// Traces a ray through each of some places of the image, in pixels from its upper left corner. `pixels` of
/// the result has the number of the place of each point. The footprints are those of a pixel.
pub fn look_at(view: &View, surface: &dyn Surface, places: &[[f32; 2]]) -> Seen {
    let found: Vec<Vec<(u32, SurfacePoint, Vec3, Footprint)>> = places
        .par_chunks(TILE)
        .enumerate()
        .map(|(tile, places)| {
            let hit = |(at, [x, y]): (usize, &[f32; 2])| {
                let ray = view.ray(*x, *y);
                let (_, point) = surface.hit(ray.origin, ray.direction, 0.0..f32::INFINITY)?;
                let footprint = Footprint::of(&point, &ray);
                Some(((tile * TILE + at) as u32, point, ray.direction, footprint))
            };
            places.iter().enumerate().filter_map(hit).collect()
        })
        .collect();
    gathered(view, found, surface)
}

fn gathered(
    view: &View,
    tiles: Vec<Vec<(u32, SurfacePoint, Vec3, Footprint)>>,
    surface: &dyn Surface,
) -> Seen {
    let hits = tiles.iter().map(Vec::len).sum();
    let (area, camera) = (surface.area(), view.facts(clip(surface.reach())));
    let points = SurfacePoints::with_capacity(hits).seen_by(camera);
    let mut seen = Seen { points, pixels: Vec::with_capacity(hits) };
    for (pixel, point, direction, footprint) in tiles.into_iter().flatten() {
        seen.points.push(point, direction, footprint, area);
        seen.pixels.push(pixel);
    }
    seen
}

/// The nearest and the farthest distance of a view of a surface with this reach.
pub fn clip(reach: f32) -> [f32; 2] {
    [reach * 0.01, reach * 100.0]
}

/// Field of view of the camera for a single surface.
const FOV_DEGREES: f32 = 30.0;
/// Factor on the minimum distance of that camera.
const MARGIN: f32 = 1.03;

/// A camera that shows a whole surface with a box and a reach: from `eye`, or from the front, slightly from
/// the right and from above, more so if the box is flat.
pub fn camera_for(bounds: &Bounds, reach: f32, eye: Option<Vec3>, resolution: [usize; 2]) -> Camera {
    let (center, reach) = (bounds.center(), reach.max(f32::MIN_POSITIVE));
    let flat = (bounds.max.y - bounds.min.y) < 0.1 * reach;
    let direction = if flat { Vec3::new(0.3, 1.2, 1.0) } else { Vec3::new(0.5, 0.6, 1.2) };
    // The bounding sphere of the surface nearly touches the narrower side of the image.
    let [width, height] = resolution.map(|n| n as f32);
    let narrow = math::tan((FOV_DEGREES * 0.5).to_radians()) * (height / width).min(1.0);
    let distance = reach / math::sin(math::atan(narrow)) * MARGIN;
    let position = eye.unwrap_or(center + direction.normalize() * distance);
    Camera { position, look_at: center, up: Vec3::Y, fov_degrees: FOV_DEGREES, resolution }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Shape;

    #[test]
    fn the_picture_shows_all_of_the_surface_and_little_else() {
        for (name, shape) in Shape::NAMED {
            for resolution in [[64, 64], [96, 48], [40, 80]] {
                let camera = camera_for(&shape.bounds(), shape.reach(), None, resolution);
                let seen = look(&camera.view().unwrap(), &shape);
                let [width, height] = resolution;
                let at_border = |pixel: &u32| {
                    let (x, y) = (*pixel as usize % width, *pixel as usize / width);
                    x == 0 || y == 0 || x + 1 == width || y + 1 == height
                };
                assert!(!seen.pixels.iter().any(at_border), "{name} {resolution:?}");
                let narrow = width.min(height);
                assert!(
                    seen.pixels.len() > narrow * narrow / 5,
                    "{name} {resolution:?}: {}",
                    seen.pixels.len()
                );
                let mut once = seen.pixels.clone();
                once.sort_unstable();
                once.dedup();
                assert_eq!(once.len(), seen.points.points().len());
            }
        }
    }
}
