//! What keeps the code readable: short functions, options that only their command reads, and one place that
//! turns events into text.

use std::path::{Path, PathBuf};

/// The lines that a function may have.
const SCREEN: usize = 80;

/// Longer functions, by file and name: tables with short arms, and the rest, which are to be split. No
/// function is added to this list.
const LONG: [(&str, &str); 7] = [
    ("osl-exec/src/program/compile.rs", "inst"),
    ("osl-hir/src/resolve/vocabulary.rs", "function"),
    ("osl-ir/src/ir/print.rs", "kernel_name"),
    ("osl-lower/src/call.rs", "builtin"),
    ("osl-lower/src/call.rs", "call"),
    ("osl-lower/src/layers.rs", "write"),
    ("osl-native/src/allocate.rs", "inst"),
];

fn crates() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates")
}

/// The Rust files below a folder: their paths relative to `crates`, and their texts.
fn files(folder: &str) -> Vec<(String, String)> {
    let root = crates();
    let (mut folders, mut found) = (vec![root.join(folder)], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let name = path.strip_prefix(&root).unwrap().display().to_string();
                found.push((name, std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    found
}

/// The name of the function that a line begins, and the blanks before it.
fn function(line: &str) -> Option<(usize, &str)> {
    let indent = line.len() - line.trim_start().len();
    let words: Vec<&str> = line.trim_start().split(' ').collect();
    let at = words.iter().position(|word| *word == "fn")?;
    let is_prefix = |word: &&str| word.starts_with("pub") || ["const", "unsafe", "async"].contains(word);
    let name = words.get(at + 1)?.split(['(', '<']).next()?;
    words[..at].iter().all(|word| is_prefix(word) || word.starts_with("in")).then_some((indent, name))
}

#[test]
fn functions_fit_a_screen() {
    let mut long = Vec::new();
    for entry in std::fs::read_dir(crates()).unwrap() {
        let folder = entry.unwrap().path().join("src");
        if !folder.is_dir() {
            continue;
        }
        let folder = folder.strip_prefix(crates()).unwrap().display().to_string();
        for (file, text) in files(&folder) {
            let lines: Vec<&str> = text.lines().collect();
            for (at, line) in lines.iter().enumerate() {
                let Some((indent, name)) = function(line) else { continue };
                let end = format!("{}}}", " ".repeat(indent));
                let length = lines[at..].iter().position(|line| **line == end).map_or(0, |n| n + 1);
                // A function of one line, or without a body, has no such end.
                let is_whole = !line.ends_with(['}', ';']);
                if length > SCREEN && is_whole {
                    long.push((file.clone(), name.to_string()));
                }
            }
        }
    }
    long.sort();
    let known: Vec<_> = LONG.map(|(file, name)| (file.to_string(), name.to_string())).into();
    assert_eq!(long, known, "functions with more than {SCREEN} lines");
}

#[test]
fn options_are_read_by_their_command_alone() {
    for (file, text) in files("oslrun/src/cli") {
        for part in text.split("Args)]").skip(1) {
            let body = part.split_once("\n}").map_or(part, |(body, _)| body);
            let open: Vec<&str> =
                body.lines().filter(|line| line.starts_with("    pub") && line.contains(": ")).collect();
            let is_struct = body.contains("struct ");
            assert!(!is_struct || open.is_empty(), "{file}: options that others read: {open:?}");
        }
    }
    let below = ["osl", "osl-exec", "osl-measure", "osl-scene", "osl-studio", "osl-job"];
    for (file, text) in below.iter().flat_map(|name| files(&format!("{name}/src"))) {
        assert!(!text.contains("clap::"), "{file} knows the command line");
    }
}

#[test]
fn only_the_edge_prints() {
    for (file, text) in files("osl-job/src") {
        assert!(!text.contains("stderr()") && !text.contains("stdout()"), "{file} prints");
    }
    for (file, text) in files("oslrun/src/cli").into_iter().chain(files("osl-studio/src")) {
        let parses = text.contains("from_str::<Value>(line") || text.contains("strip_prefix(\"warning");
        assert!(!parses, "{file} parses the text of our own messages");
    }
}
