//! An emulator of the A64 instructions used by blocks, with a decoder of its own, written from the Arm
//! Architecture Reference Manual (C4.1 for the classes, C6.2 and C7.2 for the instructions), so that blocks
//! can be tested on machines without them. Instructions that are not in its lists fail. This module must not
//! know how code is made.

use crate::memory::{CODE, MAX_STEPS, Memory, POINTERS, SLOTS};
use osl_native::{Assembled, Target, Words};
use std::ops::Range;

type Vector = [u32; 4];

struct Machine<'a, 'w> {
    vectors: [Vector; 32],
    general: [u64; 31],
    /// Whether the last comparison found the first operand below the second.
    below: bool,
    memory: Memory<'a, 'w>,
}

/// Bits of a word, from one position up to another, which is included.
fn bits(word: u32, from: u32, to: u32) -> u32 {
    word >> from & (u32::MAX >> (31 - (to - from)))
}

/// The same as a signed number.
fn signed(word: u32, from: u32, to: u32) -> i64 {
    i64::from((word << (31 - to)) as i32 >> (31 - to + from))
}

/// Whether the bits of a word that a mask names are these.
fn is(word: u32, mask: u32, these: u32) -> bool {
    word & mask == these
}

/// Runs the code on lanes of arrays as `Code::run` does, after its checks.
pub(crate) fn run(code: &Assembled, arrays: Vec<Words<'_>>, lanes: Range<usize>) {
    let mut machine = Machine {
        vectors: [[0xDEAD_BEEF; 4]; 32],
        general: [0xBAD_BAD_BAD; 31],
        below: false,
        memory: Memory::new(Target::Neon, code, arrays),
    };
    let arguments = [POINTERS, SLOTS, lanes.start as u64 * 4, lanes.end as u64 * 4];
    machine.general[..4].copy_from_slice(&arguments);
    let mut at = CODE;
    for _ in 0..MAX_STEPS {
        let word = machine.memory.read(at);
        match machine.step(word, at) {
            Some(next) => at = next,
            None => return,
        }
    }
    panic!("the code does not end");
}

impl Machine<'_, '_> {
    /// Executes an instruction. Returns the address of the next one, or `None` when the call ends.
    fn step(&mut self, word: u32, at: u64) -> Option<u64> {
        let (d, n, m) = (bits(word, 0, 4) as usize, bits(word, 5, 9) as usize, bits(word, 16, 20) as usize);
        let branch =
            |taken: bool, distance: i64| at.wrapping_add_signed(if taken { 4 * distance } else { 4 });
        if word == 0xD65F_03C0 {
            return None;
        } else if is(word, 0xFC00_0000, 0x1400_0000) {
            return Some(branch(true, signed(word, 0, 25)));
        } else if is(word, 0xFF00_0010, 0x5400_0000) {
            let taken = match bits(word, 0, 3) {
                0b0010 => !self.below,
                0b0011 => self.below,
                condition => panic!("condition {condition}"),
            };
            return Some(branch(taken, signed(word, 5, 23)));
        } else if is(word, 0xFF00_0000, 0x3400_0000) {
            return Some(branch(self.general[d] as u32 == 0, signed(word, 5, 23)));
        } else if is(word, 0x9F00_0000, 0x1000_0000) {
            let distance = signed(word, 5, 23) << 2 | i64::from(bits(word, 29, 30));
            self.general[d] = at.wrapping_add_signed(distance);
        } else if is(word, 0xFF80_0000, 0x5280_0000) {
            self.general[d] = u64::from(bits(word, 5, 20)) << (16 * bits(word, 21, 22));
        } else if is(word, 0xFF80_0000, 0x7280_0000) {
            let shift = 16 * bits(word, 21, 22);
            let kept = self.general[d] & 0xFFFF_FFFF & !(0xFFFF << shift);
            self.general[d] = kept | u64::from(bits(word, 5, 20)) << shift;
        } else if is(word, 0xFFE0_FC00, 0x8B00_0000) {
            self.general[d] = self.general[n].wrapping_add(self.general[m]);
        } else if is(word, 0xFFC0_0000, 0x9100_0000) {
            self.general[d] = self.general[n].wrapping_add(u64::from(bits(word, 10, 21)));
        } else if is(word, 0xFFE0_FC1F, 0xEB00_001F) {
            self.below = self.general[n] < self.general[m];
        } else if is(word, 0xFFFF_FC00, 0x1E26_0000) {
            self.general[d] = u64::from(self.vectors[n][0]);
        } else if bits(word, 27, 27) == 1 && bits(word, 25, 25) == 0 {
            self.transfer(word, d, n, m);
        } else {
            self.vectors[d] = self.of_vectors(word, [d, n, m].map(|number| self.vectors[number]), n);
        }
        Some(at + 4)
    }

