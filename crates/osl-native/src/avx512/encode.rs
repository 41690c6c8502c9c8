//! Encodes the AVX-512 instructions that the code consists of.
//!
//! Encodings follow the Intel 64 manual, volume 2 (2.7 for EVEX, 2.3 for VEX).

use crate::x86::{Assembler, Mem, Opcode};

/// One of 32 vector registers of 16 lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Zmm(pub(super) u8);

/// One of 8 mask registers; 0 means "no mask" where a mask is optional.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct K(pub(super) u8);

/// The last operand of a vector instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rm {
    Zmm(Zmm),
    /// A register, with the result rounded up.
    Up(Zmm),
    /// 16 words in memory.
    Lanes(Mem),
    /// A word in memory, broadcast to all lanes.
    Word(Mem),
}

/// Instruction names, for vectors of 16 words.
pub(super) mod name {
    use crate::x86::{NONE, Opcode, P66, PF3, opcode};

    /// Marks an instruction on words of 64 bits.
    const WIDE: u8 = 0x80;

    pub(in super::super) const VADDPS: Opcode = opcode(1, NONE, 0x58);
    pub(in super::super) const VMULPS: Opcode = opcode(1, NONE, 0x59);
    pub(in super::super) const VSUBPS: Opcode = opcode(1, NONE, 0x5C);
    pub(in super::super) const VMINPS: Opcode = opcode(1, NONE, 0x5D);
    pub(in super::super) const VDIVPS: Opcode = opcode(1, NONE, 0x5E);
    pub(in super::super) const VSQRTPS: Opcode = opcode(1, NONE, 0x51);
    pub(in super::super) const VCVTDQ2PS: Opcode = opcode(1, NONE, 0x5B);
    pub(in super::super) const VCMPPS: Opcode = opcode(1, NONE, 0xC2);
    /// Every odd word, twice.
    pub(in super::super) const VMOVSHDUP: Opcode = opcode(1, PF3, 0x16);
    pub(in super::super) const VSHUFPS: Opcode = opcode(1, NONE, 0xC6);
    pub(in super::super) const VPSHUFD: Opcode = opcode(1, P66, 0x70);
    /// The products, of 64 bits, of every even word.
    pub(in super::super) const VPMULDQ: Opcode = opcode(2, P66 | WIDE, 0x28);
    pub(in super::super) const VPADDD: Opcode = opcode(1, P66, 0xFE);
    pub(in super::super) const VPSUBD: Opcode = opcode(1, P66, 0xFA);
    pub(in super::super) const VPANDD: Opcode = opcode(1, P66, 0xDB);
    pub(in super::super) const VPORD: Opcode = opcode(1, P66, 0xEB);
    pub(in super::super) const VPXORD: Opcode = opcode(1, P66, 0xEF);
    pub(in super::super) const VMOVDQU32: Opcode = opcode(1, PF3, 0x6F);
    pub(in super::super) const VMOVDQU32_STORE: Opcode = opcode(1, PF3, 0x7F);
    pub(in super::super) const VCVTTPS2DQ: Opcode = opcode(1, PF3, 0x5B);
    pub(in super::super) const VPMULLD: Opcode = opcode(2, P66, 0x40);
    pub(in super::super) const VPMINSD: Opcode = opcode(2, P66, 0x39);
    pub(in super::super) const VPMAXSD: Opcode = opcode(2, P66, 0x3D);
    pub(in super::super) const VPMINUD: Opcode = opcode(2, P66, 0x3B);
    pub(in super::super) const VPGATHERDD: Opcode = opcode(2, P66, 0x90);
    pub(in super::super) const VPABSD: Opcode = opcode(2, P66, 0x1E);
    pub(in super::super) const VPSLLVD: Opcode = opcode(2, P66, 0x47);
    pub(in super::super) const VPSRAVD: Opcode = opcode(2, P66, 0x46);
    pub(in super::super) const VPERMD: Opcode = opcode(2, P66, 0x36);
    pub(in super::super) const VPTESTMD: Opcode = opcode(2, P66, 0x27);
    pub(in super::super) const VPBLENDMD: Opcode = opcode(2, P66, 0x64);
    /// The operand is one word, although the encoding does not mark it as a broadcast.
    pub(in super::super) const VBROADCASTSS: Opcode = opcode(2, P66, 0x18);
    pub(in super::super) const VRNDSCALEPS: Opcode = opcode(3, P66, 0x08);
    pub(in super::super) const VPCMPD: Opcode = opcode(3, P66, 0x1F);
    pub(in super::super) const VFPCLASSPS: Opcode = opcode(3, P66, 0x66);
    pub(in super::super) const VRSQRT14PS: Opcode = opcode(2, P66, 0x4E);
    /// The result times the first operand, plus the last.
    pub(in super::super) const VFMADD213PS: Opcode = opcode(2, P66, 0xA8);
    /// The first operand times the last, plus the result.
    pub(in super::super) const VFMADD231PS: Opcode = opcode(2, P66, 0xB8);
    /// The result minus the first operand times the last.
    pub(in super::super) const VFNMADD231PS: Opcode = opcode(2, P66, 0xBC);
    // Mask instructions, VEX-encoded.
    pub(in super::super) const KXNORW: Opcode = opcode(1, NONE, 0x46);
    pub(in super::super) const KORTESTW: Opcode = opcode(1, NONE, 0x98);
    pub(in super::super) const KANDW: Opcode = opcode(1, NONE, 0x41);
    pub(in super::super) const KORW: Opcode = opcode(1, NONE, 0x45);
    pub(in super::super) const KNOTW: Opcode = opcode(1, NONE, 0x44);
    pub(in super::super) const KMOVW_LOAD: Opcode = opcode(1, NONE, 0x90);
    pub(in super::super) const KMOVW_STORE: Opcode = opcode(1, NONE, 0x91);
}

