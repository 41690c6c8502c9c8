//! The limits of `images`.

use crate::Tripped;

pub(crate) const TRIPPED: Tripped = &[];
