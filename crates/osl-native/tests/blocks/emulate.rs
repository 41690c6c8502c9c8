//! An emulator of the few instructions used by blocks, written from the Intel 64 manual (volume 2), so that
//! blocks can be tested on machines without them. `neon` emulates those of aarch64.
//!
//! An independent decoder reads the code back. This module must not know how code is made.

use crate::memory::{CODE, MAX_STEPS, Memory, POINTERS, SLOTS};
use iced_x86::{Decoder, DecoderOptions, Instruction, Mnemonic, OpKind, Register, RoundingControl};
use osl_native::{Assembled, Target, Words};
use std::collections::HashMap;
use std::ops::Range;

/// 16 words; instructions on 8 set the others to 0.
type Vector = [u32; 16];

struct Machine<'a, 'w> {
    vectors: [Vector; 32],
    masks: [u16; 8],
    /// Words per vector of memory.
    lanes: usize,
    general: [u64; 16],
    /// Flags of the last comparison: equal, and below.
    flags: (bool, bool),
    /// Whether the last difference was negative.
    negative: bool,
    memory: Memory<'a, 'w>,
    /// Perturbs the estimate of inverse roots, which is as inaccurate as permitted.
    noise: u32,
}

/// Runs the code on lanes of arrays as `Code::run` does, after its checks.
pub(crate) fn run(target: Target, code: &Assembled, arrays: Vec<Words<'_>>, lanes: Range<usize>) {
    let mut machine = Machine {
        vectors: [[0xDEAD_BEEF; 16]; 32],
        masks: [0xA5A5; 8],
        lanes: target.lanes(),
        general: [0xBAD_BAD_BAD; 16],
        flags: (false, false),
        negative: false,
        memory: Memory::new(target, code, arrays),
        noise: 1,
    };
    let registers = [(Register::RDI, POINTERS), (Register::RSI, SLOTS)];
    // As much as no test spends.
    machine.general[Register::R12.number()] = 1 << 40;
    let bounds = [(Register::RDX, lanes.start as u64 * 4), (Register::RCX, lanes.end as u64 * 4)];
    for (register, value) in registers.into_iter().chain(bounds) {
        machine.general[register.number()] = value;
    }
    let mut known: HashMap<u64, Instruction> = HashMap::new();
    let mut at = CODE;
    for _ in 0..MAX_STEPS {
        let inst = *known.entry(at).or_insert_with(|| {
            let bytes = &code.bytes[(at - CODE) as usize..];
            Decoder::with_ip(64, bytes, at, DecoderOptions::NONE).decode()
        });
        match machine.step(&inst) {
            Some(next) => at = next,
            None => return,
        }
    }
    panic!("the code does not end");
}

impl Machine<'_, '_> {
    /// Executes an instruction. Returns the address of the next one, or `None` when the call ends.
    fn step(&mut self, inst: &Instruction) -> Option<u64> {
        let next = inst.next_ip();
        match inst.mnemonic() {
            Mnemonic::Ret => return None,
            Mnemonic::Vzeroupper => {}
            Mnemonic::Jmp => return Some(inst.near_branch_target()),
            Mnemonic::Je => return Some(if self.flags.0 { inst.near_branch_target() } else { next }),
            Mnemonic::Jne => return Some(if self.flags.0 { next } else { inst.near_branch_target() }),
            Mnemonic::Jb => return Some(if self.flags.1 { inst.near_branch_target() } else { next }),
            Mnemonic::Js => return Some(if self.negative { inst.near_branch_target() } else { next }),
            Mnemonic::Sub => {
                let to = inst.op0_register().number();
                self.general[to] = self.general[to].wrapping_sub(inst.immediate32to64() as u64);
                self.negative = (self.general[to] as i64) < 0;
            }
            Mnemonic::Mov if inst.op1_kind() != OpKind::Memory => {
                self.general[inst.op0_register().number()] = inst.immediate32to64() as u64;
            }
            Mnemonic::Vmovd => {
                let word = self.vectors[inst.op1_register().number()][0];
                self.general[inst.op0_register().number()] = u64::from(word);
            }
            Mnemonic::Lea => self.general[inst.op0_register().number()] = self.address(inst),
            Mnemonic::Vpgatherdd => self.gather(inst),
            Mnemonic::Add => {
                let to = inst.op0_register().number();
                self.general[to] = self.general[to].wrapping_add(inst.immediate32to64() as u64);
            }
            Mnemonic::Cmp => {
                let [a, b] = [inst.op0_register(), inst.op1_register()].map(|r| self.general[r.number()]);
                self.flags = (a == b, a < b);
            }
            Mnemonic::Mov => {
                let address = self.address(inst);
                assert!(inst.op1_kind() == OpKind::Memory);
                self.general[inst.op0_register().number()] = self.memory.pointer(address);
            }
            Mnemonic::Test => {
                let [a, b] = [inst.op0_register(), inst.op1_register()].map(|r| self.general[r.number()]);
                self.flags = (a & b & 0xFFFF_FFFF == 0, false);
            }
            Mnemonic::Vmovmskps => {
                let from = self.vectors[inst.op1_register().number()];
                let signs = (0..self.lanes).map(|lane| u64::from(from[lane] >> 31) << lane);
                self.general[inst.op0_register().number()] = signs.sum();
            }
            Mnemonic::Kxnorw => self.of_masks(inst),
            Mnemonic::Kandw | Mnemonic::Korw | Mnemonic::Knotw | Mnemonic::Kortestw | Mnemonic::Kmovw => {
                self.of_masks(inst);
            }
            _ => self.of_vectors(inst),
        }
        Some(next)
    }

