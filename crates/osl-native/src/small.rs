//! A machine that exists only in tests: ten vector registers, with masks among them, and few operands in
//! memory.
//!
//! Its code is a list of steps, which a loop executes. Random blocks give the same words as [`interpret()`]
//! on vectors of 4 and of 8 lanes. So the allocator needs neither 16 lanes nor registers for masks.

use crate::allocate::{allocate, carries};
use crate::block::Block;
use crate::code::Words;
use crate::encoder::{Base, Encoder, Masks, MemoryOperand, Operand, Register, Work};
use crate::inst::{Array, Binary, Compare, IntCompare, MaskValue, Op, Unary, Value};
use crate::interpret::{self, interpret};
use crate::region::Next;
use proptest::prelude::*;

#[path = "../tests/blocks/regions.rs"]
mod regions;

/// Maximum number of results of a block, which are vectors.
const RESULTS: usize = 400;

enum Step {
    Pointer(Base, u32),
    Load(Register, MemoryOperand),
    Store(Register, MemoryOperand),
    Copy(Register, Register),
    Operate(Op, Register, Vec<Operand>, Vec<Register>),
    Test(Register),
    /// Adds the first word of a register to the offset of a pointer.
    Advance(Base, Register),
    /// To this step if the tested mask had no lane.
    Skip(usize),
    /// To this step if the tested mask had a lane.
    Back(usize),
}

#[derive(Default)]
struct Small<const LANES: usize> {
    steps: Vec<Step>,
    /// The number of steps before the loop.
    start: usize,
}

impl<const LANES: usize> Encoder for Small<LANES> {
    const LANES: usize = LANES;
    const VECTORS: u8 = 10;
    const MASKS: Masks = Masks::Vectors;
    const BASES: u8 = 2;
    const JUMPS: bool = true;

    fn takes(operand: MemoryOperand) -> bool {
        matches!(operand, MemoryOperand::Lanes(..))
    }

    fn work(op: Op) -> (usize, usize) {
        match op {
            Op::LookUp(..) | Op::Gather(..) | Op::NotZero => (2, 0),
            Op::Length => (3, 1),
            Op::Compare(_) => (1, 1),
            _ => (0, 0),
        }
    }

    fn pointer(&mut self, to: Base, array: u32) {
        self.steps.push(Step::Pointer(to, array));
    }

    fn begin(&mut self) {
        self.start = self.steps.len();
    }

    fn load(&mut self, to: Register, from: MemoryOperand) {
        self.steps.push(Step::Load(to, from));
    }

    fn store(&mut self, from: Register, to: MemoryOperand) {
        self.steps.push(Step::Store(from, to));
    }

    fn copy(&mut self, to: Register, from: Register) {
        self.steps.push(Step::Copy(to, from));
    }

    fn operate(&mut self, op: Op, to: Register, args: &[Operand], work: Work<'_>) {
        let work = work.vectors.iter().chain(work.masks).copied().collect();
        self.steps.push(Step::Operate(op, to, args.to_vec(), work));
    }

    fn advance(&mut self, base: Base, offset: Register) {
        self.steps.push(Step::Advance(base, offset));
    }

    fn label(&mut self) -> usize {
        self.steps.len()
    }

    fn test(&mut self, mask: Register) {
        self.steps.push(Step::Test(mask));
    }

    fn skip(&mut self) -> usize {
        self.steps.push(Step::Skip(0));
        self.steps.len() - 1
    }

    fn land(&mut self, skip: usize) {
        self.steps[skip] = Step::Skip(self.steps.len());
    }

    fn jump_back(&mut self, label: usize) {
        self.steps.push(Step::Back(label));
    }

    fn finish(self, _vectors: usize) -> (Vec<u8>, usize) {
        (Vec::new(), self.steps.len())
    }
}

/// The memory and the registers of the machine.
struct Machine<'a, const LANES: usize> {
    arrays: &'a mut [Vec<u32>],
    registers: [[u32; LANES]; 10],
    slots: Vec<[u32; LANES]>,
    bases: [u32; 3],
    /// Words added to the pointers.
    offsets: [u32; 3],
    /// The first current lane.
    lane: usize,
    /// Whether the mask tested last had a lane.
    any: bool,
}

