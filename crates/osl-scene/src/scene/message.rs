//! Messages about a scene file, with their lines.

use osl_exec::Frame;
use osl_limits::Limits;
use std::fmt;
use std::sync::Arc;

/// A location in a scene file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneLocation {
    /// The file, as it was requested.
    pub file: Arc<str>,
    /// Its line, from 1; 0 means the file as a whole.
    pub line: u32,
}

/// An error or a warning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Whether it prevents rendering.
    pub error: bool,
    /// Its location.
    pub place: SceneLocation,
    /// Its text.
    pub text: String,
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.error { "error" } else { "warning" };
        let SceneLocation { file, line } = &self.place;
        match line {
            0 => write!(f, "{file}: {kind}: {}", self.text),
            _ => write!(f, "{file}:{line}: {kind}: {}", self.text),
        }
    }
}

/// All messages, in the order of the file, and the limits for reading and building the scene.
#[derive(Clone, Debug, Default)]
pub struct Messages {
    list: Vec<Message>,
    errors: usize,
    limits: Limits,
}

impl Messages {
    /// No messages yet, for a scene with these limits.
    pub fn within(limits: &Limits) -> Messages {
        Messages { limits: limits.clone(), ..Messages::default() }
    }

    /// The limits of the scene.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Adds an error.
    pub fn error(&mut self, place: &SceneLocation, text: impl Into<String>) {
        self.errors += 1;
        self.add(true, place, text.into());
    }

    /// Adds a warning.
    pub fn warning(&mut self, place: &SceneLocation, text: impl Into<String>) {
        self.add(false, place, text.into());
    }

    fn add(&mut self, error: bool, place: &SceneLocation, text: String) {
        // The first error is kept regardless of earlier messages.
        if (self.list.len() as u64) < self.limits.scenes.messages || (error && self.errors == 1) {
            self.list.push(Message { error, place: place.clone(), text });
        }
    }

    /// Whether there is an error.
    pub fn failed(&self) -> bool {
        self.errors > 0
    }

    /// The messages.
    pub fn list(&self) -> &[Message] {
        &self.list
    }
}

/// Reports the messages of a shader that ran while the scene was built.
pub(super) fn say(frame: &Frame, place: &SceneLocation, messages: &mut Messages) {
    for (error, text) in frame.said(|_| String::new()) {
        if error { messages.error(place, text) } else { messages.warning(place, text) }
    }
}
