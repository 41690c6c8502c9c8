//! The examined shader with its points; it can be run in both arithmetics at other settings.

use crate::trace::{self, Alone, OnePoint, Trace};
use crate::words;
use osl::stages;
use osl_exec::{Arithmetic, Datum, PointSource, RunError, RunOptions, Services};
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Body};
use osl_ir::passes;
use osl_limits::Limits;
use osl_scene::Grid;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The points of a grid with another footprint for derivatives.
#[derive(Clone, Debug)]
pub struct Swept {
    /// The points.
    pub grid: Grid,
    /// Factor on the change from pixel to pixel.
    pub footprint: f32,
}

impl PointSource for Swept {
    fn count(&self) -> usize {
        self.grid.count()
    }
    fn blocks(&self) -> Option<osl_exec::Blocks> {
        self.grid.blocks()
    }
    fn varying(&self) -> &[Global] {
        self.grid.varying()
    }
    fn uniform(&self, global: Global) -> [f32; 3] {
        self.grid.uniform(global)
    }
    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        self.grid.deriv(global, axis).map(|x| x * self.footprint)
    }
    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        self.grid.fill(global, first, width, lanes);
    }
    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        self.grid.attribute(object, name, element, point)
    }
}

/// A shader for some parameter values, ready to run.
pub struct Base {
    /// The programs.
    pub(super) programs: Programs,
    noted: Body,
    /// The number of values of the noted body before derivatives were written.
    pub(super) written: usize,
    /// Whether the shader uses derivatives.
    pub differentiates: bool,
    outputs: Option<Vec<Arc<str>>>,
    /// What is not examined, in words.
    pub(super) left_out: Vec<String>,
}

impl Base {
    /// A lowered body, without notes and with them.
    pub fn new(plain: Body, mut noted: Body, outputs: Option<Vec<Arc<str>>>, limits: &Limits) -> Base {
        let (programs, differentiates) = Programs::new(plain, outputs.as_deref(), limits);
        let asked = outputs.clone();
        let left_out = if asked.is_none() { words::left_out(&noted) } else { Vec::new() };
        let mut outputs = outputs;
        passes::closures_as_numbers(&mut noted, outputs.as_mut());
        let options = options(outputs.as_deref(), limits);
        passes::apply(&mut noted, passes::Pass::Ssa, &options);
        let written = noted.values.len();
        let mut noted = trace::prepare(noted, &options.varying, &options.derivs, limits);
        if let Some(wanted) = &outputs {
            noted.outputs.retain(|o| wanted.contains(&o.name));
        }
        Base { programs, noted, written, differentiates, outputs: asked, left_out }
    }

    /// The programs of another body with the same outputs.
    pub(super) fn programs_of(&self, plain: Body, limits: &Limits) -> Programs {
        Programs::new(plain, self.outputs.as_deref(), limits).0
    }

    /// Another body with the same outputs, without notes and with them.
    pub(super) fn again(&self, plain: Body, noted: Body, limits: &Limits) -> Base {
        Base::new(plain, noted, self.outputs.clone(), limits)
    }
}

fn options(outputs: Option<&[Arc<str>]>, limits: &Limits) -> passes::Options {
    let grid = Grid::new(2, 2);
    passes::Options {
        outputs: outputs.map(<[Arc<str>]>::to_vec),
        varying: grid.varying().to_vec(),
        derivs: grid.varying_derivs().to_vec(),
        limits: limits.clone(),
        ..passes::Options::default()
    }
}

/// A program in both arithmetics.
pub(super) struct Programs {
    pub(super) strict: osl_exec::Program,
    pub(super) exact: osl_exec::Program,
    /// The cost of the strict one, in additions.
    pub(super) cost: f64,
}

impl Programs {
    /// The programs of a lowered body, and whether it uses derivatives.
    fn new(mut plain: Body, outputs: Option<&[Arc<str>]>, limits: &Limits) -> (Programs, bool) {
        let mut outputs = outputs.map(<[Arc<str>]>::to_vec);
        passes::closures_as_numbers(&mut plain, outputs.as_mut());
        let options = options(outputs.as_deref(), limits);
        let strict = stages::finish(plain.clone(), &options);
        let double = passes::Options { arithmetic: Arithmetic::Double, ..options };
        let exact = stages::finish(plain, &double).program;
        let mut insts = strict.body.insts();
        let differentiates = insts.any(|i| matches!(i.op, osl_ir::ir::Op::GlobalDeriv(..)));
        let cost = crate::cost::cost(&strict.body);
        (Programs { strict: strict.program, exact, cost }, differentiates)
    }
}

