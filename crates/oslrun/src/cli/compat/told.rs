//! Prints the text and messages of shaders as the reference's tools do: point after point, printed text on
//! the standard output, errors and warnings on the standard error. Each stream is flushed before the other
//! one is written.
//!
//! A message that equals one of the last messages of its kind is not repeated. In the tools, the number of
//! warnings per thread is limited; here, the whole run counts as one thread.

use super::Console;
use super::settings::Settings;
use osl_exec::{Event, Message, Program, Severity};
use osl_job::file::output;
use osl_syntax::source::SourceMap;
use std::collections::{HashSet, VecDeque};
use std::sync::Arc;

/// The number of recent errors, and of recent warnings, that a message is compared with.
const REMEMBERED: usize = 25;

/// Prints the text and messages of points, in the order in which it receives them.
pub(in crate::cli) struct Teller<'a> {
    sources: &'a SourceMap,
    settings: Settings,
    /// The number of warnings that may still be printed.
    warnings_left: usize,
    /// The texts that were printed last: errors, and warnings.
    last: [VecDeque<String>; 2],
    /// Files that lookups could not open; the reference's texture library reports each once.
    lost: HashSet<Arc<str>>,
    /// Whether the standard output has text to flush.
    waiting: bool,
}

/// Whether a message comes from a lookup in a file that cannot be opened.
fn is_lookup(message: &Message) -> bool {
    let functions = ["texture", "texture3d", "environment"];
    functions.iter().any(|f| message.text.starts_with(&format!("[RendererServices::{f}] ")))
}

impl<'a> Teller<'a> {
    /// A teller that has printed nothing.
    pub(in crate::cli) fn new(sources: &'a SourceMap, settings: &Settings) -> Teller<'a> {
        Teller {
            sources,
            settings: settings.clone(),
            warnings_left: settings.max_warnings,
            last: Default::default(),
            lost: HashSet::new(),
            waiting: false,
        }
    }

    /// Prints the text and messages of points of a run.
    ///
    /// # Errors
    /// A file to which the shader prints cannot be written.
    pub(in crate::cli) fn tell(
        &mut self,
        events: &[Event],
        program: &Program,
        console: &mut Console<'_>,
    ) -> Result<(), String> {
        for event in events {
            match event {
                Event::Printed(printed) => {
                    output::printed(std::slice::from_ref(printed), output::Appends::Below, console)
                        .map_err(|failure| format!("ERROR: {}", failure.text))?;
                    self.waiting |= printed.file.is_none();
                }
                Event::Said(message) => self.say(message, program, console),
            }
        }
        self.flush(console);
        Ok(())
    }

    fn flush(&mut self, console: &mut Console<'_>) {
        if std::mem::take(&mut self.waiting) {
            let _ = console.out.flush();
        }
    }

    fn say(&mut self, message: &Message, program: &Program, console: &mut Console<'_>) {
        let text = self.text(message, program);
        if self.settings.silences(&text) {
            return;
        }
        let is_error = match message.severity {
            Severity::Error => true,
            Severity::Warning => false,
            // The tool does not know them.
            Severity::Note => return,
        };
        if !is_error {
            match self.warnings_left.checked_sub(1) {
                Some(left) => self.warnings_left = left,
                None => return,
            }
        }
        if let Some(file) = message.file.as_ref().filter(|_| is_lookup(message))
            && !self.lost.insert(file.clone())
        {
            return;
        }
        let [errors, warnings] = &mut self.last;
        let (last, kind) = if is_error { (errors, "ERROR") } else { (warnings, "WARNING") };
        if !self.settings.error_repeats && last.contains(&text) {
            return;
        }
        if last.len() == REMEMBERED {
            last.pop_front();
        }
        self.flush(console);
        let _ = writeln!(console.err, "{kind}: {text}");
        let _ = console.err.flush();
        if let Some(last) = self.last.get_mut(usize::from(!is_error)) {
            last.push_back(text);
        }
    }

    /// A message in the tools' words: messages about an index name the layer.
    fn text(&self, message: &Message, program: &Program) -> String {
        let place =
            |span| self.sources.place(span).map_or_else(String::new, |p| format!("{}:{}", p.file, p.line));
        let text = message.show(place);
        let names = message.places.first().and_then(|span| program.names(*span));
        match names.filter(|_| text.starts_with("Index [")) {
            None => text,
            Some((index, names)) => {
                format!(
                    "{text} (group {}, layer {index} {}, shader {})",
                    names.group, names.layer, names.shader
                )
            }
        }
    }
}
