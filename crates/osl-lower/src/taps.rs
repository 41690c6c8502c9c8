//! Taps: variables at a line of the source as outputs of the body.
//!
//! [`TapPath`] is a tap as a user writes it, `42:dist`. [`find`] looks in the resolved tree for the statement
//! and the variable, and lowering copies the variable after the statement. A tap computes nothing, so the
//! bits of other outputs do not change; without taps, lowering writes nothing.

mod find;
mod sets;
mod write;

pub use find::{TapError, find, find_in, lines};
pub use sets::{Branch, Doings, Most, Rounds, Set, doing_lines, doings};
pub(crate) use write::Tapping;

use osl_hir::hir::VarId;
use osl_ir::types::Type;
use std::sync::Arc;

/// A tap as a user writes it: `[FILE:][CALL_LINE/]LINE:VARIABLE[.FIELD][[ELEMENT]][@ROUND]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TapPath {
    /// The end of the name of the file; `None` means the main file of the last shader.
    pub file: Option<String>,
    /// The lines of the calls that lead to the line, from the outermost. Other calls do not count.
    pub calls: Vec<u32>,
    /// The line, from 1.
    pub line: u32,
    /// The variable.
    pub variable: String,
    /// Fields and elements of the variable.
    pub path: Vec<TapPart>,
    /// Which visit counts, from 1; `None` means the last.
    pub round: Option<u32>,
}

/// A part of a variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TapPart {
    /// A field of a struct.
    Field(String),
    /// An element of an array, or a component of a triple.
    Element(u32),
}

impl std::fmt::Display for TapPart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            TapPart::Field(field) => write!(f, ".{field}"),
            TapPart::Element(index) => write!(f, "[{index}]"),
        }
    }
}

/// The largest number of calls in a tap.
const MAX_CALLS: usize = 64;

impl TapPath {
    /// Reads a tap.
    ///
    /// # Errors
    /// What is wrong, as text for the user.
    pub fn parse(text: &str) -> Result<TapPath, String> {
        let wrong =
            || format!("a tap is LINE:VARIABLE, such as 42:dist, 42:dist@3 or 42:list[2].x, not `{text}`");
        let (place, variable) = text.rsplit_once(':').ok_or_else(wrong)?;
        let (file, lines) = match place.rsplit_once(':') {
            Some((file, lines)) => (Some(file.to_string()).filter(|file| !file.is_empty()), lines),
            None => (None, place),
        };
        let number = |text: &str| text.trim().parse().ok().filter(|n: &u32| *n > 0).ok_or_else(wrong);
        let mut calls = lines.split('/').map(number).collect::<Result<Vec<u32>, String>>()?;
        let line = calls.pop().ok_or_else(wrong)?;
        if calls.len() > MAX_CALLS {
            return Err(format!("a tap names at most {MAX_CALLS} calls"));
        }
        let (variable, round) = match variable.rsplit_once('@') {
            Some((variable, round)) => (variable, Some(number(round)?)),
            None => (variable, None),
        };
        let (variable, path) = parts(variable.trim()).ok_or_else(wrong)?;
        Ok(TapPath { file, calls, line, variable, path, round })
    }

    /// The variable with its fields and elements, as in the source.
    pub fn variable_path(&self) -> String {
        let mut text = self.variable.clone();
        self.path.iter().for_each(|part| text += &part.to_string());
        text
    }

    /// The name of the output: `line42.dist`, `line42.dist.round3`, `call57.line42.dist`.
    pub fn output(&self) -> String {
        let mut name = String::new();
        if let Some(file) = &self.file {
            let file = file.rsplit(['/', '\\']).next().unwrap_or(file);
            name += &format!("{}.", file.replace('.', "_"));
        }
        self.calls.iter().for_each(|line| name += &format!("call{line}."));
        name += &format!("line{}.{}", self.line, self.variable);
        for part in &self.path {
            name += &match part {
                TapPart::Field(field) => format!(".{field}"),
                TapPart::Element(index) => format!(".{index}"),
            };
        }
        if let Some(round) = self.round {
            name += &format!(".round{round}");
        }
        name
    }

