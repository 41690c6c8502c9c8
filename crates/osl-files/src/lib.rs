//! The one door for files. Every read and write of the product goes through this crate.
//!
//! It owns three rules. A file that a shader, group, scene or header names is opened only below the folders that the
//! user gave ([`Roots`]), links resolved, and without a moment between the check and the opening in which the file
//! could be exchanged. Pipes, devices, sockets and folders are refused before anything is read, and each read has a
//! bound ([`Opened`]). An output file is replaced as a whole or not at all ([`Unsaved`], [`save_all`]), and what a
//! killed process left behind is removed by the next one. The crate must not know formats, shaders or the command
//! line.

mod error;
mod open;
mod parts;
mod read;
mod roots;
mod save;

pub use error::{FileError, Kind, SaveError};
pub use parts::abandon;
pub use read::{Opened, open_named, read_stream, text};
pub use roots::Roots;
pub use save::{Sink, Unsaved, is_plain_name, replace, save_all};
