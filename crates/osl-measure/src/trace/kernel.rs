//! Calls that need more than a lane's arithmetic, for one point: noise fields and matrices between named
//! spaces are evaluated in both arithmetics; all other kernels run in the interpreter, as a program with that
//! one call.

use super::{Exact, Node, NodeId, OnePoint, What};
use osl_exec::{Arithmetic, Frame, Program, RunOptions, Services, noise_kind};
use osl_ir::ir::{
    Body, Builder, Const, Kernel, Kind, LaneOp, NoiseField, Output, Shape, Sink, SlotId, Source, ValueId,
};
use osl_ir::types::{Base, Extent, Type};
use osl_limits::Limits;
use osl_simd::Isa;
use std::cell::Cell;

/// A call of a noise field.
pub(crate) struct NoiseCall {
    pub(crate) field: osl_noise::Kind,
    pub(crate) dims: usize,
    pub(crate) has_derivs: bool,
    /// Number of arguments before the coordinates.
    pub(crate) skip: usize,
}

impl NoiseCall {
    /// The noise call of a kernel with these arguments, if it is one.
    pub(crate) fn of(kernel: &Kernel, args: &[Const]) -> Option<NoiseCall> {
        let (field, dims, has_derivs, skip) = match kernel {
            Kernel::Noise { field, dims, has_derivs, .. } => (*field, *dims, *has_derivs, 0),
            Kernel::NamedNoise { dims, periodic, options, has_derivs, .. } if options.is_empty() => {
                let Some(Const::Str(name)) = args.first() else { return None };
                (NoiseField::from_name(name, *periodic)?, *dims, *has_derivs, 1)
            }
            _ => return None,
        };
        Some(NoiseCall { field: noise_kind(field), dims: usize::from(dims), has_derivs, skip })
    }

    /// Its results in the strict arithmetic.
    pub(crate) fn strict(&self, args: &[Const], kinds: &[Kind]) -> Vec<Const> {
        let inputs: Vec<f32> = args.iter().skip(self.skip).flat_map(numbers).collect();
        let out = self.eval(&inputs, kinds).map(|x: f32| if x.is_nan() { f32::NAN } else { x });
        split(kinds, |at, kind| of_numbers(kind, &out[at..]))
    }

    /// Its results in double precision.
    pub(super) fn exact(&self, args: &[Exact], kinds: &[Kind]) -> Vec<Exact> {
        let inputs: Vec<f64> = args.iter().skip(self.skip).flat_map(Exact::numbers).collect();
        let out: [f64; 9] = self.eval(&inputs, kinds);
        split(kinds, |at, kind| Exact::of_numbers(kind, &out[at..]))
    }

    /// The words of the results. The inputs are the coordinates, the periods if any, then the derivatives of
    /// the coordinates.
    fn eval<T: osl_noise::BatchFloat + Default>(&self, inputs: &[T], kinds: &[Kind]) -> [T; 9] {
        let inputs: Vec<&[T]> = inputs.iter().map(std::slice::from_ref).collect();
        let count = if self.has_derivs { 2 * self.dims } else { 0 };
        let (plain, derivs) = inputs.split_at(inputs.len().saturating_sub(count));
        let (coords, periods) = plain.split_at(self.dims.min(plain.len()));
        let duals = [coords, derivs].concat();
        let mut out = [T::default(); 9];
        let [a, b, c, d, e, f, g, h, i] = out.each_mut().map(std::slice::from_mut);
        let (isa, field) = (Isa::detect(), self.field);
        let three = kinds.first() == Some(&Kind::Triple);
        match (self.has_derivs, three, periods.is_empty()) {
            (false, false, true) => osl_noise::eval(isa, field, coords, a),
            (false, false, false) => osl_noise::eval_periodic(isa, field, coords, periods, a),
            (false, true, true) => osl_noise::eval3(isa, field, coords, [a, b, c]),
            (false, true, false) => osl_noise::eval3_periodic(isa, field, coords, periods, [a, b, c]),
            (true, false, _) => osl_noise::eval_dual(isa, field, &duals, periods, [a, b, c]),
            (true, true, _) => {
                osl_noise::eval3_dual(isa, field, &duals, periods, [a, b, c, d, e, f, g, h, i]);
            }
        }
        out
    }
}