    /// Loads and stores.
    fn transfer(&mut self, word: u32, d: usize, n: usize, m: usize) {
        if is(word, 0xFFFF_FC00, 0x4C40_2000) {
            for part in 0..4 {
                let address = self.general[n] + 16 * part as u64;
                self.vectors[(d + part) % 32] = self.words(address);
            }
            return;
        }
        // The bits for the size and the kind, and the address: an offset in units of the size, or a register.
        let (kind, scale) = match (bits(word, 30, 31), bits(word, 26, 26), bits(word, 22, 23)) {
            (0, 1, 0b11) => ("ldr q", 16),
            (0, 1, 0b10) => ("str q", 16),
            (2, 1, 0b01) => ("ldr s", 4),
            (3, 0, 0b01) => ("ldr x", 8),
            other => panic!("{word:08x}: {other:?}"),
        };
        let offset = if is(word, 0x3B00_0000, 0x3900_0000) {
            scale * u64::from(bits(word, 10, 21))
        } else {
            assert!(is(word, 0x3B20_FC00, 0x3820_6800), "{word:08x}");
            self.general[m]
        };
        let address = self.general[n].wrapping_add(offset);
        match kind {
            "ldr q" => self.vectors[d] = self.words(address),
            "str q" => {
                let words = self.vectors[d];
                (0..4).for_each(|lane| self.memory.write(address + 4 * lane, words[lane as usize]));
            }
            "ldr s" => self.vectors[d] = [self.memory.read(address), 0, 0, 0],
            _ => self.general[d] = self.memory.pointer(address),
        }
    }

    fn words(&self, address: u64) -> Vector {
        std::array::from_fn(|lane| self.memory.read(address + 4 * lane as u64))
    }

    /// The result of an instruction on vectors, with the contents of its three registers.
    fn of_vectors(&self, word: u32, [old, a, b]: [Vector; 3], n: usize) -> Vector {
        let (u, size) = (bits(word, 29, 29), bits(word, 22, 23));
        if is(word, 0x9F20_0400, 0x0E20_0400) {
            assert_eq!(bits(word, 30, 30), 1, "{word:08x}: half of a vector");
            return each(|lane| same(u, size, bits(word, 11, 15), [old, a, b].map(|v| v[lane])));
        }
        if is(word, 0x9F3E_0C00, 0x0E20_0800) {
            assert_eq!(bits(word, 30, 30), 1, "{word:08x}: half of a vector");
            return each(|lane| misc(u, size, bits(word, 12, 16), a[lane]));
        }
        if is(word, 0xBFE0_FC00, 0x0EA0_C000) {
            let first = if bits(word, 30, 30) == 1 { 2 } else { 0 };
            let product = |lane: usize| i64::from(a[first + lane] as i32) * i64::from(b[first + lane] as i32);
            return each(|lane| (product(lane / 2) >> (32 * (lane & 1))) as u32);
        }
        if is(word, 0xFFE0_FC00, 0x4E80_5800) {
            return [a[1], a[3], b[1], b[3]];
        }
        if is(word, 0xFFFF_FC00, 0x6EB0_A800) {
            return [a.into_iter().fold(0, u32::max), 0, 0, 0];
        }
        if is(word, 0xFFE0_FC00, 0x4E00_0400) {
            // The lowest set bit is the size of a lane, and what is above is its number.
            assert_eq!(bits(word, 16, 18), 0b100, "{word:08x}");
            return [a[bits(word, 19, 20) as usize]; 4];
        }
        if is(word, 0xFFFF_FC00, 0x4E04_0C00) {
            return [self.general[n] as u32; 4];
        }
        if is(word, 0xFFE0_FC00, 0x4E00_6000) {
            let table: [Vector; 4] = std::array::from_fn(|at| self.vectors[(n + at) % 32]);
            let table: Vec<u8> = table.as_flattened().iter().flat_map(|word| word.to_le_bytes()).collect();
            let byte = |number: u8| table.get(usize::from(number)).copied().unwrap_or(0);
            return each(|lane| u32::from_le_bytes(b[lane].to_le_bytes().map(byte)));
        }
        if is(word, 0xDFF8_0C00, 0x4F00_0400) {
            let byte = bits(word, 16, 18) << 5 | bits(word, 5, 9);
            return [immediate(u, bits(word, 12, 15), byte); 4];
        }
        if is(word, 0xDF80_0400, 0x4F00_0400) {
            let sizes = bits(word, 16, 22);
            assert!((32..64).contains(&sizes), "{word:08x}: no lanes of 32 bits");
            return each(|lane| match (u, bits(word, 11, 15)) {
                (0, 0b01010) => a[lane] << (sizes - 32),
                (1, 0b00000) => a[lane].checked_shr(64 - sizes).unwrap_or(0),
                (0, 0b00000) => (a[lane] as i32 >> (64 - sizes).min(31)) as u32,
                other => panic!("{word:08x}: shift {other:?}"),
            });
        }
        panic!("{word:08x} is no instruction of blocks");
    }
}

