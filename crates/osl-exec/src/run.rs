//! Runs a program over all points, on all cores.
//!
//! The points are divided into tiles. Each worker has a machine and takes tiles in order, and each tile
//! writes its own part of each plane. Results do not depend on tile size, batch width, thread count or
//! instruction set. The same holds for errors: the error is that of the first point that exceeds its limits,
//! or with which all points so far exceed those of the run.

mod tile;

use crate::arithmetic;
use crate::closures::{Closures, Columns};
use crate::dictionary::Documents;
use crate::error::RunError;
use crate::frame::{Frame, Plane, Words};
use crate::message::Messages;
use crate::options::RunOptions;
use crate::order::{self, Area, Blocks};
use crate::profile::Profile;
use crate::program::Program;
use crate::services::Services;
use crate::source::PointSource;
use crate::step::OutputPlan;
use osl_ir::ir::Kind;
use osl_ir::types::Type;
use osl_numeric::Arithmetic;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tile::{Bytes, Piece, Tile, Worker};

/// The name of the plane with the steps of each point, if they are counted.
pub const STEPS: &str = "steps";

/// Bytes charged for a component of an output besides its values: its name and location.
const SLOT_BYTES: u64 = 256;
/// The number of tiles that an image has at least, if they are not too small: at the end of a run, the
/// threads wait for the last tile.
const TILES: usize = 128;
/// The least number of points in a tile that shares its rows of blocks with others.
const LEAST: usize = 1024;
/// The largest number of points in a tile of an image, unless a batch is larger: its values fit the cache.
const MOST: usize = 16384;
/// Batches have their full width if a tile fills one in so many parts of it. Machine code is made for a
/// width.
const NARROW: usize = 4;

/// Runs a program over all points of a source. `progress` is called with the number of finished points.
///
/// # Errors
/// A limit of a point or of the run is exceeded, or the program was not compiled for such a source.
pub fn run(
    program: &Program,
    services: &Services,
    source: &dyn PointSource,
    options: &RunOptions,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Frame, RunError> {
    Run::new(program, services, source, options).points(0..source.count(), progress)
}

/// Looks at the values of a tile: its number, and the words of each plane, both in the order in which points
/// are shaded. The tiles of a range of points do not depend on the number of threads.
pub type Look<'a> = dyn Fn(usize, &[&[u32]]) + Sync + 'a;

/// A run that returns its points in pieces, so that not all of them have to be in memory.
pub struct Run<'a> {
    program: &'a Program,
    services: &'a Services,
    source: &'a dyn PointSource,
    options: &'a RunOptions,
    /// The XML documents of all workers.
    documents: Documents,
    /// Bytes kept by the points so far: printed text, and closures of outputs.
    printed: AtomicU64,
    closures: AtomicU64,
    /// Number of finished points.
    done: AtomicUsize,
}

