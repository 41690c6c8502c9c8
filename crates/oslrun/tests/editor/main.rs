//! `oslrun lsp` as an editor meets it: the binary, its standard streams, and transcripts of sessions.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::unwrap_used,
    missing_docs,
    reason = "a test says what must hold"
)]

mod chance;
mod client;
mod diagnostics;
mod edits;
mod meaning;
mod neovim;
mod places;
mod protocol;
