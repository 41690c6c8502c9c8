//! The report as text. This module must not know how levels are found.

use super::report::{Level, Report, Row};
use super::words::{percent, samples};
use crate::explain::short;
use std::fmt::Write;

/// The report as text: the levels, and a table by footprint.
pub fn text(report: &Report) -> String {
    let mut out = String::new();
    if report.text.is_none() {
        let _ = writeln!(out, "{}: no simpler level up to footprint 256", report.name);
        for why in &report.why {
            let _ = writeln!(out, "  {why}");
        }
        return out;
    }
    let _ = writeln!(
        out,
        "{}: levels of detail by the width of a pixel in {}, which is {} at footprint 1",
        report.name,
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
        let _ = writeln!(out, "{edges} softer by a multiple of the width of a pixel");
    }
    for (at, level) in report.levels.iter().enumerate() {
        level_line(report, at, level, &mut out);
    }
    let most = report.rows.iter().map(|row| row.most).max().unwrap_or(0);
    let _ = writeln!(
        out,
        "\nErrors are root mean squares over pixels, of the worst output, as shares of its range, at points that were not \
         used to\nfind the levels, against {} of the original.\n",
        samples(report.reference_samples)
    );
    let _ = writeln!(
        out,
        "{:>9}  {:>17}  {:>14}  {:>16}  {:>11}  {:>10}  {:>12}",
        "footprint",
        "error of 1 sample",
        "with levels",
        "equal samples",
        "ns original",
        "ns levels",
        "times cheaper"
    );
    for row in &report.rows {
        row_line(row, &mut out);
    }
    let _ = writeln!(
        out,
        "\nEqual samples: the number with which the worst output of the original has the same error ({most}: so many or \
         more).\nTimes cheaper: the time of so many samples of the original, divided by the time of one sample with levels."
    );
    if report.cut_short {
        let _ = writeln!(out, "\nThe time was over (--budget) before everything was measured.");
    }
    out
}

fn level_line(report: &Report, at: usize, level: &Level, out: &mut String) {
    let all = level.replaces.len() == report.outputs.len() && at + 1 == report.levels.len();
    let what = if all && level.replaces == report.outputs {
        format!("all outputs are {}", level.form)
    } else {
        format!("{} replaced by {}", level.replaces.join(", "), level.form)
    };
    let _ = writeln!(
        out,
        "level {}, from width {} (fades in from {}): {what}; cost {} instead of {}; error at most {} %, of the original {} %",
        at + 1,
        short(level.widths[1], 3),
        short(level.widths[0], 3),
        short(level.cost, 3),
        short(report.cost, 3),
        short(100.0 * level.error, 2),
        short(100.0 * level.original_error, 2),
    );
}

fn row_line(row: &Row, out: &mut String) {
    let equal = if row.equal_samples >= f64::from(row.most) {
        format!("{} or more", row.most)
    } else {
        short(row.equal_samples, 2)
    };
    let time = |at: usize| row.ns.and_then(|ns| ns.get(at).copied()).map_or("-".into(), |ns| short(ns, 3));
    let cheaper = row.cheaper.map_or("-".into(), |times| short(times, 2));
    let _ = writeln!(
        out,
        "{:>9}  {:>17}  {:>14}  {:>16}  {:>11}  {:>10}  {:>12}",
        row.footprint,
        percent(row.original.worst),
        percent(row.written.worst),
        equal,
        time(0),
        time(1),
        cheaper
    );
}
