//! The lane operations as vector operations: a recorder runs the bodies of the list on numbers that are nodes
//! of a block.
//!
//! The numbers, in `number`, implement the traits of the arithmetic. So an operation has machine code
//! without a line here. The exceptions are bodies that need values ([`osl_numeric::Real::by_value`]) or
//! double precision: their results are missing, and the interpreter runs these operations. This module must
//! not know what a body computes.

mod number;

use super::Style;
use number::{Float, Integer, Item, Word};
use osl_ir::ir::LaneOp;
use osl_native::{Block, Value};
use osl_numeric::fast::FastFloat;
use std::cell::RefCell;
use std::sync::LazyLock;

/// Whether an operation can be recorded.
pub(super) fn is_known(op: LaneOp, style: Style) -> bool {
    static STRICT: LazyLock<Vec<LaneOp>> = LazyLock::new(|| known(Style::Strict));
    static FAST: LazyLock<Vec<LaneOp>> = LazyLock::new(|| known(Style::Fast));
    let known = if style == Style::Strict { &STRICT } else { &FAST };
    known.binary_search(&op).is_ok()
}

fn known(style: Style) -> Vec<LaneOp> {
    let is_known = |op: &LaneOp| {
        let mut block = Block::new();
        let array = block.array();
        let words = op.shape().args.iter().map(|kind| kind.words()).sum();
        let args: Vec<Value> = (0..words).map(|word| block.word(array, word)).collect();
        operation(&mut block, *op, &args, style).is_some()
    };
    LaneOp::ALL.iter().copied().filter(is_known).collect()
}

/// Adds an operation to a block; the words of its arguments are given in sequence. Returns the words of its
/// result, or `None` for an operation that cannot be recorded.
pub(super) fn operation(block: &mut Block, op: LaneOp, args: &[Value], style: Style) -> Option<Vec<Value>> {
    let cell = RefCell::new(std::mem::take(block));
    let result = {
        let item = |value: &Value| match cell.borrow().constant(*value) {
            Some(bits) => Item::Constant(bits),
            None => Item::Node(&cell, *value),
        };
        let mut words = args.iter().map(item);
        match style {
            Style::Strict => strict(op, &mut words),
            Style::Fast => fast(op, &mut words),
        }
        .and_then(|words| words.into_iter().map(|word| word.value(&mut cell.borrow_mut())).collect())
    };
    *block = cell.into_inner();
    result
}

/// A recorded float of the fast arithmetic.
type RecordedFastFloat<'a> = FastFloat<true, Float<'a>>;

/// An argument or a result of a body.
trait BodyValue<'a>: Copy {
    /// The argument that consists of the next words.
    fn take(words: &mut impl Iterator<Item = Word<'a>>) -> Option<Self>;
    /// Appends the words of a result.
    fn put(self, words: &mut Vec<Word<'a>>);
}

macro_rules! parts {
    ($($ty:ty: $x:ident => $word:expr, $of:expr;)*) => {$(
        impl<'a> BodyValue<'a> for $ty {
            fn take(words: &mut impl Iterator<Item = Word<'a>>) -> Option<Self> {
                words.next().map($of)
            }
            fn put(self, words: &mut Vec<Word<'a>>) {
                let $x = self;
                words.push($word);
            }
        }
    )*};
}

parts! {
    Float<'a>: x => x.0, Float;
    Integer<'a>: x => x.0, Integer;
    RecordedFastFloat<'a>: x => x.0.0, |word| FastFloat(Float(word));
}

impl<'a, T: BodyValue<'a>, const N: usize> BodyValue<'a> for [T; N] {
    fn take(words: &mut impl Iterator<Item = Word<'a>>) -> Option<Self> {
        let mut all = [T::take(words)?; N];
        for part in all.iter_mut().skip(1) {
            *part = T::take(words)?;
        }
        Some(all)
    }
    fn put(self, words: &mut Vec<Word<'a>>) {
        self.into_iter().for_each(|part| part.put(words));
    }
}

macro_rules! part {
    ($real:ident F) => {
        $real<'_>
    };
    ($real:ident T) => {
        [$real<'_>; 3]
    };
    ($real:ident M) => {
        [$real<'_>; 16]
    };
    ($real:ident $int:ident) => {
        Integer<'_>
    };
}

/// The body of an operation on a kind of number. The words of its result are returned from the function.
macro_rules! run {
    ($real:ident, $words:ident, $path:path, ($($arg:ident),*) -> $ret:ident) => {{
        let result: part!($real $ret) = $path($(<part!($real $arg)>::take($words)?),*);
        let mut results = Vec::new();
        result.put(&mut results);
        Some(results)
    }};
}

/// The same in the fast arithmetic, if it differs there.
macro_rules! run_in_fast {
    (strict, $op:ident, $words:ident, $($rest:tt)*) => {
        strict($op, $words)
    };
    ($precision:ident, $op:ident, $words:ident, $($rest:tt)*) => {
        run!(RecordedFastFloat, $words, $($rest)*)
    };
}

macro_rules! stamp {
    ($($name:ident $text:literal $class:ident ($($arg:ident),*) -> $ret:ident, $module:ident::$body:ident,
        $cost:ident $continuity:ident $precision:ident $domain:ident, $derivative:ident;)*) => {
        /// The words of the result of an operation in the strict arithmetic; `None` for too few arguments.
        fn strict<'a>(op: LaneOp, words: &mut impl Iterator<Item = Word<'a>>) -> Option<Vec<Word<'a>>> {
            match op {
                $(LaneOp::$name => run!(Float, words, osl_numeric::$module::$body, ($($arg),*) -> $ret)),*
            }
        }

        /// The same in the fast arithmetic.
        fn fast<'a>(op: LaneOp, words: &mut impl Iterator<Item = Word<'a>>) -> Option<Vec<Word<'a>>> {
            match op {
                $(LaneOp::$name => run_in_fast!(
                    $precision, op, words, osl_numeric::$module::$body, ($($arg),*) -> $ret)),*
            }
        }
    };
}

osl_numeric::for_each_lane_op!(stamp);