    fn gather(&mut self, inst: &Instruction) {
        let (to, index) = (inst.op0_register().number(), inst.memory_index().number());
        let base = self.general[inst.memory_base().number()].wrapping_add(inst.memory_displacement64());
        let full = match inst.op_mask() {
            Register::None => {
                let mask = inst.op2_register().number();
                assert!(mask != to && mask != index);
                let words = std::mem::take(&mut self.vectors[mask]);
                words[..self.lanes].iter().all(|word| *word == u32::MAX)
            }
            mask => std::mem::take(&mut self.masks[mask.number()]) == 0xFFFF,
        };
        assert!(full && to != index && inst.memory_index_scale() == 4);
        let mut words = [0; 16];
        for (lane, word) in words.iter_mut().take(self.lanes).enumerate() {
            *word = self.memory.read(base + 4 * u64::from(self.vectors[index][lane]));
        }
        self.vectors[to] = words;
    }

    fn of_masks(&mut self, inst: &Instruction) {
        let mask = |machine: &Self, at: u32| machine.masks[inst.op_register(at).number()];
        match inst.mnemonic() {
            Mnemonic::Kortestw => {
                let either = mask(self, 0) | mask(self, 1);
                self.flags = (either == 0, either == 0xFFFF);
                return;
            }
            Mnemonic::Kmovw if inst.op0_kind() == OpKind::Memory => {
                let word = u32::from(mask(self, 1));
                let address = self.address(inst);
                // Only half a word; slots hold nothing else in the other half.
                self.memory.write(address, word);
                return;
            }
            _ => {}
        }
        let value = match inst.mnemonic() {
            Mnemonic::Kxnorw => !(mask(self, 1) ^ mask(self, 2)),
            Mnemonic::Kandw => mask(self, 1) & mask(self, 2),
            Mnemonic::Korw => mask(self, 1) | mask(self, 2),
            Mnemonic::Knotw => !mask(self, 1),
            _ if inst.op1_kind() == OpKind::Register => mask(self, 1),
            _ => {
                let address = self.address(inst);
                self.memory.read(address) as u16
            }
        };
        self.masks[inst.op0_register().number()] = value;
    }

