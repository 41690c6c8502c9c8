//! Compares the maps of the project with its manifests: which crate may depend on which, and which crate uses
//! which library. Checks that texts name the oldest compiler, and the width of comments, which the formatter
//! leaves alone. Checks that links between documents lead somewhere.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

type Names = BTreeSet<String>;

/// The crates of the workspace: what each depends on when it is built, and when it is tested.
struct Packages {
    normal: BTreeMap<String, Names>,
    other: BTreeMap<String, Names>,
}

fn packages() -> Packages {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut found = Packages { normal: BTreeMap::new(), other: BTreeMap::new() };
    // The package for Python is a workspace of its own.
    for manifest in ["Cargo.toml", "crates/oslrun-py/Cargo.toml"] {
        let metadata = Command::new(env!("CARGO"))
            .args([
                "metadata",
                "--no-deps",
                "--offline",
                "--format-version",
                "1",
                "--manifest-path",
                manifest,
            ])
            .current_dir(&root)
            .output()
            .unwrap();
        let metadata: serde_json::Value = serde_json::from_slice(&metadata.stdout).unwrap();
        for package in metadata["packages"].as_array().unwrap() {
            let name = package["name"].as_str().unwrap().to_string();
            let (normal, other) =
                (found.normal.entry(name.clone()).or_default(), found.other.entry(name).or_default());
            for dependency in package["dependencies"].as_array().unwrap() {
                let name = dependency["name"].as_str().unwrap().to_string();
                if dependency["kind"] != "dev" {
                    normal.insert(name)
                } else {
                    other.insert(name)
                };
            }
        }
    }
    found
}

/// The rows of the tables of a page, each as its cells.
fn rows(page: &str) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(page)).unwrap();
    let cells = |line: &str| line.trim_matches('|').split('|').map(|cell| cell.trim().to_string()).collect();
    text.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| crate |")).map(cells).collect()
}

fn words(text: &str) -> Names {
    text.split(|c: char| !(c.is_alphanumeric() || c == '-' || c == '_'))
        .filter(|word| !word.is_empty())
        .map(str::to_string)
        .collect()
}

fn is_ours(name: &str) -> bool {
    name == "osl" || name.starts_with("osl-") || name == "oslrun" || name == "oslrun-py"
}

/// Crates for tests and examples are no part of the map.
fn is_on_the_map(name: &str) -> bool {
    is_ours(name) && !matches!(name, "osl-tests" | "osl-examples")
}

#[test]
fn the_map_of_the_crates_is_that_of_their_manifests() {
    let packages = packages();
    let mut seen = Names::new();
    for row in rows("crates/README.md") {
        let name = row[0].trim_start_matches('[').split(']').next().unwrap().to_string();
        let stated: Names = words(&row[2]).into_iter().filter(|word| is_ours(word)).collect();
        let used: Names = packages.normal[&name].iter().filter(|name| is_ours(name)).cloned().collect();
        if row[2] != "all" {
            assert_eq!(stated, used, "the crates that {name} may depend on");
        }
        seen.insert(name);
    }
    let all: Names = packages.normal.keys().filter(|name| is_on_the_map(name)).cloned().collect();
    assert_eq!(seen, all);
}

#[test]
fn every_dependency_has_its_reason_and_its_users() {
    let packages = packages();
    let mut users: BTreeMap<String, Names> = BTreeMap::new();
    for (kinds, only_tests) in [(&packages.normal, false), (&packages.other, true)] {
        for (user, names) in kinds {
            for name in names.iter().filter(|name| !is_ours(name)) {
                let users = users.entry(name.clone()).or_default();
                if !only_tests && is_on_the_map(user) {
                    users.insert(user.clone());
                }
            }
        }
    }
    let mut wrong = Vec::new();
    let mut seen = Names::new();
    for row in rows("docs/dependencies.md") {
        let stated: Names = words(&row[1]).into_iter().filter(|word| is_on_the_map(word)).collect();
        let of_tests = row[1].contains("tests");
        for name in words(&row[0]) {
            seen.insert(name.clone());
            match users.get(&name) {
                None if name == "libfuzzer-sys" => {}
                None => wrong.push(format!("{name} is used by nobody")),
                Some(used) if !of_tests && *used != stated => {
                    wrong.push(format!("{name} is used by {used:?}, not by {stated:?}"));
                }
                Some(used) if of_tests && !used.is_empty() => {
                    wrong.push(format!("{name} is used by {used:?}, not by tests alone"));
                }
                Some(_) => {}
            }
        }
    }
    wrong.extend(users.keys().filter(|name| !seen.contains(*name)).map(|name| format!("{name} has no row")));
    assert!(wrong.is_empty(), "docs/dependencies.md:\n{}", wrong.join("\n"));
}

#[test]
fn the_workflow_uses_the_oldest_compiler() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let read = |name: &str| std::fs::read_to_string(root.join(name)).unwrap();
    let manifest = read("Cargo.toml");
    let version = manifest.split("rust-version = \"").nth(1).unwrap().split('"').next().unwrap();
    assert!(read(".github/workflows/checks.yml").contains(&format!("rustup default {version}.0\n")));
    assert!(read("README.md").contains(&format!("({version} or later)")));
}

/// The longest line of a comment, in characters.
const COMMENT_WIDTH: usize = 110;

#[test]
fn comments_fit_their_width() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut folders: Vec<_> = ["crates", "tests", "examples"].map(|name| root.join(name)).into();
    let mut wide = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() && !path.ends_with("target") {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                let lines = text.lines().enumerate();
                let is_wide =
                    |line: &str| line.trim_start().starts_with("//") && line.chars().count() > COMMENT_WIDTH;
                wide.extend(
                    lines.filter(|(_, line)| is_wide(line)).map(|(at, _)| format!("{path:?}:{}", at + 1)),
                );
            }
        }
    }
    assert!(wide.is_empty(), "{wide:#?}");
}

/// The lines of a page outside of its code blocks.
fn prose(page: &str) -> impl Iterator<Item = &str> {
    page.split("```").step_by(2).flat_map(str::lines)
}

/// The anchors of a page: its headings as GitHub writes them.
fn anchors(page: &str) -> Names {
    let anchor = |heading: &str| -> String {
        let kept = |c: char| match c {
            ' ' => Some('-'),
            c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
            _ => None,
        };
        heading.to_lowercase().chars().filter_map(kept).collect()
    };
    let headings = prose(page).filter(|line| line.starts_with('#'));
    headings.map(|line| anchor(line.trim_start_matches('#').trim())).collect()
}

#[test]
fn links_between_documents_lead_somewhere() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut wrong = Vec::new();
    for folder in ["", "docs", "docs/errors", "crates", "examples", "tests/fuzz"] {
        for entry in std::fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|ending| ending != "md") {
                continue;
            }
            let page = std::fs::read_to_string(&path).unwrap();
            let targets = prose(&page).flat_map(|line| line.split("](").skip(1));
            for target in targets.filter_map(|rest| rest.split([')', ' ']).next()) {
                let (file, place) = target.split_once('#').unwrap_or((target, ""));
                let there = if file.is_empty() { path.clone() } else { root.join(folder).join(file) };
                let has_place =
                    || std::fs::read_to_string(&there).is_ok_and(|page| anchors(&page).contains(place));
                if !target.starts_with("http") && !(there.exists() && (place.is_empty() || has_place())) {
                    wrong.push(format!("{}: {target}", path.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
