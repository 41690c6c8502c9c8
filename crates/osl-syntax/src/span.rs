//! Positions in source text: 8-byte spans over one global offset space.
//!
//! The [`SourceMap`](crate::source::SourceMap) gives every file a range of global byte offsets; a span is a
//! half-open range of them. A span does not know its file, which is found through the map.

/// A half-open range `start..end` of global byte offsets.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Span {
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// The span `start..end`.
    pub const fn new(start: u32, end: u32) -> Self {
        Self { start, end }
    }

    /// A span of a source map that was appended to another: see [`crate::source::SourceMap::append`].
    #[must_use]
    pub fn moved(self, by: u32) -> Span {
        Span::new(self.start.saturating_add(by), self.end.saturating_add(by))
    }

    /// The smallest span that covers both.
    pub fn to(self, other: Span) -> Span {
        Span::new(self.start.min(other.start), self.end.max(other.end))
    }
}

impl std::fmt::Debug for Span {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}..{}", self.start, self.end)
    }
}
