//! Converts nodes to a description: camera, surfaces, lights, sky; all other nodes are shaders.

use super::fields::Fields;
use super::message::{Messages, SceneLocation};
use super::polygons::Polygons;
use super::text::Node;
use crate::camera::Camera;
use crate::light::SphereLight;
use glam::{Mat4, Vec3};

/// The contents of a scene file. Lengths are those of the file, in common space unless stated otherwise.
#[derive(Clone, Debug, Default)]
pub struct Description {
    /// The file as a whole, for messages about missing parts.
    pub place: SceneLocation,
    /// How to render the scene.
    pub settings: Settings,
    /// The camera, independent of the picture's size; `None` if the file has none.
    pub camera: Option<Camera>,
    /// The surfaces.
    pub surfaces: Vec<Surface>,
    /// Lights.
    pub lights: Vec<SphereLight>,
    /// The skies: nodes of type `sky`.
    pub skies: Vec<SkyNode>,
    /// All other nodes, which are shaders.
    pub shaders: Vec<Node>,
}

/// The `options` of a scene.
#[derive(Clone, Debug)]
pub struct Settings {
    /// `xres` and `yres`.
    pub size: (u32, u32),
    /// Paths per pixel: the square of `AA_samples` times the square of `GI_diffuse_samples`.
    pub samples: u32,
    /// Maximum number of diffuse reflections before light reaches the visible surface: `GI_diffuse_depth`.
    pub diffuse_depth: u32,
    /// The same for mirrors and glossy reflections: the largest of `GI_glossy_depth`, `GI_reflection_depth`
    /// and `GI_refraction_depth`.
    pub glossy_depth: u32,
    /// The visible sky: `background`.
    pub background: Option<String>,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { size: (640, 480), samples: 16, diffuse_depth: 1, glossy_depth: 4, background: None }
    }
}

/// A surface of the scene.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Its name.
    pub name: String,
    /// Its location in the file.
    pub place: SceneLocation,
    /// Its shape, in object space.
    pub form: Form,
    /// From object to common space, for column vectors.
    pub matrix: Mat4,
    /// Name of the shader node for its appearance.
    pub shader: Option<String>,
    /// Name of the shader node for its displacement.
    pub displacement: Option<String>,
}

/// Shapes of surfaces.
#[derive(Clone, Debug)]
pub enum Form {
    /// An infinite plane.
    Plane {
        /// A point of it.
        point: Vec3,
        /// Its normal.
        normal: Vec3,
    },
    /// A sphere.
    Sphere {
        /// Its center.
        center: Vec3,
        /// Its radius.
        radius: f32,
    },
    /// A cylinder without lids.
    Cylinder {
        /// Where its axis begins: v = 0.
        bottom: Vec3,
        /// Where its axis ends: v = 1.
        top: Vec3,
        /// Its radius.
        radius: f32,
    },
    /// Polygons.
    Mesh(Polygons),
}

/// A `sky`: light from all directions.
#[derive(Clone, Debug)]
pub struct SkyNode {
    /// Its name.
    pub name: String,
    /// Its location in the file.
    pub place: SceneLocation,
    /// Its color, if no shader computes it.
    pub color: Vec3,
    /// The node whose shader computes its color.
    pub shader: Option<String>,
    /// A factor.
    pub intensity: f32,
}

/// Sorts the nodes of a file by purpose.
pub(super) fn describe(place: SceneLocation, nodes: Vec<Node>, messages: &mut Messages) -> Description {
    let mut scene = Description { place, ..Description::default() };
    for node in nodes {
        let mut fields = Fields::new(&node, messages);
        match node.kind.as_str() {
            "options" => scene.settings = settings(&mut fields),
            "persp_camera" => scene.camera = Some(camera(&mut fields)),
            "plane" | "sphere" | "cylinder" | "polymesh" => {
                if let Some(surface) = surface(&node.kind, &mut fields) {
                    scene.surfaces.push(surface);
                }
            }
            "point_light" => {
                let light = point_light(&mut fields);
                scene.lights.push(light);
            }
            "sky" => {
                let sky = sky(&mut fields);
                scene.skies.push(sky);
            }
            _ => {
                scene.shaders.push(node);
                continue;
            }
        }
        fields.finish();
    }
    scene
}

