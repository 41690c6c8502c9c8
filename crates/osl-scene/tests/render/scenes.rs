//! The scene reader: errors have their line, irregular scenes are tolerated, and random damage does no harm.

use crate::common::{NoIncludes, Texts};
use osl_exec::Services;
use osl_scene::glam::Vec3;
use osl_scene::render::{RenderOptions, render};
use osl_scene::scene::{self, Form, Messages, Networks, SceneFiles, Surroundings};
use proptest::prelude::*;
use std::fmt::Write as _;

const PUBLISHED: &str = include_str!("../../../../examples/scenes/nonlinear_noise.ass");
const STANDARD: &str = include_str!("../../../../osl/nodes/standard.osl");
const LAMBERT: &str = include_str!("../../../../osl/nodes/lambert.osl");
const NOISE: &str = include_str!("../../../../osl/nonlinear_noise.osl");
const RAMP: &str = include_str!("../../../../osl/nodes/ramp.osl");
const BAD: &str =
    "displacement bad(float at = 0, output float d = 0) { d = P[0] > at ? 1e30 * P[0] * 1e30 : 0.1; }";
const SHADERS: [&str; 5] = [STANDARD, LAMBERT, NOISE, RAMP, BAD];

const CAMERA: &str = "persp_camera {\n position 0 0 4\n}\n";
const CUBE: &str = "polymesh {\n name box\n nsides 6 1 UINT 4 4 4 4 4 4\n vidxs 24 1 UINT\n  0 4 5 1 1 5 6 2 2 6 7 3 3 7 4 0 3 0 1 2 4 7 6 5\n \
    vlist 8 1 POINT\n  -1 -1 -1  1 -1 -1  1 -1 1  -1 -1 1  -1 1 -1  1 1 -1  1 1 1  -1 1 1\n shader grey\n}\n";
const GREY: &str = "lambert {\n name grey\n}\n";

/// The messages about a scene, and whether it has a world that renders.
fn said(text: &str, files: &dyn SceneFiles) -> String {
    let mut messages = Messages::default();
    let scene = scene::read("test.ass", text, files, &mut messages);
    let mut shaders = Texts(&SHADERS);
    let mut networks = Networks::new(&scene, &mut shaders, &mut messages);
    let around = Surroundings { size: Some([4, 3]), services: &Services::default };
    let world =
        if messages.failed() { None } else { scene::build(&scene, &mut networks, &around, &mut messages) };
    let mut said = String::new();
    for message in messages.list() {
        let _ = writeln!(said, "{message}");
    }
    match world {
        None => assert!(messages.failed(), "no world without a reason"),
        Some(world) => {
            let picture =
                render(&world, &RenderOptions { samples: 1, ..RenderOptions::default() }, &|_| ()).unwrap();
            assert!(picture.layers[0].planes.iter().flatten().all(|x| x.is_finite()));
            said += "rendered\n";
        }
    }
    said
}

fn check(text: &str) -> String {
    said(text, &NoIncludes)
}

#[test]
fn the_published_scene_says_what_it_does() {
    let mut messages = Messages::default();
    let scene = scene::read("nonlinear_noise.ass", PUBLISHED, &NoIncludes, &mut messages);
    assert!(messages.list().is_empty(), "{:?}", messages.list());
    assert_eq!(scene.settings.size, (640, 480));
    assert_eq!((scene.settings.samples, scene.settings.diffuse_depth), (81, 1));
    assert_eq!(scene.settings.background.as_deref(), Some("mysky"));
    assert_eq!(scene.camera.unwrap().fov_degrees, 11.0);
    assert_eq!(scene.lights[0].color, Vec3::new(2.0, 1.4, 0.4));
    let kinds: Vec<&str> = scene.shaders.iter().map(|n| n.kind.as_str()).collect();
    assert_eq!(kinds, ["standard", "nonlinear_noise", "lambert"]);
    let [plane, cube] = &scene.surfaces[..] else { panic!("two surfaces") };
    assert!(matches!(plane.form, Form::Plane { point, .. } if point.y == -8.0));
    let Form::Mesh(polygons) = &cube.form else { panic!("a mesh") };
    assert_eq!((polygons.mesh.face_sizes.len(), polygons.iterations, polygons.smooth), (6, 7, true));
    assert_eq!(polygons.mesh.positions[6], Vec3::new(250.0, 500.0, 250.0));
    // Rows for row vectors: the last row is the translation, and x is multiplied by the first.
    let x = cube.matrix.transform_vector3(Vec3::X);
    assert!((x - Vec3::new(0.94693, 0.0, 0.321439)).length() < 1e-6, "{x}");
    assert_eq!(cube.displacement.as_deref(), Some("sphere_disp"));
    let quick = PUBLISHED.replace("subdiv_iterations 7", "subdiv_iterations 3");
    assert_eq!(check(&quick), "rendered\n");
}

