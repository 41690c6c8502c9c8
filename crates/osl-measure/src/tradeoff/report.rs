//! A trade-off as text, and as comma-separated values.

use super::advice::{HINT, advice, listed, shared, short};
use super::{Output, Trade};
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
        let _ = write!(out, "\n{}{table}", listed(&outputs));
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
    let _ = writeln!(
        out,
        "  {:<width$} {:>10} {:>7} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}",
        "setting",
        "ns/pixel",
        "spread",
        "speed-up",
        "samples",
        "rms",
        "of range",
        "99.9 %",
        "of range",
        "largest"
    );
    for (at, (row, name)) in trade.rows.iter().zip(names).enumerate() {
        let star = if output.front.contains(&at) { '*' } else { ' ' };
        let Some(error) = output.errors.get(at) else { continue };
        let _ = writeln!(
            out,
            "{star} {name:<width$} {:>10.1} {:>6.0}% {:>8.2}x {:>9.3} {:>9.1e} {:>7.2} % {:>9.1e} {:>7.2} % {:>9.1e}",
            row.ns_per_pixel,
            100.0 * row.spread,
            row.speed_up,
            row.evaluations,
            error.rms,
            100.0 * error.rms / output.range,
            error.nearly_all,
            100.0 * error.nearly_all / output.range,
            error.largest
        );
    }
    out
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
