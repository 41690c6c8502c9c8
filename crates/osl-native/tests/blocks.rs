//! Blocks compute what they say: each operation on extremes, and long random blocks against one lane at a time.

#![allow(clippy::unwrap_used, clippy::expect_used, missing_docs, reason = "a test says what must hold")]

use osl_native::{Array, Binary, Block, Code, Compare, IntCompare, Scratch, Truth, Unary, Value, Words};
use proptest::prelude::*;

const BINARY: [Binary; 15] = [
    Binary::Add,
    Binary::Sub,
    Binary::Mul,
    Binary::Div,
    Binary::Min,
    Binary::IntAdd,
    Binary::IntSub,
    Binary::IntMul,
    Binary::IntMin,
    Binary::IntMax,
    Binary::And,
    Binary::Or,
    Binary::Xor,
    Binary::Shl,
    Binary::Shr,
];

const UNARY: [Unary; 8] = [
    Unary::Sqrt,
    Unary::InverseRoot,
    Unary::Floor,
    Unary::Ceil,
    Unary::Trunc,
    Unary::ToFloat,
    Unary::ToInt,
    Unary::IntAbs,
];

const COMPARE: [Compare; 11] = [
    Compare::Equal,
    Compare::Less,
    Compare::LessEqual,
    Compare::GreaterEqual,
    Compare::Greater,
    Compare::EqualOrNan,
    Compare::UnequalOrNan,
    Compare::LessOrNan,
    Compare::LessEqualOrNan,
    Compare::GreaterEqualOrNan,
    Compare::GreaterOrNan,
];

const INT_COMPARE: [IntCompare; 4] =
    [IntCompare::Equal, IntCompare::Less, IntCompare::LessEqual, IntCompare::Unequal];

/// Every NaN is one: which one an operation on two makes is nobody's promise.
fn plain(x: f32) -> u32 {
    if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() }
}

fn binary(op: Binary, a: u32, b: u32) -> u32 {
    let (x, y) = (f32::from_bits(a), f32::from_bits(b));
    let (i, j) = (a as i32, b as i32);
    match op {
        Binary::Add => plain(x + y),
        Binary::Sub => plain(x - y),
        Binary::Mul => plain(x * y),
        Binary::Div => plain(x / y),
        Binary::Min => {
            if x < y {
                a
            } else {
                b
            }
        }
        Binary::IntAdd => i.wrapping_add(j) as u32,
        Binary::IntSub => i.wrapping_sub(j) as u32,
        Binary::IntMul => i.wrapping_mul(j) as u32,
        Binary::IntMin => i.min(j) as u32,
        Binary::IntMax => i.max(j) as u32,
        Binary::And => a & b,
        Binary::Or => a | b,
        Binary::Xor => a ^ b,
        Binary::Shl => a.checked_shl(b).unwrap_or(0),
        Binary::Shr => (i >> b.min(31)) as u32,
    }
}

fn unary(op: Unary, a: u32) -> u32 {
    let x = f32::from_bits(a);
    match op {
        Unary::Sqrt => plain(x.sqrt()),
        // That of zero is nobody's: told as what is not compared.
        Unary::InverseRoot if x == 0.0 => f32::NAN.to_bits(),
        Unary::InverseRoot => plain(1.0 / x.sqrt()),
        Unary::Floor => plain(x.floor()),
        Unary::Ceil => plain(x.ceil()),
        Unary::Trunc => plain(x.trunc()),
        Unary::ToFloat => (a as i32 as f32).to_bits(),
        Unary::ToInt => {
            let fits = x > -2_147_483_904.0 && x < 2_147_483_648.0;
            if fits { x as i32 as u32 } else { i32::MIN as u32 }
        }
        Unary::IntAbs => (a as i32).wrapping_abs() as u32,
    }
}

/// A word unless it is NaN.
fn number(word: u32) -> Option<u32> {
    (!f32::from_bits(word).is_nan()).then_some(word)
}

fn length(v: [u32; 3]) -> u32 {
    let [x, y, z] = v.map(|x| f32::from_bits(x).abs());
    let square = x * x + y * y + z * z;
    let largest = if x < y { y } else { x };
    let largest = if largest < z { z } else { largest };
    let [p, q, r] = [x, y, z].map(|x| x / largest);
    let rescued = if largest == 0.0 { 0.0 } else { largest * (p * p + q * q + r * r).sqrt() };
    plain(if square < f32::from_bits(0x0100_0000) { rescued } else { square.sqrt() })
}

