//! A block: a sequence of vector operations on values, with loads and stores.
//!
//! A value has lanes of 32 bits, floats or ints, as many as the machine's vectors; a mask value has a bit for
//! each of them. Equal operations on equal values are merged. The sequence may contain loops and parts that
//! are skipped: `region` records these.

use crate::inst::{
    Array, Binary, Carry, Compare, Inst, IntCompare, Kind, MaskValue, Op, Region, TABLE, Unary, Value,
};
use crate::simplify::{self, Truth};
use rustc_hash::FxHashMap;

/// The required size of an array.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Use {
    /// Minimum number of words.
    pub(crate) words: usize,
    /// Words needed before those of the last lane, if lanes are used.
    pub(crate) lanes: Option<usize>,
    pub(crate) written: bool,
}

/// What was known when a region began: the changes since.
#[derive(Clone, Debug, Default)]
pub(crate) struct Open {
    pub(crate) region: u32,
    pub(crate) known: Vec<Inst>,
    pub(crate) held: Vec<((Array, u32), Option<Value>)>,
}

/// A sequence of operations under construction.
#[derive(Clone, Debug, Default)]
pub struct Block {
    pub(crate) insts: Vec<Inst>,
    pub(crate) arrays: Vec<Use>,
    pub(crate) regions: Vec<Region>,
    pub(crate) known: FxHashMap<Inst, u32>,
    /// The known contents of array lanes.
    pub(crate) held: FxHashMap<(Array, u32), Value>,
    /// The regions that have begun and not ended, from the outermost on.
    pub(crate) open: Vec<Open>,
    /// Whether it computes two vectors in each round of the loop over lanes; see [`Block::pair`].
    pub(crate) is_pair: bool,
}

impl Block {
    /// An empty block.
    pub fn new() -> Block {
        Block::default()
    }

    /// Number of operations.
    pub fn len(&self) -> usize {
        self.insts.len()
    }

    /// Whether it has no operations.
    pub fn is_empty(&self) -> bool {
        self.insts.is_empty()
    }

    /// Number of vectors that it computes in each round of the loop over lanes.
    pub(crate) fn vectors(&self) -> usize {
        if self.is_pair { 2 } else { 1 }
    }

    /// Declares another array. The caller provides arrays in this order.
    pub fn array(&mut self) -> Array {
        self.arrays.push(Use::default());
        Array(self.arrays.len() as u32 - 1)
    }

    /// Lanes of an array; the first lane is at `word`.
    pub fn lanes(&mut self, array: Array, word: u32) -> Value {
        if let Some(held) = self.held.get(&(array, word)) {
            return *held;
        }
        self.note_lanes(array, word);
        // Not merged with an earlier load: the lanes may have been stored to and dropped from `held` since.
        let value = Value(self.push(Op::Lanes(array, word), &[]));
        self.hold(array, word, value);
        value
    }

    /// One word of an array, broadcast to all lanes. The block must not write that array.
    pub fn word(&mut self, array: Array, word: u32) -> Value {
        self.note_words(array, word as usize + 1);
        Value(self.pure(Op::Word(array, word), &[]))
    }

    /// The same bits in all lanes.
    pub fn bits(&mut self, bits: u32) -> Value {
        Value(self.pure(Op::Constant(bits), &[]))
    }

    /// The bits of a value, if they are a constant.
    pub fn constant(&self, value: Value) -> Option<u32> {
        match self.insts.get(value.0 as usize)?.op {
            Op::Constant(bits) => Some(bits),
            _ => None,
        }
    }

    /// The same float in all lanes.
    pub fn float(&mut self, x: f32) -> Value {
        self.bits(x.to_bits())
    }

    /// For each lane, the word that `index` selects from the [`TABLE`] words of an array starting at
    /// `word`. The block must not write that array.
    pub fn look_up(&mut self, array: Array, word: u32, index: Value) -> Value {
        self.note_words(array, word as usize + TABLE);
        Value(self.pure(Op::LookUp(array, word), &[index.0]))
    }

