//! Choices from bytes.

/// A list of bytes that is read once; zeros follow its end.
#[derive(Clone, Debug)]
pub struct Bytes<'a> {
    data: &'a [u8],
    at: usize,
}

impl<'a> Bytes<'a> {
    /// The bytes from their start.
    pub fn new(data: &'a [u8]) -> Bytes<'a> {
        Bytes { data, at: 0 }
    }

    /// The next byte.
    pub fn byte(&mut self) -> u8 {
        let byte = self.data.get(self.at).copied().unwrap_or(0);
        self.at += 1;
        byte
    }

    /// Whether all bytes are read.
    pub fn ended(&self) -> bool {
        self.at >= self.data.len()
    }

    /// A number less than `n`, which is at most 256; 0 at the end of the bytes.
    pub fn below(&mut self, n: usize) -> usize {
        self.byte() as usize % n.max(1)
    }

    /// True for `of` of 256 bytes; false at the end of the bytes.
    pub fn chance(&mut self, of: u8) -> bool {
        self.byte() > 255 - of
    }

    /// An element of a list that is not empty; the first at the end of the bytes.
    pub fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }
}

/// `n` bytes from a seed; different seeds give different bytes.
pub fn noise_bytes(seed: u64, n: usize) -> Vec<u8> {
    // SplitMix64 (Steele, Lea and Flood 2014).
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)).to_le_bytes()
    };
    let mut bytes = Vec::with_capacity(n + 8);
    while bytes.len() < n {
        bytes.extend(next());
    }
    bytes.truncate(n);
    bytes
}
