//! Registers: lane arrays aligned to cache lines.
//!
//! A register has one to sixteen components of `width` lanes each, component by component. A lane contains a
//! word of the arithmetic.

use bytemuck::Pod;

/// Words in a cache line. Numbers of lanes are multiples of it.
pub(crate) const LINE: usize = 16;

/// Addresses at this distance compete for the same location in the L1 cache.
const PAGE: usize = 4096;

/// The lanes of one register.
#[derive(Clone, Default)]
pub(crate) struct Lanes<W = u32> {
    /// The words, with up to a line before and after them, so that they can start at a boundary.
    store: Vec<W>,
    start: usize,
    len: usize,
}

impl<W: Pod> Lanes<W> {
    /// A register of zeros with room for `words`.
    pub(crate) fn new(words: usize) -> Lanes<W> {
        let store = vec![W::zeroed(); words + LINE];
        let start = store.as_ptr().align_offset(LINE * size_of::<u32>()).min(LINE);
        Lanes { store, start, len: words }
    }

    /// A register of zeros with room for `words`, which starts `bytes` bytes after a page boundary. Pieces of
    /// registers that start at the same offset within a page would evict each other from the L1 cache.
    pub(crate) fn behind_page(words: usize, bytes: usize) -> Lanes<W> {
        let (page, behind) = (PAGE / size_of::<W>(), bytes % PAGE / size_of::<W>());
        let store = vec![W::zeroed(); words + page + behind];
        let start = store.as_ptr().align_offset(PAGE).min(page) + behind;
        Lanes { store, start, len: words }
    }

    /// Its words.
    pub(crate) fn words(&self) -> &[W] {
        &self.store[self.start..self.start + self.len]
    }

    /// Its words, mutable.
    pub(crate) fn words_mut(&mut self) -> &mut [W] {
        &mut self.store[self.start..self.start + self.len]
    }
}
