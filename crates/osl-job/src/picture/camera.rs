//! Camera shaders: which outputs of a shader are the ray of a sample, and the lens that they make.
//!
//! There are two forms. Blender's cameras have outputs named `position` and `direction`, and optionally
//! `throughput` and derivatives, in camera space. Octane's cameras have a point and a vector as their first
//! outputs, of any name, then optionally the range of the ray, in common space.

use super::layer::followed;
use super::setup;
use crate::request::Light;
use crate::source::data;
use crate::source::load::{LoadedShader, TextureFiles};
use crate::{Failure, Image, Sink};
use osl::stages;
use osl_exec::Spaces;
use osl_hir::hir;
use osl_ir::ir::Body;
use osl_ir::passes;
use osl_ir::types::{Extent, Type};
use osl_scene::Data;
use osl_scene::camera::View;
use osl_scene::glam::{DVec3, Mat4};
use osl_scene::lens::{self, Convention, Lens};

/// The message in which a camera of Octane leaves the share of light.
const THROUGHPUT: &str = "octane:throughput";
/// The outputs with derivatives: if there is one of them, the shader gives all.
const DERIVS: [&str; 4] = ["dPdx", "dPdy", "dDdx", "dDdy"];

/// A camera shader that is compiled for each view.
pub struct CameraShader {
    convention: Convention,
    body: Body,
    folder: TextureFiles,
    data: Data,
}

impl CameraShader {
    /// The shader of a preview, if its outputs are those of a camera and no option gives them another role.
    pub(super) fn recognised(
        image: &Image,
        light: &Light,
        loaded: &mut LoadedShader,
        sink: &mut dyn Sink,
    ) -> Result<Option<CameraShader>, Failure> {
        let Light { base, bump, normal, roughness, .. } = light;
        let has_role = base.is_some() || bump.is_some() || normal.is_some() || roughness.is_some();
        let named = outputs(&loaded.program).filter(|outputs| outputs.named && !has_role);
        if let Some(named) = named {
            return CameraShader::new(image, loaded, &named, sink).map(Some);
        }
        if image.provided.attributes.is_some() {
            sink.warn("--attributes are for a camera: the surface of a preview does not have them");
        }
        Ok(None)
    }

    /// The shader that a request names as the camera.
    ///
    /// # Errors
    /// Its outputs are not those of a camera, or it cannot be compiled.
    pub fn of(
        image: &Image,
        loaded: &mut LoadedShader,
        sink: &mut dyn Sink,
    ) -> Result<CameraShader, Failure> {
        let missing = || Failure::new(CameraShader::missing(&loaded.name));
        let found = outputs(&loaded.program).ok_or_else(missing)?;
        CameraShader::new(image, loaded, &found, sink)
    }

    /// Why a shader is no camera.
    pub(super) fn missing(name: &str) -> String {
        format!(
            "`{name}` is no camera: it has neither the outputs `point position` and `vector direction`, nor a point and a \
             vector as its first outputs"
        )
    }

    fn new(
        image: &Image,
        loaded: &mut LoadedShader,
        outputs: &Outputs,
        sink: &mut dyn Sink,
    ) -> Result<CameraShader, Failure> {
        let is_raster = outputs.convention == Convention::Raster;
        if is_raster && !outputs.links.iter().any(|(_, to)| *to == "throughput") {
            sink.warn("the camera has no output `throughput`, which then is 0: its picture is black");
        }
        let message = if is_raster { "" } else { THROUGHPUT };
        let given = u8::from(outputs.links.iter().any(|(_, to)| DERIVS.contains(to)));
        let values = [("message", message.to_string()), ("given", given.to_string())];
        let links: Vec<_> = outputs.links.iter().map(|(from, to)| (from.as_str(), *to)).collect();
        let body = followed(loaded, "camera_ray", &values, &links, image)?;
        let data = lens::in_all_forms(data::read(image, None)?);
        Ok(CameraShader { convention: outputs.convention, body, folder: loaded.folder.clone(), data })
    }

    /// The lens of a view.
    pub fn lens(&self, image: &Image, view: &View) -> Lens {
        let mut spaces = Spaces::default();
        view.set_spaces(&mut spaces, view.sight() * 0.01, view.sight() * 100.0);
        if self.convention == Convention::Sight {
            // Octane's cameras look along -z.
            let [right, up, ahead] = view.axes();
            let column = |v: DVec3| v.as_vec3().extend(0.0);
            let to_common =
                Mat4::from_cols(column(right), column(up), column(-ahead), view.position().extend(1.0));
            spaces.set("camera", to_common.to_cols_array());
        }
        let options = passes::Options {
            outputs: Some(lens::OUTPUTS.map(Into::into).to_vec()),
            varying: lens::VARYING.to_vec(),
            derivs: Vec::new(),
            without: image.running.without_pass.clone(),
            arithmetic: image.running.arithmetic.unwrap_or_default(),
            limits: image.limits().clone(),
            ..passes::Options::default()
        };
        Lens {
            convention: self.convention,
            program: stages::finish(self.body.clone(), &options).program,
            services: setup::services(image, self.folder.clone(), spaces),
            data: self.data.clone(),
            limits: image.limits().clone(),
        }
    }
}

/// The outputs of a camera shader.
struct Outputs {
    convention: Convention,
    /// Whether their names say that they are those of a camera, and not only their types.
    named: bool,
    /// The parameters of `camera_ray` that they feed.
    links: Vec<(String, &'static str)>,
}

/// The outputs of a camera shader; `None` if it is none.
fn outputs(program: &hir::Program) -> Option<Outputs> {
    let list = program.shader.params.iter().filter(|param| param.output);
    let list: Vec<(&str, Type)> = list
        .filter_map(|param| program.vars.get(param.var.0 as usize))
        .map(|var| (&*var.name, var.ty))
        .collect();
    let is_place = |ty: Type| ty.is_triple() && !ty.is_array() && ty != Type::COLOR;
    let has = |name: &str| list.iter().any(|(known, ty)| *known == name && is_place(*ty));
    if has("position") && has("direction") {
        let known = ["position", "direction", "throughput"].into_iter().chain(DERIVS);
        let links = known.filter(|name| list.iter().any(|(output, _)| output == name));
        let links = links.map(|name| (name.to_string(), name)).collect();
        return Some(Outputs { convention: Convention::Raster, named: true, links });
    }
    let (position, direction) = match &list[..] {
        [(position, Type::POINT), (direction, ty), ..] if is_place(*ty) => (*position, *direction),
        _ => return None,
    };
    let mut links = vec![(position.to_string(), "position"), (direction.to_string(), "direction")];
    if let Some((name, ty)) = list.get(2) {
        let pair = Type { extent: Extent::Array(2), ..Type::FLOAT };
        let to = [(Type::FLOAT, "far"), (pair, "clip")].into_iter().find(|(known, _)| known == ty);
        links.extend(to.map(|(_, to)| ((*name).to_string(), to)));
    }
    let named = position.starts_with("pos") && direction.starts_with("dir");
    Some(Outputs { convention: Convention::Sight, named, links })
}
