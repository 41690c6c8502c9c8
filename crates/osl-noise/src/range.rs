//! The range of a field's values.

use crate::float::Float;
use crate::number::Number;

/// The range of a field as data, so that both ranges share machine code.
#[derive(Clone, Copy)]
pub(crate) struct Range {
    /// Added before scaling.
    pub(crate) shift: f32,
    pub(crate) factor: f32,
}

impl Range {
    /// −1 to 1. Adding −0 leaves every number unchanged, including 0.
    pub(crate) const SIGNED: Range = Range { shift: -0.0, factor: 1.0 };
    /// 0 to 1.
    pub(crate) const UNSIGNED: Range = Range { shift: 1.0, factor: 0.5 };

    /// Maps a number from −1 to 1 to the range, with its partials.
    #[inline(always)]
    pub(crate) fn of<N: Number>(self, x: N) -> N {
        x.with_value(x.value() + N::Float::lit(self.shift)).scale(N::Float::lit(self.factor))
    }

    /// Maps three numbers.
    #[inline(always)]
    pub(crate) fn of3<N: Number>(self, [x, y, z]: [N; 3]) -> [N; 3] {
        [self.of(x), self.of(y), self.of(z)]
    }
}
