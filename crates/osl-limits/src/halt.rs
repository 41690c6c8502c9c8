//! The order to stop from outside: a watch of the time or the memory gives it, and every stage checks for it.

use crate::Limits;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

/// What is used up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Halt {
    /// The time that the whole command may take.
    Time = 1,
    /// The memory that the whole command may take.
    Memory = 2,
    /// Nothing: somebody cancelled the work, see [`Cancel`].
    Cancelled = 3,
}

impl std::fmt::Display for Halt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Halt::Time => "the time that --max-time permits is over",
            Halt::Memory => "the memory that --max-memory permits is used up",
            Halt::Cancelled => "cancelled",
        })
    }
}

impl std::error::Error for Halt {}

/// Whether to stop; all copies share one value.
#[derive(Clone, Default)]
pub(crate) struct Flag {
    why: Arc<AtomicU8>,
    /// Whoever else may stop this copy and those made from it.
    cancel: Option<Cancel>,
}

impl std::fmt::Debug for Flag {
    /// Limits with the same numbers have one text, whether or not the work is to stop.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Flag")
    }
}

/// Cancels one piece of work from another thread. Copies share one state.
///
/// The work gets limits from [`Limits::until`], and ends with [`Halt::Cancelled`] soon after
/// [`Cancel::cancel`] is called. Cancelled work cannot be resumed.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<State>);

#[derive(Debug, Default)]
struct State {
    cancelled: AtomicBool,
    /// The work that this is a part of.
    whole: Option<Cancel>,
}

impl Cancel {
    /// A state in which nothing is cancelled.
    pub fn new() -> Cancel {
        Cancel::default()
    }

    /// A state for a part of the work, which can be cancelled alone, and is cancelled with the whole.
    #[must_use]
    pub fn part(&self) -> Cancel {
        Cancel(Arc::new(State { whole: Some(self.clone()), ..State::default() }))
    }

    /// Cancels the work. Does not wait for its end.
    pub fn cancel(&self) {
        self.0.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether the work was cancelled.
    pub fn is_cancelled(&self) -> bool {
        let of_whole = || self.0.whole.as_ref().is_some_and(Cancel::is_cancelled);
        self.0.cancelled.load(Ordering::Relaxed) || of_whole()
    }
}

impl Limits {
    /// Tells every stage that uses these limits, or a copy of them, to stop. The first reason counts.
    pub fn halt(&self, why: Halt) {
        let _ = self.flag.why.compare_exchange(0, why as u8, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// The reason to stop, if any. A call costs as much as reading a number.
    pub fn halted(&self) -> Option<Halt> {
        match self.flag.why.load(Ordering::Relaxed) {
            1 => Some(Halt::Time),
            2 => Some(Halt::Memory),
            3 => Some(Halt::Cancelled),
            _ => self.flag.cancel.as_ref().filter(|cancel| cancel.is_cancelled()).map(|_| Halt::Cancelled),
        }
    }

    /// A copy that also stops when the work is cancelled. It still shares the order to stop.
    #[must_use]
    pub fn until(&self, cancel: &Cancel) -> Limits {
        let mut limits = self.clone();
        limits.flag.cancel = Some(cancel.clone());
        limits
    }

    /// Whether another copy of these limits exists, so that they are still in use.
    pub fn is_shared(&self) -> bool {
        Arc::strong_count(&self.flag.why) > 1
    }
}
