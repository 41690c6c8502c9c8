//! Recorded operations have the bits of their bodies.

#![allow(clippy::print_stdout, reason = "a test says what it leaves out")]

use super::plan::lend;
use super::*;
use crate::arithmetic::{ArithmeticImpl, Fast, Strict};
use crate::lanes::{LaneInput, LaneRun, ReadyArg, ReadyLane};
use crate::register::Lanes;
use osl_ir::ir::{Kind, LaneOp, MAX_ARGS, Precision};
use osl_native::interpret::interpret;
use osl_simd::Isa;

/// Lanes of a batch.
const WIDTH: usize = 512;

fn shape(style: Style, target: Target) -> Shape {
    Shape { width: WIDTH, style, target }
}

/// Words that are difficult for operations, and words in between.
fn word(state: &mut u32, kind: Kind) -> u32 {
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    let floats = [
        0.0,
        -0.0,
        0.5,
        -0.5,
        1.0,
        -1.0,
        2.5,
        -2.5,
        0.49999997,
        1e-20,
        -1e-20,
        1e-40,
        1e20,
        -1e20,
        3e38,
        8388607.5,
        2147483648.0,
        f32::MIN_POSITIVE,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
    ];
    let ints = [0, 1, 2, -1, 3, 31, 32, i32::MAX, i32::MIN];
    let pick = *state as usize >> 8;
    match (kind, *state % 3) {
        (Kind::Int | Kind::Str | Kind::Closure, 0) => *state,
        (Kind::Int | Kind::Str | Kind::Closure, _) => ints[pick % ints.len()] as u32,
        (_, 0) => floats[pick % floats.len()].to_bits(),
        (_, 1) => (*state as f32 / 4e8 - 5.0).to_bits(),
        _ => ((*state % 9) as f32 / 2.0 - 1.0).to_bits(),
    }
}

/// An operation with arguments: lanes, or a single word for all lanes.
struct Case {
    step: ReadyLane,
    registers: Vec<Lanes>,
    words: Vec<u32>,
    out: usize,
}

impl Case {
    /// Bit `n` of `singles` says that argument `n` is a single value. `triples`: an operation on components
    /// works on those of triples.
    fn new(op: LaneOp, singles: usize, triples: bool, state: &mut u32) -> Case {
        let shape = op.shape();
        let parts = if triples { 3 } else { 1 };
        let out = WIDTH * parts * shape.result.words() as usize;
        let (mut registers, mut words, mut args) = (vec![Lanes::new(out)], Vec::new(), Vec::new());
        for (number, kind) in shape.args.iter().enumerate() {
            let kind = if triples && *kind == Kind::Float { Kind::Triple } else { *kind };
            let count = kind.words() as usize;
            let (from, apart) = if singles >> number & 1 == 0 {
                let mut lanes = Lanes::new(WIDTH * count);
                lanes.words_mut().iter_mut().for_each(|to| *to = word(state, kind));
                registers.push(lanes);
                (LaneInput::Lanes(registers.len() as u32 - 1, 0), WIDTH as u32)
            } else {
                words.extend((0..count).map(|_| word(state, kind)));
                (LaneInput::Words((words.len() - count) as u32), 1)
            };
            let apart = if parts > 1 && count > 1 { apart } else { 0 };
            args.push(ReadyArg { from, words: count as u8, apart });
        }
        let count = args.len() as u8;
        args.resize(MAX_ARGS, ReadyArg { from: LaneInput::Words(0), words: 0, apart: 0 });
        let args = args.try_into().expect("as many as an operation has");
        let step = ReadyLane { op, parts: parts as u8, flat: false, count, out: (0, 0), args };
        Case { step, registers, words, out }
    }

    fn waiting(&self) -> QueuedOp {
        QueuedOp { ready: Ready::Lane(self.step), at: 0, last: 1 }
    }

