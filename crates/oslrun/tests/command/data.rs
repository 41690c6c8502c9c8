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

/// The text is read as the type that a parameter has, and a warning says what is not used.
#[test]
fn user_data_have_the_types_of_parameters() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(
        dir.path(),
        "s.osl",
        "#define OPEN [[ int lockgeom = 0 ]]
         shader s(int i = 1 OPEN, color c = 0 OPEN, float a[2] = { 7, 8 } OPEN, string s = \"n\" OPEN, string t[2] = { \"x\", \"y\" } OPEN,
             color list[2] = { 1, 2 } OPEN, float later[2] = { P[0], 4 } OPEN, matrix m = 3 OPEN, float fixed = 1, output float o = 0) {
             printf(\"%d|%g|%g %g|%s|%s %s|%g %g|%g|%g|%g\\n\", i, c, a[0], a[1], s, t[0], t[1], list[0], list[1], later[1], m[1][1], fixed);
         }",
    );
    let attributes = file(dir.path(), "a.json", r#"{"i": 3, "a": [5, 6.5]}"#);
    let said = |given: &[&str]| {
        let options = given.iter().flat_map(|given| ["--userdata", given]);
        let args: Vec<&str> = [shader.as_str(), "-g", "1x1"].into_iter().chain(options).collect();
        let (code, out, err) = oslrun(&args);
        assert_eq!(code, 0, "{err}");
        (out.lines().next().unwrap_or_default().to_string(), err)
    };
    let plain = "1|0 0 0|7 8|n|x y|1 1 1 2 2 2|4|3|1";
    assert_eq!(said(&[]), (plain.to_string(), String::new()));
    let given = ["i=4", "c=0.5", "a=1,2", "s=77", "t=p,q", "list=1,2,3,4,5,6", "later=9 10", "m=2"];
    let taken = "4|0.5 0.5 0.5|1 2|77|p q|1 2 3 4 5 6|10|2|1";
    assert_eq!(said(&given), (taken.to_string(), String::new()));
    for (given, why) in [
        ("i=2.5", "the shader reads it as int"),
        ("a=1,2,3", "the shader reads it as float[2]"),
        ("list=1", "the shader reads it as color[2]"),
        ("fixed=2", "a parameter takes user data only with the metadata lockgeom = 0"),
        ("fixd=2", "the shader reads no data with this name; did you mean `fixed`?"),
    ] {
        let (out, err) = said(&[given]);
        assert_eq!(out, plain, "{given}");
        assert!(err.starts_with(&format!("warning: --userdata {given} is not used: {why}")), "{err}");
    }
    // Attributes of the type that is read come after user data of any other.
    let args =
        [&shader, "-g", "1x1", "--attributes", &attributes, "--userdata", "i=2.5", "--userdata", "a=1,2"];
    let (_, out, _) = oslrun(&args);
    assert!(out.starts_with("3|0 0 0|1 2|"), "{out}");
    let (_, _, err) = oslrun(&[&shader, "-g", "1x1", "--userdata", "x=1", "--message-format", "json"]);
    assert!(err.contains("\"severity\":\"warning\"") && err.contains("--userdata x=1 is not used"), "{err}");
    let (_, _, err) = oslrun(&["explain", &shader, "--at", "0,0", "-g", "1x1", "--userdata", "x=1"]);
    assert_eq!(err.matches("--userdata x=1 is not used").count(), 1, "{err}");
}

#[test]
fn attributes_that_nobody_answers_are_named_once() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(
        dir.path(),
        "s.osl",
        "shader s(string which = \"who\", float open = 1 [[ int lockgeom = 0 ]], output float o = 0) {
             float uv[2]; float f = 0; int i = 0;
             int n = getattribute(\"hit:uv\", uv) + getattribute(which, f) + getattribute(\"box\", \"id\", i);
             if (u > 0.5) n += getattribute(\"half\", i);
             if (v > 0.5) n += getattribute(\"half\", i);
             for (int k = 0; k < 2; k++) n += getattribute(format(\"made%d\", k), f);
             n += getattribute(\"s\", f) + getattribute(\"t\", i);
             o = n + open;
         }",
    );
    let plain = ["-g", "4x4", "--dialect", "none"];
    let run = |more: &[&str]| oslrun(&[&[shader.as_str()], &plain[..], more].concat());
    let notes = |err: &str| -> Vec<String> {
        let mut lines: Vec<String> = err.lines().map(ToString::to_string).collect();
        lines.sort();
        lines
    };
    let all = [
        "note: getattribute \"box\", \"id\" is not answered, at 16 of 16 points",
        "note: getattribute \"half\" is not answered, at 12 of 16 points, first at pixel (2, 0)",
        "note: getattribute \"hit:uv\" is not answered, at 16 of 16 points",
        "note: getattribute \"made0\" is not answered, at 16 of 16 points",
        "note: getattribute \"made1\" is not answered, at 16 of 16 points",
        "note: getattribute \"t\" is not answered: its value has another type, at 16 of 16 points",
        "note: getattribute \"who\" is not answered, at 16 of 16 points",
    ];
    for more in [&[][..], &["--batch", "1"], &["--threads", "2", "--batch", "16"], &["--arithmetic", "f64"]] {
        let (code, out, err) = run(more);
        assert!(code == 0 && !out.contains("warning"), "{out}");
        assert_eq!(notes(&err), all, "{more:?}");
    }
    // Answered attributes are not named, nor is the user data of a parameter.
    let (_, _, err) = run(&["--userdata", "who=1", "--userdata", "hit:uv=0,1", "--userdata", "half=1"]);
    assert_eq!(err.lines().count(), 4, "{err}");
    let (code, _, err) = run(&["--message-format", "json", "--deny", "errors"]);
    let found = "\"severity\":\"note\",\"message\":\"getattribute \\\"half\\\" is not answered\",\"points\":12,\"of\":16";
    assert!(code == 0 && err.contains(found), "{err}");
    // The tools of the reference do not say it.
    let (code, _, err) = oslrun(&["testshade", "-g", "2", "2", &shader]);
    assert_eq!((code, err.as_str()), (0, ""));
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
