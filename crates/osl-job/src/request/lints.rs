//! Which warnings are reported, and which of them are errors.

use osl::{Levels, NoWarning};
use osl_syntax::diagnostic::Code;

/// The warnings that a user asks for, by name or code.
#[derive(Clone, Debug, Default)]
pub struct Lints {
    /// Warnings to show that are not shown by default, or `all`; `error` stands for `warnings` in `deny`.
    pub warn: Vec<String>,
    /// Warnings to silence, or `all`.
    pub allow: Vec<String>,
    /// Warnings that become errors; `warnings` for all that are shown, or `all`. With `errors`, an error that
    /// a shader reports while it runs fails the run.
    pub deny: Vec<String>,
    /// Coordinate and color spaces that the renderer knows.
    pub known_space: Vec<String>,
}

impl Lints {
    /// Whether errors of a running shader fail the run.
    pub fn denies_errors(&self) -> bool {
        self.deny.iter().any(|name| name == "errors")
    }

    /// Whether the command line asks for this warning, by name, by code or with all others.
    pub fn asks_for(&self, code: Code) -> bool {
        let fits = |word: &String| {
            word == "all" || word.eq_ignore_ascii_case(code.id) || word.eq_ignore_ascii_case(code.name)
        };
        self.warn.iter().any(fits)
    }

    /// The levels that the command line sets.
    pub(crate) fn levels(&self) -> Levels {
        let mut levels = Levels::default();
        levels.warn.clone_from(&self.warn);
        levels.allow.clone_from(&self.allow);
        levels.deny.clone_from(&self.deny);
        levels.known_spaces.clone_from(&self.known_space);
        // `-Werror`.
        if self.warn.iter().any(|word| word == "error") {
            levels.deny.push("warnings".to_string());
        }
        levels
    }
}

/// Checks the name of a warning that an option takes.
pub fn denied(text: &str) -> Result<String, String> {
    if text == "errors" { Ok(text.to_string()) } else { warning(text) }
}

/// Checks the name of a warning that an option takes.
pub fn warning_or_error(text: &str) -> Result<String, String> {
    if text == "error" { Ok(text.to_string()) } else { warning(text) }
}

/// Checks the name of a warning that an option takes.
pub fn warning(text: &str) -> Result<String, String> {
    match osl::check_warning(text) {
        Ok(()) => Ok(text.to_string()),
        Err(NoWarning::Unknown(None)) => {
            Err("no such warning; `oslrun explain-error --list` lists them".to_string())
        }
        Err(why) => Err(why.to_string()),
    }
}
