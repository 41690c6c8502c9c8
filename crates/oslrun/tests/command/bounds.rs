//! The command `oslrun bounds`.

use crate::in_process::oslrun_at;
use std::path::Path;

const SHADER: &str = "shader s(float radius = 0.3, color tint = 1, int rings = 4, output color c = 0)\n{\n    \
                      float d = hypot(u - 0.5, v - 0.5);\n    \
                      float angle = acos(clamp(d / radius, -1, 1));\n    \
                      c = tint * smoothstep(0, 1, angle) / rings;\n}\n";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.osl"), SHADER).unwrap();
    folder
}

fn run(folder: &Path, args: &str) -> (u8, String, String) {
    oslrun_at(folder, &format!("bounds {args} --budget 600"))
}

#[test]
fn bounds_are_told_by_output_and_line() {
    let folder = folder();
    let (code, out, err) = run(folder.path(), "@/s.osl");
    assert_eq!((code, err.as_str()), (0, ""));
    insta::assert_snapshot!(out);
}

#[test]
fn a_parameter_can_have_a_range() {
    let folder = folder();
    let (code, out, err) =
        run(folder.path(), "@/s.osl --over radius=0:0.5 --over rings=1:9 --over tint=0:1 --tiles 500");
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("radius in [0, 0.5], rings in [1, 9], tint.r in [0, 1]"), "{out}");
    assert!(out.contains("`d / radius`: the divisor is 0 (0 to 0.5), for example at u = "), "{out}");
    assert!(
        out.contains("`acos(clamp(d / radius, -1, 1))`: the argument is never outside of -1 to 1"),
        "{out}"
    );
    for (args, message) in [
        ("--over radius=1", "write NAME=FROM:TO"),
        ("--over radius=1:0", "the first value is the smaller one"),
        ("--over rings=0.5:2", "write whole numbers"),
        ("--over radius=a:b", "write numbers"),
    ] {
        let (code, _, err) = run(folder.path(), &format!("@/s.osl {args}"));
        assert!(code == 2 && err.contains(message), "{args}: {err}");
    }
    let (code, _, err) = run(folder.path(), "@/s.osl --over size=0:1");
    assert!(code == 1 && err.contains("there is no such parameter"), "{err}");
}

#[test]
fn tools_get_numbers() {
    let folder = folder();
    let (_, out, _) = run(folder.path(), "@/s.osl --json");
    let value: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(value["domain"][0], serde_json::json!({"name": "u", "from": 0.0, "to": 1.0}));
    let output = &value["outputs"][0];
    assert_eq!((output["name"].as_str(), output["component"].as_str()), (Some("c"), Some("r")));
    assert_eq!(output["lowest"].as_f64(), Some(0.0));
    assert_eq!(output["never_nan"].as_str(), Some("proven"));
    let claims = value["claims"].as_array().unwrap();
    let acos = claims.iter().find(|claim| claim["code"].as_str().unwrap().starts_with("acos")).unwrap();
    assert_eq!((acos["verdict"].as_str(), acos["kind"].as_str()), (Some("proven"), Some("domain")));
    let (code, ..) = run(folder.path(), "@/s.osl --on sphere");
    assert_eq!(code, 2);
}

#[test]
fn numbers_of_a_text_are_in_order_and_whole_where_they_are_ints() {
    let folder = folder();
    let shader = "shader t(output int n = 0, output float x = 0, output float y = 0, output int k = 0)\n{\n    \
                  float inf = 1e38 * (10 + u);\n    n = 20000000 + (int)(u * 100);\n    x = inf - inf;\n    \
                  y = cellnoise(inf * (u - 0.5));\n    k = (-2147483647 - 1 + (int)u) / -1;\n}\n";
    std::fs::write(folder.path().join("t.osl"), shader).unwrap();
    let (_, out, _) = run(folder.path(), "@/t.osl --tiles 400");
    insta::assert_snapshot!(out);
}
