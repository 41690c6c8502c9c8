//! The limits of `scenes`.

use crate::Tripped;

pub(crate) const TRIPPED: Tripped = &[];
