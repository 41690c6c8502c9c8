//! The edge: turns events and results into text for people or into JSON.
//!
//! [`Console`] is the sink of all commands. `diagnostics` and `done` have the text, `json` the objects,
//! `progress` the bars, and `checked` keeps the first error of the standard output.

pub(super) mod checked;
mod diagnostics;
pub(super) mod done;
pub(super) mod json;
mod progress;

pub(super) use progress::busy;

use osl_job::request::Lints;
use osl_job::{Event, Failure, Meters, Severity, Sink};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::escape::shown;
use osl_syntax::source::SourceMap;
use serde::Serialize;
use std::ffi::OsString;
use std::io::Write;
use std::sync::Arc;

/// What the command prints about a file with errors that it is to run, without colors.
pub fn rejected(list: &[Diagnostic], sources: &SourceMap) -> String {
    let (text, note) = diagnostics::text(list, sources, Some(&Lints::default()));
    let note = note.map(|note| format!("{}: {note}\n", Severity::Note.word())).unwrap_or_default();
    plain(&text) + &note
}

/// Text that the command prints, without colors.
pub fn plain(text: &str) -> String {
    anstream::adapter::strip_str(text).to_string()
}

/// The standard streams of a command.
pub(super) struct Console<'a> {
    /// The standard output.
    pub(super) out: &'a mut dyn Write,
    err: &'a mut dyn Write,
    manner: Manner,
    nowhere: std::io::Sink,
}

/// How a command prints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Manner {
    /// Each line of the standard error is a JSON object.
    pub(super) json: bool,
    /// No notes, no progress, and no lines that say which files were written.
    pub(super) quiet: bool,
}

impl<'a> Console<'a> {
    /// A console for these streams.
    pub(super) fn new(out: &'a mut dyn Write, err: &'a mut dyn Write, manner: Manner) -> Console<'a> {
        Console { out, err, manner, nowhere: std::io::sink() }
    }

    /// A console like this one that writes elsewhere.
    pub(super) fn to<'b>(&self, out: &'b mut dyn Write, err: &'b mut dyn Write) -> Console<'b> {
        Console::new(out, err, self.manner)
    }

    /// The same console with another standard output.
    pub(super) fn with_out<'b>(&'b mut self, out: &'b mut dyn Write) -> Console<'b> {
        Console::new(out, &mut *self.err, self.manner)
    }

    /// Whether messages are for people, not JSON.
    pub(super) fn is_for_people(&self) -> bool {
        !self.manner.json
    }

    /// Prints an error.
    pub(super) fn error(&mut self, text: &str) {
        self.line(Severity::Error, text);
    }

    /// Prints lines that are no messages, such as a table, on the standard error.
    pub(super) fn text(&mut self, text: &str) {
        if self.manner.quiet {
            return;
        }
        if self.manner.json {
            let lines = text.lines().filter(|line| !line.trim().is_empty());
            lines.for_each(|line| json::print(&json::line(Severity::Note, line), self.err));
        } else {
            let end = if text.ends_with('\n') { "" } else { "\n" };
            let _ = write!(self.err, "{}{end}", shown(text));
        }
    }

    /// Prints what the option parser says about a command line.
    pub(super) fn usage(&mut self, text: &str) {
        match text.strip_prefix("error: ").filter(|_| self.manner.json) {
            Some(text) => self.error(text.trim_end()),
            None => {
                let _ = write!(self.err, "{}", shown(text));
            }
        }
    }

    /// Prints a report of a command on the standard output.
    pub(super) fn report(&mut self, text: &str) {
        let _ = self.out.write_all(text.as_bytes());
    }

    /// Prints a report that may have text of a shader in it.
    pub(super) fn escaped(&mut self, text: &str) {
        let _ = self.out.write_all(shown(text).as_bytes());
    }

    /// Prints a value as JSON on the standard output.
    ///
    /// # Errors
    /// The value has no such form.
    pub(super) fn object(&mut self, value: &impl Serialize) -> Result<(), Failure> {
        let text = json::pretty(value)?;
        self.report(&text);
        Ok(())
    }

    /// Says on the standard output that a file was written.
    pub(super) fn wrote(&mut self, path: &std::path::Path) {
        let _ = writeln!(self.aside(), "wrote {}", shown(&path.display().to_string()));
    }

    /// The standard output for lines about the work, such as the names of files.
    pub(super) fn aside(&mut self) -> &mut dyn Write {
        if self.manner.quiet { &mut self.nowhere } else { &mut *self.out }
    }

    /// Writes bytes that another console has printed on its standard error.
    pub(super) fn again(&mut self, bytes: &[u8]) {
        let _ = self.err.write_all(bytes);
    }

    /// Shows what is written so far.
    pub(super) fn flush_messages(&mut self) {
        let _ = self.err.flush();
    }

    /// Prints diagnostics; fails if one is an error.
    ///
    /// # Errors
    /// One of them is an error.
    pub(super) fn diagnostics(&mut self, list: &[Diagnostic], sources: &SourceMap) -> Result<(), Failure> {
        self.event(Event::Diagnostics { list, sources, asked: None });
        if list.iter().any(Diagnostic::is_error) { Err(Failure::said()) } else { Ok(()) }
    }

    /// Prints the diagnostics of a file that is checked: warnings in other files, and many of one kind, are
    /// only counted.
    ///
    /// # Errors
    /// One of them is an error.
    pub(super) fn folded(
        &mut self,
        list: &[Diagnostic],
        sources: &SourceMap,
        lints: &Lints,
    ) -> Result<(), Failure> {
        if self.manner.json {
            return self.diagnostics(list, sources);
        }
        let (kept, notes) = diagnostics::folded(list, sources, lints);
        let result = self.diagnostics(&kept, sources);
        notes.iter().for_each(|note| self.note(note));
        result
    }

    fn line(&mut self, severity: Severity, text: &str) {
        if self.manner.quiet && severity == Severity::Note {
            return;
        }
        if self.manner.json {
            json::print(&json::line(severity, text), self.err);
        } else {
            let _ = writeln!(self.err, "{}: {}", severity.word(), shown(text));
        }
    }
}

