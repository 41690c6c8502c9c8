//! The messages of shaders while they run: one line for each message and place, with the number of points and
//! the first pixel.
//!
//! Errors that a shader reports do not fail the run: the image is written, and the last line counts the
//! errors, unless the request denies them. A file that cannot be used has only one line, even if several
//! calls use it, and so has an attribute that is not answered.

use crate::Failure;
use crate::event::{Event, Sink};
use crate::message::{Message, Place, Severity};
use osl_exec::{Keeping, Message as Raised, Said, Severity as Level};
use osl_image::{Missing, TextureCache};
use osl_ir::Span;
use osl_measure::explain::Reported;
use osl_syntax::source::{Position, SourceMap};
use std::collections::HashMap;
use std::sync::Arc;

/// Maximum number of different messages that are shown for one place, and of notes, which have no place.
const AT_A_PLACE: usize = 5;
const NOTES: usize = 50;

/// The facts about a run that a report needs.
pub struct Report<'a> {
    /// The files of the shader.
    pub sources: &'a SourceMap,
    /// The number of points, and their name in messages.
    pub points: (u64, &'static str),
    /// Pixels per row, if points belong to pixels.
    pub width: Option<usize>,
    /// The folders that were searched for files, and the option that adds a folder.
    pub textures: &'a TextureCache,
    /// The option that adds a folder to the search for files.
    pub path_option: &'a str,
    /// The values of string parameters.
    pub texts: &'a [(String, Arc<str>)],
}

/// The numbers of errors and warnings that shaders reported.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Different errors.
    pub errors: usize,
    /// Different warnings.
    pub warnings: usize,
}

impl Tally {
    /// Adds the numbers of another run.
    pub fn add(&mut self, other: Tally) {
        self.errors += other.errors;
        self.warnings += other.warnings;
    }

    /// A failure if there are errors and the command line denies them.
    pub fn judge(self, denied: bool) -> Result<(), Failure> {
        if self.errors == 0 || !denied {
            return Ok(());
        }
        Err(Failure::new(format!(
            "{} while shading; no image is written because of `--deny errors`",
            self.words()
        )))
    }

    /// `2 errors and 1 warning`.
    fn words(self) -> String {
        let count = |n: usize, what: &str| match n {
            0 => None,
            1 => Some(format!("1 {what}")),
            n => Some(format!("{n} {what}s")),
        };
        let all = [count(self.errors, "error"), count(self.warnings, "warning")];
        all.into_iter().flatten().collect::<Vec<_>>().join(" and ")
    }

    /// The text after the name of a written file: `; 2 errors while shading`.
    pub fn suffix(self) -> String {
        if self == Tally::default() { String::new() } else { format!("; {} while shading", self.words()) }
    }

    /// Prints which files were written; if none, prints the numbers of messages.
    pub fn wrote(self, files: &[std::path::PathBuf], out: &mut dyn std::io::Write) {
        for (at, file) in files.iter().enumerate() {
            let suffix = if at + 1 == files.len() { self.suffix() } else { String::new() };
            let _ = writeln!(out, "wrote {}{suffix}", file.display());
        }
        if files.is_empty() && self != Tally::default() {
            let _ = writeln!(out, "{} while shading", self.words());
        }
    }
}

/// How a run stores messages for a report: places on the same line count as one, in all copies of a file.
pub fn keeping(sources: &SourceMap) -> Keeping {
    let sources = sources.clone();
    let line = move |span: Span| {
        let Some(file) = sources.file_at(span.start) else { return span };
        let before = file.text.get(..(span.start - file.base) as usize).unwrap_or_default();
        let start = before.rfind('\n').map_or(0, |at| at as u32 + 1);
        let first = sources.files().iter().find(|f| f.name == file.name && f.text == file.text);
        let start = first.map_or(file.base, |f| f.base) + start;
        Span::new(start, start)
    };
    Keeping { each: false, places: Some(Arc::new(line)) }
}

