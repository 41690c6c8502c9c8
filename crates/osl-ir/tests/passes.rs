//! Each pass over text: the files in `passes/PASS` hold a body before the pass, `---`, and the body after it.
//!
//! A line `# options: …` before the body sets options: `outputs NAME…`, `varying GLOBAL…`, `derivs GLOBAL…`,
//! `affine SPACE…`, `prefilter SCALE`. Other lines with `#` say what the file shows. `UPDATE_IR=1` writes the
//! bodies anew: read the difference before you commit it.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use osl_ir::global::Global;
use osl_ir::ir::{Body, print, read::read, validate::validate};
use osl_ir::passes::{self, Options, Pass, Prefilter};
use std::path::{Path, PathBuf};

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut list: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    list.sort();
    list
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/passes")
}

fn options(comments: &str) -> Options {
    let mut options = Options::default();
    for line in comments.lines().filter_map(|line| line.strip_prefix("# options: ")) {
        let mut words = line.split_whitespace();
        let option = words.next();
        let globals = |words: std::str::SplitWhitespace<'_>| {
            let named = |word| Global::ALL.into_iter().find(|global| global.name() == word).unwrap();
            words.map(named).collect()
        };
        match option {
            Some("outputs") => options.outputs = Some(words.map(Into::into).collect()),
            Some("varying") => options.varying = globals(words),
            Some("affine") => options.affine = words.map(Into::into).collect(),
            Some("derivs") => options.derivs = globals(words),
            Some("prefilter") => {
                options.prefilter = words.next().map(|scale| Prefilter { scale: scale.parse().unwrap() });
            }
            other => panic!("{other:?}"),
        }
    }
    options
}

/// A valid body, which prints as the same text.
fn body(text: &str, file: &Path) -> Body {
    let body = read(text).unwrap_or_else(|e| panic!("{}: {e}\n{text}", file.display()));
    validate(&body).unwrap_or_else(|e| panic!("{}: {e}\n{text}", file.display()));
    assert_eq!(print(&body), text, "{}", file.display());
    body
}

#[test]
fn each_pass_does_what_its_files_say() {
    let update = std::env::var_os("UPDATE_IR").is_some();
    let mut wrong = Vec::new();
    for pass in Pass::ALL {
        let list = files(&folder().join(pass.name()));
        assert!(list.len() >= 2, "{}", pass.name());
        for file in list {
            let text = std::fs::read_to_string(&file).unwrap();
            let at = text.find("shader ").unwrap();
            let (comments, bodies) = text.split_at(at);
            let (before, after) = bodies.split_once("---\n").unwrap_or((bodies, ""));
            let mut found = body(before, &file);
            passes::apply(&mut found, pass, &options(comments));
            validate(&found).unwrap_or_else(|e| panic!("{}: {e}\n{}", file.display(), print(&found)));
            let found = print(&found);
            if update {
                std::fs::write(&file, format!("{comments}{before}---\n{found}")).unwrap();
            } else if found != after {
                wrong.push(format!("{}:\n{found}", file.display()));
            } else {
                body(after, &file);
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_folder_is_a_pass() {
    for folder in files(&folder()) {
        let name = folder.file_name().unwrap().to_string_lossy().into_owned();
        assert!(Pass::from_name(&name).is_some(), "{name}");
    }
}

#[test]
fn text_that_is_no_body() {
    for (text, why) in [
        ("", "line 0: expected `shader`"),
        ("shader s\n  v0: float = 1", ""),
        ("shader s\n  v0: float = fadd v1,", "line 2: expected a value, found ``"),
        ("shader s\n  v0: number = 1", "line 2: expected a kind, found ` number = 1`"),
        ("shader s\n  v0: float = nosuch v1", "line 2: no operation `nosuch`"),
        ("shader s\n    v0: float = 1.0", "line 2: not expected here"),
        ("shader s\n  v4294967295: float = 1.0", "line 2: no operation `v4294967295`"),
        ("shader s\n  loop (v0: int = v1)\n    v2: int = 1", "line 3: expected `while`"),
        ("shader s\n  output r = s0", "line 2: an unknown slot"),
        ("shader s\n  v0: string = \"a", "line 2: no operation `\"a`"),
        ("shader s\n  v0: float = 1.0 2.0", "line 2: ` 2.0` is left over"),
    ] {
        let found = read(text).err().unwrap_or_default();
        assert_eq!(found, why, "{text}");
    }
}

/// A body that breaks each rule of `validate`.
#[test]
fn bodies_that_are_not_valid() {
    for (text, why) in [
        ("  v0: float = global P\n", "results [v0] are not [Triple]"),
        ("  v0: int = 1\n  v1: float = fadd v0, v0\n", "`fadd` does not take these"),
        (
            "  v0: float = 1.0\n  v1: float = noise.perlin.2d v0\n",
            "the kernel does not take [Float] for [Float]",
        ),
        (
            "  v0: float = 1.0\n  v1: triple = noise.perlin.1d v0\n",
            "the kernel does not take [Float] for [Triple]",
        ),
        (
            "  v0: string = \"a\"\n  v1: int = concat v0, v0\n",
            "the kernel does not take [Str, Str] for [Int]",
        ),
        ("  slot s0: int \"a\"\n  v0: float = load s0\n", "results [v0] are not [Int]"),
        ("  slot s0: int \"a\"\n  v0: float = 1.0\n  store s0, v0\n", "v0 is not of the kind of s0"),
        ("  slot s0: int[2] \"a\"\n  v0: int = load s0\n", "s0 is not used as what it is"),
        ("  v0: float = fadd v1, v1\n", "v1 is not defined here"),
        ("  v0: float = 1.0\n  if v0\n", "condition v0 is no int"),
        ("  v0: float = 1.0\n  v1: int = derivative v0 x\n", "results [v1] are not [Float]"),
    ] {
        let found = read(&format!("shader s\n{text}")).unwrap();
        let wrong = validate(&found).unwrap_err();
        assert!(wrong.starts_with(why), "{text}: {wrong}");
    }
}