impl<const LANES: usize> Machine<'_, LANES> {
    fn array(&self, base: Base) -> &[u32] {
        &self.arrays[self.bases[usize::from(base.0)] as usize]
    }

    fn read(&self, operand: MemoryOperand) -> [u32; LANES] {
        match operand {
            MemoryOperand::Slot(slot) => self.slots[slot as usize],
            MemoryOperand::Lanes(base, word) => {
                let word = (word + self.offsets[usize::from(base.0)]) as usize;
                std::array::from_fn(|lane| self.array(base)[word + self.lane + lane])
            }
            MemoryOperand::Word(base, word) => [self.array(base)[word as usize]; LANES],
            MemoryOperand::Constant(bits) => [bits; LANES],
            MemoryOperand::Table(..) => panic!("a table is no vector"),
        }
    }

    fn operand(&self, operand: Operand) -> [u32; LANES] {
        match operand {
            Operand::Register(Register::Vector(number)) => self.registers[usize::from(number)],
            Operand::Register(Register::Mask(_)) => panic!("there are no such registers"),
            Operand::Memory(operand) => {
                assert!(Small::<LANES>::takes(operand));
                self.read(operand)
            }
        }
    }

    /// Runs steps from one on, up to the last.
    fn run_all(&mut self, steps: &[Step], start: usize) {
        let mut at = start;
        while let Some(step) = steps.get(at) {
            at = match *step {
                Step::Skip(to) if !self.any => to,
                Step::Back(to) if self.any => to,
                _ => at + 1,
            };
            self.run(step);
        }
    }

    fn run(&mut self, step: &Step) {
        match step {
            Step::Test(mask) => self.any = self.registers[usize::from(mask.number())] != [0; LANES],
            Step::Skip(_) | Step::Back(_) => {}
            Step::Pointer(base, array) => {
                self.bases[usize::from(base.0)] = *array;
                self.offsets[usize::from(base.0)] = 0;
            }
            Step::Advance(base, offset) => {
                self.offsets[usize::from(base.0)] += self.registers[usize::from(offset.number())][0];
            }
            Step::Load(to, from) => self.registers[usize::from(to.number())] = self.read(*from),
            Step::Copy(to, from) => {
                self.registers[usize::from(to.number())] = self.registers[usize::from(from.number())];
            }
            Step::Store(from, to) => {
                let words = self.registers[usize::from(from.number())];
                match *to {
                    MemoryOperand::Slot(slot) => self.slots[slot as usize] = words,
                    MemoryOperand::Lanes(base, word) => {
                        let array = self.bases[usize::from(base.0)] as usize;
                        let at = (word + self.offsets[usize::from(base.0)]) as usize + self.lane;
                        self.arrays[array][at..at + LANES].copy_from_slice(&words);
                    }
                    _ => panic!("{to:?} is not written"),
                }
            }
            Step::Operate(op, to, args, work) => self.operate(*op, *to, args, work),
        }
    }

    fn operate(&mut self, op: Op, to: Register, args: &[Operand], work: &[Register]) {
        // The operation may overwrite these before it reads its operands.
        let operands = |machine: &Self| -> Vec<[u32; LANES]> {
            let in_place =
                args.iter().filter(|arg| !matches!(arg, Operand::Memory(MemoryOperand::Table(..))));
            in_place.map(|arg| machine.operand(*arg)).collect()
        };
        let before = operands(self);
        work.iter().for_each(|register| self.registers[usize::from(register.number())] = [0xBAD; LANES]);
        assert_eq!(before, operands(self), "{op:?} overwrites its operands");
        let old = self.registers[usize::from(to.number())];
        let mask = |truth: bool| if truth { u32::MAX } else { 0 };
        let result = std::array::from_fn(|lane| {
            let arg = |n: usize| before[n][lane];
            match op {
                Op::Unary(op) => interpret::unary(op, arg(0)),
                Op::Binary(op) => interpret::binary(op, arg(0), arg(1)),
                Op::LookUp(..) | Op::Gather(..) => {
                    let Some(Operand::Memory(MemoryOperand::Table(base, word))) = args.last() else {
                        panic!("no table")
                    };
                    self.array(*base)[(word + arg(0)) as usize]
                }
                Op::Compare(how) => mask(interpret::compare(how, arg(0), arg(1))),
                Op::IntCompare(how) => mask(interpret::compare_ints(how, arg(0), arg(1))),
                Op::NotZero => mask(arg(0) != 0),
                Op::MaskAnd => arg(0) & arg(1),
                Op::MaskOr => arg(0) | arg(1),
                Op::MaskNot => !arg(0),
                Op::Choose => (arg(2) & arg(0)) | (arg(1) & !arg(0)),
                Op::Fused { less } => {
                    let [x, y, z] = [old[lane], arg(0), arg(1)].map(f32::from_bits);
                    (if less { -y } else { y }).mul_add(z, x).to_bits()
                }
                Op::Length => interpret::length(arg(1), [arg(2), arg(3), arg(4)]),
                Op::Number => arg(0) & 1,
                other => panic!("{other:?} is not among those of the test"),
            }
        });
        self.registers[usize::from(to.number())] = result;
    }
}

