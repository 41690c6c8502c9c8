//! The diagnostics model: codes, spans, notes and edits, as data.
//!
//! Every crate of the compiler reports through it and declares its codes next to the constructors of its
//! messages. [`crate::render`] formats diagnostics.

use crate::span::Span;

/// A stable code with the short name for `-W` and `-A`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Code {
    /// `E0123` or `W0123`.
    pub id: &'static str,
    /// `unknown-name`: lower case, hyphens.
    pub name: &'static str,
}

/// The severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Compilation continues and succeeds.
    Warning,
    /// The file does not compile.
    Error,
}

/// One replacement of source text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edit {
    /// The replaced text; empty for an insertion.
    pub span: Span,
    /// The new text.
    pub text: String,
}

/// A suggested change, whose edits are applied together or not at all.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fix {
    /// Its title, in the imperative: `remove the stray brace`.
    pub title: String,
    /// The edits, in order of position.
    pub edits: Vec<Edit>,
    /// Whether a program may apply it without asking: it is the only reading of an error, or it keeps what a
    /// file computes. Other changes are suggestions that a person judges.
    pub safe: bool,
}

/// One message to the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Its stable code.
    pub code: Code,
    /// Error or warning.
    pub severity: Severity,
    /// One line, lower case, no full stop.
    pub message: String,
    /// The offending token or construct.
    pub span: Span,
    /// A few words at the primary span.
    pub label: String,
    /// Further locations, each with a few words.
    pub labels: Vec<(Span, String)>,
    /// Facts that explain the message.
    pub notes: Vec<String>,
    /// The next step for the user.
    pub help: Option<String>,
    /// Changes that repair the text.
    pub fixes: Vec<Fix>,
}

impl Diagnostic {
    /// An error at `span`.
    pub fn error(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self::new(code, Severity::Error, span, message.into())
    }

    /// A warning at `span`.
    pub fn warning(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self::new(code, Severity::Warning, span, message.into())
    }

    fn new(code: Code, severity: Severity, span: Span, message: String) -> Self {
        Self {
            code,
            severity,
            message,
            span,
            label: String::new(),
            labels: Vec::new(),
            notes: Vec::new(),
            help: None,
            fixes: Vec::new(),
        }
    }

    /// Sets the text at the primary span.
    pub fn label(mut self, text: impl Into<String>) -> Self {
        self.label = text.into();
        self
    }

    /// Adds a further location.
    pub fn also(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push((span, text.into()));
        self
    }

    /// Adds a note.
    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.notes.push(text.into());
        self
    }

    /// Sets the next step.
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help = Some(text.into());
        self
    }

    /// Adds a change that a program may apply without asking.
    pub fn fix(mut self, title: impl Into<String>, edits: Vec<Edit>) -> Self {
        self.fixes.push(Fix { title: title.into(), edits, safe: true });
        self
    }

    /// Adds a change that is probably the intended one.
    pub fn suggest(mut self, title: impl Into<String>, edits: Vec<Edit>) -> Self {
        self.fixes.push(Fix { title: title.into(), edits, safe: false });
        self
    }

    /// Whether it is an error.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

/// A list of diagnostics with a maximum length, so that a hostile file cannot fill the memory. Warnings have
/// a limit of their own, so that they do not displace an error.
#[derive(Clone, Debug)]
pub(crate) struct Sink {
    pub(crate) list: Vec<Diagnostic>,
    limit: u64,
    n_errors: u64,
    n_warnings: u64,
    /// The location of the first dropped error.
    pub(crate) dropped: Option<Span>,
}

impl Sink {
    pub(crate) fn new(limit: u64) -> Self {
        Self { list: Vec::new(), limit, n_errors: 0, n_warnings: 0, dropped: None }
    }

    /// Adds a diagnostic, unless there are too many of its severity.
    pub(crate) fn push(&mut self, d: Diagnostic) {
        let n = if d.is_error() { &mut self.n_errors } else { &mut self.n_warnings };
        if *n < self.limit {
            *n += 1;
            self.list.push(d);
        } else if d.is_error() {
            self.dropped.get_or_insert(d.span);
        }
    }
}
