//! Choices made from bytes: if a fuzzer changes a byte, one choice changes.

/// Bytes that are consumed one by one; after the end, zeros follow.
pub(crate) struct Dice<'a> {
    bytes: std::slice::Iter<'a, u8>,
}

impl<'a> Dice<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Dice<'a> {
        Dice { bytes: bytes.iter() }
    }

    pub(crate) fn byte(&mut self) -> u8 {
        self.bytes.next().copied().unwrap_or(0)
    }

    /// A number less than `n`; 0 if `n` is 0.
    pub(crate) fn below(&mut self, n: u64) -> u64 {
        let wide = if n > 256 { u64::from(self.byte()) << 8 } else { 0 };
        (wide | u64::from(self.byte())).checked_rem(n).unwrap_or(0)
    }

    /// True once in `n` times; never after the bytes are consumed.
    pub(crate) fn one_in(&mut self, n: u64) -> bool {
        self.below(n) == n - 1
    }

    pub(crate) fn pick<T: Copy + Default>(&mut self, list: &[T]) -> T {
        let at = self.below(list.len() as u64) as usize;
        list.get(at).copied().unwrap_or_default()
    }

    /// A side length: mostly small, rarely so large that products overflow.
    pub(crate) fn side(&mut self) -> u32 {
        match self.byte() {
            small @ 0..224 => u32::from(small % 24) + 1,
            224..232 => 0,
            232..240 => 1 << self.below(32),
            240..248 => u32::MAX >> self.below(32),
            _ => 16384,
        }
    }

    /// A number of bytes: small, or much.
    pub(crate) fn size(&mut self) -> u64 {
        match self.byte() {
            small @ 0..128 => small.into(),
            128..250 => 1 << self.below(22),
            _ => u64::MAX >> self.below(64),
        }
    }

    /// A float, often a difficult one for computations.
    pub(crate) fn float(&mut self) -> f32 {
        let odd = [f32::NAN, f32::INFINITY, -1e38, 1e38, 1e-45, 0.0, -0.0, 1e12];
        match self.byte() {
            small @ 0..200 => f32::from(small) * 0.05 - 5.0,
            _ => self.pick(&odd),
        }
    }
}
