//! Why a request failed.

use std::fmt::Display;

/// Why a request or a command failed.
#[derive(Debug)]
pub struct Failure {
    /// The error message for the user; empty if an event has said it.
    pub text: String,
    /// The exit code of a command that fails for this reason: 1 for an error in the input or its result, 2
    /// for a request that makes no sense.
    pub code: u8,
    /// Whether the output was written all the same.
    pub wrote: bool,
}

impl Failure {
    /// A failure with a message of one line.
    pub fn new(text: impl Display) -> Failure {
        Failure { text: text.to_string(), code: 1, wrote: false }
    }

    /// A failure because of the request alone: options that exclude each other, or a value out of range.
    pub fn usage(text: impl Display) -> Failure {
        Failure { text: text.to_string(), code: 2, wrote: false }
    }

    /// A failure whose message an event has said already.
    pub fn said() -> Failure {
        Failure { text: String::new(), code: 1, wrote: false }
    }

    /// A picture that was written, but misses its error bound, as a warning has said.
    pub fn missed() -> Failure {
        Failure { text: String::new(), code: 1, wrote: true }
    }
}
