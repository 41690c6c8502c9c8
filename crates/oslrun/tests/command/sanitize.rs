//! The command `oslrun sanitize`.

use crate::in_process::oslrun_at;
use std::path::Path;

const GUARDED: &str = "shader s(output float r = 0) { r = u > 0 ? v / u : 0; }";
const BARE: &str = "shader s(float at = 0.5, output float r = 0)\n{\n    r = v / (u - at);\n}\n";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("guarded.osl"), GUARDED).unwrap();
    std::fs::write(folder.path().join("bare.osl"), BARE).unwrap();
    folder
}

fn run(folder: &Path, args: &str) -> (u8, String, String) {
    oslrun_at(folder, &format!("sanitize {args} --budget 600"))
}

#[test]
fn events_are_told_by_line() {
    let folder = folder();
    let (code, out, err) = run(folder.path(), "@/bare.osl -g 5x3");
    assert_eq!((code, err.as_str()), (0, ""));
    let wanted = "s: numeric events at 1 place, at 15 points (5x3)\n\n\
                  @/bare.osl:3: division by zero at 3 of 15 points (20 %), first at pixel (2, 0)\n  \
                  3 | r = v / (u - at);\n    |     ^^^^^^^^^^^^\n    = 0 / 0 has no value; the language makes it 0\n\n\
                  `oslrun explain @/bare.osl -g 5x3 --at 2,0` shows what such a pixel does\n";
    assert_eq!(out, wanted);
    // The options of a run count.
    let (_, out, _) = run(folder.path(), "@/bare.osl -g 5x3 -p at=2");
    assert_eq!(out, "s: no numeric events, at 15 points (5x3)\n");
    let (_, out, _) = run(folder.path(), "@/bare.osl");
    assert!(out.starts_with("s: no numeric events, at 4096 points (64x64)"), "{out}");
}

#[test]
fn tools_get_numbers() {
    let folder = folder();
    let (_, out, _) = run(folder.path(), "@/bare.osl -g 5x3 --json");
    let value: serde_json::Value = serde_json::from_str(&out).unwrap();
    let event = &value["events"][0];
    assert_eq!((value["points"].as_u64(), value["not_examined"].as_u64()), (Some(15), Some(0)));
    assert_eq!((event["kind"].as_str(), event["line"].as_u64()), (Some("zero-division"), Some(3)));
    assert_eq!((event["points"].as_u64(), event["share"].as_f64()), (Some(3), Some(0.2)));
    assert_eq!(event["first"], serde_json::json!([2, 0]));
    assert_eq!(event["operands"], serde_json::json!([0.0, 0.0]));
    assert_eq!(event["result"].as_f64(), Some(0.0));
}

#[test]
fn events_can_fail_the_command() {
    let folder = folder();
    for (args, code) in [
        ("@/bare.osl -g 5x3", 0),
        ("@/bare.osl -g 5x3 --fail-on any", 1),
        ("@/bare.osl -g 5x3 --fail-on nan,zero-division", 1),
        ("@/bare.osl -g 5x3 --fail-on nan,infinity", 0),
        ("@/guarded.osl -g 5x3 --fail-on any", 0),
        ("@/bare.osl -g 5x3 --fail-on divisions", 2),
        ("@/bare.osl -g 5x3 --samples 4", 2),
        ("@/bare.osl -g 5x3 --arithmetic fast", 2),
        ("@/none.osl", 1),
    ] {
        let (found, out, err) = run(folder.path(), args);
        assert_eq!(found, code, "{args}: {out}{err}");
    }
}

#[test]
fn a_map_shows_where_events_are() {
    let folder = folder();
    for name in ["map.png", "map.tif"] {
        let (code, _, err) = run(folder.path(), &format!("@/bare.osl -g 5x3 --map @/{name}"));
        assert_eq!((code, err), (0, format!("wrote @/{name}\n")));
        let image = osl_image::read_image(&folder.path().join(name)).unwrap();
        assert_eq!((image.width, image.height), (5, 3));
        let row: Vec<f32> = image.samples.iter().copied().step_by(image.samples.len() / 15).take(5).collect();
        assert_eq!(row, [0.0, 0.0, 1.0, 0.0, 0.0], "{name}");
    }
    let (code, _, err) = run(folder.path(), "@/bare.osl -g 5x3 --map @/map.exr");
    assert_eq!(code, 0, "{err}");
    assert!(folder.path().join("map.exr").metadata().unwrap().len() > 100);
}

#[test]
fn random_rounding_counts_digits() {
    let folder = folder();
    let text = "shader s(output float far = 0, output float near = 0)\n{\n    float third = u + 1.0 / 3.0;\n    \
                far = (4096 + third) - 4096;\n    near = third * 2;\n}\n";
    std::fs::write(folder.path().join("digits.osl"), text).unwrap();
    let (code, out, err) = run(folder.path(), "@/digits.osl --random-rounding --json");
    assert_eq!((code, err.as_str()), (0, ""));
    let value: serde_json::Value = serde_json::from_str(&out).unwrap();
    let outputs = &value["rounding"]["outputs"];
    let least = |at: usize| outputs[at]["least"].as_f64().unwrap();
    assert_eq!(outputs[0]["name"], "far");
    assert!(least(0) < 4.0 && least(1) > 6.0, "{outputs}");
    assert_eq!(value["rounding"]["lines"][0]["line"], 4);
    let (_, text, _) = run(folder.path(), "@/digits.osl --random-rounding");
    assert!(text.contains("Random rounding: digits in which 3 runs agree, at 1024 points"), "{text}");
    let (_, without, _) = run(folder.path(), "@/digits.osl");
    assert!(text.starts_with(&without), "{text}");
}

#[test]
fn the_time_can_be_over() {
    let folder = folder();
    let text = "shader s(output float r = 0) { for (int i = 0; i < 10000; i++) r += sin(r + u); }";
    std::fs::write(folder.path().join("long.osl"), text).unwrap();
    let (code, out, err) = oslrun_at(folder.path(), "sanitize @/long.osl -g 500x500 --budget 0.05");
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("the time was over (--budget)"), "{out}");
}

#[test]
fn surfaces_are_examined_on_any_number_of_threads() {
    let folder = folder();
    let text = "shader s(output float r = 0) { r = sqrt(P[0]); }";
    std::fs::write(folder.path().join("half.osl"), text).unwrap();
    let args = "@/half.osl -g 16x16 --on sphere";
    let (code, one, err) = run(folder.path(), &format!("{args} --threads 1"));
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(one.starts_with("s: numeric events at 1 place, at ") && one.contains("(16x16)"), "{one}");
    assert!(one.contains("`oslrun explain @/half.osl --on sphere -g 16x16 --at "), "{one}");
    // A sphere does not fill the picture, and a part of what is seen is on the side of negative x.
    let (_, json, _) = run(folder.path(), &format!("{args} --json"));
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    let (points, wrong) = (value["points"].as_u64().unwrap(), value["events"][0]["points"].as_u64().unwrap());
    assert!((100..256).contains(&points) && (20..points - 20).contains(&wrong), "{wrong} of {points}");
    assert_eq!(run(folder.path(), &format!("{args} --threads 3")).1, one);
    let (_, flat, _) = run(folder.path(), "@/bare.osl -g 5x3 --threads 3");
    assert_eq!(flat, run(folder.path(), "@/bare.osl -g 5x3 --threads 1").1);
}
