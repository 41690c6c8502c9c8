//! Where a long sequence is cut into several loops.
//!
//! A processor looks ahead a few hundred operations. While the operations of one vector wait for each other,
//! it starts those of the next vectors if they are near enough. If a loop has more operations, and most of
//! them form one chain, each vector takes the time of the whole chain. Several short loops take less,
//! although values go through memory from one to the next.

use super::QueuedOp;
use crate::lanes::Ready;
use osl_native::Block;
use std::ops::Range;

/// A sequence with fewer operations is one loop.
const LONG: usize = 192;
/// The least and the largest number of operations of a part.
const SIZES: Range<usize> = 48..144;
/// Cycles per vector around a loop, for its call.
const CALL: usize = 4;

/// Whether a sequence is so long, and waits for itself so much, that parts may take less time.
pub(super) fn is_slow(whole: &Block) -> bool {
    whole.len() >= LONG && whole.cycles() * 3 > whole.len()
}

/// Whether some loops take clearly less time than one.
pub(super) fn is_faster<'a>(parts: impl Iterator<Item = &'a Block>, whole: &Block) -> bool {
    let cycles: usize = parts.map(|part| part.cycles() + CALL).sum();
    cycles * 8 < whole.cycles() * 7
}

/// The parts of a sequence, each a loop. `ends` has the number of operations up to the end of each item. Cuts
/// are where the fewest values are needed later.
pub(super) fn parts(items: &[QueuedOp], ends: &[usize]) -> Vec<Range<usize>> {
    let mut parts = Vec::new();
    let mut start = 0;
    while start < items.len() {
        let before = start.checked_sub(1).and_then(|last| ends.get(last)).copied().unwrap_or(0);
        let size = |end: usize| ends.get(end - 1).map_or(0, |operations| operations - before);
        let ends = (start + 1..items.len()).map(|end| (end, size(end)));
        let cuts = ends.take_while(|(_, size)| *size < SIZES.end).filter(|(_, size)| *size >= SIZES.start);
        let end = if size(items.len()) < SIZES.end {
            items.len()
        } else {
            let fewest = cuts.map(|(end, _)| end).min_by_key(|end| live(&items[start..], *end - start));
            // A long item alone.
            fewest.unwrap_or(start + 1)
        };
        parts.push(start..end);
        start = end;
    }
    parts
}

/// Number of words of the items before a cut that are read after it.
fn live(items: &[QueuedOp], cut: usize) -> usize {
    let (before, after) = items.split_at(cut);
    let Some(end) = before.iter().map(|item| item.at).max().filter(|_| !after.is_empty()) else { return 0 };
    before.iter().filter(|item| item.last > end).map(words).sum()
}

fn words(item: &QueuedOp) -> usize {
    match item.ready {
        Ready::Lane(step) => usize::from(step.parts) * step.op.shape().result.words() as usize,
        Ready::Gather(step) => usize::from(step.words),
        Ready::Load(step) => usize::from(step.words),
        Ready::Store(_) => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{LaneInput, ReadyArg, ReadyLane};
    use osl_ir::ir::{LaneOp, MAX_ARGS};

    /// A sum whose result is read for the last time at a position.
    fn item(at: u32, last: u32) -> QueuedOp {
        let args = [ReadyArg { from: LaneInput::Words(0), words: 1, apart: 0 }; MAX_ARGS];
        let step = ReadyLane { op: LaneOp::FAdd, parts: 1, flat: false, count: 2, out: (at, 0), args };
        QueuedOp { ready: Ready::Lane(step), at, last }
    }

    #[test]
    fn cuts_are_where_the_fewest_values_are_needed() {
        // In each group of ten, all values are read by the last one, which the next group reads.
        let items: Vec<QueuedOp> = (0..100).map(|at| item(at, at / 10 * 10 + 9 + at % 10 / 9)).collect();
        let ends: Vec<usize> = (1..=100).map(|count| count * 8).collect();
        let parts = parts(&items, &ends);
        assert!(parts.len() > 4, "{parts:?}");
        assert!(parts.iter().all(|part| part.end % 10 == 0 && part.len() * 8 < SIZES.end), "{parts:?}");
        let all: Vec<usize> = parts.into_iter().flatten().collect();
        assert_eq!(all, (0..100).collect::<Vec<_>>());
    }

    #[test]
    fn a_long_item_is_a_part() {
        let items: Vec<QueuedOp> = (0..3).map(|at| item(at, at + 1)).collect();
        assert_eq!(parts(&items, &[500, 510, 1000]), [0..1, 1..2, 2..3]);
        assert_eq!(parts(&items, &[5, 10, 15]).len(), 1);
    }
}
