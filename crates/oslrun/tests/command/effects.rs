//! The results of a run other than images: closures, printed text, files; and their limits.

use std::path::Path;
use std::process::{Command, Output};

/// Runs a shader in a folder of its own.
fn run(dir: &Path, shader: &str, args: &[&str]) -> Output {
    std::fs::write(dir.join("s.osl"), shader).unwrap();
    Command::new(env!("CARGO_BIN_EXE_oslrun")).current_dir(dir).arg("s.osl").args(args).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const GLOW: &str =
    "surface glow() { Ci = 0.5 * diffuse(N) + color(u, v, 0) * emission(); if (u > 0.9) Ci = 0; }";

#[test]
fn closures_are_shown_and_become_layers() {
    let dir = tempfile::tempdir().unwrap();
    let result = run(dir.path(), GLOW, &["-g", "2x1", "--closures"]);
    insta::assert_snapshot!("closures_small", text(&result.stdout));
    let result = run(dir.path(), GLOW, &["-g", "16x16", "--closures", "-o", "out.exr"]);
    insta::assert_snapshot!("closures_large", text(&result.stdout));
    let image = osl_image::read_image(&dir.path().join("out.exr")).unwrap();
    assert!(image.channels.iter().any(|c| c == "Ci.emission.G"), "{:?}", image.channels);
}

#[test]
fn profiles_name_instructions_and_lines() {
    let dir = tempfile::tempdir().unwrap();
    let shader =
        "shader s(output float f = 0)\n{\n  for (int i = 0; i < 100 * u; i++)\n    f += noise(P * i);\n}";
    let result = run(dir.path(), shader, &["-g", "32x32", "--profile"]);
    let told = text(&result.stdout);
    assert!(result.status.success(), "{told}");
    assert!(told.contains("noise.uperlin.3d") && told.contains("s.osl:4"), "{told}");
    for (file, start) in [("time.svg", "<?xml"), ("time.folded", "s;")] {
        let flag = format!("--profile={file}");
        let result = run(dir.path(), shader, &["-g", "32x32", &flag]);
        assert!(text(&result.stdout).contains("wrote"), "{}", text(&result.stderr));
        let written = std::fs::read_to_string(dir.path().join(file)).unwrap();
        assert!(written.starts_with(start) && written.contains("loop_s.osl:3"), "{written}");
    }
}

#[test]
fn profiles_name_what_runs_for_each_cell_too() {
    let dir = tempfile::tempdir().unwrap();
    let shader = "shader s(float cells = 2, output float f = 0)\n{\n  point p = floor(P * cells);\n  f = sin(cellnoise(p));\n}";
    for cells in ["cells=2", "cells=1000"] {
        let result = run(dir.path(), shader, &["-g", "64x64", "-p", cells, "--profile"]);
        let told = text(&result.stdout);
        assert!(told.contains("\nsin "), "{cells}: {told}");
        assert!(told.contains("noise.cell.3d"), "{cells}: {told}");
    }
}

#[test]
fn images_of_several_pieces_are_whole() {
    let dir = tempfile::tempdir().unwrap();
    let shader = "shader s(output matrix m = 0, output color c = 0, output float rest[20] = {0}) {
        m = matrix(u); c = color(u, v, 1); rest[19] = v; }";
    let (width, height) = (4096, 67);
    let result = run(dir.path(), shader, &["-g", "4096x67", "-o", "out.exr", "--compression", "none"]);
    assert!(result.status.success(), "{}", text(&result.stderr));
    let image = osl_image::read_image(&dir.path().join("out.exr")).unwrap();
    let channel = |name: &str| image.channels.iter().position(|c| c == name).unwrap();
    let at = |x: usize, y: usize, c: usize| image.samples[(y * width + x) * image.channels.len() + c];
    let (green, last) = (channel("c.G"), channel("rest[19]"));
    for y in 0..height {
        let v = y as f32 / (height - 1) as f32;
        assert_eq!((at(7, y, green), at(4095, y, last)), (v, v), "row {y}");
    }
}

