//! Reads a scene from XML. Shader groups stay text or statements.

use super::camera::Camera;
use super::shapes::{Form, Shape};
use super::xml::{self, Element, XmlError};
use glam::Vec3;
use osl_ir::Span;
use osl_ir::types::{Base, Type};
use osl_limits::Limits;
use osl_lower::group::text::{Statement, Word};

/// A shader group as a scene describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupText {
    /// Its name.
    pub name: String,
    /// Its purpose: `surface` or `displacement`.
    pub usage: String,
    /// The index of the group that displaces its shapes.
    pub displacement: Option<usize>,
    /// Whether its shapes are sampled as lights.
    pub is_light: bool,
    /// Its text; may be empty.
    pub commands: String,
    /// Statements that follow the text.
    pub statements: Vec<Statement>,
}

/// The surroundings of all shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background {
    /// The shader group.
    pub group: Option<usize>,
    /// Side of the table by which directions are sampled, 1024 by default; 0 for none.
    pub resolution: usize,
}

/// A mesh, whose file is not read yet.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelFile {
    /// The name of the file, relative to the scene's folder.
    pub file: String,
    /// The index of its shader group.
    pub group: Option<usize>,
    /// Whether it is sampled as a light.
    pub is_light: bool,
}

/// A scene.
#[derive(Clone, Default)]
pub struct Scene {
    /// The camera.
    pub camera: Camera,
    /// Integer options, in order.
    pub options: Vec<(String, i32)>,
    /// The shader groups.
    pub groups: Vec<GroupText>,
    /// The shapes: spheres before quads.
    pub shapes: Vec<Shape>,
    /// The meshes.
    pub models: Vec<ModelFile>,
    /// The background.
    pub background: Option<Background>,
    /// What was passed over: a sentence each.
    pub warnings: Vec<String>,
}

impl Scene {
    /// The value of an option; the last one counts.
    pub fn option(&self, name: &str) -> Option<i32> {
        self.options.iter().rev().find(|(n, _)| n == name).map(|(_, value)| *value)
    }
}

/// Why a text is not a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SceneError {
    /// It is not XML.
    #[error("XML parsed with errors: {0}")]
    Xml(#[from] XmlError),
    /// Its root element is not `World`.
    #[error("Error reading scene: Root element <World> is missing")]
    NoWorld,
    /// It has too many shapes.
    #[error("Error reading scene: more than {most} shapes")]
    TooManyShapes {
        /// The permitted number.
        most: u64,
    },
}

/// Reads a scene.
///
/// # Errors
/// The reason why it cannot be read.
pub fn read(text: &str, limits: &Limits) -> Result<Scene, SceneError> {
    let limits = &limits.scenes;
    let document = xml::read(text, limits.xml_depth)?;
    let world = document.children.iter().find(|e| e.name == "World").ok_or(SceneError::NoWorld)?;
    let mut scene = Scene::default();
    let (mut spheres, mut quads) = (Vec::new(), Vec::new());
    // The group of the shapes that follow.
    let mut group = None;
    for element in &world.children {
        notice(element, TOP, "World", &mut scene.warnings);
        let vector = |name: &str| element.attribute(name).and_then(vector);
        let of_light = group.and_then(|at: usize| scene.groups.get(at)).is_some_and(|g| g.is_light);
        let is_light = of_light || element.attribute("is_light").is_some_and(flag);
        let rows =
            |default| element.attribute("resolution").map_or(default, number).clamp(1.0, 4096.0) as u32;
        let mut incomplete = |needs: &str| {
            scene.warnings.push(format!("<{}> needs {needs}, and is left out", element.name));
        };
        match element.name.as_str() {
            "Camera" => scene.camera = camera(element),
            "Option" => {
                let values = element.attributes.iter().filter_map(|(name, value)| {
                    let number = value.trim().strip_prefix("int")?.trim().parse().ok()?;
                    Some((name.clone(), number))
                });
                scene.options.extend(values);
            }
            "ShaderGroup" => {
                let found = shader_group(element, &mut scene.warnings);
                let at = scene.groups.len();
                let named = scene.groups.iter_mut().find(|g| g.name == found.name && g.usage == "surface");
                match (found.usage.as_str(), named) {
                    ("displacement", Some(surface)) => surface.displacement = Some(at),
                    ("displacement", None) => scene.warnings.push(format!(
                        "the displacement group `{}` has no surface group of its name before it",
                        found.name
                    )),
                    _ => group = Some(at),
                }
                scene.groups.push(found);
            }
            "Sphere" => {
                let radius = element.attribute("radius").map_or(0.0, number);
                match vector("center") {
                    Some(center) if radius > 0.0 => {
                        let form = Form::Sphere { center, radius };
                        spheres.push(Shape { form, group, is_light, resolution: rows(64.0) });
                    }
                    _ => incomplete("a center and a positive radius"),
                }
            }
            "Quad" => {
                let parts = (vector("corner"), vector("edge_x"), vector("edge_y"));
                if let (Some(corner), Some(edge_x), Some(edge_y)) = parts {
                    let form = Form::Quad { corner, edge_x, edge_y };
                    quads.push(Shape { form, group, is_light, resolution: rows(1.0) });
                } else {
                    incomplete("corner, edge_x and edge_y");
                }
            }
            "Model" => match element.attribute("filename") {
                Some(file) => scene.models.push(ModelFile { file: file.to_string(), group, is_light }),
                None => incomplete("a filename"),
            },
            "Background" => {
                let resolution = element.attribute("resolution").map_or(1024.0, number).max(0.0) as usize;
                scene.background =
                    Some(Background { group, resolution: resolution.min(limits.background as usize) });
            }
            _ => {}
        }
        if (spheres.len() + quads.len() + scene.models.len()) as u64 > limits.shapes {
            return Err(SceneError::TooManyShapes { most: limits.shapes });
        }
    }
    scene.shapes = spheres;
    scene.shapes.append(&mut quads);
    Ok(scene)
}