    fn of_vectors(&mut self, inst: &Instruction) {
        use Mnemonic as M;
        if inst.op0_kind() == OpKind::Memory {
            assert!(matches!(inst.mnemonic(), M::Vmovdqu32 | M::Vmovups), "{inst:?}");
            let address = self.address(inst);
            let from = self.vectors[inst.op1_register().number()];
            (0..self.lanes).for_each(|lane| self.memory.write(address + 4 * lane as u64, from[lane]));
            return;
        }
        // The result is followed by one or two operands and, for some instructions, a byte.
        let has_byte = (0..inst.op_count()).any(|at| inst.op_kind(at) == OpKind::Immediate8);
        let chooses = inst.mnemonic() == M::Vblendvps;
        let last = inst.op_count() - 1 - u32::from(has_byte) - u32::from(chooses);
        let b = self.operand(inst, last);
        let a = if last == 2 { self.operand(inst, 1) } else { [0; 16] };
        let choice = if chooses { self.operand(inst, 3) } else { [0; 16] };
        let byte = if has_byte { inst.immediate8() } else { 0 };
        let mask = match inst.op_mask() {
            Register::None => 0xFFFF,
            register => self.masks[register.number()],
        };
        let to = inst.op0_register();
        if to.is_k() {
            let bits = (0..16).map(|lane| u16::from(truth(inst.mnemonic(), byte, a[lane], b[lane])) << lane);
            self.masks[to.number()] = bits.sum::<u16>() & mask;
            return;
        }
        let old = self.vectors[to.number()];
        let up = inst.rounding_control() == RoundingControl::RoundUp;
        let mut result = [0; 16];
        for lane in 0..self.lanes {
            let (p, q) = (a[lane], b[lane]);
            let value = match inst.mnemonic() {
                M::Vpermd => b[p as usize % self.lanes],
                M::Vblendvps if choice[lane] >> 31 == 0 => p,
                M::Vblendvps => q,
                M::Vcmpps | M::Vpcmpeqd | M::Vpcmpgtd if truth(inst.mnemonic(), byte, p, q) => u32::MAX,
                M::Vcmpps | M::Vpcmpeqd | M::Vpcmpgtd => 0,
                M::Vrsqrt14ps => self.estimate(q),
                M::Vfmadd213ps => fused(p, old[lane], q, up),
                M::Vfmadd231ps => fused(p, q, old[lane], up),
                M::Vfnmadd231ps => fused(p ^ 0x8000_0000, q, old[lane], up),
                M::Vmovshdup => b[lane | 1],
                M::Vpshufd => b[quarter(lane, byte)],
                M::Vshufps => (if lane & 2 == 0 { a } else { b })[quarter(lane, byte)],
                M::Vpmuldq => {
                    let [x, y] = [a, b].map(|words| i64::from(words[lane & !1] as i32));
                    ((x * y) >> (32 * (lane & 1))) as u32
                }
                M::Vpblendmd if mask >> lane & 1 == 0 => p,
                M::Vpblendmd => q,
                other => number(other, byte, p, q),
            };
            let kept = mask >> lane & 1 == 1 || inst.mnemonic() == M::Vpblendmd;
            result[lane] = match (kept, inst.zeroing_masking()) {
                (true, _) => value,
                (false, true) => 0,
                (false, false) => old[lane],
            };
        }
        self.vectors[to.number()] = result;
    }

    /// An operand: a register, 16 words of memory, or one word for all lanes.
    fn operand(&mut self, inst: &Instruction, at: u32) -> Vector {
        if inst.op_kind(at) == OpKind::Register {
            return self.vectors[inst.op_register(at).number()];
        }
        let address = self.address(inst);
        let single = inst.is_broadcast() || inst.mnemonic() == Mnemonic::Vbroadcastss;
        let mut words = [0; 16];
        for (lane, word) in words.iter_mut().take(self.lanes).enumerate() {
            *word = self.memory.read(if single { address } else { address + 4 * lane as u64 });
        }
        words
    }

    fn address(&self, inst: &Instruction) -> u64 {
        if inst.is_ip_rel_memory_operand() {
            return inst.ip_rel_memory_address();
        }
        let index = match inst.memory_index() {
            Register::None => 0,
            register => self.general[register.number()] * u64::from(inst.memory_index_scale()),
        };
        let base = self.general[inst.memory_base().number()];
        base.wrapping_add(index).wrapping_add(inst.memory_displacement64())
    }

    /// The inverse root of a positive float, with a relative error of up to `2^-14`.
    fn estimate(&mut self, x: u32) -> u32 {
        self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let off = f64::from(self.noise >> 8) / f64::from(1 << 23) - 1.0;
        let x = f64::from(f32::from_bits(x));
        (((1.0 + off / f64::from(1 << 14)) / x.sqrt()) as f32).to_bits()
    }
}

/// The lane of the same four that two bits of a byte select for a lane.
fn quarter(lane: usize, byte: u8) -> usize {
    lane & !3 | usize::from(byte >> (2 * (lane & 3)) & 3)
}

