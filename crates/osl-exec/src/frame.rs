//! Running a program over all points, on all cores.
//!
//! The points are cut into tiles; each tile is a task with a machine of its own thread, and writes its own part of
//! each plane. Results do not depend on tile size, batch width, thread count or instruction set.

use crate::arithmetic;
use crate::machine::{Component, Machine, Stop, Totals};
use crate::message::{Event, Keeping, Messages, Printed, Said, unite};
use crate::native::Native;
use crate::order::Blocks;
use crate::profile::{Profile, ProfileEntry};
use crate::program::{OutputPlan, Program, words_of};
use crate::services::Services;
use crate::source::PointSource;
use osl_ir::ir::Kind;
use osl_ir::numeric::Arithmetic;
use osl_ir::types::Type;
use osl_noise::Isa;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// How a program is run.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Points that one instruction covers, rounded up to a multiple of 16; as suits the program where it is not set.
    pub batch: Option<usize>,
    /// Points of a task.
    pub tile: usize,
    /// The instruction set.
    pub isa: Isa,
    /// Steps that a batch may take before a loop of it has to end: an operation over the batch is one, loads, kernels and
    /// texts are as many as they take of that time.
    pub max_steps: u64,
    /// Whether the closures of outputs are kept.
    pub closures: bool,
    /// Whether to note where the time goes.
    pub profile: bool,
    /// Which runs of operations become machine code.
    pub native: Native,
    /// Which numbers to compute with. The program should be compiled for the same
    /// ([`passes::Options`](osl_ir::passes::Options)): constants that single precision has rounded stay so.
    pub arithmetic: Arithmetic,
    /// How messages are kept.
    pub keeping: Keeping,
}

impl Default for RunOptions {
    fn default() -> Self {
        RunOptions {
            batch: None,
            tile: 4096,
            isa: Isa::detect(),
            max_steps: 1 << 23,
            closures: false,
            profile: false,
            native: Native::Recurring,
            arithmetic: Arithmetic::Strict,
            keeping: Keeping::default(),
        }
    }
}

/// One component of an output over all points.
#[derive(Clone, Debug)]
pub struct Plane {
    /// Name of the output, `a[2]` for an element of an array.
    pub output: Arc<str>,
    /// Type of the output (of one element).
    pub ty: Type,
    /// Which component: 0 for scalars, 0 to 2 for triples, 0 to 15 for matrices.
    pub component: usize,
    /// What the words are.
    pub kind: Kind,
    /// A word for each point, in order; floats in single precision.
    pub words: Vec<u32>,
    /// The values in double precision, point by point, where the run computed with it; empty otherwise.
    pub wide: Vec<f64>,
}

impl Plane {
    /// The values as floats; ints are converted.
    pub fn floats(&self) -> Vec<f32> {
        let convert = |w: &u32| if self.kind == Kind::Int { *w as i32 as f32 } else { f32::from_bits(*w) };
        self.words.iter().map(convert).collect()
    }

    /// The values as doubles, as well as they are known; ints are converted.
    pub fn doubles(&self) -> Vec<f64> {
        if !self.wide.is_empty() {
            return self.wide.clone();
        }
        let convert =
            |w: &u32| if self.kind == Kind::Int { f64::from(*w as i32) } else { f32::from_bits(*w).into() };
        self.words.iter().map(convert).collect()
    }
}

/// What a run yields.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// The planes, output by output.
    pub planes: Vec<Plane>,
    /// What the run has to say, each message once.
    pub messages: Vec<Said>,
    /// What the shader printed, point by point.
    pub printed: Vec<Printed>,
    /// What points printed and said, in their order, where that is kept each time: `messages` and `printed` are empty then.
    pub events: Vec<Event>,
    /// The closures, if they were asked for.
    pub closures: Vec<Closures>,
    /// Where the time went, if that was asked for: all threads together.
    pub profile: Vec<ProfileEntry>,
}

