//! The base of code for x86-64: its arguments, jumps, the loop, operands in memory, and constants behind the
//! code.
//!
//! Encodings follow the Intel 64 manual, volume 2.

use crate::encoder::{Base, MemoryOperand};
use crate::inst::Compare;

/// The code's arguments, in the registers of the first four parameters: pointers to the arrays, working
/// memory for values without a register, the byte offset of the first lane, and the byte offset after the
/// last.
const POINTERS: Gpr = Gpr::RDI;
const SLOTS: Gpr = Gpr::RSI;
const LANE: Gpr = Gpr::RDX;
const END: Gpr = Gpr::RCX;
/// The budget of a call, in a register beyond the usual parameters: what is left of it, which is negative if
/// the code was stopped. The caller expects it to change.
const BUDGET: Gpr = Gpr(12);
/// Another one, for the offsets of addresses.
const OFFSET: Gpr = Gpr(13);
/// Caller-saved registers: for the arrays that are used most, and for the pointer of any other one.
const BASES: [Gpr; 5] = [Gpr(8), Gpr(9), Gpr(10), Gpr(11), Gpr::RAX];
/// Number of arrays whose pointers stay in registers.
pub(crate) const KEPT_BASES: u8 = BASES.len() as u8 - 1;

/// A general register by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Gpr(pub(crate) u8);

impl Gpr {
    const RAX: Gpr = Gpr(0);
    const RCX: Gpr = Gpr(1);
    const RDX: Gpr = Gpr(2);
    const RSI: Gpr = Gpr(6);
    const RDI: Gpr = Gpr(7);
}

/// A memory operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mem {
    /// `[base + disp]`
    At(Gpr, i32),
    /// `[base + index + disp]`; the index is not `rsp`.
    Indexed(Gpr, Gpr, i32),
    /// A word in the pool of constants after the code, by its number.
    Pool(u32),
}

/// The condition of a jump.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Jump {
    IfAny,
    IfNone,
    /// After a subtraction whose result is negative.
    IfNegative,
    Always,
}

/// The opcode map, the mandatory prefix and the opcode of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Opcode {
    pub(crate) map: u8,
    pub(crate) prefix: u8,
    pub(crate) byte: u8,
}

pub(crate) const fn opcode(map: u8, prefix: u8, byte: u8) -> Opcode {
    Opcode { map, prefix, byte }
}

pub(crate) const NONE: u8 = 0;
pub(crate) const P66: u8 = 1;
pub(crate) const PF3: u8 = 2;

/// Code under construction, and the constants that it reads.
#[derive(Clone, Debug, Default)]
pub(crate) struct Assembler {
    pub(crate) bytes: Vec<u8>,
    pool: Vec<u32>,
    /// Positions of the displacements to constants, each with the number of its constant.
    fixes: Vec<(usize, u32)>,
    /// Jumps to where the code stops early.
    stops: Vec<usize>,
    /// Number of instructions.
    pub(crate) count: usize,
}

impl Assembler {
    /// The offset of the next instruction.
    pub(crate) fn here(&self) -> usize {
        self.bytes.len()
    }

    /// An operand in memory, for vectors of `size` bytes.
    pub(crate) fn place(&mut self, operand: MemoryOperand, size: usize) -> Mem {
        let base = |Base(number)| BASES.get(usize::from(number)).copied().unwrap_or(Gpr::RAX);
        match operand {
            MemoryOperand::Slot(slot) => Mem::At(SLOTS, slot as i32 * size as i32),
            MemoryOperand::Lanes(array, word) => Mem::Indexed(base(array), LANE, 4 * word as i32),
            MemoryOperand::Word(array, word) | MemoryOperand::Table(array, word) => {
                Mem::At(base(array), 4 * word as i32)
            }
            MemoryOperand::Constant(bits) => Mem::Pool(self.constant(bits)),
        }
    }

    /// Loads the pointer of an array.
    pub(crate) fn base(&mut self, Base(to): Base, array: u32) {
        let to = BASES.get(usize::from(to)).copied().unwrap_or(Gpr::RAX);
        self.pointer(to, POINTERS, 8 * array as i32);
    }

