//! Choices between values, and masks as numbers: what a block makes of them at once.

use crate::{Held, WIDEST, each_way, extremes};
use osl_native::{Binary, Block, Compare, IntCompare, MaskValue, Target, Value};

/// A value, and its model for the three bits of a lane.
type Row = (Value, Box<dyn Fn([bool; 3]) -> u32>);

/// Lanes with every combination of three bits, in three rows.
fn bits() -> Vec<u32> {
    (0..3).flat_map(|bit| (0..WIDEST).map(move |lane| lane as u32 >> bit & 1)).collect()
}

/// Runs a block of three masks, one for each row of [`bits`], and checks what it stores, row by row, against
/// a model of the three bits.
fn check(write: impl Fn(&mut Block, [MaskValue; 3]) -> Vec<Row>) {
    let mut block = Block::new();
    let (input, to) = (block.array(), block.array());
    let masks = [0, 1, 2].map(|at| {
        let word = block.lanes(input, at * WIDEST as u32);
        block.not_zero(word)
    });
    let rows = write(&mut block, masks);
    for ((value, _), at) in rows.iter().zip((0..).step_by(WIDEST)) {
        block.store(to, at, *value, true);
    }
    let arrays = [Held::Read(bits()), Held::Write(vec![0; rows.len() * WIDEST])];
    for (way, held) in each_way(&block, &arrays, std::slice::from_ref(&(0..WIDEST))) {
        for (at, (_, model)) in rows.iter().enumerate() {
            for lane in 0..WIDEST {
                let set = [0, 1, 2].map(|bit| lane >> bit & 1 == 1);
                assert_eq!(held[1].words()[at * WIDEST + lane], model(set), "{way}: row {at}, {set:?}");
            }
        }
    }
}

/// Choices between numbers that are 1 or 0, among them the mask of the choice and its opposite; and whether
/// they are 1 or 0.
#[test]
fn choices_of_truths_are_truths() {
    let sides = |block: &mut Block, masks: [MaskValue; 3]| {
        let opposite = block.not(masks[0]);
        let [a, b, c, d] = [masks[0], masks[1], masks[2], opposite].map(|mask| block.number(mask));
        [a, b, c, d, block.bits(0), block.bits(1)]
    };
    let truth = |side: usize, [a, b, c]: [bool; 3]| [a, b, c, !a, false, true][side];
    let pairs = || (0..6).flat_map(|a| (0..6).map(move |b| (a, b)));
    check(|block, masks| {
        let sides = sides(block, masks);
        let row = |(a, b): (usize, usize)| {
            let value = block.choose(masks[0], sides[a], sides[b]);
            (
                value,
                Box::new(move |set: [bool; 3]| u32::from(truth(if set[0] { a } else { b }, set))) as Box<_>,
            )
        };
        pairs().map(row).collect()
    });
    for how in [IntCompare::Equal, IntCompare::Unequal, IntCompare::Less, IntCompare::LessEqual] {
        check(|block, masks| {
            let sides = sides(block, masks);
            let row = |(a, b): (usize, usize)| {
                let mask = block.compare_ints(how, sides[a], sides[b]);
                let model = move |set| {
                    let (a, b) = (truth(a, set), truth(b, set));
                    u32::from(match how {
                        IntCompare::Equal => a == b,
                        IntCompare::Unequal => a != b,
                        IntCompare::Less => !a & b,
                        IntCompare::LessEqual => a <= b,
                    })
                };
                (block.number(mask), Box::new(model) as Box<_>)
            };
            pairs().map(row).collect()
        });
    }
}

/// A choice within a choice, in each of the four places.
#[test]
fn choices_of_choices_are_choices() {
    check(|block, [p, q, _]| {
        let [x, y, z] = [7, 8, 9].map(|bits| block.bits(bits));
        let mut rows: Vec<Row> = Vec::new();
        for (yes, no, other) in [(x, y, y), (y, x, y), (x, y, z)] {
            let (yes_bits, no_bits, other_bits) =
                (block.constant(yes), block.constant(no), block.constant(other));
            let inner = block.choose(q, yes, no);
            let model = move |q: bool| if q { yes_bits } else { no_bits };
            rows.push((
                block.choose(p, inner, other),
                Box::new(move |[p, q, _]| if p { model(q) } else { other_bits }.unwrap_or(0)),
            ));
            rows.push((
                block.choose(p, other, inner),
                Box::new(move |[p, q, _]| if p { other_bits } else { model(q) }.unwrap_or(0)),
            ));
        }
        rows
    });
}

/// What a loop whose body has a condition costs: one choice for each value, and no number of a mask.
#[test]
fn a_condition_of_a_round_costs_one_choice() {
    let count = |nested: bool| {
        let mut block = Block::new();
        let (from, to) = (block.array(), block.array());
        let [a, b, c] = [0, 16, 32].map(|word| block.lanes(from, word));
        let (p, q) = (block.compare(Compare::Less, a, b), block.compare(Compare::Less, b, c));
        let sum = block.binary(Binary::Add, a, c);
        let chosen = if nested {
            let (one, zero) = (block.number(q), block.bits(0));
            let is_one = block.compare_ints(IntCompare::Unequal, one, zero);
            let inner = block.choose(is_one, sum, a);
            block.choose(p, inner, a)
        } else {
            let both = block.both(p, q);
            block.choose(both, sum, a)
        };
        block.store(to, 0, chosen, true);
        Target::ALL.iter().map(|target| target.assemble(&block).instructions).collect::<Vec<_>>()
    };
    assert_eq!(count(true), count(false));
}

/// Adding or taking away 1 where a mask is set, in every way to write it.
#[test]
fn counts_are_those_of_choices() {
    let list = extremes();
    let lanes = (list.len() * list.len()).next_multiple_of(WIDEST);
    let pairs = || list.iter().flat_map(|a| list.iter().map(move |b| (*a, *b)));
    let mut inputs: Vec<u32> = pairs().map(|(a, _)| a).collect();
    inputs.resize(lanes, 0);
    inputs.extend(pairs().map(|(_, b)| b));
    inputs.resize(2 * lanes, 0);
    let mut block = Block::new();
    let (from, to) = (block.array(), block.array());
    let (x, y) = (block.lanes(from, 0), block.lanes(from, lanes as u32));
    let (one, less) = (block.bits(1), block.bits(u32::MAX));
    let mask = block.compare_ints(IntCompare::Less, x, y);
    let steps = [
        block.binary(Binary::IntAdd, x, one),
        block.binary(Binary::IntAdd, one, x),
        block.binary(Binary::IntSub, x, one),
        block.binary(Binary::IntAdd, x, less),
        block.binary(Binary::IntSub, x, less),
    ];
    for (number, changed) in steps.into_iter().enumerate() {
        let chosen = block.choose(mask, changed, x);
        block.store(to, (number * lanes) as u32, chosen, true);
    }
    let arrays = [Held::Read(inputs), Held::Write(vec![0; 5 * lanes])];
    let ways = each_way(&block, &arrays, std::slice::from_ref(&(0..lanes)));
    for (way, held) in &ways {
        assert_eq!(held, &ways[0].1, "{way}");
    }
    for (lane, (a, b)) in pairs().enumerate() {
        let more = if (a as i32) < b as i32 { a.wrapping_add(1) } else { a };
        assert_eq!(ways[0].1[1].words()[lane], more, "{a:x} {b:x}");
    }
}
