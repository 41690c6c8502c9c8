//! The machine: one thread's registers, and the steps run over them.
//!
//! A step works on all lanes; the mask of active lanes decides only what is copied where paths meet and what is
//! stored in arrays. Lane registers are taken out of the file while they are written, so that a step
//! borrows its arguments beside its result.

mod array;
mod closure;
mod color;
mod dictionary;
mod kernels;
mod lane;
mod mask;
mod named;
mod noise;
mod point;
mod shared;
mod text;
mod texture;
mod work;

use crate::dictionary::Dictionaries;
use crate::lanes::Arg;
use crate::message::Messages;
use crate::profile::Profile;
use crate::program::{Array, LoopParam, Operand, OutputSource, Place, Program, Step, Steps};
use crate::register::{LINE, Lanes};
use crate::services::Services;
use crate::source::PointSource;
pub use closure::{Component, Param, show as show_closure};
pub(crate) use mask::Mask;
use osl_ir::Span;
use osl_ir::ir::{Const, Kind};
use osl_noise::Isa;
pub(crate) use work::Totals;

/// Why a run stopped.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Stop {
    /// A loop went on beyond the budget of its batch.
    #[error("a loop took more than {steps} steps")]
    TooManySteps {
        /// The budget.
        steps: u64,
        /// The loop.
        span: Span,
    },
    /// What a batch makes, or the run prints, does not fit its budget.
    #[error("{what}")]
    Exhausted {
        /// The budget in words.
        what: String,
        /// The call, if it was one.
        span: Option<Span>,
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
    shared: shared::Shared,
    words: Vec<u32>,
    arrays: Vec<Lanes>,
    scratch: Vec<Lanes>,
    max_steps: u64,
    /// Steps of the batch so far.
    spent: u64,
    /// A budget that the kernel which runs has used up.
    exhausted: Option<String>,
    /// Whether a batch has been run.
    ran: bool,
    /// Where the points come from.
    source: &'a dyn PointSource,
    /// The point of the first lane, and how many lanes have a point of their own.
    first: usize,
    points: usize,
    texts: text::Texts,
    closures: closure::Closures,
    dictionaries: Dictionaries,
    named: named::Named,
    totals: &'a Totals,
    /// Which blocks of each array hold more than zeros.
    dirty: Vec<Vec<bool>>,
    pub(crate) messages: Messages,
    /// Where the time goes, if that is asked for.
    pub(crate) profile: Option<Box<Profile>>,
}

impl<'a> Machine<'a> {
    /// A machine for batches of up to `width` points.
    pub(crate) fn new(
        program: &'a Program,
        services: &'a Services,
        source: &'a dyn PointSource,
        isa: Isa,
        width: usize,
        max_steps: u64,
        totals: &'a Totals,
    ) -> Self {
        let width = width.max(1).next_multiple_of(LINE);
        let array = |a: &Array| Lanes::new((a.words * a.len) as usize * if a.varying { width } else { 1 });
        Machine {
            program,
            services,
            isa,
            width,
            registers: program.registers.iter().map(|words| Lanes::new(*words as usize * width)).collect(),
            shared: shared::Shared::new(program, width),
            words: program.words.clone(),
            arrays: program.arrays.iter().map(array).collect(),
            scratch: (0..16).map(|_| Lanes::new(width)).collect(),
            max_steps,
            spent: 0,
            exhausted: None,
            ran: false,
            source,
            first: 0,
            points: 0,
            texts: text::Texts::default(),
            closures: closure::Closures::default(),
            dictionaries: Dictionaries::default(),
            named: named::Named::default(),
            totals,
            dirty: program.arrays.iter().map(|a| vec![false; array::blocks(a)]).collect(),
            messages: Messages::new(source.blocks()),
            profile: None,
        }
    }