    /// The register of a pointer.
    pub(crate) fn base_register(Base(number): Base) -> Gpr {
        BASES.get(usize::from(number)).copied().unwrap_or(Gpr::RAX)
    }

    /// Adds the first word of a vector to a pointer, as a number of words.
    pub(crate) fn advance(&mut self, base: Base, vector: u8) {
        self.count += 2;
        let (to, offset) = (Self::base_register(base), OFFSET);
        // vmovd offset, xmm (EVEX, or VEX for the lower registers: it exists without AVX-512)
        let (b, vector_low) = (offset.0 >> 3 ^ 1, vector & 7);
        if vector < 16 {
            self.bytes.extend([0xC4, (vector >> 3 ^ 1) << 7 | 0x40 | b << 5 | 1, 0x79, 0x7E]);
        } else {
            let r = (vector >> 3 & 1) ^ 1;
            self.bytes.extend([0x62, r << 7 | 0x40 | b << 5 | 1, 0x7D, 0x08, 0x7E]);
        }
        self.bytes.push(0xC0 | vector_low << 3 | offset.0 & 7);
        // lea to, [to + offset * 4]
        self.bytes.extend([0x48 | (to.0 >> 3) << 2 | (offset.0 >> 3) << 1 | to.0 >> 3, 0x8D]);
        self.bytes.extend([0x84 | (to.0 & 7) << 3, 0x80 | (offset.0 & 7) << 3 | to.0 & 7]);
        self.bytes.extend([0; 4]);
    }

    /// The number of a constant.
    pub(crate) fn constant(&mut self, bits: u32) -> u32 {
        let found = self.pool.iter().position(|have| *have == bits);
        found.unwrap_or_else(|| {
            self.pool.push(bits);
            self.pool.len() - 1
        }) as u32
    }

    /// The code, followed by its constants, each repeated a number of times.
    pub(crate) fn finish(mut self, copies: usize) -> Vec<u8> {
        let size = 4 * copies;
        self.bytes.resize(self.bytes.len().next_multiple_of(size), 0xCC);
        let pool = self.bytes.len();
        for (at, number) in &self.fixes {
            // The displacement counts from the end of the instruction, which was recorded with it.
            let known = self.bytes[*at..].first_chunk::<4>().map_or(0, |b| i32::from_le_bytes(*b));
            let distance = (pool + size * *number as usize) as i32 - (*at as i32 + 4 + known);
            if let Some(slot) = self.bytes[*at..].first_chunk_mut::<4>() {
                *slot = distance.to_le_bytes();
            }
        }
        let words = self.pool.iter().flat_map(|word| std::iter::repeat_n(*word, copies));
        self.bytes.extend(words.flat_map(u32::to_le_bytes));
        self.bytes
    }

    /// Loads a pointer.
    fn pointer(&mut self, to: Gpr, base: Gpr, disp: i32) {
        self.count += 1;
        self.bytes.extend([0x48 | (to.0 >> 3) << 2 | base.0 >> 3, 0x8B]);
        self.memory(to.0 & 7, Mem::At(base, disp), 0);
    }

    /// A forward jump, taken if the mask tested last was not all zeros, if it was, or always. Returns the
    /// argument for [`Assembler::land`].
    pub(crate) fn jump(&mut self, when: Jump) -> usize {
        self.count += 1;
        match when {
            Jump::IfAny => self.bytes.extend([0x0F, 0x85]),
            Jump::IfNone => self.bytes.extend([0x0F, 0x84]),
            Jump::IfNegative => self.bytes.extend([0x0F, 0x88]),
            Jump::Always => self.bytes.push(0xE9),
        }
        self.bytes.extend([0; 4]);
        self.bytes.len()
    }

    /// Sets the target of a jump to this position.
    pub(crate) fn land(&mut self, jump: usize) {
        let distance = (self.bytes.len() - jump) as i32;
        if let Some(slot) = self.bytes[..jump].last_chunk_mut::<4>() {
            *slot = distance.to_le_bytes();
        }
    }

