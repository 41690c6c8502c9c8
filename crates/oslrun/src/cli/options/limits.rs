//! The limits on the command line, and the watch that enforces the limits of time and memory for the process.
//!
//! The limits themselves are defined in `osl-limits`. Every few milliseconds the watch checks the clock and
//! the memory of the process. If one of them is used up, it tells all stages to stop, and ends the process if
//! they do not: a library that decodes an image cannot be told to stop.

use super::heading;
use clap::{Args, Parser};
use osl_limits::{Cancel, Halt, Limits};
use std::io::Write;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// How long the stages may take to stop after they were told to.
const GRACE: Duration = Duration::from_secs(2);
/// The interval of the watch.
const EVERY: Duration = Duration::from_millis(5);
/// The time before its first look: commands for small images are done by then.
const FIRST: Duration = Duration::from_millis(20);

/// The limits of a command.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct LimitArgs {
    /// A limit to set, by its name in docs/limits.md: running.point_steps=100M; may be repeated.
    #[arg(long, value_name = "NAME=N", value_parser = limit, help_heading = heading::LIMITS)]
    limit: Vec<(String, String)>,
    /// Maximum time in seconds for the command (default: no limit).
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true, env = "OSLRUN_MAX_TIME", hide_env = true, help_heading = heading::LIMITS)]
    max_time: Option<f64>,
    /// Maximum memory for the command (default: three quarters of the machine's memory).
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(16..), allow_negative_numbers = true, env = "OSLRUN_MAX_MEMORY", hide_env = true, help_heading = heading::LIMITS)]
    max_memory: Option<u64>,
    /// The limits, created at the first use.
    #[arg(skip)]
    made: OnceLock<Limits>,
}

impl LimitArgs {
    /// The same limits for a piece of work that can be cancelled. Its time begins now.
    pub(in crate::cli) fn until(&self, cancel: &Cancel) -> Limits {
        let fresh = LimitArgs { made: OnceLock::new(), ..self.clone() };
        fresh.limits().until(cancel)
    }

    /// The limits. The first call starts the watch.
    pub(in crate::cli) fn limits(&self) -> &Limits {
        self.made.get_or_init(|| {
            let mut limits = Limits::default();
            for (name, value) in &self.limit {
                // The values were checked when the command line was read.
                let _ = limits.set(name, value);
            }
            let seconds = self.max_time.map(Duration::from_secs_f64);
            watch(&limits, seconds, self.max_memory.map(|mib| mib.saturating_mul(1 << 20)));
            limits
        })
    }
}

/// The options that the reference's tools accept like every other command.
const OPTIONS: [&str; 3] = ["limit", "max-time", "max-memory"];

impl LimitArgs {
    /// Removes these options from another command line; returns the remaining words.
    ///
    /// # Errors
    /// What is wrong with one of them, as text.
    pub(in crate::cli) fn taken_from(words: Vec<String>) -> Result<(LimitArgs, Vec<String>), String> {
        let (mut own, mut others) = (vec!["limits".to_string()], Vec::new());
        let mut words = words.into_iter();
        while let Some(word) = words.next() {
            let name = word.strip_prefix("--").map(|text| text.split('=').next().unwrap_or(text));
            match name.filter(|name| OPTIONS.contains(name)) {
                None => others.push(word),
                Some(name) => {
                    let alone = word.len() == name.len() + 2;
                    own.push(word);
                    own.extend(words.by_ref().take(usize::from(alone)));
                }
            }
        }
        let found = Line::try_parse_from(own).map_err(|error| {
            let text = error.to_string();
            text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_string()
        })?;
        Ok((found.limits, others))
    }
}

/// A command line with only these options.
#[derive(Debug, Parser)]
struct Line {
    #[command(flatten)]
    limits: LimitArgs,
}

fn limit(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or_else(|| format!("`{text}` is not of the form NAME=N"))?;
    Limits::default().set(name, value).map_err(|why| why.to_string())?;
    Ok((name.to_string(), value.to_string()))
}

fn seconds(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|s: &f64| *s > 0.0 && *s < 1e9);
    found.ok_or_else(|| format!("a number of seconds above 0, not `{text}`"))
}

/// Three quarters of the memory of the machine, or of the part that the process may use.
fn sensible() -> u64 {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let machine = read("/proc/meminfo").and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
        line.trim().strip_suffix(" kB")?.parse::<u64>().ok()?.checked_mul(1024)
    });
    let group = read("/sys/fs/cgroup/memory.max").and_then(|text| text.trim().parse().ok());
    // If the system does not tell, a common size.
    let all = machine.unwrap_or(8 << 30).min(group.unwrap_or(u64::MAX));
    all / 4 * 3
}

/// Tells all stages to stop when the time or the memory is used up, and ends the process if they do not. The
/// watch runs as long as the limits are in use.
///
/// It sleeps before it looks for the first time: most commands are done by then, and what it reads from the
/// system would cost them more than their command line.
fn watch(limits: &Limits, time: Option<Duration>, memory: Option<u64>) {
    let start = Instant::now();
    let limits = limits.clone();
    let work = move || {
        let mut told: Option<Instant> = None;
        std::thread::sleep(time.unwrap_or(FIRST).min(FIRST));
        let memory = memory.unwrap_or_else(sensible);
        while limits.is_shared() {
            let used = memory_stats::memory_stats().map_or(0, |now| now.physical_mem as u64);
            if time.is_some_and(|time| start.elapsed() >= time) {
                limits.halt(Halt::Time);
            }
            if used > memory {
                limits.halt(Halt::Memory);
            }
            if let Some(why) = limits.halted() {
                let told = *told.get_or_insert_with(Instant::now);
                if told.elapsed() > GRACE || used > memory.saturating_add(memory / 4) {
                    let _ = writeln!(std::io::stderr(), "error: {why}");
                    osl_files::abandon();
                    std::process::exit(1);
                }
            }
            std::thread::sleep(EVERY);
        }
    };
    // A process that cannot create a thread has other limits.
    let _ = std::thread::Builder::new().name("watch".to_string()).spawn(work);
}
