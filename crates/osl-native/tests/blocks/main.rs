//! Blocks compute the right values: each operation on extremes, and long random blocks against a model that
//! computes one lane at a time. They run on the machine if it can, and in an emulator everywhere.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

mod choices;
mod emulate;
mod flow;
mod memory;
mod model;
mod neon;
mod random;
mod regions;

use model::{BINARY, COMPARE, INT_COMPARE, UNARY, alike, binary, compare, compare_ints, unary};
use osl_native::interpret::interpret;
use osl_native::{
    Array, Binary, Block, Code, Compare, IntCompare, MaskValue, Next, Outcome, Scratch, Target, Unary, Value,
    Words,
};
use proptest::prelude::*;
use random::{Both, PLACES};
use std::ops::Range;

/// Lanes of two of the widest vectors.
const WIDEST: usize = 32;

/// An array for a block.
#[derive(Clone, Debug, PartialEq)]
enum Held {
    Read(Vec<u32>),
    Write(Vec<u32>),
}

impl Held {
    fn words(&self) -> &[u32] {
        let (Held::Read(words) | Held::Write(words)) = self;
        words
    }

    fn lend(&mut self) -> Words<'_> {
        match self {
            Held::Read(words) => Words::Read(words),
            Held::Write(words) => Words::Write(words),
        }
    }
}

/// The contents of the arrays after code has run in the emulator.
fn emulated(target: Target, block: &Block, arrays: &[Held], ranges: &[Range<usize>]) -> Vec<Held> {
    let (code, mut held) = (target.assemble(block), arrays.to_vec());
    for range in ranges {
        let arrays = held.iter_mut().map(Held::lend).collect();
        match target {
            Target::Neon => neon::run(&code, arrays, range.clone()),
            _ => emulate::run(target, &code, arrays, range.clone()),
        }
    }
    held
}

/// The same on this machine, if it can run the code.
fn on_machine(target: Target, block: &Block, arrays: &[Held], ranges: &[Range<usize>]) -> Option<Vec<Held>> {
    if !target.is_supported() {
        return None;
    }
    let (code, mut scratch, mut held) =
        (Code::new(block, target).unwrap(), Scratch::default(), arrays.to_vec());
    for range in ranges {
        let arrays = held.iter_mut().map(Held::lend);
        if block.may_stop() {
            let outcome = code.run_within(arrays, range.clone(), &mut scratch, u32::MAX >> 1, |_| true);
            assert!(matches!(outcome, Outcome::Spent(_)), "{outcome:?}");
        } else {
            assert!(code.run(arrays, range.clone(), &mut scratch));
        }
    }
    Some(held)
}

/// A block for a target: for one vector at a time, and for two in step if it can be a pair.
fn forms(block: &Block, target: Target) -> impl Iterator<Item = (&'static str, Block)> {
    let pair = match target {
        Target::Avx2 => "avx2, in pairs",
        Target::Avx512 => "avx512, in pairs",
        Target::Neon => "neon, in pairs",
    };
    let two = block.pair(target.lanes() as u32).filter(|block| target.carries(block));
    std::iter::once((target.name(), block.clone())).chain(two.map(|block| (pair, block)))
}

