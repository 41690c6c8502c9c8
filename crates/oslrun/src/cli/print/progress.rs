//! Progress bars on a terminal; nothing in logs.

use indicatif::{HumanCount, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use osl_job::Meter;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long a command runs before it shows progress.
const PATIENCE: Duration = Duration::from_millis(500);

/// A progress bar for work that takes more than a moment. `unit` is the name of what is counted, or empty if
/// that is only a share of the work.
pub(super) fn meter(total: u64, unit: &'static str) -> Box<dyn Meter> {
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
    let is_shown = AtomicBool::new(!std::io::stderr().is_terminal());
    Box::new(Progress { bar, is_shown, started: Instant::now() })
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
