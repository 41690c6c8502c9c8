//! The standard output, with its errors remembered: no output is lost silently.
//!
//! Commands print without checking the result. This writer keeps the first error, which ends the command with
//! exit code 1. A reader that closes the pipe early (`| head`) is not an error.

use std::io::{self, ErrorKind, IsTerminal, Write};

/// Whether the standard output of the process is a terminal.
pub(in crate::cli) fn is_terminal() -> bool {
    io::stdout().is_terminal()
}

/// A writer that remembers its first error.
pub(in crate::cli) struct Checked<'a> {
    inner: &'a mut dyn Write,
    state: State,
}

enum State {
    Open,
    /// The reader has closed the pipe: later text is dropped.
    Closed,
    Failed(io::Error),
}

impl<'a> Checked<'a> {
    pub(in crate::cli) fn new(inner: &'a mut dyn Write) -> Checked<'a> {
        Checked { inner, state: State::Open }
    }

    /// Flushes the output, and returns the first error since the start.
    pub(in crate::cli) fn finish(mut self) -> io::Result<()> {
        let _ = self.flush();
        match self.state {
            State::Failed(error) => Err(error),
            State::Open | State::Closed => Ok(()),
        }
    }

    fn failed(&mut self, error: io::Error) {
        self.state = match error.kind() {
            ErrorKind::BrokenPipe => State::Closed,
            _ => State::Failed(error),
        };
    }
}

impl Write for Checked<'_> {
    /// Never fails, so that commands need not handle errors.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if matches!(self.state, State::Open)
            && let Err(error) = self.inner.write_all(bytes)
        {
            self.failed(error);
        }
        Ok(bytes.len())
    }

    /// Fails if output was lost, for commands that are about to do something irreversible.
    fn flush(&mut self) -> io::Result<()> {
        if matches!(self.state, State::Open)
            && let Err(error) = self.inner.flush()
        {
            self.failed(error);
        }
        match &self.state {
            State::Failed(error) => Err(error.kind().into()),
            State::Open | State::Closed => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Fails(ErrorKind);

    impl Write for Fails {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(self.0.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn an_error_is_kept_and_a_closed_pipe_is_none() {
        for (kind, lost) in [(ErrorKind::StorageFull, true), (ErrorKind::BrokenPipe, false)] {
            let mut inner = Fails(kind);
            let mut out = Checked::new(&mut inner);
            assert!(writeln!(out, "a").and_then(|()| writeln!(out, "b")).is_ok());
            assert_eq!(out.flush().is_err(), lost);
            assert_eq!(out.finish().is_err(), lost);
        }
    }
}
