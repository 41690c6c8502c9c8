//! Which points have the same key: a list of points for each key.

use super::site::Key;

/// Maximum number of points.
pub(super) const BLOCK: usize = 1024;
/// Maximum number of lists; further points are left to themselves.
const LISTS: usize = 256;
const SLOTS: usize = 1024;

/// The points with a key.
struct Shared {
    key: Key,
    count: usize,
    first: usize,
    last: usize,
}

/// Lists of points by key. If two keys have the same slot, a key may have several lists.
pub(super) struct Sharing {
    lists: Vec<Shared>,
    /// The point that follows a point in its list.
    next: [u16; BLOCK],
    /// For each hash of a key, the latest list with it.
    slots: [u16; SLOTS],
    /// The list of the previous point: neighbouring points mostly share their key.
    recent: usize,
}

impl Sharing {
    pub(super) fn new() -> Sharing {
        Sharing { lists: Vec::new(), next: [0; BLOCK], slots: [0; SLOTS], recent: 0 }
    }

    pub(super) fn clear(&mut self) {
        self.lists.clear();
        self.recent = 0;
    }

    /// Adds a point, whose number is below [`BLOCK`]. Returns whether there is a list for it.
    pub(super) fn add(&mut self, point: usize, key: &Key) -> bool {
        if !self.has(self.recent, key) {
            let slot = slot(key);
            let latest = usize::from(self.slots[slot]);
            if self.has(latest, key) {
                self.recent = latest;
            } else if self.lists.len() < LISTS {
                self.recent = self.lists.len();
                self.slots[slot] = self.recent as u16;
                self.lists.push(Shared { key: *key, count: 0, first: point, last: point });
            } else {
                return false;
            }
        }
        let Some(list) = self.lists.get_mut(self.recent) else { return false };
        self.next[list.last % BLOCK] = (point % BLOCK) as u16;
        list.last = point;
        list.count += 1;
        true
    }

    /// Whether a list has a key.
    fn has(&self, list: usize, key: &Key) -> bool {
        let differences = |other: &Key| key.iter().zip(other).fold(0, |sum, (a, b)| sum | (a ^ b));
        self.lists.get(list).is_some_and(|list| differences(&list.key) == 0)
    }

    /// The points of each list, in the order in which they were added.
    pub(super) fn lists(&self) -> impl Iterator<Item = impl ExactSizeIterator<Item = usize>> {
        self.lists.iter().map(move |list| {
            let mut point = list.first;
            (0..list.count).map(move |_| {
                let this = point;
                point = usize::from(self.next[point % BLOCK]);
                this
            })
        })
    }
}

fn slot(key: &Key) -> usize {
    let hash = key.iter().fold(0, |hash: u32, word| (hash ^ word).wrapping_mul(0x9e37_79b1).rotate_left(15));
    hash as usize % SLOTS
}
