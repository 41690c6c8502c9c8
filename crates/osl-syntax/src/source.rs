//! The source map: the files that were read, and their ranges of global offsets.
//!
//! Files come from a [`SourceProvider`]; this crate never opens one itself.

use crate::span::Span;
use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

/// Index of a file in the [`SourceMap`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FileId(pub u32);

/// What a [`SourceProvider`] says about a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// Whether messages must not show its text, see [`crate::hidden`].
    pub hidden: bool,
    /// The offset in the text of the first byte that was not UTF-8.
    pub first_foreign: Option<usize>,
}

/// The text with a line feed in place of each carriage return that stands alone, which ends a line too. No
/// offset changes.
pub fn with_line_ends(text: &str) -> Cow<'_, str> {
    let is_alone = |at: usize| text.as_bytes().get(at + 1) != Some(&b'\n');
    if !text.match_indices('\r').any(|(at, _)| is_alone(at)) {
        return Cow::Borrowed(text);
    }
    let ends = text.char_indices().map(|(at, c)| if c == '\r' && is_alone(at) { '\n' } else { c });
    Cow::Owned(ends.collect())
}

/// One source file.
#[derive(Clone, Debug)]
pub struct SourceFile {
    /// The name shown in diagnostics.
    pub name: String,
    /// Its text.
    pub text: Arc<str>,
    /// Global offset of its first byte.
    pub base: u32,
    /// What its provider says about it.
    pub about: About,
    /// The starts of its lines, computed on first use, since most files are never mentioned.
    lines: OnceLock<Arc<[u32]>>,
}

impl SourceFile {
    fn lines(&self) -> &[u32] {
        self.lines.get_or_init(|| {
            let breaks = self.text.bytes().enumerate().filter(|(_, b)| *b == b'\n');
            std::iter::once(0).chain(breaks.map(|(at, _)| at as u32 + 1)).collect()
        })
    }

    /// The line, from 1, that contains an offset of the text, by binary search.
    pub fn line_at(&self, offset: usize) -> u32 {
        self.lines().partition_point(|start| *start as usize <= offset) as u32
    }

    /// The start of a line, counted from 1, in the text.
    pub fn line_start(&self, line: u32) -> Option<usize> {
        self.lines().get(line.checked_sub(1)? as usize).map(|start| *start as usize)
    }

    /// The text of a line, counted from 1, without its end.
    pub fn line(&self, line: u32) -> Option<&str> {
        let start = self.line_start(line)?;
        let end = self.line_start(line + 1).unwrap_or(self.text.len());
        let text = self.text.get(start..end)?;
        let text = text.strip_suffix('\n').unwrap_or(text);
        Some(text.strip_suffix('\r').unwrap_or(text))
    }
}

/// All files of a translation unit. The first one added is the main file.
#[derive(Clone, Debug, Default)]
pub struct SourceMap {
    files: Vec<SourceFile>,
}

/// A human-readable location: file name, 1-based line, 1-based column in characters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Position {
    /// Name of the file.
    pub file: String,
    /// Line, from 1.
    pub line: u32,
    /// Column, from 1, in characters.
    pub column: u32,
}

impl SourceMap {
    /// Adds a file. `None` if the offset space (4 GiB) is used up.
    pub fn add(&mut self, name: impl Into<String>, text: Arc<str>) -> Option<FileId> {
        self.add_about(name, text, About::default())
    }

    /// Adds a file with what its provider says about it.
    pub fn add_about(&mut self, name: impl Into<String>, text: Arc<str>, about: About) -> Option<FileId> {
        // One unused offset between files separates the end of one from the start of the next.
        let base = match self.files.last() {
            None => 0,
            Some(f) => f.base.checked_add(u32::try_from(f.text.len()).ok()?)?.checked_add(1)?,
        };
        base.checked_add(u32::try_from(text.len()).ok()?)?;
        self.files.push(SourceFile { name: name.into(), text, base, about, lines: OnceLock::new() });
        Some(FileId(self.files.len() as u32 - 1))
    }

    /// Says what is special about the main file.
    pub fn tell(&mut self, about: About) {
        if let Some(main) = self.files.first_mut() {
            main.about = about;
        }
    }

    /// Appends all files of another map. Returns the number to add to a span of the other map to make it one
    /// of this map; `None` if the offset space is used up.
    pub fn append(&mut self, other: &SourceMap) -> Option<u32> {
        let base = match self.files.last() {
            None => 0,
            Some(f) => f.base.checked_add(u32::try_from(f.text.len()).ok()?)?.checked_add(1)?,
        };
        let end = other.files.last().map_or(Some(0), |f| f.base.checked_add(f.text.len() as u32))?;
        base.checked_add(end)?.checked_add(1)?;
        self.files.extend(other.files.iter().map(|f| SourceFile { base: f.base + base, ..f.clone() }));
        Some(base)
    }

    /// The files in the order in which they were first read.
    pub fn files(&self) -> &[SourceFile] {
        &self.files
    }

    /// The file that contains a global offset.
    pub fn file_at(&self, offset: u32) -> Option<&SourceFile> {
        let after = self.files.partition_point(|f| f.base <= offset);
        self.files.get(after.checked_sub(1)?)
    }

    /// The text of a span; empty if it is not within one file.
    pub fn text(&self, span: Span) -> &str {
        self.file_at(span.start)
            .and_then(|f| f.text.get((span.start - f.base) as usize..span.end.checked_sub(f.base)? as usize))
            .unwrap_or("")
    }

    /// Line and column of the start of a span.
    pub fn place(&self, span: Span) -> Option<Position> {
        let file = self.file_at(span.start)?;
        let at = (span.start - file.base) as usize;
        let line = file.line_at(at);
        let before = file.text.get(file.line_start(line)?..at)?;
        Some(Position { file: file.name.clone(), line, column: before.chars().count() as u32 + 1 })
    }

    /// The file and the line, from 1, of the start of a span.
    pub fn line(&self, span: Span) -> Option<(&SourceFile, u32)> {
        let file = self.file_at(span.start)?;
        let at = (span.start - file.base) as usize;
        (at <= file.text.len()).then(|| (file, file.line_at(at)))
    }
}

/// Finds the files for `#include`. The driver implements it; tests use a map.
pub trait SourceProvider {
    /// Finds the file that `#include` names. `from` is the name of the including file as the provider
    /// returned it; `quoted` distinguishes `"x"` from `<x>`. Returns the file's full name and text.
    ///
    /// # Errors
    /// The reason, as text for the user: not found, not text, too large.
    fn include(&self, name: &str, quoted: bool, from: &str) -> Result<(String, Arc<str>), String>;

    /// The names of files that an `#include` in the file `from` could name, to suggest one for a misspelt
    /// name.
    fn names(&self, _from: &str) -> Vec<String> {
        Vec::new()
    }

    /// What is special about a file, by the full name of an included one or by the name of the main file.
    fn about(&self, _name: &str) -> About {
        About::default()
    }

    /// A `stdosl.h` to read before the first line of every shader in place of the compiler's: its full name
    /// and text. `None` if there is none; an error as text if it cannot be read.
    fn standard(&self) -> Option<Result<(String, Arc<str>), String>> {
        None
    }
}
