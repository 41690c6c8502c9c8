//! The name of the program in the pictures that it writes: the attribute `software` of an EXR file, and a
//! text `Software` in a PNG file.
//!
//! It is the version alone. So equal pictures are equal files, no matter which command, processor or number
//! of threads made them, and a file says nothing about the paths on the machine.

use osl_image::{ChannelOptions, Transfer};

/// The program and its version.
pub const SOFTWARE: &str = concat!("oslrun ", env!("CARGO_PKG_VERSION"));

/// A file with this name of the program, with the samples that its format has by default. The integers of a
/// PNG or JPEG file follow the curve.
pub fn named(transfer: Transfer) -> ChannelOptions {
    ChannelOptions { samples: None, transfer, software: Some(SOFTWARE) }
}