fn split<T>(kinds: &[Kind], of: impl Fn(usize, Kind) -> T) -> Vec<T> {
    let mut at = 0;
    let mut next = |kind: &Kind| {
        let value = of(at, *kind);
        at += kind.words() as usize;
        value
    };
    kinds.iter().map(&mut next).collect()
}

/// The floats of a value.
fn numbers(value: &Const) -> Vec<f32> {
    match value {
        Const::Int(n) => vec![*n as f32],
        Const::Float(x) => vec![*x],
        Const::Triple(t) => t.to_vec(),
        Const::Matrix(m) => m.to_vec(),
        Const::Str(_) | Const::Null => Vec::new(),
    }
}

fn of_numbers(kind: Kind, numbers: &[f32]) -> Const {
    let at = |i: usize| numbers.get(i).copied().unwrap_or(0.0);
    match kind {
        Kind::Int => Const::Int(at(0) as i32),
        Kind::Float => Const::Float(at(0)),
        Kind::Triple => Const::Triple([at(0), at(1), at(2)]),
        Kind::Matrix => Const::Matrix(Box::new(std::array::from_fn(at))),
        Kind::Str | Kind::Closure => Const::zero(kind),
    }
}

/// The language's type for values of a kind.
fn type_of(kind: Kind, len: Option<u32>) -> Type {
    let base = match kind {
        Kind::Int => Base::Int,
        Kind::Float => Base::Float,
        Kind::Triple => Base::Vector,
        Kind::Matrix => Base::Matrix,
        Kind::Str => Base::String,
        Kind::Closure => Base::Closure,
    };
    Type { base, extent: len.map_or(Extent::One, Extent::Array) }
}

/// Steps per call, since following one point calls kernels many times. This is a property of tracing, not a
/// limit to set: `running.trace` bounds the number of calls.
const STEPS: u64 = 1 << 15;
/// Calls of a trace that may take as many steps as a whole run, such as those of regular expressions.
const LARGE_CALLS: u32 = 64;

/// The arguments of a kernel that are closures: they have no values, so the program for a call makes them
/// again.
#[derive(Clone, Copy)]
pub(super) struct Closures<'a> {
    pub(super) nodes: &'a [Node],
    /// The node of each argument that is a closure.
    pub(super) args: &'a [Option<NodeId>],
}

/// The most parts of a closure that is made again; others are left out.
const MAX_PARTS: usize = 1_000;
/// The largest depth of a closure that is made again.
const MAX_DEPTH: usize = 100;

impl Closures<'_> {
    fn argument(self, b: &mut Builder, at: usize, value: &Const) -> ValueId {
        match self.args.get(at) {
            Some(Some(id)) => self.make(b, *id, MAX_DEPTH, &mut 0),
            _ => b.constant(value.clone()),
        }
    }

    fn make(self, b: &mut Builder, id: NodeId, depth: usize, parts: &mut usize) -> ValueId {
        *parts += 1;
        let node = self.nodes.get(id as usize).filter(|_| depth > 0 && *parts < MAX_PARTS);
        let Some(node) = node else { return b.constant(Const::Null) };
        if !matches!(node.exact, Some(Exact::Closure(_))) {
            return b.constant(node.strict.clone().unwrap_or(Const::Null));
        }
        let mut one = |b: &mut Builder, id: NodeId| self.make(b, id, depth - 1, parts);
        match (&node.what, &node.args[..]) {
            (What::Kernel(kernel, _), args) => {
                let args: Vec<ValueId> = args.iter().map(|id| one(b, *id)).collect();
                b.kernel(Kernel::clone(kernel), &args, Kind::Closure)
            }
            (What::Lane(LaneOp::KChoose), [cond, yes, no]) => {
                let cond = self.nodes.get(*cond as usize).and_then(|node| node.strict.as_ref());
                let truth = matches!(cond, Some(Const::Int(n)) if *n != 0);
                one(b, if truth { *yes } else { *no })
            }
            (What::Element, [.., value]) | (What::Meet, [.., value, _]) => one(b, *value),
            _ => b.constant(Const::Null),
        }
    }
}

