//! Command lines. A case is a folder: sources and other inputs; `cmd`, one command per line, run in order by
//! bash in a copy of the folder; `expected.txt`, the text that the reference printed on both streams in
//! order, with its exit codes; `expected/`, the pictures that it wrote; `note.txt`, the rule.
//!
//! Lines must be identical, except diagnostics of `oslc`: their wording is our own, so only file, line, kind
//! and number are compared.

use crate::{OSLRUN, data, names_in, picture};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// The tolerance for path-traced pictures: the reference's own tests allow more.
const NEAR_OF_PATHS: f32 = 2e-3;

/// A folder that contains links to the program, named like the reference's tools.
pub(crate) struct Tools(tempfile::TempDir);

impl Tools {
    /// The links.
    pub(crate) fn linked() -> Self {
        let folder = tempfile::tempdir().unwrap();
        for name in ["oslc", "oslinfo", "testshade", "testrender"] {
            std::os::unix::fs::symlink(OSLRUN, folder.path().join(name)).unwrap();
        }
        Self(folder)
    }

    /// What one command line prints in a folder, both streams in order, and its exit code.
    fn run(&self, line: &str, folder: &Path) -> String {
        let path = std::env::var("PATH").unwrap_or_default();
        let output = Command::new("bash")
            .args(["-c", &format!("exec 2>&1; {line}")])
            .env("PATH", format!("{}:{path}", self.0.path().display()))
            .current_dir(folder)
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let printed: Vec<u8> = output.stdout.into_iter().filter(|&byte| byte != 0).collect();
        let code = output.status.code().unwrap_or(-1);
        format!("$ {line}\n{}[exit {code}]\n", String::from_utf8_lossy(&printed))
    }
}

/// The differences between a case and its recording.
pub(crate) fn check(tools: &Tools, case: &str) -> Vec<String> {
    let source = data("suite").join(case);
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join(case);
    copy(&source, &folder);
    let commands = fs::read_to_string(source.join("cmd")).unwrap();
    let printed: String = commands.lines().map(|line| tools.run(line, &folder)).collect();
    let expected = fs::read_to_string(source.join("expected.txt")).unwrap();
    let (expected, printed) = (comparable(&expected), comparable(&printed));
    let mut differences = Vec::new();
    if expected != printed {
        let n_same = expected.iter().zip(&printed).take_while(|(a, b)| a == b).count();
        let line = |lines: &[String]| lines.get(n_same).cloned().unwrap_or_else(|| "the end".to_owned());
        differences.push(format!("line {}: {:?}, not {:?}", n_same + 1, line(&printed), line(&expected)));
    }
    let tolerance = if case.starts_with("testrender") { NEAR_OF_PATHS } else { picture::NEAR };
    for name in pictures(&source.join("expected"), Path::new("")) {
        differences.extend(picture::difference(
            &source.join("expected").join(&name),
            &folder.join(&name),
            tolerance,
        ));
    }
    differences
}

/// The lines of a text. A diagnostic of `oslc` is reduced to file, line and kind; indented lines that explain
/// it are omitted.
fn comparable(text: &str) -> Vec<String> {
    let mut lines = Vec::new();
    let mut in_diagnostic = false;
    for line in text.lines() {
        let place = place(line);
        if in_diagnostic && line.starts_with([' ', '\t']) {
            continue;
        }
        in_diagnostic = place.is_some();
        lines.push(place.unwrap_or(line).to_owned());
    }
    lines
}

/// `FILE:LINE: error` or `FILE:LINE: warning` at the start of a line.
fn place(line: &str) -> Option<&str> {
    let mut parts = line.splitn(4, ':');
    let (file, number, kind) = (parts.next()?, parts.next()?, parts.next()?);
    let rest = parts.next()?;
    let is_place =
        !file.contains(' ') && number.parse::<u32>().is_ok() && matches!(kind, " error" | " warning");
    is_place.then(|| &line[..line.len() - rest.len()])
}

/// Copies the files that commands may read.
fn copy(source: &Path, target: &Path) {
    fs::create_dir_all(target).unwrap();
    for name in names_in(source) {
        let (from, to) = (source.join(&name), target.join(&name));
        if from.is_dir() && name != "expected" {
            copy(&from, &to);
        } else if from.is_file() && !matches!(name.as_str(), "cmd" | "expected.txt" | "note.txt") {
            fs::copy(&from, &to).unwrap();
        }
    }
}

/// The recorded pictures below a folder, by their paths in it.
fn pictures(root: &Path, below: &Path) -> Vec<std::path::PathBuf> {
    let folder = root.join(below);
    if !folder.is_dir() {
        return Vec::new();
    }
    let entries = names_in(&folder).into_iter().map(|name| below.join(name));
    entries
        .flat_map(|entry| if root.join(&entry).is_dir() { pictures(root, &entry) } else { vec![entry] })
        .collect()
}
