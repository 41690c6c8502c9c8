//! `--userdata` and `--attributes`, read by a shader.

use crate::in_process::oslrun;
use std::path::Path;

fn file(dir: &Path, name: &str, text: &str) -> String {
    let path = dir.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

#[test]
fn interpolated_parameters_take_user_data() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(
        dir.path(),
        "s.osl",
        "shader s(float amp = 1 [[ int lockgeom = 0 ]], float fixed = 2, color tint = 0 [[ int interpolated = 1 ]],
             string who = \"nobody\" [[ int lockgeom = 0 ]], output float o = 0) {
             if (u == 0 && v == 0) printf(\"%g %g %g %s\\n\", amp, fixed, tint, who);
         }",
    );
    let said = |more: &[&str]| oslrun(&[&[shader.as_str(), "-g", "2x2"], more].concat()).1;
    assert!(said(&[]).starts_with("1 2 0 0 0 nobody\n"));
    let given = [
        "--userdata",
        "amp=5",
        "--userdata",
        "fixed=6",
        "--userdata",
        "tint=0.5,1,2",
        "--userdata",
        "who=me",
    ];
    assert!(said(&given).starts_with("5 2 0.5 1 2 me\n"));
    assert!(said(&["--userdata", "who=\"7\""]).starts_with("1 2 0 0 0 7\n"), "quotes make a string");
    assert!(
        said(&["--userdata", "amp=hello"]).starts_with("1 2"),
        "of another type, it is not for the parameter"
    );
    assert!(said(&["-p", "amp=3", "--userdata", "amp=4"]).starts_with("4 2"), "user data go before values");
}

#[test]
fn attributes_come_from_a_file() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(
        dir.path(),
        "s.osl",
        "shader s(output float o = 0) {
             float f = -1; int i = -1; color c = -1; string t = \"-\"; float list[4] = { 0, 0, 0, 0 }; float g = -1; int e = -1;
             int n = getattribute(\"f\", f) + getattribute(\"i\", i) + getattribute(\"c\", c) + getattribute(\"t\", t)
                   + getattribute(\"list\", list) + getattribute(\"box\", \"f\", g) + getattribute(\"whole\", 1, e);
             if (u == 0 && v == 0) printf(\"%d: %g %d %g %s %g %g %d\\n\", n, f, i, c, t, list[3], g, e);
         }",
    );
    let json = r#"{"f": 0.5, "i": 3, "c": [1, 2, 3.5], "t": "text", "list": [1, 2, 3, 4.5], "whole": [7, 8],
                   "box": {"f": 9.0}}"#;
    let attributes = file(dir.path(), "a.json", json);
    let said = |more: &[&str]| oslrun(&[&[shader.as_str(), "-g", "2x2"], more].concat());
    let (_, text, _) = said(&["--attributes", &attributes]);
    assert!(text.starts_with("7: 0.5 3 1 2 3.5 text 4.5 9 8\n"), "{text}");
    let (_, text, _) = said(&["--attributes", &attributes, "--userdata", "f=6"]);
    assert!(text.starts_with("7: 6 3"), "user data go before attributes: {text}");
    assert!(said(&[]).1.starts_with("0: -1 -1 -1 -1 -1 - 0 -1 -1\n"));

    for (wrong, why) in [
        ("[1]", "the file is to hold an object"),
        ("{\"a\": true}", "`a` is no number"),
        ("{\"a\": [1, \"b\"]}", "`a` is no number"),
        ("{\"b\": {\"c\": {}}}", "`b.c` is no number"),
        ("{\"a\"", "EOF"),
    ] {
        let path = file(dir.path(), "wrong.json", wrong);
        let (code, _, text) = said(&["--attributes", &path]);
        assert!(code == 1 && text.contains(why), "{wrong}: {text}");
    }
    assert_eq!(said(&["--attributes", "nowhere.json"]).0, 1);
    assert_eq!(said(&["--userdata", "nothing"]).0, 2);
}
