//! What code over registers may use, whatever the width of the registers: operations that the compiler does
//! not vectorise by itself, above all table lookups by lane. The modules `wide` and `narrow` implement it.
//!
//! Every register is made from a proof or from another register, so that its existence proves the
//! instructions. Use registers inside [`Registers::dispatch`], where most methods compile to a single
//! instruction.

use crate::Kernel;
use std::ops::{Add, BitAnd, BitOr, BitXor, Mul, Not, Sub};

/// Proof that the machine has registers of `N` words.
pub trait Registers<const N: usize>: Copy {
    /// `N` floats.
    type Floats: Floats<N, Words = Self::Words, Marks = Self::Marks>;
    /// `N` words.
    type Words: Words<N, Floats = Self::Floats, Marks = Self::Marks>;
    /// A mask of `N` lanes.
    type Marks: Marks;

    /// Runs the kernel as compiled for these registers.
    fn dispatch<K: Kernel>(self, kernel: K) -> K::Output;
    /// Floats from memory.
    fn floats(self, from: &[f32; N]) -> Self::Floats;
    /// Words from memory.
    fn words(self, from: &[u32; N]) -> Self::Words;
    /// One float in all lanes.
    fn all(self, x: f32) -> Self::Floats;
    /// One word in all lanes.
    fn each(self, x: u32) -> Self::Words;
    /// All lanes or none.
    fn marks(self, all: bool) -> Self::Marks;
}

/// A register of floats.
pub trait Floats<const N: usize>:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// Words of the same register.
    type Words;
    /// A mask of its lanes.
    type Marks;

    /// Writes the floats to memory.
    fn store(self, to: &mut [f32; N]);
    /// The largest integers that are not above the floats.
    fn floor(self) -> Self;
    /// The floats with the other sign.
    fn negative(self) -> Self;
    /// Converts whole numbers to integers.
    fn whole(self) -> Self::Words;
    /// Lanes that are not less than those of another; no lane is NaN.
    fn at_least(self, other: Self) -> Self::Marks;
    /// Subtracts another in some lanes; the others keep their value.
    fn less_at(self, marks: Self::Marks, other: Self) -> Self;
    /// Multiplies by another in some lanes; the others are 0.
    fn times_at(self, marks: Self::Marks, other: Self) -> Self;
    /// In each lane, the float whose word is larger: a negative one, if there is one.
    fn larger_word(self, other: Self) -> Self;
    /// Lanes from +0 to below 1.
    fn are_fractions(self) -> Self::Marks;
    /// Another in some lanes; the others keep their value.
    fn replaced_at(self, marks: Self::Marks, other: Self) -> Self;
}

/// A register of words.
pub trait Words<const N: usize>: Copy {
    /// Floats of the same register.
    type Floats;
    /// A mask of its lanes.
    type Marks;

    /// Writes the words to memory.
    fn store(self, to: &mut [u32; N]);
    /// For each lane, the float of a table that its word selects, which is less than 16.
    fn pick(self, table: &[f32; 16]) -> Self::Floats;
    /// As [`Words::pick`]; every word is less than 8.
    fn pick_low(self, table: &[f32; 16]) -> Self::Floats;
    /// Adds one of two, chosen by a mask.
    fn plus(self, marks: Self::Marks, yes: Self, no: Self) -> Self;
}

/// A mask of lanes.
pub trait Marks:
    Copy + BitAnd<Output = Self> + BitOr<Output = Self> + BitXor<Output = Self> + Not<Output = Self>
{
    /// The first lane in the mask, if any.
    fn first(self) -> Option<usize>;
}