    /// Stores a value to lanes of an array. Later operations of the block see it; the caller sees it only if
    /// it is `kept`, which it must not be within a region. What is stored in a region is known up to its end.
    pub fn store(&mut self, array: Array, word: u32, value: Value, kept: bool) {
        debug_assert!(!kept || self.open.is_empty(), "a region keeps nothing");
        self.hold(array, word, value);
        if kept {
            self.note_lanes(array, word);
            if let Some(used) = self.arrays.get_mut(array.0 as usize) {
                used.written = true;
            }
            self.push(Op::Store(array, word), &[value.0]);
        }
    }

    /// Lanes of an array that start at `word` plus an offset, in words: that of the first lane of the vector,
    /// and at most `most`. An array that is accessed by offsets must not be accessed otherwise, except for
    /// single words.
    pub fn lanes_at(&mut self, array: Array, word: u32, offset: Value, most: u32) -> Value {
        let offset = self.bounded(array, word, offset, most);
        Value(self.push(Op::LanesAt(array, word), &[offset.0]))
    }

    /// Stores lanes at an offset, see [`Block::lanes_at`]. Later operations and the caller see it.
    pub fn store_at(&mut self, array: Array, word: u32, (offset, most): (Value, u32), value: Value) {
        let offset = self.bounded(array, word, offset, most);
        if let Some(used) = self.arrays.get_mut(array.0 as usize) {
            used.written = true;
        }
        self.push(Op::StoreAt(array, word), &[offset.0, value.0]);
    }

    /// For each lane, the word of an array at `word` plus an offset, at most `most`; see [`Block::lanes_at`].
    pub fn gather(&mut self, array: Array, word: u32, offset: Value, most: u32) -> Value {
        self.note_words(array, (word as usize).saturating_add(most as usize).saturating_add(1));
        let most = self.bits(most);
        let offset = self.binary(Binary::WordMin, offset, most);
        Value(self.push(Op::Gather(array, word), &[offset.0]))
    }

    /// An offset of lanes within its bounds.
    fn bounded(&mut self, array: Array, word: u32, offset: Value, most: u32) -> Value {
        self.note_lanes(array, word.saturating_add(most));
        let most = self.bits(most);
        self.binary(Binary::WordMin, offset, most)
    }

    /// An operation on one value.
    pub fn unary(&mut self, op: Unary, a: Value) -> Value {
        Value(self.pure(Op::Unary(op), &[a.0]))
    }

    /// An operation on two values. A quotient by a power of two becomes a product, which has the same bits.
    pub fn binary(&mut self, op: Binary, a: Value, b: Value) -> Value {
        if op == Binary::Div
            && let Some(inverse) = simplify::exact_inverse(&self.insts, b)
        {
            let inverse = self.bits(inverse);
            return self.binary(Binary::Mul, a, inverse);
        }
        Value(self.pure(Op::Binary(op), &[a.0, b.0]))
    }

    /// `x + y z`, or with `less` `x - y z`, rounded once.
    pub fn fused(&mut self, x: Value, [y, z]: [Value; 2], less: bool) -> Value {
        Value(self.pure(Op::Fused { less }, &[x.0, y.0, z.0]))
    }

    /// Compares floats.
    pub fn compare(&mut self, how: Compare, a: Value, b: Value) -> MaskValue {
        MaskValue(self.pure(Op::Compare(how), &[a.0, b.0]))
    }

    /// Compares ints. Whether a number made from a mask is 1 or 0 is that mask, or its opposite.
    pub fn compare_ints(&mut self, how: IntCompare, a: Value, b: Value) -> MaskValue {
        match simplify::tested(&self.insts, how, a, b) {
            Some((mask, true)) => return mask,
            Some((mask, false)) => return self.not(mask),
            None => {}
        }
        MaskValue(self.pure(Op::IntCompare(how), &[a.0, b.0]))
    }

