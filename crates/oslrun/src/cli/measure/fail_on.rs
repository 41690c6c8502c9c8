//! `--fail-on KIND,…`: which findings make the exit code 1.

use osl_measure::sanitize::Kind;

/// A numeric event that fails a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FailOn {
    /// Each of them.
    Any,
    /// One kind.
    One(Kind),
}

/// Reads the name of a kind, or `any`.
pub(super) fn kind(text: &str) -> Result<FailOn, String> {
    if text == "any" {
        return Ok(FailOn::Any);
    }
    Kind::from_name(text).map(FailOn::One).ok_or_else(|| {
        let names: Vec<&str> = Kind::ALL.into_iter().map(Kind::name).collect();
        format!("the kinds are any, {}", names.join(", "))
    })
}

/// Whether a command fails if this happens.
pub(super) fn fails(list: &[FailOn], kind: Kind) -> bool {
    list.iter().any(|wanted| [FailOn::Any, FailOn::One(kind)].contains(wanted))
}
