//! Areas, the eye above the patch, handedness, and the ways back from spaces of the image.

use crate::in_process::{oslrun, oslrun_at};
use osl_image::read_image;
use std::path::Path;

/// A shader file in the tests' data.
fn published(name: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/published");
    root.join(name).display().to_string()
}

/// The ranges of the channels that a run prints: name, smallest and largest value.
fn ranges(folder: &Path, args: &str) -> Vec<(String, f32, f32)> {
    let (code, out, err) = oslrun_at(folder, args);
    assert_eq!(code, 0, "{args}: {err}");
    let line = |line: &str| {
        let (name, rest) = line.split_once(": ")?;
        let (low, rest) = rest.split_once(" to ")?;
        let (high, _) = rest.split_once(", mean")?;
        Some((name.to_string(), low.parse().ok()?, high.parse().ok()?))
    };
    out.lines().filter_map(line).collect()
}

#[test]
fn areas_are_those_of_the_patch_and_of_surfaces() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("s.osl"), "shader s(output float a = 0) { a = surfacearea(); }").unwrap();
    // A square of two triangles, of side 3.
    std::fs::write(dir.path().join("q.obj"), "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 0 3 0\nf 1 2 3 4\n").unwrap();
    assert_eq!(ranges(dir.path(), "@/s.osl -g 4x4"), [("a".to_string(), 1.0, 1.0)]);
    for (on, area) in [
        ("--on sphere", 12.566_371),
        ("--on cylinder", 12.566_371),
        ("--on torus", 15.791_367),
        ("--on plane", 4.0),
        ("--on cube", 24.0),
        ("--on @/q.obj", 9.0),
        ("--on @/q.obj --object-space 2,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1", 18.0),
        ("--on sphere --object-space 2,0,0,0,0,2,0,0,0,0,2,0,1,0,0,1", 50.265_48),
    ] {
        let found = ranges(dir.path(), &format!("@/s.osl -g 16x16 {on}"));
        assert!((found[0].2 - area).abs() < 1e-5 * area, "{on}: {found:?}");
    }
    let (image, shader) = (dir.path().join("l.exr"), published("surfacearea_zero.osl"));
    for on in [&[][..], &["--on", "sphere"]] {
        let path = image.display().to_string();
        let args = [&[shader.as_str(), "-g", "8x8", "-o", &path], on].concat();
        let (code, _, err) = oslrun(&args);
        assert_eq!(code, 0, "{err}");
        // On a surface, the picture of a shader without other outputs is the light from the eye.
        let light = read_image(&image).unwrap();
        let value = light.plane(light.channels.len() - 1)[36];
        assert!(if on.is_empty() { value == 1.0 } else { value > 0.5 }, "{value} of {:?}", light.channels);
    }
}

#[test]
fn the_patch_is_seen_from_above_except_in_the_tool() {
    let dir = tempfile::tempdir().unwrap();
    let text = "shader s(output normal n = 0, output vector i = 0) { n = normal(0, 0, -2); n = faceforward(n, I, n); i = I + Dx(I) + Dy(I); }";
    std::fs::write(dir.path().join("s.osl"), text).unwrap();
    let of = |args: &str| ranges(dir.path(), args).into_iter().map(|(_, low, _)| low).collect::<Vec<_>>();
    assert_eq!(of("@/s.osl -g 4x4"), [0.0, 0.0, 2.0, 0.0, 0.0, -1.0]);
    assert_eq!(of("@/s.osl -g 4x4 --global I=0,0,0"), [0.0, 0.0, -2.0, 0.0, 0.0, 0.0]);
    assert_eq!(of("@/s.osl -g 4x4 --global I=0,0,3"), [0.0, 0.0, -2.0, 0.0, 0.0, 3.0]);
    let (code, out, _) = oslrun_at(dir.path(), "testshade -g 1 1 --print -o i null -o n null @/s.osl");
    assert!(code == 0 && out.contains("i : 0 0 0") && out.contains("n : 0 0 -2"), "{out}");
}

#[test]
fn normals_of_positions_are_on_the_side_of_the_normal() {
    let dir = tempfile::tempdir().unwrap();
    let text = "shader s(output float side = 0, output float back = 0) { side = dot(normalize(calculatenormal(P)), N); back = backfacing(); }";
    std::fs::write(dir.path().join("s.osl"), text).unwrap();
    let side = |args: &str| ranges(dir.path(), args)[0].clone();
    for args in ["", "--uv-scale=-1,1", "--uv-scale=1,-2", "--global N=0,0,-1", "--uv-scale=-1,-1"] {
        let (_, low, high) = side(&format!("@/s.osl -g 8x8 {args}"));
        assert_eq!((low, high), (1.0, 1.0), "{args}");
    }
    // The plane from below, and a tube into which the camera looks: both show their backs.
    for args in ["--on plane --eye 1,-3,0.5", "--on cylinder --eye 0,4,0.5"] {
        let found = ranges(dir.path(), &format!("@/s.osl -g 32x32 {args}"));
        assert!(found[0].1 >= 0.0 && found[0].2 > 0.999 && found[1].2 == 1.0, "{args}: {found:?}");
    }
}

#[test]
fn spaces_of_the_image_have_a_way_back() {
    let dir = tempfile::tempdir().unwrap();
    let shader = published("from_raster.osl");
    let path = dir.path().join("b.exr").display().to_string();
    for on in [&[][..], &["--on", "sphere"]] {
        let (code, _, err) = oslrun(&[&[shader.as_str(), "-g", "20x10", "-o", &path], on].concat());
        assert!(code == 0 && !err.contains("error"), "{err}");
    }
    let text = "shader s(string from = \"\", output float off = 0) { off = distance(transform(from, \"common\", transform(from, P)), P); }";
    std::fs::write(dir.path().join("s.osl"), text).unwrap();
    for space in ["screen", "NDC", "raster", "camera"] {
        for (on, room) in [("", 4e-6), ("--on torus", 2e-3)] {
            let found = ranges(dir.path(), &format!("@/s.osl -g 20x10 -p from={space} {on}"));
            assert!(found[0].2 < room, "{space} {on}: {found:?}");
        }
    }
    let (_, _, err) = oslrun_at(dir.path(), &format!("testshade -g 2 2 -o back null {shader}"));
    assert!(err.contains("Unknown transformation \"raster\""), "{err}");
}
