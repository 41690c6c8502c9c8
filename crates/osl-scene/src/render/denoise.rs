//! Removes noise from a picture, guided by its layers.
//!
//! H. Dammertz, D. Sewtz, J. Hanika and H. Lensch, "Edge-Avoiding À-Trous Wavelet Transform for fast Global
//! Illumination Filtering", 2010. The light is divided by the color of the surface first, so that a pattern
//! stays sharp whatever is averaged; a neighbour counts less the more its surface and its light differ, and
//! the light may differ by more where the renderer knows less.

use super::Picture;
use super::layers::Layer;
use super::tone::display;
use glam::Vec3;
use rayon::prelude::*;

/// Distances between the samples of each round, in pixels.
const STEPS: [usize; 4] = [1, 2, 4, 8];
/// How far away pixels can change a pixel: by the rounds, spikes and estimated errors.
pub const REACH: usize = 2 * (1 + 2 + 4 + 8) + 1 + AROUND;
/// The weights of a row of samples: a cubic B-spline.
const KERNEL: [f32; 5] = [1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];
/// Differences of displayed brightness that count as the same, beside those of the noise.
const SAME_LIGHT: f32 = 0.008;
/// How many standard errors may be between the same light.
const ERRORS: f32 = 3.0;
/// The error of a pixel is the mean up to this distance: few samples of one pixel may all be equal by chance.
const AROUND: usize = 2;
/// Colors below this do not scale the light.
const DARK: f32 = 0.02;

/// What guides the filter at a pixel.
#[derive(Clone, Copy, Default)]
struct Guide {
    color: Vec3,
    normal: Vec3,
    depth: f32,
    /// The estimated error of displayed brightness.
    error: f32,
}

/// Replaces the light of a picture by a smoother one. Pixels without a surface stay as they are.
pub fn denoise(picture: &mut Picture) {
    let (width, height) = (picture.width, picture.height);
    let Some(guides) = guides(picture) else { return };
    let scale = |guide: &Guide| guide.color.max(Vec3::splat(DARK));
    let mut light: Vec<Vec3> = triples(picture.layers.first(), width * height);
    light.iter_mut().zip(&guides).for_each(|(x, guide)| *x /= scale(guide));
    light = without_spikes(&light, &guides, [width, height]);
    for (round, step) in STEPS.into_iter().enumerate() {
        // Each round leaves less noise, so that smaller differences are meant.
        let tolerance = ERRORS / (1 << round) as f32;
        light = smoothed(&light, &guides, [width, height], step, tolerance);
    }
    light.iter_mut().zip(&guides).for_each(|(x, guide)| *x *= scale(guide));
    if let Some(layer) = picture.layers.first_mut() {
        for (component, plane) in layer.planes.iter_mut().enumerate().take(3) {
            for ((to, from), guide) in plane.iter_mut().zip(&light).zip(&guides) {
                if guide.depth.is_finite() {
                    *to = from[component];
                }
            }
        }
    }
}

fn layer<'a>(picture: &'a Picture, name: &str) -> Option<&'a Layer> {
    picture.layers.iter().find(|layer| &*layer.name == name)
}

fn triples(layer: Option<&Layer>, count: usize) -> Vec<Vec3> {
    let value = |at: usize, component: usize| {
        let plane = layer.and_then(|layer| layer.planes.get(component));
        plane.and_then(|plane| plane.get(at)).copied().unwrap_or(0.0)
    };
    (0..count).map(|at| Vec3::new(value(at, 0), value(at, 1), value(at, 2))).collect()
}

