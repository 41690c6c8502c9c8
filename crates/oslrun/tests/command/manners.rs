//! How the command behaves in a script and for somebody who mistypes: streams, names of files, notes, pages.

use osl_image::read_image;
use serde_json::Value;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const MANY: &str = "surface many(output vector d = 0, output color c = 0, output normal n = 0, output float far = 0)\n\
    { d = vector(u * 2 - 1, v * 2 - 1, 0); c = color(u * 3, v, 0); n = N; far = 6.9 * u; printf(\"\"); }";
const ONE: &str = "shader one(float s = 3, output float f = 0) { f = s * u; }";

/// A folder with shaders.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for (name, text) in [("many.osl", MANY), ("one.osl", ONE), ("bad.osl", "shader bad() { float x = y; }")] {
        std::fs::write(dir.path().join(name), text).unwrap();
    }
    dir
}

/// Runs the command with a text on its standard input.
fn fed(dir: &Path, args: &[&str], input: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_oslrun"));
    let command = command.current_dir(dir).args(args).stdin(Stdio::piped());
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    child.wait_with_output().unwrap()
}

fn run(dir: &Path, args: &str) -> (i32, String, String) {
    let output = fed(dir, &args.split_whitespace().collect::<Vec<_>>(), "");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn slips_on_the_command_line_are_named() {
    let dir = folder();
    let mut said = String::new();
    for args in [
        "chek one.osl",
        "expalin",
        "explain_error E0201",
        "nothing",
        "one.osl many.osl",
        "render one.osl -o a.png",
        "man chek",
        "one.osl -o a.exr --range auto",
        "one.osl --signed",
        "one.osl -o a.png --format exr",
        "one.osl -o a.png --range 2,1",
        "many.osl -o -",
        "one.osl -o - --json",
    ] {
        let (code, out, err) = run(dir.path(), args);
        assert_eq!(out, "", "{args}");
        said += &format!("$ oslrun {args}\n{err}[exit {code}]\n\n");
    }
    insta::assert_snapshot!("slips", said);
}

#[test]
fn shaders_come_from_the_standard_input() {
    let dir = folder();
    for args in [
        &["-", "-g", "2x2"][..],
        &["check", "-"],
        &["info", "-"],
        &["ir", "-"],
        &["explain", "-", "-g", "2x2", "--at", "1,1"],
        &["compile", "-", "-o", "-"],
        &["stability", "-", "--points", "4x4"],
    ] {
        let output = fed(dir.path(), args, ONE);
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{args:?}: {err}");
        let output = fed(dir.path(), args, "shader bad() { float x = y; }");
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && err.contains("<standard input>:1"), "{args:?}: {err}");
    }
}

#[test]
fn pictures_go_to_the_standard_output() {
    let dir = folder();
    for (args, ending) in [
        ("one.osl -o - -g 4x4", "png"),
        ("one.osl -o - -g 4x4 --format jpg", "jpg"),
        ("many.osl -o - -g 4x4 --format exr", "exr"),
        ("many.osl -o - -g 4x4 --outputs c", "png"),
        ("one.osl -o - -g 4x4 --format tif --on sphere", "tif"),
    ] {
        let output = fed(dir.path(), &args.split_whitespace().collect::<Vec<_>>(), "");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let path = dir.path().join(format!("piped.{ending}"));
        std::fs::write(&path, &output.stdout).unwrap();
        let image = read_image(&path).unwrap();
        assert_eq!((image.width, image.height), (4, 4), "{args}");
        // A file has the same bytes.
        let named = args.replace("-o -", &format!("-o file.{ending}"));
        let named = named.split(" --format").next().unwrap().to_string()
            + if args.contains("--on") { " --on sphere" } else { "" };
        assert_eq!(run(dir.path(), &named).0, 0, "{named}");
        let file = std::fs::read(dir.path().join(format!("file.{ending}"))).unwrap();
        assert!(file == output.stdout, "{args}");
    }
    // Text of the shader and messages stay out of the picture.
    let shader = "shader s(output float f = 0) { printf(\"text\"); f = u; }";
    let output = fed(dir.path(), &["-", "-o", "-", "-g", "1x1"], shader);
    assert!(output.stdout.starts_with(b"\x89PNG") && output.stderr == b"text");
}

