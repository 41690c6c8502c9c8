//! Encodes the A64 instructions that the code consists of: one word each.
//!
//! Encodings follow the Arm Architecture Reference Manual for A-profile, chapters C4.1 (classes) and C7.2
//! (vector instructions).

/// One of 32 vector registers of 4 lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct V(pub(super) u8);

/// One of 31 general registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct X(pub(super) u8);

/// The position of a skip, whose target is not known yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Skip(usize);

/// Instruction names. Registers are added to these words. All vectors have 4 words, unless bits are meant.
pub(super) mod name {
    /// Three registers of the same kind: the fields `U`, `size` and `opcode`.
    const fn same(u: u32, size: u32, opcode: u32) -> u32 {
        0x4E20_0400 | u << 29 | size << 22 | opcode << 11
    }

    /// Two registers.
    const fn misc(u: u32, size: u32, opcode: u32) -> u32 {
        0x4E20_0800 | u << 29 | size << 22 | opcode << 12
    }

    /// An instruction that loads or stores: with an offset, and with a register that is added.
    #[derive(Clone, Copy, Debug)]
    pub(in super::super) struct Transfer {
        pub(super) at: u32,
        pub(super) sum: u32,
    }

    pub(in super::super) const FADD: u32 = same(0, 0b00, 0b11010);
    pub(in super::super) const FSUB: u32 = same(0, 0b10, 0b11010);
    pub(in super::super) const FMUL: u32 = same(1, 0b00, 0b11011);
    pub(in super::super) const FDIV: u32 = same(1, 0b00, 0b11111);
    /// The result plus the product, rounded once.
    pub(in super::super) const FMLA: u32 = same(0, 0b00, 0b11001);
    /// The result minus the product, rounded once.
    pub(in super::super) const FMLS: u32 = same(0, 0b10, 0b11001);
    pub(in super::super) const FCMEQ: u32 = same(0, 0b00, 0b11100);
    pub(in super::super) const FCMGE: u32 = same(1, 0b00, 0b11100);
    pub(in super::super) const FCMGT: u32 = same(1, 0b10, 0b11100);
    /// Compares magnitudes.
    pub(in super::super) const FACGE: u32 = same(1, 0b00, 0b11101);
    pub(in super::super) const FACGT: u32 = same(1, 0b10, 0b11101);
    pub(in super::super) const ADD: u32 = same(0, 0b10, 0b10000);
    pub(in super::super) const SUB: u32 = same(1, 0b10, 0b10000);
    pub(in super::super) const MUL: u32 = same(0, 0b10, 0b10011);
    pub(in super::super) const SMIN: u32 = same(0, 0b10, 0b01101);
    pub(in super::super) const SMAX: u32 = same(0, 0b10, 0b01100);
    pub(in super::super) const UMIN: u32 = same(1, 0b10, 0b01101);
    /// Shifts by the distances of the last operand; negative ones shift right, and fill with the sign.
    pub(in super::super) const SSHL: u32 = same(0, 0b10, 0b01000);
    pub(in super::super) const USHL: u32 = same(1, 0b10, 0b01000);
    pub(in super::super) const CMEQ: u32 = same(1, 0b10, 0b10001);
    pub(in super::super) const CMGT: u32 = same(0, 0b10, 0b00110);
    pub(in super::super) const CMGE: u32 = same(0, 0b10, 0b00111);
    /// Whether a bit is set in both.
    pub(in super::super) const CMTST: u32 = same(0, 0b10, 0b10001);
    pub(in super::super) const AND: u32 = same(0, 0b00, 0b00011);
    pub(in super::super) const ORR: u32 = same(0, 0b10, 0b00011);
    pub(in super::super) const EOR: u32 = same(1, 0b00, 0b00011);
    /// The first operand where the result is set, else the last.
    pub(in super::super) const BSL: u32 = same(1, 0b01, 0b00011);
    /// The first operand where the last is set, else the result.
    pub(in super::super) const BIT: u32 = same(1, 0b10, 0b00011);
    /// The result where the last operand is set, else the first.
    pub(in super::super) const BIF: u32 = same(1, 0b11, 0b00011);
    /// The bytes of four registers from the first operand on that the bytes of the last select.
    pub(in super::super) const TBL: u32 = 0x4E00_6000;

