//! `--preview`: shaders on surfaces with light, from one command.

use crate::in_process::oslrun;
use osl_image::{ImageData, read_image};
use std::path::Path;

fn file(dir: &Path, name: &str, text: &str) -> String {
    let path = dir.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// A preview of 24 x 24 pixels, and what was said about it.
fn preview(dir: &Path, text: &str, more: &[&str]) -> (ImageData, String) {
    let shader = file(dir, "s.osl", text);
    let out = dir.join("out.exr").display().to_string();
    let args = [&[&shader, "--preview", "-g", "24x24", "-o", &out], more].concat();
    let (code, _, err) = oslrun(&args);
    assert_eq!(code, 0, "{args:?}: {err}");
    (read_image(Path::new(&out)).unwrap(), err)
}

fn channel(image: &ImageData, name: &str) -> Vec<f32> {
    let at = image.channels.iter().position(|c| c == name);
    image.plane(at.unwrap_or_else(|| panic!("{name} of {:?}", image.channels)))
}

/// The mean of a channel over the pixels in the middle of the picture.
fn middle(image: &ImageData, name: &str) -> f32 {
    let plane = channel(image, name);
    let rows = (9..15).flat_map(|y| (9..15).map(move |x| y * 24 + x));
    rows.map(|at| plane[at]).sum::<f32>() / 36.0
}

#[test]
fn a_color_becomes_a_lit_ball() {
    let dir = tempfile::tempdir().unwrap();
    let text = "shader s(output float mask = 0, output color tint = color(0.8, 0.1, 0.1)) { mask = u; }";
    let (image, said) = preview(dir.path(), text, &[]);
    assert!(said.contains("the preview shows base color `tint`\n"), "{said}");
    let (red, green) = (middle(&image, "R"), middle(&image, "G"));
    assert!(red > 0.2 && red > 2.0 * green, "{red} {green}");
    let (image, said) = preview(dir.path(), text, &["--base", "mask"]);
    assert!(said.contains("base color `mask`"), "{said}");
    assert!((middle(&image, "R") / middle(&image, "G") - 1.0).abs() < 0.2);
}

#[test]
fn a_closure_is_shown_as_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let text = "surface s(output color tint = 1) { Ci = color(0.1, 0.9, 0.1) * emission(); }";
    let (image, said) = preview(dir.path(), text, &[]);
    assert!(said.contains("the closure `Ci`"), "{said}");
    assert!((middle(&image, "G") - 0.9).abs() < 1e-3 && (middle(&image, "R") - 0.1).abs() < 1e-3);
    let (image, _) = preview(dir.path(), text, &["--base", "tint"]);
    assert!(middle(&image, "R") > 0.3, "an option for a role takes the output");
}

#[test]
fn bumps_normals_and_displacements_change_the_light() {
    let dir = tempfile::tempdir().unwrap();
    let text = "shader s(output float waves = 0, output normal bent = 0, output vector by = 0) {
        waves = 0.1 * sin(30 * P[1]); bent = normalize(N + 0.5 * vector(0, 1, 0)); by = 0.5 * N; }";
    let plain = ["--base", "waves", "--normal", "by"];
    let flat = preview(dir.path(), text, &plain).0;
    for more in [&["--bump", "waves,2"][..], &["--displace", "by"], &["--displace", "waves,0.5"]] {
        let (image, said) = preview(dir.path(), text, &[&plain[..], more].concat());
        assert!(said.contains(&format!("`{}`", more[1].split(',').next().unwrap())), "{said}");
        let differ = channel(&image, "R").iter().zip(channel(&flat, "R")).any(|(a, b)| (a - b).abs() > 0.02);
        assert!(differ, "{more:?}");
    }
    let depth = |image: &ImageData| middle(image, "depth");
    let grown = preview(dir.path(), text, &["--base", "waves", "--normal", "by", "--displace", "by,2"]).0;
    assert!(depth(&grown) > 1.5 * depth(&flat), "the camera sees all of a larger surface");
}

