//! `compare`: two images, two shaders, two settings of a shader, and an image with a shader.

use crate::in_process::oslrun_at;
use osl_image::{ExrOptions, Layer, LayerKind, read_image, write_exr};
use serde_json::Value;
use tempfile::TempDir;

const SHADER: &str =
    "shader s(float k = 1, int add = 0, output color c = 0, output float f = 0, output int n = 0)
    { c = color(k * u, v, 0); f = u > 0.9 && v > 0.9 ? k : 0.5; n = 16777216 + add; }";

/// A folder with shaders, and with images of one channel.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("s.osl", SHADER.to_string()),
        ("t.osl", SHADER.replace("color(k * u, v, 0)", "color(k * u, v, 0.25 * u)")),
        ("bad.osl", "shader bad() { float x = y; }".to_string()),
    ] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let image = |name: &str, values: &[f32], width: usize, channel: &str| {
        let layer = Layer { name: channel, kind: LayerKind::Scalar, planes: vec![values] };
        let path = folder.path().join(name);
        write_exr(&path, width, values.len() / width, &[layer], ExrOptions::default()).unwrap();
    };
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    image("a.exr", &[0.0, 1.0, 2.0, 3.0], 2, "x");
    image("b.exr", &[0.0, 1.5, 2.0, 2.75], 2, "x");
    image("nan.exr", &[0.0, nan, inf, 3.0], 2, "x");
    image("inf.exr", &[0.0, nan, -inf, nan], 2, "x");
    image("wide.exr", &[0.0, 1.0, 2.0, 3.0], 4, "x");
    image("other.exr", &[0.0, 1.0, 2.0, 3.0], 2, "y");
    folder
}

#[test]
fn images_are_compared_value_by_value() {
    let folder = folder();
    let said = |args: &str| {
        let (code, out, err) = oslrun_at(folder.path(), args);
        format!("$ oslrun {args}\n{out}{err}[exit {code}]\n\n")
    };
    let mut all = String::new();
    for args in [
        "compare @/a.exr @/a.exr",
        "compare @/a.exr @/b.exr",
        "compare @/a.exr @/b.exr --tolerance 0.25",
        "compare @/a.exr @/b.exr --tolerance 0.5",
        "compare @/nan.exr @/nan.exr",
        "compare @/nan.exr @/inf.exr --tolerance 1000",
        "compare @/a.exr @/wide.exr",
        "compare @/a.exr @/other.exr",
        "compare @/a.exr @/b.exr --outputs y",
        "compare @/a.exr @/none.exr",
        "compare @/a.exr",
        "compare @/a.exr @/b.exr -g 4x4",
        "compare @/a.exr @/b.exr --tolerance -1",
        "compare @/a.exr @/b.exr -o @/d.tif",
        "compare @/a.exr @/b.exr -- -p k=1",
        "compare @/s.osl -g 4x4 --stats -- -p k=2",
        "compare @/s.osl -g 4x4 -- --nonsense",
        "compare @/s.osl -g 4x4 -- -p k=2 --range auto",
    ] {
        all += &said(args);
    }
    insta::assert_snapshot!("compared", all);
}

/// The same picture in three formats, and a shader that looks it up.
#[test]
fn images_of_other_formats_are_compared() {
    let folder = folder();
    let tga = [0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 24, 0x20, 30, 20, 10, 60, 50, 40];
    std::fs::write(folder.path().join("a.tga"), tga).unwrap();
    std::fs::write(folder.path().join("a.ppm"), "P3 2 1 255 10 20 30 40 50 60").unwrap();
    std::fs::write(folder.path().join("b.ppm"), "P3 2 1 255 10 20 30 40 50 61").unwrap();
    let look = "shader look(output color c = 0) { c = texture(\"a.tga\", u, v, \"interp\", \"closest\"); }";
    std::fs::write(folder.path().join("look.osl"), look).unwrap();
    let code = |args: &str| oslrun_at(folder.path(), args).0;
    assert_eq!(code("compare @/a.ppm @/a.tga"), 0);
    assert_eq!(code("compare @/a.ppm @/b.ppm"), 1);
    assert_eq!(code("@/look.osl -g 2x1 --center -o @/c.tif --outputs c"), 0);
    assert_eq!(code("compare @/a.tga @/c.tif"), 0);
}

