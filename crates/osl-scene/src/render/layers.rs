//! The layers of a picture besides its light, as sums over the samples of each pixel.

use glam::Vec3;
use osl_exec::Plane;
use osl_ir::types::Type;
use std::sync::Arc;

/// A layer of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Its name; empty for the light itself.
    pub name: Arc<str>,
    /// The type of its values: a color, a normal, a float …
    pub ty: Type,
    /// A plane for each component, with a value for each pixel, row by row from the top.
    pub planes: Vec<Vec<f32>>,
}

/// A layer in progress.
#[derive(Clone, Debug)]
struct Sum {
    name: Arc<str>,
    ty: Type,
    planes: Vec<Vec<f32>>,
}

/// The layers of the pixels of a tile.
#[derive(Clone, Debug)]
pub(super) struct Layers {
    pixels: usize,
    list: Vec<Sum>,
    /// Number of each pixel's samples that hit a surface.
    hits: Vec<u32>,
}

const ALBEDO: usize = 0;
const NORMAL: usize = 1;
const DEPTH: usize = 2;

impl Layers {
    pub(super) fn new(pixels: usize) -> Layers {
        let mut layers = Layers { pixels, list: Vec::new(), hits: vec![0; pixels] };
        for (name, ty) in [("albedo", Type::COLOR), ("normal", Type::NORMAL), ("depth", Type::FLOAT)] {
            layers.layer(name, ty);
        }
        layers
    }

    /// The layer with a name, created if necessary.
    fn layer(&mut self, name: &str, ty: Type) -> usize {
        if let Some(at) = self.list.iter().position(|l| &*l.name == name) {
            return at;
        }
        let count = if ty == Type::MATRIX {
            16
        } else if ty.is_triple() {
            3
        } else {
            1
        };
        self.list.push(Sum { name: name.into(), ty, planes: vec![vec![0.0; self.pixels]; count] });
        self.list.len() - 1
    }

    fn add(&mut self, layer: usize, pixel: usize, component: usize, x: f32) {
        let plane = self.list.get_mut(layer).and_then(|l| l.planes.get_mut(component));
        if let Some(sum) = plane.and_then(|p| p.get_mut(pixel)).filter(|_| x.is_finite()) {
            *sum += x;
        }
    }

    fn add_triple(&mut self, layer: usize, pixel: usize, x: Vec3) {
        for (component, x) in x.to_array().into_iter().enumerate() {
            self.add(layer, pixel, component, x);
        }
    }

    pub(super) fn add_surface(&mut self, pixel: usize, albedo: Vec3, n: Vec3, depth: f32) {
        self.add_triple(ALBEDO, pixel, albedo);
        self.add_triple(NORMAL, pixel, n);
        self.add(DEPTH, pixel, 0, depth);
        if let Some(hits) = self.hits.get_mut(pixel) {
            *hits += 1;
        }
    }

    pub(super) fn add_mark(&mut self, pixel: usize, name: &str, color: Vec3) {
        let layer = self.layer(name, Type::COLOR);
        self.add_triple(layer, pixel, color);
    }

    pub(super) fn add_outputs(&mut self, pixel: usize, planes: &[Plane], point: usize) {
        for plane in planes {
            let Some(word) = plane.words.get(point) else { continue };
            let x = match plane.kind {
                osl_ir::ir::Kind::Int => *word as i32 as f32,
                _ => f32::from_bits(*word),
            };
            let layer = self.layer(&plane.output, plane.ty);
            self.add(layer, pixel, plane.component, x);
        }
    }

    /// Writes the means to the layers of a picture; `place` maps pixels to those of the picture. Depth is the
    /// mean over the samples that hit something, and infinite if none does.
    pub(super) fn finish(
        self,
        picture: &mut Vec<Layer>,
        size: usize,
        samples: impl Fn(usize) -> u32,
        place: impl Fn(usize) -> usize,
    ) {
        for (index, sum) in self.list.into_iter().enumerate() {
            let at = picture.iter().position(|l| l.name == sum.name).unwrap_or_else(|| {
                let planes = vec![vec![0.0; size]; sum.planes.len()];
                picture.push(Layer { name: sum.name.clone(), ty: sum.ty, planes });
                picture.len() - 1
            });
            for (to, from) in picture[at].planes.iter_mut().zip(sum.planes) {
                for (pixel, x) in from.into_iter().enumerate() {
                    let hits = self.hits.get(pixel).copied().unwrap_or(0);
                    let mean = match index {
                        DEPTH if hits == 0 => f32::INFINITY,
                        DEPTH => x / hits as f32,
                        _ => x / samples(pixel).max(1) as f32,
                    };
                    if let Some(to) = to.get_mut(place(pixel)) {
                        *to = mean;
                    }
                }
            }
        }
    }
}
