//! Which files an `#include` may name, from any working directory, and what messages show of them.

use std::path::Path;
use std::process::Command;

/// The exit code, and all that is printed.
fn oslrun(dir: &Path, args: &[&str]) -> (i32, String) {
    let result = Command::new(env!("CARGO_BIN_EXE_oslrun")).args(args).current_dir(dir).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (result.status.code().unwrap(), text(&result.stdout) + &text(&result.stderr))
}

/// A folder with files; their folders are made.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    dir
}

/// A path from a folder below `root` to a file below it.
fn from(place: &str, file: &str) -> String {
    "../".repeat(Path::new(place).components().count()) + file
}

const SHADER: &str =
    "#include \"../include/y.h\"\n\nshader x(output float r = 0) {\n    r = tripled(u);\n}\n";
const HEADER: &str = "#define THREE 3\n\nfloat tripled(float a) {\n    return THREE * a;\n}\n";

/// The folders of the tests for working directories.
const PLACES: [&str; 5] = ["", "osl", "osl/patterns", "osl/include", "elsewhere/deep"];

#[test]
fn a_header_beside_the_folder_is_found_from_any_working_directory() {
    let dir =
        folder(&[("osl/patterns/x.osl", SHADER), ("osl/include/y.h", HEADER), ("elsewhere/deep/n", "")]);
    let root = dir.path();
    for place in PLACES {
        let file = from(place, "osl/patterns/x.osl");
        let out = root.join("x.oso").display().to_string();
        for (args, expected) in [
            (vec![&*file, "-g", "2x1"], "r: 0 to 3"),
            (vec!["check", &file], ""),
            (vec!["compile", &file, "-o", &out], ""),
            (vec!["info", &file], "shader x"),
            (vec!["fmt", "--check", &file], ""),
            (vec!["ir", &file], "shader x"),
            (vec!["explain", &file, "-g", "2x2", "--at", "0,0"], "tripled"),
            (vec!["bounds", &file, "-g", "2x2"], "r"),
            (vec!["oslc", &file, "-o", &out], "Compiled"),
            (vec!["oslinfo", &file], "shader x"),
            (vec!["testshade", "-g", "2", "2", &file], ""),
        ] {
            let (code, said) = oslrun(&root.join(place), &args);
            assert!(code == 0 && said.contains(expected), "{place}: {args:?}: {code} {said}");
        }
    }
    // A group names its shaders relative to its own folder.
    std::fs::write(root.join("osl/patterns/a.group"), "shader x A ;\n").unwrap();
    let (code, said) = oslrun(&root.join("elsewhere"), &["../osl/patterns/a.group", "-g", "2x1"]);
    assert!(code == 0 && said.contains("r: 0 to 3"), "{said}");
}

#[test]
fn the_project_ends_at_git_or_three_folders_above() {
    let text = |ups: usize| {
        format!("#include \"{}y.h\"\nshader x() {{ float a = tripled(1); }}\n", "../".repeat(ups))
    };
    let dir = folder(&[("y.h", HEADER), ("a/b/c/d/three.osl", ""), ("a/b/c/d/four.osl", ""), ("w/n", "")]);
    let place = dir.path().join("w");
    std::fs::write(dir.path().join("a/y.h"), HEADER).unwrap();
    std::fs::write(dir.path().join("a/b/c/d/three.osl"), text(3)).unwrap();
    std::fs::write(dir.path().join("a/b/c/d/four.osl"), text(4)).unwrap();
    let (three, four) = ("../a/b/c/d/three.osl", "../a/b/c/d/four.osl");
    assert_eq!(oslrun(&place, &["check", three]).0, 0);
    let (code, said) = oslrun(&place, &["check", four]);
    assert!(code == 1 && said.contains("-I DIR"), "{said}");
    assert_eq!(oslrun(&place, &["check", four, "-I", ".."]).0, 0);
    assert_eq!(oslrun(&place, &["check", four, "--allow-files"]).0, 0);
    assert_eq!(oslrun(&place, &["oslc", four, "-o", "four.oso"]).0, 0);
    std::fs::create_dir(dir.path().join(".git")).unwrap();
    assert_eq!(oslrun(&place, &["check", four]).0, 0);
    // A nearer one narrows the project.
    std::fs::write(dir.path().join("a/b/.git"), "gitdir: elsewhere\n").unwrap();
    assert_eq!(oslrun(&place, &["check", three]).0, 1);
}

