//! Code that can be called: memory that the processor may run, and the check that it stays within the arrays it gets.
//!
//! The only unsafe code of the crate: the call. What the code does is known from the block that it was made of: it reads
//! and writes lanes of arrays at offsets that the block has noted, slots, and its own constants; it calls nothing.

#![expect(unsafe_code, reason = "code that was just made is called here")]

use crate::allocate::{LANES, assemble};
use crate::block::{Block, Use};
use memmap2::{Mmap, MmapMut};
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Operations of a block at most.
const MAX_OPERATIONS: usize = 1 << 16;
/// The furthest word of an array that a block may name: distances in bytes are signed and of 32 bits.
const MAX_WORDS: usize = 1 << 28;

/// Bytes of a page, and of a line of the cache.
const PAGE: usize = 4096;
const LINE: usize = 64;
/// Where the next code starts in its page: were it at the front each time, all would want the same few lines of the cache.
static NEXT: AtomicUsize = AtomicUsize::new(0);

/// Words for the code to read or write.
#[derive(Debug)]
pub enum Words<'a> {
    /// To read.
    Read(&'a [u32]),
    /// To read and write.
    Write(&'a mut [u32]),
}

/// Working memory of calls, best kept from one to the next.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pointers: Vec<usize>,
    slots: Vec<u32>,
}

/// The code of a block.
#[derive(Debug)]
pub struct Code {
    memory: Mmap,
    /// Where it starts.
    start: usize,
    arrays: Vec<Use>,
    slots: usize,
}

/// Whether this machine runs such code: x86-64 with AVX-512.
pub fn is_supported() -> bool {
    #[cfg(all(target_arch = "x86_64", unix))]
    {
        is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("fma")
    }
    #[cfg(not(all(target_arch = "x86_64", unix)))]
    false
}

impl Code {
    /// The code of a block; nothing where the machine cannot run it, or does not let new code be run, or where the block
    /// is too large.
    pub fn new(block: &Block) -> Option<Code> {
        let furthest = block.arrays.iter().map(|used| used.words.max(used.lanes.unwrap_or(0))).max();
        if !is_supported() || block.len() > MAX_OPERATIONS || furthest.unwrap_or(0) > MAX_WORDS {
            return None;
        }
        let assembled = assemble(block);
        let size = assembled.bytes.len();
        let start = NEXT.fetch_add(size.next_multiple_of(LINE), Ordering::Relaxed) % PAGE;
        let mut memory = MmapMut::map_anon(start + size).ok()?;
        memory.get_mut(start..)?.copy_from_slice(&assembled.bytes);
        // From here on it can be run and not written.
        let memory = memory.make_exec().ok()?;
        Some(Code { memory, start, arrays: block.arrays.clone(), slots: assembled.slots })
    }

    /// Bytes of the code.
    pub fn size(&self) -> usize {
        self.memory.len()
    }

    /// Computes lanes of the arrays, whole vectors of 16 of them. False, and nothing is done, if the arrays are fewer or
    /// shorter than the block wants or one that it writes may only be read, or if the lanes are not whole vectors.
    pub fn run<'a>(
        &self,
        arrays: impl IntoIterator<Item = Words<'a>>,
        lanes: Range<usize>,
        scratch: &mut Scratch,
    ) -> bool {
        if !lanes.start.is_multiple_of(LANES) || !lanes.end.is_multiple_of(LANES) || lanes.is_empty() {
            return lanes.is_empty();
        }
        let Scratch { pointers, slots } = scratch;
        pointers.clear();
        let mut arrays = arrays.into_iter();
        for used in &self.arrays {
            let (words, pointer) = match arrays.next() {
                Some(Words::Write(words)) => (words.len(), words.as_mut_ptr().expose_provenance()),
                Some(Words::Read(words)) if !used.written => {
                    (words.len(), words.as_ptr().expose_provenance())
                }
                _ => return false,
            };
            let needed = used.lanes.map_or(0, |before| before.saturating_add(lanes.end)).max(used.words);
            if words < needed {
                return false;
            }
            pointers.push(pointer);
        }
        slots.resize(slots.len().max(self.slots * LANES), 0);
        self.call(pointers, slots, lanes);
        true
    }

    /// Calls the code. The pointers are those of arrays as long as the block needs for these lanes.
    #[cfg(target_arch = "x86_64")]
    fn call(&self, pointers: &[usize], slots: &mut [u32], lanes: Range<usize>) {
        // SAFETY: the memory holds what `assemble` made of the block, which follows the System V convention, and was not
        // written since; the instructions it uses were detected in `new`. It touches: the pointers, as many as the block
        // has arrays; slots, as many as it counted, for which `run` made room; and arrays, whose slices live until `run`
        // returns, within the words that `run` has checked. Lanes are whole vectors and at least one, so that its loop ends
        // exactly at the last.
        unsafe {
            std::arch::asm!(
                "call {code}",
                code = in(reg) self.memory[self.start..].as_ptr(),
                inout("rdi") pointers.as_ptr() => _,
                inout("rsi") slots.as_mut_ptr() => _,
                inout("rdx") lanes.start * 4 => _,
                inout("rcx") lanes.end * 4 => _,
                clobber_abi("sysv64"),
            );
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn call(&self, _: &[usize], _: &mut [u32], _: Range<usize>) {}
}