fn settings(fields: &mut Fields<'_>) -> Settings {
    let default = Settings::default();
    // `build` checks the number of pixels, the renderer the number of paths.
    const MAX_SIDE: u32 = i32::MAX as u32;
    let size = (
        fields.int("xres", default.size.0, (1, MAX_SIDE)),
        fields.int("yres", default.size.1, (1, MAX_SIDE)),
    );
    let aa = fields.int("AA_samples", 4, (1, 64));
    let diffuse = fields.int("GI_diffuse_samples", 1, (0, 16)).max(1);
    let bounces = |fields: &mut Fields<'_>, name| fields.int(name, 0, (0, 64));
    let glossy =
        ["GI_glossy_depth", "GI_reflection_depth", "GI_refraction_depth"].map(|n| bounces(fields, n));
    Settings {
        size,
        samples: aa * aa * diffuse * diffuse,
        diffuse_depth: fields.int("GI_diffuse_depth", default.diffuse_depth, (0, 64)),
        glossy_depth: glossy.into_iter().max().filter(|n| *n > 0).unwrap_or(default.glossy_depth),
        background: fields.word("background").map(|w| w.text.clone()),
    }
}

fn camera(fields: &mut Fields<'_>) -> Camera {
    fields.take("name");
    let camera = Camera {
        position: fields.triple("position", Vec3::ZERO),
        look_at: fields.triple("look_at", Vec3::NEG_Z),
        up: fields.triple("up", Vec3::Y),
        fov_degrees: fields.float("fov", 54.43),
        resolution: [1, 1],
    };
    if let Err(why) = camera.view() {
        fields.messages.error(fields.place(), why.to_string());
    }
    camera
}

fn point_light(fields: &mut Fields<'_>) -> SphereLight {
    fields.take("name");
    let color = fields.triple("color", Vec3::ONE) * fields.float("intensity", 1.0);
    let position = fields.triple("position", Vec3::ZERO);
    SphereLight { position, radius: fields.float("radius", 0.0).max(0.0), color: color.max(Vec3::ZERO) }
}

fn sky(fields: &mut Fields<'_>) -> SkyNode {
    let name = fields.word("name").map(|w| w.text.clone()).unwrap_or_default();
    let intensity = fields.float("intensity", 1.0).max(0.0);
    let is_number = |text: &str| text.parse::<f64>().is_ok();
    let node = match fields.take("color").map(|p| &p.value) {
        Some(super::text::Value::Words(words)) if words.len() == 1 && !is_number(&words[0].text) => {
            Some(words[0].text.clone())
        }
        _ => None,
    };
    let color = if node.is_some() { Vec3::ONE } else { fields.triple("color", Vec3::ONE).max(Vec3::ZERO) };
    SkyNode { name, place: fields.place().clone(), color, shader: node, intensity }
}

fn surface(kind: &str, fields: &mut Fields<'_>) -> Option<Surface> {
    let mut word = |name| fields.word(name).map(|w| w.text.clone());
    let (name, shader, displacement) = (word("name"), word("shader"), word("disp_map"));
    let matrix = fields.matrix("matrix");
    let form = match kind {
        "plane" => {
            let (point, normal) = (fields.triple("point", Vec3::ZERO), fields.triple("normal", Vec3::Y));
            if normal.length_squared() == 0.0 {
                fields.messages.error(fields.place(), "a plane's normal has a length");
            }
            Form::Plane { point, normal: normal.normalize_or(Vec3::Y) }
        }
        "sphere" => Form::Sphere { center: fields.triple("center", Vec3::ZERO), radius: radius(fields, 0.5) },
        "cylinder" => Form::Cylinder {
            bottom: fields.triple("bottom", Vec3::new(0.0, -1.0, 0.0)),
            top: fields.triple("top", Vec3::Y),
            radius: radius(fields, 0.5),
        },
        _ => Form::Mesh(super::polygons::polygons(fields)?),
    };
    if displacement.is_some() && matches!(form, Form::Plane { .. }) {
        fields.messages.warning(fields.place(), "an endless plane cannot be displaced: use a polymesh");
    }
    Some(Surface {
        name: name.unwrap_or_default(),
        place: fields.place().clone(),
        form,
        matrix,
        shader,
        displacement,
    })
}

fn radius(fields: &mut Fields<'_>, default: f32) -> f32 {
    let radius = fields.float("radius", default);
    if radius <= 0.0 {
        fields.messages.error(fields.place(), format!("a radius is above 0, not {radius}"));
        return default;
    }
    radius
}
