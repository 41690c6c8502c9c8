//! The vocabulary of blocks: values, masks, arrays, the operations on them, and regions, without the rules by
//! which a block merges and rewrites them.

/// Number of words in a table. Indices are below it.
pub const TABLE: usize = 16;

/// A value: a word for each lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Value(pub(crate) u32);

/// A mask: true or false for each lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaskValue(pub(crate) u32);

/// An array of words, provided by the caller of the code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Array(pub(crate) u32);

/// An operation on two values.
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
    /// The first float if it is smaller, else the second (also for NaN and for zeros of either sign).
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
    /// The smaller word, as an unsigned number.
    WordMin,
    /// Bitwise and.
    And,
    /// Bitwise or.
    Or,
    /// Bitwise exclusive or.
    Xor,
    /// Shift left; 0 for shifts of 32 or more.
    Shl,
    /// Arithmetic shift right.
    Shr,
}

impl Binary {
    /// Whether the operands may change places.
    pub(crate) fn commutes(self) -> bool {
        use Binary::{Div, IntSub, Min, Shl, Shr, Sub};
        !matches!(self, Sub | Div | Min | IntSub | Shl | Shr)
    }
}

/// An operation on one value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unary {
    /// The square root of a float.
    Sqrt,
    /// 1 divided by the square root of a nonzero float; both operations are rounded.
    InverseRoot,
    /// The largest whole float that is not larger.
    Floor,
    /// The smallest whole float that is not smaller.
    Ceil,
    /// The float without its fraction.
    Trunc,
    /// The float of an int.
    ToFloat,
    /// Converts a float to an int by truncation; `i32::MIN` if it does not fit.
    ToInt,
    /// The absolute value of an int.
    IntAbs,
    /// The upper half of the product, of 64 bits, of an int and this one.
    HighProduct(i32),
}

/// A comparison of floats. Those that end in `OrNan` are true for NaN.
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

/// A comparison of ints.
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
    /// Lanes of an array, starting at a word.
    Lanes(Array, u32),
    /// A word of an array.
    Word(Array, u32),
    Constant(u32),
    Unary(Unary),
    Binary(Binary),
    /// A word from a table, by an index.
    LookUp(Array, u32),
    /// Lanes of an array, starting a number of words after a word.
    LanesAt(Array, u32),
    /// A word of an array for each lane, a number of words after a word.
    Gather(Array, u32),
    Compare(Compare),
    IntCompare(IntCompare),
    /// Whether any bit is set.
    NotZero,
    /// Whether a float is NaN (if `nan`) or infinite (if `infinite`).
    Class {
        nan: bool,
        infinite: bool,
    },
    MaskAnd,
    MaskOr,
    MaskNot,
    /// The first value where the mask is set, else the second.
    Choose,
    /// The first value plus, or minus, the product of the others, rounded once.
    Fused {
        less: bool,
    },
    /// The length of a vector. The second value is the sum of the squares of its components and the first is
    /// the root of that sum. If the squares are too small, the vector is scaled by its largest component.
    Length,
    /// 1 where the mask is set, else 0.
    Number,
    Store(Array, u32),
    /// Like [`Op::LanesAt`].
    StoreAt(Array, u32),
    /// The start of a region, by its number; its arguments are those of the region.
    Begin(u32),
    /// A value that a region carries: in the current round, or after its end.
    Carried {
        mask: bool,
    },
    /// The end of a region.
    End(u32),
    /// Stops the code if any lane is set.
    Stop,
}

impl Op {
    /// Whether its result is in memory already.
    pub(crate) fn is_source(self) -> bool {
        matches!(self, Op::Lanes(..) | Op::Word(..) | Op::Constant(_))
    }

    /// Whether all its operands are masks.
    pub(crate) fn takes_mask(self) -> bool {
        matches!(self, Op::MaskAnd | Op::MaskOr | Op::MaskNot | Op::Number)
    }

    /// Whether it does something besides its result.
    pub(crate) fn has_effect(self) -> bool {
        matches!(self, Op::Store(..) | Op::StoreAt(..) | Op::Begin(_) | Op::End(_) | Op::Stop)
    }

    /// Whether its result depends on when it runs.
    pub(crate) fn reads_stored(self) -> bool {
        matches!(self, Op::LanesAt(..) | Op::Gather(..))
    }

    /// The array that it reads or writes.
    pub(crate) fn array(self) -> Option<Array> {
        match self {
            Op::Lanes(a, _) | Op::Word(a, _) | Op::LookUp(a, _) | Op::Store(a, _) => Some(a),
            Op::LanesAt(a, _) | Op::Gather(a, _) | Op::StoreAt(a, _) => Some(a),
            _ => None,
        }
    }

    /// Whether its result is a mask.
    pub(crate) fn is_mask(self) -> bool {
        use Op::{Carried, Class, Compare, IntCompare, MaskAnd, MaskNot, MaskOr, NotZero};
        matches!(
            self,
            Compare(_)
                | IntCompare(_)
                | NotZero
                | Class { .. }
                | MaskAnd
                | MaskOr
                | MaskNot
                | Carried { mask: true }
        )
    }
}

/// An operation and its arguments, given by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Inst {
    pub(crate) op: Op,
    args: [u32; 5],
    count: u8,
}

impl Inst {
    /// An operation on at most five values.
    pub(crate) fn new(op: Op, list: &[u32]) -> Inst {
        let mut args = [0; 5];
        args.iter_mut().zip(list).for_each(|(to, from)| *to = *from);
        Inst { op, args, count: list.len() as u8 }
    }

    pub(crate) fn args(&self) -> &[u32] {
        &self.args[..usize::from(self.count)]
    }

    /// The operation with other numbers for its arguments.
    pub(crate) fn renamed(&self, name: impl Fn(u32) -> u32) -> Inst {
        let mut inst = *self;
        inst.args.iter_mut().take(usize::from(self.count)).for_each(|v| *v = name(*v));
        inst
    }
}

/// How control enters and leaves a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Repeats while a mask, given at the end, has a lane.
    Loop,
    /// Runs once, or not at all if a mask has no lane.
    Skip { mask: u32 },
}

/// A value that a region carries, by the numbers of its operations.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Carry {
    pub(crate) init: u32,
    /// In the current round.
    pub(crate) param: u32,
    /// In the next round.
    pub(crate) next: u32,
    /// After the region.
    pub(crate) result: u32,
}

/// A region, from one operation to another.
#[derive(Clone, Debug)]
pub(crate) struct Region {
    pub(crate) kind: Kind,
    /// What a round takes from the budget.
    pub(crate) cost: u32,
    pub(crate) begin: u32,
    pub(crate) end: u32,
    pub(crate) carried: Vec<Carry>,
    /// The mask that decides about the next round of a loop.
    pub(crate) again: u32,
}

impl Carry {
    /// Whether anything reads it.
    pub(crate) fn is_needed(&self, needed: &[bool]) -> bool {
        [self.param, self.result].iter().any(|v| needed.get(*v as usize) == Some(&true))
    }
}