impl Frame {
    /// Adds what the points behind its own yielded, in the order of the pieces of a [`Run`]; planes grow by theirs.
    pub fn add(&mut self, next: Frame) {
        let Frame { planes, messages, printed, events, closures, profile } = next;
        unite(&mut self.messages, messages);
        self.events.extend(events);
        self.printed.extend(printed);
        if self.planes.is_empty() {
            self.planes = planes;
        } else {
            for (all, more) in self.planes.iter_mut().zip(planes) {
                all.words.extend(more.words);
                all.wide.extend(more.wide);
            }
        }
        if self.closures.is_empty() {
            self.closures = closures;
        } else {
            self.closures.iter_mut().zip(closures).for_each(|(all, more)| all.points.extend(more.points));
        }
        self.profile.iter_mut().zip(&profile).for_each(|(all, more)| all.add(more));
        if self.profile.is_empty() {
            self.profile = profile;
        }
    }

    /// The messages in words, each once, with whether it is an error; `place` names a place of the source.
    pub fn said(&self, place: impl Fn(osl_ir::Span) -> String) -> Vec<(bool, String)> {
        let mut seen = rustc_hash::FxHashSet::default();
        let all = self.messages.iter().map(|m| (m.message.error, m.message.show(&place)));
        all.filter(|said| seen.insert(said.clone())).collect()
    }
}

/// A closure output over all points.
#[derive(Clone, Debug, PartialEq)]
pub struct Closures {
    /// Name of the output, `a[2]` for an element of an array.
    pub output: Arc<str>,
    /// The components of each point, in order.
    pub points: Vec<Vec<Component>>,
}

/// What a tile hands over besides its part of the planes.
struct Tile {
    messages: Messages,
    /// For each closure output, the components of each point.
    closures: Vec<Vec<Vec<Component>>>,
    profile: Option<Box<Profile>>,
}

/// Runs a program over all points of a source. `progress` is called with the number of points done.
///
/// # Errors
/// A loop beyond its budget.
pub fn run(
    program: &Program,
    services: &Services,
    source: &dyn PointSource,
    options: &RunOptions,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Frame, Stop> {
    Run::new(program, services, source, options).points(0..source.count(), progress)
}

/// A run that yields its points piece by piece, so that not all have to be in memory.
pub struct Run<'a> {
    program: &'a Program,
    services: &'a Services,
    source: &'a dyn PointSource,
    options: &'a RunOptions,
    totals: Totals,
    done: AtomicUsize,
}

