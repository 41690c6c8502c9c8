//! Running a program over all points, on all cores.
//!
//! The points are cut into tiles; each tile is a task with a machine of its own thread, and writes its own part of
//! each plane. Results do not depend on tile size, batch width, thread count or instruction set.

use crate::machine::{Machine, Stop};
use crate::message::{Message, Messages};
use crate::program::{OutputPlan, Program, words_of};
use crate::services::Services;
use crate::source::PointSource;
use osl_ir::ir::Kind;
use osl_ir::types::Type;
use osl_noise::Isa;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// How a program is run.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Points that one instruction covers; rounded up to a multiple of 16.
    pub batch: usize,
    /// Points of a task.
    pub tile: usize,
    /// The instruction set.
    pub isa: Isa,
    /// Rounds that the loops of a batch may take together.
    pub max_rounds: u64,
}

impl Default for RunOptions {
    fn default() -> Self {
        RunOptions { batch: 256, tile: 4096, isa: Isa::detect(), max_rounds: 1 << 24 }
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
    /// A word for each point, in order.
    pub words: Vec<u32>,
}

impl Plane {
    /// The values as floats; ints are converted.
    pub fn floats(&self) -> Vec<f32> {
        let convert = |w: &u32| if self.kind == Kind::Int { *w as i32 as f32 } else { f32::from_bits(*w) };
        self.words.iter().map(convert).collect()
    }
}

/// What a run yields.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// The planes, output by output.
    pub planes: Vec<Plane>,
    /// What the run has to say, each message once.
    pub messages: Vec<Message>,
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
    let count = source.count();
    let tile = options.tile.max(1);
    let mut slots: Vec<(usize, usize, usize)> = Vec::new();
    let mut planes = Vec::new();
    for (index, plan) in program.outputs.iter().enumerate() {
        for element in 0..plan.ty_len(program) {
            for component in 0..words_of(plan.kind) as usize {
                slots.push((index, element, component));
                planes.push(plane(plan, element, component, count));
            }
        }
    }
    let tiles = count.div_ceil(tile);
    let mut parts: Vec<Vec<&mut [u32]>> = (0..tiles).map(|_| Vec::with_capacity(planes.len())).collect();
    for plane in &mut planes {
        for (part, words) in parts.iter_mut().zip(plane.words.chunks_mut(tile)) {
            part.push(words);
        }
    }
    let done = AtomicUsize::new(0);
    let new = || Machine::new(program, services, options.isa, options.batch.min(tile), options.max_rounds);
    let results: Vec<Result<Messages, Stop>> = parts
        .into_par_iter()
        .enumerate()
        .map_init(new, |machine, (index, part)| {
            let points = tile.min(count - index * tile);
            run_tile(machine, program, source, index * tile, points, &slots, part, options.batch.max(1))?;
            progress(done.fetch_add(points, Ordering::Relaxed) + points);
            Ok(std::mem::take(&mut machine.messages))
        })
        .collect();
    let mut messages = Messages::default();
    for result in results {
        result?.into_list().into_iter().for_each(|m| messages.add(m));
    }
    Ok(Frame { planes, messages: messages.into_list() })
}

#[expect(clippy::too_many_arguments, reason = "one tile's share of everything")]
fn run_tile(
    machine: &mut Machine<'_>,
    program: &Program,
    source: &dyn PointSource,
    first: usize,
    points: usize,
    slots: &[(usize, usize, usize)],
    mut part: Vec<&mut [u32]>,
    batch: usize,
) -> Result<(), Stop> {
    let mut at = 0;
    while at < points {
        let here = batch.min(points - at);
        machine.run(source, first + at)?;
        for ((output, element, component), words) in slots.iter().zip(&mut part) {
            if let (Some(plan), Some(out)) = (program.outputs.get(*output), words.get_mut(at..at + here)) {
                machine.output(plan, *element, *component, out);
            }
        }
        at += here;
    }
    Ok(())
}

fn plane(plan: &OutputPlan, element: usize, component: usize, count: usize) -> Plane {
    let output =
        if plan.ty.is_array() { format!("{}[{element}]", plan.name).into() } else { plan.name.clone() };
    Plane { output, ty: plan.ty.element(), component, kind: plan.kind, words: vec![0; count] }
}