#[test]
fn bad_scenes_have_their_messages() {
    let cube = |from: &str, to: &str| {
        assert!(CUBE.contains(from), "{from}");
        format!("{CAMERA}{GREY}{}", CUBE.replace(from, to))
    };
    let with = |text: &str| format!("{CAMERA}{GREY}{CUBE}{text}");
    let shader = |text: &str| with(&format!("{text}\nplane {{\n name p\n shader x\n}}\n"));
    let cases = [
        ("sound", with("")),
        ("empty", String::new()),
        ("no camera", CUBE.to_string() + GREY),
        ("truncated base64", cube("POINT\n  -1 -1 -1", "b64POINT\n AAB6wwAAAAAAAHrDAAB6\n shade")),
        ("not base64", cube("POINT\n  -1 -1 -1", "b64POINT\n A*B6\n")),
        ("index out of range", cube("0 4 5 1", "0 4 5 8")),
        ("index below zero", cube("0 4 5 1", "0 4 5 -1")),
        ("too few indices", cube("UINT 4 4 4 4 4 4", "UINT 4 4 4 4 4 5")),
        ("array too short", cube("vlist 8", "vlist 9")),
        ("array too long", cube("vlist 8", "vlist 99999999")),
        ("not a number", cube("-1 -1 -1  1", "-1 -1 nan  1")),
        ("infinite", cube("-1 -1 -1  1", "-1 -1 1e99  1")),
        ("degenerate faces", cube("0 4 5 1 1 5 6 2", "0 4 4 1 1 5 1 5")),
        ("flat faces", cube("-1 1 -1  1 1 -1  1 1 1  -1 1 1", "-1 -1 -1  1 -1 -1  1 -1 1  -1 -1 1")),
        ("more than two faces at an edge", cube("3 7 4 0", "0 4 5 1")),
        ("faces that look to both sides", cube("1 5 6 2", "2 6 5 1")),
        ("no points", cube("vlist", "elist")),
        (
            "singular matrix",
            cube("shader grey", "shader grey\n matrix\n 1 0 0 0\n 0 0 0 0\n 0 0 1 0\n 0 0 0 1"),
        ),
        ("short matrix", cube("shader grey", "shader grey\n matrix 1 0 0 0")),
        (
            "displacement that is not finite",
            cube("shader grey", "shader grey\n disp_map d") + "bad {\n name d\n}\n",
        ),
        ("displacement that is not there", cube("shader grey", "shader grey\n disp_map d")),
        ("displacement without an output", cube("shader grey", "shader grey\n disp_map grey")),
        ("unknown subdivision", cube("shader grey", "shader grey\n subdiv_type loop\n subdiv_iterations 2")),
        ("no shader", cube(" shader grey\n", "")),
        ("unknown shader", shader("shiny {\n name x\n}")),
        ("unknown node that nothing uses", with("fog {\n name x\n density 3\n}")),
        ("shader that is not there", shader("")),
        ("unknown parameter", with("sky {\n name s\n colour 1 1 1\n}")),
        ("unknown parameter of a shader", shader("lambert {\n name x\n Kd_colr 1 1 1\n}")),
        ("wrong type", shader("lambert {\n name x\n Kd red\n}")),
        ("wrong number", with("point_light {\n position 1 2\n}")),
        ("link to nothing", shader("lambert {\n name x\n Kd_color wood\n}")),
        ("link to no output", shader("lambert {\n name x\n Kd_color grey\n}")),
        ("links in a circle", shader("ramp {\n name x\n position y\n}\nramp {\n name y\n position x\n}")),
        ("a node without a name", with("lambert {\n Kd 1\n}")),
        ("two nodes of a name", with(GREY)),
        ("bad camera", CUBE.to_string() + GREY + "persp_camera {\n fov 200\n}\n"),
        ("camera without direction", CUBE.to_string() + GREY + "persp_camera {\n look_at 0 0 0\n}\n"),
        ("bad options", with("options {\n xres 0\n AA_samples 2.5\n background nowhere\n}")),
        ("bad radius", with("sphere {\n name s\n radius -2\n shader grey\n}")),
        ("no sky for the background", with("options {\n background nowhere\n}")),
        ("missing brace", with("lambert {\n name x\n")),
        ("stray brace", with("}\n")),
        ("noise", with("@ ! 4 5\n{ }\n")),
        ("include of nothing", with("include \"other.ass\"\n")),
        ("include without quotes", with("include other\n")),
    ];
    let mut all = String::new();
    for (name, text) in cases {
        let _ = writeln!(all, "--- {name}\n{}", check(&text));
    }
    insta::assert_snapshot!(all);
}

