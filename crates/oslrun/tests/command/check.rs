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
    let not_numbers =
        "error: parameter `Base` is a color, and `#ff88` is none: write three numbers, or #ff8800\n";
    assert_eq!(says(&["-p", "Base=#ff88"]), not_numbers);
    let split = "error: a parameter and its value are one word: `-p Bands=3`\n";
    assert_eq!(says(&["-p", "Bands", "3"]), split);
    let (code, _, err) = oslrun(dir.path(), &["preview", "a.osl"]);
    let option = "error: there is no command `preview`, but an option: `oslrun a.osl --preview`\n";
    assert_eq!((code, err.as_str()), (2, option));
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

/// A shader whose metadata name the values of two parameters.
const NAMED: &str = "shader a(
    int Mode = 0 [[ string widget = \"mapper\", string options = \"Radial:1|Linear:2\" ]],
    string Kind = \"twill\" [[ string widget = \"popup\", string options = \"twill|plain\" ]],
    float Pos[5] = { 1, 2, 3, 4, 5 }, color Base = 1, output float r = 0, output color c = 0)
{
    r = Mode + Pos[3] + 10 * (Kind == \"plain\");
    c = Base;
}
";

#[test]
fn values_of_parameters_are_what_their_metadata_say() {
    let dir = folder(&[("a.osl", NAMED)]);
    let run = |value: &str| oslrun(dir.path(), &["a.osl", "-g", "2x2", "-p", value]);
    let (_, out, err) = run("Mode=Linear");
    assert!(out.starts_with("r: 6 to 6") && err.is_empty(), "{out}{err}");
    let (code, _, err) = run("Mode=Linaer");
    let wrong =
        "error: parameter `Mode` is an int, and `Linaer` is none: write a number, or one of Radial, Linear\n";
    assert_eq!((code, err.as_str()), (1, wrong));
    assert_eq!(run("Kind=plain").2, "");
    let none = "warning: `twil` is none of the options of `Kind`, which are twill, plain; there is one named `twill`\n";
    assert_eq!(run("Kind=twil").2, none);
    let (_, out, err) = run("Pos=0,1");
    let fewer =
        "warning: parameter `Pos` has 5 elements, and 2 values are given: the other elements are zero\n";
    assert!(out.starts_with("r: 0 to 0") && err == fewer, "{out}{err}");
    assert_eq!(run("Pos=0,1,2,3,4").2, "");
    let (_, out, _) = run("Base=#f80");
    assert!(
        out.contains("c.R: 1 to 1") && out.contains("c.G: 0.246201") && out.contains("c.B: 0 to 0"),
        "{out}"
    );
    assert_eq!(run("Base=#ff8800").1, out);
}

#[test]
fn connections_name_what_there_is_and_what_they_replace() {
    let dir = folder(&[]);
    let run = |group: &str| oslrun(dir.path(), &["--group", group, "-g", "2x2", "-p", "position=0.4"]).2;
    let group = |output: &str| format!("shader fractal f; shader ramp r; connect f.{output} r.position");
    assert!(run(&group("value")).contains("layer `f` has no parameter `value`; it has result, raw"));
    let replaced = "warning: `-p position` has no effect: the parameter takes its value from f.result\n";
    assert_eq!(run(&group("result")), replaced);
}

#[test]
fn an_assignment_as_a_condition_is_told_by_a_run() {
    let text = "shader s(int m = 0, output float r = 0) { int k = m; if (k = 1) r = 1; }\n";
    let dir = folder(&[("a.osl", text)]);
    let (_, _, err) = oslrun(dir.path(), &["a.osl", "-g", "2x2"]);
    assert_eq!(err, "note: 1 warning (assignment-in-condition); `oslrun check` shows the text\n");
}

#[test]
fn a_repair_says_which_statement_it_ends() {
    let by_indentation = "shader b(output float r = 0, output float q = 0)
{
    if (u > 0.5) {
        r = 1;
    q = 2;
    r += q;
}
";
    let on_a_line = "shader b(output float r = 0) { if (u > 0.5) { r = 1; r += 2; }";
    let dir = folder(&[("a.osl", by_indentation), ("b.osl", on_a_line)]);
    let (_, out, err) = oslrun(dir.path(), &["a.osl", "--repair", "-g", "2x2"]);
    assert!(
        err.contains("+    }\n     q = 2;") && err.ends_with("note: the `if` of line 3 ends in line 4\n"),
        "{err}"
    );
    assert!(out.contains("q: 2 to 2"), "{out}");
    let (_, _, err) = oslrun(dir.path(), &["b.osl", "--repair", "-g", "2x2"]);
    assert!(err.ends_with("note: the `if` of line 1 ends in line 1\n"), "{err}");
}

#[test]
fn warnings_of_other_files_and_many_of_a_kind_are_counted() {
    let header = "float half(float x) { x *= 0.5; return x; }\nfloat twice(float y) { y *= 2; return y; }\n";
    let function = |n: usize| format!("float f{n}(float x, float y) {{ return x; }}\n");
    let calls: String = (0..8).map(|n| format!("r += f{n}(u, v); ")).collect();
    let functions: String = (0..8).map(function).collect();
    let shader = format!("shader s(output float r = 0) {{ {calls}r += half(u) + twice(v); }}\n");
    let text = format!("#include \"h.h\"\n{functions}{shader}");
    let dir = folder(&[("a.osl", &text), ("h.h", header)]);
    let (code, _, err) = oslrun(dir.path(), &["check", "a.osl"]);
    assert!(code == 0 && err.matches("warning[W0302]").count() == 5, "{err}");
    assert!(err.contains("note: 2 warnings in h.h (writes-read-only); `-W all` shows them\n"), "{err}");
    assert!(err.contains("note: 3 more of unused-parameter; `-W unused-parameter` shows them\n"), "{err}");
    assert!(err.ends_with("no errors, 10 warnings in 1 file\n"), "{err}");
    let (_, _, err) = oslrun(dir.path(), &["check", "a.osl", "-W", "all"]);
    assert!(
        err.matches("warning[W0302]").count() == 8 && err.matches("warning[W0203]").count() == 2,
        "{err}"
    );
    let (_, _, err) = oslrun(dir.path(), &["check", "a.osl", "--message-format", "json"]);
    assert_eq!(err.lines().count(), 10, "{err}");
}