impl<'a> Run<'a> {
    /// A run that has not shaded any point yet.
    pub fn new(
        program: &'a Program,
        services: &'a Services,
        source: &'a dyn PointSource,
        options: &'a RunOptions,
    ) -> Run<'a> {
        Run {
            program,
            services,
            source,
            options,
            documents: Documents::new(&options.limits),
            printed: AtomicU64::new(0),
            closures: AtomicU64::new(0),
            done: AtomicUsize::new(0),
        }
    }

    /// The planes of a frame, without their words.
    ///
    /// # Errors
    /// There are too many of them.
    pub fn planes(&self) -> Result<Vec<Plane>, RunError> {
        let slots = self.slots(1)?.planes;
        Ok(slots.iter().map(|slot| self.plane(slot, 0)).chain(self.steps(0)).collect())
    }

    /// Whether the planes of this many points fit in memory.
    ///
    /// # Errors
    /// They do not fit.
    pub fn fits(&self, points: usize) -> Result<(), RunError> {
        self.slots(points).map(|_| ())
    }

    /// The plane with the steps of points, if they are counted.
    fn steps(&self, count: usize) -> Option<Plane> {
        self.options.steps.then(|| Plane {
            output: STEPS.into(),
            ty: Type::INT,
            component: 0,
            kind: Kind::Int,
            words: Words::any(count),
            wide: Vec::new(),
        })
    }

    fn plane(&self, slot: &Slot, count: usize) -> Plane {
        let mut plane = plane(&self.program.outputs[slot.output], *slot, count);
        if self.program.arithmetic().is_double() {
            plane.wide = vec![0.0; count];
        }
        plane
    }

    /// Runs the points of a range; if the source has blocks, the range must begin and end with whole rows of
    /// them. The planes of the frame contain only these points. `progress` is called with the number of
    /// points that the run has finished.
    ///
    /// # Errors
    /// A limit of a point or of the run is exceeded, or the program was not compiled for such a source.
    pub fn points(&self, points: Range<usize>, progress: &(dyn Fn(usize) + Sync)) -> Result<Frame, RunError> {
        self.any_points(points, progress, None)
    }

    /// The same without keeping the values: the planes of the frame are empty, and `look` gets those of each
    /// tile. So the values of all points never have to be in memory.
    ///
    /// # Errors
    /// As for [`Run::points`].
    pub fn look(
        &self,
        points: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
        look: &Look<'_>,
    ) -> Result<Frame, RunError> {
        self.any_points(points, progress, Some(look))
    }

    fn any_points(
        &self,
        points: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
        look: Option<&Look<'_>>,
    ) -> Result<Frame, RunError> {
        self.program.accepts(self.source, self.services)?;
        // Those of earlier pieces are with the caller.
        self.closures.store(0, Ordering::Relaxed);
        match self.program.arithmetic() {
            Arithmetic::Strict => self.points_in::<arithmetic::Strict>(points, progress, look),
            Arithmetic::Fast => self.points_in::<arithmetic::Fast>(points, progress, look),
            Arithmetic::Double => self.points_in::<arithmetic::Double>(points, progress, look),
        }
    }

    fn points_in<A: arithmetic::ArithmeticImpl>(
        &self,
        points: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
        look: Option<&Look<'_>>,
    ) -> Result<Frame, RunError> {
        let Run { program, source, .. } = self;
        let blocks = source.blocks();
        let points = points.start..points.end.min(source.count()).max(points.start);
        let (threads, batch, areas) = self.divide(points.clone(), blocks);
        let kept = match look {
            Some(_) => areas.iter().map(|area| area.points.len()).max().unwrap_or(0),
            None => points.len(),
        };
        let slots = self.slots(kept)?;
        let (threads, batch) = self.machines::<A>((threads, batch))?;
        let kept = if look.is_some() { 0 } else { points.len() };
        let mut planes: Vec<Plane> = slots.planes.iter().map(|slot| self.plane(slot, kept)).collect();
        planes.extend(self.steps(kept));
        let mut parts: Vec<Vec<Piece<'_>>> = areas.iter().map(|_| Vec::new()).collect();
        for Plane { words, wide, .. } in planes.iter_mut().filter(|_| look.is_none()) {
            let (words, wide) = match blocks {
                Some(blocks) => (blocks.cut(&areas, words), blocks.cut(&areas, wide)),
                None => (order::cut(&areas, words), order::cut(&areas, wide)),
            };
            for (part, (words, wide)) in parts.iter_mut().zip(words.into_iter().zip(wide)) {
                part.push(Piece { words, wide });
            }
        }
        let tiles: Vec<_> = areas.iter().zip(parts).collect();
        let mut results = self.results::<A>(tiles, (threads, batch), &slots, (progress, look));
        results.sort_by_key(|(index, _)| *index);
        let results: Vec<Tile> = results.into_iter().map(|(_, tile)| tile).collect();
        self.judge(&results)?;
        let mut frame =
            gather((program, self.options), blocks, points.start, (planes, slots.closures), results);
        for said in &mut frame.messages {
            // A uniform program has run for one batch, which stands for the others.
            if program.uniform {
                (said.first, said.points) = (points.start, Some(points.len() as u64));
            }
            said.first = source.pixel(said.first);
        }
        if self.options.profile.is_none() {
            frame.profile.clear();
        }
        Ok(frame)
    }

    /// Runs tiles, and returns what they yield besides the words of planes.
    fn results<'p, A: arithmetic::ArithmeticImpl>(
        &self,
        tiles: Vec<Open<'p>>,
        (threads, batch): (usize, usize),
        slots: &Slots,
        (progress, look): (&(dyn Fn(usize) + Sync), Option<&Look<'_>>),
    ) -> Vec<(usize, Tile)> {
        let work = Work {
            run: self,
            batch,
            slots,
            open: Mutex::new(tiles.into_iter().enumerate()),
            started: AtomicUsize::new(0),
            last: AtomicUsize::new(usize::MAX),
            results: Mutex::new(Vec::new()),
            progress,
            look,
        };
        if threads == 1 {
            Worker::<A>::new(&work).run();
        } else {
            // This thread is one of them, which need not be woken.
            rayon::in_place_scope(|scope| {
                // A thread that comes late may find nothing to do.
                let help = |_: &rayon::Scope<'_>| {
                    if work.is_open() {
                        Worker::<A>::new(&work).run();
                    }
                };
                (1..threads).for_each(|_| scope.spawn(help));
                Worker::<A>::new(&work).run();
            });
        }
        work.results.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// The number of threads that run points, the number of points in a batch, and the points of the tiles.
    fn divide(&self, points: Range<usize>, blocks: Option<Blocks>) -> (usize, usize, Vec<Area>) {
        let options = self.options;
        let size = options.tile.max(1);
        // Asking for the number of threads would start them.
        let threads = match options.threads {
            Some(1) => 1,
            _ if points.len() <= size => 1,
            most => rayon::current_num_threads().min(most.unwrap_or(usize::MAX)).max(1),
        };
        let batch = options.batch.unwrap_or_else(|| self.program.batch()).max(1);
        let areas = match blocks {
            Some(blocks) => {
                // Not by the number of threads: what a point is charged depends on its batch.
                let (period, rows) = (blocks.period(), points.len().div_ceil(blocks.period()));
                let wanted = TILES.div_ceil(rows.max(1)).max(period.div_ceil(MOST));
                blocks.areas(points, size, wanted.min(period / batch.max(LEAST)))
            }
            None => order::areas(points, size),
        };
        let largest = areas.iter().map(|area| area.points.len()).max().unwrap_or(1);
        // Few widths, so that runs share their machine code.
        let width = if largest >= batch / NARROW { batch } else { largest.next_power_of_two() };
        (threads.clamp(1, areas.len().max(1)), width, areas)
    }

    /// The outputs of the program for this many points, if they fit in memory.
    fn slots(&self, points: usize) -> Result<Slots, RunError> {
        let most_planes = |plan: &OutputPlan| 16.max(3 * plan.names.len() as u64);
        let outputs = self.program.outputs.iter();
        let count = outputs.map(|plan| (plan.ty_len(self.program) as u64).saturating_mul(most_planes(plan)));
        // Nothing is allocated before the total size is known.
        let most = self.options.limits.running.frame_bytes;
        let each = if self.program.arithmetic().is_double() { 12 } else { 4 };
        let bytes = |planes: u64| {
            let of_plane = (points as u64).saturating_mul(each).saturating_add(SLOT_BYTES);
            planes.saturating_mul(of_plane)
        };
        let slots = if count.sum::<u64>().saturating_mul(SLOT_BYTES) > most.saturating_mul(16) {
            None
        } else {
            Some(Slots::of(self.program, self.options)).filter(|s| bytes(s.planes.len() as u64) <= most)
        };
        slots.ok_or_else(|| RunError::TooMuch {
            what: format!("the outputs of {points} points take more than {most} bytes"),
            limit: "running.frame_bytes",
        })
    }

    /// The number of threads and of points in a batch for which there is memory.
    fn machines<A: arithmetic::ArithmeticImpl>(
        &self,
        wanted: (usize, usize),
    ) -> Result<(usize, usize), RunError> {
        let most = self.options.limits.running.memory;
        let fit = self.program.fit(wanted, most, size_of::<A::Word>());
        fit.map_err(|bytes| RunError::TooMuch {
            what: format!("the arrays of a point take {bytes} bytes, more than {most}"),
            limit: "running.memory",
        })
    }

    /// Charges for the printed text of a batch. Returns whether the run is within its limit.
    fn print(&self, bytes: u64) -> bool {
        let sum = self.printed.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes);
        sum <= self.options.limits.running.printed_bytes
    }

    /// Charges for a closure of an output. Returns whether the run is within its limit.
    fn keep(&self, bytes: u64) -> bool {
        let sum = self.closures.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes);
        sum <= self.options.limits.running.closure_bytes
    }

    /// The first error in the order of the points, if any.
    fn judge(&self, results: &[Tile]) -> Result<(), RunError> {
        let all: Bytes = results.iter().fold(Bytes::default(), |sum, tile| sum + tile.bytes);
        // The bytes kept by earlier pieces of the run.
        let before = |total: &AtomicU64, here: u64| total.load(Ordering::Relaxed).saturating_sub(here);
        let mut sum = Bytes {
            printed: before(&self.printed, all.printed),
            closures: before(&self.closures, all.closures),
        };
        let running = &self.options.limits.running;
        for tile in results {
            sum = sum + tile.bytes;
            for (what, bytes, most, limit) in [
                ("print", sum.printed, running.printed_bytes, "running.printed_bytes"),
                ("yield closures of", sum.closures, running.closure_bytes, "running.closure_bytes"),
            ] {
                if bytes > most {
                    let what = format!("all points together {what} more than {most} bytes");
                    return Err(RunError::TooMuch { what, limit });
                }
            }
            if let Some(stop) = &tile.stop {
                return Err(stop.clone());
            }
        }
        Ok(())
    }
}

