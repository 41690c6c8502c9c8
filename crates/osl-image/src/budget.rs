//! Slots that hold one texture each, and the bound on the memory of all of them.
//!
//! A slot can be emptied and filled again, so users of a slot need not know the bound. A texture in use is
//! never dropped, since that would free nothing: only textures in use at the same time can exceed the bound.
//! A decoder first reserves its memory and waits while others decode, so that many threads that read large
//! files need no more memory than one.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};

use crate::loaded::TextureResult;

/// Approximate memory of a texture besides its samples; it bounds how many tiny ones are kept.
const OVERHEAD: u64 = 1024;

/// The slot of one texture.
#[derive(Debug, Default)]
pub(crate) struct Slot {
    /// The inner cell makes threads that want the same texture wait for one read. The lock around it is held
    /// only to fetch or replace the cell, never while a file is read.
    cell: Mutex<Arc<OnceLock<TextureResult>>>,
    /// The clock at the last request for the texture.
    last_used: AtomicU64,
}

impl Slot {
    /// Whether the slot holds a texture.
    pub(crate) fn holds_texture(&self) -> bool {
        matches!(lock(&self.cell).get(), Some(Ok(_)))
    }

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
    /// Bytes that textures may hold.
    limit: u64,
    /// Bytes that decoding may use in addition.
    working: u64,
    /// Maximum number of textures.
    count: usize,
    clock: AtomicU64,
    ledger: Mutex<Ledger>,
    /// Notified when a reservation ends.
    ended: Condvar,
}

#[derive(Debug, Default)]
struct Ledger {
    /// The filled slots, with their bytes.
    filled: Vec<(Arc<Slot>, u64)>,
    held: u64,
    /// Bytes that decoders have reserved.
    reserved: u64,
}

/// Memory that a decoder may use until this is dropped.
#[derive(Debug)]
pub(crate) struct Reservation<'a> {
    budget: &'a Budget,
    bytes: u64,
}

impl Drop for Reservation<'_> {
    fn drop(&mut self) {
        lock(&self.budget.ledger).reserved -= self.bytes;
        self.budget.ended.notify_all();
    }
}

impl Budget {
    /// A bound on the bytes of textures, on the additional bytes for decoding, and on the number of textures.
    pub(crate) fn new(limit: u64, working: u64, count: u64) -> Self {
        Self {
            limit,
            working,
            count: usize::try_from(count).unwrap_or(usize::MAX).max(1),
            clock: AtomicU64::new(0),
            ledger: Mutex::default(),
            ended: Condvar::new(),
        }
    }

    /// The bytes of all textures that slots hold.
    pub(crate) fn held(&self) -> u64 {
        lock(&self.ledger).held
    }

    /// The texture of a slot, loaded if the slot is empty. The memory reserved for loading is then released.
    pub(crate) fn get<'a>(
        &'a self,
        slot: &Arc<Slot>,
        load: impl FnOnce() -> (TextureResult, Option<Reservation<'a>>),
    ) -> TextureResult {
        slot.last_used.store(self.clock.fetch_add(1, Ordering::Relaxed), Ordering::Relaxed);
        let cell = Arc::clone(&lock(&slot.cell));
        let mut is_new = false;
        let mut reserved = None;
        let loaded = cell.get_or_init(|| {
            is_new = true;
            let (loaded, reservation) = load();
            reserved = reservation;
            loaded
        });
        // The reserved memory now counts as held, so it must not count twice.
        drop(reserved);
        if is_new && let Ok(texture) = loaded {
            self.charge(slot, texture.bytes().saturating_add(OVERHEAD));
        }
        loaded.clone()
    }

    /// Reserves memory for decoding. Waits while others decode, if there is no room for both. A decoder never
    /// waits for another one, so the wait ends.
    pub(crate) fn reserve(&self, bytes: u64) -> Reservation<'_> {
        let most = self.limit.saturating_add(self.working);
        let mut ledger = lock(&self.ledger);
        while ledger.reserved > 0 && ledger.reserved.saturating_add(bytes) > most {
            ledger = self.ended.wait(ledger).unwrap_or_else(PoisonError::into_inner);
        }
        ledger.reserved = ledger.reserved.saturating_add(bytes);
        self.make_room(&mut ledger);
        Reservation { budget: self, bytes }
    }

    /// Records a slot that was just filled.
    fn charge(&self, slot: &Arc<Slot>, bytes: u64) {
        let mut ledger = lock(&self.ledger);
        ledger.filled.push((Arc::clone(slot), bytes));
        ledger.held = ledger.held.saturating_add(bytes);
        self.make_room(&mut ledger);
    }

    /// Drops the least recently used textures until the rest fits, together with the ones being decoded.
    fn make_room(&self, ledger: &mut Ledger) {
        let most = self.limit.saturating_add(self.working);
        let is_over = |held: u64, reserved: u64, count: usize| {
            held > self.limit || held.saturating_add(reserved) > most || count > self.count
        };
        let Ledger { filled, held, reserved } = ledger;
        let mut count = filled.len();
        if !is_over(*held, *reserved, count) {
            return;
        }
        // Oldest first; each time is read once, since other threads keep changing them. The new texture is in
        // use by this call, so it stays.
        filled.sort_by_cached_key(|(slot, _)| slot.last_used.load(Ordering::Relaxed));
        filled.retain(|(slot, bytes)| {
            let stays = !is_over(*held, *reserved, count) || !slot.drop_unused();
            if !stays {
                *held -= bytes;
                count -= 1;
            }
            stays
        });
    }
}

/// The data under these locks is never left half-changed, so a panic elsewhere does not corrupt it.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
