//! Bad input for the command: the result is one clear line, exit code 1 (2 for the command line), and an
//! unchanged old file.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn oslrun(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_oslrun")).args(args).output().unwrap()
}

fn seed(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl").join(name).display().to_string()
}

/// A folder with an old output file.
struct Place {
    dir: tempfile::TempDir,
}

impl Place {
    fn new() -> Place {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("out.exr"), "old").unwrap();
        Place { dir }
    }

    fn path(&self, name: &str) -> String {
        self.dir.path().join(name).display().to_string()
    }

    fn file(&self, name: &str, text: impl AsRef<[u8]>) -> String {
        let path = self.path(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    /// Runs the command, and checks the exit code, the message, and that nothing else has happened.
    fn refuses(&self, args: &[&str], code: i32, words: &str) {
        let mut all = args.to_vec();
        let out = self.path("out.exr");
        if !args.contains(&"-o") {
            all.extend(["-o", &out]);
        }
        let result = oslrun(&all);
        let text = String::from_utf8_lossy(&result.stderr).into_owned();
        assert_eq!(result.status.code(), Some(code), "{args:?}: {text}");
        assert!(text.contains(words), "{args:?}: {text}");
        assert!(!text.contains("panicked"), "{text}");
        let errors = text.lines().filter(|l| l.starts_with("error")).count();
        assert!((1..=6).contains(&errors), "{args:?}: {text}");
        assert_eq!(std::fs::read(self.dir.path().join("out.exr")).unwrap(), b"old", "{args:?}");
        let left: Vec<PathBuf> =
            std::fs::read_dir(self.dir.path()).unwrap().map(|e| e.unwrap().path()).collect();
        assert!(left.iter().all(|p| !p.to_string_lossy().contains(".oslrun-")), "{left:?}");
    }
}

#[test]
fn files() {
    let place = Place::new();
    place.refuses(&[&place.path("none.osl")], 1, "cannot read");
    place.refuses(&[&place.path("")], 1, "it is a folder");
    place.refuses(&[&place.file("bin.osl", [0xff, 0xfe, 0, 1, 2])], 1, "it is not text");
    place.refuses(&[&place.file("nul.osl", b"shader a() {}\0")], 1, "it is not text");
}

#[test]
fn parameters() {
    let place = Place::new();
    let flakes = seed("flakes.osl");
    place.refuses(
        &[&flakes, "-p", "flake_sise=1"],
        1,
        "no parameter `flake_sise`; there is one named `flake_size`",
    );
    place.refuses(
        &[&flakes, "-p", "flake_size=big"],
        1,
        "parameter `flake_size` is a float, and `big` is none",
    );
    place.refuses(&[&flakes, "-p", "flake_size"], 2, "NAME=VALUE");
    place.refuses(&[&flakes, "--outputs", "colour"], 1, "no output `colour`; it has result, alpha");
}

#[test]
fn command_line() {
    let place = Place::new();
    let flakes = seed("flakes.osl");
    place.refuses(&[&flakes, "-g", "0x4"], 2, "at least one point");
    place.refuses(&[&flakes, "-g", "99999999x99999999"], 1, "--limit running.points");
    place.refuses(&[&flakes, "-g", "9999999999999x9999999999999"], 2, "cannot be counted");
    place.refuses(&[&flakes, "-g", "big"], 2, "WIDTHxHEIGHT");
    place.refuses(&[&flakes, "--threads", "0"], 2, "--threads");
    place.refuses(&[&flakes, "--no-such"], 2, "--no-such");
    place.refuses(&[], 2, "FILE.osl");
}

#[test]
fn outputs() {
    let place = Place::new();
    let flakes = seed("flakes.osl");
    place.refuses(&[&flakes, "-g", "4x4", "-o", &place.path("no/such/out.exr")], 1, "there is no folder");
    place.refuses(
        &[&flakes, "-g", "4x4", "-o", &place.path("out.bmp")],
        2,
        "must end in .exr, .png, .tif or .jpg",
    );
    std::fs::create_dir(place.path("folder.exr")).unwrap();
    place.refuses(&[&flakes, "-g", "4x4", "-o", &place.path("folder.exr")], 1, "it is a folder");
}

#[test]
fn textures_and_spaces() {
    let place = Place::new();
    place.refuses(
        &[&seed("chaosmosaic.osl"), "-g", "4x4", "-p", "Image=none.png", "--deny", "errors"],
        1,
        "there is no file \"none.png\" of parameter `Image`",
    );
    place.refuses(
        &[&seed("Cobbled.osl"), "-g", "4x4", "-p", "spacename=nowhere", "--deny", "errors"],
        1,
        "Unknown transformation \"nowhere\"",
    );
}

#[test]
fn hostile_sources() {
    let place = Place::new();
    let parens =
        format!("shader a(output float f = 0) {{ f = {}1{}; }}", "(".repeat(10_000), ")".repeat(10_000));
    place.refuses(&[&place.file("parens.osl", parens)], 1, "nest");
    let looped = place.file("loop.osl", "#include \"loop.osl\"\nshader a() {}\n");
    place.refuses(&[&looped], 1, "include");
    let doubling: String = (1..60).map(|i| format!("#define A{i} A{} A{}\n", i - 1, i - 1)).collect();
    let bomb = format!("#define A0 1 +\n{doubling}shader a(output float f = 0) {{ f = A59 0; }}\n");
    place.refuses(&[&place.file("bomb.osl", bomb)], 1, "expan");
    let endless = "shader a(output float f = 0) { while (1) f += 1; }";
    place.refuses(&[&place.file("endless.osl", endless), "-g", "2x2"], 1, "takes more than");
    let functions: String = (1..40)
        .map(|i| format!("float f{i}(float x) {{ return f{}(x) + f{}(x); }}\n", i - 1, i - 1))
        .collect();
    let inlined = format!(
        "float f0(float x) {{ return x; }}\n{functions}shader a(output float f = 0) {{ f = f39(u); }}"
    );
    place.refuses(&[&place.file("inlined.osl", inlined)], 1, "too large");
    place.refuses(&[&place.file("array.osl", "shader a() { float x[2147483647]; }")], 1, "longer than");
}

#[test]
fn strict_syntax_refuses_what_is_published_broken() {
    let place = Place::new();
    place.refuses(&[&seed("Cobbled.osl"), "--strict-syntax"], 1, "error");
    place.refuses(&[&seed("flakes.osl"), "--strict-syntax"], 1, "error");
    place.refuses(&[&seed("sprinkles.osl")], 1, "insert what is missing");
}

#[test]
fn good_input_is_written() {
    let place = Place::new();
    let out = place.path("out.exr");
    let run = oslrun(&[&seed("flakes.osl"), "-g", "8x8", "-o", &out, "--half", "--outputs", "result"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert_ne!(std::fs::read(&out).unwrap(), b"old");
    let png = place.path("p.png");
    let fixed = place.path("fixed.osl");
    let run = oslrun(&[&seed("sprinkles.osl"), "--repair", "--write", &fixed, "-g", "8x8", "-o", &png]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert!(Path::new(&png).is_file());
    let check = oslrun(&["check", &fixed, "--message-format", "json"]);
    assert!(check.status.success());
    let ir = oslrun(&["ir", &fixed]);
    assert!(String::from_utf8_lossy(&ir.stdout).contains("# after the passes"));
    let several = place.path("several.png");
    assert!(oslrun(&[&seed("flakes.osl"), "-g", "8x8", "-o", &several]).status.success());
    assert!(Path::new(&place.path("several.alpha.png")).is_file());
}