#[test]
fn names_of_files_follow_from_the_option() {
    let dir = folder();
    let written = |args: &str| {
        let (code, out, err) = run(dir.path(), args);
        assert_eq!(code, 0, "{err}");
        out
    };
    assert_eq!(written("one.osl -g 4x4 -o a.png"), "wrote a.png\n");
    assert_eq!(written("one.osl -g 4x4 -o a.{output}.png"), "wrote a.f.png\n");
    assert_eq!(written("many.osl -g 4x4 -o a.png --outputs d"), "wrote a.png\n");
    assert_eq!(written("many.osl -g 4x4 -o a.png --outputs d,c"), "wrote a.d.png\nwrote a.c.png\n");
    assert_eq!(written("many.osl -g 4x4 -o {output}-1.png --outputs d"), "wrote d-1.png\n");
}

#[test]
fn values_that_a_picture_does_not_show_are_told() {
    let dir = folder();
    let (_, _, err) = run(dir.path(), "many.osl -g 8x8 -o a.png");
    insta::assert_snapshot!("clipped", err);
    for more in ["--range auto", "--range=-1,7", "--exposure -3"] {
        let (code, _, err) = run(dir.path(), &format!("many.osl -g 8x8 -o a.png {more}"));
        assert_eq!((code, err.as_str()), (0, ""), "{more}");
    }
    let gray = |more: &str| {
        let (code, _, err) = run(dir.path(), &format!("many.osl -g 3x3 --outputs far -o b.png {more}"));
        assert_eq!(code, 0, "{err}");
        let image = read_image(&dir.path().join("b.png")).unwrap();
        image.samples[..3].iter().map(|x| (x * 255.0).round() as u8).collect::<Vec<u8>>()
    };
    assert_eq!(gray(""), [0, 255, 255]);
    assert_eq!(gray("--range auto"), [0, 128, 255]);
    assert_eq!(gray("--range 0,13.8"), [0, 64, 128]);
    assert_eq!(gray("--signed"), [128, 255, 255]);
    assert_eq!(gray("--exposure -3"), [0, 110, 220]);
    // A normal has the colors of a normal map, on the grid as on a surface.
    run(dir.path(), "many.osl -g 3x3 --outputs n -o n.png");
    let image = read_image(&dir.path().join("n.png")).unwrap();
    let first: Vec<u8> = image.samples[..3].iter().map(|x| (x * 255.0).round() as u8).collect();
    assert_eq!(first, [128, 128, 255]);
}

#[test]
fn the_result_of_a_run_is_an_object() {
    let dir = folder();
    let json = |args: &str| -> Value {
        let (code, out, err) = run(dir.path(), args);
        assert_eq!(code, 0, "{err}");
        serde_json::from_str(&out).unwrap_or_else(|_| panic!("{out}"))
    };
    for more in ["", " -o a.exr", " -o a.png", " --on plane"] {
        let about = json(&format!("many.osl -g 5x5 --json{more}"));
        assert_eq!(about["outputs"][0]["name"], "d", "{more}: {about}");
        assert_eq!(about["outputs"][1]["components"].as_array().unwrap().len(), 3, "{more}");
        assert_eq!(about["errors"], 0);
    }
    let about = json("many.osl -g 5x5 --json -o a.exr");
    assert_eq!(about["files"][0], "a.exr");
    assert!((about["outputs"][3]["components"][0]["max"].as_f64().unwrap() - 6.9).abs() < 1e-5, "{about}");
    let about = json("one.osl -g 5x5 --json --stats --profile");
    assert_eq!(about["stats"]["points"], 25);
    assert!(about["profile"]["lines"][0]["source"].as_str().unwrap().contains("s * u"), "{about}");
    assert!(about["profile"]["instructions"][0]["share"].as_f64().unwrap() > 0.0);
    // Unused, but valid.
    assert_eq!(json("one.osl --json")["printed"], "");
}

#[test]
fn profiles_say_which_line_costs_most() {
    let dir = folder();
    let shader = "shader s(output float f = 0)\n{\n    f = u;\n    for (int i = 0; i < 50; i++)\n        f += sin(f * i) * noise(P * i);\n}";
    std::fs::write(dir.path().join("s.osl"), shader).unwrap();
    let (_, out, _) = run(dir.path(), "s.osl -g 64x64 --profile");
    let first = out.lines().next().unwrap();
    assert!(first.starts_with("Most of the time goes to s.osl:5, "), "{out}");
    assert!(first.ends_with(" %:  f += sin(f * i) * noise(P * i);"), "{out}");
}

