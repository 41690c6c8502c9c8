//! Handles Ctrl-C and other requests to end: half-written files are removed, and then the signal ends the
//! process as usual.
//!
//! Only the process of the command does this, never another user of the library: a process has only one
//! handler for signals, and a library must not take it.

#[cfg(unix)]
mod unix {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;

    /// Waits for a signal in a separate thread, where all calls are allowed. The handlers are there when this
    /// function returns, so a part file that is made later does not outlive a signal.
    pub(crate) fn watch() {
        let ignored = ignored();
        let all = [SIGHUP, SIGINT, SIGQUIT, SIGTERM];
        let heard = all.into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
        let heard: Vec<i32> = heard.collect();
        let (registered, is_registered) = std::sync::mpsc::channel();
        let work = move || {
            let signals = Signals::new(heard);
            drop(registered);
            if let Some(signal) = signals.ok().and_then(|mut signals| signals.forever().next()) {
                osl_files::abandon();
                let _ = emulate_default_handler(signal);
            }
        };
        // Without a thread, signals end the process as usual, and the next run removes the files.
        if std::thread::Builder::new().name("signals".to_string()).spawn(work).is_ok() {
            // The other end is dropped, without a message, once the handlers are there.
            let _: Result<(), _> = is_registered.recv();
        }
    }

    /// The signals that the parent process has set to be ignored, as shells do for background commands: the
    /// bit of signal n is n - 1.
    fn ignored() -> u64 {
        let status = osl_files::open_named(std::path::Path::new("/proc/self/status"));
        let Ok(text) = status.and_then(|file| file.text(1 << 16)) else { return 0 };
        let mask = text.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
    }
}

#[cfg(unix)]
pub(crate) use unix::watch;

/// There are no signals on this system.
#[cfg(not(unix))]
pub(crate) fn watch() {}
