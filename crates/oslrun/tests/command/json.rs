//! `--message-format json`: every line of the standard error is a JSON object with a severity and a message,
//! whatever goes wrong.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn oslrun(dir: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_oslrun")).current_dir(dir).args(args).output().unwrap()
}

fn objects(output: &Output) -> Vec<Value> {
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    let object = |line: &str| {
        let object: Value = serde_json::from_str(line).unwrap_or_else(|_| panic!("no JSON: {line}\n{text}"));
        assert!(object["severity"].is_string() && object["message"].is_string(), "{line}");
        object
    };
    text.lines().map(object).collect()
}

#[test]
fn every_line_is_an_object() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let shader = "shader a(int index = 0, output float f = 0) { float b[2]; f = b[index]; }";
    std::fs::write(dir.join("a.osl"), shader).unwrap();
    std::fs::write(dir.join("bad.osl"), "shader bad() { float x = y; }").unwrap();
    std::fs::write(dir.join("a.ass"), "include \"none.ass\"\nsphere\n{\n name s\n shader m\n").unwrap();
    for (args, severity) in [
        ("none.osl", "error"),
        ("a.osl --nonsense", "error"),
        ("a.osl -o a.gif", "error"),
        ("a.osl -p none=1", "error"),
        ("a.osl -p index=5 -o a.exr", "error"),
        ("a.osl --stats", "note"),
        ("bad.osl", "error"),
        ("check bad.osl none.osl", "error"),
        ("render a.ass -o a.exr", "error"),
        ("info none.osl", "error"),
        ("ir none.osl", "error"),
    ] {
        for format in [&["--message-format", "json"][..], &["--message-format=json"]] {
            let all: Vec<&str> = args.split(' ').chain(format.iter().copied()).collect();
            let objects = objects(&oslrun(dir, &all));
            assert!(objects.iter().any(|object| object["severity"] == severity), "{args}: {objects:?}");
        }
    }
}