#[cfg(unix)]
#[test]
fn the_advice_for_a_link_works() {
    let dir = folder(&[("far/lib/y.h", HEADER), ("a/b/c/d/osl/x.osl", ""), ("w/n", "")]);
    let root = dir.path();
    let main = root.join("a/b/c/d/osl");
    std::fs::write(main.join("x.osl"), "#include \"y.h\"\nshader x() { float a = tripled(1); }\n").unwrap();
    std::fs::write(main.join("z.osl"), "#include \"l/y.h\"\nshader z() { float a = tripled(1); }\n").unwrap();
    std::os::unix::fs::symlink(root.join("far/lib/y.h"), main.join("y.h")).unwrap();
    std::os::unix::fs::symlink(root.join("far/lib"), main.join("l")).unwrap();
    std::os::unix::fs::symlink(&main, root.join("w/osl")).unwrap();
    for file in ["../a/b/c/d/osl/x.osl", "../a/b/c/d/osl/z.osl", "osl/x.osl", "osl/z.osl"] {
        let (code, said) = oslrun(&root.join("w"), &["check", file]);
        assert!(code == 1 && said.contains("-I DIR with the folder that holds the file itself"), "{said}");
        let (code, said) = oslrun(&root.join("w"), &["check", file, "-I", "../far/lib"]);
        assert_eq!(code, 0, "{file}: {said}");
    }
    // In the project a link is followed, also one to the folder of the shader.
    std::fs::create_dir(root.join(".git")).unwrap();
    for file in ["../a/b/c/d/osl/x.osl", "osl/z.osl"] {
        assert_eq!(oslrun(&root.join("w"), &["check", file]).0, 0, "{file}");
    }
}

#[test]
fn messages_do_not_show_files_outside_of_the_folder_of_the_shader() {
    let secret = "password: sesame, sesame2\n";
    let dir = folder(&[
        ("secret.h", secret),
        ("osl/a.osl", "#include \"../secret.h\"\nshader a(output float r = sesamee) { r = sesame3; }\n"),
        ("osl/own/secret.h", secret),
        ("osl/b.osl", "#include \"own/secret.h\"\nshader b() {}\n"),
    ]);
    let shown = |said: &str| said.contains("password") || said.contains("sesame2");
    for args in [
        "check osl/a.osl",
        "check osl/a.osl --message-format json",
        "check osl/a.osl --diff",
        "osl/a.osl -g 1x1",
        "osl/a.osl -g 1x1 --repair",
        "compile osl/a.osl",
        "info --json osl/a.osl",
        "explain osl/a.osl -g 2x2 --at 0,0",
        "fmt --check osl/a.osl",
        "oslc osl/a.osl",
        "oslinfo osl/a.osl",
        "testshade -g 1 1 osl/a.osl",
    ] {
        let (code, said) = oslrun(dir.path(), &args.split(' ').collect::<Vec<_>>());
        // As the reference's, `testshade` succeeds without a shader.
        assert!((code != 0 || args.starts_with("testshade")) && !shown(&said), "{args}: {said}");
    }
    let (_, said) = oslrun(&dir.path().join("osl"), &["oslc", "-E", "a.osl"]);
    assert!(!shown(&said), "{said}");
    // Its place is told, and its text where the user permits it or in the shader's own tree.
    let (_, said) = oslrun(dir.path(), &["check", "osl/a.osl"]);
    assert!(said.contains("secret.h:1:") && said.contains("-I DIR"), "{said}");
    for args in ["check osl/a.osl -I .", "check osl/a.osl --allow-files", "check osl/b.osl"] {
        let (code, said) = oslrun(dir.path(), &args.split(' ').collect::<Vec<_>>());
        assert!(code == 1 && shown(&said), "{args}: {said}");
    }
}
