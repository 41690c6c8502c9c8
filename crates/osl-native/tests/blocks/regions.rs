//! Random blocks with loops and skipped parts, nested in each other. Floats are only compared, subtracted and
//! chosen, so that a NaN has the same bits however the block runs. This module must not know code.

use super::{Array, Binary, Block, Compare, IntCompare, MaskValue, Next, Unary, Value};

/// The depth of nested regions.
const DEPTH: u32 = 3;

struct Writer<'a> {
    block: Block,
    numbers: std::slice::Iter<'a, u32>,
    lanes: usize,
    from: Array,
    table: Array,
    /// Accessed at offsets only.
    moving: Array,
    values: Vec<Value>,
    masks: Vec<MaskValue>,
}

/// A block that is chosen by numbers: it reads five places of its first array and twenty words of the second,
/// and writes to the third. The fourth has as much as the first, and is read and written at offsets.
pub(crate) fn block(numbers: &[u32], lanes: usize) -> Block {
    let mut block = Block::new();
    let (from, table, to, moving) = (block.array(), block.array(), block.array(), block.array());
    let values = vec![block.lanes(from, 0), block.word(table, 1)];
    let masks = vec![block.not_zero(values[0])];
    let mut writer = Writer { block, numbers: numbers.iter(), lanes, from, table, moving, values, masks };
    writer.all(0, usize::MAX);
    let Writer { mut block, values, masks, .. } = writer;
    let numbers = masks.iter().map(|mask| block.number(*mask)).collect::<Vec<_>>();
    for (at, value) in values.iter().chain(&numbers).rev().take(300).enumerate() {
        block.store(to, (at * lanes) as u32, *value, true);
    }
    block
}

impl Writer<'_> {
    fn number(&mut self) -> Option<usize> {
        self.numbers.next().map(|n| *n as usize)
    }

    fn value(&mut self) -> Value {
        // Mostly recent values.
        let n = self.number().unwrap_or(0);
        let back =
            if n.is_multiple_of(4) { n / 4 % self.values.len() } else { n / 4 % self.values.len().min(6) };
        self.values[self.values.len() - 1 - back]
    }

    fn mask(&mut self) -> MaskValue {
        let n = self.number().unwrap_or(0);
        self.masks[n % self.masks.len()]
    }

    /// Writes up to a number of operations.
    fn all(&mut self, depth: u32, most: usize) {
        for _ in 0..most {
            let Some(what) = self.number() else { return };
            self.one(what, depth);
        }
    }

    fn one(&mut self, what: usize, depth: u32) {
        let (x, y) = (self.value(), self.value());
        let place = (what / 64 % 5 * self.lanes) as u32;
        match what % 24 {
            0 => {
                let value = self.block.lanes(self.from, place);
                self.values.push(value);
            }
            1 => {
                let value = self.block.word(self.table, what as u32 / 64 % 20);
                self.values.push(value);
            }
            2 => {
                let value = self.block.bits(what as u32 / 64);
                self.values.push(value);
            }
            3 => {
                let fifteen = self.block.bits(15);
                let index = self.block.binary(Binary::And, x, fifteen);
                let value = self.block.look_up(self.table, 2, index);
                self.values.push(value);
            }
            4 => self.masks.push(self.block.compare(Compare::LessOrNan, x, y)),
            5 => self.masks.push(self.block.compare_ints(IntCompare::Less, x, y)),
            6 => {
                let (a, b) = (self.mask(), self.mask());
                let mask = match what / 64 % 3 {
                    0 => self.block.both(a, b),
                    1 => self.block.either(a, b),
                    _ => self.block.not(a),
                };
                self.masks.push(mask);
            }
            7 | 8 => {
                let mask = self.mask();
                let value = self.block.choose(mask, x, y);
                self.values.push(value);
            }
            9 => {
                let value = self.block.unary(Unary::IntAbs, x);
                self.values.push(value);
            }
            14 => {
                let offset = self.row(what / 64);
                let value = self.block.lanes_at(self.moving, 0, offset, 4 * self.lanes as u32);
                self.values.push(value);
            }
            15 if depth == 0 => {
                let offset = self.row(what / 64);
                self.block.store_at(self.moving, 0, (offset, 4 * self.lanes as u32), x);
            }
            16 => {
                let value = self.block.gather(self.table, 4, x, 15);
                self.values.push(value);
            }
            10 | 11 if depth < DEPTH => self.repeat(depth, what / 64),
            12 | 13 if depth < DEPTH => self.skip(depth, what / 64),
            _ => {
                let op =
                    [Binary::Min, Binary::IntAdd, Binary::Xor, Binary::IntMul, Binary::IntSub, Binary::Shr];
                let value = self.block.binary(op[what / 64 % op.len()], x, y);
                self.values.push(value);
            }
        }
    }

    /// The offset of a row of lanes, the same in all lanes of a vector.
    fn row(&mut self, what: usize) -> Value {
        let (word, three) = (self.block.word(self.table, what as u32 % 20), self.block.bits(3));
        let (row, lanes) = (self.block.binary(Binary::And, word, three), self.block.bits(self.lanes as u32));
        self.block.binary(Binary::IntMul, row, lanes)
    }

    /// A loop whose lanes take up to seven rounds.
    fn repeat(&mut self, depth: u32, what: usize) {
        let limit = self.value();
        let seven = self.block.bits(7);
        let limit = self.block.binary(Binary::And, limit, seven);
        let (zero, one) = (self.block.bits(0), self.block.bits(1));
        let mut inits = vec![zero];
        inits.extend((0..what % 4).map(|_| self.value()));
        let active = self.mask();
        let (values, masks) = (self.values.len(), self.masks.len());
        let begun = self.block.begin_loop(active, &inits, 3);
        self.values.extend(&begun.values);
        self.masks.push(begun.active);
        self.all(depth + 1, 3 + what / 4 % 24);
        let counter = self.block.binary(Binary::IntAdd, begun.values[0], one);
        let mut again = self.block.compare_ints(IntCompare::Less, counter, limit);
        if (what / 128).is_multiple_of(2) {
            let other = self.mask();
            again = self.block.both(again, other);
        }
        // The counter need not be kept, if nothing reads it after the loop.
        let kept = (what / 256).is_multiple_of(2);
        let mut next = vec![Next { value: counter, kept }];
        next.extend((1..inits.len()).map(|_| Next { value: self.value(), kept: true }));
        self.values.truncate(values);
        self.masks.truncate(masks);
        let results = self.block.end_loop(&begun, &next, again);
        self.values.extend(&results[usize::from(!kept)..]);
    }

    /// A part that only the lanes of a mask need.
    fn skip(&mut self, depth: u32, what: usize) {
        let mask = self.mask();
        let inits: Vec<Value> = (0..1 + what % 3).map(|_| self.value()).collect();
        let (values, masks) = (self.values.len(), self.masks.len());
        self.block.begin_skip(mask, &inits, 2);
        self.all(depth + 1, 3 + what / 4 % 24);
        let next: Vec<Value> = inits.iter().map(|_| self.value()).collect();
        self.values.truncate(values);
        self.masks.truncate(masks);
        let results = self.block.end_skip(&next);
        for (result, init) in results.iter().zip(inits) {
            let value = self.block.choose(mask, *result, init);
            self.values.push(value);
        }
    }
}
