//! Scene files: the part of the `.ass` text format that preview scenes need.
//!
//! [`read`] turns a file and its includes into a [`Description`]; [`Networks`] compiles its shader nodes to
//! programs. A node whose type is not one of those here is an OSL shader. Nothing here opens files: the
//! caller provides texts and shaders.

mod build;
mod describe;
mod fields;
mod message;
mod network;
mod polygons;
mod tessellate;
mod text;

pub use build::{Surroundings, build};
pub use describe::{Description, Form, Settings, SkyNode, Surface};
pub use message::{Message, Messages, SceneLocation};
pub use network::{Network, Networks, Use};
pub use polygons::Polygons;
pub use text::{Node, Param, Value, Word};

use std::sync::Arc;
use text::Item;

/// Provides included files.
pub trait SceneFiles {
    /// The text of a file that another file includes, and its own name.
    ///
    /// # Errors
    /// Why the file is not available, as text for the user.
    fn include(&self, name: &str, from: &str) -> Result<(String, String), String>;
}

/// Reads a scene. Invalid text is an error among the messages; an unknown item is a warning.
pub fn read(file: &str, text: &str, files: &dyn SceneFiles, messages: &mut Messages) -> Description {
    let mut reading = Reading { files, messages, nodes: Vec::new(), bytes: 0, count: 0 };
    reading.file(&file.into(), text, 0);
    let nodes = reading.nodes;
    if messages.failed() {
        return Description::default();
    }
    describe::describe(SceneLocation { file: file.into(), line: 0 }, nodes, messages)
}

struct Reading<'a> {
    files: &'a dyn SceneFiles,
    messages: &'a mut Messages,
    nodes: Vec<Node>,
    bytes: usize,
    count: usize,
}

impl Reading<'_> {
    fn file(&mut self, file: &Arc<str>, text: &str, depth: usize) {
        self.bytes += text.len();
        self.count += 1;
        let limits = self.messages.limits().scenes;
        if self.bytes as u64 > limits.bytes {
            let place = SceneLocation { file: file.clone(), line: 1 };
            let most = limits.bytes;
            let text = format!("a scene has at most {most} bytes (--limit scenes.bytes=N)");
            self.messages.error(&place, text);
            return;
        }
        for item in text::read(file, text, self.messages) {
            match item {
                Item::Node(node) if self.nodes.len() as u64 >= limits.nodes => {
                    let text = format!("a scene has at most {} nodes (--limit scenes.nodes=N)", limits.nodes);
                    self.messages.error(&node.place, text);
                    return;
                }
                Item::Node(node) => self.nodes.push(node),
                Item::Include(name, place)
                    if depth as u64 >= limits.file_depth || self.count as u64 >= limits.files =>
                {
                    let text =
                        "too many files include each other (--limit scenes.files=N, scenes.file_depth=N)";
                    self.messages.error(&place, format!("`{name}`: {text}"));
                    return;
                }
                Item::Include(..) if self.messages.limits().halted().is_some() => return,
                Item::Include(name, place) => match self.files.include(&name, &place.file) {
                    Ok((name, text)) => self.file(&name.into(), &text, depth + 1),
                    Err(why) => self.messages.error(&place, format!("cannot include `{name}`: {why}")),
                },
            }
        }
    }
}