impl Assembler {
    /// A vector instruction with result (or mask number) `reg`, first operand `first` and last operand `rm`;
    /// optionally with a mask, which sets the other lanes to 0 if `zero`.
    #[expect(clippy::too_many_arguments, reason = "the fields of the encoding")]
    pub(super) fn evex(
        &mut self,
        op: Opcode,
        reg: u8,
        first: Option<Zmm>,
        rm: Rm,
        mask: K,
        zero: bool,
        imm: Option<u8>,
    ) {
        self.count += 1;
        let bit = |value: u8, at: u8| (value >> at) & 1;
        let (x, b, single) = match rm {
            Rm::Zmm(Zmm(r)) => (bit(r, 4), bit(r, 3), 0),
            // With this bit set, the bits for the vector length select the rounding mode.
            Rm::Up(Zmm(r)) => (bit(r, 4), bit(r, 3), 1),
            Rm::Lanes(mem) => (mem.x(), mem.b(), 0),
            Rm::Word(mem) => (mem.x(), mem.b(), 1),
        };
        let first = first.map_or(0, |z| z.0);
        let p0 = (bit(reg, 3) ^ 1) << 7 | (x ^ 1) << 6 | (b ^ 1) << 5 | (bit(reg, 4) ^ 1) << 4 | op.map;
        let p1 = (!first & 15) << 3 | 4 | op.prefix;
        let p2 = u8::from(zero) << 7 | 0b10 << 5 | single << 4 | (bit(first, 4) ^ 1) << 3 | mask.0;
        self.bytes.extend([0x62, p0, p1, p2, op.byte]);
        match rm {
            Rm::Zmm(Zmm(r)) | Rm::Up(Zmm(r)) => self.bytes.push(0xC0 | (reg & 7) << 3 | r & 7),
            Rm::Lanes(mem) | Rm::Word(mem) => self.memory(reg & 7, mem, i32::from(imm.is_some())),
        }
        self.bytes.extend(imm);
    }

    /// Gathers the words at a base plus four times each index into the lanes of `to`, which is not `index`.
    /// The mask, which must be full, is empty then.
    pub(super) fn evex_gather(&mut self, to: Zmm, index: Zmm, mask: K, mem: Mem) {
        self.count += 1;
        let Mem::At(base, disp) = mem else { return };
        let bit = |value: u8, at: u8| (value >> at) & 1;
        let op = name::VPGATHERDD;
        let (x, b) = (bit(index.0, 3), bit(base.0, 3));
        let p0 = (bit(to.0, 3) ^ 1) << 7 | (x ^ 1) << 6 | (b ^ 1) << 5 | (bit(to.0, 4) ^ 1) << 4 | op.map;
        let p2 = 0b10 << 5 | (bit(index.0, 4) ^ 1) << 3 | mask.0;
        self.bytes.extend([0x62, p0, 0x7C | op.prefix, p2, op.byte]);
        self.bytes.extend([0x84 | (to.0 & 7) << 3, 0x80 | (index.0 & 7) << 3 | base.0 & 7]);
        self.bytes.extend(disp.to_le_bytes());
    }

    /// An instruction on masks, with result `reg` and operands `first` and `last`.
    pub(super) fn mask(&mut self, op: Opcode, reg: K, first: Option<K>, last: K) {
        self.count += 1;
        let wide = u8::from(first.is_some());
        let first = first.map_or(0, |k| k.0);
        self.bytes.extend([0xC5, 0x80 | (!first & 15) << 3 | wide << 2 | op.prefix, op.byte]);
        self.bytes.push(0xC0 | reg.0 << 3 | last.0);
    }

