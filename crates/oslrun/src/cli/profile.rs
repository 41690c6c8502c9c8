//! `--profile`: the time spent in each instruction and source line, also as a flame graph.

use super::Failure;
use osl_exec::ProfileEntry;
use osl_ir::Span;
use osl_syntax::escape::shown;
use osl_syntax::source::SourceMap;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::time::Duration;

/// Maximum number of rows of each table.
const ROWS: usize = 20;

/// The sum of the entries of a row.
#[derive(Clone, Copy, Default)]
struct Sum {
    runs: u64,
    lanes: u64,
    own: Duration,
}

impl Sum {
    fn add(&mut self, entry: &ProfileEntry) {
        self.runs += entry.runs;
        self.lanes += entry.lanes;
        self.own += entry.own;
    }
}

/// The tables of a profile.
#[derive(Debug, Serialize)]
pub(super) struct Tables {
    instructions: Vec<Row>,
    lines: Vec<Row>,
}

/// An instruction or a line.
#[derive(Debug, Serialize)]
struct Row {
    name: String,
    /// The text of the line.
    #[serde(skip_serializing_if = "Option::is_none")]
    source: Option<String>,
    /// The share of the time, from 0 to 1.
    share: f64,
    ms: f64,
    runs: u64,
    lanes_per_run: f64,
    ns_per_lane: f64,
}

impl Row {
    fn of((name, sum): (String, Sum), total: Duration) -> Row {
        let (seconds, lanes) = (sum.own.as_secs_f64(), sum.lanes as f64);
        Row {
            name,
            source: None,
            share: seconds / total.as_secs_f64().max(1e-12),
            ms: seconds * 1e3,
            runs: sum.runs,
            lanes_per_run: lanes / sum.runs.max(1) as f64,
            ns_per_lane: seconds * 1e9 / lanes.max(1.0),
        }
    }
}

/// The tables: by instruction, and by line with its text.
pub(super) fn tables(profile: &[ProfileEntry], sources: &SourceMap) -> Tables {
    let total: Duration = profile.iter().map(|e| e.own).sum();
    let rows =
        |sums: Vec<(String, Sum)>| sums.into_iter().map(|sum| Row::of(sum, total)).collect::<Vec<Row>>();
    let mut lines = rows(by(profile, |e| line(e.span, sources)));
    for row in &mut lines {
        let entry = profile.iter().find(|e| line(e.span, sources) == row.name);
        row.source = entry.and_then(|e| text(e.span, sources));
    }
    Tables { instructions: rows(by(profile, |e| e.name.clone())), lines }
}

/// Prints the most expensive lines in a sentence each, then the tables.
pub(super) fn print(profile: &[ProfileEntry], sources: &SourceMap, err: &mut dyn Write) {
    let tables = tables(profile, sources);
    ranking(&tables.lines, err);
    table("instruction", &tables.instructions, err);
    table("line", &tables.lines, err);
}

/// Words for the first places.
const PLACES: [&str; 3] = ["Most", "Second", "Third"];
/// A line with a smaller share is not worth a sentence.
const WORTH: f64 = 0.05;

/// The lines that cost most, in words.
fn ranking(lines: &[Row], err: &mut dyn Write) {
    let worth: Vec<&Row> = lines.iter().filter(|row| row.source.is_some() && row.share >= WORTH).collect();
    for (place, row) in PLACES.iter().zip(&worth) {
        let text = shown(row.source.as_deref().unwrap_or_default()).into_owned();
        let share = 100.0 * row.share;
        let _ = match *place {
            "Most" => writeln!(err, "Most of the time goes to {}, {share:.0} %:  {text}", row.name),
            place => writeln!(err, "{place} is {}, {share:.0} %:  {text}", row.name),
        };
    }
    if !worth.is_empty() {
        let _ = writeln!(err);
    }
}