fn compare(how: Compare, a: u32, b: u32) -> bool {
    let (x, y) = (f32::from_bits(a), f32::from_bits(b));
    let nan = x.is_nan() || y.is_nan();
    match how {
        Compare::Equal => x == y,
        Compare::Less => x < y,
        Compare::LessEqual => x <= y,
        Compare::GreaterEqual => x >= y,
        Compare::Greater => x > y,
        Compare::EqualOrNan => x == y || nan,
        Compare::UnequalOrNan => x != y,
        Compare::LessOrNan => x < y || nan,
        Compare::LessEqualOrNan => x <= y || nan,
        Compare::GreaterEqualOrNan => x >= y || nan,
        Compare::GreaterOrNan => x > y || nan,
    }
}

fn compare_ints(how: IntCompare, a: u32, b: u32) -> bool {
    let (i, j) = (a as i32, b as i32);
    match how {
        IntCompare::Equal => i == j,
        IntCompare::Less => i < j,
        IntCompare::LessEqual => i <= j,
        IntCompare::Unequal => i != j,
    }
}

/// A block beside its model: what each value and truth is in every lane, as long as no NaN was computed on the way there:
/// nobody promises its bits.
struct Both {
    block: Block,
    lanes: usize,
    values: Vec<(Value, Vec<Option<u32>>)>,
    truths: Vec<(Truth, Vec<Option<bool>>)>,
    /// The array of lanes, as it is behind what has been said.
    memory: Vec<Option<u32>>,
    /// Those places of it whose lanes the block need not keep.
    loose: Vec<bool>,
    array: Array,
    table: Array,
    words: Vec<u32>,
}

const PLACES: usize = 12;

impl Both {
    fn new(start: &[u32], words: &[u32], lanes: usize) -> Both {
        let mut block = Block::new();
        let (array, table) = (block.array(), block.array());
        Both {
            block,
            lanes,
            values: Vec::new(),
            truths: Vec::new(),
            memory: start.iter().copied().map(Some).collect(),
            loose: vec![false; PLACES],
            array,
            table,
            words: words.to_vec(),
        }
    }

