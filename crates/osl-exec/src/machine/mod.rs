//! The machine: the registers of one thread, and the execution of steps over them.
//!
//! A step works on all lanes; the mask of active lanes only determines which lanes are copied where paths
//! join and which are stored to arrays. A lane register is taken out of the file while it is written, so that
//! a step can borrow its arguments at the same time as its result.

mod array;
mod checks;
mod closure;
mod color;
mod dictionary;
mod flow;
mod hash;
mod inverse;
mod kernels;
mod lane;
mod mask;
mod memo;
mod named;
mod noise;
mod per_cell;
mod point;
mod profiled;
mod region;
mod report;
mod runs;
mod text;
mod texture;
mod texture_info;
mod work;

use crate::arithmetic::ArithmeticImpl;
use crate::dictionary::{Dictionaries, Documents};
use crate::error::RunError;
use crate::lanes::Ready;
use crate::message::{Messages, Room};
use crate::native;
use crate::options::RunOptions;
use crate::profile::Profile;
use crate::program::Program;
use crate::register::{LINE, Lanes};
use crate::services::Services;
use crate::source::PointSource;
use crate::step::{Array, Location, Operand, OutputSource, Step, Steps};
pub(crate) use mask::Mask;
pub use noise::noise_kind;
use osl_ir::ir::{Const, Kind, MAX_ARGS};
use osl_lanes::{Arg, Word};
use osl_limits::Limits;
use osl_simd::{Isa, Kernel};

/// Lanes are computed in multiples of this number: pairs of the widest vectors.
const VECTORS: usize = 32;

/// The registers and working memory of one thread.
pub(crate) struct Machine<'a, A: ArithmeticImpl> {
    program: &'a Program,
    services: &'a Services,
    isa: Isa,
    /// Lanes per batch: a multiple of a cache line.
    width: usize,
    /// Number of lanes that lane operations compute: those with a point, and some more for whole vectors.
    lanes: usize,
    registers: Vec<Lanes<A::Word>>,
    per_cell: per_cell::PerCell<'a, A::Word>,
    words: Vec<A::Word>,
    arrays: Vec<Lanes<A::Word>>,
    scratch: Vec<Lanes<A::Word>>,
    /// The elements that the lanes load from an array.
    places: Vec<u32>,
    /// An attribute of all lanes.
    column: Vec<u32>,
    /// Single arguments of a lane operation, broadcast to lanes.
    broadcasts: [Vec<A::Word>; MAX_ARGS],
    /// The result of a uniform lane operation.
    single: Lanes<A::Word>,
    /// Queued lane operations.
    queue: lane::Queue<'a>,
    /// Queued operations with resolved arguments.
    ready: Vec<Ready>,
    /// Sequences of lane operations that have occurred, unless everything runs without machine code.
    native: Option<native::PlanCache>,
    /// Branches and loops, and their machine code.
    regions: Vec<region::State>,
    /// For regions: their uniform results for each lane, the arrays as they were, the numbers of the lanes.
    region_memory: (Vec<u32>, Vec<A::Word>),
    region_numbers: Vec<u32>,
    limits: &'a Limits,
    /// The cost of the batch so far.
    work: work::Work,
    /// Which steps with the same result in every batch have run.
    lasting: Vec<bool>,
    /// Whether a batch has been run.
    ran: bool,
    /// The source of the points.
    source: &'a dyn PointSource,
    /// The point of the first lane, and the number of lanes with a point of their own.
    first: usize,
    points: usize,
    texts: text::Texts,
    /// The latest results of the current kernel.
    memo: memo::Memo<A::Word>,
    closures: closure::Closures,
    dictionaries: Dictionaries<'a>,
    named: named::Named<A::Word>,
    /// The regular expression that each lane used last. Two more follow: the last one that all lanes had in
    /// common, and the last one of this machine.
    patterns: Vec<u32>,
    /// Which blocks of each array contain more than zeros.
    dirty: Vec<Vec<bool>>,
    pub(crate) messages: Messages,
    /// The measured times, if the run is profiled.
    pub(crate) profile: Option<Box<Profile>>,
}

/// Writes what a function makes of the word of each lane.
struct Each<'s, W, F> {
    lanes: &'s [W],
    out: &'s mut [u32],
    of: F,
}

