//! What shaders can ask about a camera: the attributes `camera:NAME`.

use osl_exec::Datum;
use osl_ir::ir::Const;

/// The facts from which the attributes follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraFacts {
    /// Width and height of the image in pixels.
    pub resolution: [usize; 2],
    /// The field of view in degrees.
    pub fov_degrees: f32,
    /// The nearest and the farthest distance.
    pub clip: [f32; 2],
}

impl CameraFacts {
    /// Those of the patch, as the reference's grid tool answers them.
    pub fn of_patch(resolution: [usize; 2]) -> CameraFacts {
        CameraFacts { resolution, fov_degrees: 90.0, clip: [0.1, 1000.0] }
    }

    /// The value of an attribute. OSL language specification, "getattribute".
    pub fn attribute(&self, name: &str) -> Option<Datum> {
        let float = |x: f32| Datum::one(Const::Float(x));
        let floats = |list: &[f32]| Datum::array(list.iter().map(|x| Const::Float(*x)).collect());
        let [width, height] = self.resolution;
        let aspect = width as f32 / height as f32;
        Some(match name.strip_prefix("camera:")? {
            "resolution" => Datum::array(self.resolution.map(|side| Const::Int(side as i32)).to_vec()),
            "projection" => Datum::one(Const::Str("perspective".into())),
            "fov" => float(self.fov_degrees),
            "pixelaspect" => float(1.0),
            "clip" => floats(&self.clip),
            "clip_near" => float(self.clip[0]),
            "clip_far" => float(self.clip[1]),
            "shutter" => floats(&[0.0, 1.0]),
            "shutter_open" => float(0.0),
            "shutter_close" => float(1.0),
            "screen_window" => floats(&[-aspect, -1.0, aspect, 1.0]),
            _ => return None,
        })
    }
}