    /// The products, of 64 bits, of the lower two lanes, and of the upper two.
    pub(in super::super) const SMULL: u32 = 0x0EA0_C000;
    pub(in super::super) const SMULL2: u32 = 0x4EA0_C000;
    /// The odd lanes of both operands.
    pub(in super::super) const UZP2: u32 = 0x4E80_5800;

    pub(in super::super) const FSQRT: u32 = misc(1, 0b10, 0b11111);
    /// Rounding down, up, and toward zero.
    pub(in super::super) const FRINTM: u32 = misc(0, 0b00, 0b11001);
    pub(in super::super) const FRINTP: u32 = misc(0, 0b10, 0b11000);
    pub(in super::super) const FRINTZ: u32 = misc(0, 0b10, 0b11001);
    pub(in super::super) const FCVTZS: u32 = misc(0, 0b10, 0b11011);
    pub(in super::super) const SCVTF: u32 = misc(0, 0b00, 0b11101);
    pub(in super::super) const FABS: u32 = misc(0, 0b10, 0b01111);
    pub(in super::super) const FNEG: u32 = misc(1, 0b10, 0b01111);
    pub(in super::super) const ABS: u32 = misc(0, 0b10, 0b01011);
    pub(in super::super) const NEG: u32 = misc(1, 0b10, 0b01011);
    pub(in super::super) const NOT: u32 = misc(1, 0b00, 0b00101);
    /// The largest lane.
    pub(in super::super) const UMAXV: u32 = 0x6EB0_A800;
    /// The lowest lane, in all lanes.
    pub(in super::super) const DUP: u32 = 0x4E04_0400;

    /// Shifts right by an immediate; they fill with zeros and with the sign.
    pub(in super::super) const USHR: u32 = 0x6F00_0400;
    pub(in super::super) const SSHR: u32 = 0x4F00_0400;

    pub(in super::super) const LDR_Q: Transfer = Transfer { at: 0x3DC0_0000, sum: 0x3CE0_6800 };
    pub(in super::super) const STR_Q: Transfer = Transfer { at: 0x3D80_0000, sum: 0x3CA0_6800 };
    pub(in super::super) const LDR_S: Transfer = Transfer { at: 0xBD40_0000, sum: 0xBC60_6800 };
    pub(in super::super) const LDR_X: Transfer = Transfer { at: 0xF940_0000, sum: 0xF860_6800 };
    pub(in super::super) const RET: u32 = 0xD65F_03C0;
}

/// The farthest instruction, in words, to which a conditional branch leads back.
const FARTHEST: usize = 1 << 18;

/// A sequence of instructions.
#[derive(Clone, Debug, Default)]
pub(super) struct Assembler {
    words: Vec<u32>,
}

impl Assembler {
    /// The number of the next instruction.
    pub(super) fn here(&self) -> usize {
        self.words.len()
    }

    pub(super) fn push(&mut self, word: u32) {
        self.words.push(word);
    }

    /// Writes instructions over others.
    pub(super) fn replace(&mut self, from: usize, by: &Assembler) {
        self.words.iter_mut().skip(from).zip(&by.words).for_each(|(to, word)| *to = *word);
    }

