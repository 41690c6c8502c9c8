//! Reports as JSON. This module must not know what a report says.

use super::Failure;

/// A report as the text of one object, with a line break at the end.
pub(super) fn json(value: &impl serde::Serialize) -> Result<String, Failure> {
    Ok(serde_json::to_string_pretty(value).map_err(Failure::new)? + "\n")
}
