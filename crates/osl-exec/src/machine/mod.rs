//! The machine: one thread's registers, and the steps run over them.
//!
//! A step works on all lanes; the mask of active lanes decides only what is copied where paths meet and what is
//! stored in arrays. Lane registers are taken out of the file while they are written, so that a step
//! borrows its arguments beside its result.

mod kernels;
mod mask;

use crate::lanes::{self, Arg, LaneCall};
use crate::message::Messages;
use crate::program::{Array, LoopParam, Operand, OutputPlan, OutputSource, Place, Program, Step};
use crate::register::{LINE, Lanes};
use crate::services::Services;
use crate::source::PointSource;
use mask::Mask;
use osl_ir::Span;
use osl_ir::ir::LaneOp;
use osl_noise::Isa;

/// Why a run stopped.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Stop {
    /// A loop went on beyond its budget.
    #[error("a loop ran more than {rounds} rounds")]
    TooManyRounds {
        /// The budget.
        rounds: u64,
        /// The loop.
        span: Span,
    },
}

/// The registers and working memory of one thread.
pub(crate) struct Machine<'a> {
    program: &'a Program,
    services: &'a Services,
    isa: Isa,
    /// Lanes of a batch: a multiple of a cache line.
    width: usize,
    registers: Vec<Lanes>,
    words: Vec<u32>,
    arrays: Vec<Lanes>,
    scratch: Vec<Lanes>,
    max_rounds: u64,
    rounds: u64,
    pub(crate) messages: Messages,
}

impl<'a> Machine<'a> {
    /// A machine for batches of up to `width` points.
    pub(crate) fn new(
        program: &'a Program,
        services: &'a Services,
        isa: Isa,
        width: usize,
        max_rounds: u64,
    ) -> Self {
        let width = width.max(1).next_multiple_of(LINE);
        let array = |a: &Array| Lanes::new((a.words * a.len) as usize * if a.varying { width } else { 1 });
        Machine {
            program,
            services,
            isa,
            width,
            registers: program.registers.iter().map(|words| Lanes::new(*words as usize * width)).collect(),
            words: program.words.clone(),
            arrays: program.arrays.iter().map(array).collect(),
            scratch: (0..6).map(|_| Lanes::new(3 * width)).collect(),
            max_rounds,
            rounds: 0,
            messages: Messages::default(),
        }
    }

    /// Runs the program for the points from `first` on, at most as many as the batch is wide.
    pub(crate) fn run(&mut self, source: &dyn PointSource, first: usize) -> Result<(), Stop> {
        self.rounds = 0;
        for array in &mut self.arrays {
            array.words_mut().fill(0);
        }
        let program = self.program;
        for (global, operand) in &program.globals {
            match operand.place {
                Place::Lanes { reg, .. } if source.varying().contains(global) => {
                    let lanes = crate::register::floats_mut(self.registers[reg as usize].words_mut());
                    source.fill(
                        *global,
                        first,
                        self.width,
                        &mut lanes[..operand.words as usize * self.width],
                    );
                }
                _ => self.spread(source.uniform(*global), *operand),
            }
        }
        for (global, axis, operand) in &program.slopes {
            self.spread(source.slope(*global, *axis), *operand);
        }
        self.steps(&program.steps, &Mask::all(self.width))
    }

    /// Sets a place to values that all points share.
    fn spread(&mut self, value: [f32; 3], operand: Operand) {
        for (component, x) in value.into_iter().enumerate().take(operand.words as usize) {
            match operand.place {
                Place::Words(at) => self.words[at as usize + component] = x.to_bits(),
                Place::Lanes { reg, .. } => {
                    self.registers[reg as usize].words_mut()[component * self.width..][..self.width]
                        .fill(x.to_bits());
                }
            }
        }
    }

    /// Copies component `component` of an output's element `element` for the first points into `out`.
    pub(crate) fn output(&self, plan: &OutputPlan, element: usize, component: usize, out: &mut [u32]) {
        match plan.source {
            OutputSource::Value(operand) => match operand.place {
                Place::Words(at) => out.fill(self.words[at as usize + component]),
                Place::Lanes { reg, component: base } => {
                    let lanes =
                        &self.registers[reg as usize].words()[(base as usize + component) * self.width..];
                    out.copy_from_slice(&lanes[..out.len()]);
                }
            },
            OutputSource::Array(array) => {
                let plan = self.program.arrays[array as usize];
                let at = element * plan.words as usize + component;
                let words = self.arrays[array as usize].words();
                if plan.varying {
                    out.copy_from_slice(&words[at * self.width..][..out.len()]);
                } else {
                    out.fill(words[at]);
                }
            }
        }
    }

