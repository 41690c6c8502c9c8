//! The renderer that reference values were recorded with: a grid with its own data, attributes and kinds of rays.

use crate::golden::Golden;
use osl_exec::{Blocks, Datum, PointSource, Services};
use osl_image::TextureCache;
use osl_ir::hir::Global;
use osl_ir::ir::{Axis, Const};
use osl_scene::{Grid, reference_spaces};

/// The grid of a recorded run, with what its renderer answers.
#[derive(Clone, Debug)]
pub struct Host {
    /// The points.
    pub grid: Grid,
    /// Globals whose slopes differ from point to point.
    vary: Vec<Global>,
    /// Data of the primitive: name and value.
    data: Vec<(String, Const)>,
    /// Kind of ray.
    ray: String,
}

impl Host {
    /// The conditions of a recorded run.
    pub fn new(golden: &Golden) -> Host {
        let grid = Grid {
            width: golden.size.0,
            height: golden.size.1,
            scale: golden.scale,
            offset: golden.offset,
            center: golden.center,
        };
        let mut host = Host { grid, vary: Vec::new(), data: Vec::new(), ray: String::new() };
        for key in &golden.other {
            let words: Vec<&str> = key.split_whitespace().collect();
            match words[..] {
                ["vary", "pdxdy"] => host.vary.push(Global::P),
                ["vary", "udxdy"] => host.vary.push(Global::U),
                ["vary", "vdxdy"] => host.vary.push(Global::V),
                ["raytype", name] => host.ray = name.to_string(),
                ["userdata", "float", name, value] => {
                    host.data.push((name.to_string(), Const::Float(value.parse().unwrap_or(0.0))));
                }
                ["userdata", _, name, value] => {
                    let mut parts = value.split(',').map(|x| x.parse().unwrap_or(0.0));
                    let triple = std::array::from_fn(|_| parts.next().unwrap_or(0.0));
                    host.data.push((name.to_string(), Const::Triple(triple)));
                }
                _ => {}
            }
        }
        host
    }

    /// Named spaces, textures and the kind of ray.
    pub fn services(&self) -> Services {
        Services {
            ray: self.ray.clone(),
            spaces: reference_spaces(self.grid.width, self.grid.height),
            textures: TextureCache::new(vec![crate::run::root().join("tests/data/textures")]),
        }
    }

    fn uv(&self, point: usize) -> [f32; 2] {
        let (width, height) = (self.grid.width, self.grid.height);
        let (x, y) = self.grid.order().pixel(point);
        [self.grid.coordinate(0, x, width), self.grid.coordinate(1, y, height)]
    }

    /// A slope that differs from point to point.
    fn own_slope(&self, global: Global, axis: Axis, [u, v]: [f32; 2]) -> [f32; 3] {
        match (global, axis) {
            (Global::P, Axis::X) => [1.0 - u, 1.0 - v, u * 0.5],
            (Global::P, Axis::Y) => [1.0 - v, 1.0 - u, v * 0.5],
            (Global::U, Axis::X) => [1.0 - u, 0.0, 0.0],
            (Global::U, Axis::Y) => [u, 0.0, 0.0],
            (Global::V, Axis::X) => [1.0 - v, 0.0, 0.0],
            (Global::V, Axis::Y) => [v, 0.0, 0.0],
            _ => [0.0; 3],
        }
    }

    fn slopes(&self, global: Global, uv: [f32; 2]) -> [f32; 2] {
        Axis::BOTH.map(|axis| {
            let own = self.vary.contains(&global);
            if own { self.own_slope(global, axis, uv)[0] } else { self.grid.slope(global, axis)[0] }
        })
    }
}

impl PointSource for Host {
    fn count(&self) -> usize {
        self.grid.count()
    }

    fn blocks(&self) -> Option<Blocks> {
        self.grid.blocks()
    }

    fn varying(&self) -> &[Global] {
        self.grid.varying()
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        match global {
            Global::SurfaceArea => [1.0, 0.0, 0.0],
            _ => self.grid.uniform(global),
        }
    }

    fn slope(&self, global: Global, axis: Axis) -> [f32; 3] {
        self.grid.slope(global, axis)
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        self.grid.fill(global, first, width, lanes);
    }

    fn varying_slopes(&self) -> &[Global] {
        &self.vary
    }

    fn fill_slope(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        let last = self.count().saturating_sub(1);
        for (component, lanes) in lanes.chunks_mut(width).enumerate() {
            for (lane, out) in lanes.iter_mut().enumerate() {
                *out = self.own_slope(global, axis, self.uv((first + lane).min(last)))[component];
            }
        }
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        let [u, v] = self.uv(point);
        let float = |x: f32| Some(Datum::one(Const::Float(x)));
        let aspect = self.grid.width as f32 / self.grid.height as f32;
        let floats = |list: &[f32]| Some(Datum::array(list.iter().map(|x| Const::Float(*x)).collect()));
        if (object, name) == ("options", "blahblah") {
            // The recorder's own number, not π.
            return float(314_159.0 / 100_000.0);
        }
        if !matches!(object, "" | "global") || element.is_some() {
            return None;
        }
        if let Some((_, value)) = self.data.iter().find(|(n, _)| n == name) {
            return Some(Datum::one(value.clone()));
        }
        match name {
            "s" => Some(Datum { slopes: self.slopes(Global::U, [u, v]), ..Datum::one(Const::Float(u)) }),
            "t" => Some(Datum { slopes: self.slopes(Global::V, [u, v]), ..Datum::one(Const::Float(v)) }),
            "red" if u > 0.5 => float(u),
            "green" if u < 0.5 => float(v),
            "blue" if (v * 12.0) as i32 % 2 == 0 => float(1.0 - u),
            "shading:index" => Some(Datum::one(Const::Int(self.grid.order().position(point) as i32))),
            "osl:version" => Some(Datum::one(Const::Int(11312))),
            "camera:resolution" => {
                let side = |n: usize| Const::Int(n as i32);
                Some(Datum::array(vec![side(self.grid.width), side(self.grid.height)]))
            }
            "camera:projection" => Some(Datum::one(Const::Str("perspective".into()))),
            "camera:fov" => float(90.0),
            "camera:pixelaspect" => float(1.0),
            "camera:clip" => floats(&[0.1, 1000.0]),
            "camera:clip_near" => float(0.1),
            "camera:clip_far" => float(1000.0),
            "camera:shutter" => floats(&[0.0, 1.0]),
            "camera:shutter_open" => float(0.0),
            "camera:shutter_close" => float(1.0),
            "camera:screen_window" => floats(&[-aspect, -1.0, aspect, 1.0]),
            _ => None,
        }
    }
}
