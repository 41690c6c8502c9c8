//! Progress of long work: a bar on a terminal, a line now and then in logs.

use super::{Manner, json};
use indicatif::{HumanCount, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use osl_job::{Meter, Severity};
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// How long a command runs before it shows progress.
const PATIENCE: Duration = Duration::from_millis(500);

/// A progress bar for work that takes more than a moment. `unit` is the name of what is counted, or empty if
/// that is only a share of the work.
pub(super) fn meter(total: u64, unit: &'static str, manner: Manner) -> Box<dyn Meter> {
    if manner.quiet {
        return Box::new(Silent);
    }
    if !std::io::stderr().is_terminal() {
        return Box::new(Lines { total, manner, started: Instant::now(), said: AtomicU64::new(0) });
    }
    let template = match unit {
        "" => "{bar:40} {percent:>3}% {elapsed} {eta}",
        _ => "{bar:40} {percent:>3}% {rate} {eta}",
    };
    let rate = move |state: &ProgressState, text: &mut dyn std::fmt::Write| {
        let _ = write!(text, "{} {unit}/s", HumanCount(state.per_sec() as u64));
    };
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden());
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key("rate", rate));
    }
    Box::new(Progress { bar, is_shown: AtomicBool::new(false), started: Instant::now() })
}

/// No progress.
struct Silent;

impl Meter for Silent {
    fn at(&self, _: u64) {}
}

/// The interval of lines in logs.
const EVERY: Duration = Duration::from_secs(10);

/// A line in a log for each interval that passes: `progress: 40% after 20 s`.
struct Lines {
    total: u64,
    manner: Manner,
    started: Instant,
    /// The number of intervals after which the last line was printed.
    said: AtomicU64,
}

impl Meter for Lines {
    fn at(&self, done: u64) {
        let seconds = self.started.elapsed().as_secs();
        let intervals = seconds / EVERY.as_secs();
        if intervals > self.said.fetch_max(intervals, Ordering::Relaxed) {
            let text = format!("progress: {}% after {seconds} s", done * 100 / self.total.max(1));
            let mut err = std::io::stderr();
            if self.manner.json {
                json::print(&json::line(Severity::Note, &text), &mut err);
            } else {
                let _ = writeln!(err, "{text}");
            }
        }
    }
}

/// A progress bar that appears after half a second.
struct Progress {
    bar: ProgressBar,
    is_shown: AtomicBool,
    started: Instant,
}

impl Meter for Progress {
    fn at(&self, done: u64) {
        self.bar.set_position(done);
        if self.started.elapsed() >= PATIENCE && !self.is_shown.swap(true, Ordering::Relaxed) {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            self.bar.enable_steady_tick(Duration::from_millis(200));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// A line on a terminal that says what a command does for about `seconds`; nothing in logs.
pub(in crate::cli) fn busy(what: &'static str, seconds: f64) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new_spinner().with_message(format!("{what}, about {seconds} s"));
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}: {elapsed} so far") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