#[test]
fn negative_values_are_answered_with_the_permitted_ones() {
    let dir = folder();
    for (args, said) in [
        ("one.osl --samples -1", "-1 is not in 1.."),
        ("one.osl --adaptive -1", "invalid value '-1' for '--adaptive"),
        ("one.osl --max-time -1", "a number of seconds above 0"),
        ("one.osl --max-memory -1", "invalid value '-1' for '--max-memory"),
        ("explain one.osl --at -1,1", "`-1` is no column or row: they are counted from 0"),
    ] {
        let (code, _, err) = run(dir.path(), args);
        assert!(code == 2 && err.contains(said), "{args}: {err}");
    }
}

#[cfg(unix)]
#[test]
fn write_protected_files_stay_and_links_are_followed() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let dir = folder();
    let path = |name: &str| dir.path().join(name);
    std::fs::write(path("x.png"), "old").unwrap();
    for name in ["x.png", "many.osl"] {
        std::fs::set_permissions(path(name), PermissionsExt::from_mode(0o444)).unwrap();
    }
    for args in ["one.osl -g 2x2 -o x.png", "fmt many.osl"] {
        let (code, _, err) = run(dir.path(), args);
        assert!(code != 0 && err.contains("it is write-protected"), "{args}: {err}");
    }
    assert_eq!(std::fs::read(path("x.png")).unwrap(), b"old");
    assert_eq!(std::fs::read_to_string(path("many.osl")).unwrap(), MANY);
    symlink("there.png", path("link.png")).unwrap();
    let (code, _, err) = run(dir.path(), "one.osl -g 2x2 -o link.png");
    assert!(code == 0 && path("link.png").is_symlink() && path("there.png").exists(), "{err}");
}

#[test]
fn pages_for_packages_are_made() {
    let dir = folder();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let (code, out, err) = run(dir.path(), &format!("completions {shell}"));
        assert!(code == 0 && out.contains("explain-error"), "{shell}: {err}");
    }
    let (code, out, _) = run(dir.path(), "man");
    assert!(code == 0 && out.contains(".TH oslrun 1") && out.contains("max\\-error"), "{out}");
    let (code, out, _) = run(dir.path(), "man stability");
    assert!(code == 0 && out.contains("error\\-map"), "{out}");
    let (code, out, _) = run(dir.path(), "--version");
    assert!(code == 0 && out.starts_with("oslrun ") && out.contains("instruction sets"), "{out}");
}

#[test]
fn options_stand_under_headings() {
    let dir = folder();
    let (_, help, _) = run(dir.path(), "-h");
    let headings: Vec<&str> =
        help.lines().filter(|line| !line.starts_with(' ') && line.ends_with(':')).collect();
    insta::assert_snapshot!("headings", headings.join("\n"));
}

#[test]
fn maps_of_errors_have_the_format_of_their_name() {
    let dir = folder();
    for (name, start) in [("e.png", &b"\x89PNG"[..]), ("e.exr", b"\x76\x2f\x31\x01"), ("e.tif", b"II*\0")] {
        let (code, _, err) =
            run(dir.path(), &format!("stability one.osl --points 8x8 --no-params --error-map {name}"));
        assert_eq!(code, 0, "{err}");
        assert!(std::fs::read(dir.path().join(name)).unwrap().starts_with(start), "{name}");
    }
    assert_eq!(run(dir.path(), "stability one.osl --error-map e.gif").0, 2);
}

#[cfg(unix)]
#[test]
fn files_have_the_usual_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let dir = folder();
    std::fs::write(dir.path().join("plain"), "").unwrap();
    let mode = |name: &str| std::fs::metadata(dir.path().join(name)).unwrap().permissions().mode() & 0o777;
    for (args, name) in [
        ("one.osl -g 4x4 -o a.png", "a.png"),
        ("one.osl -g 4x4 -o a.exr", "a.exr"),
        ("one.osl -g 4x4 --profile=p.svg", "p.svg"),
        ("tradeoff one.osl -g 4x4 --budget 0.01 --html t.html", "t.html"),
        ("stability one.osl --points 4x4 --no-params --html s.html", "s.html"),
        ("picture-book one.osl -g 4x4 -o b.html", "b.html"),
    ] {
        let (code, _, err) = run(dir.path(), args);
        assert_eq!(code, 0, "{err}");
        assert_eq!(mode(name), mode("plain"), "{name}");
    }
}

#[test]
fn a_single_path_has_no_known_error() {
    let dir = folder();
    let scene =
        "options\n{\n xres 2\n yres 2\n camera c\n}\npersp_camera\n{\n name c\n}\nsphere\n{\n name s\n}\n";
    std::fs::write(dir.path().join("a.ass"), scene).unwrap();
    let (code, _, err) = run(dir.path(), "render a.ass -o a.exr --samples 1 --stats");
    assert!(code == 0 && err.contains("mean error unknown"), "{err}");
}
