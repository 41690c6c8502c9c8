//! A block: vector operations one behind the other, each on what those before it gave, and what they load and store.
//!
//! Values are 16 lanes of 32 bits, floats or ints; truths are a bit for each. Equal operations on equal values are one.
//! This module must not know registers or instructions.

use rustc_hash::FxHashMap;

/// A value of 16 lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Value(pub(crate) u32);

/// A truth for each of 16 lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Truth(pub(crate) u32);

/// An array of words that the caller of the code brings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Array(pub(crate) u32);

/// What an operation on two values computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Binary {
    /// The sum of floats.
    Add,
    /// The difference of floats.
    Sub,
    /// The product of floats.
    Mul,
    /// The quotient of floats.
    Div,
    /// The first float where it is smaller, else (NaN, zeros of either sign) the second.
    Min,
    /// The sum of ints modulo 2^32.
    IntAdd,
    /// The difference of ints modulo 2^32.
    IntSub,
    /// The product of ints modulo 2^32.
    IntMul,
    /// The smaller int.
    IntMin,
    /// The larger int.
    IntMax,
    /// Bits that both have.
    And,
    /// Bits that either has.
    Or,
    /// Bits that one of them has.
    Xor,
    /// Bits shifted left; all gone from 32 on.
    Shl,
    /// Bits shifted right, the sign kept.
    Shr,
}

/// What an operation on one value computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unary {
    /// The square root of a float.
    Sqrt,
    /// 1 by the square root of a float that is not zero, both rounded.
    InverseRoot,
    /// The largest whole float not above.
    Floor,
    /// The smallest whole float not below.
    Ceil,
    /// The float without its fraction.
    Trunc,
    /// The float of an int.
    ToFloat,
    /// The int of a float, truncated; `i32::MIN` for what has none.
    ToInt,
    /// The magnitude of an int.
    IntAbs,
}

/// Which floats, compared, make a truth. Those named `Or` are true of NaN.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Compare {
    Equal,
    Less,
    LessEqual,
    GreaterEqual,
    Greater,
    EqualOrNan,
    UnequalOrNan,
    LessOrNan,
    LessEqualOrNan,
    GreaterEqualOrNan,
    GreaterOrNan,
}

/// Which ints, compared, make a truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "the names say it")]
pub enum IntCompare {
    Equal,
    Less,
    LessEqual,
    Unequal,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Op {
    /// Lanes of an array, from a word on.
    Lanes(Array, u32),
    /// A word of an array.
    Word(Array, u32),
    Constant(u32),
    Unary(Unary),
    Binary(Binary),
    /// Word of a table of 16 by an index of 0 to 15.
    LookUp(Array, u32),
    Compare(Compare),
    IntCompare(IntCompare),
    /// Whether bits are set.
    NotZero,
    /// Whether a float is NaN, or infinite, or both asked for.
    Class {
        nan: bool,
        infinite: bool,
    },
    TruthAnd,
    TruthOr,
    TruthNot,
    /// The first value where the truth is, else the second.
    Choose,
    /// The first value plus, or less, the product of the others, rounded once.
    Fused {
        less: bool,
    },
    /// The length of a vector whose squares sum up to the second value, of which the first is the root: the vector scaled
    /// by its largest component where squares are too small.
    Length,
    /// 1 where the truth is, else 0.
    Number,
    Store(Array, u32),
}

impl Op {
    /// Whether what it yields stands in memory as it is.
    pub(crate) fn is_source(self) -> bool {
        matches!(self, Op::Lanes(..) | Op::Word(..) | Op::Constant(_))
    }

    /// Whether it yields a truth.
    pub(crate) fn is_truth(self) -> bool {
        use Op::{Class, Compare, IntCompare, NotZero, TruthAnd, TruthNot, TruthOr};
        matches!(self, Compare(_) | IntCompare(_) | NotZero | Class { .. } | TruthAnd | TruthOr | TruthNot)
    }
}

/// An operation and its arguments, by their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Inst {
    pub(crate) op: Op,
    args: [u32; 5],
    count: u8,
}

impl Inst {
    pub(crate) fn args(&self) -> &[u32] {
        &self.args[..usize::from(self.count)]
    }
}

/// How a block uses an array.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Use {
    /// Words that it must have at least.
    pub(crate) words: usize,
    /// Words that it must have before those of the last lane, if lanes are used.
    pub(crate) lanes: Option<usize>,
    pub(crate) written: bool,
}

/// Operations as they are put together.
#[derive(Clone, Debug, Default)]
pub struct Block {
    pub(crate) insts: Vec<Inst>,
    pub(crate) arrays: Vec<Use>,
    known: FxHashMap<Inst, u32>,
    /// What lanes of arrays hold, as far as that is known.
    held: FxHashMap<(Array, u32), Value>,
}

impl Block {
    /// A block that does nothing.
    pub fn new() -> Block {
        Block::default()
    }

    /// How many operations it has.
    pub fn len(&self) -> usize {
        self.insts.len()
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.insts.is_empty()
    }

    /// One more array. Arrays are brought in this order.
    pub fn array(&mut self) -> Array {
        self.arrays.push(Use::default());
        Array(self.arrays.len() as u32 - 1)
    }

