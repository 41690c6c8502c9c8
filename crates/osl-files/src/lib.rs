//! Reads and writes files. Every file that the product reads or writes goes through this crate.
//!
//! It enforces three rules. A file named by a shader, group, scene or header is opened only below the folders
//! that the user permitted ([`Roots`]): links are resolved, and the file cannot be exchanged between the
//! check and the opening. Pipes, devices, sockets and folders are refused before anything is read, and each
//! read has a bound ([`Opened`]). An output file is replaced as a whole or not at all ([`Unsaved`],
//! [`save_all`]), the next process removes what a killed process left, and no output replaces a file that was
//! read ([`protect_inputs`]). The crate must not know formats, shaders or the command line.

mod error;
mod folder;
mod inputs;
mod open;
mod parts;
mod read;
mod roots;
mod save;

pub use error::{FileError, Kind, SaveError};
pub use folder::{files_below, has_file};
pub use inputs::{Used, forget_inputs, is_same, permit_rewrite, protect_inputs, used};
pub use parts::abandon;
pub use read::{Opened, Stamp, open_named, read_stream, stamp, text};
pub use roots::Roots;
pub use save::{Sink, Unsaved, is_plain_name, replace, rewrite, save_all};
