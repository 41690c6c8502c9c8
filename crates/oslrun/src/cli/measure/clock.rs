//! `--budget SECONDS` of commands that can stop early: a clock that cancels their work.

use osl_limits::Cancel;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Duration;

/// Cancels the work when a time is over.
pub(in crate::cli) struct Clock {
    pub(in crate::cli) cancel: Cancel,
    is_over: Arc<AtomicBool>,
    /// Ends the watch when it is dropped.
    _running: mpsc::Sender<()>,
}

impl Clock {
    /// A clock that cancels after so many seconds.
    pub(in crate::cli) fn new(seconds: f64) -> Clock {
        Clock::of(Cancel::new(), seconds)
    }

    /// A clock that cancels work after so many seconds which others may cancel before.
    pub(in crate::cli) fn of(cancel: Cancel, seconds: f64) -> Clock {
        let (_running, ends) = mpsc::channel::<()>();
        let (watched, is_over) = (cancel.clone(), Arc::<AtomicBool>::default());
        let over = is_over.clone();
        let watch = move || {
            let ended = ends.recv_timeout(Duration::from_secs_f64(seconds));
            if ended == Err(mpsc::RecvTimeoutError::Timeout) {
                over.store(true, Ordering::Relaxed);
                watched.cancel();
            }
        };
        // A process that cannot create a thread has no time limit.
        let _ = std::thread::Builder::new().name("clock".to_string()).spawn(watch);
        Clock { cancel, is_over, _running }
    }

    /// Whether the time is over.
    pub(in crate::cli) fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_cancels_when_its_time_is_over_and_not_before() {
        let early = Clock::new(1e6);
        let late = Clock::of(Cancel::new(), 0.0);
        while !late.cancel.is_cancelled() {
            std::thread::yield_now();
        }
        assert!(late.is_over());
        assert!(!early.is_over() && !early.cancel.is_cancelled());
        early.cancel.cancel();
        assert!(!early.is_over(), "somebody else cancelled it");
    }
}
