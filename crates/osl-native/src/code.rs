//! Callable code: executable memory, and the check that the code stays within the arrays it gets.
//!
//! The call is the only unsafe code of the crate. The effects of the code are known from its block: it reads
//! and writes array lanes at offsets recorded by the block, its slots, and its own constants. It calls
//! nothing. Code with loops gets a budget and is called for each vector, so that it returns soon.

#![expect(unsafe_code, reason = "code that was just made is called here")]

use crate::block::{Block, Use};
use crate::target::Target;
use memmap2::{Mmap, MmapMut};
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Maximum number of operations in a block.
const MAX_OPERATIONS: usize = 1 << 16;
/// The last word of an array that a block may address, since byte offsets are signed 32-bit numbers.
const MAX_WORDS: usize = 1 << 28;

/// The longest block that is tried as a pair, and the most values that a pair may keep in working memory:
/// with more, moving values takes longer than waiting for results.
const LONGEST_PAIR: usize = 1024;
const MAX_PAIR_SLOTS: usize = 48;

/// Bytes per page and per cache line.
const PAGE: usize = 4096;
const LINE: usize = 64;
/// Offset of the next code in its page. If every code began at the start of a page, all would compete for the
/// same few cache lines.
static NEXT: AtomicUsize = AtomicUsize::new(0);

/// An array for the code.
#[derive(Debug)]
pub enum Words<'a> {
    /// Read only.
    Read(&'a [u32]),
    /// Read and write.
    Write(&'a mut [u32]),
}

/// Working memory for calls; reuse it from one call to the next.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pointers: Vec<usize>,
    slots: Vec<u32>,
}

/// How a call of code with regions ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All lanes are computed; the vector that spent most spent this much.
    Spent(u32),
    /// A vector exceeded the budget or stopped, or the caller did not go on: later vectors are not computed.
    Stopped,
    /// The arrays do not suit the code; nothing was done.
    Refused,
}

/// The code of a block.
#[derive(Debug)]
pub struct Code {
    memory: Mmap,
    /// Where it starts.
    start: usize,
    arrays: Vec<Use>,
    /// Words of working memory.
    slots: usize,
    /// Lanes in each round: those of a vector, or of two.
    lanes: usize,
    /// Whether it has a budget or may stop.
    may_stop: bool,
}

/// Executable memory that holds bytes from an offset on; `None` if the system refuses. Each call takes pages
/// of its own, which are first written and then made executable: they are never both, and never written
/// again.
fn executable(start: usize, bytes: &[u8]) -> Option<Mmap> {
    let mut memory = MmapMut::map_anon(start + bytes.len()).ok()?;
    memory.get_mut(start..)?.copy_from_slice(bytes);
    let memory = memory.make_exec().ok()?;
    #[cfg(target_arch = "aarch64")]
    publish(&memory);
    Some(memory)
}

/// Makes bytes visible to the instruction fetches of all cores. They were written to data caches, which
/// aarch64 does not keep equal to the caches of instructions (Arm Architecture Reference Manual, B2.7.4).
#[cfg(target_arch = "aarch64")]
fn publish(bytes: &[u8]) {
    use std::arch::asm;
    let sizes: usize;
    // SAFETY: reads the sizes of cache lines, which Linux permits.
    unsafe { asm!("mrs {}, ctr_el0", out(reg) sizes, options(nomem, nostack, preserves_flags)) };
    // Two fields of the logarithm of a number of words.
    let (data, code) = (4_usize << (sizes >> 16 & 15), 4_usize << (sizes & 15));
    let (start, end) = (bytes.as_ptr().addr(), bytes.as_ptr().addr() + bytes.len());
    let lines = |size: usize| (start & !(size - 1)..end).step_by(size);
    for line in lines(data) {
        // SAFETY: the line holds bytes of the slice. What memory contains does not change.
        unsafe { asm!("dc cvau, {}", in(reg) line, options(nostack, preserves_flags)) };
    }
    // SAFETY: waits for the above.
    unsafe { asm!("dsb ish", options(nostack, preserves_flags)) };
    for line in lines(code) {
        // SAFETY: the line holds bytes of the slice, which are fetched again.
        unsafe { asm!("ic ivau, {}", in(reg) line, options(nostack, preserves_flags)) };
    }
    // SAFETY: waits for the above. This core also forgets instructions that it has fetched already.
    unsafe { asm!("dsb ish", "isb", options(nostack, preserves_flags)) };
}

impl Code {
    /// Assembles a block; `None` if the machine cannot run the code, the system does not permit new
    /// executable code, or the block is too large.
    pub fn new(block: &Block, target: Target) -> Option<Code> {
        Self::with_slots(block, target, usize::MAX)
    }