    /// Whether any bit of a value is set. For a number made from a mask, this is that mask.
    pub fn not_zero(&mut self, a: Value) -> MaskValue {
        let made = match self.insts.get(a.0 as usize) {
            Some(inst) if inst.op == Op::Number => inst.args().first().map(|mask| MaskValue(*mask)),
            _ => None,
        };
        made.unwrap_or_else(|| MaskValue(self.pure(Op::NotZero, &[a.0])))
    }

    /// Whether floats are NaN (if `nan`) or infinite (if `infinite`).
    pub fn class(&mut self, a: Value, nan: bool, infinite: bool) -> MaskValue {
        MaskValue(self.pure(Op::Class { nan, infinite }, &[a.0]))
    }

    /// Logical and. Two tests of the same floats become one, if there is such a test. Of three masks, the one
    /// that is known last comes last.
    pub fn both(&mut self, a: MaskValue, b: MaskValue) -> MaskValue {
        // One step only: the masks of a long condition are not put in order one by one.
        match simplify::late_last(&self.insts, a, b) {
            Some([early, other, late]) => {
                let early = self.conjunction(early, other);
                self.conjunction(early, late)
            }
            None => self.conjunction(a, b),
        }
    }

    fn conjunction(&mut self, a: MaskValue, b: MaskValue) -> MaskValue {
        let simpler = simplify::both(&self.insts, a, b);
        MaskValue(self.merged(simpler.unwrap_or_else(|| Inst::new(Op::MaskAnd, &[a.0, b.0]))))
    }

    /// Logical or.
    pub fn either(&mut self, a: MaskValue, b: MaskValue) -> MaskValue {
        MaskValue(self.pure(Op::MaskOr, &[a.0, b.0]))
    }

    /// Logical not. For a comparison, this is the opposite comparison.
    pub fn not(&mut self, a: MaskValue) -> MaskValue {
        if let Some(inner) = simplify::opposite(&self.insts, a) {
            return inner;
        }
        let simpler = simplify::not(&self.insts, a);
        MaskValue(self.merged(simpler.unwrap_or_else(|| Inst::new(Op::MaskNot, &[a.0]))))
    }

    /// `yes` where the mask is set, else `no`.
    pub fn choose(&mut self, mask: MaskValue, yes: Value, no: Value) -> Value {
        if yes == no {
            return yes;
        }
        if let (Some(a), Some(b)) = (simplify::truth(&self.insts, yes), simplify::truth(&self.insts, no)) {
            return match self.choose_truth(mask, a, b) {
                Truth::Mask(chosen) => self.number(chosen),
                Truth::Known(bit) => self.bits(u32::from(bit)),
            };
        }
        if let Some((inner, some)) = simplify::nested(&self.insts, yes, no) {
            let mask = self.both(mask, inner);
            return self.choose(mask, some, no);
        }
        if let Some(min) = simplify::min(&self.insts, mask, yes, no) {
            return Value(self.merged(min));
        }
        match simplify::opposite(&self.insts, mask) {
            Some(mask) => Value(self.pure(Op::Choose, &[mask.0, no.0, yes.0])),
            None => Value(self.pure(Op::Choose, &[mask.0, yes.0, no.0])),
        }
    }

    /// The truth that is `yes` where a mask is set, else `no`.
    fn choose_truth(&mut self, mask: MaskValue, yes: Truth, no: Truth) -> Truth {
        // Where the mask is set, it is true itself; elsewhere, it is false.
        let yes = simplify::under(&self.insts, yes, mask, true);
        let no = simplify::under(&self.insts, no, mask, false);
        Truth::Mask(match (yes, no) {
            (Truth::Known(yes), Truth::Known(no)) if yes == no => return Truth::Known(yes),
            (Truth::Known(true), Truth::Known(_)) => mask,
            (Truth::Known(false), Truth::Known(_)) => self.not(mask),
            (Truth::Known(true), Truth::Mask(no)) => self.either(mask, no),
            (Truth::Mask(yes), Truth::Known(false)) => self.both(mask, yes),
            (Truth::Known(false), Truth::Mask(no)) => {
                let other = self.not(mask);
                self.both(other, no)
            }
            (Truth::Mask(yes), Truth::Known(true)) => {
                let other = self.not(mask);
                self.either(other, yes)
            }
            (Truth::Mask(yes), Truth::Mask(no)) => {
                let other = self.not(mask);
                let (here, there) = (self.both(mask, yes), self.both(other, no));
                self.either(here, there)
            }
        })
    }

