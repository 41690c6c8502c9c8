//! Points of shapes for the batch interpreter.

use super::shapes::Point;
use osl_exec::{Datum, PointSource, left_handed};
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Const};

/// Attributes that shaders can request from the renderer, besides the globals.
#[derive(Clone, Debug)]
pub(super) struct Attributes {
    /// Size of the picture in pixels.
    pub(super) resolution: [usize; 2],
    /// The camera's field of view in degrees.
    pub(super) fov: f32,
}

/// The globals that differ from point to point. Programs are compiled for these.
pub const VARYING: [Global; 11] = [
    Global::P,
    Global::I,
    Global::N,
    Global::Ng,
    Global::U,
    Global::V,
    Global::DPdu,
    Global::DPdv,
    Global::Backfacing,
    Global::SurfaceArea,
    Global::LeftHanded,
];
/// The globals with derivatives.
pub const DERIVS: [Global; 4] = [Global::P, Global::I, Global::U, Global::V];

/// Points of shapes that one shader group shades.
pub(super) struct Points<'a> {
    pub(super) list: &'a [Point],
    pub(super) attributes: &'a Attributes,
}

impl Points<'_> {
    fn write(&self, first: usize, width: usize, lanes: &mut [f32], value: impl Fn(&Point) -> [f32; 3]) {
        let width = width.max(1);
        let last = self.list.len().saturating_sub(1);
        for lane in 0..width.min(lanes.len()) {
            let Some(point) = self.list.get((first + lane).min(last)) else { return };
            for (lanes, x) in lanes.chunks_mut(width).zip(value(point)) {
                if let Some(out) = lanes.get_mut(lane) {
                    *out = x;
                }
            }
        }
    }
}

fn one(x: f32) -> [f32; 3] {
    [x, 0.0, 0.0]
}

impl PointSource for Points<'_> {
    fn count(&self) -> usize {
        self.list.len()
    }

    fn varying(&self) -> &[Global] {
        &VARYING
    }

    fn uniform(&self, _: Global) -> [f32; 3] {
        [0.0; 3]
    }

    fn deriv(&self, _: Global, _: Axis) -> [f32; 3] {
        [0.0; 3]
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        self.write(first, width, lanes, |p| match global {
            Global::P => p.p.value.to_array(),
            Global::I => p.i.value.to_array(),
            Global::N | Global::Ng => p.n.to_array(),
            Global::U => one(p.u.value),
            Global::V => one(p.v.value),
            Global::DPdu => p.dpdu.to_array(),
            Global::DPdv => p.dpdv.to_array(),
            Global::Backfacing => one(f32::from(u8::from(p.backfacing))),
            Global::SurfaceArea => one(p.area),
            Global::LeftHanded => {
                let [dx, dy] = p.p.derivs.map(|d| d.to_array());
                one(left_handed(dx, dy, p.n.to_array()))
            }
            _ => [0.0; 3],
        });
    }

    fn varying_derivs(&self) -> &[Global] {
        &DERIVS
    }

    fn fill_deriv(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        let axis = axis as usize;
        self.write(first, width, lanes, |p| match global {
            Global::P => p.p.derivs[axis].to_array(),
            Global::I => p.i.derivs[axis].to_array(),
            Global::U => one(p.u.derivs[axis]),
            Global::V => one(p.v.derivs[axis]),
            _ => [0.0; 3],
        });
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        if !matches!(object, "" | "global") || element.is_some() {
            return None;
        }
        let point = self.list.get(point)?;
        let float = |x: f32| Some(Datum::one(Const::Float(x)));
        let floats = |list: &[f32]| Some(Datum::array(list.iter().map(|x| Const::Float(*x)).collect()));
        let [width, height] = self.attributes.resolution;
        let aspect = width as f32 / height.max(1) as f32;
        match name {
            "s" => Some(Datum { derivs: point.u.derivs, ..Datum::one(Const::Float(point.u.value)) }),
            "t" => Some(Datum { derivs: point.v.derivs, ..Datum::one(Const::Float(point.v.value)) }),
            "osl:version" => Some(Datum::one(Const::Int(11312))),
            "camera:resolution" => Some(Datum::array([width, height].map(|n| Const::Int(n as i32)).to_vec())),
            "camera:projection" => Some(Datum::one(Const::Str("perspective".into()))),
            "camera:fov" => float(self.attributes.fov),
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
