//! The source map: which files were read, and where a global offset lies in them.
//!
//! Files arrive through a [`SourceProvider`]; this crate never opens one itself.

use crate::span::Span;
use std::sync::Arc;

/// Index of a file in the [`SourceMap`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FileId(pub u32);

/// One source file.
#[derive(Clone, Debug)]
pub struct SourceFile {
    /// The name as diagnostics show it.
    pub name: String,
    /// Its text.
    pub text: Arc<str>,
    /// Global offset of its first byte.
    pub base: u32,
}

/// All files of a translation unit. The first one added is the main file.
#[derive(Clone, Debug, Default)]
pub struct SourceMap {
    files: Vec<SourceFile>,
}

/// A place as people count: file name, 1-based line, 1-based column in characters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Name of the file.
    pub file: String,
    /// Line, from 1.
    pub line: u32,
    /// Column, from 1, in characters.
    pub column: u32,
}

impl SourceMap {
    /// Adds a file. `None` when the offset space (4 GiB) is used up.
    pub fn add(&mut self, name: impl Into<String>, text: Arc<str>) -> Option<FileId> {
        // One unused offset between files keeps an end of one apart from the start of the next.
        let base = match self.files.last() {
            None => 0,
            Some(f) => f.base.checked_add(u32::try_from(f.text.len()).ok()?)?.checked_add(1)?,
        };
        base.checked_add(u32::try_from(text.len()).ok()?)?;
        self.files.push(SourceFile { name: name.into(), text, base });
        Some(FileId(self.files.len() as u32 - 1))
    }

    /// Adds all files of another map behind its own. Returns what to add to a span of the other map to make it one of
    /// this; `None` when the offset space is used up.
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

    /// The files in the order of their first reading.
    pub fn files(&self) -> &[SourceFile] {
        &self.files
    }

    /// The file that holds a global offset.
    pub fn file_at(&self, offset: u32) -> Option<&SourceFile> {
        let after = self.files.partition_point(|f| f.base <= offset);
        self.files.get(after.checked_sub(1)?)
    }

    /// The text of a span; empty where it does not lie within one file.
    pub fn text(&self, span: Span) -> &str {
        self.file_at(span.start)
            .and_then(|f| f.text.get((span.start - f.base) as usize..span.end.checked_sub(f.base)? as usize))
            .unwrap_or("")
    }

    /// Line and column of the start of a span.
    pub fn place(&self, span: Span) -> Option<Place> {
        let file = self.file_at(span.start)?;
        let before = file.text.get(..(span.start - file.base) as usize)?;
        let line_start = before.rfind('\n').map_or(0, |n| n + 1);
        Some(Place {
            file: file.name.clone(),
            line: before.bytes().filter(|b| *b == b'\n').count() as u32 + 1,
            column: before.get(line_start..)?.chars().count() as u32 + 1,
        })
    }
}

/// Where `#include` finds its files. The driver implements it; tests use a map.
pub trait SourceProvider {
    /// Finds the file that `#include` names. `from` is the name of the including file as the
    /// provider gave it; `quoted` tells `"x"` from `<x>`. Returns its full name and text.
    ///
    /// # Errors
    /// The reason, in words for the user: not found, not text, too large.
    fn include(&self, name: &str, quoted: bool, from: &str) -> Result<(String, Arc<str>), String>;

    /// A `stdosl.h` to read before the first line of every shader, in place of the one of the compiler: its full name
    /// and text. `None` if there is none, an error in words if it cannot be read.
    fn standard(&self) -> Option<Result<(String, Arc<str>), String>> {
        None
    }
}
