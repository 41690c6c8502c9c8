//! A message of a running shader.

use osl_syntax::escape::shown;
use serde::Serialize;

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Severity {
    /// The result is wrong, or there is none.
    Error,
    /// The result may not be what the user wants.
    Warning,
    /// A fact about the result.
    Note,
}

impl Severity {
    /// The word at the start of a message.
    pub fn word(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        }
    }
}

/// A message of a running shader at a line: of one text, for all points that have it.
#[derive(Clone, Debug)]
pub struct Message {
    /// How much it matters.
    pub severity: Severity,
    /// What the shader says.
    pub message: String,
    /// What the user can do.
    pub help: Option<String>,
    /// The file and line of the call; notes about the run have none.
    pub at: Option<Place>,
    /// The number of points with this message, if they were counted.
    pub points: Option<u64>,
    /// The number of all points, and what they are called.
    pub of: (u64, &'static str),
    /// Column and row of the first point, if points belong to pixels.
    pub pixel: Option<[usize; 2]>,
    /// The name of the texture that cannot be used.
    pub texture: Option<String>,
    /// The parameter whose value is that name.
    pub parameter: Option<String>,
}

/// A line of a file.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize)]
pub struct Place {
    /// The file as messages name it.
    pub file: String,
    /// The line, counted from 1.
    pub line: u32,
}

impl Message {
    /// The message in one line, with the number of points and the first pixel.
    pub fn text(&self) -> String {
        let Message { severity, message, help, at, points, pixel, of: (of, name), .. } = self;
        let place = at.as_ref().map_or_else(String::new, |at| format!("{}:{}: ", at.file, at.line));
        let count = match points {
            Some(n) if n <= of => format!(", at {n} of {of} {name}"),
            Some(n) => format!(", at {n} {name}"),
            None => String::new(),
        };
        // A shader's text may contain line breaks.
        let message = message.replace('\n', "\n    ");
        // A note about all points need not say where they begin.
        let pixel = pixel.filter(|_| *severity != Severity::Note || *points != Some(*of));
        let first = pixel.map_or_else(String::new, |[x, y]| format!(", first at pixel ({x}, {y})"));
        let help = help.as_ref().map_or_else(String::new, |help| format!("; {help}"));
        shown(&format!("{}: {place}{message}{count}{first}{help}", severity.word())).into_owned()
    }
}