impl<W: Copy, F: Fn(W) -> u32> Kernel for Each<'_, W, F> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.out.iter_mut().zip(self.lanes).for_each(|(to, word)| *to = (self.of)(*word));
    }
}

impl<'a, A: ArithmeticImpl> Machine<'a, A> {
    /// A machine for batches of up to `width` points.
    pub(crate) fn new(
        program: &'a Program,
        services: &'a Services,
        source: &'a dyn PointSource,
        width: usize,
        options: &'a RunOptions,
        documents: &'a Documents,
    ) -> Self {
        let (isa, native) = (options.isa, options.native);
        let width = if width <= 1 { 1 } else { width.next_multiple_of(LINE) };
        let array = |a: &Array| Lanes::new((a.words * a.len) as usize * if a.varying { width } else { 1 });
        Machine {
            program,
            services,
            isa,
            width,
            lanes: width,
            registers: lane::registers(&program.registers, width),
            per_cell: per_cell::PerCell::new(program, width),
            words: program.words.iter().map(|seed| seed.word::<A>()).collect(),
            arrays: program.arrays.iter().map(array).collect(),
            scratch: (0..16).map(|_| Lanes::new(width)).collect(),
            places: Vec::new(),
            column: Vec::new(),
            broadcasts: Default::default(),
            single: Lanes::new(LINE),
            queue: lane::Queue::default(),
            ready: Vec::new(),
            native: A::NATIVE.and_then(|_| native::PlanCache::new(native, isa)),
            regions: region::states(program),
            region_memory: Default::default(),
            region_numbers: Vec::new(),
            limits: &options.limits,
            work: work::Work::default(),
            lasting: vec![false; program.lasting as usize],
            ran: false,
            source,
            first: 0,
            points: 0,
            texts: text::Texts::default(),
            memo: memo::Memo::default(),
            closures: closure::Closures::default(),
            dictionaries: Dictionaries::new(documents),
            named: named::Named::default(),
            patterns: Vec::new(),
            dirty: program.arrays.iter().map(|a| vec![false; array::blocks(a)]).collect(),
            messages: Messages::new(
                source.blocks(),
                options.keeping.clone(),
                Room::of(&options.limits.running),
            ),
            profile: None,
        }
    }

    /// Number of lanes.
    pub(crate) fn width(&self) -> usize {
        self.width
    }

    /// Runs the program for `points` points from `first` on, at most as many as the batch is wide. `each`
    /// means that the cost of every point is counted separately.
    ///
    /// # Errors
    /// A single point exceeds its limits; or one of several points does, and it is not known which.
    pub(crate) fn run(&mut self, first: usize, points: usize, each: bool) -> Result<(), RunError> {
        let source = self.source;
        if let Some(why) = self.limits.halted() {
            return Err(RunError::Halted(why));
        }
        if self.program.uniform && self.ran && !self.messages.keeps_each() {
            // It contains the results of every point.
            return Ok(());
        }
        self.messages.begin(first);
        let program = self.program;
        self.work.begin(self.limits, (points, program.base), each);
        self.queue.clear();
        self.per_cell.clear();
        (self.first, self.points) = (first, points);
        // A uniform program computes the results of later batches too.
        self.lanes =
            if program.uniform { self.width } else { points.next_multiple_of(VECTORS).min(self.width) };
        self.texts.clear();
        self.closures.clear();
        self.named.clear();
        self.dictionaries.clear();
        self.patterns.clear();
        self.clear_arrays();
        for (global, operand) in &program.globals {
            match operand.location {
                Location::Lanes { reg, .. } if source.varying().contains(global) => {
                    let width = self.width;
                    let lanes =
                        &mut self.registers[reg as usize].words_mut()[..operand.words as usize * width];
                    A::fill(lanes, |lanes| source.fill(*global, first, width, lanes));
                }
                _ => self.broadcast(source.uniform(*global), *operand),
            }
        }
        for (global, axis, operand) in &program.derivs {
            match operand.location {
                Location::Lanes { reg, .. } if source.varying_derivs().contains(global) => {
                    let width = self.width;
                    let lanes =
                        &mut self.registers[reg as usize].words_mut()[..operand.words as usize * width];
                    A::fill(lanes, |lanes| source.fill_deriv(*global, *axis, first, width, lanes));
                }
                _ => self.broadcast(source.deriv(*global, *axis), *operand),
            }
        }
        self.steps(&program.steps, &Mask::start(points, self.width))?;
        self.within_limits(None)?;
        self.ran = true;
        Ok(())
    }

