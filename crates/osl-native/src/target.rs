//! The kinds of machines for which blocks become code.
//!
//! A further kind is a variant here and an encoder; nothing else depends on it.

use crate::allocate::{Assembled, assemble, carries};
use crate::avx2::{self, Avx2};
use crate::avx512::{self, Avx512};
use crate::block::Block;
use crate::encoder::Encoder;
use crate::neon::{self, Neon};

/// A kind of machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// x86-64 with AVX-512.
    Avx512,
    /// aarch64 with NEON, which all such processors have.
    Neon,
}

impl Target {
    /// All targets.
    pub const ALL: &'static [Target] = &[Target::Avx2, Target::Avx512, Target::Neon];

    /// The name of its instruction set.
    pub fn name(self) -> &'static str {
        match self {
            Target::Avx2 => "avx2",
            Target::Avx512 => "avx512",
            Target::Neon => "neon",
        }
    }

    /// The target with the name of an instruction set, if there is one and this machine can run its code.
    pub fn supported(name: &str) -> Option<Target> {
        Target::ALL.iter().copied().find(|target| target.name() == name && target.is_supported())
    }

    /// Whether this machine can run its code.
    pub fn is_supported(self) -> bool {
        match self {
            Target::Avx2 => avx2::is_supported(),
            Target::Avx512 => avx512::is_supported(),
            Target::Neon => neon::is_supported(),
        }
    }

    /// Lanes per vector. Code runs on whole vectors.
    pub fn lanes(self) -> usize {
        match self {
            Target::Avx2 => Avx2::LANES,
            Target::Avx512 => Avx512::LANES,
            Target::Neon => Neon::LANES,
        }
    }

    /// Whether there is code for the regions of a block: jumps, and registers for all values that a region
    /// carries.
    pub fn carries(self, block: &Block) -> bool {
        match self {
            Target::Avx2 => carries::<Avx2>(block),
            Target::Avx512 => carries::<Avx512>(block),
            Target::Neon => carries::<Neon>(block),
        }
    }

    /// Assembles the code of a block, whether or not this machine can run it, so that it can be inspected or
    /// emulated.
    ///
    /// The code takes four arguments, in the usual registers: the address of the array pointers, the address
    /// of its slots, the byte offset of the first lane, and the byte offset after the last. Code that may
    /// stop has its budget in a register of its own.
    pub fn assemble(self, block: &Block) -> Assembled {
        match self {
            Target::Avx2 => assemble::<Avx2>(block),
            Target::Avx512 => assemble::<Avx512>(block),
            Target::Neon => assemble::<Neon>(block),
        }
    }
}
