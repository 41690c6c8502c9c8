//! Registers of sixteen words, with AVX-512.

use crate::Kernel;
use crate::registers::{self, Registers};
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Mul, Not, Sub};

/// Proof that the machine has AVX-512.
#[derive(Clone, Copy)]
pub struct Wide(());

/// Sixteen floats.
#[derive(Clone, Copy)]
pub struct Floats(__m512);

/// Sixteen words.
#[derive(Clone, Copy)]
pub struct Words(__m512i);

/// A mask of sixteen lanes.
#[derive(Clone, Copy)]
pub struct Marks(__mmask16);

// SAFETY of all blocks below: the value at hand comes from a `Wide`, which is made only where AVX-512 was
// detected. Loads and stores use arrays of sixteen words.

impl Wide {
    /// The proof for a detected level.
    pub(crate) fn detected() -> Wide {
        Wide(())
    }
}

impl Registers<16> for Wide {
    type Floats = Floats;
    type Words = Words;
    type Marks = Marks;

    #[inline]
    fn dispatch<K: Kernel>(self, kernel: K) -> K::Output {
        unsafe { crate::run_avx512(kernel) }
    }

    #[inline(always)]
    fn floats(self, from: &[f32; 16]) -> Floats {
        unsafe { Floats(_mm512_loadu_ps(from.as_ptr())) }
    }

    #[inline(always)]
    fn words(self, from: &[u32; 16]) -> Words {
        unsafe { Words(_mm512_loadu_si512(from.as_ptr().cast())) }
    }

    #[inline(always)]
    fn all(self, x: f32) -> Floats {
        unsafe { Floats(_mm512_set1_ps(x)) }
    }

    #[inline(always)]
    fn each(self, x: u32) -> Words {
        unsafe { Words(_mm512_set1_epi32(x as i32)) }
    }

    #[inline(always)]
    fn marks(self, all: bool) -> Marks {
        Marks(if all { u16::MAX } else { 0 })
    }
}

impl registers::Floats<16> for Floats {
    type Words = Words;
    type Marks = Marks;

    #[inline(always)]
    fn store(self, to: &mut [f32; 16]) {
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn floor(self) -> Floats {
        unsafe { Floats(_mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0)) }
    }

    #[inline(always)]
    fn negative(self) -> Floats {
        unsafe { Floats(_mm512_xor_ps(self.0, _mm512_set1_ps(-0.0))) }
    }

    #[inline(always)]
    fn whole(self) -> Words {
        unsafe { Words(_mm512_cvttps_epi32(self.0)) }
    }

    #[inline(always)]
    fn at_least(self, other: Floats) -> Marks {
        unsafe { Marks(_mm512_cmp_ps_mask::<_CMP_GE_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn less_at(self, marks: Marks, other: Floats) -> Floats {
        unsafe { Floats(_mm512_mask_sub_ps(self.0, marks.0, self.0, other.0)) }
    }

    #[inline(always)]
    fn times_at(self, marks: Marks, other: Floats) -> Floats {
        unsafe { Floats(_mm512_maskz_mul_ps(marks.0, self.0, other.0)) }
    }

    #[inline(always)]
    fn larger_word(self, other: Floats) -> Floats {
        unsafe {
            let (a, b) = (_mm512_castps_si512(self.0), _mm512_castps_si512(other.0));
            Floats(_mm512_castsi512_ps(_mm512_max_epu32(a, b)))
        }
    }

    #[inline(always)]
    fn are_fractions(self) -> Marks {
        unsafe {
            let one = _mm512_set1_epi32(1.0_f32.to_bits() as i32);
            Marks(_mm512_cmplt_epu32_mask(_mm512_castps_si512(self.0), one))
        }
    }

    #[inline(always)]
    fn replaced_at(self, marks: Marks, other: Floats) -> Floats {
        unsafe { Floats(_mm512_mask_blend_ps(marks.0, self.0, other.0)) }
    }
}

impl registers::Words<16> for Words {
    type Floats = Floats;
    type Marks = Marks;

    #[inline(always)]
    fn store(self, to: &mut [u32; 16]) {
        unsafe { _mm512_storeu_si512(to.as_mut_ptr().cast(), self.0) }
    }

    #[inline(always)]
    fn pick(self, table: &[f32; 16]) -> Floats {
        unsafe { Floats(_mm512_permutexvar_ps(self.0, _mm512_loadu_ps(table.as_ptr()))) }
    }

    #[inline(always)]
    fn pick_low(self, table: &[f32; 16]) -> Floats {
        self.pick(table)
    }

    #[inline(always)]
    fn plus(self, marks: Marks, yes: Words, no: Words) -> Words {
        unsafe { Words(_mm512_add_epi32(self.0, _mm512_mask_blend_epi32(marks.0, no.0, yes.0))) }
    }
}

impl registers::Marks for Marks {
    #[inline(always)]
    fn first(self) -> Option<usize> {
        (self.0 != 0).then(
            #[inline(always)]
            || self.0.trailing_zeros() as usize,
        )
    }
}

impl BitAnd for Marks {
    type Output = Marks;
    #[inline(always)]
    fn bitand(self, other: Marks) -> Marks {
        Marks(self.0 & other.0)
    }
}

impl BitOr for Marks {
    type Output = Marks;
    #[inline(always)]
    fn bitor(self, other: Marks) -> Marks {
        Marks(self.0 | other.0)
    }
}

impl BitXor for Marks {
    type Output = Marks;
    #[inline(always)]
    fn bitxor(self, other: Marks) -> Marks {
        Marks(self.0 ^ other.0)
    }
}

impl Not for Marks {
    type Output = Marks;
    #[inline(always)]
    fn not(self) -> Marks {
        Marks(!self.0)
    }
}

crate::registers::operator!(Add add _mm512_add_ps);
crate::registers::operator!(Sub sub _mm512_sub_ps);
crate::registers::operator!(Mul mul _mm512_mul_ps);
