//! Random blocks with their models.

use crate::model::{
    BINARY, COMPARE, INT_COMPARE, UNARY, binary, compare, compare_ints, length, number, unary,
};
use osl_native::{Array, Binary, Block, MaskValue, Value};

/// A block with its model: the value of each `Value` and `MaskValue` in every lane, unless a NaN was computed
/// on the way, whose bits are unspecified.
pub(crate) struct Both {
    pub(crate) block: Block,
    lanes: usize,
    pub(crate) values: Vec<(Value, Vec<Option<u32>>)>,
    masks: Vec<(MaskValue, Vec<Option<bool>>)>,
    /// The array of lanes, as the block leaves it.
    pub(crate) memory: Vec<Option<u32>>,
    /// Positions of the array that the block need not keep.
    pub(crate) loose: Vec<bool>,
    array: Array,
    table: Array,
    words: Vec<u32>,
}

pub(crate) const PLACES: usize = 12;

impl Both {
    pub(crate) fn new(start: &[u32], words: &[u32], lanes: usize) -> Both {
        let mut block = Block::new();
        let (array, table) = (block.array(), block.array());
        Both {
            block,
            lanes,
            values: Vec::new(),
            masks: Vec::new(),
            memory: start.iter().copied().map(Some).collect(),
            loose: vec![false; PLACES],
            array,
            table,
            words: words.to_vec(),
        }
    }

    /// Adds an operation chosen by numbers.
    pub(crate) fn add(&mut self, [what, how, a, b, c]: [usize; 5]) {
        let lanes = self.lanes;
        let place = a % PLACES;
        let pick = |at: usize| self.values.get(at % self.values.len().max(1)).cloned();
        let mask = |at: usize| self.masks.get(at % self.masks.len().max(1)).cloned();
        let one = |f: &dyn Fn(usize) -> Option<u32>| (0..lanes).map(f).collect::<Vec<_>>();
        let is = |f: &dyn Fn(usize) -> Option<bool>| (0..lanes).map(f).collect::<Vec<_>>();
        match what % 18 {
            0 => {
                let value = self.block.lanes(self.array, (place * lanes) as u32);
                self.values.push((value, self.memory[place * lanes..][..lanes].to_vec()));
            }
            1 => {
                let at = a % self.words.len();
                let value = self.block.word(self.table, at as u32);
                self.values.push((value, vec![Some(self.words[at]); lanes]));
            }
            2 => {
                let value = self.block.bits(a as u32);
                self.values.push((value, vec![Some(a as u32); lanes]));
            }
            3 => {
                if let Some((v, model)) = pick(a) {
                    let fifteen = self.block.bits(15);
                    let index = self.block.binary(Binary::And, v, fifteen);
                    let value = self.block.look_up(self.table, 3, index);
                    let words = &self.words;
                    self.values.push((value, one(&|i| Some(words[3 + (model[i]? & 15) as usize]))));
                }
            }
            4 => {
                if let Some((v, model)) = pick(b) {
                    let kept = how % 3 > 0;
                    self.block.store(self.array, (place * lanes) as u32, v, kept);
                    self.memory[place * lanes..][..lanes].copy_from_slice(&model);
                    self.loose[place] = !kept;
                }
            }
            5 | 6 => {
                if let Some((v, model)) = pick(a) {
                    let op = UNARY[how % UNARY.len()];
                    self.values.push((self.block.unary(op, v), one(&|i| number(unary(op, model[i]?)))));
                }
            }
            7 | 8 => {
                if let (Some((v, p)), Some((w, q))) = (pick(a), pick(b)) {
                    let how = COMPARE[how % COMPARE.len()];
                    let mask = self.block.compare(how, v, w);
                    self.masks.push((mask, is(&|i| Some(compare(how, p[i]?, q[i]?)))));
                }
            }
            9 => {
                if let (Some((v, p)), Some((w, q))) = (pick(a), pick(b)) {
                    let how = INT_COMPARE[how % INT_COMPARE.len()];
                    let mask = self.block.compare_ints(how, v, w);
                    self.masks.push((mask, is(&|i| Some(compare_ints(how, p[i]?, q[i]?)))));
                }
            }
            10 => {
                if let Some((v, p)) = pick(a) {
                    let (nan, infinite) = (how % 3 != 0, how % 3 != 1);
                    let mask = match how % 4 {
                        0 => {
                            let mask = self.block.not_zero(v);
                            self.masks.push((mask, is(&|i| Some(p[i]? != 0))));
                            return;
                        }
                        _ => self.block.class(v, nan, infinite),
                    };
                    let float = |i: usize| p[i].map(f32::from_bits);
                    self.masks.push((
                        mask,
                        is(&|i| Some(nan && float(i)?.is_nan() || infinite && float(i)?.is_infinite())),
                    ));
                }
            }
            11 => {
                if let (Some((s, p)), Some((t, q))) = (mask(a), mask(b)) {
                    let (mask, model) = match how % 3 {
                        0 => (self.block.both(s, t), is(&|i| Some(p[i]? & q[i]?))),
                        1 => (self.block.either(s, t), is(&|i| Some(p[i]? | q[i]?))),
                        _ => (self.block.not(s), is(&|i| Some(!p[i]?))),
                    };
                    self.masks.push((mask, model));
                }
            }
            12 => {
                if let Some((t, p)) = mask(a) {
                    self.values.push((self.block.number(t), one(&|i| Some(u32::from(p[i]?)))));
                }
            }
            17 => {
                if let (Some((v, p)), Some((w, q)), Some((s, r))) = (pick(a), pick(b), pick(c)) {
                    let less = how % 2 == 0;
                    let value = self.block.fused(v, [w, s], less);
                    let of = |i: usize| {
                        let [x, y, z] = [p[i]?, q[i]?, r[i]?].map(f32::from_bits);
                        number((if less { -y } else { y }).mul_add(z, x).to_bits())
                    };
                    self.values.push((value, one(&of)));
                }
            }
            16 => {
                if let (Some((v, p)), Some((w, q)), Some((s, r))) = (pick(a), pick(b), pick(c)) {
                    let block = &mut self.block;
                    let [v2, w2, s2] = [v, w, s].map(|x| block.binary(Binary::Mul, x, x));
                    let sum = block.binary(Binary::Add, v2, w2);
                    let square = block.binary(Binary::Add, sum, s2);
                    let value = block.length(square, [v, w, s]);
                    let of = |i: usize| number(length([p[i]?, q[i]?, r[i]?]));
                    self.values.push((value, one(&of)));
                }
            }
            13 => {
                if let (Some((t, p)), Some((v, q)), Some((w, r))) = (mask(a), pick(b), pick(c)) {
                    let value = self.block.choose(t, v, w);
                    self.values.push((value, one(&|i| if p[i]? { q[i] } else { r[i] })));
                }
            }
            _ => {
                if let (Some((v, p)), Some((w, q))) = (pick(a), pick(b)) {
                    let op = BINARY[how % BINARY.len()];
                    self.values
                        .push((self.block.binary(op, v, w), one(&|i| number(binary(op, p[i]?, q[i]?)))));
                }
            }
        }
    }
}
