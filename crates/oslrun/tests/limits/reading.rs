//! The limits of `reading`.

use crate::{Tripped, shader};
use osl_limits::Row;

pub(crate) const TRIPPED: Tripped = &[("reading.file_bytes", file_bytes)];

fn file_bytes(row: &Row) {
    let folder = shader("shader a(output float o = 0) { o = u; }");
    folder.run(&["check", "a.osl"]).succeeds();
    folder.run(&["check", "a.osl", "--limit", "reading.file_bytes=10"]).fails_with(row);
}