fn each(f: impl FnMut(usize) -> u32) -> Vector {
    std::array::from_fn(f)
}

fn mask(truth: bool) -> u32 {
    if truth { u32::MAX } else { 0 }
}

/// One lane of an instruction on three registers of the same kind, with the old value of the result.
fn same(u: u32, size: u32, opcode: u32, [old, a, b]: [u32; 3]) -> u32 {
    let (x, y) = (f32::from_bits(a), f32::from_bits(b));
    let (i, j) = (a as i32, b as i32);
    match (u, size, opcode) {
        (0, 0b00, 0b11010) => (x + y).to_bits(),
        (0, 0b10, 0b11010) => (x - y).to_bits(),
        (1, 0b00, 0b11011) => (x * y).to_bits(),
        (1, 0b00, 0b11111) => (x / y).to_bits(),
        (0, 0b00, 0b11001) => x.mul_add(y, f32::from_bits(old)).to_bits(),
        (0, 0b10, 0b11001) => (-x).mul_add(y, f32::from_bits(old)).to_bits(),
        (0, 0b00, 0b11100) => mask(x == y),
        (1, 0b00, 0b11100) => mask(x >= y),
        (1, 0b10, 0b11100) => mask(x > y),
        (1, 0b00, 0b11101) => mask(x.abs() >= y.abs()),
        (1, 0b10, 0b11101) => mask(x.abs() > y.abs()),
        (0, 0b10, 0b10000) => a.wrapping_add(b),
        (1, 0b10, 0b10000) => a.wrapping_sub(b),
        (0, 0b10, 0b10011) => a.wrapping_mul(b),
        (0, 0b10, 0b01101) => i.min(j) as u32,
        (0, 0b10, 0b01100) => i.max(j) as u32,
        (1, 0b10, 0b01101) => a.min(b),
        // Shifts by the lowest byte, which is signed.
        (0, 0b10, 0b01000) => match i32::from(b as i8) {
            distance @ 0.. => a.checked_shl(distance as u32).unwrap_or(0),
            distance => (i >> distance.unsigned_abs().min(31)) as u32,
        },
        (1, 0b10, 0b01000) => match i32::from(b as i8) {
            distance @ 0.. => a.checked_shl(distance as u32).unwrap_or(0),
            distance => a.checked_shr(distance.unsigned_abs()).unwrap_or(0),
        },
        (1, 0b10, 0b10001) => mask(i == j),
        (0, 0b10, 0b00110) => mask(i > j),
        (0, 0b10, 0b00111) => mask(i >= j),
        (0, 0b10, 0b10001) => mask(a & b != 0),
        (0, 0b00, 0b00011) => a & b,
        (0, 0b10, 0b00011) => a | b,
        (1, 0b00, 0b00011) => a ^ b,
        (1, 0b01, 0b00011) => a & old | b & !old,
        (1, 0b10, 0b00011) => a & b | old & !b,
        (1, 0b11, 0b00011) => a & !b | old & b,
        other => panic!("{other:?} is no instruction of blocks"),
    }
}

/// One lane of an instruction on two registers.
fn misc(u: u32, size: u32, opcode: u32, a: u32) -> u32 {
    let x = f32::from_bits(a);
    match (u, size, opcode) {
        (1, 0b10, 0b11111) => x.sqrt().to_bits(),
        (0, 0b00, 0b11001) => x.floor().to_bits(),
        (0, 0b10, 0b11000) => x.ceil().to_bits(),
        (0, 0b10, 0b11001) => x.trunc().to_bits(),
        // Saturates, as `as` does.
        (0, 0b10, 0b11011) => x as i32 as u32,
        (0, 0b00, 0b11101) => (a as i32 as f32).to_bits(),
        (0, 0b10, 0b01111) => a & 0x7FFF_FFFF,
        (1, 0b10, 0b01111) => a ^ 0x8000_0000,
        (0, 0b10, 0b01011) => (a as i32).unsigned_abs(),
        (1, 0b10, 0b01011) => a.wrapping_neg(),
        (1, 0b00, 0b00101) => !a,
        other => panic!("{other:?} is no instruction of blocks"),
    }
}

/// The word of an immediate (`AdvSIMDExpandImm`).
fn immediate(inverted: u32, mode: u32, byte: u32) -> u32 {
    let word = match mode {
        0b0000 | 0b0010 | 0b0100 | 0b0110 => byte << (4 * mode),
        0b1100 => byte << 8 | 0xFF,
        0b1101 => byte << 16 | 0xFFFF,
        0b1110 if inverted == 0 => byte * 0x0101_0101,
        0b1111 if inverted == 0 => {
            let (sign, high, rest) = (byte >> 7, byte >> 6 & 1, byte & 0x3F);
            sign << 31 | (high ^ 1) << 30 | (if high == 1 { 0x1F } else { 0 }) << 25 | rest << 19
        }
        other => panic!("mode {other} of an immediate"),
    };
    if inverted == 1 { !word } else { word }
}