#[test]
fn every_surface_and_a_group_can_be_shown() {
    let dir = tempfile::tempdir().unwrap();
    let text = "shader s(output color tint = 0) { tint = color(u, v, 0); }";
    for surface in ["sphere", "cylinder", "torus", "plane", "cube"] {
        let (image, _) = preview(dir.path(), text, &["--on", surface, "--samples", "2"]);
        assert!(channel(&image, "R").iter().all(|x| x.is_finite()), "{surface}");
    }
    let mesh = file(dir.path(), "m.obj", "v -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    preview(dir.path(), text, &["--on", &mesh, "--samples", "2"]);
    file(dir.path(), "s.osl", text);
    let group = file(dir.path(), "g.group", "shader s preview_0; shader s b; connect preview_0.tint b.tint;");
    let out = dir.path().join("g.png").display().to_string();
    let (code, said, err) = oslrun(&[&group, "--preview", "-g", "8x8", "-o", &out]);
    assert_eq!((code, said.as_str()), (0, format!("wrote {out}\n").as_str()), "{err}");
}

#[test]
fn the_picture_depends_on_neither_threads_nor_luck() {
    let dir = tempfile::tempdir().unwrap();
    let text = "shader s(output color tint = 0) { tint = noise(8 * P); }";
    let one = preview(dir.path(), text, &["--threads", "1"]).0;
    let two = preview(dir.path(), text, &["--threads", "2"]).0;
    assert_eq!(one, two);
    let raw = preview(dir.path(), text, &["--raw"]).0;
    assert_ne!(channel(&one, "R"), channel(&raw, "R"));
}

#[test]
fn exposure_and_view_change_the_png_only() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(dir.path(), "s.osl", "shader s(output color tint = 0.5) {}");
    let picture = |more: &[&str]| {
        let out = dir.path().join("a.png");
        let path = out.display().to_string();
        let (code, _, err) = oslrun(&[&[&shader, "--preview", "-g", "8x8", "-o", &path], more].concat());
        assert_eq!(code, 0, "{err}");
        std::fs::read(out).unwrap()
    };
    let plain = picture(&[]);
    assert_eq!(plain, picture(&["--view", "soft", "--exposure", "0"]));
    for more in [["--exposure", "-1"], ["--view", "filmic"]] {
        assert_ne!(plain, picture(&more), "{more:?}");
    }
}

#[test]
fn mistakes_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(dir.path(), "s.osl", "shader s(output color tint = 0.5, output float amount = 0) {}");
    let out = dir.path().join("a.png").display().to_string();
    let said = |more: &[&str]| {
        let (code, _, err) = oslrun(&[&[shader.as_str()], more].concat());
        assert_ne!(code, 0, "{more:?}");
        assert!(!Path::new(&out).exists(), "{more:?}");
        err
    };
    let lit = |more: &[&str]| said(&[&["--preview", "-o", &out], more].concat());
    assert!(lit(&["--base", "tnt"]).contains("did you mean `tint`?"));
    assert!(lit(&["--roughness", "tint"]).contains("suitable: amount"));
    assert!(lit(&["--displace", "amout"]).contains("did you mean `amount`?"));
    assert!(lit(&["--bump", "amount,x"]).contains("a gain is a number"));
    assert!(lit(&["--on", "ball"]).contains("is no surface"));
    assert!(lit(&["--view", "nice"]).contains("one of soft, srgb, filmic"));
    assert!(lit(&["--max-error", "2"]).contains("--max-error"));
    assert!(lit(&["-g", "100000x100000"]).contains("more than"));
    assert!(lit(&["--closures"]).contains("cannot be used with"));
    assert!(said(&["--preview"]).contains("--output"));
    assert!(said(&["--base", "tint", "-o", &out]).contains("--preview"));
}

#[test]
fn the_commands_of_the_gallery_work() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = |name: &str| std::fs::read_to_string(root.join("docs").join(name)).unwrap();
    let page = page("gallery.md") + &page("cameras.md");
    let root = root.display().to_string();
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("a.png").display().to_string();
    let mut count = 0;
    for line in page.lines().filter(|line| line.starts_with("| ![]")) {
        let (picture, command) = line.trim_end_matches("` |").split_once(") | ").unwrap();
        let picture = picture.trim_start_matches("| ![](");
        assert!(Path::new(&root).join("docs").join(picture).is_file(), "{picture}");
        let (_, command) = command.split_once("`oslrun ").unwrap();
        let (command, _) = command.split_once(" -o ").unwrap();
        let word = |word: &str| match word.split_once("examples/") {
            Some((before, rest)) => format!("{before}{root}/examples/{rest}"),
            None if word.starts_with("osl/") => format!("{root}/{word}"),
            None => word.to_string(),
        };
        let words: Vec<String> = command.split(' ').map(word).collect();
        let mut words: Vec<&str> = words.iter().map(String::as_str).collect();
        words.extend(["-g", "12x12", "-o", &out]);
        let (code, _, err) = oslrun(&words);
        assert!(code == 0 && !err.contains("error"), "{command}: {err}");
        std::fs::remove_file(&out).unwrap();
        count += 1;
    }
    let nodes = std::fs::read_dir(format!("{root}/osl/nodes")).unwrap().count();
    assert!(count >= 12 + nodes, "{count} pictures of 6 shaders, 6 cameras and {nodes} nodes");
}