    /// A jump back to an earlier position, taken if the mask tested last was not all zeros.
    pub(crate) fn jump_back(&mut self, to: usize) {
        let jump = self.jump(Jump::IfAny);
        let distance = to as i32 - jump as i32;
        if let Some(slot) = self.bytes.last_chunk_mut::<4>() {
            *slot = distance.to_le_bytes();
        }
    }

    /// Takes a cost from the budget; if it `may_stop`, stops the code once the budget is negative.
    pub(crate) fn spend(&mut self, cost: u32, may_stop: bool) {
        self.count += 1;
        // sub budget, imm32
        self.bytes.extend([0x48 | BUDGET.0 >> 3, 0x81, 0xE8 | BUDGET.0 & 7]);
        self.bytes.extend((cost.min(i32::MAX as u32) as i32).to_le_bytes());
        if may_stop {
            self.stop(Jump::IfNegative);
        }
    }

    /// A jump to where the code stops early.
    pub(crate) fn stop(&mut self, when: Jump) {
        let jump = self.jump(when);
        self.stops.push(jump);
    }

    /// `LANE += step; if LANE < END goto start`, then the epilogue: clears the upper register halves and
    /// returns. Code that stops early has an end of its own.
    pub(crate) fn count_and_return(&mut self, step: i32, start: usize) {
        self.count += 5;
        let (to, end) = (LANE, END);
        // add to, imm32; cmp to, end; jb rel32
        self.bytes.extend([0x48 | to.0 >> 3, 0x81, 0xC0 | to.0 & 7]);
        self.bytes.extend(step.to_le_bytes());
        self.bytes.extend([0x48 | (end.0 >> 3) << 2 | to.0 >> 3, 0x39, 0xC0 | (end.0 & 7) << 3 | to.0 & 7]);
        let behind = self.bytes.len() + 6;
        self.bytes.extend([0x0F, 0x82]);
        self.bytes.extend((start as i32 - behind as i32).to_le_bytes());
        // vzeroupper; ret
        const RETURN: [u8; 4] = [0xC5, 0xF8, 0x77, 0xC3];
        self.bytes.extend(RETURN);
        let stops = std::mem::take(&mut self.stops);
        if !stops.is_empty() {
            stops.into_iter().for_each(|jump| self.land(jump));
            // mov budget, -1
            self.count += 3;
            self.bytes.extend([0x48 | BUDGET.0 >> 3, 0xC7, 0xC0 | BUDGET.0 & 7, 0xFF, 0xFF, 0xFF, 0xFF]);
            self.bytes.extend(RETURN);
        }
    }

    /// The bytes of a memory operand; `behind` bytes of the instruction follow.
    pub(crate) fn memory(&mut self, reg: u8, mem: Mem, behind: i32) {
        match mem {
            Mem::At(base, disp) => {
                self.bytes.push(0x80 | reg << 3 | base.0 & 7);
                if base.0 & 7 == 4 {
                    self.bytes.push(0x24);
                }
                self.bytes.extend(disp.to_le_bytes());
            }
            Mem::Indexed(base, index, disp) => {
                self.bytes.extend([0x84 | reg << 3, (index.0 & 7) << 3 | base.0 & 7]);
                self.bytes.extend(disp.to_le_bytes());
            }
            Mem::Pool(number) => {
                self.bytes.push(0x05 | reg << 3);
                self.fixes.push((self.bytes.len(), number));
                self.bytes.extend(behind.to_le_bytes());
            }
        }
    }
}

impl Mem {
    /// The fourth bit of the index.
    pub(crate) fn x(self) -> u8 {
        if let Mem::Indexed(_, index, _) = self { index.0 >> 3 & 1 } else { 0 }
    }

    /// The fourth bit of the base.
    pub(crate) fn b(self) -> u8 {
        match self {
            Mem::At(base, _) | Mem::Indexed(base, ..) => base.0 >> 3 & 1,
            Mem::Pool(_) => 0,
        }
    }
}

