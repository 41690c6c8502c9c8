//! Errors of a running shader: the image is written, each message has a line with its points, and the last
//! line counts.

use crate::in_process::oslrun_at;
use std::path::Path;
use std::process::Command;

struct Ran {
    code: Option<i32>,
    out: String,
    err: String,
}

fn run(dir: &Path, args: &[&str]) -> Ran {
    let result = Command::new(env!("CARGO_BIN_EXE_oslrun")).current_dir(dir).args(args).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    Ran { code: result.status.code(), out: text(result.stdout), err: text(result.stderr) }
}

fn folder(shader: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("s.osl"), shader).unwrap();
    dir
}

const PALETTE: &str = "shader s(output float f = 0)\n{\n    float pal[5] = {0, 1, 2, 3, 4};\n    int i = (int)(u * 7);\n    f = pal[i] * pal[i];\n    for (int k = 0; k < 3; k++)\n        if (v > 0.5) error(\"high\");\n}\n";

#[test]
fn the_image_is_written_and_messages_are_counted_by_place() {
    let dir = folder(PALETTE);
    let ran = run(dir.path(), &["s.osl", "-g", "8x4", "-o", "out.exr"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    // Two reads in one line are one place; a point counts once, even if it repeats the message.
    insta::assert_snapshot!("palette", ran.err);
    assert_eq!(ran.out, "wrote out.exr; 4 errors while shading\n");
    assert!(osl_image::read_image(&dir.path().join("out.exr")).is_ok());
    let denied = run(dir.path(), &["s.osl", "-g", "8x4", "-o", "other.exr", "--deny", "errors"]);
    assert_eq!(denied.code, Some(1));
    assert!(
        denied.err.starts_with(&ran.err) && denied.err.contains("4 errors while shading"),
        "{}",
        denied.err
    );
    assert!(!dir.path().join("other.exr").exists() && denied.out.is_empty());
}

#[test]
fn counts_do_not_depend_on_how_points_run() {
    let shader = "shader s(string file = \"none.tx\", output color c = 0) {\n  float a[3];\n  int i = (int)(noise(P * 5) * 5);\n  c = a[i];\n  if (u > 0.3)\n    c += texture(file, u, v);\n  if (i == 2) c += texture(\"\", 0, 0) + transform(\"nowhere\", N);\n  if (v > 0.9) warning(\"%d\", i);\n}\n";
    let dir = folder(shader);
    let base = ["s.osl", "-g", "97x201", "--outputs", "c"];
    let expected = run(dir.path(), &base);
    assert_eq!(expected.code, Some(0));
    assert!(expected.err.contains(" of 19497 points"), "{}", expected.err);
    for more in
        [&["--batch", "16"][..], &["--threads", "1"], &["--batch", "700", "--threads", "3"], &["-o", "o.exr"]]
    {
        let ran = run(dir.path(), &[&base[..], more].concat());
        assert_eq!(ran.err, expected.err, "{more:?}");
    }
}

#[test]
fn a_file_that_cannot_be_used_has_one_line_with_its_parameter() {
    let shader = "shader s(string empty = \"\", string gone = \"none.tx\", string out = \"../x.tx\", output color c = 0) {\n  float r[2];\n  gettextureinfo(gone, \"resolution\", r);\n  c = texture(empty, u, v) + texture(gone, u, v) + texture(out, u, v);\n  c += environment(gone, N);\n}\n";
    let dir = folder(shader);
    std::fs::create_dir(dir.path().join("tex")).unwrap();
    let ran = run(dir.path(), &["s.osl", "-g", "4x4", "--texture-path", "tex"]);
    assert_eq!(ran.code, Some(0));
    insta::assert_snapshot!("files", ran.err);
    assert!(ran.out.ends_with("3 errors while shading\n"), "{}", ran.out);
}

#[test]
fn tools_read_messages_as_json() {
    let dir = folder(PALETTE);
    let ran = run(dir.path(), &["s.osl", "-g", "8x4", "--message-format", "json"]);
    let lines: Vec<serde_json::Value> =
        ran.err.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 4);
    assert_eq!(lines[0]["message"], "index 5 out of 0..4 of `pal`");
    assert_eq!((&lines[0]["file"], &lines[0]["line"]), (&"s.osl".into(), &5.into()));
    assert_eq!((&lines[0]["points"], &lines[0]["of"]), (&4.into(), &32.into()));
    assert_eq!(lines[0]["pixel"], serde_json::json!([5, 0]));
    assert_eq!(lines[0]["severity"], "error");
}

#[test]
fn groups_views_and_scenes_write_their_images_too() {
    let dir = folder(PALETTE);
    let group = ["--group", "shader s a; shader s b;", "--outputs", "f,a.f", "-g", "8x4", "-o", "g.exr"];
    let ran = run(dir.path(), &group);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.err.contains("s.osl:5: index 5 out of 0..4 of `pal`, at 4 of 32 points"), "{}", ran.err);
    let ran = run(dir.path(), &["s.osl", "--on", "sphere", "-g", "16x16", "-o", "on.png"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.out.contains("wrote on.png; ") && ran.err.contains("first at pixel ("), "{}", ran.err);
    let samples = run(dir.path(), &["s.osl", "--samples", "4", "-g", "8x4", "-o", "on.png"]);
    assert!(
        samples.code == Some(0) && samples.err.contains(" of 128 samples, first at pixel ("),
        "{}",
        samples.err
    );
}

#[test]
fn the_grid_has_texture_coordinates_and_the_spaces_of_its_image() {
    let shader = "shader s(float s = 9 [[int lockgeom = 0]], output float a = 0, output float b = 0, output point r = 0) {\n  a = s - u;\n  float t = 9;\n  b = getattribute(\"t\", t) + t - v;\n  r = transform(\"NDC\", P) * point(8, 4, 1) - transform(\"raster\", P);\n}\n";
    let dir = folder(shader);
    let ran = run(dir.path(), &["s.osl", "-g", "8x4"]);
    assert!(ran.err.is_empty(), "{}", ran.err);
    let expected = "a: 0 to 0, mean 0.000000\nb: 1 to 1, mean 1.000000\nr.X: 0 to 0";
    assert!(ran.out.starts_with(expected), "{}", ran.out);
}

#[test]
fn a_material_without_other_outputs_has_its_closures_for_an_image() {
    let dir = folder("surface s() { Ci = u * diffuse(N) + emission(); }");
    let ran = run(dir.path(), &["s.osl", "-g", "4x4", "-o", "out.exr"]);
    assert_eq!((ran.code, &*ran.out), (Some(0), "wrote out.exr\n"));
    assert!(ran.err.starts_with("note: ") && ran.err.contains("--closures"), "{}", ran.err);
    let image = osl_image::read_image(&dir.path().join("out.exr")).unwrap();
    assert!(image.channels.iter().any(|c| c == "Ci.emission.G"), "{:?}", image.channels);
    let ran = run(dir.path(), &["s.osl", "-g", "4x4", "--samples", "4", "-o", "other.exr"]);
    assert!(ran.code == Some(0) && ran.err.contains("oslrun render"), "{}", ran.err);
    let again = osl_image::read_image(&dir.path().join("other.exr")).unwrap();
    assert_eq!(again.channels, image.channels, "samples of weights");
}

#[test]
fn ints_are_plain_numbers_and_a_run_says_which_are_rounded() {
    let dir = folder(
        "shader s(output int n = 0, output int big = 0) { n = (int)(u * 7 + 0.5) - 3; big = 16777216 + n; }",
    );
    let ran = run(dir.path(), &["s.osl", "-g", "8x1", "-o", "out.exr"]);
    assert_eq!((ran.code, &*ran.out), (Some(0), "wrote out.exr\n"));
    // 1 and 3 above the limit.
    let said = "warning: 2 ints of `big` are rounded in the image, whose floats hold all up to 16777216\n";
    assert_eq!(ran.err, said);
    let half = run(dir.path(), &["s.osl", "-g", "8x1", "--half", "--outputs", "n", "-o", "half.exr"]);
    assert_eq!(half.err, "");
}

#[test]
fn every_format_holds_the_outputs() {
    let dir =
        folder("shader s(output float f = 0, output color c = 0) { f = 3 * u - 1; c = color(u, v, 0.25); }");
    for (ending, near) in [("exr", 0.0), ("tif", 0.0), ("png", 0.01), ("jpg", 0.05)] {
        let out = format!("out.{ending}");
        let ran = run(dir.path(), &["s.osl", "-g", "8x8", "--outputs", "c", "-o", &out]);
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        let image = osl_image::read_image(&dir.path().join(&out)).unwrap();
        let blue = image.plane(2);
        // PNG and JPEG hold the value on the sRGB curve.
        let wanted = if near == 0.0 { 0.25 } else { 0.537 };
        assert!(blue.iter().all(|x| (x - wanted).abs() <= near), "{ending}: {blue:?}");
    }
    let ran = run(dir.path(), &["s.osl", "-g", "8x8", "-o", "both.tif"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let image = osl_image::read_image(&dir.path().join("both.f.tif")).unwrap();
    assert_eq!(image.plane(0).first(), Some(&-1.0));
    assert!(dir.path().join("both.c.tif").exists());
}

#[test]
fn texts_that_vary_do_not_fill_the_screen() {
    let dir = folder("shader s(output float f = 0) { error(\"value %g\", u); f = u; }\n");
    let ran = run(dir.path(), &["s.osl", "-g", "9x2"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let lines: Vec<&str> = ran.err.lines().collect();
    assert_eq!(lines.len(), 6, "{}", ran.err);
    assert_eq!(
        lines[0],
        "error: s.osl:1: Shader error [s]: value 0, at 2 of 18 points, first at pixel (0, 0)"
    );
    assert_eq!(lines[5], "error: s.osl:1: and 4 other messages of this line");
    assert!(ran.out.contains("9 errors while shading"), "{}", ran.out);
}

#[test]
fn steps_are_those_of_each_point() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(
        dir.path().join("s.osl"),
        "shader s(output float f = 0) {
            for (int i = 0; i < 10 * u; i++) f += sin(i * v);
            if (v > 0.5) for (int i = 0; i < 5 + u; i++) f += cos(f);
        }",
    )
    .unwrap();
    let steps = |more: &str| {
        let (code, _, err) = oslrun_at(dir.path(), &format!("@/s.osl -g 33x17 --steps -o @/a.exr {more}"));
        assert_eq!(code, 0, "{err}");
        let image = osl_image::read_image(&dir.path().join("a.exr")).unwrap();
        assert_eq!(image.channels, ["f", "steps"]);
        image.plane(1)
    };
    let usual = steps("");
    for more in ["--batch 1", "--batch 16", "--threads 1 --batch 48", "--isa baseline"] {
        assert_eq!(steps(more), usual, "{more}");
    }
    // Rounds of the loop, and the branch.
    for row in usual.chunks(33) {
        assert!(row[0] < row[16] && row[16] < row[32], "{row:?}");
        assert!(row.windows(2).all(|pair| pair[0] <= pair[1]), "{row:?}");
    }
    assert!(usual[0] < usual[16 * 33]);
    let (code, _, err) = oslrun_at(dir.path(), "@/s.osl --steps --samples 4 -o @/b.exr");
    assert!(code == 2 && err.contains("cannot be used with"), "{err}");
}
