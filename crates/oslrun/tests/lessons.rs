//! Every diagnostic has a correct lesson: its wrong example produces the code, its right one compiles without
//! it. The table of all codes in the docs is generated from the same list.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

mod slips;

use osl::lessons::{self, Lesson};
use osl::stages;
use osl_hir::lint::{self, Level};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::source::SourceProvider;
use osl_syntax::{NoFiles, Options};
use slips::Verdict;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// Codes that no text of a sensible length can produce, with the reason. Their lessons say so.
const UNREACHABLE: &[(&str, &str)] = &[
    ("E0017", "the sources would have to hold 4 GiB"),
    ("E0208", "the text would have to hold 257 functions of one name"),
    ("E0311", "the parser refuses such targets first, as E0114"),
    ("W0006", "the examples are UTF-8"),
];

/// Smaller limits for short examples; the real limits would need pages of text.
fn limits(code: &str) -> Options {
    let mut options = Options::default();
    match code {
        "E0015" | "E0113" => options.limits.reading.nesting = 12,
        "E0016" => options.limits.reading.tokens = 60,
        "E0120" => options.limits.reading.diagnostics = 6,
        _ => {}
    }
    options
}

/// Finds only one file to include: the example itself.
struct Itself(&'static str);

impl SourceProvider for Itself {
    fn include(&self, name: &str, _: bool, _: &str) -> Result<(String, Arc<str>), String> {
        match name {
            "example.osl" => Ok((name.to_owned(), self.0.into())),
            _ => Err("no such file".to_owned()),
        }
    }
}

/// The shaders in the groups of the lessons.
struct Shaders;

impl stages::ShaderFiles for Shaders {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        let text = match shader {
            "ramp" => "shader ramp(float scale = 1, output float value = 0) { value = u * scale; }",
            "paint" => "shader paint(float amount = 0, output color c = 0) { c = amount; }",
            _ => return Err("no such file".to_owned()),
        };
        Ok((format!("{shader}.osl"), text.to_owned()))
    }

    fn includes(&self) -> &dyn SourceProvider {
        &NoFiles
    }
}

/// All diagnostics of all stages for a source, as a list and as text.
fn said(text: &'static str, options: &Options) -> (Vec<Diagnostic>, String) {
    if ["param ", "shader "].iter().any(|s| text.starts_with(s)) && !text.contains('{') {
        let checked = stages::check_group("example.group", text, "example", &Shaders, options);
        let rendered = render(&checked.diagnostics, &checked.sources, RenderStyle::default());
        return (checked.diagnostics, rendered);
    }
    // Lessons about compiled shaders contain such a shader.
    let name =
        if text.trim_start().starts_with("OpenShadingLanguage") { "example.oso" } else { "example.osl" };
    let checked = stages::check(name, text, &Itself(text), options);
    let mut list = checked.diagnostics.clone();
    list.extend(stages::lint(&checked, &lint::Options::default()));
    if let Some(program) = &checked.program {
        list.extend(osl_lower::lower(program, &Default::default()).err().unwrap_or_default());
    }
    let rendered = render(&list, &checked.sources, RenderStyle::default());
    (list, rendered)
}

#[test]
fn every_code_has_a_lesson_and_every_lesson_a_code() {
    let codes: Vec<&str> = lessons::codes().iter().map(|c| c.id).collect();
    let taught: Vec<&str> = lessons::all().iter().map(|l| l.code).collect();
    assert_eq!(codes, taught);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/errors");
    let mut files: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    files.sort();
    assert_eq!(files, taught);
}

/// Every quoted code in the sources below a folder, except for the list of the lessons' files.
fn quoted_codes(folder: &Path, found: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        if entry.ends_with("oslrun/src/lessons") {
            continue;
        }
        if entry.is_dir() {
            quoted_codes(&entry, found);
        } else if entry.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&entry).unwrap();
            found.extend(text.split('"').filter(|part| is_code(part)).map(str::to_owned));
        }
    }
}

fn is_code(text: &str) -> bool {
    let digits = text.strip_prefix(['E', 'W']).unwrap_or_default();
    digits.len() == 4 && digits.bytes().all(|b| b.is_ascii_digit())
}