impl<'a> Run<'a> {
    /// A run of which nothing is done.
    pub fn new(
        program: &'a Program,
        services: &'a Services,
        source: &'a dyn PointSource,
        options: &'a RunOptions,
    ) -> Run<'a> {
        Run { program, services, source, options, totals: Totals::default(), done: AtomicUsize::new(0) }
    }

    /// The planes that a frame will have, without their words.
    pub fn planes(&self) -> Vec<Plane> {
        let slots = Slots::of(self.program, self.options).planes;
        slots.iter().map(|slot| self.plane(slot, 0)).collect()
    }

    fn plane(&self, slot: &Slot, count: usize) -> Plane {
        let mut plane = plane(&self.program.outputs[slot.output], slot.element, slot.component, count);
        if self.options.arithmetic.is_double() {
            plane.wide = vec![0.0; count];
        }
        plane
    }

    /// Runs the points of a range; where the source has blocks, it begins and ends with whole rows of them. The planes
    /// of the frame have these points alone. `progress` is called with the number of points that the run has done.
    ///
    /// # Errors
    /// A loop beyond its budget.
    pub fn points(&self, points: Range<usize>, progress: &(dyn Fn(usize) + Sync)) -> Result<Frame, Stop> {
        match self.options.arithmetic {
            Arithmetic::Strict => self.points_in::<arithmetic::Strict>(points, progress),
            Arithmetic::Fast => self.points_in::<arithmetic::Fast>(points, progress),
            Arithmetic::Double => self.points_in::<arithmetic::Double>(points, progress),
        }
    }

    fn points_in<A: arithmetic::Arithmetic>(
        &self,
        points: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Frame, Stop> {
        let Run { program, services, source, options, totals, done } = self;
        let blocks = source.blocks();
        let points = points.start..points.end.min(source.count()).max(points.start);
        // A tile's results are a piece of each plane, so it has whole rows of blocks.
        let tile = options.tile.max(1).next_multiple_of(blocks.map_or(1, |b| b.period()));
        let Slots { planes: slots, closures } = Slots::of(program, options);
        let mut planes: Vec<Plane> = slots.iter().map(|slot| self.plane(slot, points.len())).collect();
        let tiles = points.len().div_ceil(tile);
        let mut parts: Vec<Vec<Piece<'_>>> = (0..tiles).map(|_| Vec::with_capacity(planes.len())).collect();
        for plane in &mut planes {
            let mut wide = plane.wide.chunks_mut(tile);
            for (part, words) in parts.iter_mut().zip(plane.words.chunks_mut(tile)) {
                part.push(Piece { words, wide: wide.next().unwrap_or_default() });
            }
        }
        let failed = AtomicBool::new(false);
        let batch = options.batch.unwrap_or_else(|| program.batch());
        let batch = batch.clamp(1, program.widest(rayon::current_num_threads()));
        let new = || {
            Machine::<A>::new(
                program,
                services,
                *source,
                options.isa,
                (batch.min(tile), options.native),
                options,
                totals,
            )
        };
        let profile = || options.profile.then(|| Box::new(Profile::new(program)));
        let results: Vec<Result<Tile, Stop>> = parts
            .into_par_iter()
            .enumerate()
            .map_init(new, |machine, (index, part)| {
                let first = points.start + index * tile;
                let here = first..points.end.min(first + tile);
                if failed.load(Ordering::Relaxed) {
                    return Ok(Tile { messages: Messages::default(), closures: Vec::new(), profile: None });
                }
                machine.profile = profile();
                let count = here.len();
                let closures = run_tile(machine, here, (&slots, part), &closures, (batch, blocks))
                    .inspect_err(|_| failed.store(true, Ordering::Relaxed))?;
                progress(done.fetch_add(count, Ordering::Relaxed) + count);
                let (messages, profile) = (machine.messages.take(), machine.profile.take());
                Ok(Tile { messages, closures, profile })
            })
            .collect();
        let mut frame = gather(program, blocks, points.start, (planes, closures), results)?;
        for said in &mut frame.messages {
            // A program that all points share has run for a batch and stands for the others.
            if program.shared {
                (said.first, said.points) = (points.start, Some(points.len() as u64));
            }
            said.first = source.pixel(said.first);
        }
        if !options.profile {
            frame.profile.clear();
        }
        Ok(frame)
    }
}

/// What a program delivers for each point.
struct Slots {
    planes: Vec<Slot>,
    closures: Vec<Slot>,
}

impl Slots {
    fn of(program: &Program, options: &RunOptions) -> Slots {
        let mut slots = Slots { planes: Vec::new(), closures: Vec::new() };
        for (output, plan) in program.outputs.iter().enumerate() {
            for element in 0..plan.ty_len(program) {
                match plan.kind {
                    // Texts have no plane.
                    Kind::Str => {}
                    Kind::Closure if options.closures => {
                        slots.closures.push(Slot { output, element, component: 0 });
                    }
                    Kind::Closure => {}
                    kind => slots.planes.extend((0..words_of(kind) as usize).map(|component| Slot {
                        output,
                        element,
                        component,
                    })),
                }
            }
        }
        slots
    }
}