    /// Runs the program for `points` points from `first` on, at most as many as the batch is wide.
    pub(crate) fn run(&mut self, first: usize, points: usize) -> Result<(), Stop> {
        let source = self.source;
        if self.program.shared && std::mem::replace(&mut self.ran, true) {
            // It holds the results of every point.
            return Ok(());
        }
        self.spent = 0;
        (self.first, self.points) = (first, points);
        self.texts.clear();
        self.closures.clear();
        self.named.clear();
        self.clear_arrays();
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
            match operand.place {
                Place::Lanes { reg, .. } if source.varying_slopes().contains(global) => {
                    let lanes = crate::register::floats_mut(self.registers[reg as usize].words_mut());
                    let lanes = &mut lanes[..operand.words as usize * self.width];
                    source.fill_slope(*global, *axis, first, self.width, lanes);
                }
                _ => self.spread(source.slope(*global, *axis), *operand),
            }
        }
        self.steps(&program.steps, &Mask::start(points, self.width))
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

    /// Copies component `component` of an output's element `element` for the first points into `out`. What is NaN is the
    /// same word everywhere: which one arithmetic makes depends on the instruction set.
    pub(crate) fn output(&self, output: usize, element: usize, component: usize, out: &mut [u32]) {
        let Some(plan) = self.program.outputs.get(output) else { return };
        match plan.source {
            OutputSource::Value(operand) => match operand.place {
                Place::Words(at) => out.fill(self.words[at as usize + component]),
                Place::Lanes { .. } => match self.arg(self.part(operand, component)) {
                    Arg::Same(word) => out.fill(word[0]),
                    Arg::Each(lanes) => out.copy_from_slice(&lanes[..out.len()]),
                },
            },
            OutputSource::Array(array) => {
                let slot = self.program.arrays[array as usize];
                let at = element * slot.words as usize + component;
                let words = self.arrays[array as usize].words();
                if slot.varying {
                    out.copy_from_slice(&words[at * self.width..][..out.len()]);
                } else {
                    out.fill(words[at]);
                }
            }
        }
        if matches!(plan.kind, Kind::Float | Kind::Triple | Kind::Matrix) {
            for word in out {
                *word = if f32::from_bits(*word).is_nan() { f32::NAN.to_bits() } else { *word };
            }
        }
    }

    fn steps(&mut self, steps: &Steps, mask: &Mask) -> Result<(), Stop> {
        self.spent += steps.weight;
        if self.profile.is_some() {
            return self.profiled(steps, mask);
        }
        self.in_pieces(&steps.list, mask)
    }

    #[inline(always)]
    pub(crate) fn step(&mut self, step: &Step, mask: &Mask) -> Result<(), Stop> {
        match step {
            Step::Lane(step) => self.lane(step, 0..self.width),
            Step::Kernel(step) => {
                self.kernel(step, mask);
                if let Some(what) = self.exhausted.take() {
                    return Err(Stop::Exhausted { what, span: Some(step.span) });
                }
            }
            Step::Load { array, index, out } => self.load(*array, *index, *out),
            Step::Store { array, index, value } => self.store(*array, *index, *value, mask),
            Step::If { cond, then, otherwise, results } => {
                self.branch(*cond, then, otherwise, results, mask)?
            }
            Step::Loop { params, body, cond, span } => self.round(params, body, *cond, *span, mask)?,
            Step::FindCells { group, roots, outs, exports } => {
                self.find_cells(*group, roots, outs, mask);
                self.export_roots(*group, roots, outs, exports);
            }
            Step::Shared { group, steps, exports } => self.shared(*group, steps, exports, mask)?,
        }
        Ok(())
    }

