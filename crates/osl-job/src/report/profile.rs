//! `--profile`: the time spent in each instruction and source line, also as a flame graph.

use crate::Failure;
use osl_exec::ProfileEntry;
use osl_ir::Span;
use osl_syntax::escape::shown;
use osl_syntax::source::SourceMap;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

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
pub struct Tables {
    /// The number of runs; each time is the least of them.
    rounds: usize,
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

/// The clock of a profile: the processor time of the calling thread, which other processes do not lengthen.
#[cfg(unix)]
pub const CLOCK: fn() -> Duration = || {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec as u32)
};
#[cfg(not(unix))]
pub const CLOCK: fn() -> Duration = || {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    START.get_or_init(Instant::now).elapsed()
};

/// The number of times that a profiled shader runs, unless this takes too long.
const ROUNDS: usize = 5;
/// After so long, no further round begins.
const LONG: Duration = Duration::from_secs(10);

/// The profiles of several runs, whose times are compared; the first has been made.
pub fn rounds(
    first: &[ProfileEntry],
    mut again: impl FnMut() -> Result<Vec<ProfileEntry>, Failure>,
) -> Result<Vec<Vec<ProfileEntry>>, Failure> {
    let started = Instant::now();
    let mut rounds = vec![first.to_vec()];
    while rounds.len() < ROUNDS && started.elapsed() < LONG {
        rounds.push(again()?);
    }
    Ok(rounds)
}

/// The profile with the least time of each instruction.
fn least(rounds: &[Vec<ProfileEntry>]) -> Vec<ProfileEntry> {
    let mut least = rounds.first().cloned().unwrap_or_default();
    for round in rounds {
        least.iter_mut().zip(round).for_each(|(least, entry)| least.own = least.own.min(entry.own));
    }
    least
}

/// The tables: by instruction, and by line with its text.
pub fn tables(rounds: &[Vec<ProfileEntry>], sources: &SourceMap) -> Tables {
    let profile = &least(rounds)[..];
    let total: Duration = profile.iter().map(|e| e.own).sum();
    let rows =
        |sums: Vec<(String, Sum)>| sums.into_iter().map(|sum| Row::of(sum, total)).collect::<Vec<Row>>();
    let mut lines = rows(by(profile, |e| line(e.span, sources)));
    for row in &mut lines {
        let entry = profile.iter().find(|e| line(e.span, sources) == row.name);
        row.source = entry.and_then(|e| text(e.span, sources));
    }
    Tables { rounds: rounds.len(), instructions: rows(by(profile, |e| e.name.clone())), lines }
}

/// Prints the most expensive lines in a sentence each, then the tables.
pub fn print(rounds: &[Vec<ProfileEntry>], sources: &SourceMap, out: &mut dyn Write) {
    let tables = tables(rounds, sources);
    let times: Vec<BTreeMap<String, Sum>> = rounds
        .iter()
        .map(|round| by(round, |entry| line(entry.span, sources)).into_iter().collect())
        .collect();
    ranking(&tables.lines, &times, out);
    let _ = writeln!(out, "processor time, the least of {} runs", tables.rounds);
    table("instruction", &tables.instructions, out);
    table("line", &tables.lines, out);
}

/// Words for the first places.
const PLACES: [&str; 3] = ["Most", "Second", "Third"];
/// A line with a smaller share is not worth a sentence.
const WORTH: f64 = 0.05;

/// The lines that cost most, in words. Where the runs disagree about the order of lines, these lines share a
/// place.
fn ranking(lines: &[Row], times: &[BTreeMap<String, Sum>], out: &mut dyn Write) {
    let worth: Vec<&Row> = lines.iter().filter(|row| row.source.is_some() && row.share >= WORTH).collect();
    let mut rest = &worth[..];
    for place in PLACES {
        let (group, after) = rest.split_at(together(rest, times));
        rest = after;
        let row = |row: &Row| {
            let text = shown(row.source.as_deref().unwrap_or_default()).into_owned();
            format!("{}, {:.0} %:  {text}", row.name, 100.0 * row.share)
        };
        let _ = match (group, place) {
            ([], _) => Ok(()),
            ([one], "Most") => writeln!(out, "Most of the time goes to {}", row(one)),
            ([one], _) => writeln!(out, "{place} is {}", row(one)),
            (several, _) => {
                let first = if place == "Most" { "Most of the time goes to" } else { place };
                let verb = if place == "Most" { "" } else { " are" };
                let _ = writeln!(out, "{first}{verb} these lines, which are equal within the noise:");
                several.iter().try_for_each(|one| writeln!(out, "  {}", row(one)))
            }
        };
    }
    if !worth.is_empty() {
        let _ = writeln!(out);
    }
}