/// The elements at the top of a scene with their attributes; none where any name is right.
const TOP: &[(&str, &[&str])] = &[
    ("Camera", &["eye", "dir", "look_at", "up", "fov"]),
    ("Option", &[]),
    ("ShaderGroup", &["name", "type", "commands", "is_light"]),
    ("Sphere", &["center", "radius", "is_light", "resolution"]),
    ("Quad", &["corner", "edge_x", "edge_y", "is_light", "resolution"]),
    ("Model", &["filename", "is_light"]),
    ("Background", &["resolution"]),
];

/// The elements of a shader group.
const OF_GROUP: &[(&str, &[&str])] = &[
    ("Parameter", &[]),
    ("Shader", &["type", "name", "layer"]),
    ("ConnectShaders", &["srclayer", "srcparam", "dstlayer", "dstparam"]),
];

/// Maximum number of warnings; a scene with more mistakes is no scene of this tool.
const MAX_WARNINGS: usize = 100;

/// Warns of an element or of attributes that are not known here.
fn notice(element: &Element, known: &[(&str, &[&str])], parent: &str, warnings: &mut Vec<String>) {
    if warnings.len() >= MAX_WARNINGS {
        return;
    }
    let Some((name, attributes)) = known.iter().find(|(name, _)| *name == element.name) else {
        warnings.push(format!("<{}> in <{parent}> is not known, and has no effect", element.name));
        return;
    };
    let unknown = element.attributes.iter().filter(|(n, _)| !attributes.contains(&n.as_str()));
    for (attribute, _) in unknown.filter(|_| !attributes.is_empty()) {
        warnings.push(format!("the attribute `{attribute}` of <{name}> is not known, and has no effect"));
    }
}

fn camera(element: &Element) -> Camera {
    let vector = |name: &str| element.attribute(name).and_then(vector);
    let default = Camera::default();
    let eye = vector("eye").unwrap_or(default.eye);
    let dir = vector("dir").or_else(|| vector("look_at").map(|at| at - eye)).unwrap_or(default.dir);
    Camera {
        eye,
        dir: dir.normalize_or(default.dir),
        up: vector("up").unwrap_or(default.up),
        fov: element.attribute("fov").map_or(default.fov, number),
    }
}

fn shader_group(element: &Element, warnings: &mut Vec<String>) -> GroupText {
    let text = |name: &str, default: &str| element.attribute(name).unwrap_or(default).to_string();
    let mut group = GroupText {
        name: text("name", "group"),
        usage: text("type", "surface"),
        displacement: None,
        is_light: element.attribute("is_light").is_some_and(flag),
        commands: element.attribute("commands").or(element.text.as_deref()).unwrap_or("").to_string(),
        statements: Vec::new(),
    };
    for child in &element.children {
        notice(child, OF_GROUP, "ShaderGroup", warnings);
        let named = |name: &str| child.attribute(name).map(word);
        match child.name.as_str() {
            "Parameter" => group.statements.extend(child.attributes.iter().map(|(n, v)| parameter(n, v))),
            "Shader" => {
                if let (Some(shader), Some(layer)) = (named("name"), named("layer")) {
                    group.statements.push(Statement::Shader { shader, layer: Some(layer) });
                }
            }
            "ConnectShaders" => {
                let ends = [named("srclayer"), named("srcparam"), named("dstlayer"), named("dstparam")];
                if let [Some(a), Some(output), Some(b), Some(input)] = ends {
                    let span = Span::default();
                    group.statements.push(Statement::Connect { from: (a, output), to: (b, input), span });
                }
            }
            _ => {}
        }
    }
    group
}

fn word(text: &str) -> Word {
    Word { text: text.into(), span: Span::default() }
}

/// A value preceded by its type; a text without a type is a string.
fn parameter(name: &str, value: &str) -> Statement {
    let types = [
        ("int", Base::Int, 1),
        ("float", Base::Float, 1),
        ("color", Base::Color, 3),
        ("point", Base::Point, 3),
        ("vector", Base::Vector, 3),
        ("normal", Base::Normal, 3),
        ("matrix", Base::Matrix, 16),
    ];
    let typed = types.iter().find_map(|(ty, base, count)| {
        let rest = value.trim_start().strip_prefix(ty)?;
        let words: Vec<&str> = rest.split([' ', '\t', ',']).filter(|w| !w.is_empty()).collect();
        let fits = words.len() == *count && words.iter().all(|w| w.parse::<f32>().is_ok());
        fits.then(|| (Type::one(*base), words.into_iter().map(word).collect()))
    });
    let (ty, values) = typed.unwrap_or_else(|| (Type::STRING, vec![word(value)]));
    Statement::Param { ty, name: word(name), values, interpolated: false, span: Span::default() }
}

