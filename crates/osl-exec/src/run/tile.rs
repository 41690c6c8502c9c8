//! The tiles of a run: a worker runs them batch by batch, and repeats batches that exceed a limit in smaller
//! ones.

use super::{Slot, Work};
use crate::arithmetic::ArithmeticImpl;
use crate::closures::Columns;
use crate::error::RunError;
use crate::machine::Machine;
use crate::message::Messages;
use crate::order::{Area, PlaneArea};
use crate::profile::Profile;
use crate::register::LINE;
use osl_ir::ir::Kind;
use std::ops::Add;
use std::sync::PoisonError;
use std::sync::atomic::Ordering;

/// Bytes that points keep for the caller of the run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bytes {
    /// Printed text.
    pub(super) printed: u64,
    /// Closures of outputs.
    pub(super) closures: u64,
}

impl Add for Bytes {
    type Output = Bytes;
    fn add(self, other: Bytes) -> Bytes {
        Bytes {
            printed: self.printed.saturating_add(other.printed),
            closures: self.closures.saturating_add(other.closures),
        }
    }
}

/// The results of a tile besides its part of the planes.
#[derive(Default)]
pub(super) struct Tile {
    pub(super) messages: Messages,
    /// For each closure output, the components of each point.
    pub(super) closures: Vec<Columns>,
    pub(super) profile: Option<Box<Profile>>,
    /// Bytes kept by its points, up to the one with which it ended.
    pub(super) bytes: Bytes,
    /// Why it ended early.
    pub(super) stop: Option<RunError>,
}

/// The part of a plane that a tile writes: its words, and doubles if the plane has them.
pub(super) struct Piece<'a> {
    pub(super) words: PlaneArea<'a, u32>,
    pub(super) wide: PlaneArea<'a, f64>,
}

/// A worker with its machines.
pub(super) struct Worker<'w, 'p, A: ArithmeticImpl> {
    work: &'w Work<'w, 'p>,
    machine: Machine<'w, A>,
    /// A machine for smaller batches, if there are any.
    narrow: Option<Box<Machine<'w, A>>>,
    /// How often the batch size was halved.
    level: u32,
    row: Row,
    /// The planes of a tile that is only looked at.
    own: Vec<Vec<u32>>,
}

/// Buffers for the words of a batch in the order of its points.
#[derive(Default)]
struct Row {
    words: Vec<u32>,
    wide: Vec<f64>,
    /// The weights of the current closure output: an array for each of its planes.
    weights: Vec<u32>,
}

/// The current tile of a worker.
struct Running<'r> {
    area: &'r Area,
    part: Vec<Piece<'r>>,
    tile: Tile,
}

impl<'w, 'p, A: ArithmeticImpl> Worker<'w, 'p, A> {
    /// A new worker.
    pub(super) fn new(work: &'w Work<'w, 'p>) -> Self {
        let machine = machine(work, work.batch);
        Worker { work, machine, narrow: None, level: 0, row: Row::default(), own: Vec::new() }
    }

    /// Runs tiles until there are none left.
    pub(super) fn run(mut self) {
        let work = self.work;
        loop {
            let next = {
                let mut open = work.open.lock().unwrap_or_else(PoisonError::into_inner);
                let next = open.next();
                if let Some((index, _)) = &next {
                    work.started.store(*index, Ordering::Relaxed);
                }
                next
            };
            let next = next.filter(|(index, _)| *index <= work.last.load(Ordering::Relaxed));
            let Some((index, (area, part))) = next else { return };
            let tile = self.tile(index, area, part);
            work.results.lock().unwrap_or_else(PoisonError::into_inner).push((index, tile));
        }
    }