    /// The result, as `run` computes it.
    fn result(&mut self, run: impl FnOnce(&mut Files<'_, u32>)) -> Vec<u32> {
        run(&mut Files::new(
            (&mut self.registers, &mut []),
            (&[], &[]),
            &self.words,
            &mut Default::default(),
        ));
        std::mem::replace(&mut self.registers[0], Lanes::new(self.out)).words().to_vec()
    }
}

/// The cases of every operation that can be recorded.
fn cases(style: Style) -> impl Iterator<Item = Case> {
    let mut state = 0x1234_5678;
    let forms = |op: &LaneOp| {
        let (op, count) = (*op, 1 << op.shape().args.len());
        (0..count).flat_map(move |singles| [(op, singles, false), (op, singles, true)])
    };
    let known = LaneOp::ALL.iter().filter(move |op| record::is_known(**op, style));
    let cases = known.flat_map(forms).filter(|(op, _, triples)| op.shape().per_component || !triples);
    cases.map(move |(op, singles, triples)| Case::new(op, singles, triples, &mut state))
}

/// The loops over lanes, with fused products and sums whether or not this machine has such an instruction.
fn fused(mut run: LaneRun<'_, u32>) {
    let is_strict = |step: &Ready| match step {
        Ready::Lane(step) => step.op.precision() == Precision::Strict,
        _ => true,
    };
    run.each_alike(is_strict, |strict, part| {
        if strict {
            Strict::lanes(Isa::baseline(), part);
        } else {
            part.each(osl_lanes::run_fused);
        }
    });
}

fn compare<A: ArithmeticImpl<Word = u32>>(style: Style, lanes: impl Fn(LaneRun<'_, u32>)) {
    for mut case in cases(style) {
        let (op, steps) = (case.step.op, [Ready::Lane(case.step)]);
        let expected = case.result(|files| {
            lanes(LaneRun { steps: &steps, ..files.run(Isa::baseline(), &[], WIDTH, 0..WIDTH) });
        });
        let waiting = [case.waiting()];
        let words = case.words.clone();
        let constant = |at: u32| words.get(at as usize).copied();
        let mut interpreted = |constant: &dyn Fn(u32) -> Option<u32>| {
            let recorded = plan::block(&waiting, constant, shape(style, Target::Avx512));
            let (block, arrays, _) = recorded.expect("it can be recorded");
            case.result(|files| {
                let mut arrays: Vec<_> = lend(&arrays, files).collect();
                interpret(&block, &mut arrays, 0..WIDTH).expect("the arrays suit the block");
            })
        };
        let (found, known) = (interpreted(&|_| None), interpreted(&constant));
        let mut ways = vec![("interpreted", found), ("interpreted with constants", known)];
        for target in Target::ALL.iter().filter(|target| target.is_supported()) {
            let sequence = Sequence { items: waiting.to_vec(), constant: &constant };
            let plan = Plan::new(&sequence, shape(style, *target)).expect("what is recorded has code");
            let run = |files: &mut Files<'_, u32>| {
                plan.run::<A>(Isa::detect(), files, (WIDTH, WIDTH), &mut Scratch::default());
            };
            ways.push((target.name(), case.result(run)));
        }
        for (way, found) in ways {
            for (lane, (a, b)) in expected.iter().zip(found).enumerate() {
                let nan = |x: u32| f32::from_bits(x).is_nan();
                assert!(*a == b || nan(*a) && nan(b), "{way} {op:?}: {lane}: {b:x}, not {a:x}");
            }
        }
    }
    for target in Target::ALL.iter().filter(|target| !target.is_supported()) {
        println!("left out: this machine cannot run code for {}", target.name());
    }
}

/// Every operation that can be recorded gives the bits of its body, for arguments that are lanes or a single
/// value, and for triples if it works on each component.
#[test]
fn recorded_operations_have_the_bits_of_their_bodies() {
    compare::<Strict>(Style::Strict, |run| Strict::lanes(Isa::baseline(), run));
    compare::<Fast>(Style::Fast, fused);
}

/// Operations without machine code, because their bodies need values or double precision.
#[test]
fn other_operations_are_interpreted() {
    let missing = |style| -> Vec<LaneOp> {
        LaneOp::ALL.iter().copied().filter(|op| !record::is_known(*op, style)).collect()
    };
    use LaneOp as L;
    let list = [
        L::MGet,
        L::LibraryConstant,
        L::FmodExact,
        L::SrgbToLinear,
        L::LinearToSrgb,
        L::Blackbody,
        L::Wavelength,
        L::XyzToRgbIn,
        L::RgbToXyzIn,
        L::LuminanceIn,
        L::BlackbodyIn,
        L::WavelengthIn,
        L::ConvertNamed,
        L::ConvertNamedTangent,
    ];
    assert_eq!(missing(Style::Strict), list);
    assert_eq!(missing(Style::Fast), list);
}

/// Ints that are hard to divide, or by which to divide is hard.
fn dividends() -> Vec<u32> {
    let mut state = 0x1357_9BDF;
    let mut list: Vec<u32> = [0, 1, 2, 3, 5, 7, 10, 255, 384, 385].map(|n: i32| n as u32).to_vec();
    for bit in 4..32 {
        let power = 1_u32 << bit;
        list.extend([power - 1, power, power.wrapping_add(1), power / 3, power / 3 * 2]);
    }
    list.extend((0..60).map(|_| word(&mut state, Kind::Int)));
    let negative: Vec<u32> = list.iter().map(|n| n.wrapping_neg()).collect();
    list.extend(negative);
    list
}

/// Compares the results of a block for pairs of ints with quotients and remainders.
fn check_division(case: &mut Case, constant: plan::Constants<'_>, pairs: &[(u32, u32)]) {
    let op = case.step.op;
    let waiting = [case.waiting()];
    let recorded = plan::block(&waiting, constant, shape(Style::Strict, Target::Avx2));
    let (block, arrays, _) = recorded.expect("it can be recorded");
    for some in pairs.chunks(WIDTH) {
        for (lane, (a, b)) in some.iter().enumerate() {
            for (register, value) in case.registers[1..].iter_mut().zip([a, b]) {
                register.words_mut()[lane] = *value;
            }
        }
        let found = case.result(|files| {
            let mut arrays: Vec<_> = lend(&arrays, files).collect();
            interpret(&block, &mut arrays, 0..WIDTH).expect("the arrays suit the block");
        });
        for ((a, b), found) in some.iter().map(|(a, b)| (*a as i32, *b as i32)).zip(found) {
            let expected = match (op, b) {
                (_, 0) => 0,
                (LaneOp::IDiv, _) => a.wrapping_div(b),
                _ => a.wrapping_rem(b),
            };
            assert_eq!(found as i32, expected, "{op:?} {a} {b}");
        }
    }
}

/// Quotients and remainders of ints, which are made from floats.
#[test]
fn ints_divide_as_ints() {
    let list = dividends();
    let pairs: Vec<(u32, u32)> = list.iter().flat_map(|a| list.iter().map(|b| (*a, *b))).collect();
    for op in [LaneOp::IDiv, LaneOp::IMod] {
        check_division(&mut Case::new(op, 0, false, &mut 1), &|_| None, &pairs);
    }
}

/// The same by constants, which are made from products.
#[test]
fn ints_divide_by_constants() {
    let list = dividends();
    let near = |b: u32| [b, b.wrapping_mul(3), b.wrapping_mul(0x0101_0101)];
    for op in [LaneOp::IDiv, LaneOp::IMod] {
        for b in list.iter().copied().chain(0..300) {
            // Where the quotient changes.
            let edges = near(b).into_iter().flat_map(|n| [n.wrapping_sub(1), n, n.wrapping_add(1)]);
            let pairs: Vec<(u32, u32)> = list.iter().copied().chain(edges).map(|a| (a, b)).collect();
            check_division(&mut Case::new(op, 0b10, false, &mut 1), &|_| Some(b), &pairs);
        }
    }
}
