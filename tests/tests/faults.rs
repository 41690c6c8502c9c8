//! Planted faults: each shader of `data/faults` loses its digits on the line that says `// guilty`. Is that
//! line blamed first, and is a repair found? `docs/faults.md` has the table; `UPDATE_DOCS=1` writes it.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

#[path = "faults/repairs.rs"]
mod repairs;

use osl::stages::{self, NoFiles, Options};
use osl_exec::Services;
use osl_limits::Limits;
use osl_measure::stability::fix::{self, Built, Changed, Repair};
use osl_measure::stability::{Base, Subject, examine_given};
use osl_scene::Grid;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What was found for a shader.
struct Row {
    kind: String,
    name: String,
    /// The place of the guilty line among the blamed ones, from 1; `None` if it is not among them.
    rank: Option<usize>,
    /// Whether it is the second one, and the first one names it as its partner.
    is_partner: bool,
    repair: Repair,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/faults")
}

fn row(path: &Path) -> Row {
    let text = std::fs::read_to_string(path).unwrap();
    let file = path.file_name().unwrap().to_string_lossy().into_owned();
    let (kind, name) = file.strip_suffix(".osl").unwrap().split_once('.').unwrap();
    let guilty = text.lines().position(|line| line.ends_with("// guilty")).unwrap() as u32 + 1;
    let build = |changed: &Changed<'_>| {
        let checked = stages::check(&file, changed.text, &NoFiles, &Options::default());
        let program = checked.program?;
        let plain = stages::lower(&program, &[]).ok()?;
        let noted = if changed.notes { Some(stages::lower_noted(&program, &[]).ok()?) } else { None };
        Some(Built { program, sources: checked.sources, plain, noted })
    };
    let built = build(&Changed { text: &text, notes: true, param: None })
        .unwrap_or_else(|| panic!("{file} does not compile"));
    let (services, limits) = (Services::default(), Limits::default());
    let subject =
        Subject::new(&services, Base::new(built.plain, built.noted.unwrap(), None, &limits), &limits);
    let grid = Grid::new(32, 32);
    let examined = examine_given(&subject, &grid, 0.01, &built.sources, name);
    let culprits = &examined.report.culprits;
    let rank = culprits.iter().position(|culprit| culprit.line == guilty).map(|at| at + 1);
    let is_partner = rank == Some(2)
        && culprits.iter().take(1).any(|first| {
            [&first.magnifies, &first.magnified_by].into_iter().flatten().any(|other| other.line == guilty)
        });
    let repair = fix::repair(&subject, &grid, &examined, &[], (&text, &built.program), &build);
    if let Some(text) = &repair.text {
        assert!(
            build(&Changed::plain(text)).is_some(),
            "{file}: the repaired source does not compile:\n{text}"
        );
    }
    Row { kind: kind.replace('_', " "), name: name.to_string(), rank, is_partner, repair }
}

fn rows() -> Vec<Row> {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.par_iter().map(|path| row(path)).collect()
}

/// A number with two digits.
fn short(x: f64) -> String {
    format!("{x:.1e}").replace("e0", "")
}

fn table(rows: &[Row]) -> String {
    let mut out = String::from(
        "| kind | shader | rank of the guilty line | repair | error before | error after | cost |\n",
    );
    out += "|---|---|---|---|---|---|---|\n";
    for Row { kind, name, rank, is_partner, repair } in rows {
        let rank = rank.map_or_else(|| "–".to_string(), |rank| rank.to_string());
        let rank = if *is_partner { format!("{rank}, named") } else { rank };
        let before = repair.before.map_or_else(String::new, |e| short(e.largest));
        let names: Vec<&str> = repair.steps.iter().map(|step| step.name.as_str()).collect();
        let (what, after, cost) = match (repair.steps.last(), &repair.dear) {
            (Some(last), _) => (names.join(", "), short(last.errors.largest), format!("{:.2}", last.cost)),
            (None, Some(dear)) => {
                (format!("too dear: {}", dear.name), short(dear.errors.largest), format!("{:.2}", dear.cost))
            }
            (None, None) => ("none".to_string(), String::new(), String::new()),
        };
        let _ = writeln!(out, "| {kind} | {name} | {rank} | {what} | {before} | {after} | {cost} |");
    }
    let first = rows.iter().filter(|row| row.rank == Some(1)).count();
    let repaired = rows.iter().filter(|row| !row.repair.steps.is_empty()).count();
    let named = rows.iter().filter(|row| row.is_partner).count();
    let n = rows.len();
    let _ = writeln!(
        out,
        "\nThe guilty line is blamed first in {first} of {n}; in {named} more it is second and the first line's \
         explanation names it. A repair is found for {repaired} of {n}."
    );
    out
}

const BEGIN: &str = "<!-- planted faults: begin -->\n";
const END: &str = "<!-- planted faults: end -->\n";

#[test]
fn the_table_of_planted_faults_is_current() {
    let rows = rows();
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    for row in &rows {
        *kinds.entry(&row.kind).or_default() += 1;
    }
    assert!(rows.len() >= 40 && kinds.len() >= 12, "{kinds:?}");
    let table = table(&rows);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/faults.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (head, rest) = page.split_once(BEGIN).unwrap();
    let (held, tail) = rest.split_once(END).unwrap();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, format!("{head}{BEGIN}{table}{END}{tail}")).unwrap();
        return;
    }
    assert!(held == table, "docs/faults.md is not current: run this test with UPDATE_DOCS=1\n{table}");
}