    /// The name of the output that is 1 where the point got to the line.
    pub fn mask(&self) -> String {
        format!("{}.reached", self.output())
    }
}

/// The text that [`TapPath::parse`] reads.
impl std::fmt::Display for TapPath {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.file.iter().try_for_each(|file| write!(f, "{file}:"))?;
        self.calls.iter().try_for_each(|line| write!(f, "{line}/"))?;
        write!(f, "{}:{}", self.line, self.variable_path())?;
        self.round.iter().try_for_each(|round| write!(f, "@{round}"))
    }
}

/// The name of a variable and the path after it.
fn parts(text: &str) -> Option<(String, Vec<TapPart>)> {
    let is_name = |text: &str| {
        !text.is_empty()
            && !text.starts_with(|c: char| c.is_ascii_digit())
            && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    let end = text.find(['.', '[']).unwrap_or(text.len());
    let (name, mut rest) = text.split_at(end);
    let mut path = Vec::new();
    while let Some(first) = rest.chars().next() {
        if first == '[' {
            let (index, after) = rest.get(1..)?.split_once(']')?;
            path.push(TapPart::Element(index.trim().parse().ok()?));
            rest = after;
        } else {
            let after = rest.get(1..)?;
            let end = after.find(['.', '[']).unwrap_or(after.len());
            let (field, after) = after.split_at(end);
            if first != '.' || !is_name(field) {
                return None;
            }
            path.push(TapPart::Field(field.to_string()));
            rest = after;
        }
    }
    is_name(name).then(|| (name.to_string(), path))
}

/// A tap of a program, found by [`find`].
#[derive(Clone, Debug)]
pub struct Tap {
    /// Name of the output.
    pub name: Arc<str>,
    /// Name of the output that is 1 where the point got to the line. It does not exist if every point does.
    pub mask: Arc<str>,
    /// The layer, by its index.
    pub layer: usize,
    /// The type of the output.
    pub ty: Type,
    /// Whether some points may not get there, from the statement alone.
    pub(crate) conditional: bool,
    pub(crate) site: Site,
    pub(crate) var: Tapped,
    /// Fields, by index.
    pub(crate) fields: Vec<usize>,
    pub(crate) elements: Vec<u32>,
    pub(crate) component: Option<u32>,
    /// Which visit counts, from 1; `None` means the last.
    pub(crate) round: Option<u32>,
    /// For each required call, the range of positions of its line.
    pub(crate) calls: Vec<(u32, u32)>,
}

/// Where a tap is, by the start and the end of a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Site {
    /// After a statement.
    After(u32, u32),
    /// At the end of each round of a loop.
    Round(u32, u32),
    /// At the start of each round of a loop.
    Start(u32, u32),
    /// Where a condition is true.
    True(u32, u32),
    /// Where a condition is false.
    False(u32, u32),
}

/// What a tap copies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tapped {
    /// A variable.
    Var(VarId),
    /// The value that a function returns.
    Returned,
    /// The number of times that a point got there.
    Visits,
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;

    #[test]
    fn taps_are_read_and_named() {
        let name = |text: &str| TapPath::parse(text).map(|wanted| wanted.output());
        assert_eq!(name("42:dist").unwrap(), "line42.dist");
        assert_eq!(name("42:dist@3").unwrap(), "line42.dist.round3");
        assert_eq!(name("57/42:a[2].x").unwrap(), "call57.line42.a.2.x");
        assert_eq!(name("lib/noise.h:7:n").unwrap(), "noise_h.line7.n");
        assert_eq!(TapPath::parse("42:dist").unwrap().mask(), "line42.dist.reached");
        for text in ["42:dist", "42:dist@3", "57/42:a[2].x", "lib/noise.h:1/7:n"] {
            assert_eq!(TapPath::parse(text).unwrap().to_string(), text);
        }
        for wrong in [
            "", "dist", "0:a", "a:b", "1:", "1:2", "1:a[", "1:a.", "1:a@0", "1:a@x", "1:a-b", "/1:a",
            "1:a[-1]",
        ] {
            assert!(TapPath::parse(wrong).is_err(), "{wrong}");
        }
    }
}