impl Report<'_> {
    /// Sends the messages of a run, and counts them.
    pub fn send(&self, messages: &[Said], sink: &mut dyn Sink) -> Tally {
        let (lines, tally) = self.lines(messages);
        lines.iter().for_each(|line| sink.event(Event::Message(line)));
        tally
    }

    /// The messages of a run at the lines of one file: the line, the text, and whether it is an error.
    pub fn at_lines(&self, messages: &[Said], file: &str) -> Vec<(u32, String, bool)> {
        let (lines, _) = self.lines(messages);
        let here = |line: &Message| line.at.as_ref().filter(|at| at.file == file).map(|at| at.line);
        lines
            .iter()
            .filter_map(|line| {
                let text = Message { at: None, ..line.clone() }.text();
                Some((here(line)?, text, line.severity == Severity::Error))
            })
            .collect()
    }

    /// A message without the points that caused it: its place, and its text.
    pub fn told(&self, said: &Said) -> Vec<(Option<Span>, Reported)> {
        let (lines, _) = self.lines(std::slice::from_ref(said));
        let told =
            |Message { severity, message, help, .. }| Reported { severity: severity.word(), message, help };
        lines.into_iter().map(|line| (said.message.at, told(line))).collect()
    }

    /// The lines: one for each file, and one for each place and text, up to a limit.
    fn lines(&self, messages: &[Said]) -> (Vec<Message>, Tally) {
        let (mut lines, mut tally): (Vec<Message>, _) = (Vec::new(), Tally::default());
        let mut files: HashMap<Arc<str>, usize> = HashMap::new();
        let mut known_lines: HashMap<(Level, Option<Place>, String), usize> = HashMap::new();
        let mut places: HashMap<(Level, Option<Place>), (usize, usize)> = HashMap::new();
        for said in messages {
            let message = &said.message;
            let known = message.file.as_ref().and_then(|file| files.get(file));
            if let Some(line) = known.and_then(|at| lines.get_mut(*at)) {
                // Several calls use the file, mostly at the same points.
                line.points = line.points.max(said.points);
                continue;
            }
            let line = match &message.file {
                None => self.line(said, brief(message, self.sources)),
                Some(file) => {
                    files.insert(file.clone(), lines.len());
                    let parameter = self.parameter(file);
                    let (text, help) = self.unusable(file, parameter.as_deref(), message);
                    Message { help, texture: Some(file.to_string()), parameter, ..self.line(said, text) }
                }
            };
            // Copies of a layer report the same.
            let key = (message.severity, line.at.clone(), line.message.clone());
            if let Some(line) = known_lines.get(&key).and_then(|at| lines.get_mut(*at)) {
                line.points = line.points.zip(said.points).map(|(a, b)| a.max(b));
                continue;
            }
            known_lines.insert(key, lines.len());
            let most = match message.severity {
                Level::Error => {
                    tally.errors += 1;
                    AT_A_PLACE
                }
                Level::Warning => {
                    tally.warnings += 1;
                    AT_A_PLACE
                }
                Level::Note => NOTES,
            };
            let (count, last) = places.entry((message.severity, line.at.clone())).or_insert((0, lines.len()));
            *count += 1;
            if *count > most {
                let more = *count - most;
                if more > 1
                    && let Some(line) = lines.get_mut(*last)
                {
                    // How many points they have together is not known: a point may have several.
                    let of = if line.at.is_some() { " of this line" } else { "" };
                    line.message = format!("and {more} other messages{of}");
                    (line.points, line.pixel) = (None, None);
                    continue;
                }
            }
            *last = lines.len();
            lines.push(line);
        }
        (lines, tally)
    }

    fn line(&self, said: &Said, message: String) -> Message {
        let at = said.message.at.and_then(|span| self.sources.place(span));
        Message {
            severity: match said.message.severity {
                Level::Error => Severity::Error,
                Level::Warning => Severity::Warning,
                Level::Note => Severity::Note,
            },
            message,
            help: None,
            at: at.map(|Position { file, line, .. }| Place { file, line }),
            points: said.points,
            of: self.points,
            pixel: self.width.map(|width| [said.first % width.max(1), said.first / width.max(1)]),
            texture: None,
            parameter: None,
        }
    }

    /// The parameter whose value is this file name.
    fn parameter(&self, file: &str) -> Option<String> {
        self.texts.iter().find(|(_, text)| **text == *file).map(|(name, _)| name.clone())
    }

    /// Why a file cannot be used, and how to solve it.
    fn unusable(&self, file: &str, parameter: Option<&str>, message: &Raised) -> (String, Option<String>) {
        let (shown, option) = (file.escape_debug(), self.path_option);
        let of = parameter.map_or_else(String::new, |name| format!(" of parameter `{name}`"));
        let give = parameter.map(|name| format!("-p {name}=FILE names a file"));
        match self.textures.missing(file) {
            _ if file.is_empty() => match parameter {
                Some(name) => (format!("parameter `{name}` is empty, so its texture is black"), give),
                None => ("the name of a texture is empty, so the texture is black".to_string(), None),
            },
            Some(Missing::Outside) => (
                format!(
                    "the file \"{shown}\"{of} is refused: it is outside of the working directory and the search paths"
                ),
                Some(format!("{option} DIR admits its folder, --allow-files any file")),
            ),
            Some(Missing::NotFound) => {
                let folders = self.textures.folders().iter().map(|folder| folder.display().to_string());
                let named: Vec<String> = folders.filter(|f| !f.is_empty() && f != ".").collect();
                let also =
                    if named.is_empty() { String::new() } else { format!(" nor in {}", named.join(", ")) };
                let text = format!("there is no file \"{shown}\"{of} in the working directory{also}");
                let folder = format!("{option} DIR adds a folder");
                (text, Some(give.map_or(folder.clone(), |give| format!("{folder}, {give}"))))
            }
            None => {
                let text = brief(message, self.sources);
                (format!("the file \"{shown}\"{of} cannot be used: {text}"), give)
            }
        }
    }
}

/// The message in short, without the position at its start.
fn brief(message: &Raised, sources: &SourceMap) -> String {
    let place =
        |span| sources.place(span).map_or_else(String::new, |p: Position| format!("{}:{}", p.file, p.line));
    let here = message.at.map(place);
    let [own] = &message.places[..] else { return message.show(place).trim_end().to_string() };
    if here.as_deref() != Some(&place(*own)) {
        return message.show(place).trim_end().to_string();
    }
    let text = message.text.trim_end_matches(", called from ({0})").trim_end_matches(": {0}");
    match index(text) {
        Some(text) => text,
        None => text.replace("{0}", &place(*own)),
    }
}

/// The short form of `Index [5] out of range a[0..4]`.
fn index(text: &str) -> Option<String> {
    let (index, rest) = text.strip_prefix("Index [")?.split_once("] out of range ")?;
    let (name, range) = rest.strip_suffix(']')?.rsplit_once('[')?;
    Some(format!("index {index} out of {range} of `{name}`"))
}
