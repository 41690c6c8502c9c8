//! Scenes: those of `oslrun render`, and the XML of `testrender`.

use super::data::{Place, command};
use super::{contents, message, outcome};
use osl::stages;
use osl_exec::Services;
use osl_hir::hir;
use osl_lower::group::text::Shaders;
use osl_scene::render::{RenderOptions, render};
use osl_scene::scene::{self as scenes, Messages, Networks, SceneFiles, Surroundings};
use osl_syntax::{NoFiles, Options};
use std::collections::HashMap;
use std::ffi::OsString;
use std::sync::{Arc, LazyLock};

/// Words of scenes.
pub(super) const WORDS: &[&str] = &[
    "options",
    "persp_camera",
    "ortho_camera",
    "sphere",
    "polymesh",
    "plane",
    "cylinder",
    "lambert",
    "standard",
    "ramp",
    "fractal",
    "nonlinear_noise",
    "distant_light",
    "point_light",
    "quad_light",
    "skydome_light",
    "include",
    "{",
    "}",
    "name",
    "shader",
    "matrix",
    "vlist",
    "nlist",
    "uvlist",
    "vidxs",
    "nsides",
    "subdiv_type",
    "catclark",
    "subdiv_iterations",
    "radius",
    "center",
    "position",
    "look_at",
    "up",
    "fov",
    "xres",
    "yres",
    "AA_samples",
    "UINT",
    "POINT",
    "VECTOR",
    "FLOAT",
    "1 1",
    "8 1",
    "0 0 0",
    "\"a b\"",
    "disp_map",
    "autobump_visibility",
    "b64",
    "#",
    "1e30",
];

/// The scenes of the examples, without their large parts, and short ones.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let camera = "options\n{\n xres 4\n yres 3\n AA_samples 1\n}\npersp_camera\n{\n name c\n position 0 0 5\n look_at 0 0 0\n}\n";
    let mut seeds = contents("examples/scenes", &["ass"]);
    seeds.retain(|text| text.len() < 3000);
    let rest = [
        "sphere\n{\n name s\n radius 0.5\n center 0 0 0\n shader m\n}\nlambert\n{\n name m\n}\n",
        "polymesh\n{\n name p\n nsides 1 1 UINT 4\n vidxs 4 1 UINT 0 1 2 3\n vlist 4 1 POINT -1 -1 0 1 -1 0 1 1 0 -1 1 0\n subdiv_type catclark\n subdiv_iterations 2\n shader m\n}\nlambert\n{\n name m\n Kd_color f\n}\nfractal\n{\n name f\n}\n",
        "plane\n{\n name g\n point 0 -1 0\n normal 0 1 0\n shader m\n}\nstandard\n{\n name m\n}\ndistant_light\n{\n name l\n direction 0 -1 -1\n intensity 2\n}\nskydome_light\n{\n name d\n}\n",
    ];
    seeds.extend(rest.map(|rest| format!("{camera}{rest}").into_bytes()));
    seeds
}

struct Itself<'a>(&'a str);

impl SceneFiles for Itself<'_> {
    fn include(&self, name: &str, _: &str) -> Result<(String, String), String> {
        if name.len() > 8 { Err("no such file".to_owned()) } else { Ok((name.to_owned(), self.0.to_owned())) }
    }
}

/// The built-in shaders, read once.
struct BuiltIn;

static KNOWN: LazyLock<HashMap<String, Arc<hir::Program>>> = LazyLock::new(|| {
    let names = ["lambert", "standard", "ramp", "fractal", "nonlinear_noise"];
    let read = |name: &str| {
        let text = oslrun::nodes::find(name)?;
        let program = stages::check("fuzz.osl", text, &NoFiles, &Options::default()).program?;
        Some((name.to_owned(), Arc::new(program)))
    };
    names.into_iter().filter_map(read).collect()
});

impl Shaders for BuiltIn {
    fn load(&mut self, name: &str) -> Result<(Arc<hir::Program>, u32), String> {
        KNOWN.get(name).map(|program| (program.clone(), 0)).ok_or_else(|| "there is none".to_owned())
    }
}

/// Maximum number of faces of a scene that is built; larger scenes are only read.
const MAX_FACES: u64 = 1 << 10;

