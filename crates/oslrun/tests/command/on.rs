//! `--on`: shaders on surfaces, written as pictures with alpha.

use crate::in_process::oslrun;
use osl_image::{ImageData, read_image};
use std::path::Path;

fn file(dir: &Path, name: &str, text: &str) -> String {
    let path = dir.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// The channels of a picture of 32 × 32 pixels.
fn shade(shader: &str, more: &[&str], out: &Path) -> ImageData {
    let path = out.display().to_string();
    let args = [&[shader, "-g", "32x32", "-o", &path], more].concat();
    let (code, _, err) = oslrun(&args);
    assert_eq!(code, 0, "{args:?}: {err}");
    read_image(out).unwrap()
}

const SHADER: &str =
    "shader s(float bump = 0, output color uv = 0, output float far = 0, output normal n = 0,
    output vector by = 0, output point to = 0, output float out = 0) {
    uv = color(u, v, 0); far = length(P - point(\"object\", 0, 0, 0)); n = N;
    out = bump; by = bump * N; to = P + bump * N;
}";

/// A channel by its name in the picture.
fn channel(image: &ImageData, name: &str) -> Vec<f32> {
    let at = image.channels.iter().position(|c| c == name);
    image.plane(at.unwrap_or_else(|| panic!("{name} of {:?}", image.channels)))
}

#[test]
fn every_surface_is_shaded_where_it_is_seen() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(dir.path(), "s.osl", SHADER);
    for surface in ["sphere", "cylinder", "torus", "plane", "cube"] {
        let image = shade(&shader, &["--on", surface], &dir.path().join("a.exr"));
        let (alpha, far) = (channel(&image, "A"), channel(&image, "far"));
        let seen = alpha.iter().filter(|a| **a == 1.0).count();
        assert!(alpha.iter().all(|a| *a == 0.0 || *a == 1.0));
        assert!(seen > 150 && seen < 1024 && alpha[0] == 0.0, "{surface}: {seen}");
        for at in 0..alpha.len() {
            let (u, v) = (channel(&image, "uv.R")[at], channel(&image, "uv.G")[at]);
            let n = ["n.X", "n.Y", "n.Z"].map(|c| channel(&image, c)[at]);
            let length = n.iter().map(|x| x * x).sum::<f32>().sqrt();
            if alpha[at] == 0.0 {
                assert_eq!((u, v, far[at], length), (0.0, 0.0, 0.0, 0.0));
                continue;
            }
            assert!((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v) && (length - 1.0).abs() < 1e-5);
            if surface == "sphere" {
                assert!((far[at] - 1.0).abs() < 1e-5, "{}", far[at]);
            }
        }
    }
}

#[test]
fn pictures_show_what_outputs_are() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(dir.path(), "s.osl", SHADER);
    let (code, said, _) = oslrun(&[
        &shader,
        "--on",
        "sphere",
        "-g",
        "9x9",
        "-o",
        &dir.path().join("p.png").display().to_string(),
    ]);
    assert_eq!(code, 0);
    assert!(said.contains("p.uv.png") && said.contains("p.n.png"), "{said}");
    let normals = read_image(&dir.path().join("p.n.png")).unwrap();
    assert_eq!(normals.channels, ["R", "G", "B", "A"]);
    // The sphere's middle faces the camera, which stands in front, to the right and above.
    let middle: Vec<f32> = normals.samples[4 * (4 * 9 + 4)..][..4].to_vec();
    assert!(middle[0] > 0.5 && middle[1] > 0.5 && middle[2] > 0.8 && middle[3] == 1.0, "{middle:?}");
    assert_eq!(normals.samples[3], 0.0, "nothing is in the corner");
    let mask = read_image(&dir.path().join("p.far.png")).unwrap();
    assert_eq!(mask.channels, ["Y", "A"]);
}

