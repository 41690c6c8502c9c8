//! The order to stop that comes from outside: a clock or a measure of memory says it, and every stage hears it.

use crate::Limits;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// What is used up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Halt {
    /// The time that the whole command may take.
    Time = 1,
    /// The memory that the whole command may take.
    Memory = 2,
}

impl std::fmt::Display for Halt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Halt::Time => "the time that --max-time permits is over",
            Halt::Memory => "the memory that --max-memory permits is used up",
        })
    }
}

impl std::error::Error for Halt {}

/// Whether to stop; all copies are one.
#[derive(Clone, Debug, Default)]
pub(crate) struct Flag(Arc<AtomicU8>);

impl Limits {
    /// Tells every stage that works under these limits, or a copy of them, to end. The first reason counts.
    pub fn halt(&self, why: Halt) {
        let _ = self.flag.0.compare_exchange(0, why as u8, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// Whether to end, and why. It costs as much as reading a number.
    pub fn halted(&self) -> Option<Halt> {
        match self.flag.0.load(Ordering::Relaxed) {
            1 => Some(Halt::Time),
            2 => Some(Halt::Memory),
            _ => None,
        }
    }

    /// Whether another copy of these limits exists: somebody who works under them.
    pub fn is_shared(&self) -> bool {
        Arc::strong_count(&self.flag.0) > 1
    }
}
