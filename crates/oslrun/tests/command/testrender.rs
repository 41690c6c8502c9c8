//! `testrender`: meshes, lights and displacements of scenes, against shapes of the same form that have
//! formulas.

use osl_image::read_image;
use std::path::Path;
use std::process::Command;

/// Shaders, a square of two triangles, and a lamp of the same form as the quad of the scenes.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let files = [
        ("matt.osl", "surface matt() { Ci = 0.5 * diffuse(N); }"),
        ("lamp.osl", "surface lamp() { Ci = 4 * emission(); }"),
        ("swell.osl", "displacement swell() { P += 0.5 * N; }"),
        ("lamp.obj", "v -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\nf 1 2 3 4\n"),
    ];
    for (name, text) in files {
        std::fs::write(dir.path().join(name), text).unwrap();
    }
    dir
}

/// The mean light of a scene, and what was said.
fn mean(dir: &Path, scene: &str) -> (f32, String) {
    let text = format!(
        "<World><Camera eye=\"0 3 6\" look_at=\"0 0.5 0\" fov=\"80\"/><Option aa=\"int 12\"/>{scene}</World>"
    );
    std::fs::write(dir.join("scene.xml"), text).unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_oslrun"))
        .args(["testrender", "-r", "24", "24", "scene.xml", "out.exr"])
        .current_dir(dir)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(0), "{said}");
    let file = read_image(&dir.join("out.exr")).unwrap();
    (file.samples.iter().sum::<f32>() / file.samples.len() as f32, said)
}

const FLOOR: &str = "<ShaderGroup>shader matt l;</ShaderGroup>\
                     <Quad corner=\"-4 0 4\" edge_x=\"8 0 0\" edge_y=\"0 0 -8\"/>";

#[test]
fn a_mesh_lights_as_a_quad_does() {
    let dir = folder();
    let lamp = |shape: &str, group: &str| {
        mean(dir.path(), &format!("{FLOOR}<ShaderGroup {group}>shader lamp l;</ShaderGroup>{shape}")).0
    };
    let quad = "<Quad corner=\"-1 2 -1\" edge_x=\"2 0 0\" edge_y=\"0 0 2\" is_light=\"yes\"/>";
    let quad = lamp(quad, "");
    let sampled = lamp("<Model filename=\"lamp.obj\"/>", "is_light=\"yes\"");
    let by_chance = lamp("<Model filename=\"lamp.obj\"/>", "");
    assert!((sampled / quad - 1.0).abs() < 0.01, "{sampled}, not {quad}");
    // The lamp is small, so that few rays find it.
    assert!((by_chance / quad - 1.0).abs() < 0.1, "{by_chance}, not {quad}");
}

#[test]
fn a_displaced_sphere_is_a_larger_one() {
    let dir = folder();
    let lamp = "<ShaderGroup name=\"ball\">shader lamp l;</ShaderGroup>";
    let swell = "<ShaderGroup name=\"ball\" type=\"displacement\">shader swell l;</ShaderGroup>";
    let large = mean(dir.path(), &format!("{lamp}<Sphere center=\"0 0 0\" radius=\"1.5\"/>")).0;
    let small = format!("{lamp}{swell}<Sphere center=\"0 0 0\" radius=\"1\"/>");
    let (moved, said) = mean(dir.path(), &small);
    assert!((moved / large - 1.0).abs() < 0.01, "{moved}, not {large}");
    assert_eq!(said, "");
}

#[test]
fn what_is_passed_over_is_named() {
    let dir = folder();
    let (_, said) = mean(
        dir.path(),
        &format!("{FLOOR}<Sphere center=\"0 0 0\" colour=\"red\"/><Torus/><Quad corner=\"0 0 0\"/>"),
    );
    assert_eq!(
        said,
        "WARNING: the attribute `colour` of <Sphere> is not known, and has no effect\n\
         WARNING: <Sphere> needs a center and a positive radius, and is left out\n\
         WARNING: <Torus> in <World> is not known, and has no effect\n\
         WARNING: <Quad> needs corner, edge_x and edge_y, and is left out\n"
    );
}

#[test]
fn missing_and_large_meshes_are_errors() {
    let large = "<ShaderGroup name=\"a\">shader matt l;</ShaderGroup>\
                 <ShaderGroup name=\"a\" type=\"displacement\">shader swell l;</ShaderGroup>\
                 <Sphere center=\"0 0 0\" radius=\"1\" resolution=\"1000000\"/>";
    let missing = "<ShaderGroup>shader matt l;</ShaderGroup><Model filename=\"no.obj\"/>";
    for (scene, why) in [(missing, "model no.obj: "), (large, "more than 1000 corners")] {
        let dir = folder();
        std::fs::write(dir.path().join("scene.xml"), format!("<World>{scene}</World>")).unwrap();
        let run = Command::new(env!("CARGO_BIN_EXE_oslrun"))
            .args(["testrender", "--limit", "scenes.corners=1000", "-r", "4", "4", "scene.xml", "out.exr"])
            .current_dir(dir.path())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.code() == Some(1) && said.contains(why), "{said}");
        assert!(!dir.path().join("out.exr").exists());
    }
}