    /// Moves a mask from or to memory.
    pub(super) fn mask_memory(&mut self, op: Opcode, reg: K, mem: Mem) {
        self.count += 1;
        self.bytes.extend([0xC4, 0x80 | (mem.x() ^ 1) << 6 | (mem.b() ^ 1) << 5 | op.map]);
        self.bytes.extend([0x78 | op.prefix, op.byte]);
        self.memory(reg.0, mem, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::x86::Gpr;
    use crate::x86::tests::{NAMES, one, read};

    #[test]
    fn every_register_is_encoded() {
        for r in 0..32 {
            let (a, b) = ((r + 7) % 32, (r + 17) % 32);
            let text = one(|code| {
                code.evex(name::VADDPS, r, Some(Zmm(a)), Rm::Zmm(Zmm(b)), K(0), false, None);
            });
            assert_eq!(text, format!("vaddps zmm{r}, zmm{a}, zmm{b}"));
        }
        for k in 1..8 {
            let (a, b) = (k % 7 + 1, (k + 3) % 8);
            let text = one(|code| code.mask(name::KANDW, K(k), Some(K(a)), K(b)));
            assert_eq!(text, format!("kandw k{k}, k{a}, k{b}"));
            let text = one(|code| code.mask(name::KORW, K(k), Some(K(a)), K(b)));
            assert_eq!(text, format!("korw k{k}, k{a}, k{b}"));
            assert_eq!(one(|code| code.mask(name::KNOTW, K(k), None, K(b))), format!("knotw k{k}, k{b}"));
            let text = one(|code| {
                code.evex(name::VPBLENDMD, 1, Some(Zmm(2)), Rm::Zmm(Zmm(3)), K(k), false, None);
            });
            assert_eq!(text, format!("vpblendmd zmm1{{k{k}}}, zmm2, zmm3"));
        }
    }

    #[test]
    fn memory_is_encoded() {
        for (number, base) in NAMES.iter().enumerate() {
            let base_register = Gpr(number as u8);
            let text = one(|code| {
                let mem = Mem::At(base_register, 0x1234);
                code.evex(name::VSUBPS, 9, Some(Zmm(20)), Rm::Word(mem), K(0), false, None);
            });
            assert_eq!(text, format!("vsubps zmm9, zmm20, [{base}+1234h]{{1to16}}"));
            let text = one(|code| {
                let mem = Mem::Indexed(base_register, Gpr(2), -64);
                code.evex(name::VMOVDQU32, 30, None, Rm::Lanes(mem), K(0), false, None);
            });
            assert_eq!(text, format!("vmovdqu32 zmm30, [{base}+rdx-40h]"));
            let text = one(|code| code.mask_memory(name::KMOVW_STORE, K(5), Mem::At(base_register, 64)));
            assert_eq!(text, format!("kmovw [{base}+40h], k5"));
            let text = one(|code| code.mask_memory(name::KMOVW_LOAD, K(3), Mem::At(base_register, 64)));
            assert_eq!(text, format!("kmovw k3, [{base}+40h]"));
        }
    }

    #[test]
    fn instructions_are_what_they_are_called() {
        let plain = |op, imm| one(move |code| code.evex(op, 1, None, Rm::Zmm(Zmm(3)), K(0), false, imm));
        let both =
            |op, imm| one(move |code| code.evex(op, 1, Some(Zmm(2)), Rm::Zmm(Zmm(3)), K(0), false, imm));
        assert_eq!(plain(name::VSQRTPS, None), "vsqrtps zmm1, zmm3");
        assert_eq!(plain(name::VRNDSCALEPS, Some(9)), "vrndscaleps zmm1, zmm3, 9");
        assert_eq!(plain(name::VCVTDQ2PS, None), "vcvtdq2ps zmm1, zmm3");
        assert_eq!(plain(name::VCVTTPS2DQ, None), "vcvttps2dq zmm1, zmm3");
        assert_eq!(plain(name::VPABSD, None), "vpabsd zmm1, zmm3");
        assert_eq!(plain(name::VRSQRT14PS, None), "vrsqrt14ps zmm1, zmm3");
        assert_eq!(plain(name::VMOVSHDUP, None), "vmovshdup zmm1, zmm3");
        assert_eq!(plain(name::VPSHUFD, Some(0xD8)), "vpshufd zmm1, zmm3, 0D8h");
        assert_eq!(both(name::VSHUFPS, Some(0xDD)), "vshufps zmm1, zmm2, zmm3, 0DDh");
        assert_eq!(one(|code| code.mask(name::KORTESTW, K(1), None, K(2))), "kortestw k1, k2");
        assert_eq!(one(|code| code.mask(name::KMOVW_LOAD, K(1), None, K(2))), "kmovw k1, k2");
        assert_eq!(one(|code| code.mask(name::KXNORW, K(3), Some(K(1)), K(2))), "kxnorw k3, k1, k2");
        for (to, index, base) in [(1, 3, "rsi"), (9, 30, "r10"), (31, 12, "rax")] {
            let number = NAMES.iter().position(|name| *name == base).map_or(0, |at| at as u8);
            let text = one(|code| code.evex_gather(Zmm(to), Zmm(index), K(2), Mem::At(Gpr(number), 128)));
            assert_eq!(text, format!("vpgatherdd zmm{to}, k2, [{base}+zmm{index}*4+80h]"));
        }
        assert_eq!(plain(name::VFPCLASSPS, Some(0x99)), "vfpclassps k1, zmm3, 99h");
        for (op, text) in [
            (name::VADDPS, "vaddps"),
            (name::VSUBPS, "vsubps"),
            (name::VMULPS, "vmulps"),
            (name::VDIVPS, "vdivps"),
            (name::VMINPS, "vminps"),
            (name::VPADDD, "vpaddd"),
            (name::VPSUBD, "vpsubd"),
            (name::VPMULLD, "vpmulld"),
            (name::VPMULDQ, "vpmuldq"),
            (name::VPMINSD, "vpminsd"),
            (name::VPMAXSD, "vpmaxsd"),
            (name::VPMINUD, "vpminud"),
            (name::VPANDD, "vpandd"),
            (name::VPORD, "vpord"),
            (name::VPXORD, "vpxord"),
            (name::VPSLLVD, "vpsllvd"),
            (name::VPSRAVD, "vpsravd"),
            (name::VPERMD, "vpermd"),
            (name::VFMADD213PS, "vfmadd213ps"),
            (name::VFMADD231PS, "vfmadd231ps"),
            (name::VFNMADD231PS, "vfnmadd231ps"),
        ] {
            assert_eq!(both(op, None), format!("{text} zmm1, zmm2, zmm3"));
        }
        assert_eq!(both(name::VPTESTMD, None), "vptestmd k1, zmm2, zmm3");
        assert_eq!(both(name::VCMPPS, Some(9)), "vcmpngeps k1, zmm2, zmm3");
        assert_eq!(both(name::VPCMPD, Some(4)), "vpcmpneqd k1, zmm2, zmm3");
        let text = one(|code| {
            code.evex(name::VBROADCASTSS, 7, None, Rm::Lanes(Mem::At(Gpr(7), 0)), K(4), true, None);
        });
        assert_eq!(text, "vbroadcastss zmm7{k4}{z}, [rdi]");
        let text = one(|code| {
            code.evex(name::VFMADD213PS, 1, Some(Zmm(2)), Rm::Up(Zmm(3)), K(0), false, None);
        });
        assert_eq!(text, "vfmadd213ps zmm1{ru-sae}, zmm2, zmm3");
        let text = one(|code| {
            let to = Rm::Lanes(Mem::At(Gpr(6), 128));
            code.evex(name::VMOVDQU32_STORE, 31, None, to, K(0), false, None);
        });
        assert_eq!(text, "vmovdqu32 [rsi+80h], zmm31");
    }

    #[test]
    fn constants_lie_behind_the_code_and_loops_lead_back() {
        let mut code = Assembler::default();
        let (one, two) = (code.constant(0x1111_1111), code.constant(0x2222_2222));
        assert_eq!(code.constant(0x1111_1111), one);
        code.evex(name::VADDPS, 1, Some(Zmm(2)), Rm::Word(Mem::Pool(two)), K(0), false, None);
        let start = code.here();
        code.evex(name::VCMPPS, 1, Some(Zmm(2)), Rm::Word(Mem::Pool(one)), K(0), false, Some(2));
        code.count_and_return(64, start);
        let end = code.here();
        let bytes = code.finish(1);
        let pool = end.next_multiple_of(4);
        assert_eq!(bytes[pool..], [[0x11; 4], [0x22; 4]].concat());
        let texts = read(&bytes[..end]);
        let expected = [
            format!("vaddps zmm1, zmm2, [{:X}h]{{1to16}}", pool + 4),
            format!("vcmpleps k1, zmm2, [{pool:X}h]{{1to16}}"),
            "add rdx, 40h".to_owned(),
            "cmp rdx, rcx".to_owned(),
            format!("jb {start:016X}h"),
            "vzeroupper".to_owned(),
            "ret".to_owned(),
        ];
        assert_eq!(texts, expected);
    }
}