/// Any text as a scene: reads it and, if it is valid, builds and renders it in a few pixels. Included files
/// are the text itself. A missing world must have a reason.
pub fn scene(bytes: &[u8]) -> u64 {
    let text = String::from_utf8_lossy(bytes);
    let mut messages = Messages::default();
    let read = scenes::read("fuzz.ass", &text, &Itself(&text), &mut messages);
    let faces: u64 = read
        .surfaces
        .iter()
        .map(|surface| match &surface.form {
            scenes::Form::Mesh(p) => {
                (p.mesh.corners.len() as u64).saturating_mul(1 << (2 * p.iterations).min(40))
            }
            _ => 0,
        })
        .sum();
    let said = |messages: &Messages| {
        messages.list().iter().map(|m| message(&m.text)).fold(0, |sum: u64, m| sum.rotate_left(3) ^ m)
    };
    let displaced = read.surfaces.iter().any(|s| s.displacement.is_some());
    if messages.failed() || faces > MAX_FACES || read.surfaces.len() > 16 || displaced && faces == 0 {
        return said(&messages);
    }
    let mut shaders = BuiltIn;
    let mut networks = Networks::new(&read, &mut shaders, &mut messages);
    let around = Surroundings { size: Some([4, 3]), services: &Services::default };
    match scenes::build(&read, &mut networks, &around, &mut messages) {
        None => assert!(messages.failed(), "no world and no reason\n{text}"),
        Some(world) => {
            let options = RenderOptions { samples: 1, ..RenderOptions::default() };
            let _ = render(&world, &options, &|_| ());
        }
    }
    said(&messages)
}

/// Words of the XML of `testrender`.
pub(super) const XML_WORDS: &[&str] = &[
    "<World>",
    "</World>",
    "<Camera eye=\"0,0,5\" look_at=\"0,0,0\" fov=\"40\" />",
    "<ShaderGroup>",
    "</ShaderGroup>",
    "<Shader name=\"matte\" layer=\"l\" />",
    "<Parameter Cs=\"color 1 0 0\" />",
    "<Quad corner=\"-5,0,-5\" edge_x=\"0,0,10\" edge_y=\"10,0,0\" />",
    "<Sphere center=\"0,1,0\" radius=\"1\" />",
    "<Background resolution=\"8\" />",
    "is_light=\"yes\"",
    "<Option max_bounces=\"int 2\" />",
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "&lt;",
    "&#0;",
    "&#x10ffff;",
    "<!DOCTYPE",
    "<?xml",
    "shader matte m;",
    "float Kd 0.5;",
    "=",
    "\"",
    "'",
    "/>",
    "<ConnectShaders",
    "srclayer",
    "srcparam",
    "dstlayer",
    "dstparam",
];

/// Scenes of the suite, and short ones.
pub(super) fn xml_seeds() -> Vec<Vec<u8>> {
    let mut seeds = contents("tests/data/suite", &["xml"]);
    seeds.retain(|text| text.len() < 2000);
    seeds.push(br#"<World><Camera eye="0,3,8" look_at="0,1,0" fov="45" /><ShaderGroup>color Cs 0.7 0.6 0.5; shader matte m;</ShaderGroup><Sphere center="0,1,0" radius="1" is_light="yes" /><Background resolution="8" /></World>"#.to_vec());
    seeds
}

/// The available shaders.
const SHADERS: [(&str, &str); 4] = [
    (
        "matte.osl",
        "surface matte(float Kd = 1, color Cs = 1, output float unused = 0) { Ci = Kd * Cs * diffuse(N); }",
    ),
    (
        "sky.osl",
        "shader sky(color up = 1, color down = 0.1) { Ci = mix(down, up, normalize(I)[1] * 0.5 + 0.5) * background(); }",
    ),
    (
        "checks.osl",
        "shader checks(float n = 4, output color Cout = 0) { Cout = (int(floor(u * n)) + int(floor(v * n))) % 2; }",
    ),
    ("emitter.osl", "surface emitter(float power = 1) { Ci = (power / surfacearea()) * emission(); }"),
];

/// The maximum size of a background's table, and the maximum numbers of paths, shapes and groups. The text of
/// larger scenes is only read, since their work is the user's choice.
const MAX_TABLE: usize = 16;
const MAX_COUNT: i32 = 4;

/// Renders a scene of `testrender` through its command line, in a few pixels.
pub fn testrender(bytes: &[u8]) -> u64 {
    let text = String::from_utf8_lossy(bytes);
    let read = match osl_scene::testrender::scene::read(&text, &osl_limits::Limits::default()) {
        Ok(read) => read,
        Err(why) => return message(&why.to_string()),
    };
    let table = read.background.as_ref().map_or(0, |b| b.resolution);
    let counts = ["aa", "max_bounces", "rr_depth"].map(|name| read.option(name).unwrap_or(0));
    if table > MAX_TABLE
        || counts.iter().any(|n| *n > MAX_COUNT)
        || read.shapes.len() > 64
        || read.groups.len() > 8
    {
        return outcome(["large"]);
    }
    let place = Place::get();
    for (name, text) in SHADERS {
        place.file(name, text.as_bytes());
    }
    let xml = place.file("scene.xml", text.as_bytes());
    let folder = place.path().as_os_str().to_owned();
    let mut args: Vec<OsString> =
        ["testrender", "-r", "4", "3", "-t", "1", "-path"].map(OsString::from).into();
    args.extend([folder, xml.into(), place.path().join("out.exr").into()]);
    let (code, err) = command(args);
    assert!(code <= 1, "{err}");
    message(&err).wrapping_add(u64::from(code))
}
