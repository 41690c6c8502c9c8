//! The renderer of the reference's grid tool: a grid with its own spaces, data and attributes, used for
//! recorded values. OSL language specification, "testshade"; its answers were measured.

use crate::camera_facts::CameraFacts;
use crate::grid::{Grid, reference_spaces};
use osl_exec::{Answer, Blocks, Datum, PointSource, Spaces};
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Const};
use osl_ir::types::Type;

/// A grid, with the answers of the grid tool's renderer.
#[derive(Clone, Debug)]
pub struct ReferenceRenderer {
    /// The points.
    pub grid: Grid,
    /// Globals whose derivatives differ from point to point: P, u, v.
    pub vary: Vec<Global>,
    /// Data of the primitive: name and value.
    pub data: Vec<(String, Datum)>,
    /// The answer to `osl:version`.
    pub version: i32,
}

impl ReferenceRenderer {
    /// The renderer of a grid, without additional data.
    pub fn new(grid: Grid) -> ReferenceRenderer {
        ReferenceRenderer { grid, vary: Vec::new(), data: Vec::new(), version: 11312 }
    }

    /// Its named spaces.
    pub fn spaces(&self) -> Spaces {
        reference_spaces(self.grid.width, self.grid.height)
    }

    fn uv(&self, point: usize) -> [f32; 2] {
        let (width, height) = (self.grid.width, self.grid.height);
        let (x, y) = self.grid.order().pixel(point);
        [self.grid.coordinate(0, x, width), self.grid.coordinate(1, y, height)]
    }

    /// A derivative that differs from point to point.
    fn own_deriv(&self, global: Global, axis: Axis, [u, v]: [f32; 2]) -> [f32; 3] {
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

    fn derivs(&self, global: Global, uv: [f32; 2]) -> [f32; 2] {
        Axis::BOTH.map(|axis| {
            let own = self.vary.contains(&global);
            if own { self.own_deriv(global, axis, uv)[0] } else { self.grid.deriv(global, axis)[0] }
        })
    }
}

impl PointSource for ReferenceRenderer {
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
            // There is no eye, and the tool knows no handedness.
            Global::I | Global::LeftHanded => [0.0; 3],
            _ => self.grid.uniform(global),
        }
    }

    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        self.grid.deriv(global, axis)
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        self.grid.fill(global, first, width, lanes);
    }

    fn varying_derivs(&self) -> &[Global] {
        &self.vary
    }

    fn fill_deriv(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        let last = self.count().saturating_sub(1);
        for (component, lanes) in lanes.chunks_mut(width).enumerate() {
            for (lane, out) in lanes.iter_mut().enumerate() {
                *out = self.own_deriv(global, axis, self.uv((first + lane).min(last)))[component];
            }
        }
    }

    fn traces(&self) -> bool {
        true
    }

    fn trace(&self, origin: [f32; 3], direction: [f32; 3], point: usize) -> bool {
        let [u, _] = self.uv(point);
        let [x, y, z] = std::array::from_fn(|c| origin[c] * direction[c]);
        u / (x + y + z) > 0.5
    }

    fn message(&self, source: &str, name: &str, ty: Type, point: usize) -> Answer {
        let [u, v] = self.uv(point);
        let found = source == "trace" && u > 0.5;
        let value = match (name, ty) {
            ("hit", Type::INT) if source == "trace" => Some(Const::Int(found.into())),
            _ if !found => None,
            ("hitdist", Type::FLOAT) => Some(Const::Float(0.5)),
            ("geom:name", Type::STRING) => Some(Const::Str("teapot".into())),
            ("N", Type::NORMAL) => Some(Const::Triple([1.0 - v, 0.25, 1.0 - u])),
            _ => None,
        };
        Answer { found, values: value.map(|value| vec![value]) }
    }

    /// Camera attributes accept any object and element; data of the surface accept neither.
    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        let [u, v] = self.uv(point);
        let float = |x: f32| Some(Datum::one(Const::Float(x)));
        if (object, name) == ("options", "blahblah") {
            // The recorder's own number, not π.
            return float(314_159.0 / 100_000.0);
        }
        if let Some(camera) = self.camera(name) {
            return Some(camera);
        }
        if (object, name) == ("", "shading:index") {
            return Some(Datum::one(Const::Int(self.grid.order().position(point) as i32)));
        }
        if !object.is_empty() || element.is_some() {
            return None;
        }
        if let Some((_, value)) = self.data.iter().find(|(n, _)| n == name) {
            return Some(value.clone());
        }
        match name {
            "s" => Some(Datum { derivs: self.derivs(Global::U, [u, v]), ..Datum::one(Const::Float(u)) }),
            "t" => Some(Datum { derivs: self.derivs(Global::V, [u, v]), ..Datum::one(Const::Float(v)) }),
            "red" if u > 0.5 => float(u),
            "green" if u < 0.5 => float(v),
            "blue" if (v * 12.0) as i32 % 2 == 0 => float(1.0 - u),
            _ => None,
        }
    }

    fn attribute_global(&self, object: &str, name: &str, element: Option<usize>) -> Option<Global> {
        let is_given = self.data.iter().any(|(given, _)| given == name);
        if is_given { None } else { self.grid.attribute_global(object, name, element) }
    }

    fn attribute_is_shared(&self, _: &str, name: &str, _: Option<usize>) -> bool {
        !matches!(name, "shading:index" | "s" | "t" | "red" | "green" | "blue")
    }
}

impl ReferenceRenderer {
    /// Attributes of the camera and of the renderer.
    fn camera(&self, name: &str) -> Option<Datum> {
        if name == "osl:version" {
            return Some(Datum::one(Const::Int(self.version)));
        }
        CameraFacts::of_patch([self.grid.width, self.grid.height]).attribute(name)
    }
}
