//! What is printed about a run: its result as an object, times and rates. This module must not know how it
//! ran.

use super::args::RunArgs;
use super::histogram::Histogram;
use super::profile;
use super::ranges::{Output, Ranges};
use super::said::{self, Reached};
use super::shading::Tally;
use osl::stages::Compiled;
use osl_exec::Isa;
use osl_ir::passes::Report as PassReport;
use osl_numeric::Arithmetic;
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

/// The result of a run, for `--json`.
#[derive(Debug, Default, Serialize)]
pub(super) struct About {
    outputs: Vec<Output>,
    files: Vec<PathBuf>,
    errors: usize,
    warnings: usize,
    /// The text that the shader printed.
    pub(super) printed: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) stats: Option<Stats>,
    /// The bounds of `--max-error`, and whether the picture keeps them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) max_error: Option<said::Kept>,
    /// What the time of `--within` was enough for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) within: Option<Reached>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) histograms: Option<Vec<Histogram>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) profile: Option<profile::Tables>,
}

impl About {
    /// Adds what a run computed and wrote.
    pub(super) fn ran(&mut self, ranges: &Ranges, files: &[PathBuf], messages: Tally) {
        self.outputs = ranges.outputs();
        self.wrote(files, messages);
    }

    /// Adds which files a run wrote.
    pub(super) fn wrote(&mut self, files: &[PathBuf], messages: Tally) {
        self.files = files.to_vec();
        (self.errors, self.warnings) = (messages.errors, messages.warnings);
    }
}

/// What the fast arithmetic is worth for a program without an operation that it computes in another way.
pub(super) const SAME_IN_FAST: &str =
    "`--arithmetic fast` changes nothing here: the program has no operation that it computes in another way";

/// Times, rates, and what each pass did.
#[derive(Debug, Serialize)]
pub(super) struct Stats {
    compile_ms: f64,
    run_ms: f64,
    write_ms: f64,
    points: u64,
    points_per_second: f64,
    instruction_set: &'static str,
    batch: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    peak_memory_bytes: Option<u64>,
    instructions: usize,
    registers: usize,
    register_words: u32,
    passes: Vec<Pass>,
    /// If the fast arithmetic was asked for and changes nothing, a sentence that says so.
    #[serde(skip_serializing_if = "Option::is_none")]
    arithmetic: Option<&'static str>,
    /// What `--prefilter` filters, in a sentence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) prefilter: Option<String>,
}

#[derive(Debug, Serialize)]
struct Pass {
    name: &'static str,
    before: usize,
    after: usize,
}

impl Stats {
    pub(super) fn of(
        compiled: &Compiled,
        lowered: usize,
        points: u64,
        times: [Duration; 3],
        args: &RunArgs,
    ) -> Stats {
        let [compile_ms, run_ms, write_ms] = times.map(|t| t.as_secs_f64() * 1e3);
        let (registers, register_words) = compiled.program.register_words();
        let pass = |report: &PassReport| Pass {
            name: report.pass.name(),
            before: report.before,
            after: report.after,
        };
        Stats {
            compile_ms,
            run_ms,
            write_ms,
            points,
            points_per_second: points as f64 / (run_ms / 1e3).max(1e-9),
            instruction_set: args.isa.unwrap_or_else(Isa::detect).name(),
            batch: args.batch.map_or_else(|| compiled.program.batch(), |n| n as usize),
            peak_memory_bytes: peak_memory(),
            instructions: lowered,
            registers,
            register_words,
            passes: compiled.reports.iter().map(pass).collect(),
            arithmetic: (args.arithmetic == Some(Arithmetic::Fast) && !compiled.body.differs_in_fast())
                .then_some(SAME_IN_FAST),
            prefilter: None,
        }
    }

    /// Prints them for people.
    pub(super) fn print(&self, err: &mut dyn Write) {
        let Stats { compile_ms, run_ms, write_ms, points, points_per_second: rate, .. } = self;
        let _ = writeln!(err, "compile {compile_ms:.2} ms, run {run_ms:.2} ms, write {write_ms:.2} ms");
        let per_point = run_ms * 1e6 / (*points).max(1) as f64;
        let (isa, batch) = (self.instruction_set, self.batch);
        let _ = writeln!(
            err,
            "{points} points, {rate:.0} points/s, {per_point:.1} ns/point ({isa}, batches of {batch})"
        );
        if let Some(peak) = self.peak_memory_bytes {
            let _ = writeln!(err, "peak memory {:.0} MB", peak as f64 / 1e6);
        }
        let (lowered, registers, words) = (self.instructions, self.registers, self.register_words);
        let _ = writeln!(
            err,
            "{lowered} instructions lowered, {registers} lane registers of {words} words in all"
        );
        for Pass { name, before, after } in &self.passes {
            let _ = writeln!(err, "  {name:<8} {before:>6} -> {after}");
        }
        for text in self.arithmetic.iter().copied().chain(self.prefilter.as_deref()) {
            let _ = writeln!(err, "{text}");
        }
    }
}

/// The peak memory of the process in bytes, if the system provides it.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}