/// Three numbers separated by blanks or commas.
fn vector(text: &str) -> Option<Vec3> {
    let mut numbers = text.split([' ', '\t', ',']).filter(|w| !w.is_empty());
    let mut next = || numbers.next().and_then(|w| w.parse::<f32>().ok()).filter(|x| x.is_finite());
    Some(Vec3::new(next()?, next()?, next()?))
}

fn number(text: &str) -> f32 {
    text.trim().parse().ok().filter(|x: &f32| x.is_finite()).unwrap_or(0.0)
}

fn flag(text: &str) -> bool {
    matches!(text, "1" | "on" | "yes")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_in_order() {
        let scene = read(
            r#"<World>
                 <Camera eye="0 1, 2" look_at="0,1,0" fov="45"/>
                 <Option max_bounces="int 3" other="string x"/>
                 <Quad corner="0,0,0" edge_x="1,0,0" edge_y="0,1,0"/>
                 <ShaderGroup>float a 1; shader x l;</ShaderGroup>
                 <Quad corner="0,0,0" edge_x="1,0,0" edge_y="0,1,0" is_light="yes"/>
                 <Sphere center="0,0,0" radius="2" is_light="no"/>
                 <Sphere center="0,0,0" radius="-2"/>
                 <Unknown/>
                 <ShaderGroup name="two"><Parameter a="float 2" b="color 1 2 3" c="red" d="int x"/>
                   <Shader name="s" layer="l" type="surface"/><Shader name="s"/>
                   <ConnectShaders srclayer="a" srcparam="b" dstlayer="c" dstparam="d"/></ShaderGroup>
                 <Background resolution="64"/>
               </World>"#,
            &Limits::default(),
        )
        .expect("a scene");
        assert_eq!(scene.camera.dir, Vec3::NEG_Z);
        assert_eq!(scene.option("max_bounces"), Some(3));
        assert_eq!(scene.option("other"), None);
        let shapes: Vec<_> = scene.shapes.iter().map(|s| (s.group, s.is_light)).collect();
        assert_eq!(shapes, [(Some(0), false), (None, false), (Some(0), true)], "spheres are first");
        assert_eq!(scene.background, Some(Background { group: Some(1), resolution: 64 }));
        assert_eq!(scene.groups[0].commands, "float a 1; shader x l;");
        let types: Vec<Type> = scene.groups[1]
            .statements
            .iter()
            .filter_map(|s| if let Statement::Param { ty, .. } = s { Some(*ty) } else { None })
            .collect();
        assert_eq!(types, [Type::FLOAT, Type::COLOR, Type::STRING, Type::STRING]);
        assert_eq!(scene.groups[1].statements.len(), 6, "a shader without its layer is none");
        let warnings = [
            "<Sphere> needs a center and a positive radius, and is left out",
            "<Unknown> in <World> is not known, and has no effect",
        ];
        assert_eq!(scene.warnings, warnings);
    }

    #[test]
    fn lights_models_and_displacements_belong_to_their_groups() {
        let scene = read(
            r#"<World>
                 <ShaderGroup name="lamp" is_light="1">shader a l;</ShaderGroup>
                 <ShaderGroup name="lamp" type="displacement">shader b l;</ShaderGroup>
                 <Model filename="lamp.obj"/>
                 <ShaderGroup name="matt" color="red">shader c l;</ShaderGroup>
                 <Model filename="floor.obj"/>
                 <Model/>
                 <ShaderGroup name="other" type="displacement"><Layer/></ShaderGroup>
               </World>"#,
            &Limits::default(),
        )
        .map_err(|e| e.to_string())
        .unwrap_or_default();
        let models: Vec<_> = scene.models.iter().map(|m| (m.file.as_str(), m.group, m.is_light)).collect();
        assert_eq!(models, [("lamp.obj", Some(0), true), ("floor.obj", Some(2), false)]);
        assert_eq!(scene.groups[0].displacement, Some(1));
        assert_eq!(
            scene.warnings,
            [
                "the attribute `color` of <ShaderGroup> is not known, and has no effect",
                "<Model> needs a filename, and is left out",
                "<Layer> in <ShaderGroup> is not known, and has no effect",
                "the displacement group `other` has no surface group of its name before it",
            ]
        );
    }

    #[test]
    fn what_is_no_scene() {
        let error =
            |text: &str| read(text, &Limits::default()).map_or_else(|e| e.to_string(), |_| String::new());
        assert_eq!(error("<Scene/>"), "Error reading scene: Root element <World> is missing");
        assert!(error("scene").starts_with("XML parsed with errors: No document element"));
    }
}