impl Sink for Console<'_> {
    fn event(&mut self, event: Event<'_>) {
        match event {
            Event::Diagnostics { list, sources, .. } if self.manner.json => {
                json::diagnostics(list, sources, |object| json::print(object, self.err));
            }
            Event::Diagnostics { list, sources, asked } => {
                let (text, note) = diagnostics::text(list, sources, asked);
                let _ = self.err.write_all(text.as_bytes());
                note.iter().for_each(|note| self.line(Severity::Note, note));
            }
            Event::Message(message) if self.manner.json => json::print(&json::message(message), self.err),
            Event::Message(message) => {
                let _ = writeln!(self.err, "{}", message.text());
            }
            Event::Scene(message) if self.manner.json => json::print(&json::scene(message), self.err),
            Event::Scene(message) => {
                let _ = writeln!(self.err, "{}", shown(&message.to_string()));
            }
            Event::Line(severity, text) => self.line(severity, text),
            Event::Doubt(text) if self.manner.json => json::print(&json::doubt(text), self.err),
            Event::Doubt(text) => self.line(Severity::Warning, text),
            Event::Text(text) => self.text(text),
            Event::Printed(text) => {
                let _ = self.out.write_all(text.as_bytes());
            }
        }
    }

    fn settle(&mut self) -> Result<(), Failure> {
        // The loss is reported at the end.
        self.out.flush().map_err(|_| Failure::said())
    }

    fn meters(&self) -> Meters {
        let manner = self.manner;
        Arc::new(move |total, unit| progress::meter(total, unit, manner))
    }
}

/// How a command line wants its messages. It is read as words, since it may be wrong, and then the message
/// about it is an object too.
pub(super) fn manner(args: &[OsString]) -> Manner {
    const OPTION: &str = "--message-format";
    let mut words = args.iter().map(|word| word.to_string_lossy()).take_while(|word| word != "--").peekable();
    let mut manner = Manner::default();
    while let Some(word) = words.next() {
        manner.quiet |= word == "--quiet";
        manner.json = match word.strip_prefix(OPTION) {
            Some("") => words.peek().is_some_and(|value| value == "json"),
            Some(value) if value.starts_with('=') => value == "=json",
            _ => manner.json,
        };
    }
    manner
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;

    #[test]
    fn every_line_is_an_object_if_json_is_asked_for() {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let mut console = Console::new(&mut out, &mut err, Manner { json: true, quiet: false });
        console.error("cannot read \"a\"");
        console.text("a table\n\n  of 2\n");
        console.warn("w");
        let expected = "{\"code\":\"\",\"name\":\"\",\"severity\":\"error\",\"message\":\"cannot read \\\"a\\\"\"}\n\
            {\"code\":\"\",\"name\":\"\",\"severity\":\"note\",\"message\":\"a table\"}\n\
            {\"code\":\"\",\"name\":\"\",\"severity\":\"note\",\"message\":\"  of 2\"}\n\
            {\"code\":\"\",\"name\":\"\",\"severity\":\"warning\",\"message\":\"w\"}\n";
        assert_eq!(String::from_utf8(err).unwrap(), expected);
    }

    #[test]
    fn the_last_option_counts() {
        let asked = |text: &str| manner(&text.split(' ').map(OsString::from).collect::<Vec<_>>()).json;
        assert!(asked("oslrun a.osl --message-format json") && asked("oslrun --message-format=json"));
        assert!(!asked("oslrun --message-format human") && !asked("oslrun a -- --message-format json"));
        assert!(!asked("oslrun --message-format=json --message-format=human"));
    }
}
