//! Times, rates, and what each pass did.

use crate::request::Running;
use osl::stages::Compiled;
use osl_exec::Isa;
use osl_ir::passes::Report as PassReport;
use osl_numeric::Arithmetic;
use serde::Serialize;
use std::fmt::Write;
use std::time::Duration;

/// What the fast arithmetic is worth for a program without an operation that it computes in another way.
pub const SAME_IN_FAST: &str =
    "`--arithmetic fast` changes nothing here: the program has no operation that it computes in another way";

/// How many operations are prefiltered, in a sentence.
pub fn filtered(n: usize) -> String {
    match n {
        0 => "prefilter: no step or noise of this shader can be filtered".into(),
        1 => "prefilter: 1 step or noise is filtered".into(),
        n => format!("prefilter: {n} steps and noises are filtered"),
    }
}

/// Times, rates, and what each pass did.
#[derive(Debug, Serialize)]
pub struct Stats {
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
    /// How many operations are prefiltered, in a sentence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prefilter: Option<String>,
}

#[derive(Debug, Serialize)]
struct Pass {
    name: &'static str,
    before: usize,
    after: usize,
}

impl Stats {
    /// The facts about a run: the numbers of lowered instructions and of points, and the times of compiling,
    /// running and writing.
    pub fn of(
        compiled: &Compiled,
        (lowered, points): (usize, u64),
        times: [Duration; 3],
        running: &Running,
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
            instruction_set: running.isa.unwrap_or_else(Isa::detect).name(),
            batch: running.batch.map_or_else(|| compiled.program.batch(), |n| n as usize),
            peak_memory_bytes: peak_memory(),
            instructions: lowered,
            registers,
            register_words,
            passes: compiled.reports.iter().map(pass).collect(),
            arithmetic: (running.arithmetic == Some(Arithmetic::Fast) && !compiled.body.differs_in_fast())
                .then_some(SAME_IN_FAST),
            prefilter: None,
        }
    }

    /// The facts as lines of text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let Stats { compile_ms, run_ms, write_ms, points, points_per_second: rate, .. } = self;
        let _ = writeln!(text, "compile {compile_ms:.2} ms, run {run_ms:.2} ms, write {write_ms:.2} ms");
        let per_point = run_ms * 1e6 / (*points).max(1) as f64;
        let (isa, batch) = (self.instruction_set, self.batch);
        let _ = writeln!(
            text,
            "{points} points, {rate:.0} points/s, {per_point:.1} ns/point ({isa}, batches of {batch})"
        );
        if let Some(peak) = self.peak_memory_bytes {
            let _ = writeln!(text, "peak memory {:.0} MB", peak as f64 / 1e6);
        }
        let (lowered, registers, words) = (self.instructions, self.registers, self.register_words);
        let _ = writeln!(
            text,
            "{lowered} instructions lowered, {registers} lane registers of {words} words in all"
        );
        for Pass { name, before, after } in &self.passes {
            let _ = writeln!(text, "  {name:<8} {before:>6} -> {after}");
        }
        for sentence in self.arithmetic.into_iter().chain(self.prefilter.as_deref()) {
            let _ = writeln!(text, "{sentence}");
        }
        text
    }
}

/// The peak memory of the process in bytes, if the system provides it.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}
