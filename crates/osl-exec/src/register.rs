//! Registers: lane arrays on cache-line boundaries.
//!
//! A register holds one to sixteen components of `width` lanes each, component by component. What a lane holds is a
//! word of the arithmetic.

use bytemuck::Pod;

/// Words in a cache line. Lane counts are multiples of it.
pub(crate) const LINE: usize = 16;

/// The lanes of one register.
#[derive(Clone, Default)]
pub(crate) struct Lanes<W = u32> {
    /// The words, with up to a line before and behind them so that they can start on a boundary.
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

    /// Its words.
    pub(crate) fn words(&self) -> &[W] {
        &self.store[self.start..self.start + self.len]
    }

    /// Its words, to write.
    pub(crate) fn words_mut(&mut self) -> &mut [W] {
        &mut self.store[self.start..self.start + self.len]
    }
}
