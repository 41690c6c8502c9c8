//! `--message-format json`: every line of the standard error is a JSON object.
//!
//! Diagnostics and messages of shaders are printed as objects by those who know their parts. This writer
//! turns every other line, such as `error: cannot read a.osl`, into an object with a severity and a message.
//! It must not know who prints.

use serde::Serialize;
use serde::de::IgnoredAny;
use std::ffi::OsString;
use std::io::{Result, Write};

/// A line that is not printed as an object.
#[derive(Serialize)]
struct Plain<'a> {
    code: &'a str,
    name: &'a str,
    severity: &'a str,
    message: &'a str,
}

/// Turns lines into JSON objects.
pub(super) struct JsonLines<'a> {
    inner: &'a mut dyn Write,
    /// The beginning of a line whose end has not come yet.
    rest: Vec<u8>,
}

impl<'a> JsonLines<'a> {
    pub(super) fn new(inner: &'a mut dyn Write) -> JsonLines<'a> {
        JsonLines { inner, rest: Vec::new() }
    }

    fn line(&mut self, line: &[u8]) -> Result<()> {
        let text = String::from_utf8_lossy(line);
        let text = text.trim_end();
        if text.is_empty() {
            return Ok(());
        }
        if text.starts_with('{') && serde_json::from_str::<IgnoredAny>(text).is_ok() {
            return writeln!(self.inner, "{text}");
        }
        let severity = ["error", "warning", "note"].into_iter().find_map(|severity| {
            let message = text.strip_prefix(severity)?.strip_prefix(": ")?;
            Some((severity, message))
        });
        let (severity, message) = severity.unwrap_or(("note", text));
        let object = Plain { code: "", name: "", severity, message };
        writeln!(self.inner, "{}", serde_json::to_string(&object)?)
    }
}

impl Write for JsonLines<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.rest.extend_from_slice(bytes);
        while let Some(end) = self.rest.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = self.rest.drain(..=end).collect();
            self.line(&line)?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        self.inner.flush()
    }
}

impl Drop for JsonLines<'_> {
    fn drop(&mut self) {
        let rest = std::mem::take(&mut self.rest);
        let _ = self.line(&rest);
    }
}

/// Whether a command line asks for JSON. It is read as words, since it may be wrong, and then the message
/// about it is an object too.
pub(super) fn requested(args: &[OsString]) -> bool {
    const OPTION: &str = "--message-format";
    let mut words = args.iter().map(|word| word.to_string_lossy()).take_while(|word| word != "--").peekable();
    let mut json = false;
    while let Some(word) = words.next() {
        json = match word.strip_prefix(OPTION) {
            Some("") => words.peek().is_some_and(|value| value == "json"),
            Some(value) if value.starts_with('=') => value == "=json",
            _ => json,
        };
    }
    json
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;

    #[test]
    fn every_line_becomes_an_object_and_objects_stay() {
        let mut out = Vec::new();
        let mut lines = JsonLines::new(&mut out);
        lines.write_all(b"error: cannot read \"a\"\n\n{\"a\":1}\n  x").unwrap();
        lines.write_all(b" 1 \xff\nwarning: w").unwrap();
        drop(lines);
        let expected = "{\"code\":\"\",\"name\":\"\",\"severity\":\"error\",\"message\":\"cannot read \\\"a\\\"\"}\n\
            {\"a\":1}\n\
            {\"code\":\"\",\"name\":\"\",\"severity\":\"note\",\"message\":\"  x 1 \u{fffd}\"}\n\
            {\"code\":\"\",\"name\":\"\",\"severity\":\"warning\",\"message\":\"w\"}\n";
        assert_eq!(String::from_utf8(out).unwrap(), expected);
    }

    #[test]
    fn the_last_option_counts() {
        let asked = |text: &str| requested(&text.split(' ').map(OsString::from).collect::<Vec<_>>());
        assert!(asked("oslrun a.osl --message-format json") && asked("oslrun --message-format=json"));
        assert!(!asked("oslrun --message-format human") && !asked("oslrun a -- --message-format json"));
        assert!(!asked("oslrun --message-format=json --message-format=human"));
    }
}
