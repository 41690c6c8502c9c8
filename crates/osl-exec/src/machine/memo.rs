//! The latest results of a step that computes lane by lane: lanes with the same arguments share a result.
//!
//! A text or a name is a number in a batch, so that arguments are equal if their words are. Each result is
//! kept with its cost, which every lane is charged. The table has a fixed size: a result replaces another one
//! in the same place.

use osl_lanes::Word;

/// Maximum number of words of the arguments.
const MAX_WORDS: usize = 8;
/// Number of places for results, a power of two.
const PLACES: usize = 128;

/// The words of the arguments of a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Key<W>([W; MAX_WORDS]);

impl<W: Word> Key<W> {
    /// The words of some arguments; `None` if there are too many.
    pub(super) fn of(words: impl Iterator<Item = W>) -> Option<Key<W>> {
        let mut key = [W::default(); MAX_WORDS];
        for (index, word) in words.enumerate() {
            *key.get_mut(index)? = word;
        }
        Some(Key(key))
    }

    /// The place of its result.
    fn place(&self) -> usize {
        let mix = |sum: u32, word: &W| (sum.rotate_left(5) ^ word.bits()).wrapping_mul(0x9E37_79B9);
        (self.0.iter().fold(0, mix) >> 8) as usize & (PLACES - 1)
    }
}

/// A result and its cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MemoEntry<W> {
    pub(super) word: W,
    /// The steps that it takes, in the unit of its step.
    pub(super) cost: u64,
}

#[derive(Clone, Copy, Debug)]
struct Entry<W> {
    /// The step that made it.
    round: u64,
    key: Key<W>,
    result: MemoEntry<W>,
}

/// The results of the current step.
#[derive(Debug, Default)]
pub(super) struct Memo<W> {
    round: u64,
    entries: Vec<Entry<W>>,
}

impl<W: Word> Memo<W> {
    /// Begins another step, or the same one in another batch.
    pub(super) fn begin(&mut self) {
        self.round += 1;
        let result = MemoEntry { word: W::default(), cost: 0 };
        let entry = Entry { round: 0, key: Key([W::default(); MAX_WORDS]), result };
        self.entries.resize(PLACES, entry);
    }

    /// The result for some arguments, if it is known.
    pub(super) fn find(&self, key: &Key<W>) -> Option<MemoEntry<W>> {
        let entry = self.entries.get(key.place())?;
        (entry.round == self.round && entry.key == *key).then_some(entry.result)
    }

    /// Keeps a result.
    pub(super) fn keep(&mut self, key: Key<W>, result: MemoEntry<W>) {
        if let Some(entry) = self.entries.get_mut(key.place()) {
            *entry = Entry { round: self.round, key, result };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(words: &[u32]) -> Key<u32> {
        Key::of(words.iter().copied()).expect("few words")
    }

    #[test]
    fn results_are_those_of_the_same_step_and_arguments() {
        let mut memo = Memo::<u32>::default();
        assert_eq!(memo.find(&key(&[0])), None, "no step has begun");
        for step in 1..4 {
            memo.begin();
            for n in 0..1000 {
                assert_eq!(memo.find(&key(&[n, 7])), None, "step {step}");
                memo.keep(key(&[n, 7]), MemoEntry { word: n * step, cost: u64::from(n) });
                assert_eq!(memo.find(&key(&[n, 7])), Some(MemoEntry { word: n * step, cost: u64::from(n) }));
            }
            let known = (0..1000).filter_map(|n| Some((n, memo.find(&key(&[n, 7]))?)));
            let known: Vec<_> = known.collect();
            assert!(known.len() > PLACES / 2 && known.len() <= PLACES, "{}", known.len());
            assert!(known.iter().all(|(n, result)| result.word == n * step));
        }
    }

    #[test]
    fn too_many_words_have_no_key() {
        assert!(Key::of([1_u64; MAX_WORDS].into_iter()).is_some());
        assert!(Key::of([1_u64; MAX_WORDS + 1].into_iter()).is_none());
    }
}
