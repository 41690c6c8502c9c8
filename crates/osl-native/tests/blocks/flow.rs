//! Blocks with loops and skipped parts: random ones run as they are interpreted, and budgets bound them.

use super::{Held, WIDEST, emulated, extremes, forms, next, on_machine, regions};
use osl_native::interpret::interpret;
use osl_native::{Binary, Block, Code, IntCompare, Next, Outcome, Scratch, Target, Words};
use std::ops::Range;

/// Blocks with regions, by numbers from one to another: every way to run them agrees.
fn check_regions(
    numbers: Range<u32>,
    ways: impl Fn(&Block, &[Held], &[Range<usize>]) -> Vec<(&'static str, Vec<Held>)>,
) {
    let (lanes, list) = (WIDEST, extremes());
    for number in numbers {
        let mut state = number.wrapping_mul(0x9E37_79B9) | 1;
        let count = 8 + next(&mut state) % if number.is_multiple_of(8) { 600 } else { 100 };
        let steps: Vec<u32> = (0..count).map(|_| next(&mut state) >> 4).collect();
        let block = regions::block(&steps, lanes);
        let mut word = || {
            let next = next(&mut state);
            if next.is_multiple_of(3) { list[next as usize / 3 % list.len()] } else { next >> 8 }
        };
        let (places, words) = ((0..5 * lanes).map(|_| word()).collect(), (0..20).map(|_| word()).collect());
        let arrays = vec![Held::Write(places), Held::Read(words), Held::Write(vec![0; 400 * lanes])];
        let moving = Held::Write((0..5 * lanes).map(|_| word()).collect());
        let arrays = [arrays, vec![moving]].concat();
        let mut expected = arrays.to_vec();
        let mut lent: Vec<_> = expected.iter_mut().map(Held::lend).collect();
        interpret(&block, &mut lent, 0..lanes).unwrap();
        for (way, held) in ways(&block, &arrays, std::slice::from_ref(&(0..lanes))) {
            assert_eq!(held, expected, "{way}: {number}");
        }
    }
}

#[test]
fn regions_run_as_they_are_interpreted() {
    check_regions(0..150, |block, arrays, ranges| {
        let some = Target::ALL.iter().filter(|target| target.carries(block)).copied();
        let all = some.flat_map(|target| forms(block, target).map(move |form| (target, form)));
        all.flat_map(|(target, (name, form))| {
            let emulated = (name, emulated(target, &form, arrays, ranges));
            let on_machine = on_machine(target, &form, arrays, ranges).map(|held| (name, held));
            std::iter::once(emulated).chain(on_machine)
        })
        .collect()
    });
}

/// Blocks with regions that this machine runs.
fn check_many_regions(numbers: Range<u32>) {
    check_regions(numbers, |block, arrays, ranges| {
        let carries = |target: &&Target| target.is_supported() && Code::new(block, **target).is_some();
        let on = |target: &Target| {
            let run = |(name, form)| Some((name, on_machine(*target, &form, arrays, ranges)?));
            forms(block, *target).filter_map(run).collect::<Vec<_>>()
        };
        Target::ALL.iter().filter(carries).flat_map(on).collect()
    });
}

#[test]
fn thousands_of_regions_run_on_this_machine() {
    check_many_regions(0..4000);
}

/// `OSL_BLOCKS` is their number, as below.
#[test]
#[ignore = "minutes"]
fn millions_of_regions_run_on_this_machine() {
    let count = std::env::var("OSL_BLOCKS").ok().and_then(|count| count.parse().ok());
    check_many_regions(4000..4000_u32.saturating_add(count.unwrap_or(1_000_000)));
}

/// Counts down from the numbers of the lanes, and stops where one is negative.
fn countdown() -> Block {
    let mut block = Block::new();
    let (from, to) = (block.array(), block.array());
    let (x, zero, one) = (block.lanes(from, 0), block.bits(0), block.bits(1));
    let negative = block.compare_ints(IntCompare::Less, x, zero);
    block.stop_if(negative);
    let all = block.compare_ints(IntCompare::Equal, zero, zero);
    let begun = block.begin_loop(all, &[x, zero], 10);
    let less = block.binary(Binary::IntSub, begun.values[0], one);
    let rounds = block.binary(Binary::IntAdd, begun.values[1], one);
    let again = block.compare_ints(IntCompare::Less, zero, less);
    let next = [less, rounds].map(|value| Next { value, kept: true });
    let results = block.end_loop(&begun, &next, again);
    block.store(to, 0, results[1], true);
    block
}

#[test]
fn a_budget_bounds_the_rounds() {
    let block = countdown();
    // NEON has no code for loops.
    let carries = |target: &Target| target.is_supported() && target.carries(&block);
    for target in Target::ALL.iter().copied().filter(carries) {
        let code = Code::new(&block, target).unwrap();
        let lanes = 2 * target.lanes();
        let mut scratch = Scratch::default();
        let mut run = |words: &mut Vec<u32>, budget: u32, goes_on: bool| {
            let mut out = vec![0; lanes];
            let arrays = [Words::Read(words), Words::Write(&mut out)];
            let outcome = code.run_within(arrays, 0..lanes, &mut scratch, budget, |_| goes_on);
            (outcome, out)
        };
        let mut words: Vec<u32> = (0..lanes as u32).collect();
        let rounds: Vec<u32> = words.iter().map(|n| *n.max(&1)).collect();
        let most = 10 * (lanes as u32 - 1);
        assert_eq!(run(&mut words, most, true), (Outcome::Spent(most), rounds.clone()));
        let (outcome, out) = run(&mut words, most - 1, true);
        assert_eq!(outcome, Outcome::Stopped);
        // The first vector was within the budget.
        let half = target.lanes();
        assert_eq!((&out[..half], &out[half..]), (&rounds[..half], &vec![0; half][..]));
        assert_eq!(run(&mut words, most, false).0, Outcome::Stopped);
        words[lanes - 1] = u32::MAX;
        assert_eq!(run(&mut words, most, true).0, Outcome::Stopped);
        let mut out = vec![0; lanes];
        assert!(!code.run([Words::Read(&words), Words::Write(&mut out)], 0..lanes, &mut scratch));
    }
}