/// An operator of the `Floats` at the place of use.
macro_rules! operator {
    ($trait:ident $name:ident $call:ident) => {
        impl $trait for Floats {
            type Output = Floats;
            #[inline(always)]
            fn $name(self, other: Floats) -> Floats {
                // SAFETY: the floats exist, so the machine has their instructions.
                unsafe { Floats($call(self.0, other.0)) }
            }
        }
    };
}
pub(crate) use operator;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Isa;

    /// Every operation with some floats, as words of its results.
    fn results<R: Registers<N>, const N: usize>(r: R, a: [f32; 16], b: [f32; 16]) -> Vec<Vec<u32>> {
        struct All<R>(R, [f32; 16], [f32; 16]);
        impl<R: Registers<N>, const N: usize> Kernel for (All<R>, [(); N]) {
            type Output = Vec<Vec<u32>>;
            #[inline(always)]
            fn run(self) -> Vec<Vec<u32>> {
                let All(r, a, b) = self.0;
                let mut lists = vec![Vec::new(); 13];
                for (x, y) in a.as_chunks::<N>().0.iter().zip(b.as_chunks::<N>().0) {
                    let (x, y) = (r.floats(x), r.floats(y));
                    let marks = x.at_least(y);
                    let index: [u32; N] = std::array::from_fn(|i| (i as u32 * 5 + 3) & 15);
                    let (index, low) = (r.words(&index), r.words(&index.map(|i| i & 7)));
                    let floats = [
                        x + y,
                        x - y,
                        x * y,
                        x.floor(),
                        x.negative(),
                        x.less_at(marks & !(marks ^ r.marks(true)), y),
                        x.times_at(marks | r.marks(false), y),
                        x.larger_word(y),
                        x.replaced_at(y.are_fractions(), y),
                        index.pick(&a),
                        low.pick_low(&b),
                    ];
                    let words = [x.floor().whole(), index.plus(marks, r.each(7), r.each(9))];
                    let (mut lanes, mut number) = ([0.0; N], 0);
                    for register in floats {
                        register.store(&mut lanes);
                        lists[number].extend(lanes.map(f32::to_bits));
                        number += 1;
                    }
                    for register in words {
                        let mut lanes = [0; N];
                        register.store(&mut lanes);
                        lists[number].extend(lanes);
                        number += 1;
                    }
                }
                lists
            }
        }
        r.dispatch((All(r, a, b), [(); N]))
    }

    #[test]
    fn both_widths_do_as_a_lane() {
        let a: [f32; 16] = std::array::from_fn(|i| (i as f32 - 7.5) * 0.37);
        let b: [f32; 16] = std::array::from_fn(|i| [0.0, -0.0, 0.999, 1.0, -1e-9, 0.5, 7.0, -3.25][i % 8]);
        let lanes = |f: &dyn Fn(usize) -> f32| (0..16).map(|i| f(i).to_bits()).collect::<Vec<u32>>();
        let fraction = |x: f32| x.is_sign_positive() && x < 1.0;
        let expected = |n: usize| {
            let index = |i: usize| (i % n * 5 + 3) & 15;
            vec![
                lanes(&|i| a[i] + b[i]),
                lanes(&|i| a[i] - b[i]),
                lanes(&|i| a[i] * b[i]),
                lanes(&|i| a[i].floor()),
                lanes(&|i| -a[i]),
                lanes(&|i| if a[i] >= b[i] { a[i] - b[i] } else { a[i] }),
                lanes(&|i| if a[i] >= b[i] { a[i] * b[i] } else { 0.0 }),
                lanes(&|i| if a[i].to_bits() > b[i].to_bits() { a[i] } else { b[i] }),
                lanes(&|i| if fraction(b[i]) { b[i] } else { a[i] }),
                lanes(&|i| a[index(i)]),
                lanes(&|i| b[index(i) & 7]),
                (0..16).map(|i| a[i].floor() as i32 as u32).collect(),
                (0..16).map(|i| index(i) as u32 + if a[i] >= b[i] { 7 } else { 9 }).collect(),
            ]
        };
        for isa in Isa::all() {
            if let Some(r) = isa.wide() {
                assert_eq!(results(r, a, b), expected(16));
                assert_eq!(r.floats(&a).at_least(r.floats(&b)).first(), (0..16).find(|i| a[*i] >= b[*i]));
                assert_eq!(r.marks(false).first(), None);
            }
            if let Some(r) = isa.narrow() {
                assert_eq!(results(r, a, b), expected(8));
                assert_eq!(r.marks(true).first(), Some(0));
                assert_eq!(r.marks(false).first(), None);
            }
        }
    }
}