    fn tile<'r>(&mut self, index: usize, area: &'r Area, part: Vec<Piece<'r>>) -> Tile {
        let Some(look) = self.work.look else { return self.shade(index, area, part) };
        let mut own = std::mem::take(&mut self.own);
        own.resize_with(self.work.planes(), Vec::new);
        own.iter_mut().for_each(|words| words.resize(area.points.len(), 0));
        let piece = |words| Piece { words: PlaneArea::of(words), wide: PlaneArea::default() };
        let tile = self.shade(index, area, own.iter_mut().map(|words| piece(words)).collect());
        if tile.stop.is_none() {
            look(index, &own.iter().map(|words| &words[..]).collect::<Vec<_>>());
        }
        self.own = own;
        tile
    }

    fn shade<'r>(&mut self, index: usize, area: &'r Area, part: Vec<Piece<'r>>) -> Tile {
        let work = self.work;
        // Other points may cost less.
        self.level = self.level.saturating_sub(1);
        let points = area.points.clone();
        let columns = || Columns::new(work.run.program.closures.clone());
        let closures = work.slots.closures.iter().map(|_| columns()).collect();
        let tile = Tile { closures, ..Tile::default() };
        self.machine.profile =
            work.run.options.profile.map(|clock| Box::new(Profile::new(work.run.program, clock)));
        let mut running = Running { area, part, tile };
        let mut at = points.start;
        while at < points.end && index <= work.last.load(Ordering::Relaxed) {
            let here = work.batch.min(points.end - at);
            if let Err(stop) = self.batch(&mut running, at, here) {
                running.tile.stop = Some(stop);
                work.last.fetch_min(index, Ordering::Relaxed);
                break;
            }
            at += here;
            if self.is_full(&running.tile) {
                break;
            }
        }
        if running.tile.stop.is_none() {
            (work.progress)(work.run.done.fetch_add(points.len(), Ordering::Relaxed) + points.len());
        }
        running.tile.messages = self.machine.messages.take();
        running.tile.profile = self.machine.profile.take();
        running.tile
    }

    /// Whether a single tile exceeds what the whole run may keep.
    fn is_full(&self, tile: &Tile) -> bool {
        let running = &self.work.run.options.limits.running;
        tile.bytes.printed > running.printed_bytes || tile.bytes.closures > running.closure_bytes
    }

    /// Number of points in a batch at the current level, and whether the cost of each is counted separately:
    /// every level has half the points of the previous one, down to a line of them.
    fn size(&self) -> (usize, bool) {
        let mut size = self.work.batch;
        for _ in 0..self.level {
            if size <= LINE {
                return (size, true);
            }
            size = (size / 2).next_multiple_of(LINE);
        }
        (size, false)
    }

    /// Runs some points together or, if that exceeds a limit, in smaller batches, finally one by one.
    fn batch(&mut self, running: &mut Running<'_>, first: usize, count: usize) -> Result<(), RunError> {
        let (size, each) = self.size();
        if count > size {
            return (0..count)
                .step_by(size)
                .try_for_each(|at| self.batch(running, first + at, size.min(count - at)));
        }
        match self.together(running, first, count, each) {
            Err(RunError::TooManySteps { .. } | RunError::TooMuchMemory { .. }) if count > 1 => {
                if each {
                    return (0..count).try_for_each(|at| self.together(running, first + at, 1, false));
                }
                self.level += 1;
                while matches!(self.size(), (size, false) if size >= count) {
                    self.level += 1;
                }
                self.batch(running, first, count)
            }
            result => result,
        }
    }

    /// Runs some points together, and copies their results.
    fn together(
        &mut self,
        running: &mut Running<'_>,
        first: usize,
        count: usize,
        each: bool,
    ) -> Result<(), RunError> {
        let work = self.work;
        let width = self.size().0.max(LINE);
        if self.machine.width() <= width {
            return advance(&mut self.machine, work, running, &mut self.row, (first, count, each));
        }
        if self.narrow.as_ref().is_some_and(|narrow| narrow.width() != width) {
            self.narrow = None;
        }
        let narrow = self.narrow.get_or_insert_with(|| Box::new(machine(work, width)));
        let exchange = |a: &mut Machine<'w, A>, b: &mut Machine<'w, A>| {
            std::mem::swap(&mut a.messages, &mut b.messages);
            std::mem::swap(&mut a.profile, &mut b.profile);
        };
        exchange(&mut self.machine, narrow);
        let result = advance(narrow, work, running, &mut self.row, (first, count, each));
        exchange(&mut self.machine, narrow);
        result
    }
}

