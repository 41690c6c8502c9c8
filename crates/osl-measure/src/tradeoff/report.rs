//! A trade-off as text, and as comma-separated values.

use super::advice::{HINT, advice, shared, short};
use super::{Error, Output, Row, Trade};
use crate::words::listed;
use std::fmt::Write;

/// A table for each output, with a star at the rows of the front, and at the end what to take for an error.
pub fn text(trade: &Trade) -> String {
    let mut out = format!(
        "{}, {}x{} pixels; oracle: {}, {} samples a pixel; times: median of {} rounds\n",
        trade.name, trade.size.0, trade.size.1, trade.oracle, trade.oracle_samples, trade.repeats
    );
    let names: Vec<String> =
        trade.rows.iter().map(|row| format!("{}, {}", row.variant, row.setting)).collect();
    let width = names.iter().map(String::len).max().unwrap_or(0).max(8);
    let tables = trade.outputs.iter().map(|output| (table(trade, output, (&names, width)), &*output.name));
    for (table, outputs) in shared(tables) {
        let _ = write!(out, "\n{}{table}", listed(&outputs, "and"));
    }
    let _ = writeln!(out, "\n{HINT}:");
    out.push_str(&advice(trade));
    trade.idle.iter().for_each(|line| out.extend([line.as_str(), "\n"]));
    out
}

/// What follows the name of an output: its range, and a row for each setting.
fn table(trade: &Trade, output: &Output, (names, width): (&[String], usize)) -> String {
    let mut out = format!(
        ", range {} (the oracle's own standard error: {:.1e}, subtracted)\n",
        short(output.range),
        output.oracle_error
    );
    out += &line(' ', "setting", width, &TITLES.map(str::to_string));
    for (at, (row, name)) in trade.rows.iter().zip(names).enumerate() {
        let star = if output.front.contains(&at) { '*' } else { ' ' };
        let Some(error) = output.errors.get(at) else { continue };
        out += &line(star, name, width, &cells(row, error, output.range));
    }
    out
}

fn line(star: char, name: &str, width: usize, [ns, spread, rest @ ..]: &[String; 9]) -> String {
    let rest: String = rest.iter().map(|cell| format!(" {cell:>9}")).collect();
    format!("{star} {name:<width$} {ns:>10} {spread:>7}{rest}\n")
}

/// The titles of a row's cells.
pub(super) const TITLES: [&str; 9] =
    ["ns/pixel", "spread", "speed-up", "samples", "rms", "of range", "99.9 %", "of range", "largest"];

/// The numbers of a row, for an output with this range.
pub(super) fn cells(row: &Row, error: &Error, range: f64) -> [String; 9] {
    let share = |error: f64| format!("{:.2} %", 100.0 * error / range);
    [
        format!("{:.1}", row.ns_per_pixel),
        format!("{:.0}%", 100.0 * row.spread),
        format!("{:.2}x", row.speed_up),
        format!("{:.3}", row.evaluations),
        format!("{:.1e}", error.rms),
        share(error.rms),
        format!("{:.1e}", error.nearly_all),
        share(error.nearly_all),
        format!("{:.1e}", error.largest),
    ]
}

/// A line for each output and row.
pub fn csv(trade: &Trade) -> String {
    let mut out = String::from(
        "output,variant,setting,ns_per_pixel,spread,speed_up,evaluations,rms,nearly_all,largest,front,oracle_error,range\n",
    );
    for output in &trade.outputs {
        for (at, (row, error)) in trade.rows.iter().zip(&output.errors).enumerate() {
            let _ = writeln!(
                out,
                "{},{},{},{},{},{},{},{},{},{},{},{},{}",
                output.name,
                row.variant,
                row.setting,
                row.ns_per_pixel,
                row.spread,
                row.speed_up,
                row.evaluations,
                error.rms,
                error.nearly_all,
                error.largest,
                u8::from(output.front.contains(&at)),
                output.oracle_error,
                output.range
            );
        }
    }
    out
}