#[test]
fn displacement_moves_the_surface_by_any_kind_of_output() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(dir.path(), "s.osl", SHADER);
    let far = |more: &[&str]| {
        let args =
            [&["--on", "sphere", "--outputs", "far", "--edge-pixels", "2", "-p", "bump=0.5"], more].concat();
        let image = shade(&shader, &args, &dir.path().join("a.exr"));
        let (far, alpha) = (channel(&image, "far"), channel(&image, "A"));
        far.into_iter().zip(alpha).filter(|(_, a)| *a > 0.0).map(|(far, _)| far).collect::<Vec<_>>()
    };
    for output in ["out", "by", "to"] {
        let moved = far(&["--displace", output]);
        assert!(moved.len() > 150 && moved.iter().all(|far| (far - 1.5).abs() < 0.01), "{output}: {moved:?}");
    }
    assert!(far(&[]).iter().all(|far| (far - 1.0).abs() < 1e-5), "only where it is asked for");
}

#[test]
fn displacement_shaders_move_the_point_itself() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(dir.path(), "d.osl", "displacement d(float by = 0.25) { P += by * N; }");
    let image =
        shade(&shader, &["--on", "cube", "--displace", "P", "--level", "3"], &dir.path().join("a.exr"));
    let (light, alpha) = (channel(&image, "light"), channel(&image, "A"));
    assert!(alpha.contains(&1.0));
    assert!(light.iter().zip(&alpha).all(|(l, a)| *l <= *a && (*a == 0.0 || *l > 0.0)), "lit where it is");
}

const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n\
    f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";

#[test]
fn meshes_come_from_files_and_may_be_smooth() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(dir.path(), "s.osl", SHADER);
    let obj = file(dir.path(), "cube.obj", CUBE);
    let most = |more: &[&str]| {
        let args = [&["--on", obj.as_str(), "--outputs", "far"], more].concat();
        let image = shade(&shader, &args, &dir.path().join("a.exr"));
        channel(&image, "far").into_iter().fold(0.0_f32, f32::max)
    };
    let sharp = most(&[]);
    assert!(sharp > 1.5 && sharp <= 3.0_f32.sqrt() + 1e-5, "{sharp}");
    let smooth = most(&["--catmull-clark"]);
    // The corners move to 1/2 in each coordinate, and the farthest points of the limit surface are these.
    assert!(smooth > 0.8 && smooth < 0.88, "{smooth}");
}

#[test]
fn what_is_wrong_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(dir.path(), "s.osl", SHADER);
    let bad = file(dir.path(), "bad.obj", "v 0 0 0\nf 1 2 3\n");
    let fails = |args: &[&str]| {
        let out = dir.path().join("never.exr").display().to_string();
        let (code, _, err) = oslrun(&[&[shader.as_str(), "-g", "8x8", "-o", &out], args].concat());
        assert!(code != 0 && !dir.path().join("never.exr").exists(), "{args:?}");
        err
    };
    assert!(fails(&["--on", "teapot"]).contains("`teapot` is no surface; there are sphere,"));
    assert!(fails(&["--on", "missing.obj"]).contains("cannot read missing.obj"));
    assert!(fails(&["--on", &bad]).contains("bad.obj"));
    assert!(fails(&["--on", "cube", "--displace", "bumps"]).contains("no output `bumps`; it has uv,"));
    assert!(
        fails(&["--on", "cube", "--displace", "uv", "--level", "40"]).contains("--limit scenes.triangles")
    );
    assert!(fails(&["--displace", "out"]).contains("--on"));
    assert!(fails(&["--on", "cube", "--eye", "0,0,0"]).contains("camera has no direction"));
    assert!(fails(&["--on", "cube", "--shading-rate", "2x2"]).contains("are for the grid"));
    assert!(fails(&["--on", "cube", "--within", "1s"]).contains("are for the grid"));
    let zero = fails(&["--on", "cube", "--object-space", "1 0 0 0 0 0 0 0 0 0 1 0 0 0 0 1"]);
    assert!(zero.contains("inverted"), "{zero}");
}

#[test]
fn what_is_not_finite_stays_and_is_counted() {
    let dir = tempfile::tempdir().unwrap();
    let shader =
        file(dir.path(), "s.osl", "shader s(output float d = 0) { d = u > 0.4 ? u * 1e30 * 1e30 : 0; }");
    let out = dir.path().join("a.exr").display().to_string();
    let (code, _, err) =
        oslrun(&[&shader, "--on", "plane", "--displace", "d", "--level", "2", "-g", "8x8", "-o", &out]);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("15 of 25 points stay in place"), "{err}");
}

