//! Memory of planes that are no longer needed, for the planes of the next run.
//!
//! The system clears new memory page by page, which for a simple shader takes as long as shading. A program
//! that runs frame after frame pays that once.

use memmap2::MmapMut;
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

/// Maximum number of bytes that are kept, in all.
const MOST: usize = 64 << 20;
/// Minimum number of bytes of a plane that is kept.
const LEAST: usize = 64 << 10;
/// A plane gets memory that is at most this many times as large.
const LARGER: usize = 2;

/// Where words are.
pub(super) enum Memory {
    Own(Vec<u32>),
    /// Pages, and the number of words that count.
    Pages(MmapMut, usize),
}

impl Memory {
    /// Bytes that it has room for.
    pub(super) fn bytes(&self) -> usize {
        match self {
            Memory::Own(own) => own.capacity() * size_of::<u32>(),
            Memory::Pages(pages, _) => pages.len(),
        }
    }
}

static SPARE: Mutex<VecDeque<Memory>> = Mutex::new(VecDeque::new());

/// Memory for at least so many bytes, with any content, if some of this size is kept.
pub(super) fn take(bytes: usize) -> Option<Memory> {
    if bytes < LEAST {
        return None;
    }
    let mut kept = SPARE.lock().unwrap_or_else(PoisonError::into_inner);
    let suits = |memory: &Memory| (bytes..=bytes.saturating_mul(LARGER)).contains(&memory.bytes());
    let at = kept.iter().rposition(suits)?;
    kept.remove(at)
}

/// Keeps memory. The memory that was kept for the longest time makes room for it.
pub(super) fn give(memory: Memory) {
    if !(LEAST..=MOST).contains(&memory.bytes()) {
        return;
    }
    let mut kept = SPARE.lock().unwrap_or_else(PoisonError::into_inner);
    kept.push_back(memory);
    let mut bytes: usize = kept.iter().map(Memory::bytes).sum();
    let mut freed = Vec::new();
    while bytes > MOST
        && let Some(oldest) = kept.pop_front()
    {
        bytes -= oldest.bytes();
        freed.push(oldest);
    }
    // Giving memory back to the system takes a while.
    drop(kept);
    drop(freed);
}
