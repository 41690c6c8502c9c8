//! Mutations of inputs: bits, numbers, pieces, lines and words.
//!
//! Some mutations treat any input as bytes, others as lines of words: a changed line of a compiled shader is
//! nearly valid, and so is a changed word in a picture's header.

/// Random numbers from a seed: SplitMix64 (Steele, Lea and Flood 2014).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The sequence of a seed.
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    /// The next number.
    pub fn number(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number less than `n`; 0 if `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        if n == 0 { 0 } else { (self.number() % n as u64) as usize }
    }

    /// An element of a list, if it has any.
    pub fn pick<'a, T>(&mut self, list: &'a [T]) -> Option<&'a T> {
        list.get(self.below(list.len()))
    }

    /// A part of `0..len`, at most `longest` long.
    fn range(&mut self, len: usize, longest: usize) -> std::ops::Range<usize> {
        let start = self.below(len + 1);
        // Short pieces are more likely than long ones.
        let most = (len - start).min(longest).min(1 << self.below(16));
        start..start + self.below(most + 1)
    }
}

/// Integers that may cause failures.
const NUMBERS: [i64; 24] = [
    0,
    1,
    -1,
    2,
    3,
    7,
    8,
    15,
    16,
    127,
    128,
    255,
    256,
    32767,
    32768,
    65535,
    65536,
    1 << 24,
    i32::MAX as i64,
    i32::MIN as i64,
    u32::MAX as i64,
    1 << 32,
    i64::MAX,
    i64::MIN,
];

/// The same as words of text.
const WORDS: [&str; 22] = [
    "0",
    "1",
    "-1",
    "2",
    "3",
    "16",
    "255",
    "65536",
    "1000000",
    "2147483647",
    "-2147483648",
    "4294967296",
    "99999999999999999999",
    "0.5",
    "-0.0",
    "1e-40",
    "1e38",
    "1e39",
    "nan",
    "inf",
    "-inf",
    "\"\"",
];

/// Applies a few mutations to an input in sequence. `other` is another input, for parts of it; `words` are
/// words of the format. The result has at most `max_len` bytes.
pub fn mutate(random: &mut Random, input: &[u8], other: &[u8], words: &[&str], max_len: usize) -> Vec<u8> {
    let mut data = input.to_vec();
    let changes = 1 + random.below(4) * random.below(3);
    for _ in 0..changes {
        change(random, &mut data, other, words, max_len);
        data.truncate(max_len);
    }
    data
}

fn change(random: &mut Random, data: &mut Vec<u8>, other: &[u8], words: &[&str], max_len: usize) {
    match random.below(18) {
        0 | 1 => {
            let bit = 1 << random.below(8);
            let at = random.below(data.len());
            if let Some(byte) = data.get_mut(at) {
                *byte ^= bit;
            }
        }
        2 => {
            let (at, to) = (random.below(data.len()), random.number() as u8);
            if let Some(byte) = data.get_mut(at) {
                *byte = to;
            }
        }
        3 => number(random, data),
        4 => {
            let cut = random.range(data.len(), usize::MAX);
            data.drain(cut);
        }
        5 => {
            let keep = random.below(data.len() + 1);
            data.truncate(keep);
        }
        6 => {
            let range = random.range(data.len(), 4096);
            let piece = data.get(range).unwrap_or(&[]).to_vec();
            insert(random, data, &piece);
        }
        7 => {
            let range = random.range(other.len(), 4096);
            let piece = other.get(range).unwrap_or(&[]).to_vec();
            insert(random, data, &piece);
        }
        8 => {
            // One input up to a position, then the other from a position on.
            let from = random.below(other.len() + 1);
            let keep = random.below(data.len() + 1);
            data.truncate(keep);
            data.extend_from_slice(other.get(from..).unwrap_or(&[]));
        }
        9 | 10 => {
            if let Some(word) = random.pick(words) {
                insert(random, data, word.as_bytes());
            }
        }
        11 => {
            let piece: Vec<u8> = (0..1 + random.below(8)).map(|_| random.number() as u8).collect();
            insert(random, data, &piece);
        }
        12 => repeat(random, data, max_len),
        13..=15 => word(random, data, words),
        _ => line(random, data, other),
    }
}

fn insert(random: &mut Random, data: &mut Vec<u8>, piece: &[u8]) {
    let at = random.below(data.len() + 1);
    data.splice(at..at, piece.iter().copied());
}

/// Writes a number of one to eight bytes over others, or adds a small one.
fn number(random: &mut Random, data: &mut [u8]) {
    let size = 1 << random.below(4);
    if data.len() < size {
        return;
    }
    let at = random.below(data.len() - size + 1);
    let Some(slot) = data.get_mut(at..at + size) else { return };
    let turned = random.below(2) == 0;
    if turned {
        slot.reverse();
    }
    let mut bytes = [0; 8];
    bytes[..size].copy_from_slice(slot);
    let old = i64::from_le_bytes(bytes);
    let new = match random.below(2) {
        0 => random.pick(&NUMBERS).copied().unwrap_or(0),
        _ => old.wrapping_add(random.below(33) as i64 - 16),
    };
    slot.copy_from_slice(&new.to_le_bytes()[..size]);
    if turned {
        slot.reverse();
    }
}

/// Repeats a piece many times.
fn repeat(random: &mut Random, data: &mut Vec<u8>, max_len: usize) {
    let range = random.range(data.len(), 64);
    let piece = data.get(range.clone()).unwrap_or(&[]).to_vec();
    let room = max_len.saturating_sub(data.len()) / piece.len().max(1);
    let most = 1 << random.below(11);
    let times = random.below(room.min(most) + 1);
    data.splice(range.end..range.end, piece.repeat(times));
}

/// Replaces a word by a number, a word of the format, or another word of the input.
fn word(random: &mut Random, data: &mut Vec<u8>, words: &[&str]) {
    let found = pieces(data, |b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'.' | b'-'));
    let Some(range) = random.pick(&found).cloned() else { return };
    let is_number = data.get(range.start).is_some_and(u8::is_ascii_digit);
    let new: Vec<u8> = match random.below(4) {
        0 | 1 if is_number => random.pick(&WORDS).map(|w| w.as_bytes().to_vec()).unwrap_or_default(),
        0 | 1 => random.pick(words).map(|w| w.as_bytes().to_vec()).unwrap_or_default(),
        2 => random.pick(&found).and_then(|r| data.get(r.clone())).unwrap_or(&[]).to_vec(),
        _ => random.pick(&WORDS).map(|w| w.as_bytes().to_vec()).unwrap_or_default(),
    };
    data.splice(range, new);
}

/// Removes a line, duplicates it, moves it, or inserts one of another input.
fn line(random: &mut Random, data: &mut Vec<u8>, other: &[u8]) {
    let lines = pieces(data, |b| b != b'\n');
    let Some(range) = random.pick(&lines).cloned() else { return };
    let end = (range.end + 1).min(data.len());
    let text = data.get(range.start..end).unwrap_or(&[]).to_vec();
    match random.below(4) {
        0 => {
            data.drain(range.start..end);
        }
        1 => {
            data.splice(end..end, text);
        }
        2 => {
            data.drain(range.start..end);
            let lines = pieces(data, |b| b != b'\n');
            let to = random.pick(&lines).map_or(0, |r| r.start);
            data.splice(to..to, text);
        }
        _ => {
            let lines = pieces(other, |b| b != b'\n');
            let Some(from) = random.pick(&lines).and_then(|r| other.get(r.clone())) else { return };
            let piece = [from, b"\n"].concat();
            data.splice(range.start..range.start, piece);
        }
    }
}

/// The runs of bytes of a kind.
fn pieces(data: &[u8], is: impl Fn(u8) -> bool) -> Vec<std::ops::Range<usize>> {
    let mut found = Vec::new();
    let mut start = None;
    for (at, byte) in data.iter().enumerate() {
        match (is(*byte), start) {
            (true, None) => start = Some(at),
            (false, Some(first)) => {
                found.push(first..at);
                start = None;
            }
            _ => {}
        }
    }
    found.extend(start.map(|first| first..data.len()));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_those_of_the_seed_and_keep_to_the_length() {
        let (a, b) = (b"shader a(float x = 3)\n{ x = 2; }\n".as_slice(), b"one 1\ntwo 2\n".as_slice());
        let run = |seed| {
            let mut random = Random::new(seed);
            (0..2000).map(|_| mutate(&mut random, a, b, &["if", "while"], 200)).collect::<Vec<_>>()
        };
        let all = run(7);
        assert_eq!(all, run(7));
        assert!(all.iter().all(|data| data.len() <= 200));
        let different: std::collections::BTreeSet<_> = all.iter().collect();
        assert!(different.len() > 1500, "{}", different.len());
        // An empty input must not fail.
        let mut random = Random::new(1);
        (0..2000).for_each(|_| assert!(mutate(&mut random, &[], &[], &[], 5).len() <= 5));
    }
}
