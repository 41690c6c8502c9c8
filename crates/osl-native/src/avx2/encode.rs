//! Encodes the AVX2 instructions that the code consists of.
//!
//! Encodings follow the Intel 64 manual, volume 2 (2.3 for VEX).

use crate::x86::{Assembler, Mem, Opcode};

/// One of 16 vector registers of 8 lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Ymm(pub(super) u8);

/// The last operand of a vector instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rm {
    Ymm(Ymm),
    Memory(Mem),
}

/// Instruction names, for vectors of 8 words.
pub(super) mod name {
    use crate::x86::{NONE, Opcode, P66, opcode};

    pub(in super::super) const VADDPS: Opcode = opcode(1, NONE, 0x58);
    pub(in super::super) const VMULPS: Opcode = opcode(1, NONE, 0x59);
    pub(in super::super) const VSUBPS: Opcode = opcode(1, NONE, 0x5C);
    pub(in super::super) const VMINPS: Opcode = opcode(1, NONE, 0x5D);
    pub(in super::super) const VMAXPS: Opcode = opcode(1, NONE, 0x5F);
    pub(in super::super) const VDIVPS: Opcode = opcode(1, NONE, 0x5E);
    pub(in super::super) const VSQRTPS: Opcode = opcode(1, NONE, 0x51);
    pub(in super::super) const VCVTDQ2PS: Opcode = opcode(1, NONE, 0x5B);
    pub(in super::super) const VCVTTPS2DQ: Opcode = opcode(1, crate::x86::PF3, 0x5B);
    pub(in super::super) const VCMPPS: Opcode = opcode(1, NONE, 0xC2);
    pub(in super::super) const VMOVUPS: Opcode = opcode(1, NONE, 0x10);
    pub(in super::super) const VMOVUPS_STORE: Opcode = opcode(1, NONE, 0x11);
    /// Every odd word, twice.
    pub(in super::super) const VMOVSHDUP: Opcode = opcode(1, crate::x86::PF3, 0x16);
    pub(in super::super) const VSHUFPS: Opcode = opcode(1, NONE, 0xC6);
    pub(in super::super) const VPSHUFD: Opcode = opcode(1, P66, 0x70);
    /// The products, of 64 bits, of every even word.
    pub(in super::super) const VPMULDQ: Opcode = opcode(2, P66, 0x28);
    pub(in super::super) const VMOVMSKPS: Opcode = opcode(1, NONE, 0x50);
    pub(in super::super) const VPADDD: Opcode = opcode(1, P66, 0xFE);
    pub(in super::super) const VPSUBD: Opcode = opcode(1, P66, 0xFA);
    pub(in super::super) const VPAND: Opcode = opcode(1, P66, 0xDB);
    pub(in super::super) const VPANDN: Opcode = opcode(1, P66, 0xDF);
    pub(in super::super) const VPOR: Opcode = opcode(1, P66, 0xEB);
    pub(in super::super) const VPXOR: Opcode = opcode(1, P66, 0xEF);
    pub(in super::super) const VPCMPEQD: Opcode = opcode(1, P66, 0x76);
    pub(in super::super) const VPCMPGTD: Opcode = opcode(1, P66, 0x66);
    pub(in super::super) const VPMULLD: Opcode = opcode(2, P66, 0x40);
    pub(in super::super) const VPMINSD: Opcode = opcode(2, P66, 0x39);
    pub(in super::super) const VPMAXSD: Opcode = opcode(2, P66, 0x3D);
    pub(in super::super) const VPMINUD: Opcode = opcode(2, P66, 0x3B);
    pub(in super::super) const VPGATHERDD: Opcode = opcode(2, P66, 0x90);
    pub(in super::super) const VPABSD: Opcode = opcode(2, P66, 0x1E);
    pub(in super::super) const VPSLLVD: Opcode = opcode(2, P66, 0x47);
    pub(in super::super) const VPSRAVD: Opcode = opcode(2, P66, 0x46);
    pub(in super::super) const VPERMD: Opcode = opcode(2, P66, 0x36);
    pub(in super::super) const VBROADCASTSS: Opcode = opcode(2, P66, 0x18);
    /// The first operand times the last, plus the result.
    pub(in super::super) const VFMADD231PS: Opcode = opcode(2, P66, 0xB8);
    /// The result minus the first operand times the last.
    pub(in super::super) const VFNMADD231PS: Opcode = opcode(2, P66, 0xBC);
    pub(in super::super) const VROUNDPS: Opcode = opcode(3, P66, 0x08);
    pub(in super::super) const VBLENDVPS: Opcode = opcode(3, P66, 0x4A);
}

/// A shift of all lanes by the same distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shift {
    Left,
    /// Fills with zeros.
    Right,
    /// Fills with the sign.
    Arithmetic,
}

