//! The memory of emulated code. Every access is checked: code that reads or writes a word beyond the arrays
//! and slots that it was promised fails here. This module must not know instructions.

use osl_native::{Assembled, Target, Words};

/// Addresses of the code, the pointers, the slots and the first array; each further array is this far from
/// the previous.
pub(crate) const CODE: u64 = 0x10_0000;
pub(crate) const POINTERS: u64 = 0x1000_0000;
pub(crate) const SLOTS: u64 = 0x2000_0000;
const ARRAYS: u64 = 0x1_0000_0000;
/// Maximum number of instructions per call.
pub(crate) const MAX_STEPS: usize = 100_000_000;

pub(crate) struct Memory<'a, 'w> {
    pub(crate) code: &'a [u8],
    pointers: Vec<u64>,
    slots: Vec<u32>,
    arrays: Vec<Words<'w>>,
}

/// The location of a word.
enum Place {
    Code(usize),
    Slot(usize),
    /// An array, and the index of the word in it.
    Array(usize, usize),
}

impl<'a, 'w> Memory<'a, 'w> {
    pub(crate) fn new(target: Target, code: &'a Assembled, arrays: Vec<Words<'w>>) -> Self {
        let pointers = (0..arrays.len() as u64).map(|at| ARRAYS * (at + 1)).collect();
        let slots = vec![0xDEAD_BEEF; code.slots * target.lanes()];
        Memory { code: &code.bytes, pointers, slots, arrays }
    }

    /// The pointer of an array, at its address.
    pub(crate) fn pointer(&self, address: u64) -> u64 {
        assert!((address - POINTERS).is_multiple_of(8), "{address:x}");
        self.pointers[((address - POINTERS) / 8) as usize]
    }

    pub(crate) fn read(&self, address: u64) -> u32 {
        assert!(address.is_multiple_of(4) || (CODE..POINTERS).contains(&address), "{address:x}");
        match place(address) {
            Place::Code(at) => u32::from_le_bytes(self.code[at..at + 4].try_into().unwrap()),
            Place::Slot(at) => self.slots[at],
            Place::Array(array, at) => match &self.arrays[array] {
                Words::Write(words) => words[at],
                Words::Read(words) => words[at],
            },
        }
    }

    pub(crate) fn write(&mut self, address: u64, word: u32) {
        assert!(address.is_multiple_of(4), "{address:x}");
        match place(address) {
            Place::Slot(at) => self.slots[at] = word,
            Place::Array(array, at) => match &mut self.arrays[array] {
                Words::Write(words) => words[at] = word,
                Words::Read(_) => panic!("array {array} may only be read"),
            },
            Place::Code(_) => panic!("the code writes itself"),
        }
    }
}

fn place(address: u64) -> Place {
    if (CODE..POINTERS).contains(&address) {
        Place::Code((address - CODE) as usize)
    } else if (SLOTS..ARRAYS).contains(&address) {
        Place::Slot(((address - SLOTS) / 4) as usize)
    } else {
        assert!(address >= ARRAYS, "{address:x} is no memory for words");
        Place::Array((address / ARRAYS - 1) as usize, (address % ARRAYS / 4) as usize)
    }
}