    /// The length of a vector whose components' squares sum up to `square`. If the sum is below `2^-125` it
    /// has lost bits; then the components are divided by the largest first: |largest| · √(Σ (component /
    /// largest)²), in this order of operations, and 0 if the largest is 0.
    pub fn length(&mut self, square: Value, [x, y, z]: [Value; 3]) -> Value {
        let root = self.unary(Unary::Sqrt, square);
        Value(self.pure(Op::Length, &[root.0, square.0, x.0, y.0, z.0]))
    }

    /// 1 where the mask is set, else 0.
    pub fn number(&mut self, mask: MaskValue) -> Value {
        Value(self.pure(Op::Number, &[mask.0]))
    }

    fn note_words(&mut self, array: Array, words: usize) {
        if let Some(used) = self.arrays.get_mut(array.0 as usize) {
            used.words = used.words.max(words);
        }
    }

    fn note_lanes(&mut self, array: Array, word: u32) {
        if let Some(used) = self.arrays.get_mut(array.0 as usize) {
            used.lanes = used.lanes.max(Some(word as usize));
        }
    }

    fn pure(&mut self, op: Op, list: &[u32]) -> u32 {
        self.merged(Inst::new(op, list))
    }

    /// Notes the contents of array lanes.
    fn hold(&mut self, array: Array, word: u32, value: Value) {
        let before = self.held.insert((array, word), value);
        if let Some(open) = self.open.last_mut() {
            open.held.push(((array, word), before));
        }
    }

    /// The number of an operation, which is an earlier one if that is equal.
    pub(crate) fn merged(&mut self, inst: Inst) -> u32 {
        if let Some(known) = self.known.get(&inst) {
            return *known;
        }
        self.insts.push(inst);
        let number = self.insts.len() as u32 - 1;
        self.known.insert(inst, number);
        // What is in memory already can be used anywhere.
        if !inst.op.is_source()
            && let Some(open) = self.open.last_mut()
        {
            open.known.push(inst);
        }
        number
    }

    pub(crate) fn push(&mut self, op: Op, list: &[u32]) -> u32 {
        self.insts.push(Inst::new(op, list));
        self.insts.len() as u32 - 1
    }

    /// Puts the operations into another order, given by their numbers. It must have each once, after its
    /// operands. Nothing may be added afterwards.
    pub(crate) fn reorder(&mut self, order: &[u32]) {
        let mut new = vec![0; self.insts.len()];
        for (at, old) in order.iter().enumerate() {
            new[*old as usize] = at as u32;
        }
        let renamed = |v: u32| new.get(v as usize).copied().unwrap_or(v);
        let insts = order.iter().filter_map(|old| self.insts.get(*old as usize));
        self.insts = insts.map(|inst| inst.renamed(renamed)).collect();
        for region in &mut self.regions {
            let Region { kind, begin, end, carried, again, .. } = region;
            (*begin, *end, *again) = (renamed(*begin), renamed(*end), renamed(*again));
            if let Kind::Skip { mask } = kind {
                *mask = renamed(*mask);
            }
            for Carry { init, param, next, result } in carried {
                for v in [init, param, next, result] {
                    *v = renamed(*v);
                }
            }
        }
        // Both speak of the old numbers, and nothing is added any more.
        self.known.clear();
        self.held.clear();
    }
}
