//! `oslrun check`: the edits that it applies or shows, its counts, and what a run says of warnings.

use std::path::Path;
use std::process::Command;

/// Two safe edits, a suggestion that is only shown (W0312), and an error that no edit repairs.
const BROKEN: &str = "shader s(float a = 1
         output float r = 0) {
    flaot x = 1/2 * a;
    r = x + radius
}
";
const FIXED: &str = "shader s(float a = 1,
         output float r = 0) {
    float x = 1/2 * a;
    r = x + radius;
}
";

/// The exit code, the standard output and the standard error.
fn oslrun(dir: &Path, args: &[&str]) -> (i32, String, String) {
    let result = Command::new(env!("CARGO_BIN_EXE_oslrun")).args(args).current_dir(dir).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (result.status.code().unwrap(), text(&result.stdout), text(&result.stderr))
}

fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(dir.path().join(name), text).unwrap();
    }
    dir
}

fn text(dir: &tempfile::TempDir, name: &str) -> String {
    std::fs::read_to_string(dir.path().join(name)).unwrap()
}

#[test]
fn fix_applies_what_is_safe() {
    let dir = folder(&[("a.osl", BROKEN)]);
    let (code, _, err) = oslrun(dir.path(), &["check", "--fix", "a.osl"]);
    assert_eq!(text(&dir, "a.osl"), FIXED);
    assert!(code == 1 && err.contains("`radius` is not declared"), "{err}");
    assert!(err.ends_with("3 fixes applied; 1 error, no warnings in 1 file\n"), "{err}");
}

#[test]
fn diff_shows_and_writes_nothing() {
    let dir = folder(&[("a.osl", BROKEN)]);
    let (code, out, err) = oslrun(dir.path(), &["check", "--diff", "--fix", "a.osl"]);
    assert!(code == 1 && out.contains("+shader s(float a = 1,\n") && out.contains("-    flaot x"), "{out}");
    assert!(err.ends_with("4 errors, no warnings in 1 file\n"), "{err}");
    assert_eq!(text(&dir, "a.osl"), BROKEN);
}

#[test]
fn suggestions_are_not_applied() {
    let source = "shader s(output float r = 0) { r = 1/2 * u + smothstep(0, 1, u); }\n";
    let dir = folder(&[("a.osl", source)]);
    oslrun(dir.path(), &["check", "--fix", "a.osl"]);
    assert_eq!(text(&dir, "a.osl"), source);
}

/// Edits of a file that is only included are left alone.
#[test]
fn only_named_files_change() {
    let (header, main) = ("void f() { flaot x = 1; }\n", "#include \"a.h\"\nshader s() { flaot y; }\n");
    let dir = folder(&[("a.h", header), ("a.osl", main), ("b.osl", main)]);
    oslrun(dir.path(), &["check", "--fix", "a.osl"]);
    assert_eq!((text(&dir, "a.h"), text(&dir, "b.osl")), (header.to_owned(), main.to_owned()));
    assert_eq!(text(&dir, "a.osl"), main.replace("flaot", "float"));
}

/// Every edit of the text holds with Windows line ends and a character of several bytes before it.
#[test]
fn the_rest_of_a_file_stays() {
    let source = "\u{feff}// gr\u{fc}n\r\nshader s(output float r = 0) {\r\n    r = 0.5f\r\n}\r\n";
    let dir = folder(&[("a.osl", source)]);
    let (code, _, err) = oslrun(dir.path(), &["check", "--fix", "a.osl"]);
    assert_eq!((code, text(&dir, "a.osl")), (0, source.replace("0.5f", "0.5;")), "{err}");
}

#[test]
fn a_clean_file_is_left_in_silence() {
    let dir = folder(&[("a.osl", "shader s(output float r = 0) { r = u; }\n")]);
    assert_eq!(oslrun(dir.path(), &["check", "--fix", "a.osl"]), (0, String::new(), String::new()));
}

#[test]
fn a_run_counts_its_warnings() {
    let source = "shader s(output float r = 0) { r = 1/2 * u; v = 1; }\n";
    let dir = folder(&[("a.osl", source)]);
    let (code, _, err) = oslrun(dir.path(), &["a.osl", "-g", "2x2"]);
    assert!(code == 0 && err.lines().count() == 1, "{err}");
    assert!(
        err.contains("2 warnings (writes-read-only, integer-division); `oslrun check` shows the text"),
        "{err}"
    );
    let (_, _, err) = oslrun(dir.path(), &["a.osl", "-g", "2x2", "-W", "integer-division"]);
    assert!(err.contains("warning[W0312]") && err.contains("1 warning (writes-read-only)"), "{err}");
    let (_, _, err) = oslrun(dir.path(), &["a.osl", "-g", "2x2", "-A", "all"]);
    assert_eq!(err, "");
}

#[test]
fn a_diagnostic_names_its_lesson_once() {
    let dir = folder(&[("a.osl", "shader s(output float r = 0) { r = a + b; }\n")]);
    let (_, _, err) = oslrun(dir.path(), &["check", "a.osl"]);
    assert_eq!(err.matches("for more: `oslrun explain-error E0201`").count(), 1, "{err}");
}

#[test]
fn unknown_parameters_and_shaders_name_those_that_there_are() {
    let dir = folder(&[(
        "a.osl",
        "shader s(float gain = 1, int Bands = 3, color Base = 1, output color r = 0) { r = gain * Bands * Base; }\n",
    )]);
    let says = |args: &[&str]| oslrun(dir.path(), &[&["a.osl"], args].concat()).2;
    assert_eq!(
        says(&["-p", "time=3"]),
        "error: the shader has no parameter `time`; it has gain, Bands, Base\n"
    );
    assert_eq!(
        says(&["-p", "gian=3"]),
        "error: the shader has no parameter `gian`; there is one named `gain`\n"
    );
    assert_eq!(says(&["-p", "Bands=x"]), "error: parameter `Bands` is an int, and `x` is none\n");
    let not_numbers = "error: parameter `Base` is a color, and `#ff8800` is none: write three numbers\n";
    assert_eq!(says(&["-p", "Base=#ff8800"]), not_numbers);
    let (_, _, err) = oslrun(dir.path(), &["--layer", "one=rmap"]);
    assert!(err.contains("there is one named `remap`"), "{err}");
}

#[test]
fn what_helps_stands_first() {
    let dir = folder(&[
        ("open.osl", "shader s(output float r = 0) { r = max(u; }\n"),
        ("order.osl", "shader s(output color r = 0) { r = texture(u, v, \"x.exr\"); }\n"),
    ]);
    let (_, _, err) = oslrun(dir.path(), &["check", "open.osl"]);
    assert!(err.ends_with("`oslrun FILE --repair` inserts the missing brackets for a run\n"), "{err}");
    let (_, _, err) = oslrun(dir.path(), &["check", "order.osl"]);
    let first = err.lines().find(|line| line.contains("= note: ")).unwrap();
    assert!(
        first.contains("texture(string filename, float s, float t, \"option\", value, ...)")
            && first.ends_with("takes these arguments in another order"),
        "{err}"
    );
}