/// The contents of the arrays after a block has run on ranges of lanes, for each way to run it.
fn each_way(block: &Block, arrays: &[Held], ranges: &[Range<usize>]) -> Vec<(&'static str, Vec<Held>)> {
    let mut ways = Vec::new();
    let mut held = arrays.to_vec();
    for range in ranges {
        let mut arrays: Vec<_> = held.iter_mut().map(Held::lend).collect();
        interpret(block, &mut arrays, range.clone()).unwrap();
    }
    ways.push(("interpreted", held));
    for target in Target::ALL.iter().copied() {
        for (name, block) in forms(block, target) {
            ways.push((name, emulated(target, &block, arrays, ranges)));
            match on_machine(target, &block, arrays, ranges) {
                Some(held) => ways.push((name, held)),
                None => println!("left out: this machine has no {name}, so that it is only emulated"),
            }
        }
    }
    ways
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
    let list = extremes();
    let pairs: Vec<(u32, u32)> = list.iter().flat_map(|a| list.iter().map(|b| (*a, *b))).collect();
    let lanes = pairs.len().next_multiple_of(WIDEST);
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
        let mask = block.compare(how, a, b);
        results.push(block.number(mask));
        models.push(Box::new(move |a, b| u32::from(compare(how, a, b))));
    }
    for how in INT_COMPARE {
        let mask = block.compare_ints(how, a, b);
        results.push(block.number(mask));
        models.push(Box::new(move |a, b| u32::from(compare_ints(how, a, b))));
    }
    for (at, result) in results.iter().enumerate() {
        block.store(to, (at * lanes) as u32, *result, true);
    }
    let out = vec![0; results.len() * lanes];
    for (way, held) in
        each_way(&block, &[Held::Read(inputs), Held::Write(out)], std::slice::from_ref(&(0..lanes)))
    {
        let out = held[1].words();
        for (at, model) in models.iter().enumerate() {
            for (lane, (a, b)) in pairs.iter().enumerate() {
                let (found, expected) = (out[at * lanes + lane], model(*a, *b));
                let inverse = UNARY.get(at.wrapping_sub(BINARY.len())) == Some(&Unary::InverseRoot);
                assert!(
                    *a << 1 == 0 && inverse || alike(found, expected),
                    "{way}: operation {at} of {a:x} and {b:x}: {found:x}, not {expected:x}"
                );
            }
        }
    }
}

/// What a mask is for two words.
type Model = Box<dyn Fn(u32, u32) -> bool>;

/// Masks of the same two operands, combined and negated, and choices by them: the block may compute fewer.
#[test]
fn combined_comparisons_hold_at_the_extremes() {
    let list = extremes();
    let pairs: Vec<(u32, u32)> = list.iter().flat_map(|a| list.iter().map(|b| (*a, *b))).collect();
    let lanes = pairs.len().next_multiple_of(WIDEST);
    let mut inputs = vec![0; 2 * lanes];
    for (at, (a, b)) in pairs.iter().enumerate() {
        (inputs[at], inputs[lanes + at]) = (*a, *b);
    }
    let mut block = Block::new();
    let (from, to) = (block.array(), block.array());
    let (a, b) = (block.lanes(from, 0), block.lanes(from, lanes as u32));
    let mut masks: Vec<(MaskValue, Model)> = Vec::new();
    for how in COMPARE {
        masks.push((block.compare(how, a, b), Box::new(move |a, b| compare(how, a, b))));
        for other in COMPARE {
            let (p, q) = (block.compare(how, a, b), block.compare(other, a, b));
            let (p, q) = (block.not(p), block.not(q));
            let is = move |a, b| !compare(how, a, b) && !compare(other, a, b);
            masks.push((block.both(p, q), Box::new(is)));
        }
    }
    for how in INT_COMPARE {
        let mask = block.compare_ints(how, a, b);
        masks.push((block.not(mask), Box::new(move |a, b| !compare_ints(how, a, b))));
    }
    let nan_or_infinite = block.class(a, true, true);
    let finite = block.not(nan_or_infinite);
    masks.push((finite, Box::new(|a, _| f32::from_bits(a).is_finite())));
    let nan = block.class(a, true, false);
    let number = block.not(nan);
    masks.push((block.both(nan_or_infinite, number), Box::new(|a, _| f32::from_bits(a).is_infinite())));
    let mut place = 0;
    for (mask, _) in &masks {
        let results = [block.number(*mask), block.choose(*mask, a, b), block.choose(*mask, b, a)];
        for result in results {
            block.store(to, place, result, true);
            place += lanes as u32;
        }
    }
    let out = vec![0; 3 * masks.len() * lanes];
    for (way, held) in
        each_way(&block, &[Held::Read(inputs), Held::Write(out)], std::slice::from_ref(&(0..lanes)))
    {
        let found = |result: usize, lane: usize| held[1].words()[result * lanes + lane];
        for (at, (_, model)) in masks.iter().enumerate() {
            for (lane, (a, b)) in pairs.iter().enumerate() {
                let truth = model(*a, *b);
                let (yes, no) = if truth { (*a, *b) } else { (*b, *a) };
                let found = [0, 1, 2].map(|n| found(3 * at + n, lane));
                assert_eq!(found, [u32::from(truth), yes, no], "{way}: mask {at} of {a:x} and {b:x}");
            }
        }
    }
}

