//! Bounds the cost of any input: every limit of the product, in one table.
//!
//! A shader, a texture or a scene may come from an untrusted source. So each stage asks [`Limits`] before it
//! allocates memory or continues work in proportion to its input. The table in this crate is the only place
//! for such numbers: it generates the fields, their names on the command line, and the rows of
//! `docs/limits.md`. Whether a limit is reached depends only on the input, never on the machine; only
//! [`Halt`], which `--max-time` and `--max-memory` cause, depends on time and memory.
//!
//! This crate must not know what is limited: no sources, no programs, no images, no threads.

mod halt;
mod table;

pub use halt::{Cancel, Halt};
pub use table::{Compiling, Images, Limits, Reading, Row, Running, Scenes};

/// Why a limit cannot be set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SetError {
    /// No limit has this name; the nearest existing name, if any.
    Unknown(Option<&'static str>),
    /// The value is not a whole number.
    NoNumber,
}

impl std::fmt::Display for SetError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            SetError::Unknown(Some(near)) => write!(f, "there is no such limit; did you mean `{near}`?"),
            SetError::Unknown(None) => write!(f, "there is no such limit; docs/limits.md lists them"),
            SetError::NoNumber => write!(f, "a limit is a whole number, such as 5000000 or 64k, 16M, 2G"),
        }
    }
}

impl std::error::Error for SetError {}

/// A whole number, optionally followed by k, M or G for 2^10, 2^20 or 2^30; `None` for other text.
pub fn number(text: &str) -> Option<u64> {
    let (digits, shift) = match text.chars().last()? {
        'k' | 'K' => (&text[..text.len() - 1], 10),
        'M' => (&text[..text.len() - 1], 20),
        'G' => (&text[..text.len() - 1], 30),
        _ => (text, 0),
    };
    digits.parse::<u64>().ok()?.checked_mul(1 << shift)
}

impl Limits {
    /// Sets a limit by its name, such as `reading.file_bytes`, from text such as `1000` or `64M`.
    ///
    /// # Errors
    /// There is no such limit, or the text is not a whole number.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), SetError> {
        let value = number(text.trim()).ok_or(SetError::NoNumber)?;
        let Some(field) = self.field(name) else {
            let ends = |row: &&Row| row.name.ends_with(name) || row.name.split('.').nth(1) == Some(name);
            return Err(SetError::Unknown(Limits::rows().iter().find(ends).map(|row| row.name)));
        };
        *field = value;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_set_by_name() {
        let mut limits = Limits::default();
        assert_eq!(limits.set("reading.file_bytes", "64k"), Ok(()));
        assert_eq!(limits.reading.file_bytes, 65536);
        assert_eq!(limits.set("file_bytes", "1"), Err(SetError::Unknown(Some("reading.file_bytes"))));
        assert_eq!(limits.set("reading.file_bytes", "-1"), Err(SetError::NoNumber));
        assert_eq!(limits.set("reading.file_bytes", "99999999999G"), Err(SetError::NoNumber));
        assert_eq!(limits.set("reading.file_bytes", ""), Err(SetError::NoNumber));
        assert_eq!(limits.set("reading.file_bytes", "é"), Err(SetError::NoNumber));
    }

    #[test]
    fn every_row_names_its_field() {
        for row in Limits::rows() {
            let mut limits = Limits::default();
            assert_eq!(limits.field(row.name).copied(), Some(row.default), "{}", row.name);
            assert!(!row.meaning.is_empty() && !row.error.is_empty(), "{}", row.name);
        }
    }

    #[test]
    fn a_halt_is_seen_by_every_copy_and_the_first_counts() {
        let limits = Limits::default();
        let other = limits.clone();
        assert_eq!(limits.halted(), None);
        other.halt(Halt::Time);
        other.halt(Halt::Memory);
        assert_eq!(limits.halted(), Some(Halt::Time));
    }

    #[test]
    fn cancelling_stops_only_the_limits_made_for_it() {
        let (limits, cancel) = (Limits::default(), Cancel::new());
        let until = limits.until(&cancel).clone();
        assert_eq!(until.halted(), None);
        cancel.cancel();
        assert_eq!((until.halted(), limits.halted()), (Some(Halt::Cancelled), None));
        limits.halt(Halt::Time);
        assert_eq!(until.halted(), Some(Halt::Time));
    }
}
