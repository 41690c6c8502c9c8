//! Data that a command reads in addition to shaders, through the command itself.

use super::message;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use tempfile::TempDir;

/// Words of the JSON of `--attributes`.
pub(super) const WORDS: &[&str] = &[
    "{",
    "}",
    "[",
    "]",
    ":",
    ",",
    "\"a\"",
    "\"object\"",
    "null",
    "true",
    "1",
    "2.5",
    "-0",
    "1e400",
    "1e-400",
    "4294967296",
    "\"\\u0000\"",
    "\"\\ud800\"",
    "{\"a\":",
    "[1,2,3]",
    "[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0]",
    "[\"x\",\"y\"]",
    "[[1]]",
    "[1,\"x\"]",
];

/// Attributes of every kind.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    [
        r#"{"a": 1, "b": 2.5, "c": "text", "d": [1, 2, 3], "e": [0.5, 1, 2, 3]}"#,
        r#"{"object": {"a": [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1], "names": ["x", "y"]}, "a": [3, 4]}"#,
        r#"{"a": -2147483648, "object": {}, "b": 1e38, "c": [""]}"#,
        r#"[1, 2]"#,
    ]
    .map(|text| text.as_bytes().to_vec())
    .into()
}

const SHADER: &str = r#"shader asks(output float o = 0) {
    float a; color d; string c; float e[4]; matrix m; string names[2]; int i;
    o = getattribute("a", a) + getattribute("d", d) + getattribute("c", c) + getattribute("e", e) + getattribute("b", i);
    o += getattribute("object", "a", m) + getattribute("object", "names", names) + getattribute("a", 1, a);
    o += a + d[0] + strlen(c) + e[1] + m[0][0] + strlen(names[1]) + i;
}
"#;

/// Attributes as JSON: a shader asks for them, in types that may not match.
pub fn attributes(bytes: &[u8]) -> u64 {
    let place = Place::get();
    let (shader, json) = (place.file("asks.osl", SHADER.as_bytes()), place.file("attributes.json", bytes));
    let args = [
        "oslrun".into(),
        shader.into(),
        "-g".into(),
        "1x1".into(),
        "--attributes".into(),
        OsString::from(json),
    ];
    let (code, err) = command(args);
    assert!(code <= 1, "{err}");
    message(&err).wrapping_add(u64::from(code))
}

/// A folder for the files of this thread's executions, since doors may run in parallel.
pub(super) struct Place(TempDir);

impl Place {
    /// That of this thread.
    pub(super) fn get() -> &'static Place {
        thread_local! {
            static PLACE: &'static Place = Box::leak(Box::new(Place::new()));
        }
        PLACE.with(|place| *place)
    }

    #[expect(clippy::expect_used, reason = "without a temporary folder nothing can be tried")]
    fn new() -> Place {
        // The folder outlives the thread; its parent is removed with the process that created it.
        static ROOT: LazyLock<TempDir> = LazyLock::new(|| tempfile::tempdir().expect("a temporary folder"));
        Place(tempfile::tempdir_in(ROOT.path()).expect("a temporary folder"))
    }

    /// Where it is.
    pub(super) fn path(&self) -> &Path {
        self.0.path()
    }

    /// A file of these bytes.
    #[expect(clippy::expect_used, reason = "without files nothing can be tried")]
    pub(super) fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.path().join(name);
        std::fs::write(&path, bytes).expect("a file in a temporary folder");
        path
    }
}

/// Runs a command line; returns its exit code and its error text.
pub(super) fn command(args: impl IntoIterator<Item = OsString>) -> (u8, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let code = oslrun::cli::main(args, &mut out, &mut err);
    (code, String::from_utf8_lossy(&err).into_owned())
}
