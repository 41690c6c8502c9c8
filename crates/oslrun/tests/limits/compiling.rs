//! The limits of `compiling`.

use crate::Tripped;

pub(crate) const TRIPPED: Tripped = &[];