/// The results of both arithmetics for some points: for each component of each output, one value per point.
#[derive(Clone, Debug, Default)]
pub struct Planes {
    /// Output and component, as `name` or `name.0`.
    pub names: Vec<String>,
    /// The strict values.
    pub strict: Vec<Vec<f64>>,
    /// The values in double precision.
    pub exact: Vec<Vec<f64>>,
}

/// Instructions of a point from which on it takes long.
const LONG: u64 = 4096;

/// A shader under examination.
pub struct Subject<'a> {
    /// Files and spaces.
    pub services: &'a Services,
    /// Budgets for running points and for following them.
    pub limits: &'a Limits,
    /// The shader with the given parameter values.
    pub base: Base,
    /// Number of instructions followed so far, and of points.
    followed: [AtomicU64; 2],
}

impl<'a> Subject<'a> {
    /// A shader with the given parameter values, before any examination.
    pub fn new(services: &'a Services, base: Base, limits: &'a Limits) -> Subject<'a> {
        Subject { services, base, limits, followed: [AtomicU64::new(0), AtomicU64::new(0)] }
    }

    /// Runs points in both arithmetics. `tries` means that this is one of many settings, with a smaller
    /// budget per point.
    ///
    /// # Errors
    /// A budget of the run is used up.
    pub fn run(&self, base: &Base, points: &Swept, tries: bool) -> Result<Planes, RunError> {
        let strict = self.values(&base.programs.strict, points, tries)?;
        let exact = self.values(&base.programs.exact, points, tries)?;
        Ok(Planes { names: strict.0, strict: strict.1, exact: exact.1 })
    }

    /// Runs points with one program: the names of its planes, and their values.
    pub(super) fn values(
        &self,
        program: &osl_exec::Program,
        points: &Swept,
        tries: bool,
    ) -> Result<(Vec<String>, Vec<Vec<f64>>), RunError> {
        let mut limits = self.limits.clone();
        if tries {
            limits.running.point_steps = limits.running.point_steps.min(limits.running.tried_steps);
        }
        let options = RunOptions { limits, ..RunOptions::default() };
        let frame = osl_exec::run(program, self.services, points, &options, &|_| ())?;
        let name = |plane: &osl_exec::Plane| {
            let single = !plane.ty.base.is_triple() && plane.ty.base != osl_ir::types::Base::Matrix;
            if single { plane.output.to_string() } else { format!("{}.{}", plane.output, plane.component) }
        };
        Ok((frame.planes.iter().map(name).collect(), frame.planes.iter().map(|p| p.doubles()).collect()))
    }

    /// Whether a point takes long: it runs thousands of instructions.
    pub(super) fn is_long(&self) -> bool {
        let [nodes, points] = self.followed.each_ref().map(|count| count.load(Ordering::Relaxed));
        nodes > LONG * points.max(1)
    }

    /// Whether the time of the examination is over.
    pub(super) fn is_over(&self) -> bool {
        self.limits.halted().is_some()
    }

    /// Follows one point, given by column and row, until the budget for following is used up.
    pub fn follow(&self, base: &Base, points: &Swept, x: usize, y: usize) -> Option<Trace> {
        let running = &self.limits.running;
        let left = running.traces.saturating_sub(self.followed[0].load(Ordering::Relaxed));
        if left == 0 {
            return None;
        }
        let trace = self.watch(base, points, x, y)?;
        self.followed[0].fetch_add(trace.nodes.len() as u64, Ordering::Relaxed);
        self.followed[1].fetch_add(1, Ordering::Relaxed);
        Some(trace)
    }

    /// Follows one point without a budget.
    pub(super) fn watch(&self, base: &Base, points: &Swept, x: usize, y: usize) -> Option<Trace> {
        let point = OnePoint::at_pixel(points, points.grid.width, points.grid.height, x, y)?;
        let source = OnePoint { source: points, point };
        Some(trace::follow(&base.noted, self.services, source, self.limits))
    }

    /// Follows a point of the shader as given in double precision, where results are rounded up or down by
    /// chance. It does not count.
    pub(super) fn follow_doubled(&self, points: &Swept, (x, y): (usize, usize), run: u32) -> Option<Trace> {
        let point = OnePoint::at_pixel(points, points.grid.width, points.grid.height, x, y)?;
        let source = OnePoint { source: points, point };
        Some(trace::follow_alone(&self.base.noted, self.services, source, self.limits, Alone::Double(run)))
    }
}

/// Decimal digits that the strict value has lost, of those that single precision can hold: 0 if it is right,
/// 7.2 if no digit is right.
pub fn digits_lost(strict: f64, exact: f64) -> f64 {
    const ALL: f64 = 7.2;
    match crate::explain::digits(strict, exact) {
        None => 0.0,
        Some(digits) => (ALL - digits).clamp(0.0, ALL),
    }
}
