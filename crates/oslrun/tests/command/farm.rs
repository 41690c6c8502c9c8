//! What farms and build systems need: many files, rules for make, exit codes, lists of frames, little text.

use std::path::Path;
use std::process::Command;

const GOOD: &str = "#include \"k.h\"\nshader a(string file = \"t.png\", output color c = 0) { c = K * texture(file, u, v); }\n";
const BAD: &str = "shader b() { float x = y; }\n";

fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("all/a.osl", GOOD);
    write("all/k.h", "#define K 2\n");
    write("all/deep/b.osl", BAD);
    write("good/one.osl", "shader one(output float f = 0) { f = u / v; }\n");
    write("good/deep/two.osl", "shader two(output float f = 0) { f = u; }\n");
    write("empty/readme.txt", "");
    dir
}

/// Runs the command in a folder.
fn run(dir: &Path, args: &str) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_oslrun"));
    let output = command.current_dir(dir).args(args.split_whitespace()).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_folder_stands_for_its_shaders() {
    let dir = folder();
    let (code, _, err) = run(dir.path(), "check all good");
    assert!(code == 1 && err.contains("all/deep/b.osl:1") && err.contains("in 4 files"), "{err}");
    assert_eq!(run(dir.path(), "check good").0, 0);
    let (code, out, _) = run(dir.path(), "fmt --check good all");
    assert_eq!((code, out.lines().count()), (1, 4), "{out}");
    assert_eq!(run(dir.path(), "fmt good").0, 0);
    assert_eq!(run(dir.path(), "fmt --check good").0, 0);
    for command in ["check", "fmt", "info", "compile"] {
        let (code, _, err) = run(dir.path(), &format!("{command} empty"));
        assert_eq!((code, err.as_str()), (1, "error: empty: the folder has no .osl file\n"), "{command}");
    }
}

#[test]
fn several_shaders_are_described_and_compiled() {
    let dir = folder();
    let (code, out, _) = run(dir.path(), "info good");
    assert_eq!(code, 0);
    assert!(out.starts_with("good/deep/two.osl: shader two\n") && out.contains("good/one.osl: shader one\n"));
    let (code, out, err) = run(dir.path(), "info --json good all/deep/b.osl");
    let list: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, list.as_array().map(Vec::len), &list[0]["name"]), (1, Some(2), &"two".into()), "{err}");
    assert_eq!(list[1]["file"], "good/one.osl");
    std::fs::create_dir(dir.path().join("built")).unwrap();
    assert_eq!(run(dir.path(), "compile good -o built").0, 0);
    assert!(dir.path().join("built/one.oso").is_file() && dir.path().join("built/two.oso").is_file());
    let (code, _, err) = run(dir.path(), "compile good -o one.oso");
    assert!(code == 2 && err.contains("need a folder"), "{err}");
    let (code, _, err) = run(dir.path(), "compile good/one.osl good/one.osl");
    assert!(code == 2 && err.contains("would become one file"), "{err}");
    let (code, out, _) = run(dir.path(), "info --check-oso good");
    assert_eq!((code, out.as_str()), (0, "two.oso: no violations\none.oso: no violations\n"));
}

#[test]
fn what_was_read_becomes_a_rule_for_make() {
    let dir = folder();
    let picture = osl_image::PngOptions {
        transfer: osl_image::Transfer::Linear,
        depth: osl_image::BitDepth::Eight,
        software: None,
    };
    osl_image::write_png(&dir.path().join("all/t.png"), 1, 1, &[&[1.0]], picture).unwrap();
    let rule = |args: &str| {
        let (code, _, err) = run(dir.path(), args);
        assert_eq!(code, 0, "{args}: {err}");
        std::fs::read_to_string(dir.path().join("d.mk")).unwrap()
    };
    let of_run = rule("all/a.osl -g 4x4 -o a.exr --deps d.mk");
    let first: Vec<&str> = of_run.split("\n\n").next().unwrap().split_whitespace().collect();
    assert!(
        first[0] == "a.exr:" && ["all/a.osl", "all/t.png"].iter().all(|name| first.contains(name)),
        "{of_run}"
    );
    assert!(first.iter().any(|name| name.ends_with("all/k.h")), "{of_run}");
    let of_check = rule("check all/a.osl --deps d.mk");
    assert!(
        of_check.starts_with("d.mk: ") && of_check.contains("k.h") && !of_check.contains("t.png"),
        "{of_check}"
    );
    assert!(rule("compile all/a.osl --deps d.mk").starts_with("a.oso: "));
    for command in ["explain all/a.osl -g 4x4 --at 1,1", "sanitize all/a.osl -g 4x4"] {
        assert!(rule(&format!("{command} --deps d.mk")).contains("t.png"), "{command}");
    }
    std::fs::remove_file(dir.path().join("d.mk")).unwrap();
    assert_eq!(run(dir.path(), "check all/deep/b.osl --deps d.mk").0, 1);
    assert!(!dir.path().join("d.mk").exists(), "a command that fails writes no rule");
    let (code, _, err) = run(dir.path(), "check all/a.osl --deps all/a.osl");
    assert!(code == 1 && err.contains("file that is read"), "{err}");
    assert_eq!(std::fs::read_to_string(dir.path().join("all/a.osl")).unwrap(), GOOD);
    if Command::new("make").arg("--version").output().is_ok() {
        rule("all/a.osl -g 4x4 -o a.exr --deps d.mk");
        let asked =
            |dir: &Path| Command::new("make").current_dir(dir).args(["-f", "d.mk", "-q", "a.exr"]).status();
        assert_eq!(asked(dir.path()).unwrap().code(), Some(0), "nothing has changed");
    }
}