/// The predicate of a comparison of floats.
pub(crate) fn predicate(how: Compare) -> u8 {
    match how {
        Compare::Equal => 0x00,
        Compare::Less => 0x01,
        Compare::LessEqual => 0x02,
        Compare::UnequalOrNan => 0x04,
        Compare::GreaterEqualOrNan => 0x05,
        Compare::GreaterOrNan => 0x06,
        Compare::EqualOrNan => 0x08,
        Compare::LessOrNan => 0x09,
        Compare::LessEqualOrNan => 0x0A,
        Compare::GreaterEqual => 0x0D,
        Compare::Greater => 0x0E,
    }
}

/// Rounding modes of instructions that round, without the precision exception.
pub(crate) const FLOOR: u8 = 9;
pub(crate) const CEIL: u8 = 10;
pub(crate) const TRUNC: u8 = 11;

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use iced_x86::{Decoder, DecoderOptions, Formatter, IntelFormatter};

    /// Disassembles code.
    pub(crate) fn read(bytes: &[u8]) -> Vec<String> {
        let mut formatter = IntelFormatter::new();
        formatter.options_mut().set_space_after_operand_separator(true);
        let mut all = Vec::new();
        for inst in &mut Decoder::with_ip(64, bytes, 0, DecoderOptions::NONE) {
            assert!(!inst.is_invalid(), "{all:?} {bytes:x?}");
            let mut text = String::new();
            formatter.format(&inst, &mut text);
            all.push(text);
        }
        all
    }

    /// The single instruction that is written.
    pub(crate) fn one(write: impl FnOnce(&mut Assembler)) -> String {
        let mut code = Assembler::default();
        write(&mut code);
        let texts = read(&code.bytes);
        let [text] = texts.as_slice() else { panic!("{texts:?}") };
        text.clone()
    }

    /// Names of the general registers, by number.
    pub(crate) const NAMES: [&str; 12] =
        ["rax", "rcx", "rdx", "rbx", "rsp", "rbp", "rsi", "rdi", "r8", "r9", "r10", "r11"];

    #[test]
    fn pointers_are_loaded() {
        for (number, base) in NAMES.iter().enumerate() {
            let text = one(|code| code.pointer(Gpr(10), Gpr(number as u8), 8));
            assert_eq!(text, format!("mov r10, [{base}+8]"));
        }
    }

    #[test]
    fn offsets_are_added_to_pointers() {
        for (base, name) in [(0, "r8"), (3, "r11"), (4, "rax")] {
            for vector in [1, 9, 17, 31] {
                let mut code = Assembler::default();
                code.advance(Base(base), vector);
                let expected = [format!("vmovd r13d, xmm{vector}"), format!("lea {name}, [{name}+r13*4]")];
                assert_eq!(read(&code.bytes), expected);
            }
        }
    }

    #[test]
    fn a_budget_is_spent_and_stops_code() {
        let mut code = Assembler::default();
        let start = code.here();
        code.spend(100, true);
        code.spend(7, false);
        code.jump_back(start);
        code.count_and_return(64, start);
        let texts = read(&code.bytes);
        let end = code.here() - 11;
        let expected = ["sub r12, 64h".to_owned(), format!("js {end:016X}h"), "sub r12, 7".to_owned()];
        assert_eq!(texts[..3], expected);
        assert_eq!(texts[3], "jne 0");
        assert_eq!(texts[texts.len() - 3..], ["mov r12, 0FFFFFFFFFFFFFFFFh", "vzeroupper", "ret"]);
    }

    #[test]
    fn jumps_lead_where_they_land() {
        let mut code = Assembler::default();
        for (when, name) in [(Jump::IfAny, "jne"), (Jump::IfNone, "je"), (Jump::Always, "jmp")] {
            let start = code.here();
            let jump = code.jump(when);
            (0..3).for_each(|_| code.pointer(Gpr::RAX, Gpr::RSI, 8));
            code.land(jump);
            let texts = read(&code.bytes[start..]);
            assert_eq!(texts[0], format!("{name} {:016X}h", code.here() - start));
            assert_eq!(texts[1..], ["mov rax, [rsi+8]"; 3]);
        }
    }
}