fn by(profile: &[ProfileEntry], key: impl Fn(&ProfileEntry) -> String) -> Vec<(String, Sum)> {
    let mut sums: BTreeMap<String, Sum> = BTreeMap::new();
    let ran = profile.iter().filter(|entry| entry.runs > 0);
    ran.for_each(|entry| sums.entry(key(entry)).or_default().add(entry));
    let mut rows: Vec<(String, Sum)> = sums.into_iter().collect();
    rows.sort_by_key(|(_, sum)| std::cmp::Reverse(sum.own));
    rows
}

fn table(what: &str, rows: &[Row], err: &mut dyn Write) {
    let width = rows.iter().take(ROWS).map(|row| row.name.chars().count()).max().unwrap_or(0).max(what.len());
    let has_text = rows.iter().any(|row| row.source.is_some());
    let _ = writeln!(
        err,
        "{what:<width$} {:>6} {:>10} {:>10} {:>10} {:>8}{}",
        "share",
        "ms",
        "runs",
        "lanes/run",
        "ns/lane",
        if has_text { "  source" } else { "" }
    );
    for row in rows.iter().take(ROWS) {
        let Row { name, source, share, ms, runs, lanes_per_run, ns_per_lane } = row;
        let source = source.as_ref().map_or_else(String::new, |text| format!("  {}", shown(text)));
        let _ = writeln!(
            err,
            "{name:<width$} {:>5.1}% {ms:>10.3} {runs:>10} {lanes_per_run:>10.1} {ns_per_lane:>8.2}{source}",
            100.0 * share,
        );
    }
    if let Some(more) = rows.len().checked_sub(ROWS).filter(|more| *more > 0) {
        let _ = writeln!(err, "({more} more)");
    }
    let _ = writeln!(err);
}

/// The text of a line, without the blanks around it.
fn text(span: Span, sources: &SourceMap) -> Option<String> {
    let file = sources.file_at(span.start)?;
    let at = (span.start - file.base) as usize;
    let start = file.text.get(..at)?.rfind('\n').map_or(0, |end| end + 1);
    let line = file.text.get(start..)?.lines().next()?.trim();
    (!line.is_empty()).then(|| line.to_string())
}

fn line(span: Span, sources: &SourceMap) -> String {
    let place = |p: osl_syntax::source::Position| format!("{}:{}", shown(&p.file), p.line);
    sources.place(span).map_or_else(|| "no line".to_string(), place)
}

/// Writes a flame graph: an image if the file is named `.svg`, else its folded stacks. The frames are the
/// branches and loops around an instruction, then its line, then its operation; widths are nanoseconds.
pub(super) fn write(
    profile: &[ProfileEntry],
    shader: &str,
    sources: &SourceMap,
    path: &Path,
) -> Result<(), Failure> {
    let plain = |text: &str| shown(text).replace([';', ' ', '\n', '\t'], "_");
    let mut folded: BTreeMap<String, u128> = BTreeMap::new();
    for entry in profile.iter().filter(|entry| entry.runs > 0) {
        let mut stack = vec![plain(shader)];
        stack.extend(
            entry.around.iter().map(|(name, span)| plain(&format!("{name} {}", line(*span, sources)))),
        );
        stack.push(plain(&line(entry.span, sources)));
        stack.push(plain(&entry.name));
        *folded.entry(stack.join(";")).or_default() += entry.own.as_nanos();
    }
    let lines: Vec<String> = folded.iter().map(|(stack, nanos)| format!("{stack} {nanos}")).collect();
    let failed = |e: String| Failure::new(format!("cannot write {}: {e}", path.display()));
    let bytes = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("svg")) {
        let mut options = inferno::flamegraph::Options::default();
        options.title = format!("Time of {shader}");
        options.count_name = "ns".to_string();
        let mut image = Vec::new();
        inferno::flamegraph::from_lines(&mut options, lines.iter().map(String::as_str), &mut image)
            .map_err(|e| failed(e.to_string()))?;
        image
    } else {
        (lines.join("\n") + "\n").into_bytes()
    };
    osl_files::replace(path, &bytes).map_err(|e| failed(e.error.reason()))
}
