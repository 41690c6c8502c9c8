//! `--budget SECONDS` of commands that can stop early: a clock that cancels their work. This module must not
//! know what is cancelled.

use osl_limits::Cancel;
use std::sync::mpsc;
use std::time::Duration;

/// Cancels the work when a time is over.
pub(super) struct Clock {
    pub(super) cancel: Cancel,
    /// Ends the watch when it is dropped.
    _running: mpsc::Sender<()>,
}

impl Clock {
    /// A clock that cancels after so many seconds.
    pub(super) fn new(seconds: f64) -> Clock {
        let (_running, ends) = mpsc::channel::<()>();
        let cancel = Cancel::new();
        let watched = cancel.clone();
        let watch = move || {
            let ended = ends.recv_timeout(Duration::from_secs_f64(seconds));
            if ended == Err(mpsc::RecvTimeoutError::Timeout) {
                watched.cancel();
            }
        };
        // A process that cannot create a thread has no time limit.
        let _ = std::thread::Builder::new().name("clock".to_string()).spawn(watch);
        Clock { cancel, _running }
    }
}