/// A block of operations chosen by numbers, over an array of lanes and one of words.
fn block(steps: &[[usize; 4]], lanes: usize) -> Block {
    let mut block = Block::new();
    let (array, table, results) = (block.array(), block.array(), block.array());
    let mut values = vec![block.lanes(array, 0), block.word(table, 1)];
    let mut masks = vec![block.not_zero(values[0])];
    for [what, a, b, c] in steps {
        let value = |n: &usize| values[n % values.len()];
        let mask = |n: &usize| masks[n % masks.len()];
        let (x, y, z, place) = (value(a), value(b), value(c), (a % 5 * lanes) as u32);
        let mut found = None;
        match what % 14 {
            0 => found = Some(block.lanes(array, place)),
            1 => found = Some(block.word(table, *a as u32 % 20)),
            2 => found = Some(block.bits(*a as u32)),
            3 => block.store(array, place, x, b % 3 > 0),
            4 => {
                let fifteen = block.bits(15);
                let index = block.binary(Binary::And, x, fifteen);
                found = Some(block.look_up(table, 2, index));
            }
            5 => masks.push(block.compare(Compare::LessOrNan, x, y)),
            6 => masks.push(block.compare_ints(IntCompare::Less, x, y)),
            7 => masks.push(block.both(mask(a), mask(b))),
            8 => masks.push(block.either(mask(a), mask(b))),
            9 => masks.push(block.not(mask(a))),
            10 => found = Some(block.choose(mask(a), y, z)),
            11 => found = Some(block.fused(x, [y, z], b % 2 == 0)),
            12 => {
                let square = block.binary(Binary::IntAdd, x, y);
                found = Some(block.length(square, [x, y, z]));
            }
            // Sums and products of floats may exchange operands, so that the bits of a NaN depend on it.
            _ => {
                let op = [Binary::Sub, Binary::Min, Binary::IntAdd, Binary::Xor, Binary::IntMul][a % 5];
                found = Some(if b % 4 == 0 { block.unary(Unary::Floor, x) } else { block.binary(op, x, y) });
            }
        }
        values.extend(found);
    }
    store_all(&mut block, results, &values, &masks, lanes);
    block
}

/// Stores everything, so that many values are live at once.
fn store_all(block: &mut Block, array: Array, values: &[Value], masks: &[MaskValue], lanes: usize) {
    let mut place = 0;
    let numbers: Vec<Value> = masks.iter().map(|mask| block.number(*mask)).collect();
    for value in values.iter().chain(&numbers) {
        block.store(array, place, *value, true);
        place += lanes as u32;
    }
}

fn runs_as_interpreted<const LANES: usize>(block: &Block, seed: u32) {
    let lanes = 16;
    let mut state = seed | 1;
    let mut words = |count: usize| -> Vec<u32> {
        let next = || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            if state.is_multiple_of(2) { state } else { (state as f32 / 1e9 - 2.0).to_bits() }
        };
        std::iter::repeat_with(next).take(count).collect()
    };
    let mut arrays = [words(5 * lanes), words(20), vec![0; RESULTS * lanes], words(5 * lanes)];
    let mut expected = arrays.clone();
    let mut lent: Vec<Words<'_>> = expected.iter_mut().map(|array| Words::Write(array)).collect();
    assert_eq!(interpret(block, &mut lent, 0..lanes), Some(()));
    let (code, slots) = allocate::<Small<LANES>>(block);
    let mut machine = Machine {
        arrays: &mut arrays,
        registers: [[0xBAD; LANES]; 10],
        slots: vec![[0xBAD; LANES]; slots],
        bases: [0; 3],
        offsets: [0; 3],
        lane: 0,
        any: false,
    };
    code.steps[..code.start].iter().for_each(|step| machine.run(step));
    while machine.lane < lanes {
        machine.run_all(&code.steps, code.start);
        machine.lane += LANES;
    }
    assert_eq!(arrays[0], expected[0]);
    assert_eq!(arrays[3], expected[3]);
    for place in 0..RESULTS {
        assert_eq!(arrays[2][place * lanes..][..lanes], expected[2][place * lanes..][..lanes], "{place}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn blocks_run_on_any_number_of_lanes(
        steps in prop::collection::vec(prop::array::uniform4(0usize..1 << 20), 1..120),
        seed in any::<u32>(),
    ) {
        let block = block(&steps, 16);
        runs_as_interpreted::<4>(&block, seed);
        runs_as_interpreted::<8>(&block, seed);
    }

    #[test]
    fn regions_run_with_few_registers(
        steps in prop::collection::vec(0u32..1 << 20, 8..400),
        seed in any::<u32>(),
    ) {
        let block = regions::block(&steps, 16);
        if carries::<Small<4>>(&block) {
            runs_as_interpreted::<4>(&block, seed);
            runs_as_interpreted::<8>(&block, seed);
        }
    }
}