/// The guides of all pixels; `None` if the picture lacks a layer.
fn guides(picture: &Picture) -> Option<Vec<Guide>> {
    let (width, height) = (picture.width, picture.height);
    let count = width * height;
    let (colors, normals) = (layer(picture, "albedo")?, layer(picture, "normal")?);
    let (colors, normals) = (triples(Some(colors), count), triples(Some(normals), count));
    let depths = layer(picture, "depth")?.planes.first()?;
    let errors = layer(picture, "error")?.planes.first()?;
    let error = |at: usize| {
        // The estimate of a single pixel is noisy itself; that of its neighbourhood is less so.
        let (x, y) = (at % width, at / width);
        let (mut sum, mut n) = (0.0, 0.0);
        for y in y.saturating_sub(AROUND)..(y + AROUND + 1).min(height) {
            for x in x.saturating_sub(AROUND)..(x + AROUND + 1).min(width) {
                let here = errors.get(y * width + x).copied().filter(|e| e.is_finite()).unwrap_or(1.0);
                (sum, n) = (sum + here, n + 1.0);
            }
        }
        sum / f32::max(n, 1.0)
    };
    let guide = |at: usize| Guide {
        color: colors.get(at).copied().unwrap_or_default(),
        normal: normals.get(at).copied().unwrap_or_default(),
        depth: depths.get(at).copied().unwrap_or(f32::INFINITY),
        error: error(at),
    };
    Some((0..count).into_par_iter().map(guide).collect())
}

/// The light without single pixels that are brighter than all pixels around them, or darker: these are paths
/// that found a lamp by chance, or all missed it.
fn without_spikes(light: &[Vec3], guides: &[Guide], [width, height]: [usize; 2]) -> Vec<Vec3> {
    let brightness: Vec<f32> = light.par_iter().map(|x| x.element_sum()).collect();
    let pixel = |at: usize| {
        let (x, y) = (at % width, at / width);
        let (Some(own), Some(&lit), Some(&bright)) = (guides.get(at), light.get(at), brightness.get(at))
        else {
            return Vec3::ZERO;
        };
        // The second brightest and the second darkest, since spikes come in pairs.
        let mut most = [0.0_f32; 2];
        let mut least = [(f32::INFINITY, at); 2];
        for y in y.saturating_sub(1)..(y + 2).min(height) {
            for x in x.saturating_sub(1)..(x + 2).min(width) {
                let other = y * width + x;
                let is_like = guides.get(other).is_some_and(|guide| other != at && alike(own, guide) > 0.0);
                if let Some(there) = brightness.get(other).copied().filter(|_| is_like) {
                    most = [most[0].max(there), most[1].max(there.min(most[0]))];
                    let found = (there, other);
                    least = match least {
                        [first, _] if there < first.0 => [found, first],
                        [first, second] if there < second.0 => [first, found],
                        both => both,
                    };
                }
            }
        }
        let [_, (dark, darker)] = least;
        if !own.depth.is_finite() {
            lit
        } else if most[1] > 0.0 && bright > most[1] {
            lit * (most[1] / bright)
        } else if dark.is_finite() && bright < dark {
            light.get(darker).copied().unwrap_or(lit)
        } else {
            lit
        }
    };
    (0..light.len()).into_par_iter().map(pixel).collect()
}

fn smoothed(
    light: &[Vec3],
    guides: &[Guide],
    [width, height]: [usize; 2],
    step: usize,
    tolerance: f32,
) -> Vec<Vec3> {
    // The brightness as it is displayed, where differences are as visible as they are large.
    let seen: Vec<f32> = light.par_iter().map(|x| display(x.element_sum() / 6.0)).collect();
    let pixel = |at: usize| {
        let (x, y) = (at % width, at / width);
        let (Some(own), Some(&lit), Some(&bright)) = (guides.get(at), light.get(at), seen.get(at)) else {
            return Vec3::ZERO;
        };
        if !own.depth.is_finite() {
            return lit;
        }
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for (row, by_row) in KERNEL.into_iter().enumerate() {
            let Some(y) = (y + row * step).checked_sub(2 * step).filter(|y| *y < height) else { continue };
            for (column, by_column) in KERNEL.into_iter().enumerate() {
                let Some(x) = (x + column * step).checked_sub(2 * step).filter(|x| *x < width) else {
                    continue;
                };
                let other = y * width + x;
                let (Some(guide), Some(&there), Some(&other)) =
                    (guides.get(other), light.get(other), seen.get(other))
                else {
                    continue;
                };
                let same = SAME_LIGHT + tolerance * (own.error + guide.error);
                let weight = by_row * by_column * alike(own, guide) * bell((bright - other) / same);
                sum += there * weight;
                weights += weight;
            }
        }
        if weights > 0.0 && sum.is_finite() { sum / weights } else { lit }
    };
    (0..light.len()).into_par_iter().map(pixel).collect()
}

