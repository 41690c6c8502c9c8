//! What a run is given to write to, and what it hands back besides files. This module must not know how a
//! shader runs.

use super::load::MoreTaps;
use super::reads::Reads;
use super::said::Said;
use osl_exec::{Frame, Plane};
use std::io::Write;
use std::time::Duration;

/// Where a run writes: text, messages, and a picture that is not a file.
pub(super) struct Streams<'a> {
    pub(super) out: &'a mut dyn Write,
    pub(super) err: &'a mut dyn Write,
    pub(super) picture: &'a mut dyn Write,
    /// Gets the values of a run, for a command that does more with them than write them.
    pub(super) kept: Option<&'a mut Kept>,
    /// Gets the values of a smaller grid before those of the whole one.
    pub(super) first: Option<First<'a>>,
    /// Gets the files that the run reads.
    pub(super) reads: Option<&'a mut Reads>,
    /// Makes taps of the shader, besides those of the command line.
    pub(super) more_taps: Option<&'a MoreTaps<'a>>,
}

/// The values of a run.
#[derive(Default)]
pub(super) struct Kept {
    pub(super) frame: Frame,
    /// 0 at pixels that show nothing.
    pub(super) covered: Option<Plane>,
    /// Whether the values miss their error bound.
    pub(super) missed: bool,
    /// What the samples took, if the picture does not have one for each pixel.
    pub(super) said: Option<Said>,
    /// Of a preview: its channels, and the samples that a PNG file stores.
    pub(super) lit: (usize, Vec<u8>),
    /// The time until the program was ready, and the time that it ran.
    pub(super) times: [Duration; 2],
}

/// A smaller grid that the compiled program runs before the whole one.
pub(super) struct First<'a> {
    /// Columns and rows.
    pub(super) grid: (usize, usize),
    /// Gets the values; not called for a surface or a preview.
    pub(super) show: &'a dyn Fn(Kept),
}
