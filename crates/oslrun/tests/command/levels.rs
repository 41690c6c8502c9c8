//! The options `-W`, `-A`, `--deny`, and the command `explain-error`.

use std::process::Command;

/// A lint that is always shown (W0312), one that only `check` shows (W0301), and a warning of the compiler
/// (W0203).
const SOURCE: &str =
    "shader s(output float r = 0) {\n    float spare = 1/2 * u;\n    v = 0.5;\n    r = v;\n}\n";

/// The exit code, the standard output and the standard error.
fn oslrun(args: &[&str]) -> (i32, String, String) {
    let result = Command::new(env!("CARGO_BIN_EXE_oslrun")).args(args).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (result.status.code().unwrap(), text(&result.stdout), text(&result.stderr))
}

/// The exit code for a source, and each diagnostic in the form `warning W0301`.
fn judged(command: &[&str], source: &str, args: &[&str]) -> (i32, Vec<String>) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("case.osl");
    std::fs::write(&path, source).unwrap();
    let file = path.display().to_string();
    let all: Vec<&str> =
        [command, &[&file, "--message-format", "json"], args].into_iter().flatten().copied().collect();
    let (code, _, err) = oslrun(&all);
    let said = err
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .map(|d| format!("{} {}", d["severity"].as_str().unwrap(), d["code"].as_str().unwrap()))
        .collect();
    (code, said)
}

fn check(args: &[&str]) -> (i32, Vec<String>) {
    judged(&["check"], SOURCE, args)
}

#[test]
fn a_check_shows_more_than_a_run() {
    let grid = ["-g", "2x2"];
    assert_eq!(check(&[]), (0, vec!["warning W0301".into(), "warning W0312".into(), "warning W0203".into()]));
    assert_eq!(judged(&[], SOURCE, &grid), (0, vec!["warning W0312".into(), "warning W0203".into()]));
    let asked = [&grid[..], &["-W", "unused-variable"]].concat();
    assert_eq!(judged(&[], SOURCE, &asked).1.len(), 3);
    let all = [&grid[..], &["-Wall"]].concat();
    assert_eq!(judged(&[], SOURCE, &all).1.len(), 3);
}

#[test]
fn names_and_codes_silence() {
    for name in ["integer-division", "W0312", "w0312"] {
        assert_eq!(check(&["-A", name]), (0, vec!["warning W0301".into(), "warning W0203".into()]));
    }
    assert_eq!(check(&["-A", "writes-read-only", "-A", "unused-variable"]).1, ["warning W0312"]);
    assert_eq!(check(&["-A", "all"]), (0, Vec::new()));
    assert_eq!(check(&["-A", "all", "-W", "W0301"]).1, ["warning W0301"]);
}

#[test]
fn every_lint_can_be_silenced_and_denied() {
    for lint in osl_hir::lint::LINTS {
        let lesson = osl::lessons::find(lint.code.id)[0];
        let (id, name) = (lint.code.id, lint.code.name);
        let (_, said) = judged(&["check"], lesson.wrong, &[]);
        assert!(said.contains(&format!("warning {id}")), "{id}: {said:?}");
        let (_, said) = judged(&["check"], lesson.wrong, &["-A", name]);
        assert!(!said.iter().any(|s| s.ends_with(id)), "{id}: {said:?}");
        let (code, said) = judged(&["check"], lesson.wrong, &["--deny", name]);
        assert!(code == 1 && said.contains(&format!("error {id}")), "{id}: {said:?}");
    }
}

#[test]
fn denied_warnings_are_errors() {
    let (code, said) = check(&["--deny", "integer-division"]);
    assert_eq!((code, said), (1, vec!["warning W0301".into(), "error W0312".into(), "warning W0203".into()]));
    for all in [&["--deny", "warnings"][..], &["-Werror"]] {
        let (code, said) = check(all);
        assert!(code == 1 && said.len() == 3 && said.iter().all(|s| s.starts_with("error")), "{said:?}");
    }
    // A warning that is not shown is not denied either, unless it is named.
    assert_eq!(check(&["--deny", "warnings", "-A", "all"]), (0, Vec::new()));
    assert_eq!(check(&["--deny", "W0301", "-A", "all"]), (1, vec!["error W0301".into()]));
}

