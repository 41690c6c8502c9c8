//! A report as text.

use super::{Event, Report, Rounding};
use crate::words::percent;
use std::fmt::Write;

/// The text: each event with its line, how often it happens, and an example.
pub fn text(report: &Report) -> String {
    let mut out = String::new();
    let [width, height] = report.grid;
    let found = match report.events.len() {
        0 => "no numeric events".to_string(),
        1 => "numeric events at 1 place".to_string(),
        n => format!("numeric events at {n} places"),
    };
    let points = if report.points == 1 { "point" } else { "points" };
    let _ = writeln!(out, "{}: {found}, at {} {points} ({width}x{height})", report.shader, report.points);
    left_out(report.not_examined, report.cut, "examined", &mut out);
    for event in &report.events {
        one(event, report.points, &mut out);
    }
    if let Some(rounding) = &report.rounding {
        digits(rounding, &mut out);
    }
    out
}

/// What was not done with all points, in words.
fn left_out(not_done: usize, cut: usize, done: &str, out: &mut String) {
    if not_done > 0 {
        let _ = writeln!(
            out,
            "  the time was over (--budget) before {not_done} more points were {done}; which ones depends on the machine"
        );
    }
    if cut > 0 {
        let _ =
            writeln!(out, "  {cut} points were too long to be {done} to their end (--limit running.trace)");
    }
}

/// Places that are listed.
const LISTED: usize = 6;

/// The digits that random rounding leaves, and where the others are lost.
fn digits(rounding: &Rounding, out: &mut String) {
    let Rounding { runs, points, cut, not_examined, outputs, lines } = rounding;
    let _ = writeln!(out, "\nRandom rounding: digits in which {runs} runs agree, at {points} points");
    left_out(*not_examined, *cut, "followed", out);
    for output in outputs {
        let few = match output.few {
            0 => String::new(),
            n => format!("; at {n} points three digits or more are lost"),
        };
        let _ = writeln!(
            out,
            "  {}: {:.1} of 7.2 at 95 % of the points or more, {:.1} at the worst point{few}",
            output.name, output.usual, output.least
        );
    }
    for apart in lines.iter().take(LISTED) {
        let what = if apart.parts { "the runs part" } else { "digits fall apart" };
        let of = if apart.points == 1 { "point" } else { "points" };
        let (file, line) = (&apart.quote.file, apart.quote.line);
        let _ = writeln!(out, "\n{file}:{line}: {what} here at {} {of}", apart.points);
        apart.quote.write(out);
    }
    if lines.len() > LISTED {
        let _ = writeln!(out, "\n({} more places: --json lists them)", lines.len() - LISTED);
    }
}

fn one(event: &Event, of: usize, out: &mut String) {
    let [x, y] = event.first;
    let share = percent(event.share);
    let often =
        if event.times > event.points as u64 { format!(", {} times", event.times) } else { String::new() };
    let _ = writeln!(
        out,
        "\n{}:{}: {} at {} of {of} points ({share}{often}), first at pixel ({x}, {y})",
        event.quote.file,
        event.quote.line,
        event.kind.title(),
        event.points
    );
    event.quote.write(out);
    let margin = " ".repeat(event.quote.line.to_string().len());
    let _ = writeln!(out, "  {margin} = {}", event.example);
}
