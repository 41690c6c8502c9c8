//! Registers of eight words, with AVX2.

use crate::Kernel;
use crate::registers::{self, Registers};
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Mul, Not, Sub};

/// Proof that the machine has AVX2.
#[derive(Clone, Copy)]
pub struct Narrow(());

/// Eight floats.
#[derive(Clone, Copy)]
pub struct Floats(__m256);

/// Eight words.
#[derive(Clone, Copy)]
pub struct Words(__m256i);

/// A mask of eight lanes: all bits of a lane are equal.
#[derive(Clone, Copy)]
pub struct Marks(__m256);

// SAFETY of all blocks below: the value at hand comes from a `Narrow`, which is made only where AVX2 was
// detected. Loads and stores use arrays of eight words, or one half of an array of sixteen.

impl Narrow {
    /// The proof for a detected level.
    pub(crate) fn detected() -> Narrow {
        Narrow(())
    }
}

impl Registers<8> for Narrow {
    type Floats = Floats;
    type Words = Words;
    type Marks = Marks;

    #[inline]
    fn dispatch<K: Kernel>(self, kernel: K) -> K::Output {
        unsafe { crate::run_avx2(kernel) }
    }

    #[inline(always)]
    fn floats(self, from: &[f32; 8]) -> Floats {
        unsafe { Floats(_mm256_loadu_ps(from.as_ptr())) }
    }

    #[inline(always)]
    fn words(self, from: &[u32; 8]) -> Words {
        unsafe { Words(_mm256_loadu_si256(from.as_ptr().cast())) }
    }

    #[inline(always)]
    fn all(self, x: f32) -> Floats {
        unsafe { Floats(_mm256_set1_ps(x)) }
    }

    #[inline(always)]
    fn each(self, x: u32) -> Words {
        unsafe { Words(_mm256_set1_epi32(x as i32)) }
    }

    #[inline(always)]
    fn marks(self, all: bool) -> Marks {
        unsafe { Marks(_mm256_castsi256_ps(_mm256_set1_epi32(-i32::from(all)))) }
    }
}

impl registers::Floats<8> for Floats {
    type Words = Words;
    type Marks = Marks;

    #[inline(always)]
    fn store(self, to: &mut [f32; 8]) {
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn floor(self) -> Floats {
        unsafe { Floats(_mm256_round_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0)) }
    }

    #[inline(always)]
    fn negative(self) -> Floats {
        unsafe { Floats(_mm256_xor_ps(self.0, _mm256_set1_ps(-0.0))) }
    }

    #[inline(always)]
    fn whole(self) -> Words {
        unsafe { Words(_mm256_cvttps_epi32(self.0)) }
    }

    #[inline(always)]
    fn at_least(self, other: Floats) -> Marks {
        unsafe { Marks(_mm256_cmp_ps::<_CMP_GE_OQ>(self.0, other.0)) }
    }

    // Subtracting +0 leaves every float unchanged.
    #[inline(always)]
    fn less_at(self, marks: Marks, other: Floats) -> Floats {
        unsafe { Floats(_mm256_sub_ps(self.0, _mm256_and_ps(marks.0, other.0))) }
    }

    #[inline(always)]
    fn times_at(self, marks: Marks, other: Floats) -> Floats {
        unsafe { Floats(_mm256_and_ps(marks.0, _mm256_mul_ps(self.0, other.0))) }
    }

    #[inline(always)]
    fn larger_word(self, other: Floats) -> Floats {
        unsafe {
            let (a, b) = (_mm256_castps_si256(self.0), _mm256_castps_si256(other.0));
            Floats(_mm256_castsi256_ps(_mm256_max_epu32(a, b)))
        }
    }

    #[inline(always)]
    fn are_fractions(self) -> Marks {
        unsafe {
            // There is no comparison of unsigned words.
            let last = _mm256_set1_epi32(1.0_f32.to_bits() as i32 - 1);
            let words = _mm256_castps_si256(self.0);
            Marks(_mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_max_epu32(words, last), last)))
        }
    }

    #[inline(always)]
    fn replaced_at(self, marks: Marks, other: Floats) -> Floats {
        unsafe { Floats(_mm256_blendv_ps(self.0, other.0, marks.0)) }
    }
}

impl registers::Words<8> for Words {
    type Floats = Floats;
    type Marks = Marks;

    #[inline(always)]
    fn store(self, to: &mut [u32; 8]) {
        unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), self.0) }
    }

    // Each half is looked up by the lowest three bits; the fourth, as a sign, selects the half.
    #[inline(always)]
    fn pick(self, table: &[f32; 16]) -> Floats {
        unsafe {
            let high = _mm256_permutevar8x32_ps(_mm256_loadu_ps(table.as_ptr().add(8)), self.0);
            let choice = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(self.0));
            Floats(_mm256_blendv_ps(self.pick_low(table).0, high, choice))
        }
    }

    #[inline(always)]
    fn pick_low(self, table: &[f32; 16]) -> Floats {
        unsafe { Floats(_mm256_permutevar8x32_ps(_mm256_loadu_ps(table.as_ptr()), self.0)) }
    }

    #[inline(always)]
    fn plus(self, marks: Marks, yes: Words, no: Words) -> Words {
        unsafe {
            let chosen = _mm256_blendv_epi8(no.0, yes.0, _mm256_castps_si256(marks.0));
            Words(_mm256_add_epi32(self.0, chosen))
        }
    }
}

impl registers::Marks for Marks {
    #[inline(always)]
    fn first(self) -> Option<usize> {
        let bits = unsafe { _mm256_movemask_ps(self.0) };
        (bits != 0).then(
            #[inline(always)]
            || bits.trailing_zeros() as usize,
        )
    }
}

impl BitAnd for Marks {
    type Output = Marks;
    #[inline(always)]
    fn bitand(self, other: Marks) -> Marks {
        unsafe { Marks(_mm256_and_ps(self.0, other.0)) }
    }
}

impl BitOr for Marks {
    type Output = Marks;
    #[inline(always)]
    fn bitor(self, other: Marks) -> Marks {
        unsafe { Marks(_mm256_or_ps(self.0, other.0)) }
    }
}

impl BitXor for Marks {
    type Output = Marks;
    #[inline(always)]
    fn bitxor(self, other: Marks) -> Marks {
        unsafe { Marks(_mm256_xor_ps(self.0, other.0)) }
    }
}

impl Not for Marks {
    type Output = Marks;
    #[inline(always)]
    fn not(self) -> Marks {
        unsafe { Marks(_mm256_xor_ps(self.0, _mm256_castsi256_ps(_mm256_set1_epi32(-1)))) }
    }
}

crate::registers::operator!(Add add _mm256_add_ps);
crate::registers::operator!(Sub sub _mm256_sub_ps);
crate::registers::operator!(Mul mul _mm256_mul_ps);