    /// Whether a step with the same result in every batch has run. From now on, it has.
    fn has_lasted(&mut self, number: u32) -> bool {
        self.lasting.get_mut(number as usize).is_some_and(|ran| std::mem::replace(ran, true))
    }

    /// Sets a location to uniform values.
    fn broadcast(&mut self, value: [f32; 3], operand: Operand) {
        for (component, x) in value.into_iter().enumerate().take(operand.words as usize) {
            match operand.location {
                Location::Words(at) => self.words[at as usize + component] = A::of(x),
                Location::Lanes { reg, .. } => {
                    self.registers[reg as usize].words_mut()[component * self.width..][..self.width]
                        .fill(A::of(x));
                }
            }
        }
    }

    /// Writes component `component` of an output's element `element` for the first points into `out`, and
    /// floats in double precision into `wide` if that has room. Every NaN becomes one canonical word, because
    /// its payload depends on the instruction set.
    pub(crate) fn output(
        &self,
        (output, element, component): (usize, usize, usize),
        out: &mut [u32],
        wide: &mut [f64],
    ) {
        let Some(plan) = self.program.outputs.get(output) else { return };
        let lanes = self.output_lanes(plan.source, element, component);
        let word = |lane: usize| match lanes {
            Arg::Same(word) => word[0],
            Arg::Each(lanes) => lanes[lane],
        };
        if !matches!(plan.kind, Kind::Float | Kind::Triple | Kind::Matrix) {
            out.iter_mut().enumerate().for_each(|(lane, to)| *to = word(lane).bits());
            wide.iter_mut().zip(out).for_each(|(to, from)| *to = f64::from(*from as i32));
            return;
        }
        let single = |word: A::Word| {
            let x = A::single(word);
            if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() }
        };
        match lanes {
            Arg::Same(word) => out.fill(single(word[0])),
            Arg::Each(lanes) => self.isa.dispatch(Each { lanes, out, of: single }),
        }
        for (lane, to) in wide.iter_mut().enumerate() {
            let x = A::double(word(lane));
            *to = if x.is_nan() { f64::NAN } else { x };
        }
    }

    fn output_lanes(&self, source: OutputSource, element: usize, component: usize) -> Arg<'_, A::Word> {
        match source {
            OutputSource::Value(operand) => self.arg(self.part(operand, component)),
            OutputSource::Array(array) => {
                let slot = self.program.arrays[array as usize];
                let at = element * slot.words as usize + component;
                let words = self.arrays[array as usize].words();
                if slot.varying {
                    Arg::Each(&words[at * self.width..][..self.width])
                } else {
                    Arg::Same(&words[at..])
                }
            }
        }
    }

    fn steps(&mut self, steps: &'a Steps, mask: &Mask) -> Result<(), RunError> {
        self.spend(steps.weight, mask);
        if self.profile.is_some() {
            return self.profiled(steps, mask);
        }
        self.follow(&steps.list, mask)?;
        self.run_queue();
        Ok(())
    }

    #[inline(always)]
    pub(crate) fn step(&mut self, step: &'a Step, mask: &Mask) -> Result<(), RunError> {
        match step {
            Step::Lane(step) => {
                self.queue(step);
                self.run_queue();
            }
            Step::Kernel(step) => {
                self.kernel(step, mask);
                self.spend_kernel(0, mask);
                self.within_limits(Some(step.span))?;
            }
            Step::Load(step) => self.load(step.array, step.index, step.out),
            Step::Store(step) => self.store(step.array, step.index, step.value, mask),
            Step::If { lasting, .. } if self.has_lasted(*lasting) => self.spend_again(step, mask),
            Step::If { region, cond, then, otherwise, results, .. } => {
                let varies = matches!(cond.location, Location::Lanes { .. });
                if !varies || !self.region(*region, step, mask)? {
                    self.branch(*cond, then, otherwise, results, mask)?
                }
            }
            Step::Loop { region, params, body, cond, span } => {
                if !self.region(*region, step, mask)? {
                    let before = self.work.spent;
                    self.round(params, body, *cond, *span, mask)?;
                    self.note_region(*region, self.work.spent.saturating_sub(before));
                }
            }
            Step::FindCells { group, roots, outs, exports } => {
                self.find_cells(*group, roots, outs, mask);
                self.export_roots(*group, roots, outs, exports);
            }
            Step::PerCell { group, steps, exports, inputs } => {
                self.per_cell(*group, steps, (exports, inputs.as_ref()), mask)?;
                self.run_queue();
            }
        }
        Ok(())
    }

    #[inline]
    fn arg(&self, operand: Operand) -> Arg<'_, A::Word> {
        let words = operand.words as usize;
        match operand.location {
            Location::Words(at) => Arg::Same(&self.words[at as usize..][..words]),
            Location::Lanes { reg, component, cells } => {
                if let Some(lanes) = cells.and_then(|cells| self.per_cell.by_all(cells)) {
                    return Arg::Same(&lanes[component as usize..][..words]);
                }
                let lanes = self.registers[self.per_cell.register(reg, cells)].words();
                Arg::Each(&lanes[component as usize * self.width..][..words * self.width])
            }
        }
    }

    /// One component of an operand; a single component stands for all.
    fn component(&self, operand: Operand, component: usize) -> Arg<'_, A::Word> {
        if operand.words == 1 {
            return self.arg(operand);
        }
        self.arg(self.part(operand, component))
    }

    /// One word of an operand at one lane.
    pub(crate) fn word(&self, operand: Operand, lane: usize) -> A::Word {
        match self.arg(operand) {
            Arg::Same(word) => word[0],
            Arg::Each(lanes) => lanes[lane],
        }
    }

    /// An int, or the number of a string or closure, at one lane.
    fn bits(&self, operand: Operand, lane: usize) -> u32 {
        self.word(operand, lane).bits()
    }

    /// A float at one lane, in single precision.
    fn single(&self, operand: Operand, lane: usize) -> f32 {
        A::single(self.word(operand, lane))
    }

    /// A triple at one lane, in single precision.
    fn singles(&self, operand: Operand, lane: usize) -> [f32; 3] {
        [0, 1, 2].map(|c| self.single(self.part(operand, c), lane))
    }

    /// A value at one lane.
    pub(crate) fn value(&self, operand: Operand, kind: Kind, lane: usize) -> Const {
        let float = |c: usize| self.single(self.part(operand, c), lane);
        match kind {
            Kind::Int => Const::Int(self.bits(operand, lane) as i32),
            Kind::Float => Const::Float(float(0)),
            Kind::Triple => Const::Triple([float(0), float(1), float(2)]),
            Kind::Matrix => Const::Matrix(Box::new(std::array::from_fn(float))),
            Kind::Str => Const::Str(self.text(self.bits(operand, lane))),
            Kind::Closure => Const::Null,
        }
    }

    fn values(&self, args: &[Operand], kinds: &[Kind], lane: usize) -> Vec<Const> {
        args.iter().zip(kinds).map(|(a, k)| self.value(*a, *k, lane)).collect()
    }

    /// One component of an operand with several.
    pub(crate) fn part(&self, operand: Operand, component: usize) -> Operand {
        let component = component as u32;
        let location = match operand.location {
            Location::Words(at) => Location::Words(at + component),
            Location::Lanes { reg, component: base, cells } => {
                Location::Lanes { reg, component: base + component, cells }
            }
        };
        let kind = if operand.words > 1 { Kind::Float } else { operand.kind };
        Operand { location, words: 1, kind }
    }

    /// Writes the words of a value at one lane, or for all lanes if the location is uniform.
    fn set_words(&mut self, out: Operand, lane: usize, words: &[A::Word]) {
        self.set_each(out, lane, words.iter().copied());
    }

    /// Writes at most as many words as the operand has.
    #[inline(always)]
    fn set_each(&mut self, out: Operand, lane: usize, words: impl Iterator<Item = A::Word>) {
        let words = words.take(out.words as usize);
        match out.location {
            Location::Words(at) => {
                let own = self.words[at as usize..].iter_mut();
                own.zip(words).for_each(|(to, word)| *to = word);
            }
            Location::Lanes { reg, component, cells } => {
                let own = self.registers[self.per_cell.register(reg, cells)].words_mut();
                let first = component as usize * self.width + lane;
                words.enumerate().for_each(|(part, word)| own[first + part * self.width] = word);
            }
        }
    }

    /// Writes an int, or the number of a string or closure.
    fn set_bits(&mut self, out: Operand, lane: usize, bits: u32) {
        self.set_words(out, lane, &[A::Word::of(bits)]);
    }

    /// Writes floats.
    fn set_floats(&mut self, out: Operand, lane: usize, floats: &[f32]) {
        self.set_each(out, lane, floats.iter().map(|x| A::of(*x)));
    }

    fn set_value(&mut self, out: Operand, lane: usize, value: &Const) {
        match value {
            Const::Int(n) => self.set_bits(out, lane, *n as u32),
            Const::Float(x) => self.set_floats(out, lane, &[*x]),
            Const::Triple(t) => self.set_floats(out, lane, t),
            Const::Matrix(m) => self.set_floats(out, lane, &m[..]),
            Const::Str(s) => {
                let number = self.intern(s);
                self.set_bits(out, lane, number);
            }
            Const::Null => self.set_bits(out, lane, 0),
        }
    }

    /// The lanes at which a kernel has to compute: the active ones, or any one of them if the result is
    /// uniform.
    fn lanes(&self, outs: &[Operand], mask: &Mask) -> Vec<usize> {
        let mut lanes = self.active(mask);
        if report::are_uniform(outs) {
            lanes.truncate(1);
        }
        lanes
    }

    /// Number of lanes for which a step runs.
    pub(crate) fn lanes_in(&self, mask: &Mask) -> u64 {
        let mut lanes = 0;
        mask.for_each(|_| lanes += 1);
        lanes
    }

    /// The active lanes with a point of their own.
    pub(crate) fn active(&self, mask: &Mask) -> Vec<usize> {
        let mut lanes = Vec::new();
        mask.for_each(|lane| {
            if lane < self.points {
                lanes.push(lane);
            }
        });
        lanes
    }

    /// Takes the words of a result out of the machine.
    fn take(&mut self, out: Operand) -> Target<A::Word> {
        match out.location {
            Location::Words(_) => Target::Few([A::Word::default(); 16], out.words as usize),
            Location::Lanes { reg, component, cells } => Target::Lanes(
                std::mem::take(&mut self.registers[self.per_cell.register(reg, cells)]),
                component as usize * self.width,
            ),
        }
    }

    fn put(&mut self, out: Operand, target: Target<A::Word>) {
        match (out.location, target) {
            (Location::Words(at), Target::Few(few, n)) => {
                self.words[at as usize..][..n].copy_from_slice(&few[..n])
            }
            (Location::Lanes { reg, cells, .. }, Target::Lanes(lanes, _)) => {
                self.registers[self.per_cell.register(reg, cells)] = lanes;
            }
            _ => {}
        }
    }

    /// Copies a value to another location at the active lanes; at all lanes if the target is uniform.
    fn copy(&mut self, from: Operand, to: Operand, mask: &Mask) {
        if from.location == to.location {
            return;
        }
        let mut target = self.take(to);
        let n = if matches!(to.location, Location::Words(_)) { 1 } else { self.width };
        for (component, lanes) in target.chunks_mut(n).enumerate().take(to.words as usize) {
            match self.component(from, component) {
                Arg::Each(words) if n == words.len() => mask.copy(self.isa, lanes, words),
                Arg::Each(words) | Arg::Same(words) if n == 1 => lanes.copy_from_slice(&words[..1]),
                Arg::Each(_) => {}
                Arg::Same(word) => mask.fill(self.isa, lanes, word[0]),
            }
        }
        self.put(to, target);
    }
}

/// The words of a result while they are written.
enum Target<W> {
    /// A uniform value: its words and their number.
    Few([W; 16], usize),
    /// A register, and the word at which the result starts.
    Lanes(Lanes<W>, usize),
    /// No result.
    None,
}

impl<W: Word> Target<W> {
    fn chunks_mut(&mut self, n: usize) -> std::slice::ChunksMut<'_, W> {
        match self {
            Target::Few(few, words) => few[..*words].chunks_mut(n),
            Target::Lanes(lanes, start) => lanes.words_mut()[*start..].chunks_mut(n),
            Target::None => [].chunks_mut(n),
        }
    }
}