/// A tile that no worker has taken: its points, and the parts of planes that it writes.
type Open<'p> = (&'p Area, Vec<Piece<'p>>);

/// The state shared by all workers of a range of points.
struct Work<'a, 'p> {
    run: &'a Run<'a>,
    /// Points of a batch.
    batch: usize,
    slots: &'a Slots,
    /// Tiles that no worker has taken, in order.
    open: Mutex<std::iter::Enumerate<std::vec::IntoIter<Open<'p>>>>,
    /// The last tile that a worker has taken.
    started: AtomicUsize,
    /// Tiles after this one need not be run, because one of those up to it has an error.
    last: AtomicUsize,
    results: Mutex<Vec<(usize, Tile)>>,
    progress: &'a (dyn Fn(usize) + Sync),
    look: Option<&'a Look<'a>>,
}

impl Work<'_, '_> {
    /// Whether there is a tile that no worker has taken.
    fn is_open(&self) -> bool {
        self.open.lock().unwrap_or_else(PoisonError::into_inner).len() > 0
    }

    /// The number of planes.
    fn planes(&self) -> usize {
        self.slots.planes.len() + usize::from(self.run.options.steps)
    }
}

/// The outputs of a program for each point.
struct Slots {
    planes: Vec<Slot>,
    closures: Vec<Slot>,
}

