//! The loop of one process: runs inputs of one door in sequence, on one thread.
//!
//! It must not know other processes.

use super::corpus::Corpus;
use super::measure;
use crate::doors::Door;
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Mutex, Once, PoisonError};
use std::time::{Duration, Instant};

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub enum Until {
    /// After this number of executions.
    Runs(u64),
    /// After this time.
    Time(Duration),
}

/// The limits of an execution.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Seconds of processor time.
    pub seconds: f64,
    /// Megabytes of resident memory of the whole process.
    pub megabytes: f64,
}

impl Default for Bounds {
    fn default() -> Bounds {
        Bounds { seconds: 5.0, megabytes: 500.0 }
    }
}

/// The failure of an input.
#[derive(Clone, Debug, PartialEq)]
pub enum Wrong {
    /// The door panics, with these words.
    Panic(String),
    /// It takes too many seconds of processor time.
    Slow(f64),
    /// The process takes too many megabytes.
    Large(f64),
}

impl std::fmt::Display for Wrong {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Wrong::Panic(why) => write!(f, "panic: {why}"),
            Wrong::Slow(seconds) => write!(f, "slow: {seconds:.1} s"),
            Wrong::Large(megabytes) => write!(f, "large: {megabytes:.0} MB"),
        }
    }
}

/// The result of a loop.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Number of executions.
    pub executions: u64,
    /// Total time in seconds.
    pub seconds: f64,
    /// The longest time in seconds.
    pub worst: f64,
    /// Peak memory of the process in megabytes.
    pub megabytes: f64,
    /// Number of inputs in the corpus.
    pub corpus: usize,
}

/// Runs a door on inputs of its corpus. `before` receives each input before it is run, `wrong` each input
/// that fails.
pub fn drive(
    door: &'static Door,
    (seed, until, bounds): (u64, Until, Bounds),
    folder: Option<&Path>,
    before: &mut dyn FnMut(&[u8]),
    wrong: &mut dyn FnMut(&[u8], Wrong),
) -> Tally {
    let mut corpus = Corpus::new(door, seed, folder);
    let mut tally = Tally::default();
    let started = Instant::now();
    loop {
        let over = match until {
            Until::Runs(runs) => tally.executions >= runs,
            Until::Time(time) => started.elapsed() >= time,
        };
        if over {
            break;
        }
        let input = corpus.input(tally.executions);
        before(&input);
        tally.executions += 1;
        let processor = measure::processor_seconds();
        let began = Instant::now();
        let result = quietly(|| (door.enter)(&input));
        let seconds = began.elapsed().as_secs_f64();
        tally.seconds += seconds;
        // On a busy machine an execution takes longer, but does not cost more.
        let seconds = match (processor, measure::processor_seconds()) {
            (Some(before), Some(after)) if seconds > 0.1 => seconds.min(after - before),
            _ => seconds,
        };
        tally.worst = tally.worst.max(seconds);
        match result {
            Ok(came_to) => corpus.note(&input, came_to),
            Err(why) => wrong(&input, Wrong::Panic(why)),
        }
        if seconds > bounds.seconds {
            wrong(&input, Wrong::Slow(seconds));
        }
        // Filling memory takes time, so the memory of short executions is not measured.
        if seconds > 0.005
            && let Some(megabytes) = measure::peak_megabytes()
        {
            tally.megabytes = tally.megabytes.max(megabytes);
            if megabytes > bounds.megabytes {
                wrong(&input, Wrong::Large(megabytes));
                measure::forget_peak();
            }
        }
    }
    tally.megabytes = tally.megabytes.max(measure::peak_megabytes().unwrap_or(0.0));
    tally.corpus = corpus.len();
    tally
}

thread_local! {
    /// Whether this thread is in a door, and the message of a panic there.
    static WITHIN: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// The message of the last panic on a thread outside of any door, which works for a door.
static ELSEWHERE: Mutex<String> = Mutex::new(String::new());

/// Runs a function; returns the message if it panics, without printing it.
fn quietly(run: impl FnOnce() -> u64) -> Result<u64, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            let is_within = WITHIN
                .with_borrow_mut(|words| words.as_mut().map(|words| *words = info.to_string()).is_some());
            if !is_within {
                *ELSEWHERE.lock().unwrap_or_else(PoisonError::into_inner) = info.to_string();
                usual(info);
            }
        }));
    });
    WITHIN.set(Some(String::new()));
    let result = catch_unwind(AssertUnwindSafe(run));
    let words = WITHIN.take().filter(|words| !words.is_empty());
    result.map_err(|_| {
        words.unwrap_or_else(|| ELSEWHERE.lock().unwrap_or_else(PoisonError::into_inner).clone())
    })
}
