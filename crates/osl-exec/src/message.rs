//! What a run has to say: errors and warnings of the shader and of what it asked for.

/// One message. Equal ones are reported once.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Message {
    /// Whether it is an error rather than a warning.
    pub error: bool,
    /// The text, one line.
    pub text: String,
}

impl Message {
    /// An error.
    pub fn error(text: impl Into<String>) -> Message {
        Message { error: true, text: text.into() }
    }
}

/// Messages in the order of their first appearance.
#[derive(Clone, Debug, Default)]
pub(crate) struct Messages {
    list: Vec<Message>,
}

/// Different messages that a run keeps.
const MAX_MESSAGES: usize = 1000;

impl Messages {
    /// Adds a message unless it is there already or there are too many.
    pub(crate) fn add(&mut self, message: Message) {
        if self.list.len() < MAX_MESSAGES && !self.list.contains(&message) {
            self.list.push(message);
        }
    }

    /// The messages.
    pub(crate) fn into_list(self) -> Vec<Message> {
        self.list
    }
}