    #[inline]
    fn arg(&self, operand: Operand) -> Arg<'_> {
        let words = operand.words as usize;
        match operand.place {
            Place::Words(at) => Arg::Same(&self.words[at as usize..][..words]),
            Place::Lanes { reg, component, group } => {
                if let Some(lanes) = group.and_then(|group| self.shared.by_all(group, reg)) {
                    return Arg::Same(&lanes[component as usize..][..words]);
                }
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
        self.arg(self.part(operand, component))
    }

    /// One word of an operand at one lane.
    fn word(&self, operand: Operand, lane: usize) -> u32 {
        match self.arg(operand) {
            Arg::Same(word) => word[0],
            Arg::Each(lanes) => lanes[lane],
        }
    }

    /// A value at one lane.
    fn value(&self, operand: Operand, kind: Kind, lane: usize) -> Const {
        let float = |c: usize| f32::from_bits(self.word(self.part(operand, c), lane));
        match kind {
            Kind::Int => Const::Int(self.word(operand, lane) as i32),
            Kind::Float => Const::Float(float(0)),
            Kind::Triple => Const::Triple([float(0), float(1), float(2)]),
            Kind::Matrix => Const::Matrix(Box::new(std::array::from_fn(float))),
            Kind::Str => Const::Str(self.text(self.word(operand, lane))),
            Kind::Closure => Const::Null,
        }
    }

    fn values(&self, args: &[Operand], kinds: &[Kind], lane: usize) -> Vec<Const> {
        args.iter().zip(kinds).map(|(a, k)| self.value(*a, *k, lane)).collect()
    }

    /// One component of an operand of several.
    fn part(&self, operand: Operand, component: usize) -> Operand {
        let component = component as u32;
        let place = match operand.place {
            Place::Words(at) => Place::Words(at + component),
            Place::Lanes { reg, component: base, group } => {
                Place::Lanes { reg, component: base + component, group }
            }
        };
        Operand { place, words: 1 }
    }

    /// Writes the words of a value at one lane, or for all where the place is shared.
    fn set_words(&mut self, out: Operand, lane: usize, words: &[u32]) {
        for (component, word) in words.iter().enumerate().take(out.words as usize) {
            match out.place {
                Place::Words(at) => self.words[at as usize + component] = *word,
                Place::Lanes { reg, component: base, .. } => {
                    let at = (base as usize + component) * self.width + lane;
                    self.registers[reg as usize].words_mut()[at] = *word;
                }
            }
        }
    }

    fn set_value(&mut self, out: Operand, lane: usize, value: &Const) {
        match value {
            Const::Int(n) => self.set_words(out, lane, &[*n as u32]),
            Const::Float(x) => self.set_words(out, lane, &[x.to_bits()]),
            Const::Triple(t) => self.set_words(out, lane, &t.map(f32::to_bits)),
            Const::Matrix(m) => self.set_words(out, lane, &m.map(f32::to_bits)),
            Const::Str(s) => {
                let number = self.intern(s);
                self.set_words(out, lane, &[number]);
            }
            Const::Null => self.set_words(out, lane, &[0]),
        }
    }

    /// The lanes at which a kernel has to compute: the active ones, or any one where all share the result.
    fn lanes(&self, outs: &[Operand], mask: &Mask) -> Vec<usize> {
        let mut lanes = self.active(mask);
        let shared = !outs.is_empty() && outs.iter().all(|o| matches!(o.place, Place::Words(_)));
        if shared {
            lanes.truncate(1);
        }
        lanes
    }

    /// How many lanes a step runs for.
    pub(crate) fn lanes_in(&self, mask: &Mask) -> u64 {
        let mut lanes = 0;
        mask.for_each(|_| lanes += 1);
        lanes
    }

    /// The active lanes that have a point of their own.
    fn active(&self, mask: &Mask) -> Vec<usize> {
        let mut lanes = Vec::new();
        mask.for_each(|lane| {
            if lane < self.points {
                lanes.push(lane);
            }
        });
        lanes
    }

    /// Takes the words of a result out of the machine.
    fn take(&mut self, out: Operand) -> Target {
        match out.place {
            Place::Words(_) => Target::Few([0; 16], out.words as usize),
            Place::Lanes { reg, component, .. } => Target::Lanes(
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

    fn branch(
        &mut self,
        cond: Operand,
        then: &Steps,
        otherwise: &Steps,
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
        body: &Steps,
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
            // Masks and what the loop carries.
            self.spent += 4 + params.len() as u64;
            self.within_budget(span)?;
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
    /// No result.
    None,
}

impl Target {
    fn chunks_mut(&mut self, n: usize) -> std::slice::ChunksMut<'_, u32> {
        match self {
            Target::Few(few, words) => few[..*words].chunks_mut(n),
            Target::Lanes(lanes, start) => lanes.words_mut()[*start..].chunks_mut(n),
            Target::None => [].chunks_mut(n),
        }
    }
}