#[test]
fn findings_make_the_exit_code() {
    let dir = folder();
    for (args, expected) in [
        ("bounds good/one.osl --fail-on zero-division", 1),
        ("bounds good/one.osl --fail-on index,domain", 0),
        ("bounds good/deep/two.osl --fail-on any", 0),
        ("bounds good/deep/two.osl --fail-on divisions", 2),
        ("stability good/deep/two.osl -g 8x8 --no-params --fail-on any", 0),
        ("stability good/deep/two.osl -g 8x8 --no-params --fail-on digits", 2),
    ] {
        let (code, out, err) = run(dir.path(), args);
        assert_eq!(code, expected, "{args}: {out}{err}");
    }
    let drift = "shader drift(output float f = 0) { f = (u + 1e7) - 1e7; }";
    std::fs::write(dir.path().join("drift.osl"), drift).unwrap();
    for (kinds, expected) in [("error", 1), ("any", 1), ("nan,infinity", 0)] {
        let args = format!("stability drift.osl -g 8x8 --no-params --fail-on {kinds}");
        assert_eq!(run(dir.path(), &args).0, expected, "{kinds}");
    }
}

#[test]
fn a_film_that_was_stopped_goes_on() {
    let dir = folder();
    let names = || {
        let list = std::fs::read_dir(dir.path()).unwrap().map(|entry| entry.unwrap().file_name());
        let mut list: Vec<String> = list.filter_map(|name| name.into_string().ok()).collect();
        list.retain(|name| name.ends_with("png"));
        list.sort();
        list
    };
    let shader = "shader two(output float f = 0, output color c = 0) { f = time; c = time; }";
    std::fs::write(dir.path().join("f.osl"), shader).unwrap();
    let film = "f.osl -g 2x2 -o x.##.png --frames 1-2,5-9:2 --skip-existing";
    let (code, out, err) = run(dir.path(), film);
    assert_eq!((code, out.lines().count(), err.as_str()), (0, 10, ""), "{out}");
    std::fs::remove_file(dir.path().join("x.07.c.png")).unwrap();
    std::fs::remove_file(dir.path().join("x.07.f.png")).unwrap();
    let (code, out, err) = run(dir.path(), film);
    assert_eq!((code, out.as_str()), (0, "wrote x.07.f.png\nwrote x.07.c.png\n"));
    assert!(err.contains("note: frame 9 is left out: x.09.png is there"), "{err}");
    assert_eq!(names().len(), 10);
    assert_eq!(run(dir.path(), &format!("{film} --quiet")), (0, String::new(), String::new()));
    let (code, out, _) = run(dir.path(), "f.osl -g 2x2 --quiet -o y.exr");
    assert_eq!((code, out.as_str()), (0, ""));
}

/// The commands of the page, one after the other, in a folder with the project's shaders. Some of these have
/// errors, and some are not formatted.
#[test]
fn the_commands_of_the_page_run() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = std::fs::read_to_string(root.join("docs/farm.md")).unwrap();
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("osl")).unwrap();
    for entry in std::fs::read_dir(root.join("osl")).unwrap().map(Result::unwrap) {
        if entry.path().is_file() {
            std::fs::copy(entry.path(), dir.path().join("osl").join(entry.file_name())).unwrap();
        }
    }
    let blocks = page.split("```").skip(1).step_by(2).filter_map(|block| block.strip_prefix("sh\n"));
    let mut seen = 0;
    for line in blocks.flat_map(str::lines) {
        let words = line.replace('\'', "");
        match words.split_once(' ').unwrap() {
            ("oslrun", args) => {
                let (code, _, err) = run(dir.path(), args);
                assert!(code < 2, "{line}: {err}");
                seen += 1;
            }
            ("mkdir", name) => std::fs::create_dir(dir.path().join(name)).unwrap(),
            _ => assert!(line.starts_with("openjd run "), "{line}"),
        }
    }
    assert!(seen > 12, "{seen}");
    let made = ["set.1011.exr", "film.0012.exr", "bake.yaml", "built/Cobbled.oso", "cobbled.mk"];
    made.iter().for_each(|name| assert!(dir.path().join(name).is_file(), "{name}"));
}
