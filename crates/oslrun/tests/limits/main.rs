//! Tests reach every limit and check the error that its row in the table names. `docs/limits.md` is generated
//! from the same rows.
//!
//! A module for each group contains a list: the name of a limit, and a function that reaches it. Inputs are
//! small, because the limit is lowered with `--limit`. (`UPDATE_DOCS=1 cargo test -p oslrun --test limits`
//! rewrites the page.)

#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "a test says what must hold")]

mod commands;
mod compiling;
mod images;
mod reading;
mod running;
mod scenes;

use osl_limits::{Limits, Row};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The name of a limit, and a function that reaches it.
type Trip = (&'static str, fn(&Row));
type Tripped = &'static [Trip];

/// The exit code and output of a command.
struct Said {
    /// The exit code; 128 plus the number of the signal that ended the command.
    code: i32,
    out: String,
    err: String,
}

impl Said {
    /// Checks that the command failed with the error of a row.
    #[track_caller]
    fn fails_with(&self, row: &Row) {
        assert_eq!(self.code, 1, "{}\n{}", self.out, self.err);
        assert!(self.err.contains(row.error), "not `{}` but:\n{}", row.error, self.err);
    }

    /// Checks that the command succeeded.
    #[track_caller]
    fn succeeds(&self) {
        assert_eq!(self.code, 0, "{}\n{}", self.out, self.err);
    }
}

/// A new folder with files in it.
struct Folder(tempfile::TempDir);

impl Folder {
    fn with(files: &[(&str, &[u8])]) -> Folder {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, content).unwrap();
        }
        Folder(folder)
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    /// Runs `oslrun` in the folder.
    fn run(&self, args: &[&str]) -> Said {
        let output =
            Command::new(env!("CARGO_BIN_EXE_oslrun")).current_dir(self.path()).args(args).output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
        Said { code: output.status.code().unwrap_or(128), out: text(output.stdout), err: text(output.stderr) }
    }
}

/// A folder with one shader, `a.osl`.
fn shader(text: &str) -> Folder {
    Folder::with(&[("a.osl", text.as_bytes())])
}

fn all() -> Vec<Trip> {
    let groups = [reading::TRIPPED, compiling::TRIPPED, running::TRIPPED, images::TRIPPED, scenes::TRIPPED];
    groups.into_iter().flatten().copied().collect()
}

#[test]
fn every_limit_is_reached() {
    let all = all();
    let named: BTreeSet<&str> = all.iter().map(|(name, _)| *name).collect();
    let rows: BTreeSet<&str> = Limits::rows().iter().map(|row| row.name).collect();
    assert_eq!(named, rows, "lists and limits");
    for (name, reach) in all {
        let row = Limits::rows().iter().find(|row| row.name == name).unwrap();
        reach(row);
    }
}

#[test]
fn the_page_is_current() {
    let mut page = include_str!("head.md").to_string();
    for row in Limits::rows() {
        let group = row.name.split('.').next().unwrap();
        if !page.contains(&format!("\n## `{group}`\n")) {
            page += &format!("\n## `{group}`\n\n| limit | bounds | default | error |\n|---|---|---|---|\n");
        }
        let meaning = row.meaning.trim().trim_end_matches('.');
        page += &format!(
            "| `{}` | {meaning} | {} {} | {} |\n",
            row.name,
            amount(row.default),
            row.unit,
            row.error
        );
    }
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/limits.md");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &page).unwrap();
    }
    let held = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(held == page, "docs/limits.md is not current: run this test with UPDATE_DOCS=1");
}

/// A number in the form for `--limit`.
fn amount(n: u64) -> String {
    match n {
        0 => n.to_string(),
        n if n % (1 << 30) == 0 => format!("{}G", n >> 30),
        n if n % (1 << 20) == 0 => format!("{}M", n >> 20),
        n if n % (1 << 10) == 0 => format!("{}k", n >> 10),
        n => n.to_string(),
    }
}

#[test]
fn time_and_memory_of_a_command_are_bounded() {
    let endless =
        shader("shader a(output float o = 0) { for (int i = 0; i < 2000000000; i++) o += sin(u * i); }");
    let many = ["a.osl", "-g", "8x8", "--max-time", "0.2", "--max-steps", "1000G"];
    let said = endless.run(&many);
    assert_eq!(said.code, 1);
    assert!(said.err.contains("--max-time"), "{}", said.err);
}

#[test]
fn a_limit_has_to_exist() {
    let said = shader("shader a() {}").run(&["check", "a.osl", "--limit", "file_bytes=1"]);
    assert_eq!(said.code, 2);
    assert!(said.err.contains("reading.file_bytes"), "{}", said.err);
    let said = shader("shader a() {}").run(&["a.osl", "--max-steps", "1e9"]);
    assert_eq!(said.code, 2);
    assert!(said.err.contains("64k, 16M, 2G"), "{}", said.err);
}