    fn steps(&mut self, steps: &[Step], mask: &Mask) -> Result<(), Stop> {
        for step in steps {
            match step {
                Step::Lane { op, args, out } => self.lane(*op, args, *out),
                Step::Kernel { kernel, args, out, span } => self.kernel(kernel, args, *out, *span, mask),
                Step::Load { array, index, out } => self.load(*array, *index, *out),
                Step::Store { array, index, value } => self.store(*array, *index, *value, mask),
                Step::If { cond, then, otherwise, results } => {
                    self.branch(*cond, then, otherwise, results, mask)?
                }
                Step::Loop { params, body, cond, span } => self.round(params, body, *cond, *span, mask)?,
            }
        }
        Ok(())
    }

    fn arg(&self, operand: Operand) -> Arg<'_> {
        let words = operand.words as usize;
        match operand.place {
            Place::Words(at) => Arg::Same(&self.words[at as usize..][..words]),
            Place::Lanes { reg, component } => {
                let lanes = self.registers[reg as usize].words();
                Arg::Each(&lanes[component as usize * self.width..][..words * self.width])
            }
        }
    }

    /// One component of an operand; one of a single component stands for every one.
    fn component(&self, operand: Operand, component: usize) -> Arg<'_> {
        if operand.words == 1 {
            return self.arg(operand);
        }
        let component = component as u32;
        let place = match operand.place {
            Place::Words(at) => Place::Words(at + component),
            Place::Lanes { reg, component: base } => Place::Lanes { reg, component: base + component },
        };
        self.arg(Operand { place, words: 1 })
    }

    fn lane(&mut self, op: LaneOp, args: &[Operand], out: Operand) {
        let (_, result) = lanes::words(op);
        let n = if matches!(out.place, Place::Words(_)) { 1 } else { self.width };
        let parts = out.words as usize / result;
        let mut target = self.take(out);
        let mut list = [Arg::Same(&[]); 4];
        for (part, chunk) in target.chunks_mut(n * result).enumerate().take(parts) {
            for (slot, arg) in list.iter_mut().zip(args) {
                *slot = if parts > 1 { self.component(*arg, part) } else { self.arg(*arg) };
            }
            let args = &list[..args.len().min(list.len())];
            lanes::run(self.isa, LaneCall { op, args, out: chunk, n });
        }
        self.put(out, target);
    }

    /// Takes the words of a result out of the machine.
    fn take(&mut self, out: Operand) -> Target {
        match out.place {
            Place::Words(_) => Target::Few([0; 16], out.words as usize),
            Place::Lanes { reg, component } => Target::Lanes(
                std::mem::take(&mut self.registers[reg as usize]),
                component as usize * self.width,
            ),
        }
    }

    fn put(&mut self, out: Operand, target: Target) {
        match (out.place, target) {
            (Place::Words(at), Target::Few(few, n)) => {
                self.words[at as usize..][..n].copy_from_slice(&few[..n])
            }
            (Place::Lanes { reg, .. }, Target::Lanes(lanes, _)) => self.registers[reg as usize] = lanes,
            _ => {}
        }
    }

    /// Copies a value to another place at the active lanes; all lanes where the target is shared.
    fn copy(&mut self, from: Operand, to: Operand, mask: &Mask) {
        let mut target = self.take(to);
        let n = if matches!(to.place, Place::Words(_)) { 1 } else { self.width };
        for (component, lanes) in target.chunks_mut(n).enumerate().take(to.words as usize) {
            match self.component(from, component) {
                Arg::Each(words) if n == words.len() => mask.copy(lanes, words),
                Arg::Each(words) | Arg::Same(words) if n == 1 => lanes.copy_from_slice(&words[..1]),
                Arg::Each(_) => {}
                Arg::Same(word) => mask.fill(lanes, word[0]),
            }
        }
        self.put(to, target);
    }

    fn load(&mut self, array: u32, index: Operand, out: Operand) {
        let plan = self.program.arrays[array as usize];
        let width = self.width;
        let mut target = self.take(out);
        let lanes_of = if plan.varying { width } else { 1 };
        let source = self.arrays[array as usize].words();
        let last = plan.len.saturating_sub(1);
        let words = plan.words as usize;
        let n = if matches!(out.place, Place::Words(_)) { 1 } else { width };
        match self.arg(index) {
            Arg::Same(i) => {
                let at = i[0].min(last) as usize * words;
                for (component, lanes) in target.chunks_mut(n).enumerate().take(words) {
                    let from = &source[(at + component) * lanes_of..][..lanes_of];
                    if lanes_of == n { lanes.copy_from_slice(from) } else { lanes.fill(from[0]) }
                }
            }
            Arg::Each(indices) => {
                for (component, lanes) in target.chunks_mut(n).enumerate().take(words) {
                    for (lane, (o, i)) in lanes.iter_mut().zip(indices).enumerate() {
                        let at = (*i).min(last) as usize * words + component;
                        *o = source[if plan.varying { at * width + lane } else { at }];
                    }
                }
            }
        }
        self.put(out, target);
    }

    fn store(&mut self, array: u32, index: Operand, value: Operand, mask: &Mask) {
        let plan = self.program.arrays[array as usize];
        let width = self.width;
        let mut target = std::mem::take(&mut self.arrays[array as usize]);
        let words = target.words_mut();
        let last = plan.len.saturating_sub(1);
        for component in 0..plan.words as usize {
            let value = self.component(value, component);
            match (self.arg(index), plan.varying) {
                (Arg::Same(i), true) => {
                    let at = i[0].min(last) as usize * plan.words as usize + component;
                    let lanes = &mut words[at * width..][..width];
                    match value {
                        Arg::Each(v) => mask.copy(lanes, v),
                        Arg::Same(v) => mask.fill(lanes, v[0]),
                    }
                }
                (Arg::Each(indices), true) => mask.for_each(|lane| {
                    let at = indices[lane].min(last) as usize * plan.words as usize + component;
                    words[at * width + lane] = match value {
                        Arg::Each(v) => v[lane],
                        Arg::Same(v) => v[0],
                    };
                }),
                (Arg::Same(i) | Arg::Each(i), false) => {
                    let at = i[0].min(last) as usize * plan.words as usize + component;
                    let (Arg::Each(v) | Arg::Same(v)) = value;
                    words[at] = v[0];
                }
            }
        }
        self.arrays[array as usize] = target;
    }

    fn branch(
        &mut self,
        cond: Operand,
        then: &[Step],
        otherwise: &[Step],
        results: &[[Operand; 3]],
        mask: &Mask,
    ) -> Result<(), Stop> {
        let (yes, no) = match self.arg(cond) {
            Arg::Same(word) if word[0] != 0 => (None, Mask::none()),
            Arg::Same(_) => (Some(Mask::none()), Mask::none()),
            Arg::Each(lanes) => {
                let (yes, no) = mask.split(lanes);
                (Some(yes), no)
            }
        };
        let same = matches!(self.arg(cond), Arg::Same(_));
        let yes_mask = yes.as_ref().unwrap_or(mask);
        if yes_mask.any() {
            self.steps(then, yes_mask)?;
            results.iter().for_each(|[r, a, _]| self.copy(*a, *r, yes_mask));
        }
        let no_mask = if same && yes.is_some() { mask } else { &no };
        if no_mask.any() {
            self.steps(otherwise, no_mask)?;
            results.iter().for_each(|[r, _, b]| self.copy(*b, *r, no_mask));
        }
        Ok(())
    }

    fn round(
        &mut self,
        params: &[LoopParam],
        body: &[Step],
        cond: Operand,
        span: Span,
        mask: &Mask,
    ) -> Result<(), Stop> {
        let all = Mask::all(self.width);
        for p in params {
            self.copy(p.init, p.param, &all);
        }
        let mut active = mask.clone();
        loop {
            self.rounds += 1;
            if self.rounds > self.max_rounds {
                return Err(Stop::TooManyRounds { rounds: self.max_rounds, span });
            }
            self.steps(body, &active)?;
            // Results first: a next value may itself be a parameter.
            for p in params {
                self.copy(p.next, p.result, &active);
            }
            match self.arg(cond) {
                Arg::Same(word) if word[0] == 0 => return Ok(()),
                Arg::Same(_) => {}
                Arg::Each(lanes) => {
                    active = active.split(lanes).0;
                    if !active.any() {
                        return Ok(());
                    }
                }
            }
            for p in params {
                self.copy(p.result, p.param, &all);
            }
        }
    }
}

/// The words of a result while they are written.
enum Target {
    /// A shared value: its words and how many there are.
    Few([u32; 16], usize),
    /// A register, and the word at which the result starts in it.
    Lanes(Lanes, usize),
}

impl Target {
    fn chunks_mut(&mut self, n: usize) -> std::slice::ChunksMut<'_, u32> {
        match self {
            Target::Few(few, words) => few[..*words].chunks_mut(n),
            Target::Lanes(lanes, start) => lanes.words_mut()[*start..].chunks_mut(n),
        }
    }
}
