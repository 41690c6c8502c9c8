//! What is printed about a run: the range of each output, times and rates. This module must not know how it
//! ran.

use super::args::RunArgs;
use osl::stages::Compiled;
use osl_exec::{Frame, Isa};
use std::io::Write;
use std::time::Duration;

/// The summary of a run without an image: the range of each output, so that a first run shows something.
pub(super) fn summary(frame: &Frame, out: &mut dyn Write) {
    for plane in &frame.planes {
        let values = plane.floats();
        let (low, high) =
            values.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len().max(1) as f64;
        let _ = writeln!(out, "{}[{}]: {low} to {high}, mean {mean:.6}", plane.output, plane.component);
    }
    let _ = writeln!(out, "(no image written: name one with -o)");
}

/// Times, rates, and what each pass did.
pub(super) fn stats(
    compiled: &Compiled,
    lowered: usize,
    points: u64,
    times: [Duration; 3],
    args: &RunArgs,
    err: &mut dyn Write,
) {
    let [compile, run, write] = times.map(|t| t.as_secs_f64() * 1e3);
    let isa = args.isa.unwrap_or_else(Isa::detect);
    let (registers, words) = compiled.program.register_words();
    let _ = writeln!(err, "compile {compile:.2} ms, run {run:.2} ms, write {write:.2} ms");
    let rate = points as f64 / (run / 1e3).max(1e-9);
    let per_point = run * 1e6 / points.max(1) as f64;
    let _ = writeln!(
        err,
        "{points} points, {rate:.0} points/s, {per_point:.1} ns/point ({isa:?}, batches of {})",
        args.batch.map_or_else(|| compiled.program.batch(), |n| n as usize)
    );
    if let Some(peak) = peak_memory() {
        let _ = writeln!(err, "peak memory {:.0} MB", peak as f64 / 1e6);
    }
    let _ =
        writeln!(err, "{lowered} instructions lowered, {registers} lane registers of {words} words in all");
    for report in &compiled.reports {
        let _ = writeln!(err, "  {:<8} {:>6} -> {}", report.pass.name(), report.before, report.after);
    }
}

/// The peak memory of the process in bytes, if the system provides it.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}