#[test]
fn files_are_appended_below_the_working_directory_only() {
    let dir = tempfile::tempdir().unwrap();
    let shader = "shader s(string file = \"\") { fprintf(file, \"%g\\n\", u); printf(\"point %g\\n\", u); }";
    for _ in 0..2 {
        let result = run(dir.path(), shader, &["-g", "2x1", "-p", "file=out.txt"]);
        assert!(result.status.success(), "{}", text(&result.stderr));
        assert!(text(&result.stdout).starts_with("point 0\npoint 1\n"));
    }
    assert_eq!(std::fs::read_to_string(dir.path().join("out.txt")).unwrap(), "0\n1\n0\n1\n");
    let inner = dir.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(dir.path(), inner.join("link")).unwrap();
    let outside = dir.path().join("secret.txt");
    let absolute = format!("file={}", outside.display());
    for file in ["file=../secret.txt", "file=link/secret.txt", absolute.as_str()] {
        let result = run(&inner, shader, &["-g", "2x1", "-p", file]);
        assert_eq!(result.status.code(), Some(1), "{file}");
        assert!(text(&result.stderr).contains("not below the working directory"), "{file}");
        assert!(!outside.exists(), "{file}");
    }
    let result = run(&inner, shader, &["-g", "2x1", "-p", absolute.as_str(), "--allow-files"]);
    assert!(result.status.success() && outside.exists());
}

#[test]
fn dictionaries_are_read_below_the_working_directory_only() {
    let dir = tempfile::tempdir().unwrap();
    let inner = dir.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    let shader = "shader s(string file = \"\") { int n = dict_find(file, \"/a/b\"); float k = 0; dict_value(n, \"k\", k); printf(\"%g\\n\", k); }";
    for folder in [dir.path(), inner.as_path()] {
        std::fs::write(folder.join("d.xml"), "<a><b k='2.5'/></a>").unwrap();
    }
    let result = run(&inner, shader, &["-g", "1x1", "-p", "file=d.xml"]);
    assert!(text(&result.stdout).starts_with("2.5\n"), "{}", text(&result.stderr));
    // The name in the shader is refused; the one that the user types is not.
    let outside = shader.replace("file = \"\"", "file = \"../d.xml\"");
    let result = run(&inner, shader, &["-g", "1x1", "-p", "file=../d.xml"]);
    assert!(text(&result.stdout).starts_with("2.5\n"), "{}", text(&result.stderr));
    let result = run(&inner, &outside, &["-g", "1x1"]);
    assert_eq!(result.status.code(), Some(0));
    assert!(text(&result.stdout).starts_with("0\n") && text(&result.stderr).contains("is refused"));
}

#[test]
fn what_does_not_end_stops_with_its_place() {
    let dir = tempfile::tempdir().unwrap();
    let endless = "shader s(output float r = 0) {\n  while (u >= 0)\n    r += 1;\n}\n";
    let result = run(dir.path(), endless, &["-g", "4x4", "--max-steps", "1000", "-o", "out.exr"]);
    assert_eq!(result.status.code(), Some(1));
    assert!(
        text(&result.stderr).contains("s.osl:2: point 0 takes more than 1000 steps"),
        "{}",
        text(&result.stderr)
    );
    assert!(!dir.path().join("out.exr").exists());
    let doubling = "shader s() { string a = \"ab\"; for (int i = 0; i < 21; i++) a = concat(a, a); printf(\"%d\\n\", strlen(a)); }";
    let result = run(dir.path(), doubling, &["-g", "1x1"]);
    assert!(text(&result.stdout).starts_with("1048576\n"), "{}", text(&result.stdout));
    let prints = "shader s() { string a = \"0123456789\"; for (int i = 0; i < 12; i++) a = concat(a, a); for (int i = 0; i < 10000; i++) printf(\"%s\", a); }";
    let result = run(dir.path(), prints, &["-g", "1x1"]);
    assert!(result.stdout.len() < 80 << 20);
    assert!(text(&result.stderr).contains("takes more than"), "{}", text(&result.stderr));
}
