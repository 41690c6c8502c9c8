//! Which warnings are shown, and which of them are errors.
//!
//! A name or code takes precedence over `all` and `warnings`; if several lists name a warning, the most
//! severe one counts. Errors cannot be silenced.

use crate::lessons::{self, Code};
use std::fmt;

/// The levels of warnings. The lists hold names or codes of warnings, `all`, or `warnings` for all that are
/// shown.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Levels {
    /// Warnings to show although they are not shown by default.
    pub warn: Vec<String>,
    /// Warnings to hide.
    pub allow: Vec<String>,
    /// Warnings that are errors.
    pub deny: Vec<String>,
    /// Coordinate and color spaces that the renderer knows besides the usual ones.
    pub known_spaces: Vec<String>,
    /// Whether to show only lints about results that are hardly the intended ones, as if the shader only ran,
    /// and not those about redundant code.
    pub only_severe: bool,
}

/// What happens to a warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It is hidden.
    Hide,
    /// It is shown.
    Show,
    /// It is an error, because the list of denied warnings has this word.
    Deny(&'static str),
}

impl Levels {
    /// Shows a warning that is not shown by default.
    #[must_use]
    pub fn warn(mut self, name: &str) -> Levels {
        self.warn.push(name.to_string());
        self
    }

    /// Hides a warning.
    #[must_use]
    pub fn allow(mut self, name: &str) -> Levels {
        self.allow.push(name.to_string());
        self
    }

    /// Turns a warning into an error.
    #[must_use]
    pub fn deny(mut self, name: &str) -> Levels {
        self.deny.push(name.to_string());
        self
    }

    /// What happens to a warning that is shown by default, or is not.
    pub fn verdict(&self, code: Code, by_default: bool) -> Verdict {
        let Levels { warn, allow, deny, .. } = self;
        let named = |list: &[String]| {
            list.iter().any(|n| n.eq_ignore_ascii_case(code.id) || n.eq_ignore_ascii_case(code.name))
        };
        let has = |list: &[String], word: &str| list.iter().any(|n| n == word);
        if named(deny) {
            Verdict::Deny(code.name)
        } else if named(warn) {
            Verdict::Show
        } else if named(allow) || has(allow, "all") || has(allow, "warnings") {
            Verdict::Hide
        } else if has(deny, "all") {
            Verdict::Deny("all")
        } else if !by_default && !has(warn, "all") {
            Verdict::Hide
        } else if has(deny, "warnings") {
            Verdict::Deny("warnings")
        } else {
            Verdict::Show
        }
    }
}

/// Why a word names no warning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NoWarning {
    /// It names an error, which stays one.
    IsError,
    /// It names nothing; the closest name of a warning, if any.
    Unknown(Option<&'static str>),
}

impl fmt::Display for NoWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NoWarning::IsError => f.write_str("that is an error, and stays one"),
            NoWarning::Unknown(Some(close)) => write!(f, "no such warning; there is one named `{close}`"),
            NoWarning::Unknown(None) => f.write_str("no such warning"),
        }
    }
}

impl std::error::Error for NoWarning {}

/// Checks that a word is `all`, `warnings`, or the name or code of a warning.
///
/// # Errors
/// It is not.
pub fn check_warning(word: &str) -> Result<(), NoWarning> {
    let fits = |code: &Code| word.eq_ignore_ascii_case(code.id) || word.eq_ignore_ascii_case(code.name);
    let codes = lessons::codes();
    if ["all", "warnings"].contains(&word) || codes.iter().any(|code| code.id.starts_with('W') && fits(code))
    {
        return Ok(());
    }
    if codes.iter().any(fits) {
        return Err(NoWarning::IsError);
    }
    let close = lessons::closest(word).first().filter(|code| code.id.starts_with('W')).map(|code| code.name);
    Err(NoWarning::Unknown(close))
}