    /// Lanes of an array, of which the first is at `word`.
    pub fn lanes(&mut self, array: Array, word: u32) -> Value {
        if let Some(held) = self.held.get(&(array, word)) {
            return *held;
        }
        self.note_lanes(array, word);
        // Not one with an operation before: the lanes may have been stored to since, and dropped from what is known.
        let value = Value(self.push(Op::Lanes(array, word), &[]));
        self.held.insert((array, word), value);
        value
    }

    /// One word of an array for all lanes. Nothing in the block writes that array.
    pub fn word(&mut self, array: Array, word: u32) -> Value {
        self.note_words(array, word as usize + 1);
        Value(self.pure(Op::Word(array, word), &[]))
    }

    /// The same bits in all lanes.
    pub fn bits(&mut self, bits: u32) -> Value {
        Value(self.pure(Op::Constant(bits), &[]))
    }

    /// The same float in all lanes.
    pub fn float(&mut self, x: f32) -> Value {
        self.bits(x.to_bits())
    }

    /// For each lane the word that `index` (0 to 15) names of 16 words of an array from `word` on. Nothing in the block
    /// writes that array.
    pub fn look_up(&mut self, array: Array, word: u32, index: Value) -> Value {
        self.note_words(array, word as usize + 16);
        Value(self.pure(Op::LookUp(array, word), &[index.0]))
    }

    /// Has lanes of an array hold a value behind the block, if they are `kept`; and for what follows in the block.
    pub fn store(&mut self, array: Array, word: u32, value: Value, kept: bool) {
        self.held.insert((array, word), value);
        if kept {
            self.note_lanes(array, word);
            if let Some(used) = self.arrays.get_mut(array.0 as usize) {
                used.written = true;
            }
            self.push(Op::Store(array, word), &[value.0]);
        }
    }

    /// An operation on one value.
    pub fn unary(&mut self, op: Unary, a: Value) -> Value {
        Value(self.pure(Op::Unary(op), &[a.0]))
    }

    /// An operation on two values.
    pub fn binary(&mut self, op: Binary, a: Value, b: Value) -> Value {
        Value(self.pure(Op::Binary(op), &[a.0, b.0]))
    }

    /// `x + y z`, or with `less` `x - y z`, rounded once.
    pub fn fused(&mut self, x: Value, [y, z]: [Value; 2], less: bool) -> Value {
        Value(self.pure(Op::Fused { less }, &[x.0, y.0, z.0]))
    }

    /// Compares floats.
    pub fn compare(&mut self, how: Compare, a: Value, b: Value) -> Truth {
        Truth(self.pure(Op::Compare(how), &[a.0, b.0]))
    }

    /// Compares ints.
    pub fn compare_ints(&mut self, how: IntCompare, a: Value, b: Value) -> Truth {
        Truth(self.pure(Op::IntCompare(how), &[a.0, b.0]))
    }

    /// Whether bits of a value are set. Of a number made of a truth it is that truth.
    pub fn not_zero(&mut self, a: Value) -> Truth {
        match self.insts.get(a.0 as usize) {
            Some(Inst { op: Op::Number, args: [truth, ..], .. }) => Truth(*truth),
            _ => Truth(self.pure(Op::NotZero, &[a.0])),
        }
    }

    /// Whether floats are NaN or infinite, as far as asked for.
    pub fn class(&mut self, a: Value, nan: bool, infinite: bool) -> Truth {
        Truth(self.pure(Op::Class { nan, infinite }, &[a.0]))
    }

    /// Whether both are.
    pub fn both(&mut self, a: Truth, b: Truth) -> Truth {
        Truth(self.pure(Op::TruthAnd, &[a.0, b.0]))
    }

    /// Whether either is.
    pub fn either(&mut self, a: Truth, b: Truth) -> Truth {
        Truth(self.pure(Op::TruthOr, &[a.0, b.0]))
    }

    /// Whether it is not.
    pub fn not(&mut self, a: Truth) -> Truth {
        Truth(self.pure(Op::TruthNot, &[a.0]))
    }

    /// `yes` where the truth is, else `no`.
    pub fn choose(&mut self, truth: Truth, yes: Value, no: Value) -> Value {
        if yes == no {
            return yes;
        }
        Value(self.pure(Op::Choose, &[truth.0, yes.0, no.0]))
    }

    /// The length of a vector, whose `square` is the sum of its components' squares. Where that is below `2^-125`, which
    /// has lost bits, components are divided by the largest first: |largest| · √(Σ (component / largest)²), in this order
    /// of operations, and 0 where the largest is 0.
    pub fn length(&mut self, square: Value, [x, y, z]: [Value; 3]) -> Value {
        let root = self.unary(Unary::Sqrt, square);
        Value(self.pure(Op::Length, &[root.0, square.0, x.0, y.0, z.0]))
    }

    /// 1 where the truth is, else 0.
    pub fn number(&mut self, truth: Truth) -> Value {
        Value(self.pure(Op::Number, &[truth.0]))
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
        let inst = inst(op, list);
        if let Some(known) = self.known.get(&inst) {
            return *known;
        }
        let number = self.push(op, list);
        self.known.insert(inst, number);
        number
    }

    fn push(&mut self, op: Op, list: &[u32]) -> u32 {
        self.insts.push(inst(op, list));
        self.insts.len() as u32 - 1
    }
}

fn inst(op: Op, list: &[u32]) -> Inst {
    let mut args = [0; 5];
    args.iter_mut().zip(list).for_each(|(to, from)| *to = *from);
    Inst { op, args, count: list.len() as u8 }
}
