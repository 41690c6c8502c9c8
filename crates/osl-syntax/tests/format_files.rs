//! Real files: formatting keeps their meaning, and formatting again changes nothing, whatever the original
//! white space.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what must hold")]

#[allow(dead_code, reason = "each test file uses its part")]
mod common;

use common::{lenient, squeezed};
use osl_syntax::format::format;
use osl_syntax::print;
use proptest::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Every shader file below a folder, in order of its path.
fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| e == "osl") {
            found.push(path);
        }
    }
}

/// The valid shader files of the repository, with their texts. They are read once, since parsing all of them
/// takes longer than the tests.
fn texts() -> &'static [(String, String)] {
    static TEXTS: LazyLock<Vec<(String, String)>> = LazyLock::new(read_texts);
    &TEXTS
}

fn read_texts() -> Vec<(String, String)> {
    let mut found = Vec::new();
    for folder in ["osl", "tests", "crates/osl-syntax/tests/data/format"] {
        files(&Path::new(ROOT).join(folder), &mut found);
    }
    let texts = found.iter().map(|p| (p.display().to_string(), std::fs::read_to_string(p).unwrap()));
    // Formatting changes line numbers.
    texts.filter(|(_, text)| !text.contains("__LINE__") && !lenient(text).has_errors()).collect()
}

fn tree(text: &str) -> String {
    let parsed = lenient(text);
    assert!(!parsed.has_errors(), "{text}\n{:#?}", parsed.diagnostics);
    print::ast(&parsed.ast)
}

/// Formats, and checks that the meaning is the same and that formatting again changes nothing.
fn check(name: &str, text: &str) -> String {
    let once = format(name, text).unwrap_or_else(|d| panic!("{name}: {d:#?}\n{text}"));
    assert_eq!(squeezed(&once), squeezed(text), "{name}\n{text}");
    assert_eq!(tree(&once), tree(text), "{name}\n{text}");
    assert_eq!(format(name, &once).unwrap(), once, "{name}\n{text}");
    assert!(once.ends_with('\n') && !once.ends_with("\n\n"), "{name}");
    once
}

#[test]
fn real_files_mean_the_same_and_stay() {
    let texts = texts();
    assert!(texts.len() > 40, "{}", texts.len());
    for (name, text) in texts {
        let once = check(name, text);
        let code = |line: &&str| !line.contains("//") && line.chars().count() > osl_syntax::format::WIDTH;
        for line in once.lines().filter(code) {
            // A long string cannot be broken.
            let longest = line.split('"').map(str::len).max().unwrap_or(0);
            assert!(line.contains("[[") || longest > 40, "{name}: {line}");
        }
    }
}

/// Text that may separate two tokens without changing their meaning.
const GAPS: [&str; 14] = [
    " ",
    "  \t ",
    "\n",
    "\n\n\n",
    "\r\n",
    " /* c */ ",
    "\n/* c */\n",
    " /* c\n   d */ ",
    " // c \"\n",
    "\n\n// c\n\n",
    " \\\n ",
    "\n#pragma p  \\\n q\n",
    "\n#if 0\n don't {( \"\n#endif\n",
    "\n#ifdef NO\n#else\n#endif\n",
];

/// The starts of the tokens of a text, except those in directives and macros.
fn places(text: &str) -> Vec<usize> {
    let parsed = lenient(text);
    let mut starts: Vec<usize> = parsed.tokens.iter().map(|(_, s)| s.start as usize).collect();
    starts.retain(|s| *s < text.len());
    starts.sort_unstable();
    starts.dedup();
    starts
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn however_it_was_spaced(
        file in any::<prop::sample::Index>(),
        gaps in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(&GAPS[..])), 0..40),
    ) {
        let texts: Vec<_> = texts().iter().filter(|(_, t)| !t.contains("#define")).collect();
        let (name, text) = *file.get(&texts);
        let places = places(text);
        let mut gaps: Vec<(usize, &str)> = gaps.iter().map(|(at, gap)| (*at.get(&places), *gap)).collect();
        gaps.sort_by_key(|(at, _)| *at);
        gaps.dedup_by_key(|(at, _)| *at);
        let mut spaced = text.clone();
        for (at, gap) in gaps.iter().rev() {
            spaced.insert_str(*at, gap);
        }
        // A comment with a quote after a broken string makes a different program.
        prop_assume!(!lenient(&spaced).has_errors());
        check(name, &spaced);
    }
}
