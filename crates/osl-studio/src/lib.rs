//! A live page about a shader: a small server on the loopback interface, the protocol between server and
//! page, and the page itself.
//!
//! This crate owns everything between a browser and a shader: who may connect ([`Server`]), the messages
//! ([`State`], [`Shader`], [`Picture`]), which work is done next and which is outdated, and the page in
//! `page/`. It does not know how a shader is compiled or run. A [`Subject`] does that, one for each
//! connection. The command implements it with the functions that also make its own pictures, so a picture on
//! the page and one from the command line have the same bits by construction. That is why the seam is here: a
//! few questions, and no second way to run a shader.
//!
//! Threads and blocking reads are enough: a connection has one thread that reads and one that computes and
//! sends. docs/studio.md describes the protocol.

mod guard;
mod http;
mod page;
mod protocol;
mod server;
mod session;
mod subject;

pub use guard::Token;
pub use protocol::{Edit, Layer, Line, Output, Picture, Saved, Shader, State, Thumbnail, Unsaved, version};
pub use server::{Options, Server, StartError};
pub use subject::{Files, First, Outdate, Stop, Subject};
