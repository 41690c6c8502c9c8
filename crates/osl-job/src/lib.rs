//! The one way to ask for a picture: a typed [`Image`] (what to shade, and how) becomes values, files and
//! messages.
//!
//! Clients such as the command line and the live page describe a picture as an [`Image`] and run it
//! ([`picture::run`]). While it runs, a [`Sink`] gets typed [`Event`]s: diagnostics, messages of shaders,
//! notes and text. The result is a [`Done`] with values, ranges and the names of the written files. The
//! modules follow the way of the data: [`request`] says what is wanted, [`source`] reads and compiles,
//! [`picture`] shades points, [`report`] counts and describes what came out, [`mod@file`] writes it. Files
//! come from a [`host`]; a [`Session`] keeps what was read, and cancels work that a change makes outdated.
//!
//! The crate must not know the command line, its options, a terminal, or how messages look: clients turn
//! events into text or JSON.

mod event;
mod failure;
pub mod file;
pub mod host;
mod message;
mod open;
pub mod picture;
pub mod report;
pub mod request;
mod session;
pub mod source;
mod spoken;

pub use event::{Event, Meter, Meters, NoSink, Sink};
pub use failure::Failure;
pub use message::{Message, Place, Severity};
pub use picture::{Done, First};
pub use request::Image;
pub use session::{Session, Snapshot};
pub use spoken::Spoken;