/// The lists of codes may themselves be incomplete.
#[test]
fn no_source_knows_another_code() {
    let mut found = BTreeSet::new();
    for folder in ["osl-syntax", "osl-ir", "osl-hir", "osl-lower", "osl-exec", "osl-scene", "oslrun"] {
        quoted_codes(&Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(folder).join("src"), &mut found);
    }
    let codes: BTreeSet<String> = lessons::codes().iter().map(|c| c.id.to_owned()).collect();
    assert_eq!(found, codes);
}

#[test]
fn a_wrong_example_earns_its_code() {
    for lesson in lessons::all() {
        if UNREACHABLE.iter().any(|(code, _)| *code == lesson.code) {
            continue;
        }
        let (list, text) = said(lesson.wrong, &limits(lesson.code));
        assert!(list.iter().any(|d| d.code.id == lesson.code), "{}\n{}\n{text}", lesson.code, lesson.wrong);
    }
}

#[test]
fn the_unreachable_are_unreachable() {
    for (code, reason) in UNREACHABLE {
        let lesson = lessons::find(code)[0];
        let (list, text) = said(lesson.wrong, &limits(code));
        assert!(list.iter().all(|d| d.code.id != *code), "{code} can be reached ({reason}?)\n{text}");
    }
}

#[test]
fn a_right_example_is_right() {
    for lesson in lessons::all() {
        let (list, text) = said(lesson.right, &Options::default());
        let fine = list.iter().all(|d| !d.is_error() && d.code.id != lesson.code);
        assert!(fine, "{}\n{}\n{text}", lesson.code, lesson.right);
        // A recommended text should have no diagnostics at all.
        assert!(list.is_empty(), "{}\n{}\n{text}", lesson.code, lesson.right);
    }
}

#[test]
fn a_lesson_is_short_and_whole() {
    for Lesson { code, title, rule, wrong, right, text } in lessons::all() {
        assert!((4..=60).contains(&title.len()) && !title.ends_with('.'), "{code}: {title}");
        assert!((40..=700).contains(&rule.len()) && rule.ends_with(['.', ')']), "{code}: {rule}");
        assert!(wrong != right && text.lines().all(|line| line.chars().count() <= 120), "{code}");
    }
}

/// Checks `docs/diagnostics.md`. To update it: `UPDATE_DOCS=1 cargo test -p oslrun --test lessons`.
#[test]
fn the_table_in_the_docs_is_current() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/diagnostics.md");
    let table = table();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &table).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == table, "docs/diagnostics.md is out of date: run with UPDATE_DOCS=1");
}

/// At least 55 of 60 slips of beginners are answered right, and no edit misleads.
#[test]
fn slips_of_beginners_are_answered() {
    let mut wrong = Vec::new();
    let slips = slips::slips();
    for slip in &slips {
        let judged = slip.judge();
        assert_ne!(judged.verdict, Verdict::Misleading, "{}\n{}\n{}", slip.title, slip.text, judged.said);
        if judged.verdict != Verdict::Right {
            wrong.push(format!("{}\n{}\n{}", slip.title, slip.text, judged.said));
        }
    }
    assert!(slips.len() >= 60 && wrong.len() * 60 <= 5 * slips.len(), "{}", wrong.join("\n"));
}

fn table() -> String {
    let mut out = String::from(include_str!("diagnostics_head.md"));
    for code in lessons::codes() {
        let lesson = lessons::find(code.id)[0];
        let kind = match (lint::find(code).map(|l| l.level), &code.id[..1]) {
            (Some(Level::Always), _) => "lint",
            (Some(Level::Check), _) => "lint of `check`",
            (None, "E") => "error",
            (None, _) => "warning",
        };
        out += &format!(
            "| [{id}](errors/{id}.md) | {} | {kind} | {} |\n",
            code.name,
            lesson.title,
            id = code.id
        );
    }
    out += include_str!("diagnostics_slips.md");
    out += &slips::table();
    out + include_str!("diagnostics_counts.md")
}