/// What no store needs costs no instruction, and neither do opposites.
#[test]
fn blocks_compute_no_more_than_is_stored() {
    let count = |write: &dyn Fn(&mut Block, Value, Value) -> Value| {
        let mut block = Block::new();
        let (from, to) = (block.array(), block.array());
        let (a, b) = (block.lanes(from, 0), block.lanes(from, 16));
        let result = write(&mut block, a, b);
        block.store(to, 0, result, true);
        Target::ALL.iter().map(|target| target.assemble(&block).instructions).collect::<Vec<_>>()
    };
    let sum = count(&|block, a, b| block.binary(Binary::Add, a, b));
    let with_more = count(&|block, a, b| {
        let product = block.binary(Binary::Mul, a, b);
        block.unary(Unary::Sqrt, product);
        block.binary(Binary::Add, a, b)
    });
    assert_eq!(with_more, sum);
    let smaller = count(&|block, a, b| {
        let larger = block.compare(Compare::Greater, a, b);
        let not_larger = block.not(larger);
        block.choose(not_larger, a, b)
    });
    assert_eq!(smaller, count(&|block, a, b| block.binary(Binary::Min, a, b)));
}

/// Quotients by constants have the bits of the division, also where a product takes its place.
#[test]
fn quotients_by_constants_are_exact() {
    let list = extremes();
    let lanes = list.len().next_multiple_of(WIDEST);
    let mut from = list.clone();
    from.resize(lanes, 0);
    let powers = (0..=u8::MAX).flat_map(|exponent| {
        let power = u32::from(exponent) << 23;
        [power, power | 0x8000_0000, power | 1]
    });
    for divisor in powers.chain(list.iter().copied()) {
        let mut block = Block::new();
        let (input, to) = (block.array(), block.array());
        let (x, by) = (block.lanes(input, 0), block.bits(divisor));
        let quotient = block.binary(Binary::Div, x, by);
        block.store(to, 0, quotient, true);
        let arrays = [Held::Read(from.clone()), Held::Write(vec![0; lanes])];
        for (way, held) in each_way(&block, &arrays, std::slice::from_ref(&(0..lanes))) {
            for (x, found) in from.iter().zip(held[1].words()) {
                let expected = binary(Binary::Div, *x, divisor);
                assert!(alike(*found, expected), "{way}: {x:x} / {divisor:x}: {found:x}, not {expected:x}");
            }
        }
    }
}

/// Compares roots of floats and their inverses with the processor's.
fn check_roots(floats: impl Iterator<Item = u32>) {
    let lanes = 1 << 12;
    let mut block = Block::new();
    let (from, to) = (block.array(), block.array());
    let x = block.lanes(from, 0);
    let (root, inverse) = (block.unary(Unary::Sqrt, x), block.unary(Unary::InverseRoot, x));
    block.store(to, 0, root, true);
    block.store(to, lanes as u32, inverse, true);
    let mut floats = floats.peekable();
    while floats.peek().is_some() {
        let mut list: Vec<u32> = floats.by_ref().take(lanes).collect();
        list.resize(lanes, 0x3F80_0000);
        let arrays = [Held::Read(list.clone()), Held::Write(vec![0; 2 * lanes])];
        for (way, held) in each_way(&block, &arrays, std::slice::from_ref(&(0..lanes))) {
            let out = held[1].words();
            for (lane, x) in list.iter().enumerate() {
                let (root, inverse) = (unary(Unary::Sqrt, *x), unary(Unary::InverseRoot, *x));
                let found = (out[lane], if f32::from_bits(*x) == 0.0 { inverse } else { out[lanes + lane] });
                assert!(alike(found.0, root) && alike(found.1, inverse), "{way}: {x:x}: {found:x?}");
            }
        }
    }
}

/// Steps between tried mantissas: an emulator is slower than the machine.
fn step() -> usize {
    if Target::Avx512.is_supported() { 1 } else { 331 }
}

