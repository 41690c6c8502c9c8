//! `--profile`: the time spent in each instruction and source line, also as a flame graph.

use super::Failure;
use osl_exec::ProfileEntry;
use osl_ir::Span;
use osl_syntax::escape::shown;
use osl_syntax::source::SourceMap;
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

/// Prints the tables.
pub(super) fn print(profile: &[ProfileEntry], sources: &SourceMap, err: &mut dyn Write) {
    let total: Duration = profile.iter().map(|e| e.own).sum();
    table("instruction", by(profile, |e| e.name.clone()), total, err);
    table("line", by(profile, |e| line(e.span, sources)), total, err);
}

fn by(profile: &[ProfileEntry], key: impl Fn(&ProfileEntry) -> String) -> Vec<(String, Sum)> {
    let mut sums: BTreeMap<String, Sum> = BTreeMap::new();
    let ran = profile.iter().filter(|entry| entry.runs > 0);
    ran.for_each(|entry| sums.entry(key(entry)).or_default().add(entry));
    let mut rows: Vec<(String, Sum)> = sums.into_iter().collect();
    rows.sort_by_key(|(_, sum)| std::cmp::Reverse(sum.own));
    rows
}

fn table(what: &str, rows: Vec<(String, Sum)>, total: Duration, err: &mut dyn Write) {
    let width = rows.iter().take(ROWS).map(|(key, _)| key.chars().count()).max().unwrap_or(0).max(what.len());
    let _ = writeln!(
        err,
        "{what:<width$} {:>6} {:>10} {:>10} {:>10} {:>8}",
        "share", "ms", "runs", "lanes/run", "ns/lane"
    );
    for (key, sum) in rows.iter().take(ROWS) {
        let seconds = sum.own.as_secs_f64();
        let share = 100.0 * seconds / total.as_secs_f64().max(1e-12);
        let lanes = sum.lanes as f64;
        let _ = writeln!(
            err,
            "{key:<width$} {share:>5.1}% {:>10.3} {:>10} {:>10.1} {:>8.2}",
            seconds * 1e3,
            sum.runs,
            lanes / sum.runs.max(1) as f64,
            seconds * 1e9 / lanes.max(1.0)
        );
    }
    if let Some(more) = rows.len().checked_sub(ROWS).filter(|more| *more > 0) {
        let _ = writeln!(err, "({more} more)");
    }
    let _ = writeln!(err);
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
    osl_files::replace(path, &bytes).map_err(|e| failed(e.error.to_string()))
}
