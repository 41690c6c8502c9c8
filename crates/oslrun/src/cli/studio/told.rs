//! What the work for an answer leaves besides the answer: the messages, the reason to stop, and the files to
//! watch. This module must not know what was asked.

use crate::cli::Failure;
use crate::cli::json_lines::JsonLines;
use crate::cli::reads::Reads;
use osl_files::stamp;
use osl_limits::Cancel;
use osl_studio::{Files, Stop};
use serde_json::Value;
use std::io::Write;

/// The error output of a command, as the objects of its lines.
pub(super) fn told(work: impl FnOnce(&mut dyn Write) -> Result<(), Failure>) -> (Vec<Value>, bool) {
    let mut bytes = Vec::new();
    let mut lines = JsonLines::new(&mut bytes);
    let result = work(&mut lines);
    let failed = result.is_err();
    if let Err(Failure { text, .. }) = result
        && !text.is_empty()
    {
        let _ = writeln!(lines, "error: {text}");
    }
    drop(lines);
    let text = String::from_utf8_lossy(&bytes);
    (text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect(), failed)
}

/// The stop of work that failed with these messages.
pub(super) fn stop(messages: Vec<Value>, cancel: &Cancel) -> Stop {
    if cancel.is_cancelled() { Stop::Cancelled } else { Stop::Failed(messages) }
}

/// Adds files that were read to those that a page watches.
pub(super) fn watch(reads: Reads, files: &mut Files) {
    for path in reads.0 {
        files.entry(path).or_insert_with_key(|path| stamp(path));
    }
}
