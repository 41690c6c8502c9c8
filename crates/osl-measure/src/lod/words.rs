//! Numbers in words, for the report and for comments in the written source.
//!
//! This module must not know what they measure.

use crate::explain::plain;

/// A number of samples.
pub(super) fn samples(n: u32) -> String {
    if n == 1 { "one sample".to_string() } else { format!("{n} samples") }
}

/// A share as percent with two digits.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", plain(100.0 * share, 2))
}