/// Puts together what the tiles of a range of points yield.
fn gather(
    program: &Program,
    blocks: Option<Blocks>,
    start: usize,
    (planes, closures): (Vec<Plane>, Vec<Slot>),
    results: Vec<Result<Tile, Stop>>,
) -> Result<Frame, Stop> {
    let mut outputs: Vec<Closures> = closures
        .iter()
        .filter_map(|slot| {
            let plan = program.outputs.get(slot.output)?;
            Some(Closures { output: element_name(plan, slot.element), points: Vec::new() })
        })
        .collect();
    let mut said = Vec::new();
    let mut profile = Profile::new(program);
    for result in results {
        let tile = result?;
        tile.profile.iter().for_each(|of_tile| profile.add(of_tile));
        said.push(tile.messages);
        outputs.iter_mut().zip(tile.closures).for_each(|(all, mut here)| all.points.append(&mut here));
    }
    if let Some(blocks) = blocks {
        for all in &mut outputs {
            let found = std::mem::take(&mut all.points);
            let mut sorted: Vec<_> = found.into_iter().enumerate().collect();
            sorted.sort_by_key(|(point, _)| blocks.position(start + *point));
            all.points = sorted.into_iter().map(|(_, list)| list).collect();
        }
    }
    let (messages, printed, events) = Messages::merge(said);
    Ok(Frame { planes, messages, printed, events, closures: outputs, profile: profile.entries(program) })
}

/// One component of one element of an output.
#[derive(Clone, Copy)]
struct Slot {
    output: usize,
    element: usize,
    component: usize,
}

/// What a tile writes of a plane: its words, and doubles where the plane has them.
struct Piece<'a> {
    words: &'a mut [u32],
    wide: &'a mut [f64],
}

/// Runs the points of a tile batch by batch, and copies what they yield. Returns the closures.
fn run_tile<A: arithmetic::Arithmetic>(
    machine: &mut Machine<'_, A>,
    points: Range<usize>,
    (slots, mut part): (&[Slot], Vec<Piece<'_>>),
    closures: &[Slot],
    (batch, blocks): (usize, Option<Blocks>),
) -> Result<Vec<Vec<Vec<Component>>>, Stop> {
    let mut found: Vec<Vec<Vec<Component>>> = vec![Vec::new(); closures.len()];
    let mut row = (Vec::with_capacity(batch), Vec::new());
    let mut at = 0;
    while at < points.len() {
        let here = batch.min(points.len() - at);
        machine.run(points.start + at, here)?;
        for (slot, piece) in slots.iter().zip(&mut part) {
            let slot = (slot.output, slot.element, slot.component);
            match (blocks, piece.words.get_mut(at..at + here)) {
                (Some(blocks), _) => {
                    row.0.resize(here, 0);
                    row.1.resize(if piece.wide.is_empty() { 0 } else { here }, 0.0);
                    machine.output(slot, &mut row.0, &mut row.1);
                    blocks.scatter(points.start + at, &row.0, points.start, piece.words);
                    blocks.scatter(points.start + at, &row.1, points.start, piece.wide);
                }
                (None, Some(out)) => {
                    machine.output(slot, out, piece.wide.get_mut(at..at + here).unwrap_or_default());
                }
                (None, None) => {}
            }
        }
        for (slot, found) in closures.iter().zip(&mut found) {
            let mut numbers = vec![0; here];
            machine.output((slot.output, slot.element, 0), &mut numbers, &mut []);
            for number in numbers {
                found.push(machine.keep_components(number)?);
            }
        }
        at += here;
    }
    Ok(found)
}

fn element_name(plan: &OutputPlan, element: usize) -> Arc<str> {
    if plan.ty.is_array() { format!("{}[{element}]", plan.name).into() } else { plan.name.clone() }
}

fn plane(plan: &OutputPlan, element: usize, component: usize, count: usize) -> Plane {
    let output = element_name(plan, element);
    Plane {
        output,
        ty: plan.ty.element(),
        component,
        kind: plan.kind,
        words: vec![0; count],
        wide: Vec::new(),
    }
}