/// On the usual path, a factor of four changes only exponents, so two binades stand for all.
#[test]
fn roots_are_exact_for_every_mantissa() {
    let one = 1.0_f32.to_bits();
    check_roots((one..one + (2 << 23)).step_by(step()));
    // The last mantissas of a binade are those whose inverse is close to a tie.
    check_roots(one + (1 << 23) - 2000..one + (1 << 23) + 2000);
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

/// Places whose addresses do not fit in an instruction, more arrays than have registers, and more constants
/// than lie in memory.
#[test]
fn far_places_and_many_arrays_and_constants_are_reached() {
    const PLACES: [u32; 8] = [0, 3, 1020, 1024, 16_380, 16_384, 40_001, 70_000];
    let lanes = 2 * WIDEST;
    let mut state = 0x2468_ACE1;
    let mut block = Block::new();
    let mut sum = block.bits(0);
    let mut held = Vec::new();
    let mut expected = vec![0_u32; lanes];
    for _ in 0..20 {
        let words: Vec<u32> = (0..70_000 + lanes).map(|_| next(&mut state)).collect();
        let array = block.array();
        for place in PLACES {
            let fifteen = block.bits(15);
            let index = block.binary(Binary::And, sum, fifteen);
            let parts =
                [block.lanes(array, place), block.word(array, place), block.look_up(array, place, index)];
            for part in parts {
                sum = block.binary(Binary::IntAdd, sum, part);
            }
            let place = place as usize;
            for (lane, sum) in expected.iter_mut().enumerate() {
                let picked = words[place + (*sum & 15) as usize];
                *sum = sum.wrapping_add(words[place + lane]).wrapping_add(words[place]).wrapping_add(picked);
            }
        }
        held.push(Held::Read(words));
    }
    for number in 0..5000_u32 {
        let constant = number.wrapping_mul(0x9E37_79B9);
        let value = block.bits(constant);
        sum = block.binary(Binary::Xor, sum, value);
        expected.iter_mut().for_each(|sum| *sum ^= constant);
    }
    let to = block.array();
    // Those that do not overlap.
    let stored = [3, 1024, 16_384, 40_001, 70_000];
    stored.iter().for_each(|place| block.store(to, *place, sum, true));
    held.push(Held::Write(vec![0; 70_000 + lanes]));
    for (way, held) in each_way(&block, &held, std::slice::from_ref(&(0..lanes))) {
        let out = held[20].words();
        for place in stored {
            assert_eq!(out[place as usize..][..lanes], expected, "{way}: {place}");
        }
    }
}

#[test]
fn arrays_that_do_not_suit_are_refused() {
    Target::ALL.iter().copied().filter(|target| target.is_supported()).for_each(refuses_what_does_not_suit);
}

fn refuses_what_does_not_suit(target: Target) {
    let mut block = Block::new();
    let (from, to) = (block.array(), block.array());
    let (a, k) = (block.lanes(from, 32), block.word(from, 100));
    let sum = block.binary(Binary::Add, a, k);
    block.store(to, 16, sum, true);
    let code = Code::new(&block, target).unwrap();
    assert!(code.size() > 0);
    let half = target.lanes() / 2;
    let mut scratch = Scratch::default();
    let (read, mut write) = (vec![0; 101], vec![7; 48]);
    let short = vec![0; 63];
    assert!(!code.run([Words::Read(&read)], 0..32, &mut scratch));
    assert!(!code.run([Words::Read(&read[..100]), Words::Write(&mut write)], 0..32, &mut scratch));
    assert!(!code.run([Words::Read(&short), Words::Write(&mut write)], 0..32, &mut scratch));
    assert!(!code.run([Words::Read(&read), Words::Write(&mut write[..47])], 0..32, &mut scratch));
    assert!(!code.run([Words::Read(&read), Words::Read(&short)], 0..32, &mut scratch));
    assert!(!code.run([Words::Read(&read), Words::Write(&mut write)], 0..31, &mut scratch));
    assert!(!code.run([Words::Read(&read), Words::Write(&mut write)], half..half + 16, &mut scratch));
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
    assert!(Target::ALL.iter().all(|target| Code::new(&block, *target).is_none()));
}

/// The next of a sequence of random numbers, which begins with an odd one.
fn next(state: &mut u32) -> u32 {
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    *state
}

/// A random block on vectors of the widest target, cut into two calls. `ways` runs it.
fn check_random(
    steps: &[[usize; 5]],
    seed: u32,
    (vectors, cut): (usize, usize),
    ways: impl Fn(&Block, &[Held], &[Range<usize>]) -> Vec<(&'static str, Vec<Held>)>,
) {
    let (lanes, list) = (WIDEST * vectors, extremes());
    let mut state = seed | 1;
    let mut word = || {
        let next = next(&mut state);
        if next.is_multiple_of(3) {
            list[next as usize / 3 % list.len()]
        } else {
            (next as f32 / 1e9 - 2.0).to_bits()
        }
    };
    let start: Vec<u32> = (0..PLACES * lanes).map(|_| word()).collect();
    let words: Vec<u32> = (0..40).map(|_| word()).collect();
    let mut both = Both::new(&start, &words, lanes);
    steps.iter().for_each(|step| both.add(*step));
    // The remaining values are stored too, so that many are live at once.
    let array = both.block.array();
    let values = both.values.clone();
    for (at, (value, _)) in values.iter().enumerate() {
        both.block.store(array, (at * lanes) as u32, *value, true);
    }
    let arrays = [Held::Write(start), Held::Read(words), Held::Write(vec![0; values.len() * lanes])];
    // All lanes in two calls, whose sizes are no powers of two; one of them may be empty.
    let cut = WIDEST * (cut % (vectors + 1));
    let ranges: Vec<_> = [0..cut, cut..lanes].into_iter().filter(|range| !range.is_empty()).collect();
    for (way, held) in ways(&both.block, &arrays, &ranges) {
        let (memory, rest) = (held[0].words(), held[2].words());
        for (at, (_, model)) in values.iter().enumerate() {
            for lane in 0..lanes {
                let found = rest[at * lanes + lane];
                assert!(
                    model[lane].is_none_or(|x| x == found),
                    "{way}: value {at}, lane {lane}: {found:x} {:x?}",
                    model[lane]
                );
            }
        }
        for place in (0..PLACES).filter(|place| !both.loose[*place]) {
            let words = place * lanes..(place + 1) * lanes;
            for (model, found) in both.memory[words.clone()].iter().zip(&memory[words]) {
                assert!(model.is_none_or(|x| x == *found), "{way}: place {place}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn random_blocks_compute_what_they_say(
        steps in prop::collection::vec(prop::array::uniform5(0usize..1 << 20), 1..260),
        seed in any::<u32>(),
        vectors in 1usize..6,
        cut in 0usize..8,
    ) {
        check_random(&steps, seed, (vectors, cut), each_way);
    }
}

/// Blocks with numbers from one to another, run by the machine if it can.
fn check_many(numbers: Range<u32>) {
    for number in numbers {
        let mut state = number.wrapping_mul(0x9E37_79B9) | 1;
        let mut some = |below: u32| next(&mut state) % below;
        let long = if some(16) == 0 { 160 } else { 40 };
        let count = 1 + some(long);
        let steps: Vec<[usize; 5]> = (0..count).map(|_| [(); 5].map(|()| some(1 << 20) as usize)).collect();
        let (seed, cut) = (some(u32::MAX), some(8) as usize);
        check_random(&steps, seed, (1 + cut % 2, cut), |block, arrays, ranges| {
            let on = |target: &Target| {
                let run = |(name, form)| Some((name, on_machine(*target, &form, arrays, ranges)?));
                forms(block, *target).filter_map(run).collect::<Vec<_>>()
            };
            Target::ALL.iter().flat_map(on).collect()
        });
    }
}

#[test]
fn thousands_of_random_blocks_run_on_this_machine() {
    check_many(0..5000);
}

/// `cargo test --release -p osl-native --test blocks millions -- --ignored`; `OSL_BLOCKS` is their number.
#[test]
#[ignore = "minutes"]
fn millions_of_random_blocks_run_on_this_machine() {
    let count = std::env::var("OSL_BLOCKS").ok().and_then(|count| count.parse().ok());
    let count: u32 = count.unwrap_or(10_000_000);
    check_many(5000..5000_u32.saturating_add(count));
    println!("{count} blocks");
}
