//! Slots that hold one texture each, and the bound on what all of them hold together.
//!
//! A slot can be emptied and filled again, so whoever knows the slot needs to know nothing of the bound. A
//! texture that somebody still holds is never dropped, since that would free nothing: the bound is therefore
//! exceeded by what is in use at one time, and by no more. It must not know files or names.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use crate::cache::Loaded;

/// The place of one texture.
#[derive(Debug, Default)]
pub(crate) struct Slot {
    /// The inner cell makes those who want the same texture wait for one read; the lock around it is held to
    /// fetch or replace the cell, never while a file is read.
    cell: Mutex<Arc<OnceLock<Loaded>>>,
    /// The clock when the texture was last asked for.
    last_used: AtomicU64,
}

impl Slot {
    /// Empties the slot if nobody else holds its texture or is about to.
    fn drop_unused(&self) -> bool {
        let mut cell = lock(&self.cell);
        let in_use = Arc::strong_count(&cell) > 1
            || matches!(cell.get(), Some(Ok(texture)) if Arc::strong_count(texture) > 1);
        if !in_use {
            *cell = Arc::default();
        }
        !in_use
    }
}

/// The bound on the bytes of all textures.
#[derive(Debug)]
pub(crate) struct Budget {
    limit: u64,
    clock: AtomicU64,
    ledger: Mutex<Ledger>,
}

#[derive(Debug, Default)]
struct Ledger {
    /// The filled slots, with their bytes.
    filled: Vec<(Arc<Slot>, u64)>,
    held: u64,
}

impl Budget {
    /// A bound in bytes; `u64::MAX` for none.
    pub(crate) fn new(limit: u64) -> Self {
        Self { limit, clock: AtomicU64::new(0), ledger: Mutex::default() }
    }

    /// The bytes of all textures that slots hold.
    pub(crate) fn held(&self) -> u64 {
        lock(&self.ledger).held
    }

    /// The texture of a slot, loaded if the slot is empty.
    pub(crate) fn get(&self, slot: &Arc<Slot>, load: impl FnOnce() -> Loaded) -> Loaded {
        if self.limit < u64::MAX {
            slot.last_used.store(self.clock.fetch_add(1, Ordering::Relaxed), Ordering::Relaxed);
        }
        let cell = Arc::clone(&lock(&slot.cell));
        let mut is_new = false;
        let loaded = cell.get_or_init(|| {
            is_new = true;
            load()
        });
        if is_new && let Ok(texture) = loaded {
            self.charge(slot, texture.bytes());
        }
        loaded.clone()
    }

    /// Enters a slot that was just filled, and drops the textures that were asked for longest ago.
    fn charge(&self, slot: &Arc<Slot>, bytes: u64) {
        let mut ledger = lock(&self.ledger);
        ledger.filled.push((Arc::clone(slot), bytes));
        ledger.held = ledger.held.saturating_add(bytes);
        if ledger.held <= self.limit {
            return;
        }
        // Oldest first; the times are read once each, since other threads go on changing them. The new one is in
        // use by this call, so it stays.
        ledger.filled.sort_by_cached_key(|(slot, _)| slot.last_used.load(Ordering::Relaxed));
        let Ledger { filled, held } = &mut *ledger;
        filled.retain(|(slot, bytes)| {
            let stays = *held <= self.limit || !slot.drop_unused();
            if !stays {
                *held -= bytes;
            }
            stays
        });
    }
}

/// What these locks protect is never left half-changed, so a panic elsewhere does not spoil it.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