#[test]
fn a_denied_run_writes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out.exr").display().to_string();
    let args = ["-g", "2x2", "-o", &out, "--deny", "warnings"];
    assert_eq!(judged(&[], SOURCE, &args), (1, vec!["error W0312".into(), "error W0203".into()]));
    assert!(!std::fs::exists(&out).unwrap());
}

#[test]
fn a_pragma_silences_the_next_line() {
    let source = SOURCE.replacen("    float spare", "#pragma osl nowarn\n    float spare", 1);
    assert_eq!(judged(&["check"], &source, &[]), (0, vec!["warning W0203".into()]));
    let source = source.replacen("    v = ", "#pragma osl nowarn\n    v = ", 1);
    assert_eq!(judged(&["check"], &source, &["--deny", "warnings"]), (0, Vec::new()));
    // Two lines below, the pragma has no effect.
    let source = SOURCE.replacen("    float spare", "#pragma osl nowarn\n\n    float spare", 1);
    assert_eq!(judged(&["check"], &source, &[]).1.len(), 3);
}

#[test]
fn the_shaders_of_the_repository_earn_no_lint() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl");
    for path in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        if path.extension().is_none_or(|e| e != "osl") {
            continue;
        }
        let (_, said) = judged(&["check"], &std::fs::read_to_string(&path).unwrap(), &[]);
        assert!(!said.iter().any(|d| d.starts_with("warning W03")), "{}: {said:?}", path.display());
    }
}

#[test]
fn known_spaces_may_be_told() {
    let source = "shader s(output point r = 0) { r = transform(\"kitchen\", P); }\n";
    assert_eq!(judged(&["check"], source, &[]).1, ["warning W0314"]);
    assert_eq!(judged(&["check"], source, &["--known-space", "kitchen"]).1.len(), 0);
}

#[test]
fn unknown_names_are_refused_with_the_closest() {
    let said = |args: &[&str]| {
        let (code, _, err) = oslrun(args);
        assert_eq!(code, 2, "{args:?}: {err}");
        err
    };
    assert!(said(&["check", "x.osl", "-A", "unused-variabel"]).contains("unused-variable"));
    assert!(said(&["check", "x.osl", "-A", "E0201"]).contains("stays one"));
    assert!(said(&["check", "x.osl", "--deny", "error"]).contains("no such warning"));
}

#[test]
fn lessons_are_told() {
    let (code, out, _) = oslrun(&["explain-error", "E0201"]);
    assert_eq!((code, out.as_str()), (0, include_str!("../../../../docs/errors/E0201.md")));
    assert_eq!(oslrun(&["explain-error", "unknown-name"]).1, out);
    assert_eq!(oslrun(&["explain-error", "e0201"]).1, out);
    let (_, list, _) = oslrun(&["explain-error", "--list"]);
    assert_eq!(list.lines().count(), osl::lessons::codes().len());
    let (code, out, err) = oslrun(&["explain-error", "E0123"]);
    assert!(code == 1 && out.is_empty() && err.contains("did you mean E0"), "{err}");
    assert_eq!(oslrun(&["explain-error"]).0, 2);
}

/// Each name is reported once, even if it is written often; names of parameters that are only documentation
/// are not reported.
#[test]
fn one_warning_a_name() {
    let source = "float twice(float x, float y) { x = 2 * x; x += 1; y = x; return x + y; }
shader s(string Notes = \"by hand\", output float r = 0) {
    u = 1; u = 2; v = 1;
    r = twice(u, v) + length(transform(\"kitchen\", P)) + length(transform(\"kitchen\", N));
    if (r > 1) { float P = 1; r += P; } else { float P = 2; r += P; }
    color t = texture(\"a.tx\", u, v, \"\", 1);
    r += t[0];
}
";
    let (code, said) = judged(&["check"], source, &[]);
    let want = ["W0203", "W0203", "W0203", "W0203", "W0313", "W0314"].map(|code| format!("warning {code}"));
    let mut said = said;
    said.sort();
    assert_eq!((code, said), (0, want.into()));
}
