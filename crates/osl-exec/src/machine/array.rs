//! Arrays: reading and writing elements, by an index that is uniform or differs between lanes.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::step::{Array, Location, Operand};
use osl_lanes::{Arg, Word};
use osl_simd::Kernel;

/// Elements that are cleared together.
const BLOCK: usize = 64;

/// Maximum number of elements in a table that fits in one vector.
const MAX_TABLE: usize = 16;

/// Number of blocks of an array.
pub(super) fn blocks(array: &Array) -> usize {
    (array.len as usize).div_ceil(BLOCK)
}

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// Clears the parts of arrays that a batch has written: long arrays are seldom written everywhere.
    pub(super) fn clear_arrays(&mut self) {
        for ((array, plan), dirty) in self.arrays.iter_mut().zip(&self.program.arrays).zip(&mut self.dirty) {
            let block = BLOCK * plan.words as usize * if plan.varying { self.width } else { 1 };
            for (words, dirty) in array.words_mut().chunks_mut(block.max(1)).zip(dirty) {
                if std::mem::take(dirty) {
                    words.fill(A::Word::default());
                }
            }
        }
    }

    fn touch(&mut self, array: u32, index: usize) {
        if let Some(dirty) = self.dirty[array as usize].get_mut(index / BLOCK) {
            *dirty = true;
        }
    }

    /// Marks all elements.
    pub(super) fn touch_array(&mut self, array: u32) {
        if let Some(dirty) = self.dirty.get_mut(array as usize) {
            dirty.fill(true);
        }
    }

    /// Marks the elements that a store may write.
    pub(super) fn touch_all(&mut self, array: u32, index: Operand, mask: &Mask) {
        let last = self.program.arrays[array as usize].len.saturating_sub(1);
        let mut dirty = std::mem::take(&mut self.dirty[array as usize]);
        let mut mark = |at: u32| {
            if let Some(dirty) = dirty.get_mut(at.min(last) as usize / BLOCK) {
                *dirty = true;
            }
        };
        match self.arg(index) {
            Arg::Same(at) => mark(at[0].bits()),
            Arg::Each(_) if last < BLOCK as u32 => mark(0),
            Arg::Each(indices) => mask.for_each(|lane| mark(indices[lane].bits())),
        }
        self.dirty[array as usize] = dirty;
    }

    /// One word of an array's element at one lane.
    pub(super) fn element(&self, array: u32, index: usize, component: usize, lane: usize) -> A::Word {
        let plan = self.program.arrays[array as usize];
        let at = index.min(plan.len.saturating_sub(1) as usize) * plan.words as usize + component;
        let words = self.arrays[array as usize].words();
        words[if plan.varying { at * self.width + lane } else { at }]
    }

    pub(super) fn set_element(
        &mut self,
        array: u32,
        index: usize,
        component: usize,
        lane: usize,
        word: A::Word,
    ) {
        let plan = self.program.arrays[array as usize];
        if index >= plan.len as usize {
            return;
        }
        self.touch(array, index);
        let at = index * plan.words as usize + component;
        let at = if plan.varying { at * self.width + lane } else { at };
        self.arrays[array as usize].words_mut()[at] = word;
    }

    pub(super) fn load(&mut self, array: u32, index: Operand, out: Operand) {
        let plan = self.program.arrays[array as usize];
        let width = self.width;
        let mut target = self.take(out);
        let lanes_of = if plan.varying { width } else { 1 };
        let source = self.arrays[array as usize].words();
        let last = plan.len.saturating_sub(1);
        let words = plan.words as usize;
        let n = if matches!(out.location, Location::Words(_)) { 1 } else { width };
        let mut places = std::mem::take(&mut self.places);
        match self.arg(index) {
            Arg::Same(i) => {
                let at = i[0].bits().min(last) as usize * words;
                for (component, lanes) in target.chunks_mut(n).enumerate().take(words) {
                    let from = &source[(at + component) * lanes_of..][..lanes_of];
                    if lanes_of == n { lanes.copy_from_slice(from) } else { lanes.fill(from[0]) }
                }
            }
            Arg::Each(indices) => {
                // A small uniform table is looked up by vectors.
                let small = !plan.varying && (1..=MAX_TABLE).contains(&(plan.len as usize));
                let narrow = A::Word::narrow(indices);
                if !(small && narrow.is_some()) {
                    places.resize(width, 0);
                    self.isa.dispatch(Places { indices, last, words: plan.words, places: &mut places });
                }
                for (component, lanes) in target.chunks_mut(n).enumerate().take(words) {
                    if small && let Some(indices) = narrow {
                        let element = |at: usize| source[at.min(last as usize) * words + component];
                        A::Word::look_up(self.isa, &std::array::from_fn(element), indices, lanes);
                    } else if plan.varying {
                        for (lane, (o, at)) in lanes.iter_mut().zip(&places).enumerate() {
                            *o = source[(*at as usize + component) * width + lane];
                        }
                    } else {
                        let source = &source[component..];
                        for (o, at) in lanes.iter_mut().zip(&places) {
                            *o = source[*at as usize];
                        }
                    }
                }
            }
        }
        self.places = places;
        self.put(out, target);
    }

    pub(super) fn store(&mut self, array: u32, index: Operand, value: Operand, mask: &Mask) {
        let plan = self.program.arrays[array as usize];
        let width = self.width;
        self.touch_all(array, index, mask);
        let mut target = std::mem::take(&mut self.arrays[array as usize]);
        let words = target.words_mut();
        let last = plan.len.saturating_sub(1);
        for component in 0..plan.words as usize {
            let value = self.component(value, component);
            match (self.arg(index), plan.varying) {
                (Arg::Same(i), true) => {
                    let at = i[0].bits().min(last) as usize * plan.words as usize + component;
                    let lanes = &mut words[at * width..][..width];
                    match value {
                        Arg::Each(v) => mask.copy(self.isa, lanes, v),
                        Arg::Same(v) => mask.fill(self.isa, lanes, v[0]),
                    }
                }
                (Arg::Each(indices), true) => mask.for_each(|lane| {
                    let at = indices[lane].bits().min(last) as usize * plan.words as usize + component;
                    words[at * width + lane] = match value {
                        Arg::Each(v) => v[lane],
                        Arg::Same(v) => v[0],
                    };
                }),
                (Arg::Same(i) | Arg::Each(i), false) => {
                    let at = i[0].bits().min(last) as usize * plan.words as usize + component;
                    let (Arg::Each(v) | Arg::Same(v)) = value;
                    words[at] = v[0];
                }
            }
        }
        self.arrays[array as usize] = target;
    }
}

/// Computes the places of elements: the first word of each, for indices that are clamped to the last element.
struct Places<'a, W> {
    indices: &'a [W],
    last: u32,
    /// Number of words in an element.
    words: u32,
    places: &'a mut [u32],
}

impl<W: Word> Kernel for Places<'_, W> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Places { indices, last, words, places } = self;
        let indices = &indices[..places.len()];
        osl_simd::fill(
            places,
            #[inline(always)]
            |i| indices[i].bits().min(last).wrapping_mul(words),
        );
    }
}
