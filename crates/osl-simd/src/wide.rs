//! Registers of sixteen words, for operations that the compiler does not vectorise: above all, table lookups
//! by lane.
//!
//! Every register is made from a [`Proof`] or from another register, so that its existence proves the
//! instructions. Use them inside [`crate::Isa::dispatch`], where each method compiles to a single
//! instruction.

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Mul, Not, Sub};

/// Proof that the machine has AVX-512.
#[derive(Clone, Copy)]
pub struct Proof(());

/// Sixteen floats.
#[derive(Clone, Copy)]
pub struct Floats(__m512);

/// Sixteen words.
#[derive(Clone, Copy)]
pub struct Words(__m512i);

/// A mask of sixteen lanes.
#[derive(Clone, Copy)]
pub struct Marks(__mmask16);

// SAFETY of all blocks below: the value at hand comes from a `Proof`, which is made only where AVX-512 was
// detected. Loads and stores use arrays of sixteen words.

impl Proof {
    /// The proof for a detected level.
    pub(crate) fn detected() -> Proof {
        Proof(())
    }

    /// Sixteen floats from memory.
    #[inline(always)]
    pub fn floats(self, from: &[f32; 16]) -> Floats {
        unsafe { Floats(_mm512_loadu_ps(from.as_ptr())) }
    }

    /// Sixteen words from memory.
    #[inline(always)]
    pub fn words(self, from: &[u32; 16]) -> Words {
        unsafe { Words(_mm512_loadu_si512(from.as_ptr().cast())) }
    }

    /// One float in all lanes.
    #[inline(always)]
    pub fn all(self, x: f32) -> Floats {
        unsafe { Floats(_mm512_set1_ps(x)) }
    }

    /// One word in all lanes.
    #[inline(always)]
    pub fn each(self, x: u32) -> Words {
        unsafe { Words(_mm512_set1_epi32(x as i32)) }
    }
}

impl Floats {
    /// Writes the floats to memory.
    #[inline(always)]
    pub fn store(self, to: &mut [f32; 16]) {
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
    }

    /// The largest integers that are not above the floats.
    #[inline(always)]
    pub fn floor(self) -> Floats {
        unsafe { Floats(_mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0)) }
    }

    /// Converts whole numbers to integers.
    #[inline(always)]
    pub fn whole(self) -> Words {
        unsafe { Words(_mm512_cvttps_epi32(self.0)) }
    }

    /// Lanes that are not less than those of another; no lane is NaN.
    #[inline(always)]
    pub fn at_least(self, other: Floats) -> Marks {
        unsafe { Marks(_mm512_cmp_ps_mask::<_CMP_GE_OQ>(self.0, other.0)) }
    }

    /// Subtracts another in some lanes; the others keep their value.
    #[inline(always)]
    pub fn less_at(self, marks: Marks, other: Floats) -> Floats {
        unsafe { Floats(_mm512_mask_sub_ps(self.0, marks.0, self.0, other.0)) }
    }

    /// Multiplies by another in some lanes; the others are 0.
    #[inline(always)]
    pub fn times_at(self, marks: Marks, other: Floats) -> Floats {
        unsafe { Floats(_mm512_maskz_mul_ps(marks.0, self.0, other.0)) }
    }
}

impl Words {
    /// Writes the words to memory.
    #[inline(always)]
    pub fn store(self, to: &mut [u32; 16]) {
        unsafe { _mm512_storeu_si512(to.as_mut_ptr().cast(), self.0) }
    }

    /// For each lane, the float of a table that its lowest four bits select.
    #[inline(always)]
    pub fn pick(self, table: Floats) -> Floats {
        unsafe { Floats(_mm512_permutexvar_ps(self.0, table.0)) }
    }

    /// Adds one of two, chosen by a mask.
    #[inline(always)]
    pub fn plus(self, marks: Marks, yes: Words, no: Words) -> Words {
        unsafe { Words(_mm512_add_epi32(self.0, _mm512_mask_blend_epi32(marks.0, no.0, yes.0))) }
    }
}

impl BitAnd for Marks {
    type Output = Marks;
    /// Lanes in both masks.
    #[inline(always)]
    fn bitand(self, other: Marks) -> Marks {
        Marks(self.0 & other.0)
    }
}

impl BitOr for Marks {
    type Output = Marks;
    /// Lanes in one of the masks or both.
    #[inline(always)]
    fn bitor(self, other: Marks) -> Marks {
        Marks(self.0 | other.0)
    }
}

impl Not for Marks {
    type Output = Marks;
    /// Lanes that are not in the mask.
    #[inline(always)]
    fn not(self) -> Marks {
        Marks(!self.0)
    }
}

macro_rules! operator {
    ($trait:ident $name:ident $call:ident) => {
        impl $trait for Floats {
            type Output = Floats;
            #[inline(always)]
            fn $name(self, other: Floats) -> Floats {
                unsafe { Floats($call(self.0, other.0)) }
            }
        }
    };
}

operator!(Add add _mm512_add_ps);
operator!(Sub sub _mm512_sub_ps);
operator!(Mul mul _mm512_mul_ps);