/// The number of rows at the head of a list that share a place with the first: they are before it in more
/// than one run, since the first run is mostly slower than the others; of two runs, in one.
fn together(rows: &[&Row], times: &[BTreeMap<String, Sum>]) -> usize {
    let of =
        |time: &BTreeMap<String, Sum>, row: &Row| time.get(&row.name).map_or(Duration::ZERO, |sum| sum.own);
    let Some(first) = rows.first() else { return 0 };
    let is_near = |row: &&&Row| {
        let before = times.iter().filter(|time| of(time, row) >= of(time, first)).count();
        before >= times.len().min(3).div_ceil(2)
    };
    1 + rows.iter().skip(1).rposition(|row| is_near(&row)).map_or(0, |last| last + 1)
}

fn by(profile: &[ProfileEntry], key: impl Fn(&ProfileEntry) -> String) -> Vec<(String, Sum)> {
    let mut sums: BTreeMap<String, Sum> = BTreeMap::new();
    let ran = profile.iter().filter(|entry| entry.runs > 0);
    ran.for_each(|entry| sums.entry(key(entry)).or_default().add(entry));
    let mut rows: Vec<(String, Sum)> = sums.into_iter().collect();
    rows.sort_by_key(|(_, sum)| std::cmp::Reverse(sum.own));
    rows
}

fn table(what: &str, rows: &[Row], out: &mut dyn Write) {
    let width = rows.iter().take(ROWS).map(|row| row.name.chars().count()).max().unwrap_or(0).max(what.len());
    let has_text = rows.iter().any(|row| row.source.is_some());
    let _ = writeln!(
        out,
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
            out,
            "{name:<width$} {:>5.1}% {ms:>10.3} {runs:>10} {lanes_per_run:>10.1} {ns_per_lane:>8.2}{source}",
            100.0 * share,
        );
    }
    if let Some(more) = rows.len().checked_sub(ROWS).filter(|more| *more > 0) {
        let _ = writeln!(out, "({more} more)");
    }
    let _ = writeln!(out);
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
pub fn write(
    rounds: &[Vec<ProfileEntry>],
    shader: &str,
    sources: &SourceMap,
    path: &Path,
) -> Result<(), Failure> {
    let plain = |text: &str| shown(text).replace([';', ' ', '\n', '\t'], "_");
    let mut folded: BTreeMap<String, u128> = BTreeMap::new();
    for entry in least(rounds).iter().filter(|entry| entry.runs > 0) {
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;

    /// The ranking of lines with these times in each run.
    fn ranked(lines: &[(&str, &[u64])]) -> String {
        let runs = lines.first().map_or(0, |(_, times)| times.len());
        let sum = |ms: u64| Sum { runs: 1, lanes: 1, own: Duration::from_millis(ms) };
        let time =
            |run: usize| lines.iter().map(|(name, times)| ((*name).to_string(), sum(times[run]))).collect();
        let times: Vec<BTreeMap<String, Sum>> = (0..runs).map(time).collect();
        let least = |times: &[u64]| times.iter().copied().min().unwrap_or(0);
        let total = Duration::from_millis(lines.iter().map(|(_, times)| least(times)).sum());
        let row = |(name, times): &(&str, &[u64])| Row {
            source: Some("x".to_string()),
            ..Row::of(((*name).to_string(), sum(least(times))), total)
        };
        let mut rows: Vec<Row> = lines.iter().map(row).collect();
        rows.sort_by(|a, b| b.share.total_cmp(&a.share));
        let mut out = Vec::new();
        ranking(&rows, &times, &mut out);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn lines_are_named_where_the_runs_agree() {
        assert_eq!(
            ranked(&[("a:1", &[50, 60]), ("a:2", &[30, 31]), ("a:3", &[20, 29])]),
            "Most of the time goes to a:1, 50 %:  x\nSecond is a:2, 30 %:  x\nThird is a:3, 20 %:  x\n\n"
        );
        assert_eq!(
            ranked(&[("a:1", &[51, 60]), ("a:2", &[24, 31]), ("a:3", &[26, 25])]),
            "Most of the time goes to a:1, 51 %:  x\n\
             Second are these lines, which are equal within the noise:\n  a:3, 25 %:  x\n  a:2, 24 %:  x\n\n"
        );
        // The second is before the first in two of three runs; the third is once, which may be chance.
        assert_eq!(
            ranked(&[("a:1", &[40, 40, 40]), ("a:2", &[31, 41, 41]), ("a:3", &[29, 40, 29])]),
            "Most of the time goes to these lines, which are equal within the noise:\n\
             \x20 a:1, 40 %:  x\n  a:2, 31 %:  x\nSecond is a:3, 29 %:  x\n\n"
        );
    }
}