impl Assembler {
    /// A vector instruction with result `reg`, first operand `first` and last operand `rm`.
    pub(super) fn vex(&mut self, op: Opcode, reg: Ymm, first: Option<Ymm>, rm: Rm, imm: Option<u8>) {
        self.count += 1;
        let (x, b) = match rm {
            Rm::Ymm(Ymm(r)) => (0, r >> 3),
            Rm::Memory(mem) => (mem.x(), mem.b()),
        };
        let r = (reg.0 >> 3 ^ 1) << 7;
        let last = (!first.map_or(0, |first| first.0) & 15) << 3 | 4 | op.prefix;
        if op.map == 1 && x == 0 && b == 0 {
            self.bytes.extend([0xC5, r | last, op.byte]);
        } else {
            self.bytes.extend([0xC4, r | (x ^ 1) << 6 | (b ^ 1) << 5 | op.map, last, op.byte]);
        }
        match rm {
            Rm::Ymm(Ymm(r)) => self.bytes.push(0xC0 | (reg.0 & 7) << 3 | r & 7),
            Rm::Memory(mem) => self.memory(reg.0 & 7, mem, i32::from(imm.is_some())),
        }
        self.bytes.extend(imm);
    }

    /// Gathers the words at a base plus four times each index into the lanes of `to`. The three registers
    /// differ. The mask, which must be full, is empty then.
    pub(super) fn gather(&mut self, to: Ymm, index: Ymm, mask: Ymm, mem: Mem) {
        self.count += 1;
        let Mem::At(base, disp) = mem else { return };
        let op = name::VPGATHERDD;
        let (r, x, b) = (to.0 >> 3 ^ 1, index.0 >> 3 ^ 1, mem.b() ^ 1);
        let last = (!mask.0 & 15) << 3 | 4 | op.prefix;
        self.bytes.extend([0xC4, r << 7 | x << 6 | b << 5 | op.map, last, op.byte]);
        self.bytes.extend([0x84 | (to.0 & 7) << 3, 0x80 | (index.0 & 7) << 3 | base.0 & 7]);
        self.bytes.extend(disp.to_le_bytes());
    }

    /// `yes` in the lanes whose mask has its highest bit set, else `no`.
    pub(super) fn choose(&mut self, to: Ymm, mask: Ymm, yes: Rm, no: Ymm) {
        self.vex(name::VBLENDVPS, to, Some(no), yes, Some(mask.0 << 4));
    }

    /// Shifts by a distance below 32.
    pub(super) fn shift(&mut self, how: Shift, to: Ymm, from: Ymm, distance: u8) {
        let number = match how {
            Shift::Right => 2,
            Shift::Arithmetic => 4,
            Shift::Left => 6,
        };
        let op = crate::x86::opcode(1, crate::x86::P66, 0x72);
        self.vex(op, Ymm(number), Some(to), Rm::Ymm(from), Some(distance));
    }

