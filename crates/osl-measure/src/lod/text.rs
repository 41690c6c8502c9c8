//! The report as text.

use super::SHOWN;
use super::report::{Report, Row};
use super::words::{percent, samples};
use crate::words::{plain, short};
use std::fmt::Write;

/// The report as text: the levels, and a table by footprint.
pub fn text(report: &Report) -> String {
    let Parts { mut before, rows, after } = parts(report);
    for row in rows {
        let [a, b, c, d, e, f, g] = row;
        let _ = writeln!(before, "{a:>9}  {b:>17}  {c:>14}  {d:>16}  {e:>11}  {f:>10}  {g:>12}");
    }
    before + &after
}

/// The parts of the report: sentences, the rows of the table with their titles first, and sentences.
pub(super) struct Parts {
    pub(super) before: String,
    pub(super) rows: Vec<[String; 7]>,
    pub(super) after: String,
}

const TITLES: [&str; 7] = [
    "footprint",
    "error of 1 sample",
    "with levels",
    "equal samples",
    "ns original",
    "ns levels",
    "times cheaper",
];

pub(super) fn parts(report: &Report) -> Parts {
    let mut out = String::new();
    if report.text.is_none() {
        let _ = writeln!(out, "{}: no simpler level up to footprint 256", report.name);
        why_lines(report, &mut out);
        return Parts { before: out, rows: Vec::new(), after: String::new() };
    }
    let _ = writeln!(
        out,
        "{}: levels of detail by {} of a pixel in {}, which is {} at footprint 1",
        report.name,
        report.by.name(),
        report.coordinate,
        short(report.width, 3)
    );
    let _ = writeln!(out);
    if report.faded_noise > 0 {
        let start = report.noise_width;
        let calls = if report.faded_noise == 1 {
            "one call".to_string()
        } else {
            format!("{} calls", report.faded_noise)
        };
        let _ = writeln!(
            out,
            "{calls} of noise: fades to its mean where a pixel is more than {start} of its cells wide"
        );
    }
    if report.soft_edges > 0 {
        let edges = if report.soft_edges == 1 {
            "one edge becomes".to_string()
        } else {
            format!("{} edges become", report.soft_edges)
        };
        let _ = writeln!(out, "{edges} softer by a multiple of this size");
    }
    match &report.level {
        Some(level) => {
            let _ = writeln!(
                out,
                "from size {} on (fades in from {}), all outputs are their means; cost {} instead of {}; error at most {}, \
                 of the original {}",
                short(level.widths[1], 3),
                short(level.widths[0], 3),
                plain(level.cost, 3),
                plain(report.cost, 3),
                percent(level.error),
                percent(level.original_error),
            );
        }
        None => {
            let _ = writeln!(out, "the body runs at every size:");
            why_lines(report, &mut out);
        }
    }
    let _ = write!(out, "{}", above(report));
    let most = report.rows.iter().map(|row| row.most).max().unwrap_or(0);
    let _ = writeln!(
        out,
        "\nErrors are root mean squares over pixels, of the worst output, as shares of its range.\nThey are measured at points that \
         were not used to find the levels, against {} of the original.\n",
        samples(report.reference_samples)
    );
    let mut rows = vec![TITLES.map(str::to_string)];
    rows.extend(report.rows.iter().map(cells));
    let mut after = format!(
        "\nEqual samples: the number with which the worst output of the original has the same error ({most}: so many or \
         more).\nTimes cheaper: the time of so many samples of the original, divided by the time of one sample with levels.\n"
    );
    if report.cut_short {
        let _ = writeln!(after, "\nThe time was over (--budget) before {}.", missing(report));
    }
    Parts { before: out, rows, after }
}

/// What was not measured because the time was over.
fn missing(report: &Report) -> String {
    let row = |footprint: f64| report.rows.iter().find(|row| row.footprint == footprint);
    let without = |is_missing: &dyn Fn(f64) -> bool| {
        let list: Vec<String> = SHOWN.into_iter().filter(|f| is_missing(*f)).map(|f| f.to_string()).collect();
        (!list.is_empty()).then(|| list.join(", "))
    };
    let errors = without(&|footprint| row(footprint).is_none());
    let times = without(&|footprint| row(footprint).is_some_and(|row| row.ns.is_none()));
    let mut parts: Vec<String> = Vec::new();
    parts.extend(errors.map(|list| format!("the errors and times at footprint {list}")));
    parts.extend(times.map(|list| format!("the times at footprint {list}")));
    match parts.is_empty() {
        true => "all pictures were made".to_string(),
        false => format!("these were measured: {}", parts.join("; ")),
    }
}

fn why_lines(report: &Report, out: &mut String) {
    for why in &report.why {
        let _ = writeln!(out, "  {why}");
    }
}

/// Says where nothing satisfies the bound, and what runs there.
fn above(report: &Report) -> String {
    let rows = report.rows.iter().filter(|row| row.written.worst > report.error);
    let list: Vec<String> = rows.map(|row| row.footprint.to_string()).collect();
    if list.is_empty() {
        return String::new();
    }
    let form = match report.faded_noise + report.soft_edges {
        0 => "the original runs",
        _ => "the original with what becomes softer runs",
    };
    let at = list.join(", ");
    format!(
        "at footprint {at} no form has an error of at most {} (--error): {form} there\n",
        percent(report.error)
    )
}

fn cells(row: &Row) -> [String; 7] {
    let equal = if row.equal_samples >= f64::from(row.most) {
        format!("{} or more", row.most)
    } else {
        plain(row.equal_samples, 2)
    };
    let time = |at: usize| row.ns.and_then(|ns| ns.get(at).copied()).map_or("-".into(), |ns| plain(ns, 3));
    [
        row.footprint.to_string(),
        percent(row.original.worst),
        percent(row.written.worst),
        equal,
        time(0),
        time(1),
        row.cheaper.map_or("-".into(), |times| plain(times, 2)),
    ]
}