#[test]
fn a_mesh_is_not_subdivided_for_ever() {
    let mut messages = Messages::default();
    let text = CUBE.replace("shader grey", "shader grey\n subdiv_type catclark\n subdiv_iterations 40");
    let scene = scene::read("test.ass", &text, &NoIncludes, &mut messages);
    let Form::Mesh(polygons) = &scene.surfaces[0].form else { panic!("a mesh") };
    assert_eq!(polygons.iterations, 9);
    assert!(messages.list()[0].text.contains("40 subdivisions are too many"));
}

/// Every file includes itself.
struct Itself<'a>(&'a str);

impl SceneFiles for Itself<'_> {
    fn include(&self, name: &str, _: &str) -> Result<(String, String), String> {
        Ok((name.to_string(), self.0.to_string()))
    }
}

#[test]
fn files_that_include_themselves_come_to_an_end() {
    let text = "include \"a.ass\"\ninclude \"b.ass\"\n";
    assert!(said(text, &Itself(text)).contains("too many files include each other"));
}

#[test]
fn what_is_included_is_part_of_the_scene() {
    let text = format!("include \"rest.ass\"\n{CUBE}");
    assert_eq!(said(&text, &Itself(&format!("{CAMERA}{GREY}"))), "rendered\n");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Changed, removed or doubled bytes: no panic, and an error message where there is no world.
    #[test]
    fn scenes_with_damage_are_survived(
        changes in proptest::collection::vec((0.0..1.0_f64, 0..5_usize, any::<u8>()), 1..12),
    ) {
        let mut bytes = format!("{CAMERA}{GREY}{CUBE}").into_bytes();
        for (at, what, byte) in changes {
            let at = (at * bytes.len() as f64) as usize;
            match what {
                0 => bytes[at] = byte,
                1 => { bytes.remove(at); }
                2 => bytes.insert(at, byte),
                3 => { let piece = bytes[at..bytes.len().min(at + 9)].to_vec(); bytes.splice(at..at, piece); }
                _ => bytes.truncate(at.max(40)),
            }
        }
        check(&String::from_utf8_lossy(&bytes));
    }

    /// Any text is read to its end.
    #[test]
    fn any_text_is_read(text in "[a-z{}\"# \n0-9.-]{0,200}|\\PC{0,80}") {
        let mut messages = Messages::default();
        scene::read("any.ass", &text, &Itself(&text), &mut messages);
    }
}