/// 1 at 0, and 0 from 1 on.
fn bell(x: f32) -> f32 {
    let x = (1.0 - x * x).max(0.0);
    x * x
}

/// How far two pixels show the same surface, from 0 to 1.
fn alike(a: &Guide, b: &Guide) -> f32 {
    let bend = 1.0 - a.normal.dot(b.normal).clamp(0.0, 1.0);
    let depth = (a.depth - b.depth).abs() / (0.1 * a.depth.min(b.depth)).max(1e-6);
    let color = (a.color - b.color).abs().max_element();
    bell(bend / 0.25) * bell(depth) * bell(color / 0.35)
}

#[cfg(test)]
mod tests {
    use super::*;
    use osl_ir::types::Type;

    /// A picture of two surfaces side by side whose light is the same except for noise.
    fn noisy(size: usize) -> Picture {
        let count = size * size;
        let left = |at: usize| at % size < size / 2;
        let random = |at: usize| (at.wrapping_mul(2_654_435_761) >> 7) as f32 % 1000.0 / 1000.0 - 0.5;
        let color = |at: usize| if left(at) { 0.2 } else { 0.8 };
        let plane = |of: &dyn Fn(usize) -> f32| (0..count).map(of).collect::<Vec<f32>>();
        let layer = |name: &str, ty: Type, planes: Vec<Vec<f32>>| Layer { name: name.into(), ty, planes };
        let light = plane(&|at| color(at) * (1.0 + 0.3 * random(at)));
        let colors = plane(&color);
        let facing = plane(&|_| 1.0);
        let none = plane(&|_| 0.0);
        let layers = vec![
            layer("", Type::COLOR, vec![light; 3]),
            layer("error", Type::FLOAT, vec![plane(&|_| 0.05)]),
            layer("albedo", Type::COLOR, vec![colors; 3]),
            layer("normal", Type::NORMAL, vec![none.clone(), none, facing]),
            layer("depth", Type::FLOAT, vec![plane(&|_| 3.0)]),
        ];
        Picture { width: size, height: size, layers, ..Picture::default() }
    }

    #[test]
    fn noise_goes_and_edges_stay() {
        let size = 32;
        let mut picture = noisy(size);
        let error = |picture: &Picture| {
            let plane = &picture.layers[0].planes[0];
            let off = |at: usize| plane[at] / if at % size < size / 2 { 0.2 } else { 0.8 } - 1.0;
            (0..plane.len()).map(|at| off(at).powi(2)).sum::<f32>().sqrt()
        };
        let before = error(&picture);
        denoise(&mut picture);
        assert!(error(&picture) < 0.25 * before, "{before} {}", error(&picture));
    }

    #[test]
    fn single_bright_pixels_go() {
        let mut picture = noisy(16);
        for plane in &mut picture.layers[0].planes {
            (plane[5 * 16 + 4], plane[5 * 16 + 5]) = (100.0, 80.0);
        }
        denoise(&mut picture);
        assert!(picture.layers[0].planes[0].iter().all(|x| *x < 1.0));
    }

    #[test]
    fn single_dark_pixels_go() {
        let mut picture = noisy(16);
        for plane in &mut picture.layers[0].planes {
            (plane[5 * 16 + 4], plane[5 * 16 + 5]) = (0.0, 0.0);
        }
        denoise(&mut picture);
        assert!(picture.layers[0].planes[0].iter().all(|x| *x > 0.1));
    }

    #[test]
    fn pixels_without_a_surface_stay() {
        let mut picture = noisy(8);
        let before = picture.layers[0].clone();
        picture.layers[4].planes[0].fill(f32::INFINITY);
        denoise(&mut picture);
        assert_eq!(picture.layers[0], before);
        picture.layers.truncate(2);
        denoise(&mut picture);
        assert_eq!(picture.layers[0], before, "without guides nothing changes");
    }
}