    /// Tests whether the highest bit of any lane is set, for the next jump; overwrites a general register.
    pub(super) fn test(&mut self, mask: Ymm) {
        // Into rax, which at most holds a pointer that is loaded again for each use.
        self.vex(name::VMOVMSKPS, Ymm(0), None, Rm::Ymm(mask), None);
        // test eax, eax
        self.count += 1;
        self.bytes.extend([0x85, 0xC0]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::x86::Gpr;
    use crate::x86::tests::{NAMES, one, read};

    #[test]
    fn every_register_is_encoded() {
        for r in 0..16 {
            let (a, b) = ((r + 7) % 16, (r + 11) % 16);
            let text = one(|code| code.vex(name::VADDPS, Ymm(r), Some(Ymm(a)), Rm::Ymm(Ymm(b)), None));
            assert_eq!(text, format!("vaddps ymm{r}, ymm{a}, ymm{b}"));
            let text = one(|code| code.vex(name::VPMULLD, Ymm(r), Some(Ymm(a)), Rm::Ymm(Ymm(b)), None));
            assert_eq!(text, format!("vpmulld ymm{r}, ymm{a}, ymm{b}"));
            let text = one(|code| code.choose(Ymm(r), Ymm(a), Rm::Ymm(Ymm(b)), Ymm(3)));
            assert_eq!(text, format!("vblendvps ymm{r}, ymm3, ymm{b}, ymm{a}"));
            for (how, name) in
                [(Shift::Left, "vpslld"), (Shift::Right, "vpsrld"), (Shift::Arithmetic, "vpsrad")]
            {
                let text = one(|code| code.shift(how, Ymm(r), Ymm(b), 31));
                assert_eq!(text, format!("{name} ymm{r}, ymm{b}, 1Fh"));
            }
            let mut code = Assembler::default();
            code.test(Ymm(r));
            assert_eq!(read(&code.bytes), [format!("vmovmskps eax, ymm{r}"), "test eax, eax".to_owned()]);
        }
    }

    #[test]
    fn memory_is_encoded() {
        for (number, base) in NAMES.iter().enumerate() {
            let base_register = Gpr(number as u8);
            for r in [1, 9] {
                let text = one(|code| {
                    let mem = Rm::Memory(Mem::At(base_register, 0x1234));
                    code.vex(name::VSUBPS, Ymm(r), Some(Ymm(12)), mem, None);
                });
                assert_eq!(text, format!("vsubps ymm{r}, ymm12, [{base}+1234h]"));
                let text = one(|code| {
                    let mem = Rm::Memory(Mem::Indexed(base_register, Gpr(2), -64));
                    code.vex(name::VMOVUPS, Ymm(r), None, mem, None);
                });
                assert_eq!(text, format!("vmovups ymm{r}, [{base}+rdx-40h]"));
                let text = one(|code| {
                    let mem = Rm::Memory(Mem::At(base_register, 4));
                    code.vex(name::VBROADCASTSS, Ymm(r), None, mem, None);
                });
                assert_eq!(text, format!("vbroadcastss ymm{r}, [{base}+4]"));
            }
        }
        let text = one(|code| {
            let to = Rm::Memory(Mem::At(Gpr(6), 128));
            code.vex(name::VMOVUPS_STORE, Ymm(15), None, to, None);
        });
        assert_eq!(text, "vmovups [rsi+80h], ymm15");
    }

    #[test]
    fn instructions_are_what_they_are_called() {
        let plain = |op, imm| one(move |code| code.vex(op, Ymm(1), None, Rm::Ymm(Ymm(3)), imm));
        let both = |op, imm| one(move |code| code.vex(op, Ymm(1), Some(Ymm(2)), Rm::Ymm(Ymm(3)), imm));
        assert_eq!(plain(name::VSQRTPS, None), "vsqrtps ymm1, ymm3");
        assert_eq!(plain(name::VROUNDPS, Some(9)), "vroundps ymm1, ymm3, 9");
        assert_eq!(plain(name::VCVTDQ2PS, None), "vcvtdq2ps ymm1, ymm3");
        assert_eq!(plain(name::VCVTTPS2DQ, None), "vcvttps2dq ymm1, ymm3");
        assert_eq!(plain(name::VPABSD, None), "vpabsd ymm1, ymm3");
        assert_eq!(plain(name::VMOVUPS, None), "vmovups ymm1, ymm3");
        assert_eq!(plain(name::VMOVSHDUP, None), "vmovshdup ymm1, ymm3");
        assert_eq!(plain(name::VPSHUFD, Some(0xD8)), "vpshufd ymm1, ymm3, 0D8h");
        assert_eq!(both(name::VSHUFPS, Some(0xDD)), "vshufps ymm1, ymm2, ymm3, 0DDh");
        for (to, index, base) in [(1, 3, "rsi"), (9, 13, "r10"), (15, 4, "rax")] {
            let number = NAMES.iter().position(|name| *name == base).map_or(0, |at| at as u8);
            let text = one(|code| code.gather(Ymm(to), Ymm(index), Ymm(7), Mem::At(Gpr(number), 128)));
            assert_eq!(text, format!("vpgatherdd ymm{to}, [{base}+ymm{index}*4+80h], ymm7"));
        }
        for (op, text) in [
            (name::VADDPS, "vaddps"),
            (name::VSUBPS, "vsubps"),
            (name::VMULPS, "vmulps"),
            (name::VDIVPS, "vdivps"),
            (name::VMINPS, "vminps"),
            (name::VMAXPS, "vmaxps"),
            (name::VPADDD, "vpaddd"),
            (name::VPSUBD, "vpsubd"),
            (name::VPMULLD, "vpmulld"),
            (name::VPMULDQ, "vpmuldq"),
            (name::VPMINSD, "vpminsd"),
            (name::VPMAXSD, "vpmaxsd"),
            (name::VPMINUD, "vpminud"),
            (name::VPAND, "vpand"),
            (name::VPANDN, "vpandn"),
            (name::VPOR, "vpor"),
            (name::VPXOR, "vpxor"),
            (name::VPCMPEQD, "vpcmpeqd"),
            (name::VPCMPGTD, "vpcmpgtd"),
            (name::VPSLLVD, "vpsllvd"),
            (name::VPSRAVD, "vpsravd"),
            (name::VPERMD, "vpermd"),
            (name::VFMADD231PS, "vfmadd231ps"),
            (name::VFNMADD231PS, "vfnmadd231ps"),
        ] {
            assert_eq!(both(op, None), format!("{text} ymm1, ymm2, ymm3"));
        }
        assert_eq!(both(name::VCMPPS, Some(9)), "vcmpngeps ymm1, ymm2, ymm3");
    }

    #[test]
    fn constants_behind_the_code_fill_vectors() {
        let mut code = Assembler::default();
        let (one, two) = (code.constant(0x1111_1111), code.constant(0x2222_2222));
        code.vex(name::VADDPS, Ymm(1), Some(Ymm(2)), Rm::Memory(Mem::Pool(two)), None);
        code.vex(name::VCMPPS, Ymm(1), Some(Ymm(2)), Rm::Memory(Mem::Pool(one)), Some(2));
        let end = code.here();
        let bytes = code.finish(8);
        let pool = end.next_multiple_of(32);
        assert_eq!(bytes[pool..], [[0x11; 32], [0x22; 32]].concat());
        let expected =
            [format!("vaddps ymm1, ymm2, [{:X}h]", pool + 32), format!("vcmpleps ymm1, ymm2, [{pool:X}h]")];
        assert_eq!(read(&bytes[..end]), expected);
    }
}