/// The results of one call with known arguments that are no closures; `array` is the array that it reads.
/// `None` if the call does not end within its steps.
pub(crate) fn run_call(
    (services, point, limits): (&Services, OnePoint<'_>, &Limits),
    kernel: &Kernel,
    args: &[Const],
    kinds: &[Kind],
    array: &[Const],
    body: &Body,
) -> Option<Vec<Const>> {
    let kernels = Kernels::new(services, point, limits);
    let closures = Closures { nodes: &[], args: &[] };
    let (values, _) = kernels.run(kernel, (args, closures), kinds, array, body);
    (!kernels.stopped.get()).then_some(values)
}

/// Runs kernels for a point.
pub(super) struct Kernels<'a> {
    pub(super) services: &'a Services,
    pub(super) point: OnePoint<'a>,
    pub(super) limits: &'a Limits,
    /// The large calls that are left.
    pub(super) large: Cell<u32>,
    /// Whether a call did not end, so that its results are unknown.
    pub(super) stopped: Cell<bool>,
    /// Whether a call reported an error or warning since this was last asked.
    pub(super) reported: Cell<bool>,
}

impl<'a> Kernels<'a> {
    pub(super) fn new(services: &'a Services, point: OnePoint<'a>, limits: &'a Limits) -> Kernels<'a> {
        let (stopped, reported) = (false.into(), false.into());
        Kernels { services, point, limits, large: LARGE_CALLS.into(), stopped, reported }
    }

    /// The results of a kernel, and the array that it leaves behind; `given` is the array that it reads.
    /// Messages found by name at run time and dictionary nodes do not outlast a call.
    pub(super) fn run(
        &self,
        kernel: &Kernel,
        (args, closures): (&[Const], Closures<'_>),
        kinds: &[Kind],
        given: &[Const],
        body: &Body,
    ) -> (Vec<Const>, Vec<Const>) {
        let zeros: Vec<Const> = kinds.iter().map(|k| Const::zero(*k)).collect();
        if matches!(kernel, Kernel::Print { .. } | Kernel::SetMessage(_) | Kernel::Report { .. }) {
            return (zeros, Vec::new());
        }
        let mut b = Builder::new("call".into());
        let mut kernel = kernel.clone();
        let (reads, writes) = (kernel.reads(), kernel.writes());
        let mut own = |b: &mut Builder, slot: Option<SlotId>, is_filled: bool| {
            let (slot, copy) = (slot?, copy_slot(b, body, slot?));
            for (index, value) in given.iter().enumerate().filter(|_| is_filled) {
                let (index, value) = (b.int(index as i32), b.constant(value.clone()));
                b.store_element(copy, index, value);
            }
            redirect(&mut kernel, slot, copy);
            Some(copy)
        };
        own(&mut b, reads, true);
        // What the call does not write keeps its value.
        let written = own(&mut b, writes, reads.is_none());
        let args: Vec<_> =
            args.iter().enumerate().map(|(at, value)| closures.argument(&mut b, at, value)).collect();
        let results = b.kernel_of(kernel, &args, kinds);
        outputs(&mut b, &results, kinds, written);
        let slot = written.map(|slot| b.body.slot(slot).clone());
        // No passes run: there are no scalar slots, everything is varying already, and derivatives were
        // written out earlier.
        let program = Program::new(&b.body);
        let Some(frame) = self.frame(&program) else {
            self.stopped.set(true);
            return (zeros, Vec::new());
        };
        self.reported.set(self.reported.get() || !frame.messages.is_empty());
        let mut planes = frame.planes.iter().map(|p| p.words.first().copied().unwrap_or(0));
        let mut printed = frame.printed.iter().map(|p| p.text.clone());
        let mut next = |kind: Kind| match kind {
            Kind::Int => Const::Int(planes.next().unwrap_or(0).cast_signed()),
            Kind::Str => Const::Str(printed.next().unwrap_or_default().into()),
            Kind::Closure => Const::Null,
            _ => {
                let words: Vec<f32> =
                    planes.by_ref().take(kind.words() as usize).map(f32::from_bits).collect();
                of_numbers(kind, &words)
            }
        };
        let values = kinds.iter().map(|k| next(*k)).collect();
        let elements =
            slot.map_or_else(Vec::new, |s| (0..s.len.unwrap_or(0)).map(|_| next(s.kind)).collect());
        (values, elements)
    }

    /// The matrix between named spaces in double precision; `None` for other kernels. Its arguments have no
    /// digits, so that a run in double precision is as exact as the rest of the trace.
    pub(super) fn exact_matrix(&self, kernel: &Kernel, names: &[Const]) -> Option<Vec<Exact>> {
        let Kernel::SpaceMatrix { .. } = kernel else { return None };
        let mut b = Builder::new("call".into());
        let names: Vec<_> = names.iter().map(|name| b.constant(name.clone())).collect();
        let matrix = b.kernel(kernel.clone(), &names, Kind::Matrix);
        let source = Source::Value(matrix);
        b.body.outputs.push(Output { name: "r".into(), ty: type_of(Kind::Matrix, None), source });
        b.body.assumptions.arithmetic = Arithmetic::Double;
        let frame = self.frame(&Program::new(&b.body))?;
        let numbers: Vec<f64> = frame.planes.iter().filter_map(|p| p.doubles().first().copied()).collect();
        Some(vec![Exact::of_numbers(Kind::Matrix, &numbers)])
    }

    /// Runs the program of a call; `None` if it does not end within its steps.
    fn frame(&self, program: &Program) -> Option<Frame> {
        let run = |steps: u64| {
            let mut options = RunOptions { limits: self.limits.clone(), ..RunOptions::default() };
            options.limits.running.point_steps = options.limits.running.point_steps.min(steps);
            osl_exec::run(program, self.services, &self.point, &options, &|_| ()).ok()
        };
        run(STEPS).or_else(|| {
            self.large.set(self.large.get().checked_sub(1)?);
            run(u64::MAX)
        })
    }
}

/// Makes the results of a call, and the array that it writes, outputs of its program. Strings are printed.
fn outputs(b: &mut Builder, results: &[ValueId], kinds: &[Kind], written: Option<SlotId>) {
    for (index, (value, kind)) in results.iter().zip(kinds).enumerate() {
        if *kind == Kind::Str {
            print(b, *value);
        }
        let (name, ty) = (format!("r{index}").into(), type_of(*kind, None));
        b.body.outputs.push(Output { name, ty, source: Source::Value(*value) });
    }
    let Some(slot) = written else { return };
    let (kind, len) = (b.body.slot(slot).kind, b.body.slot(slot).len);
    if kind == Kind::Str {
        for index in 0..len.unwrap_or(0) {
            let index = b.int(index as i32);
            let element = b.load_element(slot, index);
            print(b, element);
        }
    } else {
        let output = Output { name: "array".into(), ty: type_of(kind, len), source: Source::Slot(slot) };
        b.body.outputs.push(output);
    }
}

/// Prints a string: a frame has no planes for strings.
fn print(b: &mut Builder, value: ValueId) {
    let format = b.constant(Const::Str("%s".into()));
    let shapes = vec![Shape { kind: Kind::Str, count: 1, key: None }];
    b.kernel_of(Kernel::Print { sink: Sink::Print, shapes }, &[format, value], &[]);
}

fn copy_slot(b: &mut Builder, body: &Body, slot: SlotId) -> SlotId {
    let slot = body.slot(slot);
    b.slot(slot.kind, slot.len, slot.name.clone())
}

/// Makes a kernel use another array.
fn redirect(kernel: &mut Kernel, from: SlotId, to: SlotId) {
    let place = match kernel {
        Kernel::Split { pieces } => Some(pieces),
        Kernel::Regex { places: Some(places), .. } => Some(places),
        Kernel::SplineInverse { knots, .. } => Some(knots),
        Kernel::SetMessage(form) | Kernel::GetMessage(form) => form.array.as_mut(),
        _ => None,
    };
    if let Some(place) = place.filter(|p| **p == from) {
        *place = to;
    }
}

/// One result of a noise kernel in double precision; `None` if the kernel is not a noise.
pub fn noise(kernel: &Kernel, args: &[Exact], result: usize) -> Option<Exact> {
    let rounded: Vec<Const> = args.iter().map(Exact::round).collect();
    let call = NoiseCall::of(kernel, &rounded)?;
    let (triple, has_derivs) = match kernel {
        Kernel::Noise { triple, has_derivs, .. } | Kernel::NamedNoise { triple, has_derivs, .. } => {
            (*triple, *has_derivs)
        }
        _ => return None,
    };
    let kind = if triple { Kind::Triple } else { Kind::Float };
    let kinds = vec![kind; if has_derivs { 3 } else { 1 }];
    call.exact(args, &kinds).into_iter().nth(result)
}