    pub(super) fn bytes(&self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    /// An instruction on two operands.
    pub(super) fn three(&mut self, op: u32, V(to): V, V(first): V, V(last): V) {
        self.push(op | u32::from(last) << 16 | u32::from(first) << 5 | u32::from(to));
    }

    /// An instruction on one operand.
    pub(super) fn two(&mut self, op: u32, V(to): V, V(from): V) {
        self.push(op | u32::from(from) << 5 | u32::from(to));
    }

    pub(super) fn copy(&mut self, to: V, from: V) {
        self.three(name::ORR, to, from, from);
    }

    /// `yes` in the lanes of a mask, else `no`.
    pub(super) fn choose(&mut self, to: V, mask: V, yes: V, no: V) {
        if to == mask {
            self.three(name::BSL, to, yes, no);
        } else if to == yes {
            self.three(name::BIF, to, no, mask);
        } else {
            if to != no {
                self.copy(to, no);
            }
            self.three(name::BIT, to, yes, mask);
        }
    }

    /// Shifts left by a distance below 32.
    pub(super) fn shift_left(&mut self, to: V, from: V, distance: u32) {
        self.two(0x4F20_5400 | distance << 16, to, from);
    }

    /// Shifts right by a distance from 1 to 32.
    pub(super) fn shift_right(&mut self, op: u32, to: V, from: V, distance: u32) {
        self.two(op | (64 - distance) << 16, to, from);
    }

    /// A word in all lanes, if an instruction has it. Returns false if there is none.
    pub(super) fn immediate(&mut self, V(to): V, bits: u32) -> bool {
        let byte = |value: u32, at: u32| (value & !(0xFF << at) == 0).then_some(value >> at);
        let shifted = |value: u32| {
            [0, 8, 16, 24].into_iter().zip(0..).find_map(|(at, n)| Some((byte(value, at)?, n << 1)))
        };
        let ones_behind = |value: u32, at: u32| {
            let below = (1 << at) - 1;
            (value & below == below).then(|| byte(value & !below, at)).flatten()
        };
        let exponent = bits >> 25 & 0x3F;
        let found = if let Some((byte, mode)) = shifted(bits) {
            (0, mode, byte)
        } else if let Some((byte, mode)) = shifted(!bits) {
            (1, mode, byte)
        } else if let Some(byte) = ones_behind(bits, 8) {
            (0, 0b1100, byte)
        } else if let Some(byte) = ones_behind(bits, 16) {
            (0, 0b1101, byte)
        } else if bits == (bits & 0xFF) * 0x0101_0101 {
            (0, 0b1110, bits & 0xFF)
        } else if bits & 0x7_FFFF == 0 && (exponent == 0x20 || exponent == 0x1F) {
            (0, 0b1111, bits >> 31 << 7 | bits >> 19 & 0x7F)
        } else {
            return false;
        };
        let (inverted, mode, byte) = found;
        self.push(
            0x4F00_0400 | inverted << 29 | byte >> 5 << 16 | mode << 12 | (byte & 31) << 5 | u32::from(to),
        );
        true
    }

    /// Fills a vector with the lower word of a general register.
    pub(super) fn fill(&mut self, V(to): V, X(from): X) {
        self.push(0x4E04_0C00 | u32::from(from) << 5 | u32::from(to));
    }

    /// The lowest word of a vector.
    pub(super) fn lowest_word(&mut self, X(to): X, V(from): V) {
        self.push(0x1E26_0000 | u32::from(from) << 5 | u32::from(to));
    }

    /// Loads or stores at a register and an offset below 4096, which counts what is transferred.
    pub(super) fn transfer_at(&mut self, op: name::Transfer, number: u8, X(base): X, offset: u32) {
        self.push(op.at | offset << 10 | u32::from(base) << 5 | u32::from(number));
    }

    /// Loads or stores at the sum of two registers.
    pub(super) fn transfer_sum(&mut self, op: name::Transfer, number: u8, X(base): X, X(other): X) {
        self.push(op.sum | u32::from(other) << 16 | u32::from(base) << 5 | u32::from(number));
    }

    /// Loads four vectors into registers that follow each other.
    pub(super) fn load_four(&mut self, V(first): V, X(from): X) {
        self.push(0x4C40_2000 | u32::from(from) << 5 | u32::from(first));
    }

    /// Sets a register.
    pub(super) fn set(&mut self, to: X, value: u32) {
        if value >> 16 == 0 {
            self.push(0x5280_0000 | value << 5 | u32::from(to.0));
        } else {
            self.set_both(to, value);
        }
    }

    /// Sets a register, always by two instructions.
    pub(super) fn set_both(&mut self, X(to): X, value: u32) {
        self.push(0x5280_0000 | (value & 0xFFFF) << 5 | u32::from(to));
        self.push(0x72A0_0000 | value >> 16 << 5 | u32::from(to));
    }

    pub(super) fn add(&mut self, X(to): X, X(a): X, X(b): X) {
        self.push(0x8B00_0000 | u32::from(b) << 16 | u32::from(a) << 5 | u32::from(to));
    }

    /// Adds a number below 4096.
    pub(super) fn add_immediate(&mut self, X(to): X, X(from): X, value: u32) {
        self.push(0x9100_0000 | value << 10 | u32::from(from) << 5 | u32::from(to));
    }

    /// The address of the instruction itself.
    pub(super) fn address_of_this(&mut self, X(to): X) {
        self.push(0x1000_0000 | u32::from(to));
    }

    /// Compares two registers, for the next branch.
    pub(super) fn compare(&mut self, X(a): X, X(b): X) {
        self.push(0xEB00_001F | u32::from(b) << 16 | u32::from(a) << 5);
    }

    /// Continues at an earlier instruction if the comparison said "below" for unsigned numbers.
    pub(super) fn repeat_if_below(&mut self, start: usize) {
        if self.here() - start < FARTHEST {
            let distance = (start as u32).wrapping_sub(self.here() as u32) & 0x7_FFFF;
            self.push(0x5400_0003 | distance << 5);
        } else {
            // Over the next instruction if not below; that one leads 32 times as far.
            self.push(0x5400_0042);
            let distance = (start as u32).wrapping_sub(self.here() as u32) & 0x3FF_FFFF;
            self.push(0x1400_0000 | distance);
        }
    }

    /// A forward branch, taken if a word is zero.
    pub(super) fn skip_if_zero(&mut self, X(word): X) -> Skip {
        self.push(0x3400_0000 | u32::from(word));
        Skip(self.here() - 1)
    }

    /// Sets the target of a skip to this position, which is near.
    pub(super) fn land(&mut self, Skip(at): Skip) {
        let distance = (self.here() - at) as u32;
        if let Some(word) = self.words.get_mut(at) {
            *word |= distance << 5;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(write: impl FnOnce(&mut Assembler)) -> Vec<u32> {
        let mut code = Assembler::default();
        write(&mut code);
        code.words
    }

    // All words below are those of the GNU assembler (binutils 2.40) for the text beside them.

    #[test]
    fn operations_are_what_they_are_called() {
        for (op, text, word) in [
            (name::FADD, "fadd v1.4s, v2.4s, v3.4s", 0x4E23_D441),
            (name::FSUB, "fsub v1.4s, v2.4s, v3.4s", 0x4EA3_D441),
            (name::FMUL, "fmul v1.4s, v2.4s, v3.4s", 0x6E23_DC41),
            (name::FDIV, "fdiv v1.4s, v2.4s, v3.4s", 0x6E23_FC41),
            (name::FMLA, "fmla v1.4s, v2.4s, v3.4s", 0x4E23_CC41),
            (name::FMLS, "fmls v1.4s, v2.4s, v3.4s", 0x4EA3_CC41),
            (name::FCMEQ, "fcmeq v1.4s, v2.4s, v3.4s", 0x4E23_E441),
            (name::FCMGE, "fcmge v1.4s, v2.4s, v3.4s", 0x6E23_E441),
            (name::FCMGT, "fcmgt v1.4s, v2.4s, v3.4s", 0x6EA3_E441),
            (name::FACGE, "facge v1.4s, v2.4s, v3.4s", 0x6E23_EC41),
            (name::FACGT, "facgt v1.4s, v2.4s, v3.4s", 0x6EA3_EC41),
            (name::ADD, "add v1.4s, v2.4s, v3.4s", 0x4EA3_8441),
            (name::SUB, "sub v1.4s, v2.4s, v3.4s", 0x6EA3_8441),
            (name::MUL, "mul v1.4s, v2.4s, v3.4s", 0x4EA3_9C41),
            (name::SMIN, "smin v1.4s, v2.4s, v3.4s", 0x4EA3_6C41),
            (name::SMAX, "smax v1.4s, v2.4s, v3.4s", 0x4EA3_6441),
            (name::UMIN, "umin v1.4s, v2.4s, v3.4s", 0x6EA3_6C41),
            (name::SSHL, "sshl v1.4s, v2.4s, v3.4s", 0x4EA3_4441),
            (name::USHL, "ushl v1.4s, v2.4s, v3.4s", 0x6EA3_4441),
            (name::CMEQ, "cmeq v1.4s, v2.4s, v3.4s", 0x6EA3_8C41),
            (name::CMGT, "cmgt v1.4s, v2.4s, v3.4s", 0x4EA3_3441),
            (name::CMGE, "cmge v1.4s, v2.4s, v3.4s", 0x4EA3_3C41),
            (name::CMTST, "cmtst v1.4s, v2.4s, v3.4s", 0x4EA3_8C41),
            (name::AND, "and v1.16b, v2.16b, v3.16b", 0x4E23_1C41),
            (name::ORR, "orr v1.16b, v2.16b, v3.16b", 0x4EA3_1C41),
            (name::EOR, "eor v1.16b, v2.16b, v3.16b", 0x6E23_1C41),
            (name::BSL, "bsl v1.16b, v2.16b, v3.16b", 0x6E63_1C41),
            (name::BIT, "bit v1.16b, v2.16b, v3.16b", 0x6EA3_1C41),
            (name::BIF, "bif v1.16b, v2.16b, v3.16b", 0x6EE3_1C41),
            (name::SMULL, "smull v1.2d, v2.2s, v3.2s", 0x0EA3_C041),
            (name::SMULL2, "smull2 v1.2d, v2.4s, v3.4s", 0x4EA3_C041),
            (name::UZP2, "uzp2 v1.4s, v2.4s, v3.4s", 0x4E83_5841),
            (name::TBL, "tbl v1.16b, {v2.16b-v5.16b}, v3.16b", 0x4E03_6041),
        ] {
            assert_eq!(words(|code| code.three(op, V(1), V(2), V(3))), [word], "{text}");
        }
        for (op, text, word) in [
            (name::FSQRT, "fsqrt v1.4s, v2.4s", 0x6EA1_F841),
            (name::FRINTM, "frintm v1.4s, v2.4s", 0x4E21_9841),
            (name::FRINTP, "frintp v1.4s, v2.4s", 0x4EA1_8841),
            (name::FRINTZ, "frintz v1.4s, v2.4s", 0x4EA1_9841),
            (name::FCVTZS, "fcvtzs v1.4s, v2.4s", 0x4EA1_B841),
            (name::SCVTF, "scvtf v1.4s, v2.4s", 0x4E21_D841),
            (name::FABS, "fabs v1.4s, v2.4s", 0x4EA0_F841),
            (name::FNEG, "fneg v1.4s, v2.4s", 0x6EA0_F841),
            (name::ABS, "abs v1.4s, v2.4s", 0x4EA0_B841),
            (name::NEG, "neg v1.4s, v2.4s", 0x6EA0_B841),
            (name::NOT, "not v1.16b, v2.16b", 0x6E20_5841),
            (name::UMAXV, "umaxv s1, v2.4s", 0x6EB0_A841),
            (name::DUP, "dup v1.4s, v2.s[0]", 0x4E04_0441),
        ] {
            assert_eq!(words(|code| code.two(op, V(1), V(2))), [word], "{text}");
        }
    }

    #[test]
    fn every_register_is_encoded() {
        for r in 0..32 {
            let word = words(|code| code.three(name::FADD, V(r), V(31 - r), V((r + 7) % 32)))[0];
            let fields = [word & 31, word >> 5 & 31, word >> 16 & 31];
            assert_eq!(fields.map(|field| field as u8), [r, 31 - r, (r + 7) % 32]);
        }
    }

    #[test]
    fn shifts_and_single_words_are_encoded() {
        assert_eq!(words(|code| code.copy(V(1), V(2))), [0x4EA2_1C41], "mov v1.16b, v2.16b");
        assert_eq!(words(|code| code.shift_left(V(1), V(2), 0)), [0x4F20_5441], "shl v1.4s, v2.4s, #0");
        assert_eq!(words(|code| code.shift_left(V(31), V(30), 31)), [0x4F3F_57DF], "shl v31.4s, v30.4s, #31");
        assert_eq!(
            words(|code| code.shift_right(name::SSHR, V(1), V(2), 1)),
            [0x4F3F_0441],
            "sshr v1.4s, v2.4s, #1"
        );
        assert_eq!(
            words(|code| code.shift_right(name::SSHR, V(1), V(2), 31)),
            [0x4F21_0441],
            "sshr v1.4s, v2.4s, #31"
        );
        assert_eq!(
            words(|code| code.shift_right(name::USHR, V(31), V(30), 31)),
            [0x6F21_07DF],
            "ushr v31.4s, v30.4s, #31"
        );
        assert_eq!(words(|code| code.fill(V(3), X(17))), [0x4E04_0E23], "dup v3.4s, w17");
        assert_eq!(words(|code| code.lowest_word(X(17), V(5))), [0x1E26_00B1], "fmov w17, s5");
    }

    #[test]
    fn memory_is_encoded() {
        assert_eq!(
            words(|code| code.transfer_sum(name::LDR_Q, 9, X(4), X(2))),
            [0x3CE2_6889],
            "ldr q9, [x4, x2]"
        );
        assert_eq!(
            words(|code| code.transfer_at(name::LDR_Q, 9, X(1), 4095)),
            [0x3DFF_FC29],
            "ldr q9, [x1, #65520]"
        );
        assert_eq!(
            words(|code| code.transfer_sum(name::STR_Q, 9, X(4), X(2))),
            [0x3CA2_6889],
            "str q9, [x4, x2]"
        );
        assert_eq!(
            words(|code| code.transfer_at(name::STR_Q, 9, X(1), 2)),
            [0x3D80_0829],
            "str q9, [x1, #32]"
        );
        assert_eq!(
            words(|code| code.transfer_at(name::LDR_S, 9, X(4), 4095)),
            [0xBD7F_FC89],
            "ldr s9, [x4, #16380]"
        );
        assert_eq!(
            words(|code| code.transfer_sum(name::LDR_S, 9, X(4), X(17))),
            [0xBC71_6889],
            "ldr s9, [x4, x17]"
        );
        assert_eq!(
            words(|code| code.transfer_at(name::LDR_X, 16, X(0), 4095)),
            [0xF97F_FC10],
            "ldr x16, [x0, #32760]"
        );
        assert_eq!(
            words(|code| code.transfer_sum(name::LDR_X, 16, X(0), X(17))),
            [0xF871_6810],
            "ldr x16, [x0, x17]"
        );
        assert_eq!(
            words(|code| code.load_four(V(28), X(17))),
            [0x4C40_223C],
            "ld1 {{v28.16b-v31.16b}}, [x17]"
        );
    }

    #[test]
    fn general_registers_are_encoded() {
        assert_eq!(words(|code| code.set(X(17), 0x1234)), [0x5282_4691], "mov w17, #4660");
        let both = [0x5282_4691, 0x72AA_CF11];
        assert_eq!(
            words(|code| code.set(X(17), 0x5678_1234)),
            both,
            "mov w17, #4660; movk w17, #22136, lsl #16"
        );
        assert_eq!(words(|code| code.add(X(17), X(4), X(2))), [0x8B02_0091], "add x17, x4, x2");
        assert_eq!(words(|code| code.add_immediate(X(2), X(2), 16)), [0x9100_4042], "add x2, x2, #16");
        assert_eq!(
            words(|code| code.add_immediate(X(17), X(14), 4095)),
            [0x913F_FDD1],
            "add x17, x14, #4095"
        );
        assert_eq!(words(|code| code.address_of_this(X(17))), [0x1000_0011], "adr x17, .");
        assert_eq!(words(|code| code.compare(X(2), X(3))), [0xEB03_005F], "cmp x2, x3");
        assert_eq!(words(|code| code.push(name::RET)), [0xD65F_03C0], "ret");
    }

    #[test]
    fn immediates_are_encoded() {
        for (bits, text, word) in [
            (0, "movi v1.4s, #0", 0x4F00_0401),
            (0x7F, "movi v1.4s, #127", 0x4F03_07E1),
            (0xAB00, "movi v1.4s, #171, lsl #8", 0x4F05_2561),
            (0x7F_0000, "movi v1.4s, #127, lsl #16", 0x4F03_47E1),
            (0x8000_0000, "movi v1.4s, #128, lsl #24", 0x4F04_6401),
            (u32::MAX, "mvni v1.4s, #0", 0x6F00_0401),
            (0x7FFF_FFFF, "mvni v1.4s, #128, lsl #24", 0x6F04_6401),
            (!0xAB00, "mvni v1.4s, #171, lsl #8", 0x6F05_2561),
            (0x7FFF, "movi v1.4s, #127, msl #8", 0x4F03_C7E1),
            (0x7F_FFFF, "movi v1.4s, #127, msl #16", 0x4F03_D7E1),
            (0x0404_0404, "movi v1.16b, #4", 0x4F00_E481),
            (1.0_f32.to_bits(), "fmov v1.4s, #1.0", 0x4F03_F601),
            ((-0.75_f32).to_bits(), "fmov v1.4s, #-0.75", 0x4F07_F501),
            (31.0_f32.to_bits(), "fmov v1.4s, #31.0", 0x4F01_F7E1),
            (0.15625_f32.to_bits(), "fmov v1.4s, #0.15625", 0x4F02_F481),
        ] {
            assert_eq!(words(|code| assert!(code.immediate(V(1), bits))), [word], "{text}");
        }
        for bits in [0x0302_0100, 0x7F80_0000, 0x1_0001, 0.1_f32.to_bits(), 33.0_f32.to_bits()] {
            assert_eq!(words(|code| assert!(!code.immediate(V(1), bits))), [], "{bits:x}");
        }
    }

    #[test]
    fn branches_lead_where_they_land() {
        let back = words(|code| {
            (0..4).for_each(|_| code.push(name::RET));
            code.repeat_if_below(0);
        });
        assert_eq!(back[4], 0x54FF_FF83, "b.lo .-16");
        let far = words(|code| {
            (0..FARTHEST).for_each(|_| code.push(name::RET));
            code.repeat_if_below(FARTHEST - 3);
            code.repeat_if_below(0);
        });
        assert_eq!(
            far[FARTHEST..],
            [0x54FF_FFA3, 0x5400_0042, 0x17FB_FFFE],
            "b.lo .-12; b.hs .+8; b .-1048584"
        );
        let forward = words(|code| {
            let skip = code.skip_if_zero(X(17));
            (0..4).for_each(|_| code.push(name::RET));
            code.land(skip);
        });
        assert_eq!(forward[0], 0x3400_00B1, "cbz w17, .+20");
    }
}
