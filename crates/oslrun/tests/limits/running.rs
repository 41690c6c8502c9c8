//! The limits of `running`.

use crate::Tripped;

pub(crate) const TRIPPED: Tripped = &[];
