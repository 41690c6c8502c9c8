//! Registers: lane arrays on cache-line boundaries.
//!
//! A register holds one to sixteen components of `width` lanes each, component by component. All lanes are
//! 32-bit words; floats and ints are views of them.

/// Words in a cache line. Lane counts are multiples of it.
pub(crate) const LINE: usize = 16;

/// The lanes of one register.
#[derive(Clone, Default)]
pub(crate) struct Lanes {
    /// The words, with up to a line before and behind them so that they can start on a boundary.
    store: Vec<u32>,
    start: usize,
    len: usize,
}

impl Lanes {
    /// A register of zeros with room for `words`.
    pub(crate) fn new(words: usize) -> Lanes {
        let store = vec![0; words + LINE];
        let start = store.as_ptr().align_offset(LINE * size_of::<u32>()).min(LINE);
        Lanes { store, start, len: words }
    }

    /// Its words.
    pub(crate) fn words(&self) -> &[u32] {
        &self.store[self.start..self.start + self.len]
    }

    /// Its words, to write.
    pub(crate) fn words_mut(&mut self) -> &mut [u32] {
        &mut self.store[self.start..self.start + self.len]
    }
}

/// Words as floats.
pub(crate) fn floats(words: &[u32]) -> &[f32] {
    bytemuck::cast_slice(words)
}

/// Words as floats, to write.
pub(crate) fn floats_mut(words: &mut [u32]) -> &mut [f32] {
    bytemuck::cast_slice_mut(words)
}

/// Words as ints.
pub(crate) fn ints(words: &[u32]) -> &[i32] {
    bytemuck::cast_slice(words)
}

/// Words as ints, to write.
pub(crate) fn ints_mut(words: &mut [u32]) -> &mut [i32] {
    bytemuck::cast_slice_mut(words)
}