    /// Code for batches of `width` lanes. If a batch consists of whole pairs of vectors, and most values fit
    /// in registers, the code computes two vectors in step ([`Block::pair`]); a call must then ask for whole
    /// pairs. `None` as for [`Code::new`].
    pub fn for_batches(block: &Block, target: Target, width: usize) -> Option<Code> {
        let lanes = target.lanes();
        let is_fit = block.len() <= LONGEST_PAIR && width.is_multiple_of(2 * lanes);
        let pair = if is_fit { block.pair(lanes as u32) } else { None };
        let code = pair.and_then(|pair| Self::with_slots(&pair, target, MAX_PAIR_SLOTS));
        code.or_else(|| Self::new(block, target))
    }

    /// The code of a block, unless it keeps more vectors in working memory than so many.
    fn with_slots(block: &Block, target: Target, most: usize) -> Option<Code> {
        let furthest = block.arrays.iter().map(|used| used.words.max(used.lanes.unwrap_or(0))).max();
        if !target.is_supported() || block.len() > MAX_OPERATIONS || furthest.unwrap_or(0) > MAX_WORDS {
            return None;
        }
        if !target.carries(block) {
            return None;
        }
        let (assembled, lanes) = (target.assemble(block), target.lanes() * block.vectors());
        if assembled.slots > most {
            return None;
        }
        let size = assembled.bytes.len();
        let start = NEXT.fetch_add(size.next_multiple_of(LINE), Ordering::Relaxed) % PAGE;
        let memory = executable(start, &assembled.bytes)?;
        let (arrays, slots) = (block.arrays.clone(), assembled.slots * target.lanes());
        Some(Code { memory, start, arrays, slots, lanes, may_stop: block.may_stop() })
    }

    /// Size of the code in bytes.
    pub fn size(&self) -> usize {
        self.memory.len()
    }

