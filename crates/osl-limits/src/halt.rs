//! The order to stop from outside: a watch of the time or the memory gives it, and every stage checks for it.

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

/// Whether to stop; all copies share one value.
#[derive(Clone, Debug, Default)]
pub(crate) struct Flag(Arc<AtomicU8>);

impl Limits {
    /// Tells every stage that uses these limits, or a copy of them, to stop. The first reason counts.
    pub fn halt(&self, why: Halt) {
        let _ = self.flag.0.compare_exchange(0, why as u8, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// The reason to stop, if any. A call costs as much as reading a number.
    pub fn halted(&self) -> Option<Halt> {
        match self.flag.0.load(Ordering::Relaxed) {
            1 => Some(Halt::Time),
            2 => Some(Halt::Memory),
            _ => None,
        }
    }

    /// Whether another copy of these limits exists, so that they are still in use.
    pub fn is_shared(&self) -> bool {
        Arc::strong_count(&self.flag.0) > 1
    }
}