/// One lane of an instruction that returns words.
fn number(mnemonic: Mnemonic, byte: u8, p: u32, q: u32) -> u32 {
    use Mnemonic as M;
    let (x, y) = (f32::from_bits(p), f32::from_bits(q));
    let (i, j) = (p as i32, q as i32);
    match mnemonic {
        M::Vaddps => (x + y).to_bits(),
        M::Vsubps => (x - y).to_bits(),
        M::Vmulps => (x * y).to_bits(),
        M::Vdivps => (x / y).to_bits(),
        M::Vminps => {
            if x < y {
                p
            } else {
                q
            }
        }
        M::Vmaxps => {
            if x > y {
                p
            } else {
                q
            }
        }
        M::Vsqrtps => y.sqrt().to_bits(),
        M::Vcvtdq2ps => (j as f32).to_bits(),
        M::Vcvttps2dq => {
            let whole = y.trunc();
            let fits = (-2_147_483_648.0..2_147_483_648.0).contains(&whole);
            if fits { whole as i32 as u32 } else { 0x8000_0000 }
        }
        // Rounding to whole numbers without a scale.
        M::Vrndscaleps | M::Vroundps => match byte {
            9 => y.floor().to_bits(),
            10 => y.ceil().to_bits(),
            11 => y.trunc().to_bits(),
            _ => panic!("rounding {byte:x}"),
        },
        M::Vpaddd => i.wrapping_add(j) as u32,
        M::Vpsubd => i.wrapping_sub(j) as u32,
        M::Vpmulld => i.wrapping_mul(j) as u32,
        M::Vpminsd => i.min(j) as u32,
        M::Vpmaxsd => i.max(j) as u32,
        M::Vpminud => p.min(q),
        M::Vpabsd => j.unsigned_abs(),
        M::Vpandd | M::Vpand => p & q,
        M::Vpandn => !p & q,
        M::Vpord | M::Vpor => p | q,
        M::Vpxord | M::Vpxor => p ^ q,
        M::Vpsllvd => {
            if q < 32 {
                p << q
            } else {
                0
            }
        }
        M::Vpsravd => (i >> q.min(31)) as u32,
        // Of a register by a distance below 32.
        M::Vpslld => q << byte,
        M::Vpsrld => q >> byte,
        M::Vpsrad => (j >> byte) as u32,
        M::Vmovdqu32 | M::Vmovups | M::Vbroadcastss => q,
        other => panic!("{other:?} is no instruction of blocks"),
    }
}

/// One lane of an instruction that returns a mask.
fn truth(mnemonic: Mnemonic, byte: u8, p: u32, q: u32) -> bool {
    let (x, y) = (f32::from_bits(p), f32::from_bits(q));
    let (i, j) = (p as i32, q as i32);
    let unordered = x.is_nan() || y.is_nan();
    match (mnemonic, byte) {
        (Mnemonic::Vptestmd, _) => p & q != 0,
        (Mnemonic::Vcmpps, 0x00) => x == y,
        (Mnemonic::Vcmpps, 0x01) => x < y,
        (Mnemonic::Vcmpps, 0x02) => x <= y,
        (Mnemonic::Vcmpps, 0x04) => unordered || x != y,
        (Mnemonic::Vcmpps, 0x05) => unordered || x >= y,
        (Mnemonic::Vcmpps, 0x06) => unordered || x > y,
        (Mnemonic::Vcmpps, 0x08) => unordered || x == y,
        (Mnemonic::Vcmpps, 0x09) => unordered || x < y,
        (Mnemonic::Vcmpps, 0x0A) => unordered || x <= y,
        (Mnemonic::Vcmpps, 0x0D) => x >= y,
        (Mnemonic::Vcmpps, 0x0E) => x > y,
        (Mnemonic::Vpcmpd, 0) | (Mnemonic::Vpcmpeqd, _) => i == j,
        (Mnemonic::Vpcmpgtd, _) => i > j,
        (Mnemonic::Vpcmpd, 1) => i < j,
        (Mnemonic::Vpcmpd, 2) => i <= j,
        (Mnemonic::Vpcmpd, 4) => i != j,
        (Mnemonic::Vpcmpd, 5) => i >= j,
        (Mnemonic::Vfpclassps, classes) => {
            let quiet = y.is_nan() && q & 0x40_0000 != 0;
            let is = [
                quiet,
                q == 0,
                q == 0x8000_0000,
                q == 0x7F80_0000,
                q == 0xFF80_0000,
                y.is_subnormal(),
                y.is_finite() && y.is_sign_negative() && y != 0.0,
                y.is_nan() && !quiet,
            ];
            is.iter().enumerate().any(|(at, is)| *is && classes >> at & 1 == 1)
        }
        other => panic!("{other:?} is no comparison of blocks"),
    }
}

/// `a b + c` rounded once: to the nearest, or up.
fn fused(a: u32, b: u32, c: u32, up: bool) -> u32 {
    let [x, y, z] = [a, b, c].map(f32::from_bits);
    let nearest = x.mul_add(y, z);
    if !up || !nearest.is_finite() {
        return nearest.to_bits();
    }
    // The product is exact in double precision, and so is the sum together with its remainder (Knuth, volume
    // 2, 4.2.2).
    let (p, z) = (f64::from(x) * f64::from(y), f64::from(z));
    let sum = p + z;
    let part = sum - p;
    let rest = (p - (sum - part)) + (z - part);
    // How far the exact value is above a nearby float.
    let above = |float: f32| (sum - f64::from(float)) + rest;
    let mut result = nearest;
    while above(result) > 0.0 {
        result = result.next_up();
    }
    while above(result.next_down()) <= 0.0 {
        result = result.next_down();
    }
    result.to_bits()
}
