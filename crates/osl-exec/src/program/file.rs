//! The registers of a program, which values use one after the other.

use rustc_hash::FxHashMap;

/// Registers of one kind; each is free again after the last use of its value.
#[derive(Default)]
pub(super) struct File {
    /// Number of components of each.
    pub(super) list: Vec<u32>,
    /// Free registers by component count.
    free: FxHashMap<u32, Vec<u32>>,
    /// Registers that become free after a position.
    ending: FxHashMap<u32, Vec<(u32, u32)>>,
}

impl File {
    /// A register that becomes free after position `last`, if given.
    pub(super) fn take(&mut self, words: u32, last: Option<u32>) -> u32 {
        match self.free.get_mut(&words).and_then(Vec::pop) {
            Some(reg) => self.until(reg, words, last),
            None => self.add(words, last),
        }
    }

    /// A new register.
    pub(super) fn add(&mut self, words: u32, last: Option<u32>) -> u32 {
        self.list.push(words);
        self.until(self.list.len() as u32 - 1, words, last)
    }

    fn until(&mut self, reg: u32, words: u32, last: Option<u32>) -> u32 {
        if let Some(last) = last {
            self.ending.entry(last).or_default().push((words, reg));
        }
        reg
    }

    /// Keeps a register that would be free after one position until after another. Returns whether it was to
    /// become free there.
    pub(super) fn keep(&mut self, (words, reg): (u32, u32), from: u32, to: u32) -> bool {
        let Some(list) = self.ending.get_mut(&from) else { return false };
        let Some(at) = list.iter().position(|entry| *entry == (words, reg)) else { return false };
        list.swap_remove(at);
        self.until(reg, words, Some(to));
        true
    }

    /// Frees the registers whose values end at a position.
    pub(super) fn end(&mut self, position: u32) {
        for (words, reg) in self.ending.remove(&position).into_iter().flatten() {
            self.free.entry(words).or_default().push(reg);
        }
    }
}