/// A machine for batches of a size.
fn machine<'w, A: ArithmeticImpl>(work: &'w Work<'w, '_>, batch: usize) -> Machine<'w, A> {
    let run = work.run;
    Machine::new(run.program, run.services, run.source, batch, run.options, &run.documents)
}

/// Runs some points on a machine, and copies their results.
fn advance<A: ArithmeticImpl>(
    machine: &mut Machine<'_, A>,
    work: &Work<'_, '_>,
    running: &mut Running<'_>,
    row: &mut Row,
    (first, count, each): (usize, usize, bool),
) -> Result<(), RunError> {
    let each = each || work.run.options.steps;
    let printed = match machine.run(first, count, each) {
        Ok(()) => machine.messages.printed_bytes(),
        Err(stop) => {
            machine.messages.roll_back();
            return Err(stop);
        }
    };
    if printed > 0 {
        running.tile.bytes.printed += printed;
        if !work.run.print(printed) {
            // One of the tiles up to the last one taken is the one that exceeds the limit.
            work.last.fetch_min(work.started.load(Ordering::Relaxed), Ordering::Relaxed);
            machine.messages.drop_printed();
        }
    }
    deliver(machine, work, running, row, (first, count));
    for (index, slot) in work.slots.closures.iter().enumerate() {
        let mut numbers = vec![0; count];
        machine.output((slot.output, slot.element, 0), &mut numbers, &mut []);
        let Some(found) = running.tile.closures.get_mut(index) else { continue };
        for number in numbers {
            let bytes = machine.keep_closure(number, found);
            running.tile.bytes.closures += bytes;
            if !work.run.keep(bytes) {
                *found = Columns::default();
                work.last.fetch_min(work.started.load(Ordering::Relaxed), Ordering::Relaxed);
                break;
            }
        }
    }
    Ok(())
}

/// Copies the outputs of the points that a machine has run.
fn deliver<A: ArithmeticImpl>(
    machine: &Machine<'_, A>,
    work: &Work<'_, '_>,
    running: &mut Running<'_>,
    row: &mut Row,
    (first, count): (usize, usize),
) {
    let at = first - running.area.points.start;
    // Who only looks at values does not need them in rows.
    let blocks = work.run.source.blocks().filter(|_| work.look.is_none());
    for (Slot { output, element, component }, piece) in work.slots.planes.iter().zip(&mut running.part) {
        let slot = (*output, *element, *component);
        let plan = work.run.program.outputs.get(*output);
        let is_closure = plan.is_some_and(|plan| plan.kind == Kind::Closure);
        if is_closure && *component == 0 {
            machine.weights((*output, *element), count, &mut row.weights);
        }
        let weights = row.weights.get(component * count..).and_then(|words| words.get(..count));
        let read = |words: &mut [u32], wide: &mut [f64]| match weights.filter(|_| is_closure) {
            Some(weights) => {
                words.copy_from_slice(weights);
                wide.iter_mut().zip(weights).for_each(|(to, word)| *to = f32::from_bits(*word).into());
            }
            None => machine.output(slot, words, wide),
        };
        match blocks {
            Some(blocks) => {
                row.words.resize(count, 0);
                row.wide.resize(if piece.wide.is_empty() { 0 } else { count }, 0.0);
                read(&mut row.words, &mut row.wide);
                blocks.scatter(first, &row.words, running.area, &mut piece.words);
                blocks.scatter(first, &row.wide, running.area, &mut piece.wide);
            }
            None => {
                let wide = piece.wide.after(at).and_then(|wide| wide.get_mut(..count)).unwrap_or_default();
                if let Some(out) = piece.words.after(at).and_then(|words| words.get_mut(..count)) {
                    read(out, wide);
                }
            }
        }
    }
    // The plane with the steps comes after those of the outputs.
    if let Some(piece) = running.part.get_mut(work.slots.planes.len()).filter(|_| work.run.options.steps) {
        row.words.clear();
        row.words.extend((0..count).map(|lane| machine.spent(lane)));
        match blocks {
            Some(blocks) => blocks.scatter(first, &row.words, running.area, &mut piece.words),
            None => {
                if let Some(out) = piece.words.after(at).and_then(|words| words.get_mut(..count)) {
                    out.copy_from_slice(&row.words);
                }
            }
        }
    }
}