    /// Adds an operation that numbers choose.
    fn add(&mut self, [what, how, a, b, c]: [usize; 5]) {
        let lanes = self.lanes;
        let place = a % PLACES;
        let pick = |at: usize| self.values.get(at % self.values.len().max(1)).cloned();
        let truth = |at: usize| self.truths.get(at % self.truths.len().max(1)).cloned();
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
                    let truth = self.block.compare(how, v, w);
                    self.truths.push((truth, is(&|i| Some(compare(how, p[i]?, q[i]?)))));
                }
            }
            9 => {
                if let (Some((v, p)), Some((w, q))) = (pick(a), pick(b)) {
                    let how = INT_COMPARE[how % INT_COMPARE.len()];
                    let truth = self.block.compare_ints(how, v, w);
                    self.truths.push((truth, is(&|i| Some(compare_ints(how, p[i]?, q[i]?)))));
                }
            }
            10 => {
                if let Some((v, p)) = pick(a) {
                    let (nan, infinite) = (how % 3 != 0, how % 3 != 1);
                    let truth = match how % 4 {
                        0 => {
                            let truth = self.block.not_zero(v);
                            self.truths.push((truth, is(&|i| Some(p[i]? != 0))));
                            return;
                        }
                        _ => self.block.class(v, nan, infinite),
                    };
                    let float = |i: usize| p[i].map(f32::from_bits);
                    self.truths.push((
                        truth,
                        is(&|i| Some(nan && float(i)?.is_nan() || infinite && float(i)?.is_infinite())),
                    ));
                }
            }
            11 => {
                if let (Some((s, p)), Some((t, q))) = (truth(a), truth(b)) {
                    let (truth, model) = match how % 3 {
                        0 => (self.block.both(s, t), is(&|i| Some(p[i]? & q[i]?))),
                        1 => (self.block.either(s, t), is(&|i| Some(p[i]? | q[i]?))),
                        _ => (self.block.not(s), is(&|i| Some(!p[i]?))),
                    };
                    self.truths.push((truth, model));
                }
            }
            12 => {
                if let Some((t, p)) = truth(a) {
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
                if let (Some((t, p)), Some((v, q)), Some((w, r))) = (truth(a), pick(b), pick(c)) {
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

/// Words equal, or NaN both.
fn alike(a: u32, b: u32) -> bool {
    a == b || f32::from_bits(a).is_nan() && f32::from_bits(b).is_nan()
}

fn extremes() -> Vec<u32> {
    let floats = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        -0.5,
        1.5,
        2.5,
        0.49999997,
        3.7,
        -3.7,
        8388607.5,
        -8388607.5,
        16777216.0,
        2147483520.0,
        2147483648.0,
        -2147483648.0,
        -2147483904.0,
        1e-40,
        f32::MIN_POSITIVE,
        f32::MAX,
        f32::MIN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
    ];
    floats.iter().map(|x| x.to_bits()).chain([1, 2, 31, 32, 33, 0x7FFF_FFFF, 0x8000_0000, u32::MAX]).collect()
}

#[test]
fn every_operation_holds_at_the_extremes() {
    if !osl_native::is_supported() {
        return;
    }
    let list = extremes();
    let pairs: Vec<(u32, u32)> = list.iter().flat_map(|a| list.iter().map(|b| (*a, *b))).collect();
    let lanes = pairs.len().next_multiple_of(16);
    let mut inputs = vec![0; 2 * lanes];
    for (at, (a, b)) in pairs.iter().enumerate() {
        (inputs[at], inputs[lanes + at]) = (*a, *b);
    }
    let mut block = Block::new();
    let (from, to) = (block.array(), block.array());
    let (a, b) = (block.lanes(from, 0), block.lanes(from, lanes as u32));
    let mut models: Vec<Box<dyn Fn(u32, u32) -> u32>> = Vec::new();
    let mut results = Vec::new();
    for op in BINARY {
        results.push(block.binary(op, a, b));
        models.push(Box::new(move |a, b| binary(op, a, b)));
    }
    for op in UNARY {
        results.push(block.unary(op, a));
        models.push(Box::new(move |a, _| unary(op, a)));
    }
    for how in COMPARE {
        let truth = block.compare(how, a, b);
        results.push(block.number(truth));
        models.push(Box::new(move |a, b| u32::from(compare(how, a, b))));
    }
    for how in INT_COMPARE {
        let truth = block.compare_ints(how, a, b);
        results.push(block.number(truth));
        models.push(Box::new(move |a, b| u32::from(compare_ints(how, a, b))));
    }
    for (at, result) in results.iter().enumerate() {
        block.store(to, (at * lanes) as u32, *result, true);
    }
    let code = Code::new(&block).unwrap();
    let mut out = vec![0; results.len() * lanes];
    assert!(code.run([Words::Read(&inputs), Words::Write(&mut out)], 0..lanes, &mut Scratch::default()));
    for (at, model) in models.iter().enumerate() {
        for (lane, (a, b)) in pairs.iter().enumerate() {
            let (found, expected) = (out[at * lanes + lane], model(*a, *b));
            let open = *a << 1 == 0 && UNARY.get(at.wrapping_sub(BINARY.len())) == Some(&Unary::InverseRoot);
            assert!(
                open || alike(found, expected),
                "operation {at} of {a:x} and {b:x}: {found:x}, not {expected:x}"
            );
        }
    }
}

/// Roots of floats, and 1 by them, against the processor's.
fn check_roots(floats: impl Iterator<Item = u32>) {
    if !osl_native::is_supported() {
        return;
    }
    let lanes = 1 << 16;
    let mut block = Block::new();
    let (from, to) = (block.array(), block.array());
    let x = block.lanes(from, 0);
    let (root, inverse) = (block.unary(Unary::Sqrt, x), block.unary(Unary::InverseRoot, x));
    block.store(to, 0, root, true);
    block.store(to, lanes as u32, inverse, true);
    let code = Code::new(&block).unwrap();
    let (mut floats, mut out) = (floats.peekable(), vec![0; 2 * lanes]);
    while floats.peek().is_some() {
        let mut list: Vec<u32> = floats.by_ref().take(lanes).collect();
        list.resize(lanes, 0x3F80_0000);
        assert!(code.run([Words::Read(&list), Words::Write(&mut out)], 0..lanes, &mut Scratch::default()));
        for (lane, x) in list.iter().enumerate() {
            let (root, inverse) = (unary(Unary::Sqrt, *x), unary(Unary::InverseRoot, *x));
            let found = (out[lane], if f32::from_bits(*x) == 0.0 { inverse } else { out[lanes + lane] });
            assert!(alike(found.0, root) && alike(found.1, inverse), "{x:x}: {found:x?}");
        }
    }
}

/// Within the range of the usual way a factor of four changes exponents only, so that two binades stand for all.
#[test]
fn roots_are_exact_for_every_mantissa() {
    let one = 1.0_f32.to_bits();
    check_roots(one..one + (2 << 23));
    check_roots([0, 0x8000_0000].into_iter());
    for edge in [27_u32, 227] {
        check_roots((edge << 23) - 1000..(edge << 23) + 1000);
    }
}

/// `cargo test --release -p osl-native --test blocks roots -- --ignored`: a few minutes.
#[test]
#[ignore = "all floats"]
fn roots_are_exact_for_every_float() {
    check_roots(0..=u32::MAX);
}

#[test]
fn arrays_that_do_not_suit_are_refused() {
    if !osl_native::is_supported() {
        return;
    }
    let mut block = Block::new();
    let (from, to) = (block.array(), block.array());
    let (a, k) = (block.lanes(from, 32), block.word(from, 100));
    let sum = block.binary(Binary::Add, a, k);
    block.store(to, 16, sum, true);
    let code = Code::new(&block).unwrap();
    assert!(code.size() > 0);
    let mut scratch = Scratch::default();
    let (read, mut write) = (vec![0; 101], vec![7; 48]);
    let short = vec![0; 63];
    assert!(!code.run([Words::Read(&read)], 0..32, &mut scratch));
    assert!(!code.run([Words::Read(&read[..100]), Words::Write(&mut write)], 0..32, &mut scratch));
    assert!(!code.run([Words::Read(&short), Words::Write(&mut write)], 0..32, &mut scratch));
    assert!(!code.run([Words::Read(&read), Words::Write(&mut write[..47])], 0..32, &mut scratch));
    assert!(!code.run([Words::Read(&read), Words::Read(&short)], 0..32, &mut scratch));
    assert!(!code.run([Words::Read(&read), Words::Write(&mut write)], 0..31, &mut scratch));
    assert!(!code.run([Words::Read(&read), Words::Write(&mut write)], 8..24, &mut scratch));
    assert!(code.run([Words::Read(&read), Words::Write(&mut write)], 16..16, &mut scratch));
    assert_eq!(write, [7; 48]);
    assert!(code.run([Words::Read(&read), Words::Write(&mut write)], 16..32, &mut scratch));
    assert_eq!(write, [[7; 32].as_slice(), &[0; 16]].concat());
}

#[test]
fn blocks_that_name_far_words_have_no_code() {
    let mut block = Block::new();
    let array = block.array();
    let a = block.lanes(array, u32::MAX - 3);
    block.store(array, 0, a, true);
    assert!(Code::new(&block).is_none());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn random_blocks_compute_what_they_say(
        steps in prop::collection::vec(prop::array::uniform5(0usize..1 << 20), 1..260),
        seed in any::<u32>(),
    ) {
        if osl_native::is_supported() {
            let (lanes, list) = (48, extremes());
            let mut state = seed | 1;
            let mut next = || {
                state ^= state << 13;
                state ^= state >> 17;
                state ^= state << 5;
                if state % 3 == 0 { list[state as usize / 3 % list.len()] } else { (state as f32 / 1e9 - 2.0).to_bits() }
            };
            let start: Vec<u32> = (0..PLACES * lanes).map(|_| next()).collect();
            let words: Vec<u32> = (0..40).map(|_| next()).collect();
            let mut both = Both::new(&start, &words, lanes);
            steps.iter().for_each(|step| both.add(*step));
            // What is left over is wanted, too, so that much lives at once.
            let array = both.block.array();
            let values = both.values.clone();
            for (at, (value, _)) in values.iter().enumerate() {
                both.block.store(array, (at * lanes) as u32, *value, true);
            }
            let code = Code::new(&both.block).unwrap();
            let (mut memory, mut rest) = (start, vec![0; values.len() * lanes]);
            let mut scratch = Scratch::default();
            for range in [0..16, 16..48] {
                let arrays = [Words::Write(&mut memory), Words::Read(&words), Words::Write(&mut rest)];
                prop_assert!(code.run(arrays, range, &mut scratch));
            }
            for (at, (_, model)) in values.iter().enumerate() {
                for lane in 0..lanes {
                    let found = rest[at * lanes + lane];
                    prop_assert!(model[lane].is_none_or(|x| x == found), "value {at}, lane {lane}: {found:x} {:x?}", model[lane]);
                }
            }
            for place in (0..PLACES).filter(|place| !both.loose[*place]) {
                let words = place * lanes..(place + 1) * lanes;
                for (model, found) in both.memory[words.clone()].iter().zip(&memory[words]) {
                    prop_assert!(model.is_none_or(|x| x == *found), "place {place}");
                }
            }
        }
    }
}