#[test]
fn the_picture_is_the_same_on_any_number_of_threads() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(dir.path(), "s.osl", SHADER);
    let base = ["--on", "torus", "--displace", "out", "-p", "bump=0.1", "--edge-pixels", "3"];
    let one = shade(&shader, &[&base[..], &["--threads", "1"]].concat(), &dir.path().join("a.exr"));
    let four = shade(&shader, &[&base[..], &["--threads", "4"]].concat(), &dir.path().join("b.exr"));
    let scalar = shade(
        &shader,
        &[&base[..], &["--batch", "16", "--isa", "baseline"]].concat(),
        &dir.path().join("c.exr"),
    );
    assert!(one == four && one == scalar);
}

/// A checker whose squares are smaller than pixels near the poles, and a constant.
const CHECKER: &str = "shader s(output float checker = 0, output float one = 0) {
    checker = (int)(floor(u * 24) + floor(v * 12)) % 2; one = 1;
    if (v > 0.999) warning(\"at the pole\");
}";

#[test]
fn samples_smooth_the_picture_and_its_edge() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(dir.path(), "s.osl", CHECKER);
    let made =
        |more: &[&str]| shade(&shader, &[&["--on", "sphere"], more].concat(), &dir.path().join("a.exr"));
    let sharp = made(&[]);
    let reference = made(&["--samples", "1024"]);
    let off = |image: &ImageData, name: &str| {
        let (a, b) = (channel(image, name), channel(&reference, name));
        (a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f32>() / a.len() as f32).sqrt()
    };
    let alpha = channel(&reference, "A");
    assert!(alpha.iter().any(|a| (0.1..0.9).contains(a)) && alpha.iter().all(|a| (0.0..=1.0).contains(a)));
    for (value, alpha) in channel(&reference, "one").iter().zip(&alpha) {
        assert_eq!(*value, f32::from(u8::from(*alpha > 0.0)), "a constant has no edge");
    }
    let smooth = made(&["--samples", "64"]);
    assert!(off(&smooth, "checker") < 0.1 * off(&sharp, "checker"), "{}", off(&smooth, "checker"));
    assert!(off(&smooth, "A") < 0.1 * off(&sharp, "A"), "{}", off(&smooth, "A"));
    for filter in ["box", "gaussian", "blackman-harris", "mitchell"] {
        let filtered = made(&["--samples", "64", "--filter", filter]);
        assert!(off(&filtered, "checker") < 0.4, "{filter}: {}", off(&filtered, "checker"));
    }
    assert!(made(&["--samples", "64", "--threads", "1"]) == smooth);
}

#[test]
fn error_bounds_hold_on_a_surface() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(dir.path(), "s.osl", CHECKER);
    let out = dir.path().join("a.exr");
    let path = out.display().to_string();
    let base = [shader.as_str(), "-g", "32x32", "--on", "sphere", "-o", &path];
    let run = |more: &[&str]| oslrun(&[&base[..], more].concat());
    let (code, said, err) = run(&["--max-error", "checker=10%"]);
    assert_eq!(code, 0, "{err}");
    assert!(said.contains("evaluations a pixel"), "{said}");
    assert!(
        err.contains("10 % of the range of checker (0 to 1 at")
            && err.contains("`one`") | err.contains("of one"),
        "{err}"
    );
    assert!(err.contains("warning") && err.contains("at the pole"), "{err}");
    let found = channel(&read_image(&out).unwrap(), "checker");
    let reference = shade(&shader, &["--on", "sphere", "--samples", "4096"], &dir.path().join("b.exr"));
    let wrong = found.iter().zip(channel(&reference, "checker")).filter(|(a, b)| (*a - b).abs() > 0.1);
    assert!(wrong.count() <= 10, "of 1024 pixels");
    let (code, _, err) = run(&["--max-error", "0.01", "--samples", "8"]);
    assert!(
        code == 1 && err.contains("the error bound 0.01 is missed") && err.contains("--samples N"),
        "{err}"
    );
    let (code, said, err) = run(&["--adaptive", "0.05"]);
    assert!(code == 0 && said.contains("with 4,"), "{said}{err}");
}