#[test]
fn shaders_and_settings_are_compared() {
    let folder = folder();
    let json = |args: &str, code: u8| -> Value {
        let (found, out, err) = oslrun_at(folder.path(), &format!("compare {args} --json -g 21x11"));
        assert_eq!(found, code, "{args}: {out}{err}");
        serde_json::from_str(&out).unwrap_or_else(|_| panic!("{out}{err}"))
    };
    let report = json("@/s.osl @/s.osl", 0);
    assert_eq!((&report["equal"], &report["size"][0]), (&Value::from(true), &Value::from(21)));
    let largest = |report: &Value, name: &str| {
        let list = report["channels"].as_array().unwrap();
        list.iter().find(|c| c["channel"] == name).unwrap()["largest"].as_f64().unwrap()
    };
    let report = json("@/s.osl @/t.osl", 1);
    assert_eq!((largest(&report, "c.R"), largest(&report, "c.B")), (0.0, 0.25));
    assert_eq!(report["different_pixels"], 20 * 11, "the first column is equal");
    // The options after `--` belong to the second picture; they come after those of both.
    let with = |args: &str| oslrun_at(folder.path(), args);
    for args in
        ["compare @/s.osl -g 21x11 --json -- -p k=1.5", "compare @/s.osl -g 21x11 -p k=1 --json -- -p k=1.5"]
    {
        let (code, out, err) = with(args);
        assert_eq!(code, 1, "{err}");
        let report: Value = serde_json::from_str(&out).unwrap();
        assert_eq!((largest(&report, "c.R"), largest(&report, "f")), (0.5, 0.5), "{args}");
        assert_eq!(report["channels"][0]["at"]["pixel"], serde_json::json!([20, 0]));
    }
    assert_eq!(with("compare @/s.osl -g 9x9 -- --threads 1 --batch 7 --isa baseline").0, 0);
    assert_eq!(with("compare @/s.osl -g 9x9 -- @/t.osl -p k=1").0, 1);
    assert_eq!(with("compare @/s.osl -g 9x9 --outputs c -- -g 8x9").0, 1);
    // Ints that a float cannot hold differ all the same.
    let (code, out, _) = with("compare @/s.osl -g 2x2 --outputs n -- -p add=1");
    assert!(code == 1 && out.contains("16777217"), "{out}");
    // An error of a shader is said, and compared with nothing.
    let (code, out, err) = with("compare @/s.osl @/bad.osl");
    assert!(code == 1 && out.is_empty() && err.contains("@/bad.osl:1"), "{err}");
    let (code, out, err) = with("compare --layer a=@/s.osl -g 2x2");
    assert!(code == 2 && out.is_empty() && err.contains("takes two pictures"), "{err}");
}

#[test]
fn an_image_is_compared_with_its_shader() {
    let folder = folder();
    let run = |args: &str| oslrun_at(folder.path(), args);
    assert_eq!(run("@/s.osl -g 16x8 --outputs c,f -o @/s.exr").0, 0);
    let (code, out, err) = run("compare @/s.exr @/s.osl -g 16x8 --outputs c,f");
    assert_eq!(code, 0, "{out}{err}");
    assert!(out.ends_with("equal\n"), "{out}");
    let (code, _, err) = run("compare @/s.exr @/s.osl -g 16x9 --outputs c,f");
    assert!(code == 1 && err.contains("the sizes differ: @/s.exr has 16x8 pixels"), "{err}");
    let (code, _, err) = run("compare @/s.exr @/s.osl -g 16x8");
    assert!(code == 1 && err.contains("only @/s.osl has n"), "{err}");
    // The surfaces of --on have alpha, in the file as in the run.
    assert_eq!(run("@/s.osl -g 16x16 --on sphere -o @/on.exr").0, 0);
    assert_eq!(run("compare @/on.exr @/s.osl -g 16x16 --on sphere").0, 0);
    assert_eq!(run("compare @/on.exr @/s.osl -g 16x16 --on sphere --outputs c").0, 0);
    assert_eq!(run("compare @/on.exr @/s.osl -g 16x16 --on cube --outputs c").0, 1);
}

#[test]
fn pictures_show_the_difference() {
    let folder = folder();
    let run = |args: &str| oslrun_at(folder.path(), args);
    let (code, out, _) = run("compare @/a.exr @/b.exr -o @/d.exr");
    assert!(code == 1 && out.contains("wrote @/d.exr: the second picture minus the first"), "{out}");
    let image = read_image(&folder.path().join("d.exr")).unwrap();
    assert_eq!((image.channels[0].as_str(), &image.samples[..]), ("x", &[0.0, 0.5, 0.0, -0.25][..]));
    let (code, out, _) = run("compare @/nan.exr @/inf.exr -o @/d.png");
    assert!(code == 1 && out.contains("cyan where one value is NaN or infinite"), "{out}");
    let image = read_image(&folder.path().join("d.png")).unwrap();
    let cyan = [0.0, 1.0, 1.0];
    assert_eq!(&image.samples[..], [[0.0; 3], [0.0; 3], cyan, cyan].concat());
    // Equal pictures have a picture too.
    let (code, out, _) = run("compare @/a.exr @/a.exr -o @/e.png");
    assert!(code == 0 && out.contains("wrote @/e.png: black where the pictures are equal"), "{out}");
}
