//! Files that are not UTF-8, and lines that end in carriage returns: they are read, and not damaged.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

/// The exit code, the standard output and the standard error.
fn oslrun(dir: &Path, args: &[&str], input: &[u8]) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_oslrun"));
    command.args(args).current_dir(dir).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let _ = child.stdin.take().unwrap().write_all(input);
    let result = child.wait_with_output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (result.status.code().unwrap(), text(&result.stdout), text(&result.stderr))
}

const LATIN1: &[u8] = b"// caf\xe9\nshader l(output float r = 0) { string s = \"na\xefve\"; printf(\"%s %d\\n\", s, strlen(s)); r = u; }\n";

fn utf16(text: &str, unit: fn(u16) -> [u8; 2]) -> Vec<u8> {
    std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(unit).collect()
}

#[test]
fn bytes_of_latin1_are_characters() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("l.osl"), LATIN1).unwrap();
    std::fs::write(dir.path().join("l.h"), b"// \xe9\n#define TEXT \"\xe8\"\n").unwrap();
    std::fs::write(dir.path().join("i.osl"), "#include \"l.h\"\nshader i() { printf(\"%s\\n\", TEXT); }\n")
        .unwrap();
    for (args, input) in [(&["l.osl", "-g", "1x1"][..], &b""[..]), (&["-", "-g", "1x1"], LATIN1)] {
        let (code, out, err) = oslrun(dir.path(), args, input);
        assert!(code == 0 && out.contains("na\u{ef}ve 6\n"), "{out} {err}");
        assert!(err.contains("not-utf8"), "{err}");
    }
    let (code, _, err) = oslrun(dir.path(), &["check", "l.osl"], b"");
    assert!(code == 0 && err.matches("W0006").count() == 2 && err.contains("l.osl:1:7"), "{err}");
    let (code, _, err) = oslrun(dir.path(), &["check", "-A", "not-utf8", "l.osl"], b"");
    assert!(code == 0 && err.is_empty(), "{err}");
    let (_, out, err) = oslrun(dir.path(), &["i.osl", "-g", "1x1"], b"");
    assert!(out.contains("\u{e8}\n") && err.contains("not-utf8"), "{out} {err}");
    let (code, out, err) = oslrun(dir.path(), &["testshade", "-g", "1", "1", "l.osl"], b"");
    assert!(code == 0 && out.contains("na\u{ef}ve 6"), "{out} {err}");
}

#[test]
fn a_compiled_shader_may_have_such_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path();
    std::fs::write(place.join("l.osl"), LATIN1).unwrap();
    assert_eq!(oslrun(place, &["compile", "l.osl", "-o", "l.oso"], b"").0, 0);
    let text = std::fs::read_to_string(place.join("l.oso")).unwrap();
    let bytes: Vec<u8> = text.chars().map(|c| c as u8).collect();
    std::fs::write(place.join("l.oso"), bytes).unwrap();
    let (code, out, err) = oslrun(place, &["l.oso", "-g", "1x1"], b"");
    assert!(code == 0 && out.contains("na\u{ef}ve 6\n") && err.contains("not-utf8"), "{out} {err}");
}

#[test]
fn utf16_is_read_in_both_orders() {
    let dir = tempfile::tempdir().unwrap();
    let text = "shader w() { printf(\"\u{e9}\u{1f600}\\n\"); }\n";
    for unit in [u16::to_le_bytes, u16::to_be_bytes] {
        let bytes = utf16(text, unit);
        std::fs::write(dir.path().join("w.osl"), &bytes).unwrap();
        let (code, out, err) = oslrun(dir.path(), &["w.osl", "-g", "1x1"], b"");
        assert!(code == 0 && out.contains("\u{e9}\u{1f600}\n") && err.is_empty(), "{out} {err}");
        let (code, ..) = oslrun(dir.path(), &["fmt", "w.osl"], b"");
        assert_eq!(code, 0);
        let formatted = "shader w() {\n    printf(\"\u{e9}\u{1f600}\\n\");\n}\n";
        assert_eq!(std::fs::read(dir.path().join("w.osl")).unwrap(), utf16(formatted, unit));
        std::fs::write(dir.path().join("w.osl"), &bytes[..bytes.len() - 1]).unwrap();
        let (code, _, err) = oslrun(dir.path(), &["check", "w.osl"], b"");
        assert!(code == 1 && err.contains("UTF-16"), "{err}");
    }
}

#[test]
fn what_changes_a_file_keeps_its_encoding_or_refuses() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("l.osl");
    let source = b"// \xe9\nshader l(output float r = 0) {\n    r = 0.5f; // \xfc\n}\n";
    let fixed = b"// \xe9\nshader l(output float r = 0) {\n    r = 0.5; // \xfc\n}\n";
    std::fs::write(&file, source).unwrap();
    oslrun(dir.path(), &["check", "--fix", "l.osl"], b"");
    assert_eq!(std::fs::read(&file).unwrap(), fixed);
    std::fs::write(&file, b"// \xe9\nshader l() {}\n\n\n\n").unwrap();
    assert_eq!(oslrun(dir.path(), &["fmt", "l.osl"], b"").0, 0);
    assert_eq!(std::fs::read(&file).unwrap(), b"// \xe9\nshader l() {}\n");
    // Both encodings in one file.
    let mixed = b"// \xc3\xa9 \xe9\nshader l() { float a = 0.5f; }\n";
    std::fs::write(&file, mixed).unwrap();
    for args in [&["fmt", "l.osl"][..], &["check", "--fix", "l.osl"]] {
        let (code, _, err) = oslrun(dir.path(), args, b"");
        assert!(code == 1 && (err.contains("save it as UTF-8") || err.contains("E0105")), "{args:?}: {err}");
        assert_eq!(std::fs::read(&file).unwrap(), mixed);
    }
}

#[test]
fn lines_end_in_carriage_returns() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("m.osl");
    let text = "// one\n#define TWO 2\n// three\nshader m(output float r = 0)\n{\n    r = TWO * 0.5f;\n}\n";
    std::fs::write(&file, text.replace('\n', "\r")).unwrap();
    let (code, _, err) = oslrun(dir.path(), &["check", "m.osl"], b"");
    assert!(code == 1 && err.contains("m.osl:6:15"), "{err}");
    oslrun(dir.path(), &["check", "--fix", "m.osl"], b"");
    let fixed = text.replace("0.5f", "0.5");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), fixed.replace('\n', "\r"));
    let (code, out, err) = oslrun(dir.path(), &["m.osl", "-g", "1x1"], b"");
    assert!(code == 0 && out.contains("r: 1 to 1"), "{out} {err}");
}