/// One component of one element of an output; for the weights of a closure, three components for each name.
#[derive(Clone, Copy)]
struct Slot {
    output: usize,
    element: usize,
    component: usize,
}

impl Slots {
    fn of(program: &Program, options: &RunOptions) -> Slots {
        let mut slots = Slots { planes: Vec::new(), closures: Vec::new() };
        let mut weights = Vec::new();
        for (output, plan) in program.outputs.iter().enumerate() {
            for element in 0..plan.ty_len(program) {
                let each =
                    |count: usize| (0..count).map(move |component| Slot { output, element, component });
                match plan.kind {
                    // Strings have no plane.
                    Kind::Str => {}
                    Kind::Closure => {
                        slots.closures.extend(each(1).filter(|_| options.closures));
                        let names = plan.names.len().max(1);
                        weights.extend(each(3 * names).filter(|_| options.weights));
                    }
                    kind => slots.planes.extend(each(kind.words() as usize)),
                }
            }
        }
        slots.planes.append(&mut weights);
        slots
    }
}

/// Combines the results of the tiles of a range of points.
fn gather(
    (program, options): (&Program, &RunOptions),
    blocks: Option<Blocks>,
    start: usize,
    (planes, closures): (Vec<Plane>, Vec<Slot>),
    results: Vec<Tile>,
) -> Frame {
    let mut kept: Vec<Vec<Columns>> = closures.iter().map(|_| Vec::new()).collect();
    let mut said = Vec::new();
    let mut profile = Profile::new(program, || Duration::ZERO);
    for tile in results {
        tile.profile.iter().for_each(|of_tile| profile.add(of_tile));
        said.push(tile.messages);
        kept.iter_mut().zip(tile.closures).for_each(|(all, here)| all.push(here));
    }
    // The points are whole rows of blocks, if there are blocks.
    let position = |number: usize| blocks.map_or(number, |blocks| blocks.position(start + number) - start);
    let outputs = closures.iter().zip(kept).filter_map(|(slot, tiles)| {
        let plan = program.outputs.get(slot.output)?;
        Some(Closures::new(element_name(plan, slot.element), tiles, position))
    });
    let outputs = outputs.collect();
    let (messages, printed, events) = Messages::merge(said, &options.limits.running);
    Frame { planes, messages, printed, events, closures: outputs, profile: profile.entries(program) }
}

fn element_name(plan: &OutputPlan, element: usize) -> Arc<str> {
    if plan.ty.is_array() { format!("{}[{element}]", plan.name).into() } else { plan.name.clone() }
}

fn plane(plan: &OutputPlan, slot: Slot, count: usize) -> Plane {
    let Slot { element, component, .. } = slot;
    let output = element_name(plan, element);
    let (words, wide) = (Words::any(count), Vec::new());
    if plan.kind == Kind::Closure {
        let output = match plan.names.get(component / 3) {
            Some(name) => format!("{output}.{name}").into(),
            None => output,
        };
        return Plane { output, ty: Type::COLOR, component: component % 3, kind: Kind::Float, words, wide };
    }
    Plane { output, ty: plan.ty.element(), component, kind: plan.kind, words, wide }
}