    /// Computes lanes of the arrays, in whole vectors. Returns false and does nothing if there are
    /// fewer or shorter arrays than the block needs, if an array that it writes is read-only, if the lanes
    /// are not whole vectors, or if the code may stop: such code needs a budget.
    pub fn run<'a>(
        &self,
        arrays: impl IntoIterator<Item = Words<'a>>,
        lanes: Range<usize>,
        scratch: &mut Scratch,
    ) -> bool {
        if self.may_stop || !self.suits(arrays, &lanes, scratch) {
            return false;
        }
        if !lanes.is_empty() {
            self.call(scratch, lanes, 0);
        }
        true
    }

    /// The same for code that may stop. Each vector, or pair of vectors, may spend the budget. `goes_on` is
    /// asked after each, given what it spent.
    pub fn run_within<'a>(
        &self,
        arrays: impl IntoIterator<Item = Words<'a>>,
        lanes: Range<usize>,
        scratch: &mut Scratch,
        budget: u32,
        mut goes_on: impl FnMut(u32) -> bool,
    ) -> Outcome {
        if !self.suits(arrays, &lanes, scratch) {
            return Outcome::Refused;
        }
        let mut most = 0;
        for start in lanes.step_by(self.lanes) {
            let left = self.call(scratch, start..start + self.lanes, budget.into());
            let Ok(left) = u32::try_from(left) else { return Outcome::Stopped };
            let spent = budget.saturating_sub(left);
            most = most.max(spent);
            if !goes_on(spent) {
                return Outcome::Stopped;
            }
        }
        Outcome::Spent(most)
    }

    /// Whether the arrays suit; prepares the call.
    fn suits<'a>(
        &self,
        arrays: impl IntoIterator<Item = Words<'a>>,
        lanes: &Range<usize>,
        scratch: &mut Scratch,
    ) -> bool {
        if !lanes.start.is_multiple_of(self.lanes)
            || !lanes.end.is_multiple_of(self.lanes)
            || lanes.is_empty()
        {
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
        slots.resize(slots.len().max(self.slots), 0);
        true
    }

    /// Calls the code. Its arrays suit these lanes, and there is at least one vector of lanes. Returns what
    /// is left of the budget, which is negative if the code stopped.
    #[cfg(target_arch = "x86_64")]
    fn call(&self, scratch: &mut Scratch, lanes: Range<usize>, budget: i64) -> i64 {
        let Scratch { pointers, slots } = scratch;
        let mut left = budget;
        // SAFETY: the memory holds the code that `assemble` made from the block and was not written since.
        // The code follows the System V convention, and `new` detected the instructions that it uses. It
        // accesses the pointers, as many as the block has arrays; slots, as many as it counted, for which
        // `suits` made room; and arrays, whose slices live until its caller returns, within the words that
        // `suits` has checked: offsets that depend on values are bounded by operations of the block. Lanes
        // are whole vectors and at least one, so the loop ends exactly at the last. Each round of a loop
        // within takes from the budget, in a register that this call declares, so that the code ends.
        unsafe {
            std::arch::asm!(
                "call {code}",
                code = in(reg) self.memory[self.start..].as_ptr(),
                inout("rdi") pointers.as_ptr() => _,
                inout("rsi") slots.as_mut_ptr() => _,
                inout("rdx") lanes.start * 4 => _,
                inout("rcx") lanes.end * 4 => _,
                inout("r12") left,
                out("r13") _,
                clobber_abi("sysv64"),
            );
        }
        left
    }

    /// The same for aarch64, whose code has no regions and so spends nothing.
    #[cfg(target_arch = "aarch64")]
    fn call(&self, scratch: &mut Scratch, lanes: Range<usize>, budget: i64) -> i64 {
        let Scratch { pointers, slots } = scratch;
        // SAFETY: as on x86-64; the convention is AAPCS64, and all registers that it lets a function change
        // count as changed. The barrier is for a core that has fetched something else from these
        // addresses, before another core made the code.
        unsafe {
            std::arch::asm!(
                "isb",
                "blr {code}",
                code = in(reg) self.memory[self.start..].as_ptr(),
                inout("x0") pointers.as_ptr() => _,
                inout("x1") slots.as_mut_ptr() => _,
                inout("x2") lanes.start * 4 => _,
                inout("x3") lanes.end * 4 => _,
                clobber_abi("C"),
            );
        }
        budget
    }

    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    fn call(&self, _: &mut Scratch, _: Range<usize>, _: i64) -> i64 {
        -1
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "a test says what must hold")]

    use super::executable;
    use std::process::Command;
    use std::sync::atomic::{AtomicBool, Ordering};

    /// The permissions of all pages of this process, such as `rwxp`, with their addresses.
    fn pages() -> Vec<(std::ops::Range<usize>, String)> {
        let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
        let page = |line: &str| {
            let mut words = line.split_whitespace();
            let (from, to) = words.next()?.split_once('-')?;
            let number = |text| usize::from_str_radix(text, 16).ok();
            Some((number(from)?..number(to)?, words.next()?.to_string()))
        };
        maps.lines().filter_map(page).collect()
    }

    #[test]
    fn no_page_is_ever_writable_and_executable() {
        let done = AtomicBool::new(false);
        let looks = std::thread::scope(|scope| {
            let watcher = scope.spawn(|| {
                let mut looks = 0;
                while !done.load(Ordering::Relaxed) {
                    let wrong = pages().into_iter().find(|(_, r)| r.contains('w') && r.contains('x'));
                    assert_eq!(wrong, None);
                    looks += 1;
                }
                looks
            });
            let mut kept = Vec::new();
            for number in 0..300_usize {
                let bytes = vec![0xC3; 1 + number * 97 % 9000];
                let memory = executable(number * 64 % 4096, &bytes).unwrap();
                let at = memory.as_ptr().addr();
                let rights = pages().into_iter().find(|(range, _)| range.contains(&at)).unwrap().1;
                assert!(rights.starts_with("r-x"), "{rights}");
                assert_eq!(memory[number * 64 % 4096..], bytes);
                kept.push(memory);
                if number % 3 == 0 {
                    kept.remove(0);
                }
            }
            done.store(true, Ordering::Relaxed);
            watcher.join().unwrap()
        });
        assert!(looks > 0);
    }

    /// Set in a child process that requests executable memory from a system that refuses it.
    const REFUSED: &str = "OSL_NATIVE_TEST_REFUSED";

    #[test]
    fn a_system_that_refuses_is_no_error() {
        if std::env::var_os(REFUSED).is_some() {
            assert!(executable(64, &[0xC3]).is_none(), "the system does not refuse");
            return;
        }
        // `prctl(PR_SET_MDWE, PR_MDWE_REFUSE_EXEC_GAIN)` of Linux 6.3: from then on no page can become
        // executable. The setting survives the start of another program.
        let script = "import ctypes, os, sys\n\
            if ctypes.CDLL(None).prctl(65, 1, 0, 0, 0): sys.exit(77)\n\
            try: os.execv(sys.argv[1], sys.argv[1:])\n\
            except OSError: sys.exit(77)";
        let name = "code::tests::a_system_that_refuses_is_no_error";
        let this = std::env::current_exe().unwrap();
        let mut command = Command::new("python3");
        command.args(["-c", script]).arg(this).args(["--exact", name]).env(REFUSED, "1");
        match command.output() {
            Err(_) => println!("left out: no python3 to call prctl"),
            Ok(output) if output.status.code() == Some(77) => {
                println!("left out: this system knows no PR_SET_MDWE, or an emulator runs this test")
            }
            Ok(output) => {
                let said = String::from_utf8_lossy(&output.stdout);
                assert!(output.status.success() && said.contains("1 passed"), "{said}");
            }
        }
    }
}
